"""The energy ledger of a Space: by what each step, and the program between steps, changed its mechanical energy.

The energy is kinetic, and potential (of the centres of gravity, in the Space's gravity). Bodies of infinite mass have
none, nor has the rotation of those with an infinite moment.

Chipmunk's step moves all bodies with the velocities that they have, finds contacts, adds the springs' impulses, then
damping, gravity and forces, then the impulses of contacts and joints. All impulses of a step act at fixed points, so a
set of impulses J that changes the relative velocity at these points from v to u does the work J · (v + u) / 2 exactly.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, NamedTuple, Self

import numpy as np

from sandbox.quantity import dot
from sandbox.space.recording import Numbers, Rows, Run, finite
from sandbox.state import Floats

SMALLEST_SHOWN: Final = 5e-5  # of the largest kinetic energy
LEAST_ENERGY: Final = 1e-6  # kg px²/s²: with less than that, nothing moved
SUSPECT: Final = 0.05  # of the largest kinetic energy: a line that is not the program's own, and worth a headline


class Cause(StrEnum):
    """What changes the energy of a Space: its name in JSON, its words, and whether the solver's errors are in it."""

    words: str
    is_error: bool

    def __new__(cls, name: str, words: str, is_error: bool = False) -> Self:
        """Name a cause."""
        cause = str.__new__(cls, name)
        cause._value_, cause.words, cause.is_error = name, words, is_error
        return cause

    # Normal impulses, with the restitution that the contact should have:
    RESTITUTION = "restitution", "bounces, as elasticities say"
    # A contact ended with another normal velocity than that:
    RESTITUTION_ERROR = "restitution_error", "bounces, other than elasticities say", True
    FRICTION = "friction", "friction and surface velocities"
    KINEMATIC = "kinematic", "kinematic bodies that push"  # bodies of infinite mass that move
    DAMPING = "damping", "the Space's damping"
    FORCES = "forces", "forces and torques"  # Body.force and Body.torque
    # Work of gravity, less the potential energy of the way with the step's first velocity; contacts and joints against
    # what gravity, forces and damping did in the same step:
    INTEGRATION = "integration", "gravity and what bears it, in steps instead of at every moment"
    CORRECTION = "correction", "bodies moved apart that overlapped", True  # against gravity
    # The impulses on bodies besides those of contacts:
    JOINTS = "joints", "joints", True  # in steps in which nothing else pushes bodies:
    DRIVEN = "driven", "motors, springs, joints that give way, functions, and all joints beside them"
    # Changed within the step by nothing that was recorded: handlers, and what they add and remove:
    CALLBACKS = "callbacks", "handlers and callbacks"
    PROGRAM = "program", "the program: what it sets, adds and removes between steps"


_COLUMN: Final = {cause: column for column, cause in enumerate(Cause)}


@dataclass(frozen=True)
class Ledger:
    """The energy ledger of a run of n steps.

    time: (n + 1,) s; kinetic, potential: (n + 1,) kg px²/s², at these times, before the program's changes;
    work: (n, causes) kg px²/s², of each step and of the program's changes before it, in the order of Cause.
    """

    time: Floats
    kinetic: Floats
    potential: Floats
    work: Floats

    @property
    def total(self) -> Floats:
        """(n + 1,) energy."""
        return self.kinetic + self.potential

    @property
    def scale(self) -> float:
        """What shares are of: the largest kinetic energy."""
        return float(self.kinetic.max())

    @property
    def lines(self) -> dict[Cause, float]:
        """The change of energy over the run by its causes; they sum to the change of the total."""
        return {cause: float(value) for cause, value in zip(Cause, self.work.sum(axis=0), strict=True)}

    @property
    def shares(self) -> dict[str, float]:
        """The lines in words as shares of the scale, the largest first; 0 if nothing moved."""
        shares = {cause.words: value / self.scale if self.scale else 0.0 for cause, value in self.lines.items()}
        return dict(sorted(shares.items(), key=lambda line: -abs(line[1])))

    @property
    def suspect(self) -> dict[str, float]:
        """Those shares above SUSPECT that neither the program nor what it set up explains."""
        errors = {cause.words for cause in Cause if cause.is_error}
        return {words: share for words, share in self.shares.items() if words in errors and abs(share) > SUSPECT}

    def of(self, cause: Cause) -> Floats:
        """(n,) the change of each step by a cause."""
        return self.work[:, _COLUMN[cause]]

    def text(self) -> Iterator[str]:
        """Yield its balance in lines of text: how much energy there was, and what changed it."""
        scale = self.scale
        if scale < LEAST_ENERGY:
            yield "Its energy: nothing moved."
            return
        if not np.isfinite(scale):
            yield "Its energy is not a number."
            return
        since, until = self.time[[0, -1]].tolist()
        yield f"Its energy from {since:.4g} to {until:.4g} s, in % of the largest kinetic energy, {scale:.3g}:"
        lines = [line for line in self.shares.items() if abs(line[1]) >= SMALLEST_SHOWN]
        lines.append(("together", float(self.total[-1] - self.total[0]) / scale))
        yield from (f"  {100 * share:+9.2f} %  {words}" for words, share in lines)

    def as_json(self) -> dict[str, Any]:
        """Return its balance as a JSON document has it: energies in kg px²/s², times in s."""
        return {
            "since": float(self.time[0]),
            "until": float(self.time[-1]),
            "start": float(self.total[0]),
            "end": float(self.total[-1]),
            "largest_kinetic": self.scale,
            "lines": {str(cause): value for cause, value in self.lines.items() if value},
        }


