"""Figures, and how they are measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import process_time
from typing import Final

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
