"""Kernels: functions that numba compiles, and what happens while they are compiled.

`kernel` is compiled into its callers; `entry` is called from Python, and its machine code is cached on disk; a
`portable_entry` gives the same bits in Python. The cache checks the entry's own file only: after an edit to a kernel in
another file, delete the cache (in `__pycache__`, or in NUMBA_CACHE_DIR). The tests do so by themselves.

Numba takes longer to import than all else together, so these decorators only note the functions. The first call of an
entry imports `sandbox.jit`, and numba with it.

Compiling takes seconds, once. A program with something to show in that time has it done by a `Compiler`.
"""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import cache, wraps
from time import sleep
from types import ModuleType
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from sandbox.threads import checkpoint

RETRY_INTERVAL: Final = 0.05  # s, until a thread looks again whether a kernel is compiled
MAX_IN_PYTHON: Final = 5_000  # numbers in the arrays that a portable kernel gets, to run in Python meanwhile

Function = Callable[..., Any]  # numba ships no types
Record = Any  # an element of a structured array; in a kernel, its fields are attributes, which write to the array
_unregistered: Final[list[Function]] = []  # kernels that numba does not know of yet
_registration: Final = threading.Lock()
_numbers_before_numba = 0  # in all arrays that portable kernels got so far


class Compiler(Protocol):
    """Fills the cache with machine code while the program goes on.

    shows_frames: whether a window must not stand still meanwhile.
    """

    shows_frames: bool

    def note_missing(self, module: str) -> None:
        """Note that a kernel of a module is not compiled, while what it does can be done without it, or later."""

    def wait(self, module: str) -> None:
        """Return when the kernels of a module are compiled."""


class NotCompiledYet(Exception):
    """A kernel is not in the cache, and is not to be waited for."""


class _OfThread(threading.local):
    """waits: whether a kernel that is not in the cache is waited for; only the main thread can let a compiler wait."""

    def __init__(self) -> None:
        self.is_main = self.waits = threading.current_thread() is threading.main_thread()


_compiler: Compiler | None = None
_of_thread = _OfThread()


def compile_by(compiler: Compiler | None) -> None:
    """From now on, have kernels that are not in the cache compiled by a compiler; by None, where they are called."""
    global _compiler  # noqa: PLW0603
    _compiler = compiler


@contextmanager
def without_waiting() -> Iterator[None]:
    """Raise NotCompiledYet in this block where a kernel would have to be waited for."""
    _of_thread.waits, before = False, _of_thread.waits
    try:
        yield
    finally:
        _of_thread.waits = before


@contextmanager
def between_frames() -> Iterator[None]:
    """Raise NotCompiledYet in this block where a window would have to wait.

    Without a window, kernels are waited for: what a recording shows must not depend on what the cache holds.
    """
    with without_waiting() if _compiler and _compiler.shows_frames else nullcontext():
        yield


def _wait_for(module: str) -> None:
    """Return when the compiler, if there is one, has compiled a module. Raises NotCompiledYet where nothing waits."""
    if _compiler and not _of_thread.waits:
        _compiler.note_missing(module)
        raise NotCompiledYet
    if _compiler:
        _compiler.wait(module)


def kernel(function: Function) -> Function:
    """Compile a kernel into its callers. It is not called from Python, except by a portable entry.

    Never called in machine code either: each call would copy all that its tuples of arrays refer to, 70 numbers for the
    World of `exact`, which has 1.19 to 1.22 times as many collisions per second without.
    """
    _unregistered.append(function)
    return function


def entry(function: Function) -> Function:
    """Compile a kernel that Python calls, when it is first called."""

    @cache
    def dispatcher() -> Function:
        with _registration:
            jit = _jit()
            while _unregistered:
                jit.inline(_unregistered.pop())
            compiled: Function = jit.dispatcher(function, _wait_for)
        compiled.compile = _waiting_in_threads(compiled.compile)  # type: ignore[attr-defined]
        return compiled

    @wraps(function)
    def call(*args: Any) -> Any:
        return dispatcher()(*args)

    return call


@cache
def _jit() -> ModuleType:
    import sandbox.jit as jit  # noqa: PLC0415, PLR0402 (it imports numba)

    jit.compile_as_prefetch(prefetch)
    return jit


def _waiting_in_threads(compile_or_load: Callable[[object], object]) -> Callable[[object], object]:
    """Return a function that, in a thread beside the main one, tries again until the compiler is done.

    The thread must wait here: inside, it has numba's lock, which the main thread needs to load its own kernels.
    """

    def call(signature: object) -> object:
        while True:
            try:
                return compile_or_load(signature)
            except NotCompiledYet:
                if _of_thread.is_main:
                    raise
                checkpoint()
                sleep(RETRY_INTERVAL)

    return call


def portable_entry(function: Function) -> Function:
    """Compile a kernel that Python calls; run small calls of it in Python while that is sooner done.

    That is so while a compiler is at work, and before numba is imported, until all such calls together are no longer
    small: a command that only checks a scene needs no numba.
    """
    compiled = entry(function)

    @wraps(function)
    def call(*args: Any) -> Any:
        global _numbers_before_numba  # noqa: PLW0603
        numbers = _numbers_in(args)
        if "numba" not in sys.modules:
            _numbers_before_numba += numbers
            if _numbers_before_numba <= MAX_IN_PYTHON:
                return function(*args)
        if _compiler is None or numbers > MAX_IN_PYTHON:
            return compiled(*args)
        try:
            with without_waiting():
                return compiled(*args)
        except NotCompiledYet:
            return function(*args)

    return call


def _numbers_in(value: object) -> int:
    """Return how many numbers the arrays in (nested) tuples have."""
    if isinstance(value, tuple):
        return sum(map(_numbers_in, value))
    return value.size if isinstance(value, np.ndarray) else 0


def prefetch(array: NDArray[Any], index: "int | np.int64") -> None:
    """In machine code, start to fetch an element of an array from memory, without waiting; in Python, do nothing.

    With all calls of it in `exact`, `sandbox bench --only exact` has 1.24 times as many collisions per second as with
    none, for 100,000 discs that cover 20 % of the arena (426,000 and 346,000; medians of 5); 1.30 times if they cover
    50 %; for 10,000 discs that cover 20 % 1.09 times; for up to 1,000 discs 0.96 to 0.98 times.
    """
