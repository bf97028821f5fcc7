"""Recording the steps of any `pymunk.Space`: its bodies before and after each step, and what acted between them.

Bodies come through `pymunk.batch`, contacts as the structs cpArbiter and cpContact, whose fields Pymunk compiles in.
Pymunk has no function for the direction of a joint's impulse: `_WORDS` says where Chipmunk keeps it. If `knows_joints`
finds it elsewhere, joints are not recorded, and the energy ledger has fewer lines.
Handlers and callbacks stay as they are. Bodies and constraints may come and go between steps, and within them.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.space.contents import shapes_of
from sandbox.state import Floats

Rows = NDArray[Any]

MAX_BYTES: Final = 1_000_000_000  # of snapshots
MAX_SECONDS: Final = 600.0  # of the Space's time
original_step: Final = pymunk.Space.step  # another one may take its place


class JointKind(IntEnum):
    """The ten constraints of Pymunk, in the order of `_WORDS`."""

    PIN = 0
    SLIDE = 1
    PIVOT = 2
    GROOVE = 3
    SPRING = 4
    ROTARY_SPRING = 5
    ROTARY_LIMIT = 6
    RATCHET = 7
    GEAR = 8
    MOTOR = 9


KINDS: Final = {
    pymunk.PinJoint: JointKind.PIN,
    pymunk.SlideJoint: JointKind.SLIDE,
    pymunk.PivotJoint: JointKind.PIVOT,
    pymunk.GrooveJoint: JointKind.GROOVE,
    pymunk.DampedSpring: JointKind.SPRING,
    pymunk.DampedRotarySpring: JointKind.ROTARY_SPRING,
    pymunk.RotaryLimitJoint: JointKind.ROTARY_LIMIT,
    pymunk.RatchetJoint: JointKind.RATCHET,
    pymunk.GearJoint: JointKind.GEAR,
    pymunk.SimpleMotor: JointKind.MOTOR,
}
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
        ("surface_velocity", "f8", 2),
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
        ("kind", "i8"),  # JointKind
        ("body_a", "u8"),
        ("body_b", "u8"),
        ("own_law", "?"),  # of a spring: its force is a function of the program
        ("is_free", "?"),  # it is a limit that is not reached, which applies no impulse
        ("max_force", "f8"),
        ("arm_a", "f8", 2),
        ("arm_b", "f8", 2),
        ("normal", "f8", 2),
        ("impulse", "f8", 2),  # accumulated, on B: a vector, or along the normal, or an angular impulse
        ("setting", "f8", 3),  # as SETTINGS names them
        ("error", "f8"),  # how far the joint is off its law, px or rad
    ]
)
SETTINGS: Final = {
    JointKind.PIN: ("distance",),
    JointKind.SLIDE: ("min", "max"),
    JointKind.SPRING: ("rest_length", "stiffness", "damping"),
    JointKind.ROTARY_SPRING: ("rest_angle", "stiffness", "damping"),
    JointKind.ROTARY_LIMIT: ("min", "max"),
    JointKind.RATCHET: ("angle", "ratchet"),
    JointKind.GEAR: ("phase", "ratio"),
    JointKind.MOTOR: ("rate",),
}
# 64-bit words of each kind: arm A, arm B, normal, impulse (each a vector: the first of two), bias; 0: it has none.
_WORDS: Final = (
    (18, 20, 22, 25, 0),
    (19, 21, 23, 26, 0),
    (17, 19, 0, 25, 0),
    (24, 26, 0, 32, 0),
    (23, 25, 28, 30, 0),
    (0, 0, 0, 20, 0),
    (0, 0, 0, 17, 16),
    (0, 0, 0, 18, 17),
    (0, 0, 0, 18, 0),
    (0, 0, 0, 15, 0),
)
_VECTORS: Final = (JointKind.PIVOT, JointKind.GROOVE)  # whose impulse has two coordinates


def _struct(name: str, **kinds: Any) -> np.dtype[Any]:
    """Return the type of a struct of Chipmunk, with those of its fields that are named."""
    offsets = [ffi.offsetof(f"struct {name}", field) for field in kinds]
    formats = list(kinds.values())
    return np.dtype(
        {"names": [*kinds], "formats": formats, "offsets": offsets, "itemsize": ffi.sizeof(f"struct {name}")}
    )


_ARBITER: Final = _struct(
    "cpArbiter", e="f8", u="f8", surface_vr="2f8", a="u8", b="u8", n="2f8", count="i4", stamp="u4", state="i4"
)
_POINT: Final = _struct("cpContact", r1="2f8", r2="2f8", jnAcc="f8", jtAcc="f8", hash="u8")


class Settings(NamedTuple):
    """Of a Space: px/s²; per second; steps; the dt of its last step, s."""

    gravity: tuple[float, float]
    damping: float
    persistence: int
    dt: float


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What a Space had at one moment: (n,) BODY; (k,) CONTACT and (j,) JOINT that the last step solved."""

    bodies: Rows
    contacts: Rows
    joints: Rows
    settings: Settings

    @property
    def bytes(self) -> int:
        """Its size."""
        return self.bodies.nbytes + self.contacts.nbytes + self.joints.nbytes


