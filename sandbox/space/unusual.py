"""What is unusual in a Space and its steps. It may be meant; if a program does not do what it should, it may be why."""

import math
from collections import defaultdict
from collections.abc import Iterator
from typing import Final

import numpy as np
import pymunk

from sandbox.quantity import dot, tangent
from sandbox.space.contents import body_of, half_length, half_width, is_dynamic, shape_words, solid_of
from sandbox.space.findings import Fault
from sandbox.space.recording import Numbers
from sandbox.space.steps import MOST, Evidence, by_key

COARSE: Final = 0.1  # of its width, for collision_slop
VAIN: Final = 0.05  # of its length, in a second, that a pushed body moves
FEW: Final = 10  # steps
OFTEN: Final = 0.1  # of the steps
SAME: Final = 0.02  # relative, of what stays the same
TURNED: Final = 1.0  # rad
BORNE: Final = 0.5  # of a weight
ACROSS: Final = 0.3  # cosine of the angle between gravity and the normal of a wall
MIN_STEPS: Final = 30  # since the last push
KEPT_SPEED: Final = 0.8  # of its largest speed: slower in the end, something has slowed a body
Found = Iterator[tuple[str, str]]  # the keys of rules, and each fault in figures


def unusual(evidence: Evidence) -> dict[str, list[Fault]]:
    """Return what is unusual, by the keys of its rules."""
    faults: dict[str, list[Fault]] = defaultdict(list)
    for track in _tracks(evidence):
        for find in (_slop, _pushes, _velocities, _clings, _coasts):
            for rule, what in find(track):
                faults[rule].append(evidence.contents.fault(track.body, what))
    return faults | {"ghosts": [*_ghosts(evidence)]}


def _tracks(evidence: Evidence) -> Iterator["_Track"]:
    """Yield the bodies that move by forces, of more than a few steps."""
    (contacts, step), bodies, ids = evidence.sides, evidence.recording.bodies, evidence.run.old["id"]
    touching = {int(contacts["body_b"][rows[0]]): rows for rows in by_key(contacts["body_b"], step)}
    for rows in by_key(ids, evidence.run.step):
        body = bodies[int(ids[rows[0]])]
        if is_dynamic(body) and len(rows) > FEW:
            yield _Track(evidence, body, rows, touching.get(body.id, np.empty(0, np.intp)))


class _Track:
    """A body that moves by forces, in n steps of a run, and its contacts, as B of each.

    was, old, new: (n,) BODY, as in a Step; step, contact_step: the numbers of the steps; changed: (n, 2) px/s, by the
    program before each step; force: (n,) kg px/s²; is_pushed: (n,); turned: rad, between its smallest and largest
    angle; length, width: px, of its largest solid shape; gravity: (2,) px/s²; weight: kg px²/s⁴, of its mass times
    gravity, along gravity.
    """

    def __init__(self, evidence: Evidence, body: pymunk.Body, rows: Numbers, at: Numbers) -> None:
        self.evidence, self.body, self.space, self.run = evidence, body, evidence.contents.space, evidence.run
        self.was, self.old, self.new = (every[rows] for every in (self.run.was, self.run.old, self.run.new))
        self.step, self.dt = self.run.step[rows], self.run.dt[self.run.step[rows]]
        contacts, step = evidence.sides
        self.contacts, self.contact_step = contacts[at], step[at]
        self.changed = self.old["velocity"] - self.was["velocity"]
        self.force = np.hypot(*self.old["force"].T)
        self.is_pushed = (self.force > 0) | self.changed.any(axis=1)
        self.turned = float(np.ptp(self.new["angle"]))
        self.solid = solid_of(body)
        self.length, self.width = (2 * max([0.0, *map(half, self.solid)]) for half in (half_length, half_width))
        self.is_round = any(isinstance(shape, pymunk.Circle) for shape in self.solid)
        self.gravity = np.array(self.space.gravity)
        self.weight = body.mass * float(self.gravity @ self.gravity)


def _slop(track: _Track) -> Found:
    slop, width = track.space.collision_slop, track.width
    if slop > COARSE * width > 0 and len(track.contacts):
        yield "coarse-slop", f"is {width:.3g} wide, and collision_slop {slop:.3g}"


