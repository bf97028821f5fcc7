"""The energy ledger of a Space: by what each step, and the program between steps, changed its mechanical energy.

The energy is kinetic, potential (of the centres of gravity, in the Space's gravity), and elastic (of springs with
Pymunk's own laws). Bodies of infinite mass have none, nor has the rotation of those with an infinite moment.

Chipmunk's step moves all bodies with the velocities that they have, finds contacts, adds the springs' impulses, then
damping, gravity and forces, then the impulses of contacts and joints. All impulses of a step act at fixed points, so a
set of impulses J that changes the relative velocity at these points from v to u does the work J · (v + u) / 2 exactly.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from sandbox.errors import SandboxError
from sandbox.quantity import dot
from sandbox.space.recording import JointKind, Rows, Settings, Snapshot, Step, knows_joints
from sandbox.state import Bools, Floats

LEAST_SHARE: Final = 0.005  # of the largest kinetic energy; smaller lines are printed together
SMALLEST_SHOWN: Final = 5e-5
LEAST_ENERGY: Final = 1e-6  # kg px²/s²: with less than that, nothing moved
MAX_SHARE: Final = 10.0  # of the largest kinetic energy: beyond, that is no measure of what changed
LARGEST: Final = 1e120  # px, px/s, rad or rad/s: beyond that, energies overflow
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
    FRICTION = "friction", "friction"
    SURFACE = "surface", "surface velocities"
    JOINTS = "joints", "joints", True  # all but motors and springs
    LIMITED_JOINTS = "limited_joints", "joints with a max_force"  # which may give way, as friction does
    MOTORS = "motors", "motors"
    SPRINGS = "springs", "springs with a law of the program"
    SPRING_DAMPING = "spring_damping", "dampers of springs"
    # Work of springs, less what they stored:
    SPRING_INTEGRATION = "spring_integration", "springs, in steps instead of at every moment", True
    KINEMATIC = "kinematic", "kinematic bodies that push"  # bodies of infinite mass that move
    DAMPING = "damping", "the Space's damping"
    FORCES = "forces", "forces and torques"  # Body.force and Body.torque
    # Work of gravity, less the potential energy of the way with the step's first velocity; contacts and joints against
    # what gravity, forces and damping did in the same step:
    INTEGRATION = "integration", STEPS
    CORRECTION = "correction", "bodies moved apart that overlapped", True  # against gravity
    FUNCTIONS = "functions", "velocity and position functions"
    # Changed within the step by nothing that was recorded: handlers, and what they removed:
    CALLBACKS = "callbacks", "handlers and callbacks"
    VELOCITY_SET = "velocity_set", "the program: velocities and impulses"  # between steps, as what follows
    POSITION_SET = "position_set", "the program: positions"
    SETTINGS_SET = "settings_set", "the program: masses, moments, gravity, springs"  # also springs that come and go
    ADDED = "added", "bodies added"
    REMOVED = "removed", "bodies removed"


Work = defaultdict[Cause, float]  # kg px²/s²
# By the number of its kind, whether a joint's impulse is angular or a vector, and whether it is a spring:
_KINDS: Final = np.arange(len(JointKind))
_ANGULAR: Final = _KINDS >= JointKind.ROTARY_SPRING
_VECTORS: Final = (_KINDS == JointKind.PIVOT) | (_KINDS == JointKind.GROOVE)
_SPRINGS: Final = (_KINDS == JointKind.SPRING) | (_KINDS == JointKind.ROTARY_SPRING)


@dataclass(frozen=True)
class Ledger:
    """The energy ledger of a run of n steps.

    time: (n + 1,) s; kinetic, potential, elastic: (n + 1,) kg px²/s², at these times, before the program's changes;
    work: (n, causes) kg px²/s², of each step and of the program's changes before it, in the order of Cause.
    """

    time: Floats
    kinetic: Floats
    potential: Floats
    elastic: Floats
    work: Floats

    @property
    def total(self) -> Floats:
        """(n + 1,) energy."""
        return self.kinetic + self.potential + self.elastic

    @property
    def scale(self) -> float:
        """What shares are of: the largest kinetic energy, or the largest elastic one if that is larger."""
        return float(max(self.kinetic.max(), self.elastic.max()))

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
        return self.work[:, list(Cause).index(cause)]

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


def ledger_of(steps: Iterable[Step]) -> Ledger:
    """Return the energy ledger of successive steps, of which there is at least one.

    It ends before the first step that leaves a number which is not finite.
    """
    steps = list(steps)
    if not steps:
        raise SandboxError("no step was recorded")
    history = _ContactHistory(steps[0].before)
    works: list[Work] = []
    first = steps[0]
    energies = [(*_energies(first.before), _elastic_energy(first.after, first.before))]
    for number, step in enumerate(steps):
        if not is_within(LARGEST, step.after):
            break
        works.append(defaultdict(float))
        if number:
            _add_program(works[-1], steps[number - 1], step)
        _StepWork(step, history, works[-1]).add()
        energies.append((*_energies(step.after), _elastic_energy(step.after, step.after)))
    time = np.array([first.time, *(step.end for step in steps[: len(works)])])
    work = np.array([[work[cause] for cause in Cause] for work in works]).reshape(len(works), len(Cause))
    kinetic, potential, elastic = np.array(energies).T
    return Ledger(time, kinetic, potential, elastic, work)


def is_within(largest: float, state: Snapshot) -> bool:
    """Return whether all places and velocities are numbers below a bound, px, px/s, rad and rad/s."""
    keys = ("position", "velocity", "angle", "spin")
    return all(bool((np.abs(state.bodies[key]) < largest).all()) for key in keys)


def common(old: Rows, new: Rows) -> tuple[Rows, Rows]:
    """Return the bodies that two tables have in common."""
    if np.array_equal(old["id"], new["id"]):
        return old, new
    _, first, second = np.intersect1d(old["id"], new["id"], return_indices=True)
    return old[first], new[second]


class Index:
    """Finds rows by their keys, such as bodies by their ids. What is unknown is in a row after the last."""

    def __init__(self, keys: Rows) -> None:
        self._order = np.argsort(keys)
        self._keys = keys[self._order]

    def rows(self, wanted: Rows) -> NDArray[np.intp]:
        """Return the row of each key, or the number of rows if it is unknown."""
        if not len(self._keys):
            return np.zeros(wanted.shape, np.intp)
        place = np.minimum(np.searchsorted(self._keys, wanted), len(self._keys) - 1)
        return np.where(self._keys[place] == wanted, self._order[place], len(self._keys))


def turned(a: Floats) -> Floats:
    """Return vectors turned by +90°."""
    return np.stack([-a[..., 1], a[..., 0]], axis=-1)


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def with_static(values: Floats) -> Floats:
    """Return values of bodies, and a row of zeros for what is not in the Space."""
    return np.concatenate([values, np.zeros((1, *values.shape[1:]))])


def _finite(value: Floats) -> Floats:
    """Return masses or moments, 0 for infinite ones, which have no energy here."""
    return np.asarray(np.where(np.isfinite(value), value, 0.0))


def _kinetic(of: Rows, motion: Rows) -> Floats:
    """Return the kinetic energy of each body: with the masses and moments of one table, the motion of another."""
    v = motion["velocity"]
    return np.asarray((_finite(of["mass"]) * dot(v, v) + _finite(of["moment"]) * motion["spin"] ** 2) / 2)


def _potential(of: Rows, position: Floats, gravity: tuple[float, float]) -> Floats:
    """Return the potential energy of each body."""
    return np.asarray(-_finite(of["mass"]) * (position @ np.array(gravity)))


def _energies(state: Snapshot) -> tuple[float, float]:
    """Return the kinetic and the potential energy."""
    bodies = state.bodies
    kinetic, potential = _kinetic(bodies, bodies), _potential(bodies, bodies["position"], state.settings.gravity)
    return float(kinetic.sum()), float(potential.sum())


def _is_default_spring(joints: Rows) -> Bools:
    """Return which joints are springs with Pymunk's own law."""
    return np.asarray(_SPRINGS[joints["kind"]] & ~joints["own_law"])