@dataclass(frozen=True, slots=True)
class Step:
    """One call of `Space.step`: from `time` on, `dt` s long; the Space just before and just after it."""

    number: int  # from 0, of all steps
    time: float
    dt: float
    before: Snapshot
    after: Snapshot

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.time + self.dt


def address(pointer: object) -> int:
    """Return the address of a struct of Chipmunk."""
    return int(ffi.cast("uintptr_t", pointer))


class Recording:
    """The last steps of a Space, as many as MAX_BYTES and MAX_SECONDS allow.

    steps: those that are kept, in the order of time; count: of all that were recorded; bytes: the size of those kept,
    where what two snapshots share counts once.
    bodies: by `pymunk.Body.id`; shapes, joints: by their address; also those that are gone, so that no other gets it.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self.steps: deque[Step] = deque()
        self.bytes = self.count = 0
        self._time = 0.0
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
        after = self._snapshot()
        if not self.steps:
            self.bytes += before.bytes
        elif before is not self.steps[-1].after:
            self.bytes += before.bodies.nbytes
        self.bytes += after.bytes
        self.steps.append(Step(self.count, self._time, dt, before, after))
        self.count += 1
        self._time += dt
        while len(self.steps) > 1 and not self._fits():
            dropped = self.steps.popleft()
            self.bytes -= dropped.before.bytes
            if self.steps[0].before is not dropped.after:
                self.bytes -= dropped.after.bodies.nbytes

    def _before(self) -> Snapshot:
        """Return the Space before a step, which is the last one after a step if the program changed nothing."""
        self._look()
        if not self.steps:
            return self._snapshot()
        last, settings = self.steps[-1].after, self._settings()
        bodies = self._bodies(last.bodies)
        if settings == last.settings and bodies.tobytes() == last.bodies.tobytes():
            return last
        return Snapshot(bodies, last.contacts, last.joints, settings)

    def _snapshot(self) -> Snapshot:
        bodies = self._bodies(None)
        return Snapshot(bodies, _contacts(self._space), _joints(self._space, bodies), self._settings())

    def _look(self) -> None:
        """Look at what is new, and keep it."""
        space = self._space
        joints = list(space.constraints)
        seen = lib.cpSpaceGetShapeIDCounter(space._space), [*map(id, space.bodies)], [*map(id, joints)]
        if seen == self._seen:
            return
        self._seen = seen
        shapes = shapes_of(space)
        self.shapes |= {address(shape._shape): shape for shape in shapes}
        self.joints |= {address(joint._constraint): joint for joint in joints}
        used = [*space.bodies, *(shape.body for shape in shapes)]
        used += [body for joint in joints for body in (joint.a, joint.b)]
        self.bodies |= {body.id: body for body in used if body and body is not space.static_body}

    def _bodies(self, last: Rows | None) -> Rows:
        """Return all bodies. last: those whose masses still hold, if they have not changed; else they are read."""
        self._buffer.clear()
        get_space_bodies(self._space, _BODY_FIELDS, self._buffer)
        ids = np.frombuffer(self._buffer.int_buf(), np.uintp)
        rows = np.zeros(len(ids), BODY)
        motion = np.frombuffer(self._buffer.float_buf(), np.dtype(_MOTION))
        for name in motion.dtype.names or ():
            rows[name] = motion[name]
        rows["id"] = ids
        bodies = [self.bodies.get(each) or self._space.static_body for each in ids.tolist()]
        pointers = [body._body for body in bodies]
        rows["asleep"] = [lib.cpBodyIsSleeping(each) for each in pointers]
        if last is not None and np.array_equal(last["id"], rows["id"]):
            for name in ("mass", "moment", "own_velocity", "own_position"):
                rows[name] = last[name]
        else:
            rows["mass"] = [lib.cpBodyGetMass(each) for each in pointers]
            rows["moment"] = [lib.cpBodyGetMoment(each) for each in pointers]
            rows["own_velocity"] = [body._velocity_func is not None for body in bodies]
            rows["own_position"] = [body._position_func is not None for body in bodies]
        centres = [lib.cpBodyGetCenterOfGravity(each) for each in pointers]
        for row, centre in enumerate(centres):
            if centre.x or centre.y:
                rows["position"][row] += pymunk.Vec2d(centre.x, centre.y).rotated(float(rows["angle"][row]))
        return rows

    def _settings(self) -> Settings:
        space = self._space
        gravity, persistence = (space.gravity.x, space.gravity.y), int(space.collision_persistence)
        return Settings(gravity, space.damping, persistence, space.current_time_step)

    def _fits(self) -> bool:
        return self.bytes <= MAX_BYTES and self._time - self.steps[0].time <= MAX_SECONDS


_BODY_FIELDS: Final = (
    BodyFields.BODY_ID
    | BodyFields.POSITION
    | BodyFields.ANGLE
    | BodyFields.VELOCITY
    | BodyFields.ANGULAR_VELOCITY
    | BodyFields.FORCE
    | BodyFields.TORQUE
)


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
    for name, field in _FIELDS_OF_ARBITER.items():
        rows[name] = of_arbiter[field]
    for name, field in _FIELDS_OF_POINT.items():
        rows[name] = of_point[field]
    return rows


def _joints(space: pymunk.Space, bodies: Rows) -> Rows:
    """Return the constraints that are not asleep."""
    awake = [joint for joint in space.constraints if not (joint.a.is_sleeping or joint.b.is_sleeping)]
    rows = np.zeros(len(awake) if knows_joints() else 0, JOINT)
    places = dict(zip(bodies["id"].tolist(), bodies[["position", "angle"]].tolist(), strict=True))
    for row, joint in zip(rows, awake, strict=False):
        _read_joint(row, joint, *(places.get(body.id) or _place_of(body) for body in (joint.a, joint.b)))
    return rows


def _place_of(body: pymunk.Body) -> tuple[Floats, float]:
    return np.array(body.local_to_world(body.center_of_gravity)), body.angle


def _read_joint(row: Any, joint: pymunk.Constraint, a: tuple[Floats, float], b: tuple[Floats, float]) -> None:
    """Read a constraint into a row. a, b: where the centres of gravity of its bodies are, and their angles."""
    kind = _kind_of(joint)
    *places, bias = _WORDS[kind]
    words = ffi.unpack(ffi.cast("double *", joint._constraint), max(_WORDS[kind]) + 2)
    arm_a, arm_b, normal, impulse = (tuple(words[at : at + 2]) if at else (0.0, 0.0) for at in places)
    setting = [getattr(joint, name) for name in SETTINGS.get(kind, ())]
    row["key"], row["kind"], row["max_force"] = address(joint._constraint), kind, joint.max_force
    row["body_a"], row["body_b"], row["own_law"] = joint.a.id, joint.b.id, not has_pymunks_law(joint)
    row["arm_a"], row["arm_b"], row["normal"] = arm_a, arm_b, normal
    row["is_free"] = bool(bias) and words[bias] == 0
    row["impulse"] = impulse if kind in _VECTORS else (impulse[0], 0)
    row["setting"][: len(setting)] = setting
    row["error"] = _error(kind, setting, np.subtract(np.add(b[0], arm_b), np.add(a[0], arm_a)), a[1], b[1])


def _kind_of(joint: pymunk.Constraint) -> JointKind:
    """Return the kind of a constraint, also of a class of the program's own."""
    return next(KINDS[each] for each in type(joint).__mro__ if each in KINDS)


