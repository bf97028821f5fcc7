"""Samples of every engine after every step, for the charts: energy, gap to the reference, momentum and more."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from typing import Final, TypeVar

import numpy as np

from sandbox.analysis.gas import fluid_pressure, why_no_gas
from sandbox.quantity import angular_momentum, centre_of_mass, height, kinetic_energy, length, momentum
from sandbox.scene.model import Scene
from sandbox.session.history import History, Moment
from sandbox.state import Floats, State

CAPACITY: Final = 4096  # samples kept of a run, however long; about as many as a screen has columns
MIN_RATE_SECONDS: Final = 1.0  # over which a rate is measured at least, s
SAME_TIME: Final = 1e-9  # s, by which two times may differ that are the same
SCALE: Final = 4  # column with the scale of energy so far
FIRST: Final = 5  # column with a quantity of an engine

NO_SECONDS: Final[Mapping[str, float | None]] = {}
T = TypeVar("T", float, Floats)


class Quantity(Enum):
    """A quantity that is sampled of every engine. The value is its number among them.

    ENERGY: what the engine lost (negative) or made, minus what the reference did, see `share_of_energy`; GAP: the
    largest distance of a ball from the reference's, px; MOMENTUM: the length of the total momentum, kg px/s;
    ANGULAR_MOMENTUM: of flight and spin about the arena's centre, kg px²/s; HEIGHT: of the centre of mass above the
    arena's lower edge, px; CONTACTS: their number so far; WALL_IMPULSE: the momentum per length that the arena's walls
    took so far, kg/s; X, Y, VX, VY: position and velocity of the ball that is followed, px and px/s; COST: how
    long a step took lately, ms.
    """

    ENERGY = 0
    GAP = 1
    MOMENTUM = 2
    ANGULAR_MOMENTUM = 3
    HEIGHT = 4
    CONTACTS = 5
    WALL_IMPULSE = 6
    X = 7
    Y = 8
    VX = 9
    VY = 10
    COST = 11


def _angular_momentum(state: State, scene: Scene) -> float:
    about_centre = replace(state, position=state.position - np.divide(scene.arena.size, 2))
    return float(angular_momentum(about_centre, scene.bodies))


OF_STATES: Final[Mapping[Quantity, Callable[[State, Scene], float]]] = {
    Quantity.MOMENTUM: lambda state, scene: float(length(momentum(state.velocity, scene.bodies.mass))),
    Quantity.ANGULAR_MOMENTUM: _angular_momentum,
    Quantity.HEIGHT: lambda state, scene: float(
        height(centre_of_mass(state.position, scene.bodies.mass), scene.arena.size)
    ),
}
OF_BALLS: Final[Mapping[Quantity, Callable[[State], Floats]]] = {
    Quantity.X: lambda state: state.position[:, 0],
    Quantity.Y: lambda state: state.position[:, 1],
    Quantity.VX: lambda state: state.velocity[:, 0],
    Quantity.VY: lambda state: state.velocity[:, 1],
}
ON_DEMAND: Final = (*OF_STATES, *OF_BALLS)


class Series:
    """Samples of some values over time in bounded memory: when it is full, every other sample is dropped.

    columns: how many values. Each sample belongs to a step. Steps that have a sample are not sampled again when a run
    is stepped back and resumed; if it takes another course, `cut` drops the samples after a step.
    """

    def __init__(self, columns: int) -> None:
        self.drops = 0  # how often samples have been dropped
        self._rows = np.empty((CAPACITY, columns))
        self._steps = np.empty(CAPACITY, int)
        self._count = 0
        self._stride = 1  # steps between two samples, at least

    def __len__(self) -> int:
        return self._count

    def wants(self, step: int) -> bool:
        """Return whether a sample at a step would be kept."""
        return not self._count or step >= self._steps[self._count - 1] + self._stride

    def add(self, step: int, values: Sequence[float]) -> None:
        """Keep a sample at a step that `wants` accepts."""
        if self._count == CAPACITY:
            half = CAPACITY // 2
            self._rows[:half], self._steps[:half] = self._rows[::2].copy(), self._steps[::2].copy()
            self._count, self._stride = half, 2 * self._stride
            self.drops += 1
        self._steps[self._count], self._rows[self._count] = step, values
        self._count += 1

    def cut(self, step: int) -> None:
        """Drop the samples after a step."""
        count = int(np.searchsorted(self._steps[: self._count], step, side="right"))
        if count < self._count:
            self._count = count
            self.drops += 1

    @property
    def steps(self) -> np.ndarray[tuple[int], np.dtype[np.int_]]:
        """The step of each sample: (samples,)."""
        return self._steps[: self._count]

    @property
    def rows(self) -> Floats:
        """The values: (samples, columns)."""
        return self._rows[: self._count]


class Samples:
    """Each quantity in each engine over time. A quantity is NaN while an engine or the reference does not run.

    energy_at_start: kg px²/s², the same in every engine; silent: the engines that report no contacts; history: has the
    moments of ON_DEMAND before these were asked for, which are not sampled until then. Without it, they always are.
    """

    def __init__(
        self,
        engines: Sequence[str],
        reference: str,
        energy_at_start: float,
        silent: Collection[str] = (),
        history: History | None = None,
    ) -> None:
        self.engines = list(engines)
        self.reference = reference
        self.energy_at_start = energy_at_start
        # Time, the lowest and highest change of the reference's energy around it, a gas's pressure in theory, the scale
        # of energy, and each quantity of each engine, energies in kg px²/s².
        self.series = Series(FIRST + len(Quantity) * len(self.engines))
        self._silent = silent
        self._history = history
        self._sampled = list[Quantity]() if history else list(ON_DEMAND)
        self.ball = 0  # that is followed, by its number among all that ever were in the run
        self._change = np.nan  # of the reference's energy in the step before
        self._gas: tuple[Scene | None, bool] = None, False  # the scene of the last sample, and whether it is a gas

    def __len__(self) -> int:
        return len(self.series)

    def add(self, moment: Moment, seconds: Mapping[str, float | None] = NO_SECONDS) -> None:
        """Add a step, and a sample if one is due. Called after every step, in order.

        seconds: that a step of each engine took lately.
        """
        change = {
            name: change_of_energy(energy, self.energy_at_start, moment.work[name])
            for name, energy in moment.energy.items()
            if name not in moment.standing
        }
        before, self._change = self._change, change.get(self.reference, np.nan)
        series = self.series
        if len(series) and series.steps[-1] == moment.step - 1:
            last = series.rows[-1]
            last[1:3] = min(last[1], self._change), max(last[2], self._change)
        if series.wants(moment.step):
            around = before if len(series) and before == before else self._change  # noqa: PLR0124 (not NaN)
            ends = min(around, self._change), max(around, self._change)
            theory = self._pressure_in_theory(moment)
            values = self._values(moment, change)
            values[Quantity.COST.value] = [1000 * (seconds.get(name) or np.nan) for name in self.engines]
            series.add(moment.step, [moment.time, *ends, theory, moment.energy_scale, *values.ravel().tolist()])

    def _values(self, moment: Moment, change: dict[str, float]) -> Floats:
        """Return each quantity of each engine: (quantities, engines)."""
        values = np.full((len(Quantity), len(self.engines)), np.nan)
        states = _running(moment)
        reference = states.get(self.reference)
        for k, name in enumerate(self.engines):
            if name not in states:
                continue
            values[Quantity.ENERGY.value, k] = change[name]
            if name not in self._silent:
                values[Quantity.CONTACTS.value, k] = moment.counts[name]
                values[Quantity.WALL_IMPULSE.value, k] = moment.wall_impulse[name]
            if name == self.reference:
                values[Quantity.GAP.value, k] = 0.0
            elif reference is not None:
                values[Quantity.GAP.value, k] = length(states[name].position - reference.position).max()
        for quantity in self._sampled:
            values[quantity.value] = self._of_states(quantity, moment)
        return values

    def _of_states(self, quantity: Quantity, moment: Moment) -> list[float]:
        """Return one of ON_DEMAND of each engine; NaN where the ball that is followed is not there."""
        states = _running(moment)
        if quantity in OF_STATES:
            of_state = OF_STATES[quantity]
            return [of_state(states[name], moment.scene) if name in states else np.nan for name in self.engines]
        if self.ball not in moment.balls:
            return [np.nan] * len(self.engines)
        ball, of_balls = moment.balls.index(self.ball), OF_BALLS[quantity]
        return [float(of_balls(states[name])[ball]) if name in states else np.nan for name in self.engines]

    def follow(self, ball: int) -> bool:
        """Sample a ball instead of the one before, as far back as the history goes. Return whether it is another."""
        if ball == self.ball:
            return False
        self.ball = ball
        self._sampled = [quantity for quantity in self._sampled if quantity not in OF_BALLS]
        for quantity in OF_BALLS:
            first = self._first_column(quantity)
            self.series.rows[:, first : first + len(self.engines)] = np.nan
        return True

    def _sample(self, quantity: Quantity) -> None:
        """Sample a quantity from now on, and as far back as the history goes."""
        self._sampled.append(quantity)
        first = self._first_column(quantity)
        for row, step in zip(self.series.rows, self.series.steps.tolist(), strict=True):
            for moment in self._history.between(step, step) if self._history else ():
                row[first : first + len(self.engines)] = self._of_states(quantity, moment)

    def _first_column(self, quantity: Quantity) -> int:
        return FIRST + quantity.value * len(self.engines)

    def _pressure_in_theory(self, moment: Moment) -> float:
        """Return the pressure that theory expects of a gas with the reference's energy, kg/s²; NaN if it is no gas."""
        scene, reference = moment.scene, _running(moment).get(self.reference)
        if self._gas[0] is not scene:
            self._gas = scene, not why_no_gas(scene)
        if not self._gas[1] or reference is None:
            return np.nan
        kinetic = float(kinetic_energy(reference.velocity, scene.bodies.mass))
        return fluid_pressure(scene.bodies.radius, kinetic, scene.arena.size)

    def of(self, quantity: Quantity, since: int = 0) -> Floats:
        """Return a quantity in the samples from one on, one column per engine: (samples, engines).

        A difference of energy counts only if the reference's energy does not have that value a step earlier or later:
        where energy is lost in contacts, an engine that is late by a step is not accused of the loss. All samples have
        the scale of the latest.
        """
        if quantity in ON_DEMAND and quantity not in self._sampled:
            self._sample(quantity)
        rows, first = self.series.rows[since:], self._first_column(quantity)
        values = rows[:, first : first + len(self.engines)]
        if quantity is not Quantity.ENERGY:
            return values
        if not self.is_alone:
            low, high = rows[:, 1, None], rows[:, 2, None]
            values = np.maximum(values - high, 0.0) + np.minimum(values - low, 0.0)
        return share_of_energy(values, self.energy_scale)

    def energies(self, since: int = 0) -> Floats:
        """Return the energy of each engine in the samples from one on, as shares (%) of the scale: 100 at the start.

        What mouse and edits have added is left out; kg px²/s² from the start if nothing has moved.
        """
        first = self._first_column(Quantity.ENERGY)
        change = share_of_energy(self.series.rows[since:, first : first + len(self.engines)], self.energy_scale)
        return 100 + change if self.energy_scale else change

    def energy_error(self, step: int) -> dict[str, float]:
        """Return by how much each engine's energy is off at a step, or the nearest sample before it: see `of`.

        At the latest step, it is that of the step before: the next one can change how it compares with the reference.
        """
        settled = max(0, len(self) - 2)
        row = min(max(0, int(np.searchsorted(self.series.steps, step, side="right")) - 1), settled)
        return dict(zip(self.engines, self.of(Quantity.ENERGY, row)[0].tolist(), strict=True))

    def rate(self, quantity: Quantity, seconds: float, since: int = 0) -> Floats:
        """Return by how much a quantity grew in a second, averaged over some seconds before each sample from one on.

        NaN in the first MIN_RATE_SECONDS; then averaged over what there is: (samples, engines).
        """
        times, values = self.times, self.of(quantity)
        before = np.searchsorted(times, times[since:] - seconds + SAME_TIME, side="right") - 1
        before = np.maximum(before, 0)
        passed = times[since:] - times[before]
        passed[passed < MIN_RATE_SECONDS - SAME_TIME] = np.nan
        return (values[since:] - values[before]) / passed[:, None]

    def pressure_in_theory(self, since: int = 0) -> Floats:
        """Return the pressure that theory expects in the samples from one on, kg/s²: (samples,); NaN for no gas."""
        return self.series.rows[since:, 3]

    @property
    def energy_scale(self) -> float:
        """The scale of energy so far, kg px²/s²; 0 if nothing has moved."""
        return float(self.series.rows[-1, SCALE]) if len(self) else 0.0

    @property
    def is_alone(self) -> bool:
        """Whether there is only the reference, so that its energy is compared with the start."""
        return self.engines == [self.reference]

    @property
    def times(self) -> Floats:
        """The times of the samples, s: (samples,)."""
        return self.series.rows[:, 0]


def _running(moment: Moment) -> dict[str, State]:
    """Return the states of the engines that have not reached a limit."""
    return {name: state for name, state in moment.states.items() if name not in moment.standing}


def change_of_energy(energy: float, start: float, work: float) -> float:
    """Return what an engine lost (negative) or made, kg px²/s².

    energy, start: kg px²/s², now and at first; work: what mouse and edits have added to it.
    """
    return energy - start - work


def share_of_energy(change: T, scale: float) -> T:
    """Return a change of energy (kg px²/s²) in % of a scale, or as it is if that is 0: nothing has moved."""
    return 100 * change / scale if scale else change
