"""Figures: how they are measured, and compared with those of an earlier benchmark."""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any, Final

from sandbox.errors import SandboxError
from sandbox.files import read_text
from sandbox.text import printable

PROCESS_NOISE: Final = 0.05  # fraction by which a figure varies from process to process, beyond the spread in each
MEMORY_NOISE: Final = 1.0  # MB, likewise: growth can be 0 in all rounds


@dataclass(frozen=True)
class Figure:
    """A figure and its spread over the rounds. `means` describes it; `unit` is empty for a ratio."""

    name: str
    means: str
    unit: str
    median: float
    lowest: float
    highest: float
    higher_is_better: bool = False

    def is_worse_than(self, earlier: "Figure") -> bool:
        """Return whether every round was worse than every round of an earlier measurement in another process."""
        gap = earlier.lowest - self.highest if self.higher_is_better else self.lowest - earlier.highest
        return gap > max(PROCESS_NOISE * abs(earlier.median), MEMORY_NOISE if self.unit == "MB" else 0.0)


def figure(name: str, means: str, values: Sequence[float], unit: str = "", *, higher_is_better: bool = False) -> Figure:
    """Summarise the values of all rounds."""
    return Figure(name, means, unit, median(values), min(values), max(values), higher_is_better)


def processor_time(act: Callable[[], object], times: int = 1) -> float:
    """Return the processor time of a call, s: the mean of so many calls."""
    start = process_time()
    for _ in range(times):
        act()
    return (process_time() - start) / times


def repeats_in(act: Callable[[], object], total: float) -> int:
    """Return how many calls fit in a number of seconds, at least 1. Calls it twice, which also warms it up."""
    act()
    return max(1, int(total / processor_time(act)))


def alternately(rounds: int, *measurements: Callable[[], float]) -> list[tuple[float, ...]]:
    """Take measurements alternately, for some rounds; return those of each round."""
    return [tuple(measure() for measure in measurements) for _ in range(rounds)]


def read_figures(file: Path) -> dict[str, Figure]:
    """Read the JSON of an earlier benchmark, and return its figures by name. Raises SandboxError if it is not one."""
    text = read_text(file)
    try:
        return {figure.name: figure for figure in map(_figure, json.loads(text))}
    except (ValueError, TypeError, OverflowError, RecursionError):
        raise SandboxError(f"{printable(str(file))}: is not a file of sandbox bench --json") from None


def _figure(fields: dict[str, Any]) -> Figure:
    """Return a figure that was read. Raises TypeError, ValueError or OverflowError if it is not one."""
    figure = Figure(**fields)
    numbers = (figure.lowest, figure.median, figure.highest)
    if not (isinstance(figure.name, str) and all(map(math.isfinite, numbers)) and [*numbers] == sorted(numbers)):
        raise ValueError("neither a name nor a spread")
    return figure


def worse(figures: Iterable[Figure], earlier: Mapping[str, Figure]) -> list[Figure]:
    """Return the figures that are worse than earlier ones of the same name by more than the spread."""
    return [figure for figure in figures if figure.name in earlier and figure.is_worse_than(earlier[figure.name])]
