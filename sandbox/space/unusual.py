"""What is unusual in a Space and its steps. It may be meant; if a program does not do what it should, it may be why."""

import dis
import math
from collections import defaultdict
from collections.abc import Iterator
from itertools import islice, pairwise
from types import CodeType, FunctionType, MethodType
from typing import Final

import numpy as np
import pymunk

from sandbox.quantity import dot, tangent
from sandbox.space.contents import (
    Contents,
    body_of,
    end_of,
    half_length,
    half_width,
    is_dynamic,
    is_static,
    may_collide,
    shape_words,
)
from sandbox.space.findings import Fault
from sandbox.space.recording import Numbers
from sandbox.space.rules import MAX_OFF_CENTRE
from sandbox.space.steps import MOST, Evidence, by_key
from sandbox.state import Bools

SLOW_FALL: Final = 1.2  # s, for a body at rest to fall by its own width
COARSE: Final = 0.1  # of its width, for collision_slop
VAIN: Final = 0.05  # of its length, in a second, that a pushed body moves
SETS: Final = 10  # steps before which the program changes a velocity
SAME: Final = 0.02  # relative, of what stays the same
TURNED: Final = 1.0  # rad
LATE: Final = 1.0  # s, at the end of a run
BORNE: Final = 0.5  # of a weight
ACROSS: Final = 0.3  # cosine of the angle between gravity and the normal of a wall
KEPT: Final = 0.98  # of a velocity, after a step
MIN_STEPS: Final = 30  # since the last push
KEPT_SPEED: Final = 0.8  # of its largest speed: slower in the end, something has slowed a body
ROUNDING: Final = 1e-6  # px or rad
BOOLEAN: Final = {"COMPARE_OP", "CONTAINS_OP", "IS_OP", "UNARY_NOT"}
Found = Iterator[tuple[str, str]]  # the keys of rules, and each fault in figures


def unusual(evidence: Evidence) -> dict[str, list[Fault]]:
    """Return what is unusual, by the keys of its rules."""
    faults: dict[str, list[Fault]] = defaultdict(list)
    contents = evidence.contents
    for track in _tracks(evidence):
        for find in (_size, _pushes, _velocities, _rolled, _contacts, _flight):
            for rule, what in find(track):
                faults[rule].append(contents.fault(track.body, what))
    for rule, figure in _callbacks(contents):
        faults[rule].append(Fault(None, figure=figure))
    for joint in evidence.recording.joints.values():
        for rule, what in _joint(joint):
            faults[rule].append(contents.fault(end_of(joint), f"its {type(joint).__name__} {what}"))
    others = {"ghosts": _ghosts, "falls-away": _fallen, "sleeps-on": _sleepers}
    return faults | {rule: [*find(evidence)] for rule, find in others.items()}


def _tracks(evidence: Evidence) -> Iterator["_Track"]:
    """Yield the bodies that move by forces, of more than a few steps."""
    (contacts, step), bodies, ids = evidence.sides, evidence.recording.bodies, evidence.run.old["id"]
    mobile = np.array([body.id for body in bodies.values() if not is_static(body)], "u8")
    is_fixed = ~np.isin(contacts["body_a"], mobile)
    touching = {int(contacts["body_b"][rows[0]]): rows for rows in by_key(contacts["body_b"], step)}
    for rows in by_key(ids, evidence.run.step):
        body = bodies[int(ids[rows[0]])]
        if is_dynamic(body) and len(rows) > SETS:
            at = touching.get(body.id, np.empty(0, np.intp))
            yield _Track(evidence, body, rows, at, is_fixed[at])