def _strain(springs: Rows, read: Snapshot, state: Snapshot) -> Floats:
    """Return how much longer springs are than at rest, px, or their angle less that at rest, rad.

    read: the snapshot which the springs are of; state: that of the bodies' places.
    """
    ends, angles = [], []
    then, now = read.bodies, state.bodies
    index_then, index_now = Index(then["id"]), Index(now["id"])
    for side in ("a", "b"):
        rows = index_now.rows(springs[f"body_{side}"])
        angle = with_static(now["angle"])[rows]
        turn = (angle - with_static(then["angle"])[index_then.rows(springs[f"body_{side}"])])[:, None]
        arm = springs[f"arm_{side}"]
        ends.append(with_static(now["position"])[rows] + np.cos(turn) * arm + np.sin(turn) * turned(arm))
        angles.append(angle)
    length = np.linalg.norm(ends[1] - ends[0], axis=1)
    is_angular = springs["kind"] == JointKind.ROTARY_SPRING
    return np.asarray(np.where(is_angular, angles[0] - angles[1], length) - springs["setting"][:, 0])


def _stored_energy(springs: Rows, read: Snapshot, state: Snapshot) -> Floats:
    """Return the elastic energy of each spring."""
    return np.asarray(springs["setting"][:, 1] * _strain(springs, read, state) ** 2 / 2)