def _error(kind: JointKind, setting: Sequence[float], apart: Floats, angle_a: float, angle_b: float) -> float:
    """Return how far a joint is off its law: px, or rad; 0 for springs and motors.

    PinJoint: its length less the distance; SlideJoint: what is outside of its limits; PivotJoint and GrooveJoint: the
    distance of the anchors, of the anchor from the groove; RotaryLimitJoint and RatchetJoint: the angle outside of the
    limits; GearJoint: the angle off.
    """
    distance, between = math.hypot(*apart), angle_b - angle_a
    match kind, *setting:
        case JointKind.PIN, length:
            error = distance - length
        case JointKind.SLIDE, least, most:
            error = max(0, distance - most) - max(0, least - distance)
        case (JointKind.PIVOT | JointKind.GROOVE,):
            error = distance
        case JointKind.ROTARY_LIMIT, least, most:
            error = max(0, between - most) - max(0, least - between)
        case JointKind.RATCHET, angle, ratchet if (angle - between) * ratchet > 0:
            error = angle - between
        case JointKind.GEAR, phase, ratio:
            error = angle_b * ratio - angle_a - phase
        case _:
            error = 0.0
    return error


def has_pymunks_law(joint: pymunk.Constraint) -> bool:
    """Return whether a constraint is no spring, or one with Pymunk's own law of force."""
    if isinstance(joint, pymunk.DampedSpring):
        return joint.force_func == pymunk.DampedSpring.spring_force
    return not isinstance(joint, pymunk.DampedRotarySpring) or joint.torque_func == joint.spring_torque


