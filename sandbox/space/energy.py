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
from sandbox.space.recording import (
    FIRST_ANGULAR,
    MOTOR,
    SPRINGS,
    VECTORS,
    Numbers,
    Rows,
    Run,
    Snapshot,
    knows_joints,
)
from sandbox.state import Floats

LEAST_SHARE: Final = 0.005  # of the largest kinetic energy; smaller lines are printed together
SMALLEST_SHOWN: Final = 5e-5
LEAST_ENERGY: Final = 1e-6  # kg px²/s²: with less than that, nothing moved
MAX_SHARE: Final = 10.0  # of the largest kinetic energy: beyond, that is no measure of what changed
SUSPECT: Final = 0.05  # of the largest kinetic energy: a line that is not the program's own, and worth a headline
STEPS: Final = "gravity and what bears it, in steps instead of at every moment"


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
    JOINTS = "joints", "joints", True  # all but motors and springs
    LIMITED_JOINTS = "limited_joints", "joints with a max_force"  # which may give way, as friction does
    MOTORS = "motors", "motors"
    SPRINGS = "springs", "springs and their dampers"
    KINEMATIC = "kinematic", "kinematic bodies that push"  # bodies of infinite mass that move
    DAMPING = "damping", "the Space's damping"
    FORCES = "forces", "forces and torques"  # Body.force and Body.torque
    # Work of gravity, less the potential energy of the way with the step's first velocity; contacts and joints against
    # what gravity, forces and damping did in the same step:
    INTEGRATION = "integration", STEPS
    CORRECTION = "correction", "bodies moved apart that overlapped", True  # against gravity
    FUNCTIONS = "functions", "velocity and position functions"
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
        shares = {_words(cause): value / self.scale if self.scale else 0.0 for cause, value in self.lines.items()}
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
        scale, shares = self.scale, self.shares
        if scale < LEAST_ENERGY:
            yield "Its energy: nothing moved."
            return
        since, until = self.time[[0, -1]].tolist()
        is_small = max(map(abs, shares.values()), default=0.0) > MAX_SHARE
        unit = "kg px²/s²; its largest kinetic energy is" if is_small else "% of the largest kinetic energy,"
        yield f"Its energy from {since:.4g} to {until:.4g} s, in {unit} {scale:.3g}:"
        large = {words: share for words, share in shares.items() if abs(share) >= LEAST_SHARE}
        change = float(self.total[-1] - self.total[0]) / scale
        rest = change - sum(large.values())
        lines = [*large.items(), *([("all else", rest)] if abs(rest) >= SMALLEST_SHOWN else []), ("together", change)]
        for words, share in lines:
            yield f"  {share * scale:+12.3g}  {words}" if is_small else f"  {100 * share:+9.2f} %  {words}"

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


def _words(cause: Cause) -> str:
    is_all = cause is Cause.CALLBACKS and not knows_joints()
    return "joints, motors, springs, handlers: in one, as this Pymunk is not known" if is_all else cause.words


def turned(a: Floats) -> Floats:
    """Return vectors turned by +90°."""
    return np.stack([-a[..., 1], a[..., 0]], axis=-1)


def _finite(value: Floats) -> Floats:
    """Return masses or moments, 0 for infinite ones, which have no energy here."""
    return np.asarray(np.where(np.isfinite(value), value, 0.0))


def _potential(of: Rows, position: Floats, gravity: Floats) -> Floats:
    """Return the potential energy of each body."""
    return -_finite(of["mass"]) * dot(position, gravity)


def ledger_of(run: Run) -> Ledger:
    """Return the energy ledger of a run."""
    work = np.zeros((len(run.steps), len(Cause)))
    _Work(run, work).add()
    states = [run.first, *(step.after for step in run.steps)]
    kinetic, potential = np.array([_energies(state) for state in states]).T
    total, before = kinetic + potential, np.array([sum(_energies(step.before)) for step in run.steps])
    work[:, _COLUMN[Cause.CALLBACKS]] = total[1:] - before - work.sum(axis=1)
    work[:, _COLUMN[Cause.PROGRAM]] = before - total[:-1]
    return Ledger(run.time, kinetic, potential, work)