def _elastic_energy(read: Snapshot, state: Snapshot) -> float:
    """Return the elastic energy of all springs with Pymunk's own law, for the places in a state."""
    springs = read.joints[_is_default_spring(read.joints)]
    return float(_stored_energy(springs, read, state).sum()) if len(springs) else 0.0


def _add_program(work: Work, previous: Step, step: Step) -> None:
    """Add what the program changed between two steps."""
    old, new = previous.after, step.before
    work[Cause.SETTINGS_SET] += _elastic_energy(step.after, new) - _elastic_energy(old, old)
    if old is new:
        return
    gravity = old.settings.gravity
    a, b = common(old.bodies, new.bodies)
    work[Cause.VELOCITY_SET] += (_kinetic(a, b) - _kinetic(a, a)).sum()
    work[Cause.POSITION_SET] += _potential(a, b["position"] - a["position"], gravity).sum()
    work[Cause.SETTINGS_SET] += _change_by_mass(a, b, b, gravity)
    _add_membership(work, old, new)


def _change_by_mass(old: Rows, new: Rows, state: Rows, gravity: tuple[float, float]) -> float:
    """Return the change of energy when bodies in a state get other masses and moments."""
    energies = [_kinetic(of, state) + _potential(of, state["position"], gravity) for of in (old, new)]
    return float((energies[1] - energies[0]).sum())


def _add_membership(work: Work, old: Snapshot, new: Snapshot) -> None:
    """Add the energies of bodies that came and went, and of a change of gravity."""
    gravity = old.settings.gravity
    for cause, sign, bodies, others in (
        (Cause.ADDED, 1, new.bodies, old.bodies),
        (Cause.REMOVED, -1, old.bodies, new.bodies),
    ):
        rows = (
            bodies[:0] if np.array_equal(bodies["id"], others["id"]) else bodies[~np.isin(bodies["id"], others["id"])]
        )
        work[cause] += sign * (_kinetic(rows, rows) + _potential(rows, rows["position"], gravity)).sum()
    change = new.settings.gravity[0] - gravity[0], new.settings.gravity[1] - gravity[1]
    work[Cause.SETTINGS_SET] += _potential(new.bodies, new.bodies["position"], change).sum()