class _Track:
    """A body that moves by forces, in n steps of a run, and its contacts, as B of each.

    was, old, new: (n,) BODY, as in a Step; step, contact_step: the numbers of the steps; is_fixed: of contacts, with
    static bodies; changed: (n, 2) px/s, by the program before each step; force: (n,) kg px/s²; is_pushed: (n,); turned:
    rad, between its smallest and largest angle; length, width: px, of its largest solid shape; gravity: (2,) px/s²;
    weight: kg px²/s⁴, of its mass times gravity, along gravity.
    """

    def __init__(self, evidence: Evidence, body: pymunk.Body, rows: Numbers, at: Numbers, is_fixed: Bools) -> None:
        self.evidence, self.body, self.space, self.run = evidence, body, evidence.contents.space, evidence.run
        self.was, self.old, self.new = (every[rows] for every in (self.run.was, self.run.old, self.run.new))
        self.step, self.dt = self.run.step[rows], self.run.dt[self.run.step[rows]]
        contacts, step = evidence.sides
        self.contacts, self.contact_step, self.is_fixed = contacts[at], step[at], is_fixed
        self.changed = self.old["velocity"] - self.was["velocity"]
        self.force = np.hypot(*self.old["force"].T)
        self.is_pushed = (self.force > 0) | self.changed.any(axis=1)
        self.turned = float(np.ptp(self.new["angle"]))
        self.solid = [shape for shape in body.shapes if not shape.sensor]
        self.length, self.width = (2 * max([0.0, *map(half, self.solid)]) for half in (half_length, half_width))
        self.is_round = any(isinstance(shape, pymunk.Circle) for shape in self.solid)
        self.gravity = np.array(self.space.gravity)
        self.weight = body.mass * float(self.gravity @ self.gravity)


def _size(track: _Track) -> Found:
    space, width = track.space, track.width
    seconds = math.sqrt(2 * width / space.gravity.length) if space.gravity.length else 0.0
    if seconds > SLOW_FALL and not track.body._velocity_func:
        yield "slow-fall", f"takes {seconds:.2g} s to fall by its own width, {width:.3g}"
    if space.collision_slop > COARSE * width > 0 and len(track.contacts):
        yield "coarse-slop", f"is {width:.3g} wide, and collision_slop {space.collision_slop:.3g}"
    kinds = {shape.collision_type for shape in track.evidence.contents.solid_of.get(id(track.body), ())}
    heard = {kind for pair in space._handlers for kind in pair}
    if kinds & heard and kinds - heard:
        yield "other-type", f"has shapes of collision types {', '.join(map(str, sorted(kinds)))}"


def _pushes(track: _Track) -> Found:
    """Yield what is unusual in the forces that the program gives."""
    body, force, gravity = track.body, track.old["force"], track.gravity
    acts = (track.force > 0) | (track.old["torque"] != 0)
    if acts[:-1].any() and not (acts[1:] & acts[:-1]).any():
        yield "single-pushes", f"in {acts.sum()} of {len(acts)} steps"
    if (track.force > 0).mean() <= MOST:
        return
    way, extent = track.new["position"][-1] - track.old["position"][0], np.ptp(track.new["position"], axis=0)
    torque, largest, up = track.old["torque"], track.force.max(), -(force @ gravity)
    stays = math.hypot(*extent) < VAIN * track.length * track.dt.sum() and len(track.contacts)
    falls = up.min() > 0 and up.max() < (1 - SAME) * track.weight and way @ gravity > 0
    if (stays and np.abs(torque).max() < SAME * largest * track.length) or falls:
        words = f"a force of {largest:.3g} on a mass of {body.mass:.3g}: {largest / body.mass:.3g} px/s²"
        yield "in-vain", f"{words}, and gravity {math.hypot(*gravity):.3g} px/s²"
    if not np.ptp(force, axis=0).any() and track.turned > TURNED and not track.is_round:
        # Does the point turn with the body? torque / force = (R(angle) point) x direction
        own, arm = force[0] @ (1, 1j) / largest * np.exp(-1j * track.old["angle"]), torque / largest
        columns = np.column_stack([own.imag, -own.real])
        point = np.linalg.lstsq(columns, arm)[0]
        if np.abs(columns @ point - arm).max() <= SAME * np.abs(arm).max():
            yield "turns-not", f"a force of {largest:.3g}, while the body turned by {track.turned:.3g} rad"


