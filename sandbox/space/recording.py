"""Recording the steps of any `pymunk.Space`: its bodies before and after each step, and what acted between them.

Bodies come through `pymunk.batch`, contacts as the structs cpArbiter and cpContact, whose fields Pymunk compiles in.
Pymunk has no function for the direction of a joint's impulse: `_WORDS` says where Chipmunk keeps it in the versions of
KNOWN. With another one, joints are not recorded, and the energy ledger has fewer lines.
Handlers and callbacks stay as they are. Bodies and constraints may come and go between steps, and within them.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from itertools import takewhile
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

Rows = NDArray[Any]
Numbers = NDArray[np.intp]

MAX_ROWS: Final = 5_000_000  # of bodies, contacts and joints, some 200 bytes each
ROWS_OF_A_STEP: Final = 100  # that a step counts as besides its own: with few bodies, 10 min are kept
LARGEST: Final = 1e120  # px, px/s, rad or rad/s: beyond that, energies overflow
KNOWN: Final = ("7.3",)  # versions of Pymunk
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
        ("own_velocity", "?"),  # it has a velocity_func, a position_func of the program
        ("own_position", "?"),
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
        ("kind", "i8"),  # its place in KINDS
        ("is_free", "?"),  # it is a limit that is not reached, which applies no impulse
        ("body_a", "u8"),
        ("body_b", "u8"),
        ("max_force", "f8"),
        ("ratio", "f8"),  # of the angular impulse on A to that on B
        ("arm_a", "f8", 2),
        ("arm_b", "f8", 2),
        ("normal", "f8", 2),
        ("impulse", "f8", 2),  # accumulated, on B: a vector, or along the normal, or an angular impulse
        ("error", "f8"),  # how far its anchors are off its law, px
    ]
)
# 64-bit words of each constraint: arm A, arm B, normal, impulse (each a vector: the first of two), bias; 0: none.
_WORDS: Final = {
    "PinJoint": (18, 20, 22, 25, 0),
    "SlideJoint": (19, 21, 23, 26, 0),
    "PivotJoint": (17, 19, 0, 25, 0),
    "GrooveJoint": (24, 26, 0, 32, 0),
    "DampedSpring": (23, 25, 28, 30, 0),
    "DampedRotarySpring": (0, 0, 0, 20, 0),
    "RotaryLimitJoint": (0, 0, 0, 17, 16),
    "RatchetJoint": (0, 0, 0, 18, 17),
    "GearJoint": (0, 0, 0, 18, 0),
    "SimpleMotor": (0, 0, 0, 15, 0),
}
KINDS: Final = [*_WORDS]
VECTORS: Final = [KINDS.index("PivotJoint"), KINDS.index("GrooveJoint")]  # whose impulse has two coordinates
SPRINGS: Final = [KINDS.index("DampedSpring"), KINDS.index("DampedRotarySpring")]
FIRST_ANGULAR: Final = KINDS.index("DampedRotarySpring")  # from it on, impulses are angular
MOTOR: Final = KINDS.index("SimpleMotor")


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
    """Of a Space: px/s²; per second; steps; the dt of its last step, s."""

    gravity: tuple[float, float]
    damping: float
    persistence: int
    dt: float


class Snapshot(NamedTuple):
    """What a Space had at one moment: (n,) BODY; (k,) CONTACT and (j,) JOINT that the last step solved."""

    bodies: Rows
    contacts: Rows
    joints: Rows
    settings: Settings

    @property
    def is_finite(self) -> bool:
        """Whether all places and velocities are numbers below LARGEST."""
        keys = ("position", "velocity", "angle", "spin")
        return all(bool((np.abs(self.bodies[key]) < LARGEST).all()) for key in keys)


class Step(NamedTuple):
    """One call of `Space.step`: from `time` on, `dt` s long; the Space just before and just after it."""

    time: float
    dt: float
    before: Snapshot
    after: Snapshot

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.time + self.dt

    @property
    def rows(self) -> int:
        """What it counts of MAX_ROWS."""
        return ROWS_OF_A_STEP + 2 * len(self.after.bodies) + len(self.after.contacts) + len(self.after.joints)


def address(pointer: object) -> int:
    """Return the address of a struct of Chipmunk."""
    return int(ffi.cast("uintptr_t", pointer))


def knows_joints() -> bool:
    """Return whether it is known where this Chipmunk keeps the impulses of joints."""
    return pymunk.version.startswith(KNOWN)


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
        before = self._before()
        step(dt)
        self._look()
        self.steps.append(Step(self._time, dt, before, self._snapshot()))
        self._time += dt
        self._rows += self.steps[-1].rows
        while len(self.steps) > 1 and self._rows > MAX_ROWS:
            self._rows -= self.steps.popleft().rows

    def _before(self) -> Snapshot:
        """Return the Space before a step, which is the last one after a step if the program changed nothing."""
        self._look()
        if not self.steps:
            return self._snapshot()
        last, settings = self.steps[-1].after, self._settings()
        bodies = self._bodies()
        if settings == last.settings and bodies.tobytes() == last.bodies.tobytes():
            return last
        return last._replace(bodies=bodies, settings=settings)

    def _snapshot(self) -> Snapshot:
        joints = [joint for joint in self._space.constraints if not (joint.a.is_sleeping or joint.b.is_sleeping)]
        rows = [_joint(joint) for joint in joints] if knows_joints() else []
        return Snapshot(self._bodies(), _contacts(self._space), np.array(rows, JOINT), self._settings())

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
        rows["own_velocity"] = [body._velocity_func is not None for body in bodies]
        rows["own_position"] = [body._position_func is not None for body in bodies]
        for name, read in _READ.items():
            rows[name] = [read(body._body) for body in bodies]
        for row, body in enumerate(bodies):
            centre = lib.cpBodyGetCenterOfGravity(body._body)
            if centre.x or centre.y:
                rows["position"][row] += pymunk.Vec2d(centre.x, centre.y).rotated(float(rows["angle"][row]))
        return rows

    def _settings(self) -> Settings:
        space = self._space
        gravity, persistence = (space.gravity.x, space.gravity.y), int(space.collision_persistence)
        return Settings(gravity, space.damping, persistence, space.current_time_step)


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
    name = next(each.__name__ for each in type(joint).__mro__ if each.__module__ == "pymunk.constraints")
    kind = KINDS.index(name)  # also of a class of the program's own
    *places, bias = _WORDS[name]
    words = ffi.unpack(ffi.cast("double *", joint._constraint), max(places) + 2)
    arm_a, arm_b, normal, impulse = ((words[at], words[at + 1]) if at else (0.0, 0.0) for at in places)
    if kind not in VECTORS:
        impulse = impulse[0], 0.0
    ends, is_free = (joint.a.id, joint.b.id), bias and words[bias] == 0
    ratio = 1 / joint.ratio if isinstance(joint, pymunk.GearJoint) else 1.0
    vectors = arm_a, arm_b, normal, impulse
    key, error = address(joint._constraint), _error(joint, arm_a, arm_b)
    return key, kind, is_free, *ends, joint.max_force, ratio, *vectors, error


def _error(joint: pymunk.Constraint, arm_a: tuple[float, float], arm_b: tuple[float, float]) -> float:
    """Return how far the anchors of a joint are off its law, px; 0 for springs, and for joints of angles.

    PinJoint: its length less the distance; SlideJoint: what is outside of its limits; PivotJoint and GrooveJoint: the
    distance of the anchors, of the anchor from the groove.
    """
    a, b = (body.local_to_world(body.center_of_gravity) for body in (joint.a, joint.b))
    length = (b + arm_b - a - arm_a).length
    match joint:
        case pymunk.PinJoint():
            return length - joint.distance
        case pymunk.SlideJoint():
            return max(0.0, length - joint.max, joint.min - length)
        case pymunk.PivotJoint() | pymunk.GrooveJoint():
            return length
        case _:
            return 0.0


class Pairs(NamedTuple):
    """Bodies that a snapshot and a later one have: (n,) the number of the step, BODY then, BODY later."""

    step: Numbers
    old: Rows
    new: Rows


def pairs_of(snapshots: Iterable[tuple[Snapshot, Snapshot]]) -> Pairs:
    """Return the bodies of pairs of snapshots, one for each step; of one and the same snapshot none."""
    old, new = [], []
    for then, later in snapshots:
        a, b = then.bodies, later.bodies
        if then is later:
            a = b = a[:0]
        elif not np.array_equal(a["id"], b["id"]):
            _, first, second = np.intersect1d(a["id"], b["id"], return_indices=True)
            a, b = a[first], b[second]
        old.append(a)
        new.append(b)
    return Pairs(*listed(old, BODY), listed(new, BODY)[1])


def listed(of_step: Sequence[Rows], kind: np.dtype[Any]) -> tuple[Numbers, Rows]:
    """Return the rows of all steps, and before them the number of the step of each."""
    return np.repeat(np.arange(len(of_step)), [*map(len, of_step)]), np.concatenate([np.empty(0, kind), *of_step])


class Run:
    """The columns of K recorded steps, until one leaves a number that is not finite or too large.

    first: the Space before all steps; broken: the step after them, if it is such a one; time: (K + 1,) s; dt: (K,) s.
    """

    def __init__(self, recording: Recording) -> None:
        steps = list(recording.steps)
        self.steps = list(takewhile(lambda step: step.after.is_finite, steps))
        self.broken = steps[len(self.steps)] if len(self.steps) < len(steps) else None
        self.first = steps[0].before
        self.time = np.array([steps[0].time, *(step.end for step in self.steps)])
        self.dt = np.array([step.dt for step in self.steps])

    @cached_property
    def contacts(self) -> tuple[Numbers, Rows]:
        """The number of the step of each contact, and (k,) CONTACT."""
        return listed([step.after.contacts for step in self.steps], CONTACT)

    @cached_property
    def joints(self) -> tuple[Numbers, Rows]:
        """The number of the step of each joint, and (j,) JOINT."""
        return listed([step.after.joints for step in self.steps], JOINT)

    @cached_property
    def moved(self) -> Pairs:
        """The bodies before and after each step."""
        return pairs_of((step.before, step.after) for step in self.steps)

    @cached_property
    def set(self) -> Pairs:
        """The bodies after the step before and before each step, where the program changed something."""
        befores = [step.before for step in self.steps]
        return pairs_of(zip([*befores[:1], *(step.after for step in self.steps)], befores, strict=False))

    @cached_property
    def _keys(self) -> tuple[Rows, Rows, Numbers]:
        """The ids of all bodies; of the rows of `moved`, numbers for step and body, sorted; the order of the rows."""
        step, old, _ = self.moved
        ids, body = np.unique(old["id"], return_inverse=True)
        keys = step * len(ids) + body
        order = np.argsort(keys)
        return ids, keys[order], order

    def rows_of(self, step: Numbers, bodies: Rows) -> Numbers:
        """Return the row of `moved` of each body in its step, or the number of rows if that step has no such body."""
        ids, keys, order = self._keys
        body = np.searchsorted(ids, bodies)
        wanted = step * len(ids) + body
        place = np.searchsorted(keys, wanted)
        is_there = np.append(ids, np.uint64(0))[body] == bodies
        is_there &= np.append(keys, -1)[place] == wanted
        return np.where(is_there, np.append(order, len(order))[place], len(order))