class _ContactHistory:
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
        pair = pair_key(contacts)
        key = pair ^ contacts["hash"]
        missing = np.arange(len(contacts))
        for cached in self._steps:
            if len(cached) and len(missing):
                cached_pair = pair_key(cached)
                at = Index(cached_pair ^ cached["hash"]).rows(key[missing])
                hit = at < len(cached)
                start[missing[hit]] = np.stack([cached["impulse"], cached["tangential"]], axis=1)[at[hit]]
                missing = missing[~np.isin(pair[missing], cached_pair)]  # a pair has the points of its last contact
        self._steps = [contacts, *self._steps][: step.after.settings.persistence]
        share = np.where(contacts["is_first"], -1.0, _cached_share(step) - 1)
        return contacts["impulse"] + share * start[:, 0], contacts["tangential"] + share * start[:, 1]


def _cached_share(step: Step) -> float:
    """Return the part of cached impulses that a step applies at its start."""
    dt = step.before.settings.dt
    return step.dt / dt if dt else 0.0


def pair_key(contacts: Rows) -> Rows:
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


class _Impulses:
    """Impulses that act together, summed for each of n bodies."""

    def __init__(self, count: int) -> None:
        self._linear, self._angular = np.zeros((count + 1, 2)), np.zeros(count + 1)

    def add(self, rows: NDArray[np.intp], arm: Floats, impulse: Floats, angular: Floats | float = 0.0) -> None:
        np.add.at(self._linear, rows, impulse)
        np.add.at(self._angular, rows, _cross(arm, impulse) + angular)

    def change(self, motion: _Motion, inverse: tuple[Floats, Floats], sign: int) -> _Motion:
        """Return the motion with the impulses (sign 1), or without them (-1)."""
        return _Motion(
            motion.velocity + sign * inverse[0][:, None] * self._linear, motion.spin + sign * inverse[1] * self._angular
        )

    def on_infinite(self, motion: _Motion, inverse: tuple[Floats, Floats]) -> float:
        """Return the work done on what has no energy: bodies of infinite mass, and spins of infinite moments."""
        linear = dot(self._linear, motion.velocity)[inverse[0] == 0].sum()
        return float(linear + (self._angular * motion.spin)[inverse[1] == 0].sum())


class _Joints(NamedTuple):
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
        return np.asarray(dot(self.linear, velocity) + turning)

    def act(self, impulses: _Impulses) -> None:
        """Add the impulses to those of their bodies."""
        impulses.add(self.a, self.rows["arm_a"], -self.linear, -self.angular_on_a)
        impulses.add(self.b, self.rows["arm_b"], self.linear, self.angular)