def _energies(state: Snapshot) -> tuple[float, float]:
    """Return the kinetic and the potential energy of all bodies."""
    bodies, v = state.bodies, state.bodies["velocity"]
    kinetic = (_finite(bodies["mass"]) * dot(v, v) + _finite(bodies["moment"]) * bodies["spin"] ** 2) / 2
    return float(kinetic.sum()), float(_potential(bodies, bodies["position"], np.array(state.settings.gravity)).sum())


class _Motion(NamedTuple):
    """Velocities of all bodies in all steps, and a row of zeros: (n + 1, 2) px/s and (n + 1,) rad/s."""

    velocity: Floats
    spin: Floats

    def at(self, rows: Numbers, arm: Floats) -> Floats:
        """Return the velocities of points on bodies."""
        return self.velocity[rows] + self.spin[rows][:, None] * turned(arm)

    def plus(self, velocity: Floats, spin: Floats) -> "_Motion":
        return _Motion(self.velocity + velocity, self.spin + spin)


class _Links(NamedTuple):
    """Contacts or joints: the rows of their bodies, and the impulses that they apply to B, and to A the opposite.

    linear: (k, 2) kg px/s; angular, angular_a: (k,) kg px²/s, the latter on A, against the sense of the former.
    """

    step: Numbers
    rows: Rows
    a: Numbers
    b: Numbers
    linear: Floats
    angular: Floats
    angular_a: Floats

    def relative(self, motion: _Motion) -> Floats:
        """Return the velocities of the points on B as seen from those on A."""
        return motion.at(self.b, self.rows["arm_b"]) - motion.at(self.a, self.rows["arm_a"])

    def power(self, motion: _Motion) -> Floats:
        """Return the impulses times the velocities on which they act."""
        turning = self.angular * motion.spin[self.b] - self.angular_a * motion.spin[self.a]
        return np.asarray(dot(self.linear, self.relative(motion)) + turning)

    def act(self, linear: Floats, angular: Floats) -> None:
        """Add the impulses to those of their bodies."""
        for rows, arm, sign, turning in ((self.a, "arm_a", -1, self.angular_a), (self.b, "arm_b", 1, self.angular)):
            np.add.at(linear, rows, sign * self.linear)
            np.add.at(angular, rows, sign * (dot(turned(self.rows[arm]), self.linear) + turning))