def _pushes(track: _Track) -> Found:
    """Yield what is unusual in the forces that the program gives."""
    body, force, torque, gravity = track.body, track.old["force"], track.old["torque"], track.gravity
    acts = (track.force > 0) | (torque != 0)
    if acts[:-1].any() and not (acts[1:] & acts[:-1]).any():
        yield "single-pushes", f"in {acts.sum()} of {len(acts)} steps"
    if (track.force > 0).mean() <= MOST:
        return
    way, extent = track.new["position"][-1] - track.old["position"][0], np.ptp(track.new["position"], axis=0)
    largest, up = track.force.max(), -(force @ gravity)
    stays = math.hypot(*extent) < VAIN * track.length * track.dt.sum() and len(track.contacts)
    falls = up.min() > 0 and up.max() < (1 - SAME) * track.weight and way @ gravity > 0
    if (stays and np.abs(torque).max() < SAME * largest * track.length) or falls:
        words = f"a force of {largest:.3g} on a mass of {body.mass:.3g}: {largest / body.mass:.3g} px/s²"
        yield "in-vain", f"{words}, and gravity {math.hypot(*gravity):.3g} px/s²"
    is_within = np.abs(torque).max() <= largest * track.length  # the point, of the body
    if is_within and not np.ptp(force, axis=0).any() and track.turned > TURNED and not track.is_round:
        yield "turns-not", f"a force of {largest:.3g}, while the body turned by {track.turned:.3g} rad"


def _velocities(track: _Track) -> Found:
    """Yield velocities that the program sets, and bodies that tip over while it drives them."""
    changed, velocity = track.changed, track.old["velocity"]
    is_same = velocity[1:] == velocity[:-1]
    lost = np.abs(changed)[1:] * is_same * (is_same.mean(axis=0) > MOST)
    count = int((lost > VAIN * track.length).any(axis=1).sum())
    if count > max(FEW, OFTEN * len(changed)) and track.evidence.contents.origins.driven.get(track.body, 0) > FEW:
        yield "velocity-set", f"before {count} of {len(changed)} steps; up to {lost.max():.3g} px/s are lost in one"
    is_steered = any((track.old[name] != track.was[name]).any() for name in ("angle", "spin"))
    steers = is_steered or track.old["torque"].any() or track.old["spin"][0]
    is_free = track.is_round or track.body.constraints or track.body._velocity_func or not len(track.contacts)
    if track.is_pushed.mean() > MOST and track.turned > TURNED and not (steers or is_free):
        yield "tips", f"turned by {track.turned:.3g} rad"


def _clings(track: _Track) -> Found:
    """Yield bodies that the program presses against walls, on which friction holds them."""
    contacts, gravity, run = track.contacts, track.gravity, track.run
    normal, pull = contacts["normal"], math.hypot(*track.gravity)
    is_upright = np.abs(dot(normal, gravity)) < ACROSS * pull
    by_friction = contacts["tangential"] * dot(tangent(normal), gravity) * is_upright
    borne = -np.bincount(track.contact_step, by_friction, len(run.steps)) > BORNE * track.weight * run.dt
    stays = np.abs(dot(track.new["velocity"], gravity)) < pull * track.length
    pressed = track.force * contacts["friction"].max(initial=0.0) > BORNE * track.body.mass * pull
    held = stays & (pressed | track.changed.any(axis=1)) & borne[track.step]
    if pull and track.evidence.lasts(track.step[held]):
        yield "clings", f"in {held.sum()} steps"


def _coasts(track: _Track) -> Found:
    """Yield bodies with friction that nothing slows down, as nothing touches them."""
    speed = np.hypot(*track.old["velocity"][~track.is_pushed].T)
    is_left = len(speed) > MIN_STEPS and not track.is_pushed[-MIN_STEPS:].any() and not len(track.contacts)
    acts = track.gravity.any() or track.body.constraints or track.body._velocity_func or track.space.damping < 1
    is_rough = any(shape.friction for shape in track.solid) and not any(shape.elasticity for shape in track.solid)
    if is_left and is_rough and not acts and 0 < speed.max() * KEPT_SPEED < speed[-1]:
        yield "friction-untouched", f"still goes at {speed[-1]:.3g} px/s, and never touched anything"


def _ghosts(evidence: Evidence) -> Iterator[Fault]:
    """Yield bodies that went through walls with which they do not collide, by their kinds or by a filter."""
    named: set[int] = set()
    for step, shape, wall, *_ in evidence.passages.ghosts:
        body = body_of(shape)
        is_held = any(body_of(wall) in (joint.a, joint.b) for joint in body.constraints)
        if body.id not in named and not is_held:
            named.add(body.id)
            why = "by a filter" if is_dynamic(body) else "as neither moves by forces"
            yield evidence.fault([body.id], step, f"through a {shape_words(wall)}, {why}")
