"""Figures of a recorded run of a Space: overlaps, joints, contacts, rest, and bodies that leave."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray

from sandbox.space.contents import Meeting
from sandbox.space.mechanics import Floats, Index, Rows, dot, turned, with_static
from sandbox.space.memory import CONTACT, JOINT, JointKind, Snapshot
from sandbox.space.recording import Step

IN_ANGLE: Final = (JointKind.ROTARY_LIMIT, JointKind.RATCHET, JointKind.GEAR)
LAWLESS: Final = (JointKind.SPRING, JointKind.ROTARY_SPRING, JointKind.MOTOR)  # no place or angle is a wrong one
HOLDING: Final = (JointKind.PIN, JointKind.SLIDE, JointKind.PIVOT)  # anchors
Groups = tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]

ROUNDING: Final = 1e-6  # relative, of impulses at the limit of friction
MIN_RESTING: Final = 30  # steps
RESTING_SPEED: Final = 2.0  # in units of what gravity adds in a step: slower bodies count as at rest


class Series(NamedTuple):
    """A figure of two bodies that touch, or of a joint, in n steps. Overlaps in px; others as the functions say.

    first: its first contact or joint; steps: (n,) the numbers of the steps, from 0; values: (n,).
    """

    first: Any
    steps: NDArray[np.intp]
    values: Floats

    @property
    def ends(self) -> tuple[int, int]:
        """The ids of both bodies."""
        return int(self.first["body_a"]), int(self.first["body_b"])

    @property
    def worst(self) -> tuple[int, float]:
        """The number of the step of the largest value, of either sign, and that value."""
        at = int(np.abs(self.values).argmax())
        return int(self.steps[at]), float(self.values[at])


def overlaps(steps: Iterable[Step]) -> list[Series]:
    """Return the depth of the deepest point of each pair of bodies, where they overlap, the deepest first."""
    contacts, number = _listed((step.after.contacts for step in steps), CONTACT)
    deep = contacts["distance"] < 0
    contacts, number = contacts[deep], number[deep]
    found = [
        Series(contacts[rows[0]], at, np.maximum.reduceat(-contacts["distance"][rows], first))
        for rows, at, first in _by_pair(contacts, number, "body")
    ]
    return sorted(found, key=lambda overlap: -overlap.values.max())


def _listed(of_step: Iterable[Rows], kind: np.dtype[Any]) -> tuple[Rows, NDArray[np.intp]]:
    """Return the contacts or joints of all steps, and the number of the step of each."""
    listed = list(of_step)
    return np.concatenate([np.empty(0, kind), *listed]), np.repeat(np.arange(len(listed)), [*map(len, listed)])


def _by_pair(contacts: Rows, number: NDArray[np.intp], of: str) -> Iterator[Groups]:
    """Yield the rows of each pair of bodies or shapes, as `_by_key` does."""
    return _by_key(np.sort(np.stack([contacts[f"{of}_a"], contacts[f"{of}_b"]], axis=1), axis=1), number)


def _by_key(keys: Rows, number: NDArray[np.intp]) -> Iterator[Groups]:
    """Yield the rows of each key by step, the numbers of these steps, and where each begins. keys: (n, k).

    Keys come in the order of their first rows: they are addresses, whose order differs from run to run.
    """
    _, begin, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = begin.argsort().argsort()[group.ravel()]
    order = np.lexsort((number, group))
    for rows in np.split(order, np.bincount(group).cumsum()[:-1]) if len(order) else ():
        at, first = np.unique(number[rows], return_index=True)
        yield rows, at, first


def meetings(steps: Sequence[Step], by_address: Mapping[int, pymunk.Shape]) -> list[Meeting]:
    """Return which shapes with a body touched, in the order of time. by_address: the shapes."""
    contacts, number = _listed((step.after.contacts for step in steps), CONTACT)
    found = []
    for rows, at, _ in _by_pair(contacts, number, "shape"):
        a, b = (by_address.get(int(contacts[side][rows[0]])) for side in ("shape_a", "shape_b"))
        if a and b and a.body and b.body:
            largest = (float(contacts[name][rows].max()) for name in ("elasticity", "friction"))
            found.append(Meeting(a, b, steps[at[0]].end, *largest))
    return sorted(found, key=lambda meeting: meeting.since)


class Hit(NamedTuple):
    """A contact point of a body in the first step of a contact.

    body, other_body: ids of the two bodies; other: address of the shape that is hit; speed: px/s, of the body's centre
    of gravity along the contact's normal, relative to the other body's; reach: px, from the centre of gravity to the
    point, along the normal.
    """

    step: Step
    body: int
    other_body: int
    other: int
    speed: float
    reach: float


def hits(steps: Iterable[Step]) -> Iterator[Hit]:
    """Yield the points of first contacts, as each of the two bodies sees them."""
    for step in steps:
        contacts = step.after.contacts
        contacts = contacts[contacts["is_first"] == 1]
        if not len(contacts):
            continue
        index, velocity = Index(step.before.bodies["id"]), with_static(step.before.bodies["velocity"])
        between = velocity[index.rows(contacts["body_b"])] - velocity[index.rows(contacts["body_a"])]
        speeds = np.abs(dot(between, contacts["normal"])).tolist()
        for side, other in (("a", "b"), ("b", "a")):
            reaches = np.abs(dot(contacts[f"arm_{side}"], contacts["normal"])).tolist()
            ends = contacts[[f"body_{side}", f"body_{other}", f"shape_{other}"]].tolist()
            for (body, other_body, met), speed, reach in zip(ends, speeds, reaches, strict=True):
                yield Hit(step, body, other_body, met, speed, reach)


def residuals(steps: Sequence[Step]) -> tuple[list[Series], list[Series]]:
    """Return what the solver left undone at the contacts of two shapes that were there in the step before too, px/s.

    First, at which speed bodies still approach after its last pass, beyond what is due; then, at which they slip where
    friction is below its limit, so that none is due.
    Chipmunk's solver looks for normal impulses j >= 0 that end each approach at minus the contact's `bounce`, and for
    tangential ones of at most friction times j that end its slip.
    """
    lasting = [step.after.contacts[step.after.contacts["is_first"] == 0] for step in steps]
    contacts, number = _listed(lasting, CONTACT)
    velocity = _velocities(lasting, steps)
    approach = -dot(velocity, contacts["normal"]) - contacts["bounce"]
    holds = np.abs(contacts["tangential"]) < (1 - ROUNDING) * contacts["friction"] * contacts["impulse"]
    slip = np.where(holds, dot(velocity + contacts["surface_velocity"], turned(contacts["normal"])), 0.0)
    approaches, slips = [], []
    for rows, at, first in _by_pair(contacts, number, "shape"):
        holding = np.maximum(1, np.add.reduceat(holds[rows], first, dtype=int))
        approaches.append(Series(contacts[rows[0]], at, np.maximum.reduceat(approach[rows], first)))
        slips.append(Series(contacts[rows[0]], at, np.add.reduceat(slip[rows], first) / holding))
    return approaches, slips


def joint_residuals(steps: Sequence[Step], joint_of: Callable[[int], pymunk.Constraint]) -> list[Series]:
    """Return the same of all joints that hold anchors with any force, px/s.

    Of PinJoint, SlideJoint and PivotJoint, Chipmunk's solver looks for impulses after which the error e of a joint
    shrinks by its part 1 - error_bias^dt in a step, but by max_bias dt at most: this is how much faster it grows.
    joint_of: returns the joint of a key.
    """
    holding = [step.after.joints[np.isin(step.after.joints["kind"], HOLDING)] for step in steps]
    holding = [rows[np.isinf(rows["max_force"])] for rows in holding]
    joints, number = _listed(holding, JOINT)
    keys, of_key = np.unique(joints["key"], return_inverse=True)
    named = [joint_of(key) for key in keys.tolist()]
    error_bias, max_bias = (np.array([getattr(joint, name) for joint in named]) for name in ("error_bias", "max_bias"))
    error = joint_errors(joints)
    apart = joints["place_b"] + joints["arm_b"] - joints["place_a"] - joints["arm_a"]
    size = np.abs(error)
    outwards = np.sign(error)[:, None] * apart / np.where(size > 0, np.linalg.norm(apart, axis=1), 1.0)[:, None]
    lengths = np.array([step.dt for step in steps])[number]
    due = np.minimum((1 - error_bias[of_key] ** lengths) * size / lengths, max_bias[of_key])
    approach = np.where(size > 0, dot(_velocities(holding, steps), outwards) + due, 0.0)
    return _of_joints(joints, number, approach)


def joint_errors(joints: Rows) -> Floats:
    """Return how far each joint just after a step is from its law: (j,) px or rad, 0 for springs and motors.

    PinJoint: its length less the distance; SlideJoint: what is outside of its limits; PivotJoint and GrooveJoint: the
    distance of the anchors, of the anchor from the groove; RotaryLimitJoint and RatchetJoint: the angle outside of the
    limits; GearJoint: the angle off.
    """
    ends = [joints[f"place_{side}"] + joints[f"arm_{side}"] for side in ("a", "b")]
    distance = np.linalg.norm(ends[1] - ends[0], axis=1)
    angle_a, angle_b = joints["angle_a"], joints["angle_b"]
    between, first, second = angle_b - angle_a, joints["setting"][:, 0], joints["setting"][:, 1]
    ratchet = first - between
    errors = {
        JointKind.PIN: distance - first,
        JointKind.SLIDE: np.maximum(0, distance - second) - np.maximum(0, first - distance),
        JointKind.PIVOT: distance,
        JointKind.GROOVE: distance,
        JointKind.ROTARY_LIMIT: np.maximum(0, between - second) - np.maximum(0, first - between),
        JointKind.RATCHET: np.where(ratchet * second > 0, ratchet, 0.0),
        JointKind.GEAR: angle_b * second - angle_a - first,
    }
    kinds = joints["kind"]
    return np.select([kinds == kind for kind in errors], list(errors.values()), 0.0)


def stretches(steps: Iterable[Step]) -> list[Series]:
    """Return the errors of each joint that has a law for places or angles, in the order in which they came."""
    lawful = [step.after.joints[~np.isin(step.after.joints["kind"], LAWLESS)] for step in steps]
    joints, number = _listed(lawful, JOINT)
    return _of_joints(joints, number, joint_errors(joints))


def _of_joints(joints: Rows, number: NDArray[np.intp], values: Floats) -> list[Series]:
    """Return the values of each joint. number: of the step of each."""
    by_joint = _by_key(joints["key"][:, None], number)
    return [Series(joints[rows[0]], at, values[rows]) for rows, at, _ in by_joint]


@dataclass(frozen=True)
class Bounce:
    """A first contact that did not end as its elasticity says: bodies by id, px/s."""

    body_a: int
    body_b: int
    step: Step
    elasticity: float
    approach: float
    separation: float


def wrong_bounces(steps: Iterable[Step], tolerance: float = 0.05) -> list[Bounce]:
    """Return the points of first contacts whose restitution differs from their elasticity by more than a tolerance.

    Only approaches count that are faster than what gravity adds in four steps, of bodies that nothing else touches or
    holds in that step: then the solver has one equation, which it solves exactly.
    """
    bounces = []
    for step in steps:
        contacts = step.after.contacts
        contacts = contacts[(contacts["is_first"] == 1) & _are_alone(contacts, step.after)]
        if not len(contacts):
            continue
        approach = -normal_velocity(contacts, step.before)
        separation = normal_velocity(contacts, step.after)
        least = 4 * np.linalg.norm(step.before.settings["gravity"]) * step.dt
        for row, v, u in zip(contacts, approach.tolist(), separation.tolist(), strict=True):
            if v > least and abs(u / v - row["elasticity"]) > tolerance:
                ends = int(row["body_a"]), int(row["body_b"])
                bounces.append(Bounce(*ends, step, float(row["elasticity"]), v, u))
    return bounces


def _are_alone(contacts: Rows, state: Snapshot) -> NDArray[np.bool_]:
    """Return which points are the only ones of their bodies of finite mass, which have no joints either."""
    bodies, joints = state.bodies, state.joints
    light = bodies["id"][np.isfinite(bodies["mass"])]
    ends = [rows[side] for rows in (contacts, joints) for side in ("body_a", "body_b")]
    ids, counts = np.unique(np.concatenate(ends), return_counts=True)
    busy = np.intersect1d(ids[counts > 1], light)
    return ~(np.isin(contacts["body_a"], busy) | np.isin(contacts["body_b"], busy))


def normal_velocity(contacts: Rows, state: Snapshot) -> Floats:
    """Return the velocity at which the bodies of contacts part."""
    return dot(_velocity(contacts, state), contacts["normal"])


def _velocities(of_step: Iterable[Rows], steps: Sequence[Step]) -> Floats:
    """Return the velocities at contacts or joints of each step, after it, in one list."""
    return np.concatenate(
        [np.empty((0, 2)), *(_velocity(rows, step.after) for rows, step in zip(of_step, steps, strict=True))]
    )


def _velocity(contacts: Rows, state: Snapshot) -> Floats:
    """Return the velocity of body B at each contact or joint, relative to body A."""
    bodies = state.bodies
    index = Index(bodies["id"])
    velocity, spin = with_static(bodies["velocity"]), with_static(bodies["spin"])
    at = []
    for side in ("a", "b"):
        rows = index.rows(contacts[f"body_{side}"])
        at.append(velocity[rows] + spin[rows][:, None] * turned(contacts[f"arm_{side}"]))
    return at[1] - at[0]


def jitter(steps: Iterable[Step]) -> dict[int, float]:
    """Return how often bodies at rest reverse their velocity, as a share of the steps, by their id.

    A body is at rest while it is slower than what gravity adds in two steps. Reversals count from a tenth of that on,
    of bodies that were at rest for MIN_RESTING steps.
    """
    last: dict[int, NDArray[Any]] = {}
    reversals: dict[int, int] = {}
    resting: dict[int, int] = {}
    for step in steps:
        limit = RESTING_SPEED * np.linalg.norm(step.before.settings["gravity"]) * step.dt
        bodies = step.after.bodies
        bodies = bodies[np.isfinite(bodies["mass"]) & (bodies["asleep"] == 0)]
        speed = np.linalg.norm(bodies["velocity"], axis=1)
        for row in bodies[(speed > 0) & (speed < limit)]:
            body = int(row["id"])
            resting[body] = resting.get(body, 0) + 1
            if body in last and last[body] @ row["velocity"] < -((limit / 10) ** 2):
                reversals[body] = reversals.get(body, 0) + 1
            last[body] = row["velocity"]
    return {body: reversals.get(body, 0) / count for body, count in resting.items() if count >= MIN_RESTING}


@dataclass(frozen=True)
class Escape:
    """A body that left the world, by id: in which step; whether its place or velocity was not finite."""

    body: int
    step: Step
    is_finite: bool


def escapes(steps: Iterable[Step], margin: float = 10.0) -> list[Escape]:
    """Return the bodies of finite mass that left the world, in the order of time.

    The world is the box around the places at which bodies were when they were first seen, larger by `margin` times its
    size (at least 100 px) on each side.
    """
    left: dict[int, Escape] = {}
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    known = np.empty(0, np.uint64)
    for step in steps:
        bodies = step.before.bodies
        new = ~np.isin(bodies["id"], known)
        if new.any():
            places = bodies["position"][new & np.isfinite(bodies["position"]).all(axis=1)]
            low, high = np.min([low, *places], axis=0), np.max([high, *places], axis=0)
            known = np.union1d(known, bodies["id"])
        size = margin * max(float((high - low).max(initial=0)), 100.0)
        after = step.after.bodies[np.isfinite(step.after.bodies["mass"])]
        is_finite = np.all([np.isfinite(after[key]) for key in ("angle", "spin")], axis=0)
        for key in ("position", "velocity"):
            is_finite &= np.isfinite(after[key]).all(axis=1)
        inside = ((after["position"] > low - size) & (after["position"] < high + size)).all(axis=1)
        for row in np.flatnonzero(~(is_finite & inside)).tolist():
            body = int(after["id"][row])
            left.setdefault(body, Escape(body, step, bool(is_finite[row])))
    return list(left.values())
