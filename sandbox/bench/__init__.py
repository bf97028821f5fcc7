"""Benchmarks: how fast the sandbox is, as figures with their spread.

Machines are noisy. So two things to compare are measured alternately, and their ratio says more than either alone; and
what runs in this process is measured in processor time.
"""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Final

import sandbox.view  # noqa: F401  (pygame is silent if it comes after this)
from sandbox.bench.figure import Figure
from sandbox.errors import SandboxError, suggestion

__all__ = ["PARTS", "Figure", "bench"]

# Name of a part -> its title, and the function that measures it.
PARTS: Final = {
    "pymunk": ("Pymunk engine, compared with a plain Pymunk loop", "sandbox.bench.engines:against_plain_pymunk"),
    "article": ("Article engine", "sandbox.bench.engines:article"),
    "exact": ("Exact engine, on one core", "sandbox.bench.engines:exact"),
    "compare": ("Comparison, relative to its engines run alone", "sandbox.bench.programs:comparison"),
    "window": ("Frame of the window: physics, panes and charts", "sandbox.bench.window:frame"),
    "start": ("Start-up: programs from start to end", "sandbox.bench.programs:start"),
}


def bench(only: Sequence[str] | None = None) -> Iterator[tuple[str, Iterator[Figure]]]:
    """Yield the title of each part, or of those named, and its figures, each measured when it is iterated over.

    Raises SandboxError if a part is unknown.
    """
    for name in only or ():
        if name not in PARTS:
            raise SandboxError(f"no benchmark {name!r}; {suggestion(name, PARTS)}")
    for title, place in (PARTS[name] for name in only or PARTS):
        module, _, function = place.partition(":")
        measure: Callable[[], Iterator[Figure]] = getattr(import_module(module), function)
        yield title, measure()