def _velocities(track: _Track) -> Found:
    """Yield what is unusual in the velocities that the program sets."""
    changed, velocity = track.changed, track.old["velocity"]
    is_same = velocity[1:] == velocity[:-1]
    lost = np.abs(changed)[1:] * is_same * (is_same.mean(axis=0) > MOST)
    count = int((lost > VAIN * track.length).any(axis=1).sum())
    if count > SETS < track.evidence.contents.origins.driven.get(track.body, 0):
        yield "velocity-set", f"before {count} of {len(changed)} steps; up to {lost.max():.3g} px/s are lost in one"
    size, gain = np.hypot(*changed.T)[1:], np.hypot(*velocity[-1]) - np.hypot(*velocity[0])
    is_again = (size > 0) & (np.hypot(*np.diff(changed, axis=0).T) < SAME * size)
    if is_again.mean() > MOST and gain > size[is_again].sum() / 2:
        yield "adds-up", f"{np.median(size):.3g} px/s before {is_again.sum() + 1} of {len(changed)} steps"
    turn = track.old["angle"] - track.was["angle"]
    is_turned = (np.abs(turn) > 2 * math.pi) & np.isclose(turn, np.round(turn), 0, 1e-9) & (track.old["angle"] != 0)
    if is_turned.any():
        yield "degrees", f"turned by {turn[is_turned][0]:.4g} before a step"
    jumps = np.hypot(*(track.old["position"] - track.was["position"]).T) > track.length
    keeps = jumps & (np.hypot(*track.was["velocity"].T) > track.length) & ~changed.any(axis=1)
    if 0 < keeps.sum() < SETS:
        yield "respawns", f"by {np.hypot(*velocity[keeps][0]):.3g} px/s"
    spin = track.old["spin"]
    steers = turn.any() or track.old["torque"].any() or (spin != track.was["spin"]).any() or spin[0]
    is_free = track.is_round or track.body.constraints or track.body._velocity_func or not len(track.contacts)
    if track.is_pushed.mean() > MOST and track.turned > TURNED and not (steers or is_free):
        yield "tips", f"turned by {track.turned:.3g} rad"


def _rolled(track: _Track) -> Found:
    """Yield pushes that are the same in the coordinates of a ball, while it rolls."""
    for push in (track.changed, track.old["force"]) if track.is_round and track.gravity.any() else ():
        given = push.any(axis=1)
        ways = push[given] @ (1, 1j)
        own = ways * np.exp(-1j * track.old["angle"][given])
        largest = np.abs(ways).max(initial=0.0)
        own_spread, spread = (np.abs(each - each[:1]).max(initial=0.0) for each in (own, ways))
        if own_spread < SAME * largest < spread and len(track.contacts):
            yield "turns-with", f"while it turned by {track.turned:.3g} rad"


def _contacts(track: _Track) -> Found:
    """Yield what is unusual in what touches."""
    contacts, at, gravity, run = track.contacts, track.contact_step, track.gravity, track.run
    if (contacts["elasticity"] > 1).any():
        yield "bouncy", f"elasticity {contacts['elasticity'].max():.3g} in a contact"
    late = run.time[1:][track.step] > run.time[-1] - LATE
    is_left = late.any() and not late.all() and not track.is_pushed[late].any() and not track.body.constraints
    rubs = np.isin(track.step[late], at[(contacts["friction"] > 0) & track.is_fixed])
    speed, is_damped = np.hypot(*track.new["velocity"][late].T), track.space.damping < 1
    rolls = track.is_round and is_left and rubs.all() and not is_damped
    if rolls and speed.min() > max((1 - SAME) * speed.max(), track.width / LATE):
        yield "rolls", f"at {speed[-1]:.3g} px/s"
    is_stiff = track.is_round and math.isinf(track.body.moment) and not track.body.constraints
    if is_stiff and contacts["tangential"][track.is_fixed].any() and not gravity.any():
        yield "slides-not", f"friction {contacts['friction'][track.is_fixed].max():.3g} in a contact"
    normal, weight = contacts["normal"], track.weight * run.dt
    is_upright = np.abs(dot(normal, gravity)) < ACROSS * math.hypot(*gravity)
    rubbed = -np.bincount(at, contacts["tangential"] * dot(tangent(normal), gravity) * is_upright, len(run.steps))
    stays = np.abs(dot(track.new["velocity"], gravity)) < math.hypot(*gravity) * track.length
    pressed = track.force * contacts["friction"].max(initial=0.0) > BORNE * track.body.mass * math.hypot(*gravity)
    held = stays & (pressed | track.changed.any(axis=1)) & (rubbed > BORNE * weight)[track.step]
    if gravity.any() and track.evidence.lasts(track.step[held]):
        yield "clings", f"in {held.sum()} steps"


