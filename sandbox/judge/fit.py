"""Which error models leave nothing over of a step: those with the fewest parameters first, and then all that do.

A parameter is fitted by Gauss and Newton's method from the best points of a grid: the residual of a step that a model
explains goes to the noise floor, and that of one which it does not explain stays.
"""

from collections.abc import Sequence
from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.groups import scratch_for
from sandbox.judge.law import LAW, Laws, Place, Scope, When, law
from sandbox.judge.models import BY_NAME, FAULTS, Fault, Fields, rules, scopes
from sandbox.judge.one_step import MET, Group, run_laws
from sandbox.judge.thresholds import LEFT_OVER
from sandbox.state import Floats

GRID: Final = 17  # points of a parameter's range from which a fit may begin
STARTS: Final = 4  # of these, the best, from which it does: a contact that moves to the start of the step has no slope
ROUNDS: Final = 8  # of Gauss and Newton's method, which doubles the digits in each
STEP: Final = 1e-6  # of a parameter's range, for the derivative
MET_KEPT: Final = 8  # contacts of a step that are kept for its sentence


class Trial(NamedTuple):
    """A way to make a step: by a rule, with a fault of the contacts in some scope, and its value."""

    rule: Fields
    fault: str = ""  # its name, "" if none
    scope: Fields = {}
    value: float = 1.0

    @property
    def fields(self) -> dict[str, float]:
        """The fields of LAW that it changes."""
        if not self.fault:
            return dict(self.rule)
        model = BY_NAME[self.fault]
        return {**self.rule, **self.scope, **model.fields, **dict.fromkeys(model.of, self.value)}

    @property
    def is_in_time(self) -> bool:
        return self.rule.get("when", When.IN_TIME) == When.IN_TIME


class Outcome(NamedTuple):
    """What a step comes to by a trial.

    left: px, what is over of the residual; met: its contacts; after: (k, 5).
    """

    trial: Trial
    left: float
    met: NDArray[np.void]
    after: Floats


class Problem:
    """A step of a group of balls that an engine did, for models to explain.

    after: (k, 5) x, y, vx, vy and spin, of the engine; floor: px, below which a residual is noise.
    """

    def __init__(self, group: Group, after: Floats, gravity: tuple[float, float], floor: float) -> None:
        self.group, self.after, self.gravity, self.floor = group, after, gravity, floor
        dt, radius = group.dt, group.ball["radius"]
        self.scale = np.empty_like(after)
        self.scale[:, :2], self.scale[:, 2:4], self.scale[:, 4] = 1.0, dt, radius * dt
        self._scratch = scratch_for(len(group.ball))
        self.exact = self.outcomes([Trial({})])[0]
        self.size = self.exact.left

    def run(self, laws: Laws) -> tuple[Floats, NDArray[np.void], NDArray[np.int64]]:
        """Do the step by some laws. Returns what it comes to, (laws, k, 5), and contacts."""
        after = np.empty((len(laws), *self.after.shape))
        met, counts = np.zeros((len(laws), MET_KEPT), MET), np.zeros(len(laws), np.int64)
        run_laws(self.group, laws, self._scratch, after, met, counts)
        return after, met, counts

    def laws(self, trials: Sequence[Trial]) -> Laws:
        """Return the laws of some trials."""
        return laws_of(trials, self.gravity)

    def residuals(self, after: Floats) -> Floats:
        """Return the residuals of what steps come to, px: (laws, 5 k)."""
        return ((after - self.after) * self.scale).reshape(len(after), -1)  # type: ignore[no-any-return]

    def outcomes(self, trials: Sequence[Trial]) -> list[Outcome]:
        """Try trials as they are."""
        if not trials:
            return []
        return self.outcomes_of(trials, self.laws(trials))

    def outcomes_of(self, trials: Sequence[Trial], laws: Laws) -> list[Outcome]:
        """Try trials whose laws are known."""
        after, met, counts = self.run(laws)
        left = np.abs(self.residuals(after)).max(axis=1)
        left[np.isnan(left)] = np.inf
        return [
            Outcome(trial, float(left[k]), met[k, : counts[k]], after[k]) for k, trial in enumerate(trials)
        ]

    @property
    def numbers(self) -> int:
        """How many places, velocities and spins of balls are not as the exact step has them."""
        off = np.abs(self.residuals(self.exact.after[None])).reshape(self.after.shape) > self.enough()
        return int(off[:, :2].any(axis=1).sum() + off[:, 2:4].any(axis=1).sum() + off[:, 4].sum())

    def enough(self) -> float:
        """Return the residual that an explanation may leave, px."""
        return max(2 * self.floor, LEFT_OVER * self.size)

    def fits(self, outcomes: Sequence[Outcome]) -> list[Outcome]:
        """Return the outcomes that leave nothing over, the best first."""
        enough = self.enough()
        fitting = (o for o in outcomes if o.left <= enough and (o.trial.is_in_time or len(o.met)))
        return sorted(fitting, key=lambda o: o.left)

    def fit(self, trials: Sequence[Trial]) -> list[Outcome]:
        """Fit the parameters of trials, and return what they come to."""
        if not trials:
            return []
        models = [BY_NAME[trial.fault] for trial in trials]
        base = self.laws(trials)
        grid = np.array([np.linspace(model.low, model.high, GRID) + 1e-3 * (model.high - model.low) / GRID for model in models])
        after, _, _ = self.run(_with(np.repeat(base, GRID), [m for m in models for _ in range(GRID)], grid.ravel()))
        left = np.linalg.norm(self.residuals(after), axis=1).reshape(grid.shape)
        left[np.isnan(left)] = np.inf
        best = np.argsort(left, axis=1)[:, :STARTS]
        value = np.take_along_axis(grid, best, axis=1).ravel()
        models = [model for model in models for _ in range(STARTS)]
        laws, trials = np.repeat(base, STARTS), [trial for trial in trials for _ in range(STARTS)]
        value = self._refine(laws, models, value)
        outcomes = self.outcomes_of([t._replace(value=float(v)) for t, v in zip(trials, value, strict=True)], _with(laws, models, value))
        return [min(outcomes[k : k + STARTS], key=lambda o: o.left) for k in range(0, len(outcomes), STARTS)]

    def _refine(self, laws: Laws, models: Sequence[Fault], value: Floats) -> Floats:
        """Return values that leave less over, from given ones."""
        low, high = np.array([m.low for m in models]), np.array([m.high for m in models])
        step = STEP * (high - low)
        now = self.residuals(self.run(_with(laws, models, value))[0])
        for _ in range(ROUNDS):
            ahead = self.residuals(self.run(_with(laws, models, value + step))[0])
            slope = (ahead - now) / step[:, None]
            steep = np.einsum("lk,lk->l", slope, slope)
            change = -np.einsum("lk,lk->l", slope, now) / np.where(steep > 0, steep, np.inf)
            value = np.clip(value + np.nan_to_num(change), low, high)
            now = self.residuals(self.run(_with(laws, models, value))[0])
            if np.nanmin(np.abs(now).max(axis=1)) <= self.floor / 100 or not np.abs(change).max() > 0:
                break
        return value


