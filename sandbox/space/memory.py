"""A snapshot of a `pymunk.Space`, read from Chipmunk's own structures.

Pymunk's functions say neither how an impulse is divided between the two points of a contact, nor its direction at a
joint, and one call for each body costs more than the step. So a kernel reads the structures of `chipmunk_structs.h`, as
64-bit words. `check_layout` compares them once, in a probe Space, with what Pymunk's functions return.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from typing import Any, Final, cast

import numpy as np
import pymunk
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.compiled import entry, kernel
from sandbox.errors import SandboxError

Words = NDArray[np.uint64]


class JointKind(IntEnum):
    """The ten constraints of Pymunk."""

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


def _packed(*fields: tuple[Any, ...]) -> np.dtype[Any]:
    """Return the type of a row of words."""
    kind = np.dtype(list(fields))
    assert kind.itemsize % 8 == 0
    return kind


# Masses kg, moments kg px², places px, angles rad, velocities px/s and rad/s, forces kg px/s², impulses kg px/s.
BODY: Final = _packed(
    ("velocity_func", "u8"),
    ("position_func", "u8"),
    ("mass", "f8"),
    ("moment", "f8"),
    ("position", "f8", 2),  # of the centre of gravity
    ("velocity", "f8", 2),
    ("force", "f8", 2),
    ("angle", "f8"),
    ("spin", "f8"),
    ("torque", "f8"),
    ("id", "u8"),  # pymunk.Body.id
    ("asleep", "u8"),  # not 0: asleep
)
BODY_WORDS: Final = (0, 1, 2, 4, 8, 9, 10, 11, 12, 13, 14, 15, 16, 23, 31)  # of cpBody, in the order of BODY
_BODY_ID, _BODY_POSITION, _BODY_ANGLE, _BODY_SHAPES, _BODY_NEXT = 23, 8, 14, 28, 32

CONTACT: Final = _packed(  # a point of an arbiter; the normal points from body A to body B
    ("body_a", "u8"),
    ("body_b", "u8"),
    ("shape_a", "u8"),  # addresses
    ("shape_b", "u8"),
    ("hash", "u8"),  # of the point: the same in the next step
    ("is_first", "u8"),  # 1: the shapes did not touch in the step before, so that no cached impulse was applied
    ("elasticity", "f8"),
    ("friction", "f8"),
    ("surface_velocity", "f8", 2),
    ("normal", "f8", 2),
    ("arm_a", "f8", 2),  # from the centre of gravity to the point
    ("arm_b", "f8", 2),
    ("bounce", "f8"),  # elasticity times the normal velocity when the contact was found
    ("impulse", "f8"),  # accumulated, on B along the normal
    ("tangential", "f8"),  # accumulated, on B along the normal turned by +90°
    ("distance", "f8"),  # below 0: overlap
)
_CONTACT_WORDS: Final = 12  # of a cpContact

JOINT: Final = _packed(
    ("key", "u8"),  # distinguishes constraints of one Space
    ("kind", "u8"),  # JointKind
    ("body_a", "u8"),
    ("body_b", "u8"),
    ("function", "u8"),  # of a spring: the address of its law of force
    ("max_force", "f8"),
    ("arm_a", "f8", 2),
    ("arm_b", "f8", 2),
    ("normal", "f8", 2),
    ("impulse", "f8", 2),  # accumulated, on B: a vector, or along the normal, or an angular impulse
    ("setting", "f8", 3),  # as SETTINGS names them
    ("place_a", "f8", 2),  # of the centres of gravity of its bodies, which need not be in the Space
    ("place_b", "f8", 2),
    ("angle_a", "f8"),
    ("angle_b", "f8"),
)
SETTINGS: Final = {
    JointKind.PIN: ("distance",),
    JointKind.SLIDE: ("min", "max"),
    JointKind.PIVOT: (),
    JointKind.GROOVE: (),
    JointKind.SPRING: ("rest_length", "stiffness", "damping"),
    JointKind.ROTARY_SPRING: ("rest_angle", "stiffness", "damping"),
    JointKind.ROTARY_LIMIT: ("min", "max", "bias"),
    JointKind.RATCHET: ("angle", "ratchet", "bias"),
    JointKind.GEAR: ("phase", "ratio"),
    JointKind.MOTOR: ("rate",),
}
# Words of each kind: function, arm A, arm B, normal, impulse (vectors: the first of two), settings; 0: it has none.
_JOINT_WORDS: Final = np.array(
    [
        (0, 18, 20, 22, 25, 0, 17, 0, 0),
        (0, 19, 21, 23, 26, 0, 17, 18, 0),
        (0, 17, 19, 0, 25, 26, 0, 0, 0),
        (0, 24, 26, 0, 32, 33, 0, 0, 0),
        (20, 23, 25, 28, 30, 0, 17, 18, 19),
        (16, 0, 0, 0, 20, 0, 13, 14, 15),
        (0, 0, 0, 0, 17, 0, 13, 14, 16),
        (0, 0, 0, 0, 18, 0, 13, 15, 17),
        (0, 0, 0, 0, 18, 0, 13, 14, 0),
        (0, 0, 0, 0, 15, 0, 13, 0, 0),
    ]
)

_OF_BODY: Final = {  # BODY, in Pymunk's words
    **{key: key for key in ("mass", "moment", "position", "velocity", "force", "angle", "torque")},
    "spin": "angular_velocity",
    "asleep": "is_sleeping",
}
SETTING: Final = _packed(
    ("gravity", "f8", 2),
    ("damping", "f8"),
    ("slop", "f8"),
    ("persistence", "u8"),
    ("dt", "f8"),
    ("fingerprint", "u8"),  # of what there is, apart from how dynamic bodies move and how joints are set
)
_SETTING_WORDS: Final = (1, 2, 3, 6, 8, 11)  # of cpSpace, in the order of SETTING
_FINGERPRINT: Final = 6  # in the words of SETTING
_SETTINGS_IN_FINGERPRINT: Final = (0, 1, 2, 3, 5, 6, 7, 8)  # of cpSpace, from iterations to persistence
_BODY_CONSTANTS: Final = (0, 1, 2, 4, 6, 7)  # of cpBody: functions, mass, moment, centre of gravity
_BODY_MOTION: Final = (10, 11, 15)
_BODY_POSE: Final = (8, 9, 14)
_SHAPE_WORDS: Final = (3, 4, 5, 6, 7, 13, 14, 15, 16, 19, 20, 24)  # of cpShape, to the filter; a polygon's radius
_SHAPE_BODY, _SHAPE_SENSOR, _SHAPE_NEXT = 2, 12, 21
_SHAPE_BOX: Final = (8, 9, 10, 11)
_BODY_IDLE: Final = 33  # the time for which a body was idle, s; infinite if it is static
_DYNAMIC, _STATIC, _SLEEPING, _CONSTRAINTS, _ARBITERS = 12, 13, 15, 19, 20
_original_step: Final = pymunk.Space.step  # another one may take its place
_LOW: Final = 0xFFFFFFFF  # the lower half of a word
_ODD: Final = 0x9E3779B97F4A7C15  # spreads the bits of a word: 2^64 over the golden ratio


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What a Space had at one moment, as bytes: of BODY, CONTACT, JOINT and SETTING.

    Contacts are those that the last step solved. Static bodies are listed after the others, sleeping ones last.
    """

    body_bytes: bytes
    contact_bytes: bytes
    joint_bytes: bytes
    setting_bytes: bytes

    @property
    def bodies(self) -> NDArray[Any]:
        """(n,) BODY."""
        return np.frombuffer(self.body_bytes, BODY)

    @property
    def contacts(self) -> NDArray[Any]:
        """(k,) CONTACT, in the order in which they were solved."""
        return np.frombuffer(self.contact_bytes, CONTACT)

    @property
    def joints(self) -> NDArray[Any]:
        """(j,) JOINT, of the constraints that are not asleep, in the order in which they were solved."""
        return np.frombuffer(self.joint_bytes, JOINT)

    @property
    def settings(self) -> NDArray[Any]:
        """() SETTING: gravity px/s², damping per second, slop px, persistence in steps, dt s of the last step.

        The fingerprint is another number after any change other than the motion of bodies and the settings of joints.
        """
        return cast("NDArray[Any]", np.frombuffer(self.setting_bytes, SETTING)[0])

    @property
    def fingerprint(self) -> int:
        """That of the settings."""
        return int(self.settings["fingerprint"])

    @property
    def bytes(self) -> int:
        """Its size."""
        return sum(map(len, (self.body_bytes, self.contact_bytes, self.joint_bytes, self.setting_bytes)))