def _flight(track: _Track) -> Found:
    """Yield what is unusual while nothing touches a body, and nothing pushes it."""
    body, gravity = track.body, track.gravity
    free = ~np.isin(track.step, track.contact_step) & ~track.is_pushed
    before, after, fall = track.old["velocity"][free], track.new["velocity"][free], track.dt[free][:, None] * gravity
    kept, speed = np.hypot(*(after - fall).T) / track.space.damping ** track.dt[free], np.hypot(*before.T)
    if body._velocity_func and not body.constraints and free.any():
        # At its largest speed, which a function may limit, it goes along gravity
        if gravity.any() and (before == after).all() and (before @ gravity <= 0).all():
            yield "own-function", "gravity does not act on it"
        elif speed.any() and (kept <= KEPT * speed).all() and (before != after).any():
            yield "own-function", f"it takes {100 * (1 - kept.sum() / speed.sum()):.2g} % of its velocity in a step"
    off, is_computed = body.center_of_gravity.length, any(shape.mass for shape in body.shapes)
    turns = track.turned > TURNED and free.all() and not body.constraints
    if is_computed and off > MAX_OFF_CENTRE * track.length and turns:
        yield "turns-about", f"its centre of gravity is {off:.3g} px off its position"
    is_rough = any(shape.friction for shape in track.solid) and not any(shape.elasticity for shape in track.solid)
    is_left = not (gravity.any() or body.constraints or body._velocity_func) and track.space.damping == 1
    is_going = len(free) > MIN_STEPS and free[-MIN_STEPS:].all() and 0 < speed.max() * KEPT_SPEED < speed[-1]
    if is_rough and is_left and is_going and not len(track.contacts):
        yield "friction-untouched", f"still goes at {speed[-1]:.3g} px/s, and never touched anything"


def _callbacks(contents: Contents) -> Found:
    """Callbacks that nothing calls, or everything, and those that return whether to collide, as before Pymunk 7."""
    used = contents.origins.types | {shape.collision_type for shape in contents.shapes}
    is_plain = any(not shape.collision_type for shape in contents.solid if is_static(body_of(shape)))
    for kinds, handler in contents.space._handlers.items():
        yield from (("deaf-callback", str(kind)) for kind in kinds if kind not in {None, 0} | used)
        if kinds in ((0, 0), (0, None)) and is_plain:
            yield "any-type", f"{kinds}"
        for callback in (handler.begin, handler.pre_solve):
            if isinstance(callback, FunctionType | MethodType) and _returns(callback.__code__):
                yield "returned", callback.__code__.co_name


def _returns(code: CodeType) -> bool:
    """Return whether a function returns False or a comparison, and does not set `process_collision`."""
    for value, then in pairwise(dis.get_instructions(code)):
        is_value = then.opname == "RETURN_VALUE" and (value.argval is False or value.opname in BOOLEAN)
        if is_value or (then.opname == "RETURN_CONST" and then.argval is False):
            return "process_collision" not in code.co_names
    return False


def _joint(joint: pymunk.Constraint) -> Found:
    if isinstance(joint, pymunk.SimpleMotor) and math.isinf(joint.max_force) and joint.rate:
        yield "strong-motor", f"of {joint.rate:.3g} rad/s has max_force inf"
    if isinstance(joint, pymunk.SlideJoint | pymunk.RotaryLimitJoint) and joint.min - joint.max > ROUNDING:
        yield "limits", f"has min {joint.min:.3g} and max {joint.max:.3g}"


