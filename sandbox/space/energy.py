"""The energy ledger of a Space: by what each step, and the program between steps, changed its mechanical energy.

The energy is kinetic, and potential (of the centres of gravity, in the Space's gravity). Bodies of infinite mass have
none, nor has the rotation of those with an infinite moment.

Chipmunk's step moves all bodies with the velocities that they have, finds contacts, adds the springs' impulses, then
damping, gravity and forces, then the impulses of contacts and joints. All impulses of a step act at fixed points, so a
set of impulses J that changes the relative velocity at these points from v to u does the work J · (v + u) / 2 exactly.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

import numpy as np

from sandbox.quantity import dot, impulse_of, tangent
from sandbox.space.recording import Numbers, Rows, Run, finite
from sandbox.state import Bools, Floats

SMALLEST_SHOWN: Final = 5e-5  # of the largest kinetic energy
LEAST_ENERGY: Final = 1e-6  # kg px²/s²: with less than that, hardly anything had a velocity
SUSPECT: Final = 0.05  # of the largest kinetic energy: a line that is not the program's own, and worth a headline
UNSEEN: Final = 1.0  # px, by which what is at rest may sink in, sag or fall


class Cause(StrEnum):
    """What changes the energy of a Space, in words; if the solver's errors are in it, it is among ERRORS."""

    RESTITUTION = "restitution"  # normal impulses, with the restitution that the contact should have
    RESTITUTION_ERROR = "restitution other than elasticities say"  # it ended with another normal velocity than that
    FRICTION = "friction and surface velocities"
    KINEMATIC = "kinematic bodies that push"  # bodies of infinite mass that move
    DAMPING = "the Space's damping"
    FORCES = "forces and torques"  # Body.force and Body.torque
    # Work of gravity, less the potential energy of the way with the step's first velocity; contacts and joints against
    # what gravity, forces and damping did in the same step:
    INTEGRATION = "time step error of gravity and forces"
    CORRECTION = "overlap correction"  # against gravity
    # The impulses on bodies besides those of contacts:
    JOINTS = "joints"  # in steps in which nothing else pushes bodies; otherwise, with such bounces:
    DRIVEN = "motors, springs, joints that give way, functions, and what acts beside them"
    # Changed within the step by nothing that was recorded: handlers, and what they add and remove:
    CALLBACKS = "handlers and callbacks"
    PROGRAM = "the program: what it sets, adds and removes between steps"


ERRORS: Final = {Cause.RESTITUTION_ERROR, Cause.JOINTS}  # not CORRECTION: what is pushed out had fallen too far


@dataclass(frozen=True)
class Ledger:
    """The energy ledger of a run of n steps.

    time: (n + 1,) s; kinetic, potential: (n + 1,) kg px²/s², at these times, before the program's changes;
    work: (n,) kg px²/s² by each cause, of each step and of the program's changes before it; is_at_rest: whether all
    bodies are slower than after a fall by UNSEEN.
    """

    time: Floats
    kinetic: Floats
    potential: Floats
    work: dict[Cause, Floats]
    is_at_rest: bool = False

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
        return {cause: float(work.sum()) for cause, work in self.work.items()}

    @property
    def shares(self) -> dict[Cause, float]:
        """The lines as shares of the scale, the largest first; 0 if there was hardly any."""
        moved = self.scale >= LEAST_ENERGY
        shares = {cause: value / self.scale if moved else 0.0 for cause, value in self.lines.items()}
        return dict(sorted(shares.items(), key=lambda line: -abs(line[1])))

    @property
    def suspect(self) -> dict[Cause, float]:
        """Those shares above SUSPECT that neither the program nor what it set up explains; none at rest."""
        shares = {} if self.is_at_rest else self.shares
        return {cause: share for cause, share in shares.items() if cause in ERRORS and abs(share) > SUSPECT}

    def text(self) -> Iterator[str]:
        """Yield its balance in lines of text: how much energy there was, and what changed it."""
        scale = self.scale
        if scale < LEAST_ENERGY:
            yield "Its energy: hardly anything had a velocity."
            return
        since, until = self.time[[0, -1]].tolist()
        yield f"Its energy from {since:.4g} to {until:.4g} s, in % of the largest kinetic energy, {scale:.3g}:"
        lines = [line for line in self.shares.items() if abs(line[1]) >= SMALLEST_SHOWN]
        yield from (f"  {100 * share:+9.2f} %  {cause}" for cause, share in lines)
        yield f"  {100 * float(self.total[-1] - self.total[0]) / scale:+9.2f} %  together"

    def as_json(self) -> dict[str, Any]:
        """Return its balance as a JSON document has it: energies in kg px²/s², times in s."""
        return {
            "since": float(self.time[0]),
            "until": float(self.time[-1]),
            "start": float(self.total[0]),
            "end": float(self.total[-1]),
            "largest_kinetic": self.scale,
            "lines": {cause.name.lower(): value for cause, value in self.lines.items() if value},
        }


