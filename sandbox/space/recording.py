"""Recording the steps of any `pymunk.Space`: its bodies before and after each step, and what acted between them.

Bodies come through `pymunk.batch`, contacts as the structs cpArbiter and cpContact, whose fields Pymunk compiles in,
joints through their properties, which do not have the direction of an impulse.
Handlers and callbacks stay as they are. Bodies and constraints may come and go between steps, and within them.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import takewhile
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.quantity import dot
from sandbox.state import Floats

Rows = NDArray[Any]
Numbers = NDArray[np.intp]

MAX_ROWS: Final = 5_000_000  # of bodies, contacts and joints, some 200 bytes each
ROWS_OF_A_STEP: Final = 100  # that a step counts as besides its own: with few bodies, 10 min are kept
LARGEST: Final = 1e120  # px, px/s, rad or rad/s: beyond that, energies overflow
original_step: Final = pymunk.Space.step  # another one may take its place


# Masses kg, moments kg px², places px, angles rad, velocities px/s and rad/s, forces kg px/s², impulses kg px/s.
_MOTION: Final = [
    ("position", "f8", 2),  # of the centre of gravity
    ("angle", "f8"),
    ("velocity", "f8", 2),
    ("spin", "f8"),
    ("force", "f8", 2),
    ("torque", "f8"),
]
BODY: Final = np.dtype(
    [
        *_MOTION,
        ("id", "u8"),  # pymunk.Body.id
        ("mass", "f8"),
        ("moment", "f8"),
        ("asleep", "?"),
        ("is_own", "?"),  # it has a velocity_func or a position_func of the program
    ]
)
CONTACT: Final = np.dtype(  # a point of an arbiter; the normal points from body A to body B
    [
        ("body_a", "u8"),
        ("body_b", "u8"),
        ("shape_a", "u8"),  # addresses
        ("shape_b", "u8"),
        ("hash", "u8"),  # of the point: the same in the next step
        ("is_first", "?"),  # the shapes did not touch in the step before, so that no cached impulse was applied
        ("elasticity", "f8"),
        ("friction", "f8"),
        ("normal", "f8", 2),
        ("arm_a", "f8", 2),  # from the centre of gravity to the point
        ("arm_b", "f8", 2),
        ("impulse", "f8"),  # accumulated, on B along the normal
        ("tangential", "f8"),  # accumulated, on B along the normal turned by +90°
        ("distance", "f8"),  # below 0: overlap
    ]
)
JOINT: Final = np.dtype(
    [
        ("key", "u8"),  # distinguishes constraints
        ("body_a", "u8"),
        ("body_b", "u8"),
        ("is_hard", "?"),  # it neither drives its bodies nor gives way: what it does to their energy is an error
        ("error", "f8"),  # how far its anchors are off its law, px
    ]
)


def _struct(name: str, **kinds: Any) -> np.dtype[Any]:
    """Return the type of a struct of Chipmunk, with those of its fields that are named."""
    offsets = [ffi.offsetof(f"struct {name}", field) for field in kinds]
    formats = list(kinds.values())
    return np.dtype(
        {"names": [*kinds], "formats": formats, "offsets": offsets, "itemsize": ffi.sizeof(f"struct {name}")}
    )


_ARBITER: Final = _struct("cpArbiter", e="f8", u="f8", a="u8", b="u8", n="2f8", count="i4", stamp="u4", state="i4")
_POINT: Final = _struct("cpContact", r1="2f8", r2="2f8", jnAcc="f8", jtAcc="f8", hash="u8")
_OF_ARBITER: Final = {
    "shape_a": "a",
    "shape_b": "b",
    "elasticity": "e",
    "friction": "u",
    "normal": "n",
}
_OF_POINT: Final = {"arm_a": "r1", "arm_b": "r2", "impulse": "jnAcc", "tangential": "jtAcc", "hash": "hash"}
_BODY_FIELDS: Final = (
    BodyFields.BODY_ID
    | BodyFields.POSITION
    | BodyFields.ANGLE
    | BodyFields.VELOCITY
    | BodyFields.ANGULAR_VELOCITY
    | BodyFields.FORCE
    | BodyFields.TORQUE
)
_READ: Final = {"asleep": lib.cpBodyIsSleeping, "mass": lib.cpBodyGetMass, "moment": lib.cpBodyGetMoment}
_ARBITER_FIELDS: Final = (
    ArbiterFields.BODY_A_ID | ArbiterFields.BODY_B_ID | ArbiterFields.DISTANCE_1 | ArbiterFields.DISTANCE_2
)


class Settings(NamedTuple):
    """Of a Space: px/s²; per second; steps; the dt of its last step, s; whether it has a collision handler."""

    gravity: tuple[float, float]
    damping: float
    persistence: int
    last_dt: float
    handles: bool


class Step(NamedTuple):
    """One call of `Space.step`: from `time` on, `dt` s long; the settings before it.

    before, after: the kinetic and the potential energy of all bodies, kg px²/s²; was, old, new: (n,) BODY after the
    step before, before this step and after it, of the bodies that are there after it; (k,) CONTACT and (j,) JOINT that
    it solved.
    """

    time: float
    dt: float
    settings: Settings
    before: tuple[float, float]
    after: tuple[float, float]
    was: Rows
    old: Rows
    new: Rows
    contacts: Rows
    joints: Rows

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.time + self.dt

    @property
    def is_finite(self) -> bool:
        """Whether all places and velocities are numbers below LARGEST after it."""
        keys = ("position", "velocity", "angle", "spin")
        return all(bool((np.abs(self.new[key]) < LARGEST).all()) for key in keys)

    @property
    def rows(self) -> int:
        """What it counts of MAX_ROWS."""
        return ROWS_OF_A_STEP + 2 * len(self.new) + len(self.contacts) + len(self.joints)


def address(pointer: object) -> int:
    """Return the address of a struct of Chipmunk."""
    return int(ffi.cast("uintptr_t", pointer))


class Recording:
    """The last steps of a Space, as many as MAX_ROWS allows.

    bodies: by `pymunk.Body.id`; shapes, joints: by their address; also those that are gone, so that no other gets it.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self.steps: deque[Step] = deque()
        self._time, self._rows = 0.0, 0
        self.bodies: dict[int, pymunk.Body] = {}
        self.shapes: dict[int, pymunk.Shape] = {}
        self.joints: dict[int, pymunk.Constraint] = {}
        self._buffer = Buffer()
        self._seen: tuple[int, list[int], list[int]] | None = None

    def record(self, step: Callable[[float], None], dt: float) -> None:
        """Call a Space's own `step`, and record what it does. dt: s; a step of 0 s does nothing and is not recorded.

        If dt is below 0 or not finite, or if a callback of the program raises in the step, it is not recorded either.
        """
        if not 0 < dt < math.inf:
            step(dt)
            return
        self._look()
        settings, old = self._settings(), self._bodies()
        before = energies(old, settings.gravity)
        step(dt)
        self._look()
        new, joints = self._bodies(), self._joints()
        after = energies(new, self._settings().gravity)
        old = _of_bodies(old, new)
        was = _of_bodies(self.steps[-1].new, old) if self.steps else old
        step_done = Step(self._time, dt, settings, before, after, was, old, new, _contacts(self._space), joints)
        self.steps.append(step_done)
        self._time += dt
        self._rows += step_done.rows
        while len(self.steps) > 1 and self._rows > MAX_ROWS:
            self._rows -= self.steps.popleft().rows

    def _look(self) -> None:
        """Look at what is new, and keep it."""
        space = self._space
        joints = list(space.constraints)
        seen = lib.cpSpaceGetShapeIDCounter(space._space), [*map(id, space.bodies)], [*map(id, joints)]
        if seen == self._seen:
            return
        self._seen = seen
        shapes = [shape for shape in space.shapes if shape.body]
        self.shapes |= {address(shape._shape): shape for shape in shapes}
        self.joints |= {address(joint._constraint): joint for joint in joints}
        used = [*space.bodies, *(shape.body for shape in shapes)]
        used += [body for joint in joints for body in (joint.a, joint.b)]
        self.bodies |= {body.id: body for body in used if body and body is not space._static_body}

    def _bodies(self) -> Rows:
        """Return all bodies."""
        self._buffer.clear()
        get_space_bodies(self._space, _BODY_FIELDS, self._buffer)
        ids = np.frombuffer(self._buffer.int_buf(), np.uintp)
        rows = np.zeros(len(ids), BODY)
        rows["id"], motion = ids, np.frombuffer(self._buffer.float_buf(), np.dtype(_MOTION))
        for name in motion.dtype.names or ():
            rows[name] = motion[name]
        bodies = [self.bodies.get(each) or self._space.static_body for each in ids.tolist()]
        rows["is_own"] = [bool(body._velocity_func or body._position_func) for body in bodies]
        for name, read in _READ.items():
            rows[name] = [read(body._body) for body in bodies]
        for row, body in enumerate(bodies):
            centre = lib.cpBodyGetCenterOfGravity(body._body)
            if centre.x or centre.y:
                rows["position"][row] += pymunk.Vec2d(centre.x, centre.y).rotated(float(rows["angle"][row]))
        return rows

    def _joints(self) -> Rows:
        """Return the joints that are awake."""
        joints = [joint for joint in self._space.constraints if not (joint.a.is_sleeping or joint.b.is_sleeping)]
        return np.array([_joint(joint) for joint in joints], JOINT)

    def _settings(self) -> Settings:
        space = self._space
        gravity, persistence = (space.gravity.x, space.gravity.y), int(space.collision_persistence)
        return Settings(gravity, space.damping, persistence, space.current_time_step, bool(space._handlers))


