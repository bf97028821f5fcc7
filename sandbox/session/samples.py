"""Samples of every engine after every step, for the charts: energy, gap to the reference, momentum and more."""

from collections.abc import Collection, Mapping, Sequence
from enum import IntEnum, auto
from typing import Final

import numpy as np

from sandbox.quantity import kinetic_energy, length, momentum, spin_energy
from sandbox.scene.model import Scene
from sandbox.session.history import History, Moment, Reading
from sandbox.state import Floats, State

CAPACITY: Final = 4096  # samples kept of a run, however long; about as many as a screen has columns
NEGLIGIBLE: Final = 5e-5  # of the scale of energy
NO_SECONDS: Final[Mapping[str, float | None]] = {}
TIME, LOW, HIGH, SCALE, FIRST = range(5)  # columns of a sample; the quantities of the engines are the last


class Quantity(IntEnum):
    """A quantity that is sampled of every engine. The value is its number among them.

    OWN: energy without what mouse and edits added; ENERGY: kinetic and potential, that from the lowest place which a
    ball can reach; KINETIC: of flight and spin; MOMENTUM: the length of the total momentum, kg px/s; CONTACTS: their
    number so far; X, Y, VX, VY: of the ball that is followed, px and px/s; GAP: the largest distance of a ball from the
    reference's, px; COST: how long a step took lately, ms. Energies are in kg px²/s².
    """

    OWN = 0
    ENERGY = auto()
    KINETIC = auto()
    MOMENTUM = auto()
    CONTACTS = auto()
    X = auto()
    Y = auto()
    VX = auto()
    VY = auto()
    GAP = auto()
    COST = auto()


OF_BALL: Final = slice(Quantity.X, Quantity.VY + 1)


def fall(scene: Scene) -> float:
    """Return the energy of a fall of all balls through their radius along each axis of gravity, kg px²/s²."""
    bodies = scene.bodies
    return float(np.abs(scene.gravity).sum() * (bodies.mass * bodies.radius).sum())


def _kinetic(state: State, scene: Scene) -> float:
    return float(kinetic_energy(state.velocity, scene.bodies.mass) + spin_energy(state.spin, scene.bodies.moment))


def _measured(reading: Reading, scene: Scene) -> list[float]:
    """Return the quantities of an engine before X."""
    state = reading.state
    return [
        reading.energy - reading.work,
        reading.energy - fall(scene),
        _kinetic(state, scene),
        float(length(momentum(state.velocity, scene.bodies.mass))),
        reading.contact_count,
    ]


class Series:
    """Samples of some values over time in bounded memory: when it is full, every other sample is dropped.

    columns: how many values. Each sample belongs to a step. Steps that have a sample are not sampled again when a run
    is stepped back and resumed; if it takes another course, `cut` drops the samples after a step.
    """

    def __init__(self, columns: int) -> None:
        self.drops = 0  # how often samples that were final have been dropped
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
        self._count = int(np.searchsorted(self._steps[: self._count], step, side="right"))

    def at(self, step: int) -> Floats:
        """Return the sample at a step, if there is one: (0 or 1, columns)."""
        return self.rows[slice(*(int(np.searchsorted(self.steps, step, side=side)) for side in ("left", "right")))]

    @property
    def steps(self) -> np.ndarray[tuple[int], np.dtype[np.int_]]:
        """The step of each sample: (samples,)."""
        return self._steps[: self._count]

    @property
    def rows(self) -> Floats:
        """The values: (samples, columns)."""
        return self._rows[: self._count]