class _StepWork:
    """The work of all that acts within a step, added to `work` by cause.

    The motion is followed from `start`: springs, damping with gravity and forces, velocity functions, then contacts and
    joints. What differs from this in the end is by callbacks. Of velocity functions, only the result is known, from the
    end without the impulses.
    """

    def __init__(self, step: Step, history: _ContactHistory, work: Work) -> None:
        self._step, self._after, self._work = step, step.after.bodies, work
        self._index = Index(self._after["id"])
        rows = Index(step.before.bodies["id"]).rows(self._after["id"])
        self._is_new = rows == len(step.before.bodies)
        self._before = self._after.copy()  # a body that a callback added in the step has no part in it
        self._before[~self._is_new] = step.before.bodies[rows[~self._is_new]]
        self._mass, self._moment = (with_static(_finite(self._after[key])) for key in ("mass", "moment"))
        inverse = [np.divide(1, of, where=of > 0, out=np.zeros_like(of)) for of in (self._mass, self._moment)]
        self._inverse = inverse[0], inverse[1]
        self._start = _Motion(with_static(self._before["velocity"]), with_static(self._before["spin"]))
        self._end = _Motion(with_static(self._after["velocity"]), with_static(self._after["spin"]))
        self._contact_impulses = history.applied(step)

    def add(self) -> None:
        """Add the work of each cause."""
        springs, joints = self._joint_impulses()
        first, last = _Impulses(len(self._after)), _Impulses(len(self._after))
        for each, impulses in ((springs, first), (joints, last)):
            if len(each.rows):
                each.act(impulses)
        self._sum_contacts(last)
        sprung = first.change(self._start, self._inverse, 1)
        updated = self._add_velocity_update(sprung)
        unsolved, without = updated, last.change(self._end, self._inverse, -1)
        if (own := with_static(self._after["own_velocity"].astype(float)) == 1).any():
            unsolved = _Motion(
                np.where(own[:, None], without.velocity, updated.velocity), np.where(own, without.spin, updated.spin)
            )
        solved = last.change(unsolved, self._inverse, 1)
        self._work[Cause.FUNCTIONS] += self._energy(unsolved) - self._energy(updated)
        self._work[Cause.CALLBACKS] += self._energy(self._end) - self._energy(solved)
        self._add_contacts(unsolved, solved)
        self._add_springs(springs, sprung)
        self._add_joints(joints, unsolved, solved)
        for impulses, motions in ((first, (self._start, sprung)), (last, (unsolved, solved))):
            self._work[Cause.KINEMATIC] -= sum(impulses.on_infinite(motion, self._inverse) for motion in motions) / 2
        self._add_positions()
        before, gravity = self._before, self._settings.gravity
        self._work[Cause.SETTINGS_SET] += _change_by_mass(before, self._after, before, gravity)
        _add_membership(self._work, self._step.before, self._step.after)

    @property
    def _settings(self) -> Settings:
        return self._step.before.settings

    def _joint_impulses(self) -> tuple[_Joints, _Joints]:
        """Return the impulses of springs at the start of the step, and of all joints after it: on B.

        A spring's impulse at the start is recomputed from its law; a spring of the program's own law counts as a joint.
        """
        after, before = self._step.after, self._step.before.joints
        rows = after.joints
        start = with_static(before["impulse"])[Index(before["key"]).rows(rows["key"])]
        is_spring = _SPRINGS[rows["kind"]]
        applied = rows["impulse"] + np.where(is_spring[:, None], 0.0, (_cached_share(self._step) - 1) * start)
        applied[rows["is_free"]] = 0.0
        is_default = _is_default_spring(rows)
        springs = rows[is_default]
        sign = np.where(springs["kind"] == JointKind.SPRING, -1.0, 1.0)
        strain = _strain(springs, after, after) if len(springs) else np.empty(0)
        force = sign * springs["setting"][:, 1] * strain
        force = np.clip(force, -springs["max_force"], springs["max_force"]) * self._step.dt
        applied[is_default, 0] -= force
        return self._joints(springs, np.stack([force, 0 * force], axis=1)), self._joints(rows, applied)

    def _joints(self, rows: Rows, impulse: Floats) -> _Joints:
        """Return joints with the impulses that they apply."""
        linear = np.where(_VECTORS[rows["kind"]][:, None], impulse, impulse[:, :1] * rows["normal"])
        is_angular = _ANGULAR[rows["kind"]]
        angular = np.where(is_angular, impulse[:, 0], 0.0)
        is_gear = rows["kind"] == JointKind.GEAR
        ratio = np.divide(1, rows["setting"][:, 1], where=is_gear, out=np.ones(len(rows)))
        linear = np.where(is_angular[:, None], 0.0, linear)
        a, b = self._index.rows(rows["body_a"]), self._index.rows(rows["body_b"])
        return _Joints(rows, a, b, linear, angular, angular * ratio)

    def _sum_contacts(self, impulses: _Impulses) -> None:
        contacts = self._step.after.contacts
        n, (normal, tangential) = contacts["normal"], self._contact_impulses
        impulse = normal[:, None] * n + tangential[:, None] * turned(n)
        impulses.add(self._index.rows(contacts["body_a"]), contacts["arm_a"], -impulse)
        impulses.add(self._index.rows(contacts["body_b"]), contacts["arm_b"], impulse)

    def _add_contacts(self, unsolved: _Motion, solved: _Motion) -> None:
        """Add the work of contacts: what is due by the velocities before the step, and the rest."""
        contacts = self._step.after.contacts
        if not len(contacts):
            return
        n, e = contacts["normal"], contacts["elasticity"]
        normal, tangential = self._contact_impulses
        a, b = self._index.rows(contacts["body_a"]), self._index.rows(contacts["body_b"])
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
        self._work[Cause.INTEGRATION] += support.sum() / 2

    def _add_springs(self, springs: _Joints, sprung: _Motion) -> None:
        """Add the work of springs at the start of the step, and the energy that they store."""
        rows, after = springs.rows, self._step.after
        if len(rows):
            work = (springs.power(self._start) + springs.power(sprung)) / 2
            stored = _stored_energy(rows, after, after) - _stored_energy(rows, after, self._step.before)
            self._work[Cause.SPRING_INTEGRATION] += (work + stored).sum()

    def _add_joints(self, joints: _Joints, unsolved: _Motion, solved: _Motion) -> None:
        """Add the work of joints, and of the dampers of springs."""
        if not len(joints.rows):
            return
        kind, is_damper = joints.rows["kind"], _is_default_spring(joints.rows)
        before, between, after = (joints.power(motion) for motion in (self._start, unsolved, solved))
        support = np.where(is_damper, 0.0, (between - before) / 2)
        work = (between + after) / 2 - support
        is_spring, is_motor = _SPRINGS[kind] & ~is_damper, kind == JointKind.MOTOR
        self._work[Cause.INTEGRATION] += support.sum()
        self._work[Cause.SPRING_DAMPING] += work[is_damper].sum()
        self._work[Cause.SPRINGS] += work[is_spring].sum()
        self._work[Cause.MOTORS] += work[is_motor].sum()
        is_joint, is_limited = ~(is_damper | is_spring | is_motor), np.isfinite(joints.rows["max_force"])
        self._work[Cause.JOINTS] += work[is_joint & ~is_limited].sum()
        self._work[Cause.LIMITED_JOINTS] += work[is_joint & is_limited].sum()

    def _energy(self, motion: _Motion) -> float:
        """Return the kinetic energy of all bodies in a motion."""
        energies = self._mass * dot(motion.velocity, motion.velocity) + self._moment * motion.spin**2
        return float(energies.sum()) / 2

    def _add_velocity_update(self, sprung: _Motion) -> _Motion:
        """Add the work of damping, gravity and forces, and return the motion after them."""
        step, before = self._step, self._before
        is_moved = np.isfinite(before["mass"]) & ~self._after["asleep"] & ~self._is_new
        is_updated = with_static(is_moved.astype(float))
        left = np.where(is_updated == 1, self._settings.damping**step.dt, 1.0)
        damped = _Motion(left[:, None] * sprung.velocity, left * sprung.spin)
        by_gravity = is_updated[:, None] * np.array(self._settings.gravity) * step.dt
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
        before, gravity = self._before, self._settings.gravity
        is_awake = ~before["asleep"] & ~self._is_new
        drift = np.where(is_awake[:, None], before["velocity"] * self._step.dt, 0.0)
        rest = self._after["position"] - before["position"] - drift
        self._work[Cause.INTEGRATION] += _potential(before, drift, gravity).sum()
        change, own = _potential(before, rest, gravity), self._after["own_position"]
        self._work[Cause.FUNCTIONS] += change[own].sum()
        self._work[Cause.CORRECTION] += change[is_awake & ~own].sum()
        self._work[Cause.CALLBACKS] += change[~is_awake & ~own].sum()