def _ghosts(evidence: Evidence) -> Iterator[Fault]:
    """Yield bodies that go through walls with which they do not collide, as neither moves by forces, or by a filter."""
    run, solid = evidence.run, evidence.contents.solid
    filtered = [body_of(shape).id for shape in solid if shape.filter != pymunk.ShapeFilter()]
    start, end, ids = run.was["position"], run.new["position"], run.new["id"]
    low, high = np.minimum(start, end), np.maximum(start, end)
    may_pass = (start != end).any(axis=1) & (np.isinf(run.new["mass"]) | np.isin(ids, np.array(filtered, "u8")))
    for wall in (each for each in solid if is_static(body_of(each))) if may_pass.any() else ():
        box, body_of_wall = wall.bb, body_of(wall)
        near = ((low <= (box.right, box.top)) & (high >= (box.left, box.bottom))).all(axis=1)
        if isinstance(wall, pymunk.Segment):
            a, b = (np.array(body_of_wall.local_to_world(point)) for point in (wall.a, wall.b))
            near &= ((start - a) @ tangent(b - a) > 0) != ((end - a) @ tangent(b - a) > 0)
        for rows in by_key(ids, run.step, may_pass & near):
            body = evidence.recording.bodies[int(ids[rows[0]])]
            # Of its shapes those round its centre of gravity, whose way is looked at
            shapes = [each for each in body.shapes if not each.sensor and each.point_query(body.position).distance <= 0]
            reach = 2 * max(map(half_length, shapes), default=0.0)  # what moves by more is put elsewhere
            is_held = any(body_of_wall in (joint.a, joint.b) for joint in body.constraints)
            if body is not body_of_wall and not is_held and not any(may_collide(each, wall) for each in shapes):
                ways = ((row, tuple(start[row]), tuple(end[row])) for row in rows.tolist())
                met = (row for row, a, b in ways if math.dist(a, b) < reach and wall.segment_query(a, b))
                for row in islice(met, 1):
                    why = "by a filter" if is_dynamic(body) else "as neither moves by forces"
                    step = run.steps[run.step[row]]
                    yield evidence.fault([body.id], step, f"through a {shape_words(wall)}, {why}")


def _fallen(evidence: Evidence) -> Iterator[Fault]:
    """Yield bodies that are below all walls, touch nothing, and passed none."""
    gravity, contents, last = evidence.contents.space.gravity, evidence.contents, evidence.run.steps[-1]
    walls = [shape.bb for shape in contents.solid if not is_dynamic(body_of(shape)) or body_of(shape).constraints]
    corners = [gravity.dot((x, y)) for box in walls for x in (box.left, box.right) for y in (box.bottom, box.top)]
    lowest = max(corners, default=math.inf)
    held = {*last.contacts["body_a"].tolist(), *last.contacts["body_b"].tolist()}
    held |= {body_of(passage.shape).id for passage in evidence.passages.found}
    for body in contents.bodies if gravity.length else ():
        is_low = gravity.dot(body.position) > lowest
        falls = is_dynamic(body) and not body.is_sleeping and gravity.dot(body.velocity) > gravity.dot(gravity) / 10
        if is_low and falls and not body.constraints and body.id not in held:
            yield contents.fault(body, "is below all walls" if body.shapes else "it has no shape")


def _sleepers(evidence: Evidence) -> Iterator[Fault]:
    """Yield bodies that slept before gravity changed, and after."""
    run, steps = evidence.run, evidence.run.steps
    changes = [number for number, (before, after) in enumerate(pairwise(steps), 1) if before.gravity != after.gravity]
    for row in np.flatnonzero(np.isin(run.step, changes) & run.new["asleep"]).tolist():
        yield evidence.fault([int(run.new["id"][row])], steps[run.step[row]], "sleeps")