def _contacts(space: pymunk.Space) -> Rows:
    """Return the contact points that the last step solved."""
    pointers = space._get_arbiters()
    listed = Buffer()
    get_space_arbiters(space, _ARBITER_FIELDS, listed)  # in the same order
    arbiters = np.frombuffer(b"".join([ffi.buffer(each, _ARBITER.itemsize) for each in pointers]), _ARBITER)
    solved = (arbiters["stamp"] == lib.cpSpaceGetTimestamp(space._space)) & (arbiters["count"] > 0)
    counts = arbiters["count"][solved]
    points = [
        ffi.buffer(pointers[at].contacts, count * _POINT.itemsize)
        for at, count in zip(np.flatnonzero(solved).tolist(), counts.tolist(), strict=True)
    ]
    of_arbiter, of_point = arbiters[solved].repeat(counts), np.frombuffer(b"".join(points), _POINT)
    rows = np.zeros(len(of_point), CONTACT)
    rows["body_a"], rows["body_b"] = np.frombuffer(listed.int_buf(), "u8").reshape(-1, 2)[solved].repeat(counts, 0).T
    rows["distance"] = np.frombuffer(listed.float_buf()).reshape(-1, 2)[solved][np.arange(2) < counts[:, None]]
    rows["is_first"] = of_arbiter["state"] == 0
    for fields, source in ((_OF_ARBITER, of_arbiter), (_OF_POINT, of_point)):
        for name, field in fields.items():
            rows[name] = source[field]
    return rows


