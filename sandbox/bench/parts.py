"""The parts of the benchmark."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple

from sandbox.bench import comparisons, engines, memory, programs, window
from sandbox.bench.figure import Figure
from sandbox.errors import SandboxError, suggestion

FEW_ROUNDS: Final = 5  # of what takes seconds: two disturbed rounds do not change the median
ROUNDS: Final = 7  # so that three disturbed rounds do not change the median


class Part(NamedTuple):
    """A part: its title, how many rounds it has, and what measures its figures in so many rounds."""

    title: str
    rounds: int
    measure: Callable[[int], Iterator[Figure]]


PARTS: Final = {
    "pymunk": Part("Pymunk engine, compared with a plain Pymunk loop", ROUNDS, engines.against_plain_pymunk),
    "article": Part("Article engine", ROUNDS, engines.article),
    "exact": Part("Exact engine, on one core", ROUNDS, engines.exact),
    "compare": Part("Comparison, relative to its engines and to plain Pymunk", FEW_ROUNDS, comparisons.comparison),
    "sweep": Part("Sweep in one process", FEW_ROUNDS, comparisons.sweep),
    "window": Part("Frame of the window: physics, panes and charts", ROUNDS, window.frame),
    "memory": Part("Memory (on Linux)", FEW_ROUNDS, memory.memory),
    "start": Part("Start-up: programs from start to end", ROUNDS, programs.start),
    "cold": Part("First start: programs with nothing compiled yet", FEW_ROUNDS, programs.cold),
}


def bench(only: Sequence[str] | None = None) -> Iterator[tuple[str, Iterator[Figure]]]:
    """Yield the title of each part, or of those named, and its figures, each measured when it is iterated over.

    Raises SandboxError if a part is unknown.
    """
    for name in only or ():
        if name not in PARTS:
            raise SandboxError(f"no benchmark {name!r}; {suggestion(name, PARTS)}")
    for part in (PARTS[name] for name in only or PARTS):
        yield part.title, part.measure(part.rounds)
