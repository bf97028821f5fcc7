"""A comparison over time: quantities of each engine after every step, as lines of charts."""

from typing import Any, Final

import numpy as np

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.figures import Run
from sandbox.scene.units import Dimension
from sandbox.state import Floats

MAX_POINTS: Final = 2_000  # of a line, about; screens have fewer columns


def energies(comparison: Comparison) -> tuple[dict[str, Floats], str]:
    """Return each engine's energy over time and its unit: %, 100 at the start, or the scene's if nothing moves."""
    runs = comparison.runs
    if comparison.energy_scale:
        return {name: 100 * (1 + run.energy_change) for name, run in runs.items()}, "%"
    units = comparison.scene.units
    factor = units.factor(Dimension.ENERGY)
    return {name: factor * run.energy for name, run in runs.items()}, units.name(Dimension.ENERGY)


def contacts_by(time: Floats, run: Run) -> Floats:
    """Return the number of a run's contacts up to each time."""
    return np.searchsorted(run.contacts["time"], time + 1e-9, side="right").astype(float)


def thinned(values: Floats, most: int = MAX_POINTS) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return about `most` indices of a series: its ends, and the lowest and the highest value of each interval."""
    if len(values) <= most:
        return np.arange(len(values))
    size = -(-2 * len(values) // most)
    intervals = np.pad(values, (0, -len(values) % size), mode="edge").reshape(-1, size)
    starts = np.arange(len(intervals)) * size
    chosen = np.concatenate([[0], starts + intervals.argmin(axis=1), starts + intervals.argmax(axis=1)])
    return np.unique(np.append(np.minimum(chosen, len(values) - 1), len(values) - 1))