class Samples:
    """Each quantity in each engine over time; NaN while the engine, or the reference that it is compared with, stands.

    What belongs to one engine is there after every step, what needs the reference once that has done the step too.
    silent: the engines that report no contacts; history: has the moments before another ball is followed.
    """

    def __init__(
        self, engines: Sequence[str], reference: str, silent: Collection[str] = (), history: History | None = None
    ) -> None:
        self.engines = list(engines)
        self.reference = reference
        # Time, the lowest and highest energy of the reference's own around it, the scale of energy, and each
        # quantity of each engine.
        self.series = Series(FIRST + len(Quantity) * len(self.engines))
        self._silent = silent
        self._history = history
        self.ball = 0  # that is followed, by its number among all that ever were in the run
        self._reached = self._completed = -1  # steps
        self._own, self._largest = np.nan, 0.0  # the reference's own energy, and its largest kinetic one so far

    def __len__(self) -> int:
        return len(self.series)

    def add(self, moment: Moment, seconds: Mapping[str, float | None] = NO_SECONDS) -> None:
        """Sample the engines that are there after a step, in order. seconds: that a step of each took lately."""
        if moment.step > self._reached and self.series.wants(moment.step):
            self.series.add(moment.step, [moment.time, *[np.nan] * (self.series.rows.shape[1] - 1)])
            self._measure(self.series.rows[-1], moment, seconds)
        self._reached = max(self._reached, moment.step)

    def complete(self, moment: Moment, seconds: Mapping[str, float | None] = NO_SECONDS) -> None:
        """Sample the reference, and what is compared with it, after a step that was added, in order."""
        if moment.step <= self._completed:
            return
        self._completed, before, reference = moment.step, self._own, moment.running.get(self.reference)
        self._own = reference.energy - reference.work if reference else np.nan
        if reference:
            kinetic = _kinetic(reference.state, moment.scene)
            self._largest = max(kinetic, fall(moment.scene), self._largest)
        for row in self.series.at(moment.step - 1):
            row[LOW : HIGH + 1] = min(row[LOW], self._own), max(row[HIGH], self._own)
        for row in self.series.at(moment.step):
            around = [before, self._own] if before == before else [self._own]  # noqa: PLR0124 (not NaN)
            row[LOW : HIGH + 1] = min(around), max(around)
            row[SCALE] = self._largest
            self._measure(row, moment, seconds)

    def _measure(self, row: Floats, moment: Moment, seconds: Mapping[str, float | None]) -> None:
        """Enter into a sample the quantities of the engines that run, as far as they are not there yet."""
        table, running = self._table(row), moment.running
        reference = running.get(self.reference)
        for k, name in enumerate(self.engines):
            reading = running.get(name)
            if reading and np.isnan(table[Quantity.OWN, k]):
                table[: Quantity.X, k] = _measured(reading, moment.scene)
                table[Quantity.COST, k] = 1000 * (seconds.get(name) or np.nan)
                if name in self._silent:
                    table[Quantity.CONTACTS, k] = np.nan
            if reading and reference:
                table[Quantity.GAP, k] = length(reading.state.position - reference.state.position).max()
        self._measure_ball(table, moment)

    def _measure_ball(self, table: Floats, moment: Moment) -> None:
        if self.ball in moment.balls:
            ball = moment.balls.index(self.ball)
            for k, name in enumerate(self.engines):
                if reading := moment.running.get(name):
                    table[OF_BALL, k] = *reading.state.position[ball], *reading.state.velocity[ball]

    def _table(self, rows: Floats) -> Floats:
        """Return the quantities of the engines in samples: (..., quantities, engines)."""
        table: Floats = rows[..., FIRST:].reshape(*rows.shape[:-1], len(Quantity), len(self.engines))
        return table

    def cut(self, step: int) -> None:
        """Drop the samples after a step, from which the run takes another course."""
        if self.final and step < self.series.steps[self.final - 1]:
            self.series.drops += 1
        self.series.cut(step)
        if step < self._completed:
            rows, reference = self.series.rows, self.engines.index(self.reference)
            self._own = float(self.of(Quantity.OWN)[-1, reference]) if len(rows) else np.nan
            self._largest = float(rows[-1, SCALE]) if len(rows) else 0.0
        self._reached, self._completed = min(self._reached, step), min(self._completed, step)

    def follow(self, ball: int) -> bool:
        """Sample a ball instead of the one before, as far back as the history goes. Return whether it is another."""
        if ball == self.ball:
            return False
        self.ball = ball
        for row, step in zip(self.series.rows, self.series.steps.tolist(), strict=True):
            table = self._table(row)
            table[OF_BALL] = np.nan
            for moment in self._history.between(step, step) if self._history else ():
                self._measure_ball(table, moment)
        return True

    @property
    def final(self) -> int:
        """The number of samples that no later step changes any more."""
        return int(np.searchsorted(self.series.steps, self._completed))

    def of(self, quantity: Quantity, since: int = 0) -> Floats:
        """Return a quantity in the samples from one on, one column per engine: (samples, engines)."""
        values: Floats = self._table(self.series.rows[since:])[:, quantity]
        return values

    def errors(self, since: int = 0) -> Floats:
        """Return by how much energy is off in the samples from one on, %, one column per engine: (samples, engines).

        It is what an engine has by itself less what the reference has then, as a share of the largest kinetic energy
        that the reference has had until then, or of `fall`, if that is more. It counts only if the reference does not
        have that energy a step earlier or later: where energy is lost in contacts, an engine that is late by a step is
        not accused of the loss. So the latest sample keeps the error of the sample before. One engine alone is
        compared with its start.
        """
        first = max(0, min(since, self.final - 1))
        rows = self.series.rows[first:]
        own, low, high, scale = self._table(rows)[:, Quantity.OWN], rows[:, LOW], rows[:, HIGH], rows[:, SCALE]
        if self.is_alone:
            low = high = np.full(len(rows), self.of(Quantity.OWN)[0, 0])
        off = np.maximum(own - high[:, None], 0.0) + np.minimum(own - low[:, None], 0.0)
        with np.errstate(divide="ignore"):
            errors = np.divide(100 * off, scale[:, None], out=np.zeros_like(off), where=off != 0)
        latest = self.final - first
        if 0 < latest < len(errors):
            errors[latest] = errors[latest - 1]
        shown: Floats = errors[since - first :]
        return shown

    def error_at(self, step: int) -> dict[str, float]:
        """Return the error of each engine's energy at a step, or the nearest sample before it, %: see `errors`."""
        row = max(0, int(np.searchsorted(self.series.steps, step, side="right")) - 1)
        return dict(zip(self.engines, self.errors(row)[0].tolist(), strict=True))

    @property
    def keeps_energy(self) -> bool:
        """Whether the reference has had the same energy of its own all the time."""
        own = self.of(Quantity.OWN)[:, self.engines.index(self.reference)]
        return not np.nanmax(np.abs(own - own[0])) > NEGLIGIBLE * self._largest

    @property
    def is_alone(self) -> bool:
        """Whether there is only the reference, so that its energy is compared with the start."""
        return self.engines == [self.reference]

    @property
    def times(self) -> Floats:
        """The times of the samples, s: (samples,)."""
        return self.series.rows[:, TIME]
