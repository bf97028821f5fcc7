"""The work of all that acts within one step of a Space."""

from collections import defaultdict
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.space.causes import Cause
from sandbox.space.mechanics import (
    Floats,
    Index,
    Rows,
    cross,
    dot,
    finite,
    is_default_spring,
    kinetic_energy,
    potential_energy,
    stored_energy,
    strain,
    turned,
    with_static,
)
from sandbox.space.memory import JointKind, Snapshot
from sandbox.space.recording import Step

Work = defaultdict[Cause, float]  # kg px²/s²

_JOINT_CAUSES: Final = dict.fromkeys(JointKind, Cause.JOINTS) | {
    JointKind.MOTOR: Cause.MOTORS,
    JointKind.SPRING: Cause.SPRINGS,
    JointKind.ROTARY_SPRING: Cause.SPRINGS,
}
_PROGRAM_VELOCITY: Final = int(ffi.cast("uintptr_t", lib.ext_cpBodyVelocityFunc))
_PROGRAM_POSITION: Final = int(ffi.cast("uintptr_t", lib.ext_cpBodyPositionFunc))
_ANGULAR: Final = (JointKind.ROTARY_SPRING, JointKind.ROTARY_LIMIT, JointKind.RATCHET, JointKind.GEAR, JointKind.MOTOR)
_VECTORS: Final = (JointKind.PIVOT, JointKind.GROOVE)
_LIMITED: Final = (JointKind.ROTARY_LIMIT, JointKind.RATCHET)  # which forget their impulse while not at the limit
_BIAS: Final = 2  # in the settings of limited joints


class ContactHistory:
    """The contacts of the last steps, whose impulses Chipmunk caches."""

    def __init__(self, before: Snapshot) -> None:
        self._steps = [before.contacts]  # the latest first

    def applied(self, step: Step) -> tuple[Floats, Floats]:
        """Return the normal and tangential impulses that a step applied at its contacts, and remember its contacts.

        Of an accumulated impulse, the solver applies what it adds to the cached one, and the cached one itself times
        the ratio of dt to that of the step before. If the shapes touch for the first time after some steps, of which
        there are at most `collision_persistence`, the cached one is not applied.
        """
        contacts = step.after.contacts
        start = np.zeros((len(contacts), 2))
        pair = _pair_key(contacts)
        key = pair ^ contacts["hash"]
        missing = np.arange(len(contacts))
        for cached in self._steps:
            if len(cached) and len(missing):
                cached_pair = _pair_key(cached)
                at = Index(cached_pair ^ cached["hash"]).rows(key[missing])
                hit = at < len(cached)
                start[missing[hit]] = np.stack([cached["impulse"], cached["tangential"]], axis=1)[at[hit]]
                missing = missing[~np.isin(pair[missing], cached_pair)]  # a pair has the points of its last contact
        self._steps = [contacts, *self._steps][: int(step.after.settings["persistence"])]
        share = np.where(contacts["is_first"] == 1, -1.0, _cached_share(step) - 1)
        return contacts["impulse"] + share * start[:, 0], contacts["tangential"] + share * start[:, 1]


def _cached_share(step: Step) -> float:
    """Return the part of cached impulses that a step applies at its start."""
    dt = float(step.before.settings["dt"])
    return step.dt / dt if dt else 0.0


def _pair_key(contacts: Rows) -> Rows:
    """Return a number for the two shapes of each contact, whichever is A."""
    a, b = contacts["shape_a"], contacts["shape_b"]
    low, high = np.minimum(a, b), np.maximum(a, b)
    mixed: Rows = low * np.uint64(0x9E3779B97F4A7C15) + high * np.uint64(0xC2B2AE3D27D4EB4F)
    return mixed


@dataclass
class _Motion:
    """Velocities of all bodies, and a row of zeros: (n + 1, 2) px/s and (n + 1,) rad/s."""

    velocity: Floats
    spin: Floats

    def at(self, rows: NDArray[np.intp], arm: Floats) -> Floats:
        """Return the velocities of points on bodies."""
        return self.velocity[rows] + self.spin[rows][:, None] * turned(arm)

    def with_rows(self, which: NDArray[np.bool_], of: "_Motion") -> "_Motion":
        """Return this motion, for some bodies replaced by another one."""
        return _Motion(np.where(which[:, None], of.velocity, self.velocity), np.where(which, of.spin, self.spin))


