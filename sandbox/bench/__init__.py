"""How fast the sandbox is: figures that are measured in turn, in one run, with their spread.

Machines are noisy, so a ratio of two things measured in turn says more than either alone; and what runs in this
process is measured by the time that the processor works for it.
"""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Final

import sandbox.view  # noqa: F401  (pygame is silent if it comes after this)
from sandbox.bench.figure import Figure
from sandbox.errors import SandboxError, nearest

__all__ = ["PARTS", "Figure", "bench"]

# What can be measured -> what its figures are, and what measures them.
PARTS: Final = {
    "pymunk": ("The Pymunk engine beside a plain Pymunk loop", "sandbox.bench.engines:beside_pymunk"),
    "article": ("The article's rule", "sandbox.bench.engines:article"),
    "exact": ("The exact engine, on one core", "sandbox.bench.engines:exact"),
    "compare": ("A comparison beside its engines alone", "sandbox.bench.programs:comparison"),
    "window": ("A frame of the window: physics, panes and charts", "sandbox.bench.window:frame"),
    "start": ("Programs from their start to their end", "sandbox.bench.programs:start"),
}


def bench(only: Sequence[str] | None = None) -> Iterator[tuple[str, Iterator[Figure]]]:
    """Yield the title of each part, or of those named, and its figures, which are measured as they are asked for.

    Raises SandboxError for a part that is none.
    """
    for name in only or ():
        if name not in PARTS:
            raise SandboxError(f"nothing to measure called {name!r}; {nearest(name, PARTS)}")
    for title, place in (PARTS[name] for name in only or PARTS):
        module, _, function = place.partition(":")
        measure: Callable[[], Iterator[Figure]] = getattr(import_module(module), function)
        yield title, measure()
