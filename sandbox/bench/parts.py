"""The parts of the benchmark."""

from collections.abc import Iterator, Sequence
from typing import Final

from sandbox.bench import engines, programs, window
from sandbox.bench.figure import Figure
from sandbox.errors import SandboxError, suggestion

# Name of a part -> its title, and the function that measures it.
PARTS: Final = {
    "pymunk": ("Pymunk engine, compared with a plain Pymunk loop", engines.against_plain_pymunk),
    "article": ("Article engine", engines.article),
    "exact": ("Exact engine, on one core", engines.exact),
    "compare": ("Comparison, relative to its engines run alone", programs.comparison),
    "window": ("Frame of the window: physics, panes and charts", window.frame),
    "start": ("Start-up: programs from start to end", programs.start),
}


def bench(only: Sequence[str] | None = None) -> Iterator[tuple[str, Iterator[Figure]]]:
    """Yield the title of each part, or of those named, and its figures, each measured when it is iterated over.

    Raises SandboxError if a part is unknown.
    """
    for name in only or ():
        if name not in PARTS:
            raise SandboxError(f"no benchmark {name!r}; {suggestion(name, PARTS)}")
    for title, measure in (PARTS[name] for name in only or PARTS):
        yield title, measure()