class _Impulses:
    """Impulses that act together, summed for each of n bodies."""

    def __init__(self, count: int) -> None:
        self._linear, self._angular = np.zeros((count + 1, 2)), np.zeros(count + 1)

    def add(self, rows: NDArray[np.intp], arm: Floats, impulse: Floats) -> None:
        np.add.at(self._linear, rows, impulse)
        np.add.at(self._angular, rows, cross(arm, impulse))

    def turn(self, rows: NDArray[np.intp], impulse: Floats) -> None:
        np.add.at(self._angular, rows, impulse)

    def change(self, motion: _Motion, inverse: tuple[Floats, Floats], sign: int) -> _Motion:
        """Return the motion with the impulses (sign 1), or without them (-1)."""
        return _Motion(
            motion.velocity + sign * inverse[0][:, None] * self._linear, motion.spin + sign * inverse[1] * self._angular
        )

    def on_infinite(self, motion: _Motion, inverse: tuple[Floats, Floats]) -> float:
        """Return the work done on what has no energy: bodies of infinite mass, and spins of infinite moments."""
        linear = dot(self._linear, motion.velocity)[inverse[0] == 0].sum()
        return float(linear + (self._angular * motion.spin)[inverse[1] == 0].sum())


@dataclass(frozen=True)
class _Joints:
    """Joints and the impulses that they apply to body B: linear (j, 2), angular (j,); the latter on A with a ratio."""

    rows: Rows
    a: NDArray[np.intp]
    b: NDArray[np.intp]
    linear: Floats
    angular: Floats
    angular_on_a: Floats

    def power(self, motion: _Motion) -> Floats:
        """Return the impulses times the velocities on which they act."""
        velocity = motion.at(self.b, self.rows["arm_b"]) - motion.at(self.a, self.rows["arm_a"])
        turning = self.angular * motion.spin[self.b] - self.angular_on_a * motion.spin[self.a]
        return dot(self.linear, velocity) + turning


