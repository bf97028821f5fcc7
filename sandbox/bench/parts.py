"""The parts of the benchmark, and what each of them guards."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple

from sandbox.bench import comparisons, engines, programs, window
from sandbox.bench.figure import Figure
from sandbox.errors import SandboxError, suggestion

FEW_ROUNDS: Final = 3  # of what takes seconds: one disturbed round does not change the median
ROUNDS: Final = 5  # so that two disturbed rounds do not change the median


class Benchmark(NamedTuple):
    """A part: what it guards, how many rounds it has, and what measures its figures in so many rounds."""

    guards: str
    rounds: int
    measure: Callable[[int], Iterator[Figure]]


PARTS: Final = {
    "pymunk": Benchmark("reading a Space costs little beside its steps", ROUNDS, engines.against_plain_pymunk),
    "recording": Benchmark("any program can be recorded while it runs", ROUNDS, engines.recording),
    "article": Benchmark("the time per ball hardly grows with their number", ROUNDS, engines.article),
    "exact": Benchmark("the event queue and the order in memory serve any gas", ROUNDS, engines.exact),
    "compare": Benchmark("what judging and twins cost beside the engines", FEW_ROUNDS, comparisons.comparison),
    "window": Benchmark("60 frames a second with thousands of balls", ROUNDS, window.frame),
    "memory": Benchmark("a comparison stays small, and the window does not grow", FEW_ROUNDS, programs.memory),
    "start": Benchmark("heavy libraries are imported only where they are needed", ROUNDS, programs.start),
    "cold": Benchmark("the window moves while kernels compile", FEW_ROUNDS, programs.cold),
}


def bench(only: Sequence[str] | None = None) -> Iterator[tuple[str, Iterator[Figure]]]:
    """Yield the title of each part, or of those named, and its figures, each measured when it is iterated over.

    Raises SandboxError if a part is unknown.
    """
    for name in only or ():
        if name not in PARTS:
            raise SandboxError(f"no benchmark {name!r}; {suggestion(name, PARTS)}")
    for name in only or PARTS:
        yield f"{name}: {PARTS[name].guards}", PARTS[name].measure(PARTS[name].rounds)
