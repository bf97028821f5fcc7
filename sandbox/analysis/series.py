"""A comparison over time: the quantities of each engine after every step, as lines of charts and as CSV."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.figures import Run
from sandbox.files import whole_file
from sandbox.quantity import height
from sandbox.scene.units import Dimension
from sandbox.state import Floats
from sandbox.text import csv_text

SERIES_COLUMNS: Final = (
    "time",  # s
    "engine",
    "energy",  # kg px²/s², of flight, spin and gravity
    "gap_rms",  # px
    "gap_max",  # px
    "momentum_x",  # kg px/s
    "momentum_y",
    "angular_momentum",  # kg px²/s, about the arena's centre
    "centre_of_mass_height",  # px above the arena's lower edge
    "contacts",  # so far
)
BLOCK_STEPS: Final = 10_000  # that are written together
MAX_POINTS: Final = 2_000  # of a line, about; screens have fewer columns


def write_series(comparison: Comparison, path: str) -> None:
    """Write what `--series` writes: a row for each step and engine. Raises SandboxError if the file cannot be written.

    Within a step, the engines come in the comparison's order.
    """
    series = {name: _series(comparison, run) for name, run in comparison.runs.items()}
    with whole_file(path) as file:
        file.write(csv_text([SERIES_COLUMNS]).encode())
        for start in range(0, len(comparison.time), BLOCK_STEPS):
            steps = slice(start, start + BLOCK_STEPS)
            block = {name: [values[steps] for values in columns] for name, columns in series.items()}
            file.write(csv_text(_rows(comparison.time[steps], block)).encode())


def _series(comparison: Comparison, run: Run) -> list[np.ndarray[Any, Any]]:
    """Return the columns of an engine after its name, each (steps + 1,)."""
    above = height(run.centre_of_mass, comparison.scene.arena.size)
    contacts = contacts_by(comparison.time, run).astype(int)
    return [run.energy, run.gap_rms, run.gap_max, *run.momentum.T, run.angular_momentum, above, contacts]


def _rows(time: Floats, series: Mapping[str, Sequence[np.ndarray[Any, Any]]]) -> Iterator[list[object]]:
    """Yield a row for each step and engine. time: (steps,) s; series: engine -> its columns, each (steps,)."""
    engines = [zip(*(values.tolist() for values in columns), strict=True) for columns in series.values()]
    for moment, *of_step in zip(time.tolist(), *engines, strict=True):
        for name, values in zip(series, of_step, strict=True):
            yield [moment, name, *values]


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