class StepWork:
    """The work of all that acts within a step.

    work, of_joints: what it is added to, by cause and by the key of the constraint.
    The motion is followed from `start`: springs, damping with gravity and forces, velocity functions, then contacts and
    joints. What differs from this in the end is by callbacks. Of velocity functions, only the result is known, from the
    end without the impulses.
    """

    def __init__(self, step: Step, history: ContactHistory, work: Work, of_joints: dict[int, float]) -> None:
        self._step, self._after = step, step.after.bodies
        self._work, self._of_joints = work, of_joints
        self._index = Index(self._after["id"])
        rows = Index(step.before.bodies["id"]).rows(self._after["id"])
        self._is_new = rows == len(step.before.bodies)
        self._before = self._after.copy()  # a body that a callback added in the step has no part in it
        self._before[~self._is_new] = step.before.bodies[rows[~self._is_new]]
        self._mass, self._moment = (with_static(finite(self._after[key])) for key in ("mass", "moment"))
        inverse = [np.divide(1, of, where=of > 0, out=np.zeros_like(of)) for of in (self._mass, self._moment)]
        self._inverse = inverse[0], inverse[1]
        self._start = _Motion(with_static(self._before["velocity"]), with_static(self._before["spin"]))
        self._end = _Motion(with_static(self._after["velocity"]), with_static(self._after["spin"]))
        self._contact_impulses = history.applied(step)

    def add(self) -> None:
        """Add the work of each cause, and of each constraint by its key."""
        springs, joints = self._joint_impulses()
        first, last = _Impulses(len(self._after)), _Impulses(len(self._after))
        contacts = self._step.after.contacts
        self._sum_joints(springs, first)
        self._sum_joints(joints, last)
        self._sum_contacts(contacts, last)
        sprung = first.change(self._start, self._inverse, 1)
        updated = self._add_velocity_update(sprung)
        has_function = with_static((self._before["velocity_func"] == _PROGRAM_VELOCITY).astype(float)) == 1
        unsolved = updated.with_rows(has_function, last.change(self._end, self._inverse, -1))
        solved = last.change(unsolved, self._inverse, 1)
        self._work[Cause.VELOCITY_FUNCTIONS] += self._energy(unsolved) - self._energy(updated)
        self._work[Cause.CALLBACKS] += self._energy(self._end) - self._energy(solved)
        self._add_contacts(contacts, unsolved, solved)
        self._add_springs(springs, sprung)
        self._add_joints(joints, unsolved, solved)
        for impulses, motions in ((first, (self._start, sprung)), (last, (unsolved, solved))):
            self._work[Cause.KINEMATIC] -= sum(impulses.on_infinite(motion, self._inverse) for motion in motions) / 2
        self._add_positions()
        self._work[Cause.MASS_SET] += change_by_mass(self._before, self._after, self._before, self._gravity)
        add_membership(self._work, self._step.before, self._step.after)

    @property
    def _gravity(self) -> Floats:
        return np.array(self._step.before.settings["gravity"])

    def _joint_impulses(self) -> tuple[_Joints, _Joints]:
        """Return the impulses of springs at the start of the step, and of all joints after it: on B.

        A spring's impulse at the start is recomputed from its law; a spring of the program's own law counts as a joint.
        """
        rows = self._step.after.joints
        before = self._step.before.joints
        start = with_static(before["impulse"])[Index(before["key"]).rows(rows["key"])]
        is_spring = np.isin(rows["kind"], (JointKind.SPRING, JointKind.ROTARY_SPRING))
        is_free = np.isin(rows["kind"], _LIMITED) & (rows["setting"][:, _BIAS] == 0)
        applied = rows["impulse"] + np.where(is_spring[:, None], 0.0, (_cached_share(self._step) - 1) * start)
        applied[is_free] = 0.0
        is_default = is_default_spring(rows)
        springs = rows[is_default]
        after = self._step.after
        sign = np.where(springs["kind"] == JointKind.SPRING, -1.0, 1.0)
        force = sign * springs["setting"][:, 1] * strain(springs, after, after)
        force = np.clip(force, -springs["max_force"], springs["max_force"]) * self._step.dt
        applied[is_default, 0] -= force
        return self._joints(springs, np.stack([force, 0 * force], axis=1)), self._joints(rows, applied)

    def _joints(self, rows: Rows, impulse: Floats) -> _Joints:
        """Return joints with the impulses that they apply."""
        linear = np.where(np.isin(rows["kind"], _VECTORS)[:, None], impulse, impulse[:, :1] * rows["normal"])
        is_angular = np.isin(rows["kind"], _ANGULAR)
        angular = np.where(is_angular, impulse[:, 0], 0.0)
        is_gear = rows["kind"] == JointKind.GEAR
        ratio = np.divide(1, rows["setting"][:, 1], where=is_gear, out=np.ones(len(rows)))
        linear = np.where(is_angular[:, None], 0.0, linear)
        a, b = self._index.rows(rows["body_a"]), self._index.rows(rows["body_b"])
        return _Joints(rows, a, b, linear, angular, angular * ratio)

    def _sum_joints(self, joints: _Joints, impulses: _Impulses) -> None:
        impulses.add(joints.a, joints.rows["arm_a"], -joints.linear)
        impulses.add(joints.b, joints.rows["arm_b"], joints.linear)
        impulses.turn(joints.a, -joints.angular_on_a)
        impulses.turn(joints.b, joints.angular)

    def _sum_contacts(self, contacts: Rows, impulses: _Impulses) -> None:
        n = contacts["normal"]
        normal, tangential = self._contact_impulses
        impulse = normal[:, None] * n + tangential[:, None] * turned(n)
        impulses.add(self._index.rows(contacts["body_a"]), contacts["arm_a"], -impulse)
        impulses.add(self._index.rows(contacts["body_b"]), contacts["arm_b"], impulse)

    def _add_contacts(self, contacts: Rows, unsolved: _Motion, solved: _Motion) -> None:
        """Add the work of contacts: what is due by the velocities before the step, and the rest."""
        if not len(contacts):
            return
        n, e = contacts["normal"], contacts["elasticity"]
        a, b = self._index.rows(contacts["body_a"]), self._index.rows(contacts["body_b"])
        normal, tangential = self._contact_impulses
        before, between, after = (
            motion.at(b, contacts["arm_b"]) - motion.at(a, contacts["arm_a"])
            for motion in (self._start, unsolved, solved)
        )
        first = dot(before, n)
        target = -e * np.minimum(first, 0)
        self._work[Cause.RESTITUTION] += (normal * (np.minimum(first, 0) + target)).sum() / 2
        self._work[Cause.RESTITUTION_ERROR] += (normal * (dot(after, n) - target + np.maximum(first, 0))).sum() / 2
        tangent = turned(n)
        slip = [dot(velocity, tangent) for velocity in (before, between, after)]
        surface = dot(contacts["surface_velocity"], tangent)
        self._work[Cause.FRICTION] += (tangential * (slip[0] + slip[2] + 2 * surface)).sum() / 2
        self._work[Cause.SURFACE] -= (tangential * surface).sum()
        support = normal * (dot(between, n) - first) + tangential * (slip[1] - slip[0])
        self._work[Cause.SUPPORT] += support.sum() / 2

    def _add_springs(self, springs: _Joints, sprung: _Motion) -> None:
        """Add the work of springs at the start of the step, and the energy that they store."""
        rows, after = springs.rows, self._step.after
        if not len(rows):
            return
        work = (springs.power(self._start) + springs.power(sprung)) / 2
        work += stored_energy(rows, after, after) - stored_energy(rows, after, self._step.before)
        self._work[Cause.SPRING_INTEGRATION] += work.sum()
        self._add_each(rows, work)

    def _add_joints(self, joints: _Joints, unsolved: _Motion, solved: _Motion) -> None:
        """Add the work of joints, and of the dampers of springs."""
        rows = joints.rows
        if not len(rows):
            return
        before, between, after = (joints.power(motion) for motion in (self._start, unsolved, solved))
        is_damper = is_default_spring(rows)
        support = np.where(is_damper, 0.0, (between - before) / 2)
        work = (between + after) / 2 - support
        self._work[Cause.SUPPORT] += support.sum()
        self._work[Cause.SPRING_DAMPING] += work[is_damper].sum()
        for kind, cause in _JOINT_CAUSES.items():
            self._work[cause] += work[(rows["kind"] == kind) & ~is_damper].sum()
        self._add_each(rows, work)

    def _add_each(self, rows: Rows, work: Floats) -> None:
        for key, value in zip(rows["key"].tolist(), work.tolist(), strict=True):
            self._of_joints[key] += value

    def _energy(self, motion: _Motion) -> float:
        """Return the kinetic energy of all bodies in a motion."""
        return float(kinetic_energy(self._mass, self._moment, motion.velocity, motion.spin).sum())

    def _add_velocity_update(self, sprung: _Motion) -> _Motion:
        """Add the work of damping, gravity and forces, and return the motion after them."""
        step, before = self._step, self._before
        is_moved = np.isfinite(before["mass"]) & (self._after["asleep"] == 0) & ~self._is_new
        is_updated = with_static(is_moved.astype(float))
        left = np.where(is_updated == 1, step.before.settings["damping"] ** step.dt, 1.0)
        damped = _Motion(left[:, None] * sprung.velocity, left * sprung.spin)
        by_gravity = is_updated[:, None] * self._gravity * step.dt
        by_force = (is_updated * self._inverse[0])[:, None] * with_static(before["force"]) * step.dt
        by_torque = is_updated * self._inverse[1] * with_static(before["torque"]) * step.dt
        updated = _Motion(damped.velocity + by_gravity + by_force, damped.spin + by_torque)
        self._work[Cause.DAMPING] += self._energy(damped) - self._energy(sprung)
        mean = (damped.velocity + updated.velocity) / 2
        self._work[Cause.INTEGRATION] += (self._mass * dot(by_gravity, mean)).sum()
        by_forces = self._mass * dot(by_force, mean) + self._moment * by_torque * (damped.spin + updated.spin) / 2
        self._work[Cause.FORCES] += by_forces.sum()
        return updated

    def _add_positions(self) -> None:
        """Add the change of potential energy, by the step's first velocity and by the rest of the displacement."""
        before = self._before
        is_awake = (before["asleep"] == 0) & ~self._is_new
        drift = np.where(is_awake[:, None], before["velocity"] * self._step.dt, 0.0)
        rest = self._after["position"] - before["position"] - drift
        self._work[Cause.INTEGRATION] += potential_energy(before["mass"], drift, self._gravity).sum()
        change = potential_energy(before["mass"], rest, self._gravity)
        has_function = before["position_func"] == _PROGRAM_POSITION
        self._work[Cause.POSITION_FUNCTIONS] += change[has_function].sum()
        self._work[Cause.CORRECTION] += change[is_awake & ~has_function].sum()
        self._work[Cause.CALLBACKS] += change[~is_awake & ~has_function].sum()


def change_by_mass(old: Rows, new: Rows, state: Rows, gravity: Floats) -> float:
    """Return the change of energy when bodies in a state get other masses and moments."""
    energies = [
        kinetic_energy(of["mass"], of["moment"], state["velocity"], state["spin"])
        + potential_energy(of["mass"], state["position"], gravity)
        for of in (old, new)
    ]
    return float((energies[1] - energies[0]).sum())


def add_membership(work: Work, old: Snapshot, new: Snapshot) -> None:
    """Add the energies of bodies that came and went, and of a change of gravity."""
    gravity = old.settings["gravity"]
    for cause, sign, bodies, others in (
        (Cause.ADDED, 1, new.bodies, old.bodies),
        (Cause.REMOVED, -1, old.bodies, new.bodies),
    ):
        rows = bodies[Index(others["id"]).rows(bodies["id"]) == len(others)]
        kinetic = kinetic_energy(rows["mass"], rows["moment"], rows["velocity"], rows["spin"])
        work[cause] += sign * (kinetic + potential_energy(rows["mass"], rows["position"], gravity)).sum()
    change = new.settings["gravity"] - gravity
    work[Cause.GRAVITY_SET] += potential_energy(new.bodies["mass"], new.bodies["position"], change).sum()
