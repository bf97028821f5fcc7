"""What is unusual in a Space and its steps. It may be meant; if a program does not do what it should, it may be why."""

import dis
import math
from collections.abc import Iterator
from itertools import pairwise
from types import CodeType
from typing import Final

import numpy as np
import pymunk

from sandbox.quantity import dot, tangent
from sandbox.space.contents import Contents, body_of, end_of, half_length, half_width, is_dynamic, solid_of
from sandbox.space.findings import Fault
from sandbox.space.recording import Numbers
from sandbox.space.steps import LONGEST_STEP, MOST, Evidence, by_key

EARTH: Final = 9.0, 11.0  # px/s²: gravity in metres
PIXELS: Final = 15.0  # wider than this, bodies are hardly in metres
COARSE: Final = 0.1  # of its width, for collision_slop
SLOP: Final = 0.1  # px, of a new Space: for sizes in pixels
SAME: Final = 0.02  # relative, of what stays the same
SMALL: Final = 0.05  # of the steps; of a velocity; of a body's length, in a second
FEW: Final = 10  # steps
BORNE: Final = 0.5  # of a force or weight
MIN_STEPS: Final = 30  # since the last push
BOOLEAN: Final = {"COMPARE_OP", "CONTAINS_OP", "IS_OP", "UNARY_NOT"}  # Python's operations
KEPT_SPEED: Final = 0.8  # of its largest speed: slower in the end, something has slowed a body