class _Work:
    """The work of all that acts within steps, added to a ledger's by cause.

    The motion is followed from `start`: damping with gravity and forces, velocity functions, then springs, contacts and
    joints. What differs from this in the end is by callbacks. Of velocity functions, only the result is known, from the
    end without the impulses.
    """

    def __init__(self, run: Run, work: Floats) -> None:
        self._run, self._work = run, work
        self._step, old, new = run.moved
        self._old, self._new = old, new
        self._gravity = np.array([step.before.settings.gravity for step in run.steps]).reshape(-1, 2)[self._step]
        mass, moment = (np.append(_finite(new[key]), 0.0) for key in ("mass", "moment"))
        self._mass, self._moment = mass, moment
        self._inverse = [np.divide(1, of, where=of > 0, out=np.zeros_like(of)) for of in (mass, moment)]
        self._start, self._end = (
            _Motion(np.append(of["velocity"], [[0, 0]], axis=0), np.append(of["spin"], 0)) for of in (old, new)
        )

    def add(self) -> None:
        """Add the work of each cause."""
        contacts, joints = self._contacts(), self._joints()
        linear, angular = np.zeros_like(self._start.velocity), np.zeros_like(self._start.spin)
        contacts.act(linear, angular)
        joints.act(linear, angular)
        kick = self._inverse[0][:, None] * linear, self._inverse[1] * angular
        updated = self._add_velocity_update()
        own = np.append(self._new["own_velocity"], False)
        unsolved = _Motion(
            np.where(own[:, None], self._end.velocity - kick[0], updated.velocity),
            np.where(own, self._end.spin - kick[1], updated.spin),
        )
        solved = unsolved.plus(*kick)
        self._book(Cause.FUNCTIONS, self._energy(unsolved) - self._energy(updated))
        rest = self._energy(self._end) - self._energy(solved)
        self._book(Cause.SPRINGS, rest * self._is_sprung(joints))
        self._add_contacts(contacts, unsolved, solved)
        self._add_joints(joints, unsolved, solved)
        on_infinite = dot(linear, unsolved.velocity) * (self._inverse[0] == 0)
        on_infinite += angular * unsolved.spin * (self._inverse[1] == 0)
        self._book(Cause.KINEMATIC, -on_infinite)
        self._add_positions()

    def _book(self, cause: Cause, energy: Floats, step: Numbers | None = None) -> None:
        """Add energies of some steps, or of each body in each step."""
        step = self._step if step is None else step
        np.add.at(self._work[:, _COLUMN[cause]], step, energy[: len(step)])

    def _energy(self, motion: _Motion) -> Floats:
        energies = self._mass * dot(motion.velocity, motion.velocity) + self._moment * motion.spin**2
        return np.asarray(energies / 2)

    def _is_sprung(self, joints: _Links) -> Any:
        """Return which bodies a spring moved before the damping of their step, which their work here is after."""
        is_sprung = np.zeros(len(self._mass), bool)
        for rows in (joints.a, joints.b):
            is_sprung[rows[np.isin(joints.rows["kind"], SPRINGS)]] = True
        is_damped = np.array([step.before.settings.damping != 1 for step in self._run.steps], bool)
        return is_sprung & np.append(is_damped[self._step], False)

    def _links(self, step: Numbers, rows: Rows, linear: Floats, angular: Floats, ratio: Floats) -> _Links:
        a, b = (self._run.rows_of(step, rows[side]) for side in ("body_a", "body_b"))
        return _Links(step, rows, a, b, linear, angular, angular * ratio)

    @property
    def _cached_share(self) -> Floats:
        """The part of cached impulses that each step applies at its start: (K,)."""
        last = np.array([step.before.settings.dt for step in self._run.steps])
        return np.asarray(np.divide(self._run.dt, last, where=last > 0, out=np.zeros_like(last)))

    def _contacts(self) -> _Links:
        """Return the contacts with the impulses that the steps applied.

        Of an accumulated impulse, the solver applies what it adds to the cached one, and the cached one itself times
        the ratio of dt to that of the step before. If the shapes touch for the first time after some steps, of which
        there are at most `collision_persistence`, the cached one is not applied.
        """
        step, rows = self._run.contacts
        pair = pair_key(rows)
        last, of_pair = _previous(pair ^ rows["hash"], step), _previous(pair, step)
        persistence = np.array([each.after.settings.persistence for each in self._run.steps], int)[step]
        is_cached = (last >= 0) & (step[last] == step[of_pair]) & (step - step[last] <= persistence)
        share = np.where(is_cached, np.where(rows["is_first"], -1.0, self._cached_share[step] - 1), 0.0)
        applied = [rows[key] + share * rows[key][last] for key in ("impulse", "tangential")]
        linear = applied[0][:, None] * rows["normal"] + applied[1][:, None] * turned(rows["normal"])
        return self._links(step, rows, linear, np.zeros(len(rows)), np.ones(len(rows)))

    def _joints(self) -> _Links:
        """Return the joints with the impulses that the steps applied; a spring's is not cached."""
        step, rows = self._run.joints
        kind, impulse = rows["kind"], rows["impulse"]
        last = _previous(rows["key"], step)
        is_cached = (last >= 0) & ~np.isin(kind, SPRINGS)
        share = np.where(is_cached, self._cached_share[step] - 1, 0.0)
        applied = (impulse + share[:, None] * impulse[last]) * ~rows["is_free"][:, None]
        is_angular = kind >= FIRST_ANGULAR
        linear = np.where(np.isin(kind, VECTORS)[:, None], applied, applied[:, :1] * rows["normal"])
        linear[is_angular] = 0.0
        return self._links(step, rows, linear, np.where(is_angular, applied[:, 0], 0.0), rows["ratio"])

    def _add_contacts(self, contacts: _Links, unsolved: _Motion, solved: _Motion) -> None:
        """Add the work of contacts: what is due by the velocities before the step, and the rest."""
        step, rows = contacts.step, contacts.rows
        n, tangent = rows["normal"], turned(rows["normal"])
        normal, tangential = dot(contacts.linear, n), dot(contacts.linear, tangent)
        velocities = [contacts.relative(motion) for motion in (self._start, unsolved, solved)]
        first, between, last = (dot(velocity, n) for velocity in velocities)
        slip = [dot(velocity, tangent) for velocity in velocities]
        target = -rows["elasticity"] * np.minimum(first, 0)
        support = normal * (between - first) + tangential * (slip[1] - slip[0])
        for cause, twice in (
            (Cause.RESTITUTION, normal * (np.minimum(first, 0) + target)),
            (Cause.RESTITUTION_ERROR, normal * (last - target + np.maximum(first, 0))),
            (Cause.FRICTION, tangential * (slip[0] + slip[2])),
            (Cause.INTEGRATION, support),
        ):
            self._book(cause, twice / 2, step)

    def _add_joints(self, joints: _Links, unsolved: _Motion, solved: _Motion) -> None:
        """Add the work of joints, by their kinds."""
        kind, is_limited = joints.rows["kind"], np.isfinite(joints.rows["max_force"])
        before, between, after = (joints.power(motion) for motion in (self._start, unsolved, solved))
        self._book(Cause.INTEGRATION, (between - before) / 2, joints.step)
        is_spring, is_motor = np.isin(kind, SPRINGS), kind == MOTOR
        is_joint = ~is_spring & ~is_motor
        for cause, chosen in (
            (Cause.SPRINGS, is_spring),
            (Cause.MOTORS, is_motor),
            (Cause.JOINTS, is_joint & ~is_limited),
            (Cause.LIMITED_JOINTS, is_joint & is_limited),
        ):
            self._book(cause, (before + after)[chosen] / 2, joints.step[chosen])

    def _add_velocity_update(self) -> _Motion:
        """Add the work of damping, gravity and forces, and return the motion after them."""
        old, dt, start = self._old, self._run.dt[self._step], self._start
        is_updated = np.isfinite(old["mass"]) & ~self._new["asleep"]
        damping = np.array([step.before.settings.damping for step in self._run.steps])[self._step] ** dt
        left = np.append(np.where(is_updated, damping, 1.0), 1.0)
        damped = _Motion(left[:, None] * start.velocity, left * start.spin)
        for_dt = np.append(is_updated * dt, 0.0)
        by_gravity = for_dt[:, None] * np.append(self._gravity, [[0, 0]], axis=0)
        by_force = (for_dt * self._inverse[0])[:, None] * np.append(old["force"], [[0, 0]], axis=0)
        by_torque = for_dt * self._inverse[1] * np.append(old["torque"], 0)
        updated = damped.plus(by_gravity + by_force, by_torque)
        mean, spin = (damped.velocity + updated.velocity) / 2, (damped.spin + updated.spin) / 2
        self._book(Cause.DAMPING, self._energy(damped) - self._energy(start))
        self._book(Cause.INTEGRATION, self._mass * dot(by_gravity, mean))
        self._book(Cause.FORCES, self._mass * dot(by_force, mean) + self._moment * by_torque * spin)
        return updated

    def _add_positions(self) -> None:
        """Add the change of potential energy, by the step's first velocity and by the rest of the displacement."""
        old, own, gravity = self._old, self._new["own_position"], self._gravity
        is_awake = ~old["asleep"]
        drift = (is_awake * self._run.dt[self._step])[:, None] * old["velocity"]
        self._book(Cause.INTEGRATION, _potential(old, drift, gravity))
        change = _potential(old, self._new["position"] - old["position"] - drift, gravity)
        self._book(Cause.FUNCTIONS, change * own)
        self._book(Cause.CORRECTION, change * (is_awake & ~own))


def _previous(keys: Rows, step: Numbers) -> Numbers:
    """Return, for each row, the first row with its key in the latest earlier step that has the key, or -1: (rows,)."""
    _, key = np.unique(keys, return_inverse=True)
    count = step.max(initial=0) + 1
    codes, first, group = np.unique(key * count + step, return_index=True, return_inverse=True)
    is_known = (group > 0) & (codes[group - 1] // count == key)
    return np.where(is_known, first[group - 1], -1)


def pair_key(contacts: Rows, of: str = "shape") -> Rows:
    """Return a number for the two shapes, or bodies, of each contact, whichever is A."""
    a, b = contacts[f"{of}_a"], contacts[f"{of}_b"]
    low, high = np.minimum(a, b), np.maximum(a, b)
    mixed: Rows = low * np.uint64(0x9E3779B97F4A7C15) + high * np.uint64(0xC2B2AE3D27D4EB4F)
    return mixed