def turned(a: Floats) -> Floats:
    """Return vectors turned by +90°."""
    return np.stack([-a[..., 1], a[..., 0]], axis=-1)


def _potential(of: Rows, position: Floats, gravity: Floats) -> Floats:
    """Return the potential energy of each body."""
    return -finite(of["mass"]) * dot(position, gravity)


def ledger_of(run: Run) -> Ledger:
    """Return the energy ledger of a run."""
    work = np.zeros((len(run.steps), len(Cause)))
    _Work(run, work).add()
    before, after = (
        np.array([getattr(step, when) for step in run.steps]).reshape(-1, 2) for when in ("before", "after")
    )
    kinetic, potential = np.vstack([run.start, after]).T
    total = kinetic + potential
    work[:, _COLUMN[Cause.CALLBACKS]] = total[1:] - before.sum(axis=1) - work.sum(axis=1)
    work[:, _COLUMN[Cause.PROGRAM]] = before.sum(axis=1) - total[:-1]
    return Ledger(run.time, kinetic, potential, work)


class _Motion(NamedTuple):
    """Velocities of all bodies in all steps, and a row of zeros: (n + 1, 2) px/s and (n + 1,) rad/s."""

    velocity: Floats
    spin: Floats

    def at(self, rows: Numbers, arm: Floats) -> Floats:
        """Return the velocities of points on bodies."""
        return self.velocity[rows] + self.spin[rows][:, None] * turned(arm)


class _Contacts(NamedTuple):
    """The contacts of all steps: the rows of their bodies, and the impulses on B, those on A reversed, kg px/s."""

    step: Numbers
    rows: Rows
    a: Numbers
    b: Numbers
    impulse: Floats

    def relative(self, motion: _Motion) -> Floats:
        """Return the velocities of the points on B as seen from those on A."""
        return motion.at(self.b, self.rows["arm_b"]) - motion.at(self.a, self.rows["arm_a"])