@cache
def knows_joints() -> bool:
    """Return whether Chipmunk keeps the impulses of joints where `_WORDS` says: tried in a Space of its own."""
    space = pymunk.Space()
    space.gravity = 3.5, -211.25
    a, b = pymunk.Body(2.5, 70.5), pymunk.Body(3.5, 71.5)
    a.position, a.velocity, a.angular_velocity = (0, 30.5), (-2.75, 4.5), 0.5
    b.position, b.angle, b.angular_velocity = (7.25, 31.5), 0.125, -0.5
    joints: list[pymunk.Constraint] = [
        pymunk.PinJoint(a, b, (1, 2), (3, 4.5)),
        pymunk.SlideJoint(a, b, (1, 2), (3, 4), 0.5, 1.25),
        pymunk.PivotJoint(a, b, (4, 31)),
        pymunk.GrooveJoint(a, b, (-3, 1), (5, 2), (1, 1.5)),
        pymunk.DampedSpring(a, b, (1, 0), (0, 1), 3.5, 17.5, 0.75),
        pymunk.DampedRotarySpring(a, b, 0.25, 19.5, 1.75),
        pymunk.RotaryLimitJoint(a, b, 0.5, 1.5),
        pymunk.RatchetJoint(a, b, 0.5, 1.25),
        pymunk.GearJoint(a, b, 0.5, 1.5),
        pymunk.SimpleMotor(a, b, 2.25),
    ]
    space.add(a, b, *joints)
    for joint in joints:
        joint.max_force = 100  # so that none leaves nothing to the others
    for _ in range(2):
        original_step(space, 1 / 64)
    for joint in joints:
        row = np.zeros((), JOINT)
        _read_joint(row, joint, _place_of(a), _place_of(b))
        arms = [(body.local_to_world(anchor) - body.position) for body, anchor in _anchors(joint)]
        seen = [row["arm_a"], row["arm_b"]][-len(arms) :] if arms else []
        if not joint.impulse or not math.isclose(math.hypot(*row["impulse"]), abs(joint.impulse)):
            return False
        if not np.allclose(arms, seen, atol=1e-12):
            return False
    return True


def _anchors(joint: pymunk.Constraint) -> list[tuple[pymunk.Body, tuple[float, float]]]:
    """Return the bodies of a constraint with the anchors that are fixed to them; of a groove, the second."""
    ends = ((joint.a, "anchor_a"), (joint.b, "anchor_b"))
    return [(body, getattr(joint, name)) for body, name in ends if hasattr(joint, name)]


_ARBITER_FIELDS: Final = (
    ArbiterFields.BODY_A_ID | ArbiterFields.BODY_B_ID | ArbiterFields.DISTANCE_1 | ArbiterFields.DISTANCE_2
)
_FIELDS_OF_ARBITER: Final = {
    "shape_a": "a",
    "shape_b": "b",
    "elasticity": "e",
    "friction": "u",
    "surface_velocity": "surface_vr",
    "normal": "n",
}
_FIELDS_OF_POINT: Final = {
    "arm_a": "r1",
    "arm_b": "r2",
    "impulse": "jnAcc",
    "tangential": "jtAcc",
    "hash": "hash",
}
