"""A figure, and how it is measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import process_time
from typing import Final

ROUNDS: Final = 7  # enough for a median that one disturbance, or three, leave alone


@dataclass(frozen=True)
class Figure:
    """A figure and its spread over the rounds. `means` says what it is; `unit` is empty for a ratio."""

    name: str
    means: str
    unit: str
    median: float
    lowest: float
    highest: float


def figure(name: str, means: str, values: Sequence[float], unit: str = "") -> Figure:
    """Sum up what the rounds measured."""
    return Figure(name, means, unit, median(values), min(values), max(values))


def seconds(act: Callable[[], object], times: int = 1) -> float:
    """Return the processor's time for doing something, on average of so many times, s."""
    start = process_time()
    for _ in range(times):
        act()
    return (process_time() - start) / times


def times_for(act: Callable[[], object], total: float) -> int:
    """Return how often something can be done in so many seconds; doing it twice, it is warm then."""
    act()
    return max(1, int(total / seconds(act)))


def in_turn(one: Callable[[], float], other: Callable[[], float]) -> list[tuple[float, float]]:
    """Take two measurements in turn, for some rounds."""
    return [(one(), other()) for _ in range(ROUNDS)]