def _joint(joint: pymunk.Constraint) -> tuple[Any, ...]:
    """Return a row of JOINT."""
    drives = isinstance(joint, pymunk.SimpleMotor | pymunk.DampedSpring | pymunk.DampedRotarySpring)
    drives |= pymunk.Body.KINEMATIC in (joint.a.body_type, joint.b.body_type)
    is_hard = not drives and math.isinf(joint.max_force)
    return address(joint._constraint), joint.a.id, joint.b.id, is_hard, _error(joint)


def _error(joint: pymunk.Constraint) -> float:
    """Return how far the anchors of a joint that may pull as hard as it needs are off its law, px.

    PinJoint: its length less the distance; SlideJoint: what is outside of its limits; PivotJoint: the distance of the
    anchors. 0 for all others.
    """
    if math.isfinite(joint.max_force) or not isinstance(joint, pymunk.PinJoint | pymunk.SlideJoint | pymunk.PivotJoint):
        return 0.0
    length = (joint.b.local_to_world(joint.anchor_b) - joint.a.local_to_world(joint.anchor_a)).length
    if isinstance(joint, pymunk.PinJoint):
        return abs(length - joint.distance)
    return max(0.0, length - joint.max, joint.min - length) if isinstance(joint, pymunk.SlideJoint) else length


