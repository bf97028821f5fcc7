"""Figures, and how they are measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import process_time
from typing import Final

ROUNDS: Final = 7  # so that three disturbed rounds do not change the median


@dataclass(frozen=True)
class Figure:
    """A figure and its spread over the rounds. `means` describes it; `unit` is empty for a ratio."""

    name: str
    means: str
    unit: str
    median: float
    lowest: float
    highest: float


def figure(name: str, means: str, values: Sequence[float], unit: str = "") -> Figure:
    """Summarise the values of all rounds."""
    return Figure(name, means, unit, median(values), min(values), max(values))


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


def alternately(one: Callable[[], float], other: Callable[[], float]) -> list[tuple[float, float]]:
    """Take two measurements alternately, for ROUNDS rounds."""
    return [(one(), other()) for _ in range(ROUNDS)]
