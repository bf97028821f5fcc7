"""What is unusual in a Space and its steps. It may be meant; if a program does not do what it should, it may be why."""

import math
from collections.abc import Iterator
from typing import Final

import numpy as np
import pymunk

from sandbox.quantity import dot, tangent
from sandbox.space.contents import body_of, half_length, half_width, is_dynamic, may_collide, shape_words, solid_of
from sandbox.space.findings import Fault
from sandbox.space.recording import Numbers
from sandbox.space.steps import MOST, Evidence, by_key

SLOW_FALL: Final = 1.2  # s, for a body at rest to fall by its own length
SAME: Final = 0.02  # relative, of what stays the same
TURNED: Final = 1.0  # rad
LOST: Final = 0.05  # of its length, in a second, of what a body had gained
FEW: Final = 10  # steps
BORNE: Final = 0.5  # of a weight
ACROSS: Final = 0.3  # cosine of the angle between gravity and the normal of a wall
MIN_STEPS: Final = 30  # since the last push
KEPT_SPEED: Final = 0.8  # of its largest speed: slower in the end, something has slowed a body


def unusual(evidence: Evidence) -> Iterator[Fault]:
    """Yield what is unusual."""
    for track in _tracks(evidence):
        for find in (_pushes, _velocities, _turns, _clings, _coasts):
            yield from find(track)
    yield from _ghosts(evidence)
    yield from _fallen(evidence)


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

    old, new: (n,) BODY, as in a Step; step, contact_step: the numbers of the steps; changed: (n, 2) px/s, by the
    program before each step; force: (n,) kg px/s²; is_pushed: (n,); length: px, of its largest solid shape; gravity:
    (2,) px/s²; pull: its length.
    """

    def __init__(self, evidence: Evidence, body: pymunk.Body, rows: Numbers, at: Numbers) -> None:
        self.evidence, self.body, self.space, self.run = evidence, body, evidence.contents.space, evidence.run
        self.old, self.new = self.run.old[rows], self.run.new[rows]
        self.step = self.run.step[rows]
        contacts, step = evidence.sides
        self.contacts, self.contact_step = contacts[at], step[at]
        self.changed = self.old["velocity"] - self.run.was["velocity"][rows]
        self.force = np.hypot(*self.old["force"].T)
        self.is_pushed = (self.force > 0) | self.changed.any(axis=1)
        self.solid = solid_of(body)
        self.length = 2 * max([0.0, *map(half_length, self.solid)])
        self.gravity, self.pull = np.array(self.space.gravity), self.space.gravity.length

    def fault(self, rule: str, what: str) -> Fault:
        """Return a fault of the body."""
        return self.evidence.contents.fault(rule, self.body, what)


def _pushes(track: _Track) -> Iterator[Fault]:
    """Yield forces that act in single steps, or without effect; and a gravity that hardly acts."""
    acts, body, pull = (track.force > 0) | (track.old["torque"] != 0), track.body, track.pull
    if acts[:-1].any() and not (acts[1:] & acts[:-1]).any():
        yield track.fault("single-pushes", f"in {acts.sum()} of {len(acts)} steps")
    mean, way = track.old["force"].mean(axis=0), track.new["position"][-1] - track.old["position"][0]
    size, seconds = math.hypot(*mean), track.run.dt[track.step].sum()
    stays = way @ mean < LOST * track.length * seconds * size and not body.constraints
    falls = way @ track.gravity > 0 and track.force.max() < (1 - SAME) * body.mass * pull
    if size > MOST * track.force.max() and stays and (len(track.contacts) or falls):
        what = f"a force of {size:.3g} on a mass of {body.mass:.3g} is {size / body.mass:.3g} px/s²"
        yield track.fault("in-vain", f"{what}, and gravity {pull:.3g} px/s²")
    width = 2 * max(map(half_width, track.solid), default=0.0)
    if pull and (fall := math.sqrt(2 * width / pull)) > SLOW_FALL and not body._velocity_func:
        yield track.fault("slow-fall", f"takes {fall:.2g} s to fall by its own width, {width:.3g} px")


def _velocities(track: _Track) -> Iterator[Fault]:
    """Yield velocities that the program sets again and again, whatever a step did to them."""
    changed, velocity = track.changed, track.old["velocity"]
    is_same = velocity[1:] == velocity[:-1]
    lost = np.abs(changed)[1:] * is_same * (is_same.mean(axis=0) > MOST)
    count = int((lost > LOST * track.length).any(axis=1).sum())
    if count > FEW < track.evidence.contents.origins.driven.get(track.body, 0):
        what = f"before {count} of {len(changed)} steps; up to {lost.max():.3g} px/s are lost in one"
        yield track.fault("velocity-set", what)
    size, gain = np.hypot(*changed.T)[1:], np.hypot(*velocity[-1]) - np.hypot(*velocity[0])
    is_again = (size > 0) & (np.hypot(*np.diff(changed, axis=0).T) < SAME * size)
    if is_again.mean() > MOST and gain > size[is_again].sum() / 2:
        yield track.fault("adds-up", f"{np.median(size):.3g} px/s before {is_again.sum() + 1} of {len(changed)} steps")


def _turns(track: _Track) -> Iterator[Fault]:
    """Yield what contacts turn that the program drives, and balls that friction stops, as they cannot roll."""
    body, contacts, old = track.body, track.contacts, track.old
    if body.constraints or not len(contacts):
        return
    is_round = any(isinstance(shape, pymunk.Circle) for shape in track.solid)
    steers = old["torque"].any() or (old["spin"][1:] != track.new["spin"][:-1]).any() or old["spin"][0]
    if track.is_pushed.mean() > MOST and not is_round and not steers and (turn := np.ptp(old["angle"])) > TURNED:
        yield track.fault("tips", f"turned by {turn:.3g} rad")
    if is_round and math.isinf(body.moment) and contacts["tangential"].any() and not track.pull:
        yield track.fault("slides-not", f"friction {contacts['friction'].max():.3g} in a contact")


def _clings(track: _Track) -> Iterator[Fault]:
    """Yield bodies that the program presses against walls, on which friction holds them."""
    contacts, gravity, pull, run = track.contacts, track.gravity, track.pull, track.run
    is_upright = np.abs(dot(contacts["normal"], gravity)) < ACROSS * pull
    by_friction = -contacts["tangential"] * dot(tangent(contacts["normal"]), gravity) * is_upright
    weight = track.body.mass * pull
    borne = np.bincount(track.contact_step, by_friction, len(run.steps)) > BORNE * weight * pull * run.dt
    stays = np.abs(dot(track.new["velocity"], gravity)) < pull * track.length
    pressed = track.force * contacts["friction"].max(initial=0.0) > BORNE * weight
    held = stays & (pressed | track.changed.any(axis=1)) & borne[track.step]
    if pull and track.evidence.lasts(track.step[held]):
        yield track.fault("clings", f"in {held.sum()} steps")


def _coasts(track: _Track) -> Iterator[Fault]:
    """Yield bodies with friction that nothing slows down, as nothing touches them."""
    speed = np.hypot(*track.old["velocity"][~track.is_pushed].T)
    is_left = len(speed) > MIN_STEPS and not track.is_pushed[-MIN_STEPS:].any() and not len(track.contacts)
    acts = track.pull or track.body.constraints or track.body._velocity_func or track.space.damping < 1
    is_rough = any(shape.friction for shape in track.solid) and not any(shape.elasticity for shape in track.solid)
    if is_left and is_rough and not acts and 0 < speed.max() * KEPT_SPEED < speed[-1]:
        yield track.fault("friction-untouched", f"still goes at {speed[-1]:.3g} px/s, and never touched anything")


def _ghosts(evidence: Evidence) -> Iterator[Fault]:
    """Yield bodies that went through walls with which they do not collide, by their kinds or by a filter."""
    named: set[int] = set()
    for step, shape, wall, *_ in evidence.passages.ghosts:
        body = body_of(shape)
        is_held = any(body_of(wall) in (joint.a, joint.b) for joint in body.constraints)
        if body.id not in named and not is_held and not may_collide(shape, wall):
            named.add(body.id)
            why = "by a filter" if is_dynamic(body) else "as neither moves by forces"
            yield evidence.fault("ghosts", [body.id], step, f"through a {shape_words(wall)}, {why}")


def _fallen(evidence: Evidence) -> Iterator[Fault]:
    """Yield bodies that fall below all walls, and met nothing before."""
    gravity, contents, contacts = evidence.contents.space.gravity, evidence.contents, evidence.run.contacts
    boxes = [shape.bb for shape in contents.solid if not is_dynamic(body_of(shape))]
    corners = [gravity.dot((x, y)) for box in boxes for x in (box.left, box.right) for y in (box.bottom, box.top)]
    met = {*contacts["body_a"].tolist(), *contacts["body_b"].tolist()}
    for body in contents.bodies if corners and not evidence.passages.found else ():
        falls = gravity.dot(body.position) > max(corners) and gravity.dot(body.velocity) > 0
        if is_dynamic(body) and falls and body.id not in met and not body.constraints:
            yield contents.fault("falls-away", body, "is below all walls, and never touched anything")