class _Work:
    """The work of all that acts within steps and is recorded, added to a ledger's by cause.

    The motion is followed from `start`: damping with gravity and forces, then contacts. What bodies on joints have in
    the end besides that is the joints' impulse on them; of a body with functions of the program, all but its contacts.
    What other bodies have besides is by callbacks.
    """

    def __init__(self, run: Run, work: Floats) -> None:
        self._run, self._work = run, work
        self._step, self._old, self._new = run.step, run.old, run.new
        self._gravity = np.array([step.gravity for step in run.steps]).reshape(-1, 2)[self._step]
        self._mass, self._moment = (np.append(finite(self._new[key]), 0.0) for key in ("mass", "moment"))
        self._inverse = [np.divide(1, of, where=of > 0, out=np.zeros_like(of)) for of in (self._mass, self._moment)]
        self._start, self._end = (
            _Motion(np.append(of["velocity"], [[0, 0]], axis=0), np.append(of["spin"], 0)) for of in (run.old, run.new)
        )

    def add(self) -> None:
        """Add the work of each cause."""
        updated, contacts = self._add_velocity_update(), self._contacts()
        pushed = self._pushed(contacts, updated)
        is_free = ~self._on_joints() & ~np.append(self._new["is_own"], False)
        solved = _Motion(
            np.where(is_free[:, None], pushed.velocity, self._end.velocity),
            np.where(is_free, pushed.spin, self._end.spin),
        )
        self._add_contacts(contacts, updated, solved)
        self._add_rest(updated, _Motion(solved.velocity - pushed.velocity, solved.spin - pushed.spin))
        self._add_positions()

    def _book(self, cause: Cause, energy: Floats, step: Numbers | None = None) -> None:
        """Add energies of some steps, or of each body in each step."""
        step = self._step if step is None else step
        np.add.at(self._work[:, _COLUMN[cause]], step, energy[: len(step)])

    def _energy(self, motion: _Motion) -> Floats:
        energies = self._mass * dot(motion.velocity, motion.velocity) + self._moment * motion.spin**2
        return np.asarray(energies / 2)

    def _contacts(self) -> _Contacts:
        step, rows = self._run.contact_step, self._run.contacts
        impulse = rows["impulse"][:, None] * rows["normal"] + rows["tangential"][:, None] * turned(rows["normal"])
        a, b = (self._run.rows_of(step, rows[side]) for side in ("body_a", "body_b"))
        return _Contacts(step, rows, a, b, impulse)

    def _pushed(self, contacts: _Contacts, updated: _Motion) -> _Motion:
        """Return the motion after the contacts' impulses."""
        linear, angular = np.zeros_like(updated.velocity), np.zeros_like(updated.spin)
        for rows, arm, sign in ((contacts.a, "arm_a", -1), (contacts.b, "arm_b", 1)):
            np.add.at(linear, rows, sign * contacts.impulse)
            np.add.at(angular, rows, sign * dot(turned(contacts.rows[arm]), contacts.impulse))
        velocity = updated.velocity + self._inverse[0][:, None] * linear
        return _Motion(velocity, updated.spin + self._inverse[1] * angular)

    def _on_joints(self) -> Any:
        """Return which bodies are on joints: (n + 1,) of bool."""
        run, on_joints = self._run, np.zeros(len(self._mass), bool)
        for side in ("body_a", "body_b"):
            on_joints[run.rows_of(run.joint_step, run.joints[side])] = True
        return on_joints

    def _add_rest(self, updated: _Motion, rest: _Motion) -> None:
        """Add the work of impulses besides those of contacts. rest: how much they changed the motion."""
        run, start, end = self._run, self._start, self._end
        linear, angular = self._mass[:, None] * rest.velocity, self._moment * rest.spin
        work = dot(linear, start.velocity + end.velocity) + angular * (start.spin + end.spin)
        support = dot(linear, updated.velocity - start.velocity) + angular * (updated.spin - start.spin)
        drives = np.array([step.handles for step in run.steps], bool)
        drives[run.joint_step[~run.joints["is_hard"]]] = True
        drives[run.step[run.new["is_own"]]] = True
        is_driven = np.append(drives[self._step], False)
        self._book(Cause.JOINTS, work * ~is_driven / 2)
        self._book(Cause.DRIVEN, work * is_driven / 2)
        self._book(Cause.INTEGRATION, support / 2)

    def _add_contacts(self, contacts: _Contacts, updated: _Motion, solved: _Motion) -> None:
        """Add the work of contacts: what is due by the velocities before the step, and the rest."""
        rows, n = contacts.rows, contacts.rows["normal"]
        tangent = turned(n)
        normal, tangential = dot(contacts.impulse, n), dot(contacts.impulse, tangent)
        velocities = [contacts.relative(motion) for motion in (self._start, updated, solved)]
        first, between, last = (dot(velocity, n) for velocity in velocities)
        slip = [dot(velocity, tangent) for velocity in velocities]
        target = -rows["elasticity"] * np.minimum(first, 0)
        is_driven = [inverse == 0 for inverse in self._inverse]  # bodies of infinite mass, which have no energy
        driven = contacts.relative(_Motion(updated.velocity * is_driven[0][:, None], updated.spin * is_driven[1]))
        for cause, twice in (
            (Cause.RESTITUTION, normal * (np.minimum(first, 0) + target)),
            (Cause.RESTITUTION_ERROR, normal * (last - target + np.maximum(first, 0))),
            (Cause.FRICTION, tangential * (slip[0] + slip[2])),
            (Cause.INTEGRATION, normal * (between - first) + tangential * (slip[1] - slip[0])),
            (Cause.KINEMATIC, -2 * dot(contacts.impulse, driven)),
        ):
            self._book(cause, twice / 2, contacts.step)

    def _add_velocity_update(self) -> _Motion:
        """Add the work of damping, gravity and forces, and return the motion after them."""
        old, dt, start = self._old, self._run.dt[self._step], self._start
        is_updated = np.isfinite(old["mass"]) & ~self._new["asleep"] & ~self._new["is_own"]
        damping = np.array([step.damping for step in self._run.steps])[self._step] ** dt
        left = np.append(np.where(is_updated, damping, 1.0), 1.0)
        damped = _Motion(left[:, None] * start.velocity, left * start.spin)
        for_dt = np.append(is_updated * dt, 0.0)
        by_gravity = for_dt[:, None] * np.append(self._gravity, [[0, 0]], axis=0)
        by_force = (for_dt * self._inverse[0])[:, None] * np.append(old["force"], [[0, 0]], axis=0)
        by_torque = for_dt * self._inverse[1] * np.append(old["torque"], 0)
        updated = _Motion(damped.velocity + by_gravity + by_force, damped.spin + by_torque)
        mean, spin = (damped.velocity + updated.velocity) / 2, (damped.spin + updated.spin) / 2
        self._book(Cause.DAMPING, self._energy(damped) - self._energy(start))
        self._book(Cause.INTEGRATION, self._mass * dot(by_gravity, mean))
        self._book(Cause.FORCES, self._mass * dot(by_force, mean) + self._moment * by_torque * spin)
        return updated

    def _add_positions(self) -> None:
        """Add the change of potential energy, by the step's first velocity and by the rest of the displacement."""
        old, gravity, is_awake = self._old, self._gravity, ~self._old["asleep"]
        drift = (is_awake * self._run.dt[self._step])[:, None] * old["velocity"]
        self._book(Cause.INTEGRATION, _potential(old, drift, gravity))
        change = _potential(old, self._new["position"] - old["position"] - drift, gravity)
        self._book(Cause.CORRECTION, change * (is_awake & ~self._new["is_own"]))
