"""Which error models leave nothing over of a step: those with the fewest parameters first, and then all that do.

A parameter is fitted by Gauss and Newton's method from the best points of a grid: the residual of a step that a model
explains goes to the noise floor, and that of one which it does not explain stays.
"""

from collections.abc import Hashable, Mapping, Sequence
from functools import cache, cached_property
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.law import LAW, Laws, Scope, When, law
from sandbox.judge.models import BY_NAME, IN_TIME, Fault, Fields
from sandbox.judge.one_step import MET, Group, Scratch, run_laws
from sandbox.judge.soft_step import NO_CONTACTS, SoftScratch, run_soft, soft_scratch_for
from sandbox.judge.thresholds import LEFT_OVER
from sandbox.state import Floats, Integers

GRID: Final = 33  # points of a parameter's range from which a fit may begin
STARTS: Final = 4  # of these, the best, from which it does
ROUNDS: Final = 8  # of Gauss and Newton's method, which doubles the digits in each
STEP: Final = 1e-6  # of a parameter's range, for the derivative
MET_KEPT: Final = 8  # contacts of a step that are kept for its sentence


class Trial(NamedTuple):
    """A way to make a step: by a rule, with a fault of the contacts in some scope, and its value."""

    rule: Fields
    fault: str = ""  # its name, "" if none
    scope: Fields = IN_TIME
    value: float = 1.0

    def __deepcopy__(self, memo: object) -> Self:
        return self  # nothing changes it

    @property
    def fields(self) -> dict[str, float]:
        """The fields of LAW that it changes."""
        return {**self.rule, **self.fields_of_fault}

    @property
    def fields_of_fault(self) -> dict[str, float]:
        """The fields of LAW that its fault changes."""
        return {**self.scope, **BY_NAME[self.fault].fields_at(self.value)} if self.fault else {}

    @property
    def key(self) -> str:
        """What makes it equal to another, but for what a fit leaves over."""
        return f"{self.fault} {self.value:.6g} {self.rule} {self.scope}"

    @property
    def model(self) -> tuple[str, Hashable]:
        """What makes it the same model as another: its fault and the value to three digits, or else its rule."""
        if self.is_soft:
            return "soft", self.rule["substeps"]
        return self.fault, float(f"{self.value:.3g}") if self.fault else frozenset(self.rule.items())

    @property
    def is_fitted(self) -> bool:
        """Whether it has a parameter."""
        return bool(self.fault) and BY_NAME[self.fault].span is not None

    @property
    def is_odd(self) -> bool:
        """Whether another model that explains a step as well is more likely."""
        return bool(self.fault) and BY_NAME[self.fault].odd

    @property
    def is_in_time(self) -> bool:
        """Whether contacts are found at the time of impact."""
        return self.rule.get("when", When.IN_TIME) == When.IN_TIME

    @property
    def is_wrong(self) -> bool:
        """Whether it says more than how balls fly."""
        return bool(self.fault) or not self.is_in_time

    @property
    def gives_impulses(self) -> bool:
        """Whether contacts change velocities."""
        return self.fields_of_fault.get("impulse", 1.0) != 0

    @property
    def is_soft(self) -> bool:
        """Whether contacts are soft."""
        return self.rule.get("when") == When.SOFT

    def concerns(self, first: int, second: int) -> bool:
        """Return whether its fault is one of a contact's. second: ball, or ~wall."""
        scope = self.scope.get("scope", Scope.ALL)
        if scope == Scope.ONE:
            return (self.scope["first"], self.scope["second"]) == (first, second)
        return scope == Scope.ALL or (scope == Scope.PAIRS) == (second >= 0)


