"""Figures of a benchmark, and how they are measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import process_time
from typing import Final

SECONDS_PER_ROUND: Final = 0.3  # at least, for which each side of a ratio is measured


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


def repeats_of(act: Callable[[], object]) -> int:
    """Return how many calls a round has, at least 1. Calls it twice, which also warms it up."""
    act()
    return max(1, int(SECONDS_PER_ROUND / processor_time(act)))


def alternately(rounds: int, *measurements: Callable[[], float]) -> list[tuple[float, ...]]:
    """Take measurements alternately, for some rounds; return those of each round."""
    return [tuple(measure() for measure in measurements) for _ in range(rounds)]