def laws_of(trials: Sequence[Trial], gravity: tuple[float, float]) -> Laws:
    """Return the laws of some trials. gravity: px/s²."""
    laws = np.repeat(np.array([law(gravity)], LAW), len(trials))
    for number, trial in enumerate(trials):
        for name, value in trial.fields.items():
            laws[name][number] = value
    return laws


def _with(laws: Laws, models: Sequence[Fault], value: Floats) -> Laws:
    """Return laws with other values of the models' parameters."""
    laws = laws.copy()
    for number, model in enumerate(models):
        for name in model.of:
            laws[name][number] = value[number]
    return laws


def explain(problem: Problem, flight: Fields, known: Sequence[Trial], *, rough: bool, full: bool) -> list[Outcome]:
    """Return the outcomes that leave nothing over, of the fewest parameters; none if nothing explains the step.

    flight: fields of the engine's habit; known: what has explained other steps, tried first; full: whether all else is
    tried if these do not.
    """
    exact, habitual = problem.exact, problem.outcomes([Trial(flight)])[0]
    contacts = _contacts([exact, habitual])
    known_outcomes = problem.outcomes([trial for trial in known if _applies(trial, contacts)])
    fitting = problem.fits([habitual]) or problem.fits(known_outcomes)
    if fitting or not full:
        return fitting
    stepwise = _distinct(problem, problem.outcomes_of(*_of_rules(problem.gravity, tuple(sorted(flight.items())))))
    stepwise = [outcome for outcome in stepwise if len(outcome.met)]
    contacts = _contacts([exact, habitual, *stepwise])
    plain = [fault for fault in FAULTS if not fault.of and _suits(fault, contacts, rough)]
    fitted = [fault for fault in FAULTS if fault.of and _suits(fault, contacts, rough)]
    fitting = problem.fits([*stepwise, *problem.outcomes(_trials([flight], plain, _contacts([exact])))])
    if fitting:
        return fitting
    met = _contacts([exact])
    bases = [flight, {**flight, "pair_place": 3}, {**flight, "pair_place": 4}]
    offset = BY_NAME["offset"]
    early = _contacts(problem.outcomes([Trial(flight, "offset", {}, share * offset.high) for share in (0.1, 0.3, 1.0)]))
    trials = _trials([flight], [fault for fault in fitted if fault is not offset], met)
    trials += _trials(bases, [offset], early)
    trials += [Trial(flight, "offset", {"scope": scope}) for scope in (Scope.PAIRS, Scope.WALLS)]
    fitting = problem.fits(problem.fit(trials))
    if fitting:
        return fitting
    ways = [outcome.trial.rule for outcome in stepwise]
    fitting = problem.fits(problem.outcomes(_trials(ways, plain, contacts)))
    if fitting:
        return fitting
    ways.sort(key=lambda rule: rule["when"])
    return problem.fits(problem.fit(_trials(ways[:12], [f for f in fitted if f.name not in ("offset", "apart")], contacts)))


