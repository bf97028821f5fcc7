"""The samples that the charts of a run show: energy, gap to the reference, momentum of every engine over time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sandbox.analysis.reference import reference_of
from sandbox.quantity import energy, length, momentum
from sandbox.scene.model import Scene
from sandbox.state import Floats, State

CAPACITY: Final = 4096  # samples kept of a run, however long; about as many as a screen has columns


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
        self.drops = 0  # how often samples have been dropped

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


@dataclass(frozen=True)
class Quantity:
    """What a chart shows. logarithmic: its axis has powers of ten."""

    title: str
    unit: str
    logarithmic: bool = False


class ChartData:
    """Each quantity in each engine over time."""

    def __init__(self, scene: Scene, states: Mapping[str, State]) -> None:
        self.scene = scene
        self.engines = list(states)
        self.reference = reference_of(self.engines)
        first = states[self.reference]
        self.energy_at_start = scene_energy(scene, first)
        unit = "% of the start" if self.energy_at_start else "kg px²/s²"
        gap = [Quantity("RMS gap", "px", logarithmic=True)] if len(states) > 1 else []
        self.quantities = (Quantity("energy", unit), *gap, Quantity("momentum", "kg px/s"))
        self.series = Series(1 + len(self.quantities) * len(states))  # time, and each quantity of each engine
        self.add(0, states)

    def add(self, step: int, states: Mapping[str, State]) -> None:
        """Add a sample of all engines, if one is due."""
        if self.series.wants(step):
            self.series.add(step, self._sample(states))

    def _sample(self, states: Mapping[str, State]) -> list[float]:
        scene, mass = self.scene, self.scene.bodies.mass
        unit = self.energy_at_start / 100 or 1.0
        values = [states[self.reference].time]
        values += [scene_energy(scene, state) / unit for state in states.values()]
        if len(states) > 1:
            reference = states[self.reference].position
            values += [float(np.sqrt(np.mean(length(state.position - reference) ** 2))) for state in states.values()]
        return values + [float(length(momentum(state.velocity, mass))) for state in states.values()]

    def of(self, quantity: int) -> Floats:
        """Return a quantity over time, one column per engine: (samples, engines)."""
        n = len(self.engines)
        return self.series.rows[:, 1 + quantity * n : 1 + (quantity + 1) * n]

    @property
    def times(self) -> Floats:
        """The times of the samples, s: (samples,)."""
        return self.series.rows[:, 0]


def scene_energy(scene: Scene, state: State) -> float:
    """Return the energy of a scene's balls in a state, kg px²/s²."""
    return float(energy(state, scene.bodies, scene.gravity, scene.arena.size))
