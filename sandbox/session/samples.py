"""Samples of every engine after every step, for the charts: energy, gap to the reference, momentum and more."""

from collections.abc import Sequence
from enum import IntEnum, auto
from typing import Final

import numpy as np

from sandbox.quantity import energy, length, momentum
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.state import Floats

CAPACITY: Final = 2048  # samples kept of a run, however long; about as many as a screen has columns
TIME, FALL, FIRST = range(3)  # columns of a sample; the quantities of the engines are the last


class Quantity(IntEnum):
    """A quantity that is sampled of every engine. The value is its number among them.

    OWN: energy without what mouse and edits added; ENERGY: kinetic and potential, that from the lowest place which a
    ball can reach; KINETIC: of flight and spin; all in kg px²/s². MOMENTUM: the length of the total momentum, kg px/s;
    GAP: the largest distance of a ball from the reference's, px.
    """

    OWN = 0
    ENERGY = auto()
    KINETIC = auto()
    MOMENTUM = auto()
    GAP = auto()


def fall(scene: Scene) -> Floats:
    """Return the energy of a fall of each ball through its radius along each axis of gravity, kg px²/s²: (n,)."""
    weight: Floats = np.abs(scene.gravity).sum() * scene.bodies.mass
    return weight * scene.bodies.radius


class Series:
    """Samples of some values over time in bounded memory: when it is full, every other sample is dropped.

    columns: how many values. Each sample belongs to a step. Steps that have a sample are not sampled again when a run
    is stepped back and resumed; if it takes another course, `cut` drops the samples after a step.
    """

    def __init__(self, columns: int) -> None:
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
    """

    def __init__(self, engines: Sequence[str], reference: str) -> None:
        self.engines = list(engines)
        self.reference = reference
        self._index = self.engines.index(reference)
        self.series = Series(FIRST + len(Quantity) * len(self.engines))

    def add(self, moment: Moment) -> None:
        """Sample the engines that are there after a step, in order."""
        if self.series.wants(moment.step):
            unknown = [np.nan] * (self.series.rows.shape[1] - FIRST)
            self.series.add(moment.step, [moment.time, float(fall(moment.scene).sum()), *unknown])
            self.complete(moment)

    def complete(self, moment: Moment) -> None:
        """Sample the engines that are there by now after a step that was added."""
        running, scene = moment.running, moment.scene
        reference, lowest = running.get(self.reference), float(fall(scene).sum())
        for table in self._table(self.series.at(moment.step)):
            for k, name in enumerate(self.engines):
                if reading := running.get(name):
                    state = reading.state
                    table[: Quantity.GAP, k] = (
                        reading.energy - reading.work,
                        reading.energy - lowest,
                        energy(state, scene.bodies),
                        length(momentum(state.velocity, scene.bodies.mass)),
                    )
                    if reference:
                        table[Quantity.GAP, k] = length(state.position - reference.state.position).max()

    def _table(self, rows: Floats) -> Floats:
        """Return the quantities of the engines in samples: (samples, quantities, engines)."""
        table: Floats = rows[:, FIRST:].reshape(len(rows), len(Quantity), len(self.engines))
        return table

    def of(self, quantity: Quantity) -> Floats:
        """Return a quantity in all samples, one column per engine: (samples, engines)."""
        values: Floats = self._table(self.series.rows)[:, quantity]
        return values

    @property
    def _scale(self) -> Floats:
        """The largest kinetic energy that the reference has had by each sample, or `fall` if that is more."""
        scale: Floats = np.maximum.accumulate(
            np.fmax(self.of(Quantity.KINETIC)[:, self._index], self.series.rows[:, FALL])
        )
        return scale

    def errors(self) -> Floats:
        """Return by how much energy is off in all samples, %, one column per engine: (samples, engines).

        It is what an engine has by itself less what the reference has then, as a share of the largest kinetic energy
        that the reference has had until then, or of `fall`, if that is more. It counts only if the reference does not
        have that energy a sample earlier or later: where energy is lost in contacts, an engine that is late by a step
        is not accused of the loss. So the latest sample keeps the error of the sample before. One engine alone is
        compared with its start.
        """
        own = self.of(Quantity.OWN)
        expected = np.full(len(own), own[0, 0]) if self.is_alone else own[:, self._index]
        around = np.pad(expected, 1, mode="edge")
        low, high = (least([around[:-2], expected, around[2:]])[:, None] for least in (np.fmin.reduce, np.fmax.reduce))
        off = np.maximum(own - high, 0.0) + np.minimum(own - low, 0.0)
        off[np.isnan(expected)] = np.nan
        with np.errstate(divide="ignore"):
            errors: Floats = np.divide(100 * off, self._scale[:, None], out=np.zeros_like(off), where=off != 0)
        latest = int(np.isfinite(expected).nonzero()[0].max(initial=0))
        if latest and not self.is_alone:
            errors[latest] = errors[latest - 1]
        return errors

    def error_at(self, step: int) -> dict[str, float]:
        """Return the error of each engine's energy at a step, or the nearest sample before it, %: see `errors`."""
        row = max(0, int(np.searchsorted(self.series.steps, step, side="right")) - 1)
        return dict(zip(self.engines, self.errors()[row].tolist(), strict=True))

    @property
    def is_alone(self) -> bool:
        """Whether there is only the reference, so that its energy is compared with the start."""
        return self.engines == [self.reference]

    @property
    def times(self) -> Floats:
        """The times of the samples, s: (samples,)."""
        return self.series.rows[:, TIME]