def _columns(rows: Rows, linear: str, angular: str) -> Floats:
    """Return two fields of each body as three columns, x, y and rotation, and a row of zeros: (n + 1, 3)."""
    columns = np.zeros((len(rows) + 1, 3))
    columns[:-1, :2].T[:] = rows[linear].T
    columns[:-1, 2] = rows[angular]
    return columns


def ledger_of(run: Run) -> Ledger:
    """Return the energy ledger of a run."""
    work = _Work(run).by_cause
    before, after = (np.array([getattr(step, at) for step in run.steps]).reshape(-1, 2) for at in ("before", "after"))
    kinetic, potential = np.vstack([run.start, after]).T
    total = kinetic + potential
    work[Cause.CALLBACKS] = total[1:] - before.sum(axis=1) - sum(work.values())
    work[Cause.PROGRAM] = before.sum(axis=1) - total[:-1]
    speed, pull = np.hypot(*run.new["velocity"].T), max((math.hypot(*step.gravity) for step in run.steps), default=0.0)
    return Ledger(run.time, kinetic, potential, work, bool((speed**2 < 2 * pull * UNSEEN).all()))


class _Work:
    """The work of all that acts within steps and is recorded.

    The motion of all bodies in all steps, (n + 1, 3) px/s and rad/s, is followed from `start`: damping with gravity and
    forces, then contacts. What bodies on joints have in the end besides that is the joints' impulse on them; of a body
    with functions of the program, all but its contacts. What other bodies have besides is by callbacks.
    """

    def __init__(self, run: Run) -> None:
        self.by_cause = {cause: np.zeros(len(run.steps)) for cause in Cause}
        self._run, self._contacts = run, run.contacts
        self._gravity = np.array([step.gravity for step in run.steps]).reshape(-1, 2)[run.step]
        self._mass = finite(_columns(run.new, "mass", "moment"))
        self._inverse = np.divide(1, self._mass, where=self._mass > 0, out=np.zeros_like(self._mass))
        self._handles = np.array([step.handles for step in run.steps], bool)
        self._drives = self._handles.copy()
        for step in (run.joint_step[~run.joints["is_hard"]], run.step[run.new["is_own"]]):
            self._drives[step] = True
        self._start, self._end = (_columns(rows, "velocity", "spin") for rows in (run.old, run.new))
        arms = [tangent(self._contacts[arm]) for arm in ("arm_a", "arm_b")]
        rows = [run.rows_of(run.contact_step, self._contacts[row]) for row in ("row_a", "row_b")]
        self._sides = [*zip((-1, 1), rows, arms, strict=True)]
        self._impulse = impulse_of(self._contacts)  # on B, and its reverse on A
        self._joined = np.array([run.rows_of(run.joint_step, run.joints[row]) for row in ("row_a", "row_b")])
        self._add()

    def _add(self) -> None:
        """Add the work of each cause."""
        run, updated, impulse = self._run, self._add_velocity_update(), np.zeros_like(self._start)
        for sign, rows, arm in self._sides:
            np.add.at(impulse, rows, sign * np.column_stack([self._impulse, dot(arm, self._impulse)]))
        pushed = updated + self._inverse * impulse
        is_free = np.append(~run.new["is_own"], True)
        is_free[self._joined] = False
        solved = np.where(is_free[:, None], pushed, self._end)
        self._add_contacts(updated, solved)
        self._add_rest(updated, solved - pushed)
        self._add_positions()

    def _book(self, cause: Cause, energy: Floats, step: Numbers) -> None:
        """Add energies of contacts or bodies, by the numbers of their steps."""
        self.by_cause[cause] += np.bincount(step, energy[: len(step)], len(self._run.steps))

    def _relative(self, motion: Floats) -> Floats:
        """Return the velocities of points of contact on B as seen from those on A."""
        a, b = (sign * (motion[rows, :2] + motion[rows, 2:] * arm) for sign, rows, arm in self._sides)
        return a + b

    def _add_rest(self, updated: Floats, rest: Floats) -> None:
        """Add the work of impulses besides those of contacts. rest: how much they changed the motion."""
        run, impulse = self._run, self._mass * rest
        drives = self._drives.copy()
        drives[run.joint_step[self._is_jolted()]] = True
        work, is_driven = (impulse * (self._start + self._end)).sum(axis=1) / 2, np.append(drives[run.step], False)
        self._book(Cause.JOINTS, work * ~is_driven, run.step)
        self._book(Cause.DRIVEN, work * is_driven, run.step)
        self._book(Cause.INTEGRATION, (impulse * (updated - self._start)).sum(axis=1) / 2, run.step)

    def _is_jolted(self) -> Bools:
        """Return whether joints are new, or the program changed the velocity of an end: that work is no error."""
        run, joints = self._run, self._run.joints
        is_set = (run.old["velocity"] != run.was["velocity"]).any(axis=1) | (run.old["spin"] != run.was["spin"])
        is_new = np.isin(np.arange(len(joints)), np.unique(joints["key"], return_index=True)[1])
        return np.asarray(is_new | np.append(is_set, False)[self._joined].any(axis=0))

    def _add_contacts(self, updated: Floats, solved: Floats) -> None:
        """Add the work of contacts: what is due by the velocities before the step, and the rest."""
        n = self._contacts["normal"]
        along = tangent(n)
        normal, tangential = self._contacts["impulse"], self._contacts["tangential"]
        velocities = [self._relative(motion) for motion in (self._start, updated, solved)]
        first, between, last = (dot(velocity, n) for velocity in velocities)
        slip = [dot(velocity, along) for velocity in velocities]
        target = -self._contacts["elasticity"] * np.minimum(first, 0)
        driven = self._relative(updated * (self._inverse == 0))  # by bodies of infinite mass, which have no energy
        error, is_driven = normal * (last - target + np.maximum(first, 0)), self._drives[self._run.contact_step]
        for cause, twice in (
            (Cause.RESTITUTION, normal * (np.minimum(first, 0) + target)),
            (Cause.RESTITUTION_ERROR, error * ~is_driven),
            (Cause.DRIVEN, error * is_driven),  # a contact that a motor presses does work against it
            (Cause.FRICTION, tangential * (slip[0] + slip[2])),
            (Cause.INTEGRATION, normal * (between - first) + tangential * (slip[1] - slip[0])),
            (Cause.KINEMATIC, -2 * dot(self._impulse, driven)),
        ):
            self._book(cause, twice / 2, self._run.contact_step)

    def _add_velocity_update(self) -> Floats:
        """Add the work of damping, gravity and forces, and return the motion after them."""
        run, old, new = self._run, self._run.old, self._run.new
        is_updated = np.isfinite(old["mass"]) & ~new["asleep"] & ~new["is_own"]
        dt = np.append(is_updated * run.dt[run.step], 0.0)[:, None]
        damping = np.append(np.array([step.damping for step in run.steps])[run.step], 1.0)[:, None]
        damped = self._start * damping**dt
        by_gravity = dt * np.pad(self._gravity, ((0, 1), (0, 1)))
        by_force = dt * self._inverse * _columns(old, "force", "torque")
        updated: Floats = damped + by_gravity + by_force
        momentum = self._mass * (damped + updated) / 2
        self._book(Cause.DAMPING, (self._mass * (damped**2 - self._start**2)).sum(axis=1) / 2, run.step)
        self._book(Cause.INTEGRATION, (by_gravity * momentum).sum(axis=1), run.step)
        self._book(Cause.FORCES, (by_force * momentum).sum(axis=1), run.step)
        return updated

    def _add_positions(self) -> None:
        """Add the change of potential energy, by the step's first velocity and by the rest of the displacement."""
        run, old = self._run, self._run.old
        weight, is_awake = finite(old["mass"])[:, None] * self._gravity, ~old["asleep"]
        is_own = run.new["is_own"] | self._handles[run.step]
        drift, way = (is_awake * run.dt[run.step])[:, None] * old["velocity"], run.new["position"] - old["position"]
        self._book(Cause.INTEGRATION, -dot(weight, drift) * ~is_own, run.step)
        self._book(Cause.CORRECTION, -dot(weight, way - drift) * (is_awake & ~is_own), run.step)
        self._book(Cause.DRIVEN, -dot(weight, way) * is_own, run.step)