PLAIN: Final = Trial({})


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

    after: (k, 5) x, y, vx, vy and spin, of the engine; floor: px, below which a residual is noise; scratch: that steps
    work in; warm: soft contacts of the step before; exact: (k, 5), how the step should end, by default as it is
    computed from contact to contact.
    """

    def __init__(
        self,
        group: Group,
        after: Floats,
        gravity: tuple[float, float],
        floor: float,
        scratch: Scratch,
        warm: NDArray[np.void] = NO_CONTACTS,
        exact: Floats | None = None,
    ) -> None:
        self.group, self.after, self.gravity, self.floor = group, after, gravity, floor
        self._scratch, self._warm = scratch._replace(ball=scratch.ball[: len(group.ball)]), warm
        dt, radius = group.dt, group.ball["radius"]
        self.scale = np.empty_like(after)
        self.scale[:, :2], self.scale[:, 2:4], self.scale[:, 4] = 1.0, dt, radius * dt
        if exact is None:
            [self.exact] = self.outcomes_of([PLAIN], _exact_laws(gravity))
        else:  # whose contacts are not known
            self.exact = Outcome(PLAIN, float(np.abs(self.residuals(exact[None])).max()), np.empty(0, MET), exact)
        self.size = self.exact.left

    @property
    def before(self) -> Floats:
        """The state before the step: (k, 5)."""
        return np.column_stack([self.group.ball[name] for name in ("x", "y", "vx", "vy", "spin")])

    @cached_property
    def _soft_scratch(self) -> SoftScratch:
        return soft_scratch_for(len(self.group.ball), self._warm)

    def run(self, laws: Laws) -> tuple[Floats, NDArray[np.void], NDArray[np.int64]]:
        """Do the step by some laws. Returns what it comes to, (laws, k, 5), and contacts."""
        after = np.empty((len(laws), *self.after.shape))
        met, counts = np.zeros((len(laws), MET_KEPT), MET), np.zeros(len(laws), np.int64)
        soft = laws["when"] == When.SOFT
        if not soft.any():
            run_laws(self.group, laws, self._scratch, after, met, counts)
        elif soft.all():
            run_soft(self.group, laws, self._soft_scratch, after, met, counts)
        else:
            for chosen in (~soft, soft):
                after[chosen], met[chosen], counts[chosen] = self.run(laws[chosen])
        return after, met, counts

    def soft_contacts(self, trial: Trial) -> NDArray[np.void]:
        """Return the soft contacts that a trial has at the end of the step."""
        self.run(self.laws([trial]))
        return self._soft_scratch.contact[self._soft_scratch.contact["colour"] >= 0]

    def laws(self, trials: Sequence[Trial]) -> Laws:
        """Return the laws of some trials."""
        return laws_of(trials, self.gravity)

    def residuals(self, after: Floats) -> Floats:
        """Return the residuals of what steps come to, px: (laws, 5 k)."""
        return ((after - self.after) * self.scale).reshape(len(after), -1)

    def outcomes(self, trials: Sequence[Trial]) -> list[Outcome]:
        """Try trials as they are."""
        if not trials:
            return []
        return self.outcomes_of(trials, self.laws(trials))

    def outcomes_of(self, trials: Sequence[Trial], laws: Laws, most: float = np.inf) -> list[Outcome]:
        """Try trials whose laws are known. most: px, what the outcomes that are returned leave over."""
        after, met, counts = self.run(laws)
        left = np.abs(self.residuals(after)).max(axis=1)
        left[np.isnan(left)] = np.inf
        chosen = np.flatnonzero(left <= most).tolist()
        return [Outcome(trials[k], float(left[k]), met[k, : counts[k]], after[k]) for k in chosen]

    @property
    def numbers(self) -> int:
        """How many numbers the places, velocities and spins have that are not as in the exact step."""
        off = np.abs(self.residuals(self.exact.after[None])).reshape(self.after.shape) > self.enough()
        return int(2 * off[:, :2].any(axis=1).sum() + 2 * off[:, 2:4].any(axis=1).sum() + off[:, 4].sum())

    def enough(self) -> float:
        """Return the residual that an explanation may leave, px."""
        return max(2 * self.floor, LEFT_OVER * self.size)

    def fits(self, outcomes: Sequence[Outcome]) -> list[Outcome]:
        """Return the outcomes that leave nothing over, the best first."""
        enough = self.enough()
        fitting = [o for o in outcomes if o.left <= enough and (o.trial.is_in_time or len(o.met))]
        kept = without_idle_faults([o.trial for o in fitting])
        return sorted((o for o in fitting if o.trial in kept), key=lambda o: o.left)

    def fit(self, trials: Sequence[Trial]) -> list[Outcome]:
        """Fit the parameters of trials, and return what they come to."""
        if not trials:
            return []
        models = [BY_NAME[trial.fault] for trial in trials]
        low, high = self._ranges(models)
        grid = np.linspace(low, high, GRID, axis=1) + 1e-3 * (high - low)[:, None] / GRID  # off the right value
        laws = self.laws(trials)
        chosen, value = self._starts(laws, models, grid)
        if not chosen:
            return []
        trials, models, laws = [trials[k] for k in chosen], [models[k] for k in chosen], laws[chosen]
        value = self._refine(laws, models, value)
        fitted = [trial._replace(value=float(v)) for trial, v in zip(trials, value, strict=True)]
        best: dict[int, Outcome] = {}
        for k, outcome in zip(chosen, self.outcomes_of(fitted, _set(laws, _places(models), value)), strict=True):
            best[k] = min(best.get(k, outcome), outcome, key=lambda o: o.left)
        return list(best.values())

    def _starts(self, laws: Laws, models: Sequence[Fault], grid: Floats) -> tuple[list[int], Floats]:
        """Return from where fits may begin: the numbers of laws, and values of their models' parameters.

        Only where the residual changes by half of itself or more from one point of the grid to the next: elsewhere, no
        value near by brings it to nothing. grid: (laws, points).
        """
        points = grid.shape[1]
        after, _, _ = self.run(_set(np.repeat(laws, points), _places(models, points), grid.ravel()))
        residuals = self.residuals(after).reshape(*grid.shape, -1)
        left, change = np.linalg.norm(residuals, axis=2), np.linalg.norm(np.diff(residuals, axis=1), axis=2)
        left[np.isnan(left)] = np.inf
        change[np.isnan(change)] = np.inf  # next to a step that has no end
        flat = change <= 1e-9 * left[:, 1:]  # a contact that has moved to the start of the step does not depend on it
        around = np.maximum(np.pad(change, ((0, 0), (1, 0))), np.pad(change, ((0, 0), (0, 1))))
        left[around < left / 2] = np.inf
        left[:, 1:][flat] = np.inf
        best = np.argsort(left, axis=1)[:, :STARTS]
        chosen, places = np.nonzero(np.isfinite(np.take_along_axis(left, best, axis=1)))
        return chosen.tolist(), grid[chosen, best[chosen, places]]

    def _ranges(self, models: Sequence[Fault]) -> tuple[Floats, Floats]:
        """Return the least and the largest values of the models' parameters, (k,) each."""
        unit = np.where([model.in_radii for model in models], self.group.ball["radius"].min(), 1.0)
        low, _, high = np.transpose([model.span for model in models])
        return unit * low, unit * high

    def _refine(self, laws: Laws, models: Sequence[Fault], value: Floats) -> Floats:
        """Return values that leave less over, from given ones. laws: written."""
        low, high = self._ranges(models)
        step, places = STEP * (high - low), _places(models)
        now = self.residuals(self.run(_set(laws, places, value))[0])
        for _ in range(ROUNDS):
            ahead = self.residuals(self.run(_set(laws, places, value + step))[0])
            slope = (ahead - now) / step[:, None]
            steep = np.einsum("lk,lk->l", slope, slope)
            change = -np.einsum("lk,lk->l", slope, now) / np.where(steep > 0, steep, np.inf)
            change[np.isnan(change)] = 0.0  # of a step that has no end
            value = np.clip(value + change, low, high)
            now = self.residuals(self.run(_set(laws, places, value))[0])
            left = np.abs(now).max(axis=1)
            if np.any(left <= self.floor / 100) or not change.any():
                break
        return value


