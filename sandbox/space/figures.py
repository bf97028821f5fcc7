"""Figures of a recorded run of a Space: overlaps, joints, contacts, momentum, rest, and bodies that leave."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sandbox.space.mechanics import BodyIndex, Floats, Rows, dot, turned, with_static
from sandbox.space.memory import JointKind, Snapshot
from sandbox.space.recording import Step

IN_ANGLE: Final = (JointKind.ROTARY_LIMIT, JointKind.RATCHET, JointKind.GEAR)
LAWLESS: Final = (JointKind.SPRING, JointKind.ROTARY_SPRING, JointKind.MOTOR)  # no place or angle is a wrong one
RESTING_SPEED: Final = 2.0  # in units of what gravity adds in a step: slower bodies count as at rest


@dataclass(frozen=True)
class Overlap:
    """The deepest overlap of a pair of shapes: bodies by id, s, px."""

    body_a: int
    body_b: int
    time: float
    depth: float


def deepest_overlap(steps: Iterable[Step]) -> tuple[Floats, Floats]:
    """Return the time after each step, s, and the deepest overlap that the step found, px: (n,), 0 if there is none."""
    depths = [(step.time + step.dt, max(0.0, -step.after.contacts["distance"].min(initial=0.0))) for step in steps]
    time, depth = np.array(depths, float).reshape(-1, 2).T
    return time, depth


def overlaps(steps: Iterable[Step]) -> list[Overlap]:
    """Return the deepest overlap of each pair of bodies, the deepest first."""
    worst: dict[tuple[int, int], Overlap] = {}
    for step in steps:
        contacts = step.after.contacts
        for row in contacts[contacts["distance"] < 0]:
            a, b = int(row["body_a"]), int(row["body_b"])
            pair, depth = (min(a, b), max(a, b)), -float(row["distance"])
            if pair not in worst or depth > worst[pair].depth:
                worst[pair] = Overlap(a, b, step.time + step.dt, depth)
    return sorted(worst.values(), key=lambda overlap: -overlap.depth)


@dataclass(frozen=True)
class Stretch:
    """How far a joint was from its law at worst, by its key: px, or rad for RotaryLimit, Ratchet and Gear."""

    key: int
    kind: JointKind
    body_a: int
    body_b: int
    time: float
    error: float

    @property
    def is_angle(self) -> bool:
        """Whether the error is an angle."""
        return self.kind in IN_ANGLE


def joint_errors(state: Snapshot) -> Floats:
    """Return how far each joint of a state just after a step is from its law: (j,) px or rad, 0 for springs and motors.

    PinJoint: its length less the distance; SlideJoint: what is outside of its limits; PivotJoint and GrooveJoint: the
    distance of the anchors, of the anchor from the groove; RotaryLimitJoint and RatchetJoint: the angle outside of the
    limits; GearJoint: the angle off.
    """
    joints, bodies = state.joints, state.bodies
    index = BodyIndex(bodies)
    a, b = index.rows(joints["body_a"]), index.rows(joints["body_b"])
    place, angle = with_static(bodies["position"]), with_static(bodies["angle"])
    distance = np.linalg.norm(place[b] + joints["arm_b"] - place[a] - joints["arm_a"], axis=1)
    between, first, second = angle[b] - angle[a], joints["setting"][:, 0], joints["setting"][:, 1]
    ratchet = first - between
    errors = {
        JointKind.PIN: distance - first,
        JointKind.SLIDE: np.maximum(0, distance - second) - np.maximum(0, first - distance),
        JointKind.PIVOT: distance,
        JointKind.GROOVE: distance,
        JointKind.ROTARY_LIMIT: np.maximum(0, between - second) - np.maximum(0, first - between),
        JointKind.RATCHET: np.where(ratchet * second > 0, ratchet, 0.0),
        JointKind.GEAR: angle[b] * second - angle[a] - first,
    }
    kinds = joints["kind"]
    return np.select([kinds == kind for kind in errors], list(errors.values()), 0.0)


def stretches(steps: Iterable[Step]) -> list[Stretch]:
    """Return the largest error of each joint, in units of its law, lengths before angles, the largest first."""
    worst: dict[int, Stretch] = {}
    for step in steps:
        joints = step.after.joints
        if not len(joints):
            continue
        for row, error in zip(joints, joint_errors(step.after).tolist(), strict=True):
            key = int(row["key"])
            if row["kind"] not in LAWLESS and (key not in worst or abs(error) > abs(worst[key].error)):
                kind = JointKind(row["kind"])
                ends = int(row["body_a"]), int(row["body_b"])
                worst[key] = Stretch(key, kind, *ends, step.time + step.dt, error)
    return sorted(worst.values(), key=lambda stretch: (stretch.is_angle, -abs(stretch.error)))


@dataclass(frozen=True)
class Bounce:
    """A first contact that did not end as its elasticity says: bodies by id, s, px/s."""

    body_a: int
    body_b: int
    time: float
    elasticity: float
    approach: float
    separation: float

    @property
    def restitution(self) -> float:
        """The ratio of the separation to the approach."""
        return self.separation / self.approach


def wrong_bounces(steps: Iterable[Step], tolerance: float = 0.05) -> list[Bounce]:
    """Return the points of first contacts whose restitution differs from their elasticity by more than a tolerance.

    Only approaches count that are faster than what gravity adds in four steps.
    """
    bounces = []
    for step in steps:
        contacts = step.after.contacts
        contacts = contacts[contacts["is_first"] == 1]
        if not len(contacts):
            continue
        approach = -_normal_velocity(contacts, step.before)
        separation = _normal_velocity(contacts, step.after)
        least = 4 * np.linalg.norm(step.before.settings["gravity"]) * step.dt
        for row, v, u in zip(contacts, approach.tolist(), separation.tolist(), strict=True):
            if v > least and abs(u / v - row["elasticity"]) > tolerance:
                ends = int(row["body_a"]), int(row["body_b"])
                bounces.append(Bounce(*ends, step.time + step.dt, float(row["elasticity"]), v, u))
    return bounces


def _normal_velocity(contacts: Rows, state: Snapshot) -> Floats:
    """Return the velocity at which the bodies of contacts part."""
    bodies = state.bodies
    index = BodyIndex(bodies)
    velocity, spin = with_static(bodies["velocity"]), with_static(bodies["spin"])
    at = []
    for side in ("a", "b"):
        rows = index.rows(contacts[f"body_{side}"])
        at.append(velocity[rows] + spin[rows][:, None] * turned(contacts[f"arm_{side}"]))
    return dot(at[1] - at[0], contacts["normal"])


def momentum(steps: Iterable[Step]) -> tuple[Floats, Floats]:
    """Return the time, s, and the momentum of all bodies of finite mass, kg px/s: (n,) and (n, 2), after each step."""
    rows = [(step.time + step.dt, *_momentum(step.after.bodies)) for step in steps]
    values = np.array(rows, float).reshape(-1, 3)
    return values[:, 0], values[:, 1:]


def _momentum(bodies: Rows) -> Floats:
    moving = bodies[np.isfinite(bodies["mass"])]
    return np.asarray((moving["mass"][:, None] * moving["velocity"]).sum(axis=0))


def jitter(steps: Iterable[Step]) -> dict[int, float]:
    """Return how often bodies at rest reverse their velocity, as a share of the steps, by their id.

    A body is at rest while it is slower than what gravity adds in two steps.
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
            if body in last and last[body] @ row["velocity"] < 0:
                reversals[body] = reversals.get(body, 0) + 1
            last[body] = row["velocity"]
    return {body: reversals.get(body, 0) / count for body, count in resting.items()}


@dataclass(frozen=True)
class Escape:
    """A body that left the world, by id: since when, s; whether its place or velocity was not finite."""

    body: int
    time: float
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
            left.setdefault(body, Escape(body, step.time + step.dt, bool(is_finite[row])))
    return list(left.values())