def _of_bodies(rows: Rows, like: Rows) -> Rows:
    """Return the rows of the bodies that another array has; its own, of bodies that are not among them."""
    if np.array_equal(rows["id"], like["id"]):
        return rows
    found = like.copy()
    _, here, there = np.intersect1d(rows["id"], like["id"], return_indices=True)
    found[there] = rows[here]
    return found


def finite(value: Floats) -> Floats:
    """Return masses or moments, 0 for infinite ones, which have no energy here."""
    return np.asarray(np.where(np.isfinite(value), value, 0.0))


def energies(bodies: Rows, gravity: tuple[float, float]) -> tuple[float, float]:
    """Return the kinetic and the potential energy of bodies, kg px²/s²."""
    mass, v = finite(bodies["mass"]), bodies["velocity"]
    kinetic = (mass * dot(v, v) + finite(bodies["moment"]) * bodies["spin"] ** 2) / 2
    return float(kinetic.sum()), -float((mass * dot(bodies["position"], np.array(gravity))).sum())


class Run:
    """The columns of K recorded steps, until one leaves a number that is not finite or too large.

    broken: the step after them, if it is such a one; start: the energies before them; time: (K + 1,) s; dt: (K,) s;
    step: (n,) the number of the step of each row of was, old and new; contact_step, joint_step: of contacts and joints.
    """

    def __init__(self, recording: Recording) -> None:
        every = list(recording.steps)
        self.steps = list(takewhile(lambda step: step.is_finite, every))
        self.broken = every[len(self.steps)] if len(self.steps) < len(every) else None
        self.start = every[0].before
        self.time = np.array([every[0].time, *(step.end for step in self.steps)])
        self.dt = np.array([step.dt for step in self.steps])
        self.step, self.new = _listed([step.new for step in self.steps], BODY)
        self.old = _listed([step.old for step in self.steps], BODY)[1]
        self.was = _listed([step.was for step in self.steps], BODY)[1]
        self.contact_step, self.contacts = _listed([step.contacts for step in self.steps], CONTACT)
        self.joint_step, self.joints = _listed([step.joints for step in self.steps], JOINT)

    @cached_property
    def _keys(self) -> tuple[Rows, Rows, Numbers]:
        """The ids of all bodies; of the rows of bodies, numbers for step and body, sorted; the order of the rows."""
        ids, body = np.unique(self.new["id"], return_inverse=True)
        keys = self.step * len(ids) + body
        order = np.argsort(keys)
        return ids, keys[order], order

    def rows_of(self, step: Numbers, bodies: Rows) -> Numbers:
        """Return the row of each body in its step, or the number of rows if that step has no such body."""
        ids, keys, order = self._keys
        body = np.searchsorted(ids, bodies)
        wanted = step * len(ids) + body
        place = np.searchsorted(keys, wanted)
        is_there = np.append(ids, np.uint64(0))[body] == bodies
        is_there &= np.append(keys, -1)[place] == wanted
        return np.where(is_there, np.append(order, len(order))[place], len(order))


def _listed(of_step: Sequence[Rows], kind: np.dtype[Any]) -> tuple[Numbers, Rows]:
    """Return the number of the step of each row of all steps, and the rows."""
    return np.repeat(np.arange(len(of_step)), [*map(len, of_step)]), np.concatenate([np.empty(0, kind), *of_step])