def without_idle_faults(trials: Sequence[Trial]) -> list[Trial]:
    """Return those of some trials that fit, but for faults that change nothing: the same rule fits without them."""
    enough_alone = [trial.rule for trial in trials if not trial.fault]
    return [trial for trial in trials if not trial.fault or trial.rule not in enough_alone]


def laws_of(trials: Sequence[Trial], gravity: tuple[float, float]) -> Laws:
    """Return the laws of some trials. gravity: px/s²."""
    laws = np.repeat(np.array([law(gravity)], LAW), len(trials))
    fields: dict[str, dict[int, float]] = {}
    for number, trial in enumerate(trials):
        for name, value in trial.fields.items():
            fields.setdefault(name, {})[number] = value
    for name, values in fields.items():
        laws[name][list(values)] = list(values.values())
    return laws


@cache
def _exact_laws(gravity: tuple[float, float]) -> Laws:
    return laws_of([PLAIN], gravity)


def _places(models: Sequence[Fault], times: int = 1) -> dict[str, Integers]:
    """Return which of some models, each of which is repeated, have each field of LAW for their parameter."""
    places: dict[str, list[int]] = {}
    for number, model in enumerate(models):
        for name in model.parameters:
            places.setdefault(name, []).append(number)
    repeats = np.arange(times)
    return {name: np.add.outer(times * np.array(numbers), repeats).ravel() for name, numbers in places.items()}


def _set(laws: Laws, places: Mapping[str, Integers], value: Floats) -> Laws:
    """Set the values of the models' parameters in laws, and return these. places: see `_places`."""
    for name, numbers in places.items():
        laws[name][numbers] = value[numbers]
    return laws