@cache
def _of_rules(gravity: tuple[float, float], flight: tuple[tuple[str, float], ...]) -> tuple[list[Trial], Laws]:
    """Return the trials of all rules, and their laws."""
    fields = dict(flight)
    trials = [Trial({**_not_of_rules(fields), **rule}) for rule in rules(gravity=any(gravity), flight=fields)]
    return trials, laws_of(trials, gravity)


def _not_of_rules(flight: Fields) -> Fields:
    return {name: value for name, value in flight.items() if name != "theta"}


def _contacts(outcomes: Sequence[Outcome]) -> list[tuple[int, int]]:
    """Return the contacts of outcomes, each once: first and second."""
    return list(dict.fromkeys((int(m["first"]), int(m["second"])) for outcome in outcomes for m in outcome.met))


def _applies(trial: Trial, contacts: Sequence[tuple[int, int]]) -> bool:
    return trial.scope.get("scope") != Scope.ONE or (trial.scope["first"], trial.scope["second"]) in contacts


def _suits(fault: Fault, contacts: Sequence[tuple[int, int]], rough: bool) -> bool:
    """Return whether a fault can be one of some contacts."""
    pairs = [second >= 0 for _, second in contacts]
    if (fault.rough and not rough) or (fault.pairs_only and pairs and not any(pairs)):
        return False
    return not (fault.walls_only and pairs and all(pairs))


def _trials(rules: Sequence[Fields], faults: Sequence[Fault], contacts: Sequence[tuple[int, int]]) -> list[Trial]:
    return [Trial(rule, fault.name, scope) for rule in rules for fault in faults for scope in scopes(contacts)]


def _distinct(problem: Problem, outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Return one outcome of each group of those that come to the same, the first."""
    unit = max(problem.floor, 1e-12)
    seen: dict[bytes, Outcome] = {}
    for outcome in outcomes:
        key = np.round(outcome.after * problem.scale / unit).tobytes()
        seen.setdefault(key, outcome)
    return list(seen.values())


def cause_of(outcome: Outcome, problem: Problem) -> Cause:
    """Return the cause that an outcome stands for."""
    trial = outcome.trial
    if trial.fault:
        model = BY_NAME[trial.fault]
        if model.rough and model.of == () and model.cause is BY_NAME["friction"].cause:
            return _friction_by_outcome(outcome, problem)
        if model.name in ("friction", "coefficient"):
            return _friction_by_outcome(outcome, problem)
        return model.cause(trial.value)
    if trial.is_in_time:
        return Cause.UNTOLD
    velocities = np.abs((outcome.after - problem.exact.after) * problem.scale)[:, 2:].max() > problem.enough()
    if trial.rule["parting"] == 1 and any(m["closing"] <= 0 for m in outcome.met):
        return Cause.TURNED
    if not velocities and trial.rule["pair_place"] != 0 and any(m["second"] >= 0 for m in outcome.met):
        return Cause.PUSHED
    on_wall = trial.rule["wall_place"] == Place.ON and any(m["second"] < 0 for m in outcome.met)
    if not velocities and on_wall:
        return Cause.OVERSHOOT
    return Cause.LATE


def _friction_by_outcome(outcome: Outcome, problem: Problem) -> Cause:
    """Return whether friction is too small or too large: its impulses are told from the exact ones."""
    trial = outcome.trial
    if trial.fault == "friction" and trial.value < 0:
        return Cause.FRICTION_SMALL
    due, got = (float(np.abs(o.met["tangential"]).sum()) for o in (problem.exact, outcome))
    return Cause.FRICTION_SMALL if got < due else Cause.FRICTION_LARGE