def unusual(evidence: Evidence) -> Iterator[Fault]:
    """Yield what is unusual."""
    for track in _tracks(evidence):
        for find in (_sizes, _forces, _weak_force, _velocities, _cannot_roll, _clings, _coasts, _falls):
            yield from find(track)
    yield from _joints(evidence.contents)
    yield from _returned(evidence.contents)


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

    was, old, new: (n,) BODY, as in a Step; step: (n,) the numbers of the steps; at: the indices of contacts in these;
    changed: (n, 2) px/s, by the program before each step; is_pushed: (n,); length, width: px, of its largest solid
    shape; gravity: (2,) px/s² in the last step, and pull, its size; is_free: of joints and functions of the program.
    """

    def __init__(self, evidence: Evidence, body: pymunk.Body, rows: Numbers, at: Numbers) -> None:
        run, (contacts, step) = evidence.run, evidence.sides
        self.evidence, self.body, self.run, self.step = evidence, body, run, run.step[rows]
        self.was, self.old, self.new = (every[rows] for every in (run.was, run.old, run.new))
        at = at[np.isin(step[at], self.step)]  # not where the body was gone, and its shape left
        self.contacts, self.at = contacts[at], np.searchsorted(self.step, step[at])
        self.changed = self.old["velocity"] - self.was["velocity"]
        self.is_pushed = (self.old["force"] != 0).any(axis=1) | self.changed.any(axis=1)
        self.mass, self.moment = (float(self.old[key][-1]) for key in ("mass", "moment"))
        self.solid = solid_of(body)
        self.length, self.width = (2 * max([0.0, *map(half, self.solid)]) for half in (half_length, half_width))
        self.gravity = np.array(run.steps[self.step[-1]].gravity)
        self.pull = math.hypot(*self.gravity)
        self.is_free = not (body.constraints or self.old["is_own"].any())

    def fault(self, rule: str, what: str) -> Fault:
        """Return a fault of the body."""
        return self.evidence.contents.fault(rule, self.body, what)


def _sizes(track: _Track) -> Iterator[Fault]:
    slop, width, longest = track.evidence.contents.space.collision_slop, track.width, track.run.dt.max()
    is_default = slop >= SLOP and longest <= LONGEST_STEP and not track.gravity[0] and track.is_free
    if EARTH[0] < track.pull < EARTH[1] and width > PIXELS and is_default:
        what = f"takes {math.sqrt(2 * width / track.pull):.2g} s to fall by its own width, {width:.3g} px"
        yield track.fault("slow-fall", what)
    if slop > COARSE * width > 0 and (track.contacts["distance"] < -COARSE * width).any():
        yield track.fault("coarse-slop", f"is {width:.3g} wide, and collision_slop {slop:.3g}")


def _forces(track: _Track) -> Iterator[Fault]:
    """Yield forces and torques that act in single steps, or that a function of the program leaves."""
    acts = track.old["force"].any(axis=1) | (track.old["torque"] != 0)
    if acts[:-1].any() and not (acts[1:] & acts[:-1]).any():
        yield track.fault("single-pushes", f"in {acts.sum()} of {len(acts)} steps")
    left = np.hypot(*track.new["force"].T)
    is_kept = (left > 0) & (track.new["force"] == track.old["force"]).all(axis=1)
    if track.body._velocity_func and is_kept.mean() > MOST and not track.run.steps[-1].handles:
        yield track.fault("force-kept", f"a force of {left.max():.3g} is left after a step")


def _weak_force(track: _Track) -> Iterator[Fault]:
    """Yield bodies that a constant force does not move, and does not press against anything."""
    first, contacts = int(track.is_pushed.argmax()), track.contacts
    force, size = track.old["force"][first:], math.hypot(*track.old["force"][first])
    along, seconds = force[0] / (size or 1.0), float(track.run.dt[track.step[first:]].sum())
    way, gain = ((track.new[key][-1] - track.old[key][first]) @ along for key in ("position", "velocity"))
    borne = -(contacts["impulse"] * (contacts["normal"] @ along)).sum()
    pressed = borne > BORNE * (size + track.mass * track.gravity @ along) * seconds
    least = SMALL * size * seconds * (1 if len(contacts) else -1)
    stays = way < SMALL * track.length * seconds and gain * track.mass < least and not pressed
    is_constant = np.abs(force - force[0]).max() < SAME * size and not track.changed.any()
    if stays and is_constant and track.is_free:
        what = f"a force of {size:.3g} on a mass of {track.mass:.3g} is {size / track.mass:.3g} px/s²"
        yield track.fault("weak-force", f"{what}, and gravity {track.pull:.3g} px/s²")


def _velocities(track: _Track) -> Iterator[Fault]:
    """Yield bodies whose velocity the program resets after each step, or keeps adding to."""
    changed, velocity = track.changed, track.old["velocity"]
    lost = np.abs(changed[1:]) * (velocity[1:] == velocity[:-1])
    count = int((lost > SMALL * track.length).any(axis=1).sum())
    if count > FEW:
        what = f"before {count} of {len(changed)} steps; up to {lost.max():.3g} px/s are lost in one"
        yield track.fault("velocity-set", what)
    size, (first, last) = np.hypot(*changed.T)[1:], velocity[[0, -1]] @ changed.sum(axis=0)
    is_again = (size > 0) & (np.hypot(*np.diff(changed, axis=0).T) < SAME * size)
    if is_again.mean() > MOST and last - max(first, 0.0) > size[is_again].sum() ** 2 / 2:
        yield track.fault("adds-up", f"by {np.median(size):.3g} px/s before most steps")


def _cannot_roll(track: _Track) -> Iterator[Fault]:
    """Yield balls that cannot roll, are hardly pushed, and are slowed down by friction."""
    contacts, velocity = track.contacts, track.old["velocity"][track.at]
    work = (contacts["tangential"] * dot(tangent(contacts["normal"]), velocity)).sum()
    is_round = all(isinstance(shape, pymunk.Circle) for shape in track.solid)
    if work < 0 and math.isinf(track.moment) and is_round and not track.pull and track.is_pushed.mean() < SMALL:
        yield track.fault("cannot-roll", f"friction {contacts['friction'].max():.3g} in a contact")


def _clings(track: _Track) -> Iterator[Fault]:
    """Yield bodies that the program presses against walls, on which friction holds them."""
    contacts, gravity, pull = track.contacts, track.gravity, track.pull
    by_friction = -contacts["tangential"] * dot(tangent(contacts["normal"]), gravity)
    weight, dt = track.mass * pull, track.run.dt[track.step]
    borne = np.bincount(track.at, by_friction, len(dt)) > BORNE * weight * pull * dt
    stays = np.abs(dot(track.new["velocity"], gravity)) < pull * track.length
    pressed = np.hypot(*track.old["force"].T) * contacts["friction"].max(initial=0.0) > BORNE * weight
    held = stays & (pressed | track.changed.any(axis=1)) & borne
    if track.evidence.lasts(track.step[held]):
        yield track.fault("clings", f"in {held.sum()} steps")


def _coasts(track: _Track) -> Iterator[Fault]:
    """Yield bodies with friction that nothing slows down, as nothing touches them."""
    speed = np.hypot(*track.old["velocity"][~track.is_pushed].T)
    is_left = len(speed) > MIN_STEPS and not track.is_pushed[-MIN_STEPS:].any() and not len(track.contacts)
    acts = track.pull or not track.is_free or track.evidence.contents.space.damping < 1
    is_rough = any(shape.friction for shape in track.solid) and not any(shape.elasticity for shape in track.solid)
    if is_left and is_rough and not acts and 0 < speed.max() * KEPT_SPEED < speed[-1]:
        yield track.fault("friction-untouched", f"still goes at {speed[-1]:.3g} px/s, and never touched anything")


def _falls(track: _Track) -> Iterator[Fault]:
    """Yield bodies that fall below all walls, and whose straight path meets none of them."""
    gravity, contents = track.gravity, track.evidence.contents
    if len(track.contacts) or not track.is_free or not track.new["velocity"][-1] @ gravity > 0:
        return
    passed = {each.shape.body for each in (*track.evidence.passages.found, *track.evidence.passages.ghosts)}
    start, end = (tuple(rows["position"][at].tolist()) for rows, at in ((track.old, 0), (track.new, -1)))
    walls = [shape for shape in contents.shapes if not is_dynamic(body_of(shape))]
    corners = [(x, y) @ gravity for box in (each.bb for each in walls) for x in box[::2] for y in box[1::2]]
    is_below = corners and end @ gravity > max(corners)
    if is_below and track.body not in passed and not any(wall.segment_query(start, end) for wall in walls):
        yield track.fault("falls-away", "is below all walls, and never touched anything")


def _joints(contents: Contents) -> Iterator[Fault]:
    for joint in contents.space.constraints:
        if isinstance(joint, pymunk.SimpleMotor) and joint.rate and math.isinf(joint.max_force):
            what = f"its SimpleMotor of {joint.rate:.3g} rad/s has max_force inf"
            yield contents.fault("strong-motor", end_of(joint), what)
        if isinstance(joint, pymunk.DampedSpring | pymunk.DampedRotarySpring) and joint.stiffness < 0:
            what = f"its {type(joint).__name__} has stiffness {joint.stiffness:.3g}"
            yield contents.fault("pushing-spring", end_of(joint), what)


def _returned(contents: Contents) -> Iterator[Fault]:
    """Yield callbacks that return False or a comparison, and do not set `process_collision` themselves."""
    for handler in contents.space._handlers.values():  # Pymunk has no public list of them
        for code in (getattr(callback, "__code__", None) for callback in (handler.begin, handler.pre_solve)):
            if isinstance(code, CodeType) and "process_collision" not in code.co_names:
                for value, end in pairwise(dis.get_instructions(code)):
                    is_value = value.opname in BOOLEAN or value.argval is False or end.argval is False
                    if end.opname.startswith("RETURN") and is_value:
                        yield Fault("returned", None, figure=code.co_name)
