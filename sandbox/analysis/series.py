"""A comparison over time: the quantities of each engine after every step, as lines of charts and as CSV."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.figures import Run
from sandbox.files import whole_file
from sandbox.quantity import height
from sandbox.scene.units import Dimension
from sandbox.state import Floats
from sandbox.text import csv_text

SERIES: Final[dict[str, Callable[[Comparison, Run], np.ndarray[Any, Any]]]] = {  # column -> its values, (steps + 1,)
    "energy": lambda _, run: run.energy,  # kg px²/s², of flight, spin and gravity
    "gap_rms": lambda _, run: run.gap_rms,  # px
    "gap_max": lambda _, run: run.gap_max,
    "momentum_x": lambda _, run: run.momentum[:, 0],  # kg px/s
    "momentum_y": lambda _, run: run.momentum[:, 1],
    "angular_momentum": lambda _, run: run.angular_momentum,  # kg px²/s, about the arena's centre
    "centre_of_mass_height": lambda comparison, run: height(run.centre_of_mass, comparison.scene.arena.size),  # px
    "contacts": lambda comparison, run: contacts_by(comparison.time, run).astype(int),  # so far
}
BLOCK_STEPS: Final = 10_000  # that are written together
MAX_POINTS: Final = 2_000  # of a line, about; screens have fewer columns


def write_series(comparison: Comparison, path: str) -> None:
    """Write what `--series` writes: a row for each step and engine. Raises SandboxError if the file cannot be written.

    Within a step, the engines come in the comparison's order.
    """
    series = [[column(comparison, run) for column in SERIES.values()] for run in comparison.runs.values()]
    with whole_file(path) as file:
        file.write(csv_text([("time", "engine", *SERIES)]).encode())
        for start in range(0, len(comparison.time), BLOCK_STEPS):
            steps = slice(start, start + BLOCK_STEPS)
            block = [zip(*(values[steps].tolist() for values in columns), strict=True) for columns in series]
            rows = (
                (time, name, *values)
                for time, *of_step in zip(comparison.time[steps].tolist(), *block, strict=True)
                for name, values in zip(comparison.runs, of_step, strict=True)
            )
            file.write(csv_text(rows).encode())


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
