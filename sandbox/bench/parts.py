"""The parts of the benchmark, and what each of them guards."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple

from sandbox.bench import comparisons, engines, window
from sandbox.bench.figure import Figure
from sandbox.engines.machine_code import KERNEL_ENGINES, compile_engines
from sandbox.errors import SandboxError, suggestion

ROUNDS: Final = 3  # one disturbed round does not change the median


class Benchmark(NamedTuple):
    """A part: what it guards, and what measures its figures in some rounds."""

    guards: str
    measure: Callable[[int], Iterator[Figure]]


PARTS: Final = {
    "pymunk": Benchmark("reading a Space costs little beside its steps", engines.against_plain_pymunk),
    "exact": Benchmark("the event queue and the order in memory serve any gas", engines.exact),
    "compare": Benchmark("what judging costs beside the engines", comparisons.comparison),
    "window": Benchmark("60 frames a second with thousands of balls", window.frame),
}


def bench(only: Sequence[str] | None = None) -> Iterator[tuple[str, Iterator[Figure]]]:
    """Yield the title of each part, or of those named, and its figures, each measured when it is iterated over.

    Raises SandboxError if a part is unknown.
    """
    for name in only or ():
        if name not in PARTS:
            raise SandboxError(f"no benchmark {name!r}; {suggestion(name, PARTS)}")
    compile_engines(KERNEL_ENGINES)
    for name in only or PARTS:
        yield f"{name}: {PARTS[name].guards}", PARTS[name].measure(ROUNDS)