class SpaceMemory:
    """Takes snapshots of a Space. checked: whether the layout of Pymunk's memory is checked first."""

    def __init__(self, space: pymunk.Space, *, checked: bool = True) -> None:
        if checked:
            check_layout()
        self._space = space  # keeps its structures in memory
        self._address = _address(space._space)
        self._rows = [_rows(kind.itemsize // 8, 64) for kind in (BODY, CONTACT, JOINT)]
        self._settings = np.empty(SETTING.itemsize // 8, np.uint64)
        self._classes = joint_classes()

    def snapshot(self) -> Snapshot:
        """Read the Space, between two steps."""
        counts = self._read()
        while any(count > len(rows) for count, rows in zip(counts, self._rows, strict=True)):
            self._rows = [_rows(row.shape[1], 2 * count) for count, row in zip(counts, self._rows, strict=True)]
            counts = self._read()
        bodies, contacts, joints = (row[:count].tobytes() for count, row in zip(counts, self._rows, strict=True))
        return Snapshot(bodies, contacts, joints, self._settings.tobytes())

    def _read(self) -> tuple[int, int, int]:
        return cast("tuple[int, int, int]", _read(self._address, *self._rows, self._settings, self._classes))


def _rows(words: int, count: int) -> Words:
    """Return room for a number of rows, at least 16."""
    return np.empty((max(16, count), words), np.uint64)


def joint_key(joint: pymunk.Constraint) -> int:
    """Return the `key` of a constraint in snapshots."""
    return int(_address(lib.cpConstraintGetUserData(joint._constraint)))


def shape_address(shape: pymunk.Shape) -> np.uint64:
    """Return the address of a shape, by which contacts know it."""
    return _address(shape._shape)


def _address(pointer: object) -> np.uint64:
    return np.uint64(int(ffi.cast("uintptr_t", pointer)))


@intrinsic
def _word_at(typing: Any, address: Any) -> Any:
    """Return the word at an address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = context.get_value_type(types.uint64).as_pointer()
        return builder.load(builder.inttoptr(args[0], pointer))

    return types.uint64(types.uint64), generate


_load = cast("Callable[[Any], Any]", _word_at)


@kernel
def _word(address: Any, index: int) -> Any:
    """Return a word of the structure at an address."""
    return _load(address + np.uint64(8 * index))


@kernel
def _number(address: Any, index: int) -> Any:
    """Return a word of a structure as the floating-point number whose bits it is."""
    return np.uint64(_word(address, index)).view(np.float64)


@kernel
def _mixed(number: Any, word: Any) -> Any:
    product = (number ^ word) * np.uint64(_ODD)
    return product ^ (product >> np.uint64(29))


@kernel
def _fingerprint(body: Any) -> Any:
    """Return a number for a body and its shapes, and for where it is if it is static, or kinematic at rest."""
    number = body
    for index in _BODY_CONSTANTS:
        number = _mixed(number, _word(body, index))
    if np.isinf(_number(body, 2)):
        is_moving = False
        for index in _BODY_MOTION:
            is_moving |= _number(body, index) != 0
        for index in _BODY_POSE:
            number = _mixed(number, np.uint64(1) if is_moving else _word(body, index))
    total = number
    shape = _word(body, _BODY_SHAPES)
    while shape:
        total += _shape_fingerprint(shape)
        shape = _word(shape, _SHAPE_NEXT)
    return total


@kernel
def _shape_fingerprint(shape: Any) -> Any:
    """Return a number for a shape: what it is, but for where its body is."""
    number = _mixed(shape, _word(shape, _SHAPE_SENSOR) & np.uint64(0xFF))
    for index in _SHAPE_WORDS:
        number = _mixed(number, _word(shape, index))
    return number


@kernel
def _read_body(body: Any, bodies: Any, settings: Any, count: int) -> int:
    settings[_FINGERPRINT] += _fingerprint(body)
    if count < len(bodies):
        for k, index in enumerate(BODY_WORDS):
            bodies[count, k] = _word(body, index)
    return count + 1


@kernel
def _read_bodies(space: Any, bodies: Any, settings: Any) -> int:
    count = 0
    for kind in (_DYNAMIC, _STATIC):
        array = _word(space, kind)
        for k in range(_word(array, 0) & np.uint64(_LOW)):
            count = _read_body(_word(_word(array, 1), k), bodies, settings, count)
    array = _word(space, _SLEEPING)
    for k in range(_word(array, 0) & np.uint64(_LOW)):
        body = _word(_word(array, 1), k)
        while body:
            count = _read_body(body, bodies, settings, count)
            body = _word(body, _BODY_NEXT)
    return count


@kernel
def _read_contacts(space: Any, contacts: Any) -> int:
    count = 0
    array = _word(space, _ARBITERS)
    for k in range(_word(array, 0) & np.uint64(_LOW)):
        arbiter = _word(_word(array, 1), k)
        a, b = _word(arbiter, 7), _word(arbiter, 8)
        for point in range(_word(arbiter, 13) & np.uint64(_LOW)):
            if count < len(contacts):
                contact = _word(arbiter, 14) + np.uint64(8 * _CONTACT_WORDS * point)
                row = contacts[count]
                row[0], row[1] = _word(a, _BODY_ID), _word(b, _BODY_ID)
                row[2], row[3] = _word(arbiter, 5), _word(arbiter, 6)
                row[4] = _word(contact, 11)
                row[5] = np.uint64((_word(arbiter, 22) & np.uint64(_LOW)) == 0)
                for index in range(4):
                    row[6 + index] = _word(arbiter, index)
                    row[12 + index] = _word(contact, index)
                row[10], row[11] = _word(arbiter, 15), _word(arbiter, 16)
                for index in range(3):
                    row[16 + index] = _word(contact, 6 + index)
                distance = 0.0
                for axis in range(2):  # as cpArbiterGetDepth rounds it
                    arms = _number(contact, 2 + axis) - _number(contact, axis)
                    apart = _number(b, _BODY_POSITION + axis) - _number(a, _BODY_POSITION + axis)
                    distance += (arms + apart) * _number(arbiter, 15 + axis)
                row[19] = np.float64(distance).view(np.uint64)
            count += 1
    return count


@kernel
def _read_joints(space: Any, joints: Any, settings: Any, classes: Any) -> int:
    count = 0
    array = _word(space, _CONSTRAINTS)
    for k in range(_word(array, 0) & np.uint64(_LOW)):
        settings[_FINGERPRINT] += _mixed(np.uint64(0), _word(_word(array, 1), k))
        if count < len(joints):
            joint, row, kind = _word(_word(array, 1), k), joints[count], 0
            while kind < len(classes) - 1 and classes[kind] != _word(joint, 0):
                kind += 1
            row[0], row[1] = _word(joint, 12), np.uint64(kind)
            for end in range(2):
                body = _word(joint, 2 + end)
                row[2 + end] = _word(body, _BODY_ID)
                row[17 + 2 * end] = _word(body, _BODY_POSITION)
                row[18 + 2 * end] = _word(body, _BODY_POSITION + 1)
                row[21 + end] = _word(body, _BODY_ANGLE)
            row[5] = _word(joint, 6)
            for target, index in enumerate((4, 6, 8, 10, 12, 13, 14, 15, 16)):
                place = _JOINT_WORDS[kind, target]
                row[index] = _word(joint, place) if place else np.uint64(0)
                if 1 <= target <= 3:  # a vector
                    row[index + 1] = _word(joint, place + 1) if place else np.uint64(0)
        count += 1
    return count


def shape_fingerprints(addresses: Words) -> Words:
    """Return a number for each shape, by its address: another one after a change of what it is, or of where it is.

    The latter only of shapes on static bodies, and if their place was indexed anew. (n,).
    """
    numbers = np.empty_like(addresses)
    _read_shapes(addresses, numbers)
    return numbers


@entry
def _read_shapes(addresses: Words, numbers: Words) -> None:
    for k, shape in enumerate(addresses):
        numbers[k] = _shape_fingerprint(shape)
        body = _word(shape, _SHAPE_BODY)
        if body and np.isinf(_number(body, _BODY_IDLE)):
            for index in _SHAPE_BOX:
                numbers[k] = _mixed(numbers[k], _word(shape, index))


@entry
def _read(
    space: Any, bodies: Words, contacts: Words, joints: Words, settings: Words, classes: Words
) -> tuple[int, int, int]:
    """Read a Space into rows, as many as there is room for; return how many there are."""
    for k, index in enumerate(_SETTING_WORDS):
        settings[k] = _word(space, index)
    settings[4] &= np.uint64(_LOW)
    settings[_FINGERPRINT] = 0
    for index in _SETTINGS_IN_FINGERPRINT:
        word = _word(space, index)
        settings[_FINGERPRINT] = _mixed(settings[_FINGERPRINT], word & np.uint64(_LOW) if index in (0, 8) else word)
    return (
        _read_bodies(space, bodies, settings),
        _read_contacts(space, contacts),
        _read_joints(space, joints, settings, classes),
    )


def _probe() -> tuple[pymunk.Space, list[pymunk.Constraint]]:
    """Return a Space with a constraint of each kind, in the order of JointKind, and a contact, after two steps."""
    space = pymunk.Space()
    space.gravity, space.damping = (3.5, -211.25), 0.875
    floor = pymunk.Segment(space.static_body, (-500, -20), (500, -20), 1.5)
    bodies = [pymunk.Body(2.5 + k, 70.5 + k) for k in range(3)]
    for k, body in enumerate(bodies):
        body.position, body.velocity = (7.25 * k, 30.5 + k), (k - 2.75, 4.5)
        body.angle, body.angular_velocity = 0.125 * k, 0.5 - k
    lying = pymunk.Body(3.25, 41.5)  # a shape does not keep its body alive
    box = pymunk.Poly.create_box(lying, (10, 8))
    lying.position, box.friction, floor.friction, box.elasticity, floor.elasticity = (0, -14.75), 0.5, 0.5, 0.5, 0.25
    space.add(*bodies, lying, box, floor)
    a, b, _ = bodies
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
    space.add(*joints)
    for _ in range(2):
        _original_step(space, 1 / 64)
    bodies[2].force, bodies[2].torque = (1.5, -2.25), 3.125
    return space, joints


@cache
def joint_classes() -> Words:
    """Return the address of Chipmunk's class of each JointKind."""
    _, joints = _probe()
    address = "uintptr_t *"
    return np.array([int(ffi.cast(address, joint._constraint)[0]) for joint in joints], np.uint64)


@cache
def check_layout() -> None:
    """Raise SandboxError if this Pymunk's structures are not laid out as this file expects."""
    space, joints = _probe()
    if not all(_agreements(space, joints, SpaceMemory(space, checked=False).snapshot())):
        raise SandboxError(f"Pymunk {pymunk.version} lays out its memory in a way that this version does not know")


def _agreements(space: pymunk.Space, joints: list[pymunk.Constraint], seen: Snapshot) -> list[bool]:
    """Return which parts of a snapshot of the probe are what Pymunk's functions return."""
    settings = seen.settings
    expected = (*space.gravity, space.damping, space.collision_slop, space.collision_persistence, 1 / 64)
    agree = [(*settings["gravity"], *(settings[key] for key in ("damping", "slop", "persistence", "dt"))) == expected]
    of_id = {int(row["id"]): row for row in seen.bodies}
    for body in space.bodies:
        row = of_id.get(body.id, np.zeros((), BODY))
        agree += [np.array_equal(row[key], getattr(body, name)) for key, name in _OF_BODY.items()]
    agree.append(len(seen.joints) == len(joints))
    for kind, row, joint in zip(JointKind, seen.joints, joints, strict=False):
        agree.append(bool(row["kind"] == kind))
        values = [getattr(joint, key) for key in SETTINGS[kind] if key != "bias"]
        settings_agree = all(value in row["setting"] for value in values)
        agree.append(settings_agree and math.isclose(math.hypot(*row["impulse"]), abs(joint.impulse), rel_tol=1e-12))
        agree.append((int(row["body_a"]), int(row["body_b"])) == (joint.a.id, joint.b.id))
    agree.append(len(seen.contacts) == 2 and _contacts_agree(space, seen))
    return agree


def _contacts_agree(space: pymunk.Space, seen: Snapshot) -> bool:
    """Return whether the contact of the probe's box is what its arbiter says."""
    arbiters: list[tuple[Any, ...]] = []
    box = list(space.bodies)[-1]
    box.each_arbiter(
        lambda arbiter: arbiters.append(
            (
                arbiter.total_impulse,
                arbiter.normal,
                arbiter.restitution,
                [point.distance for point in arbiter.contact_point_set.points],
            )
        )
    )
    (impulse, normal, restitution, distances), rows = arbiters[0], seen.contacts
    n = rows["normal"][0]
    total = rows["impulse"].sum() * n + rows["tangential"].sum() * np.array([-n[1], n[0]])
    return bool(
        np.allclose(np.abs(total), np.abs(impulse), rtol=1e-12)
        and np.allclose(np.abs(n), np.abs(normal))
        and rows["elasticity"][0] == restitution
        and np.allclose(np.sort(rows["distance"]), np.sort(distances), atol=1e-12)
    )
