"""How numba compiles kernels.

Never fastmath: every operation rounds as IEEE 754 prescribes. Division by zero yields infinity instead of raising, and
arrays are not reference-counted (`_nrt`), because both cost time at every access, together half of the event loop's,
and time to compile. Without reference counts, a kernel cannot make an array: Python passes all that it needs.

`kernel` is compiled into its callers; `entry` is called from Python, and its machine code is cached on disk; a
`portable_entry` gives the same bits in Python. The cache checks the entry's own file only: after an edit to a kernel in
another file, delete the cache (in `__pycache__`, or in NUMBA_CACHE_DIR). The tests do so by themselves.

Signal handlers wait until a kernel is compiled, loaded or saved: llvmlite runs Python in callbacks, where an exception
is lost, and releases LLVM's memory in destructors, which an exception would leave half done.

Compiling takes seconds, once. A program with something to show in that time has it done by a `Compiler`.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import wraps
from time import sleep
from typing import Any, Final, Protocol, cast

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.core.caching import FunctionCache
from numba.extending import intrinsic, register_jitable
from numpy.typing import NDArray

from sandbox.signals import checkpoint, signals_deferred

_OPTIONS: Final[dict[str, Any]] = {"error_model": "numpy", "_nrt": False}
_OF_ENTRY: Final = {**_OPTIONS, "nogil": True}  # so that a thread can run a kernel while others go on in Python
RETRY_INTERVAL: Final = 0.05  # s, until a thread looks again whether a kernel is compiled
MAX_IN_PYTHON: Final = 5_000  # numbers in the arrays that a portable kernel gets, to run in Python meanwhile


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


class _Cache(FunctionCache):
    """Numba's cache of one function, which asks the compiler for what it lacks.

    Numba's own initialises the compiler before it loads machine code, which takes 0.3 s and is not needed.
    """

    def load_overload(self, signature: object, context: object) -> object:
        code = self._load(signature, context)
        if code is None and _compiler:
            if not _of_thread.waits:
                _compiler.note_missing(self._py_func.__module__)
                raise NotCompiledYet
            _compiler.wait(self._py_func.__module__)
            code = self._load(signature, context)
        return code

    def save_overload(self, signature: object, compiled: object) -> None:
        with signals_deferred():
            super().save_overload(signature, compiled)  # type: ignore[no-untyped-call]

    def _load(self, signature: object, context: object) -> object:
        with signals_deferred(), self._guard_against_spurious_io_errors():
            try:
                return self._load_overload(signature, context)  # type: ignore[no-untyped-call]
            except (ImportError, AttributeError):  # written by another version, of other modules
                self.flush()  # type: ignore[no-untyped-call]
        return None


_Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]  # numba ships no types

# Never called: each call would copy all that its tuples of arrays refer to, 70 numbers for the World of `exact`, which
# has 1.19 to 1.22 times as many collisions per second without.
kernel: Final[_Decorator] = register_jitable(**_OPTIONS, forceinline=True)


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel that Python calls, when it is first called."""
    compiled = njit(**_OF_ENTRY)(function)
    compiled._cache = _Cache(function)  # type: ignore[no-untyped-call]
    compiled._compiler.compile = signals_deferred()(compiled._compiler.compile)
    compiled.compile = _waiting_in_threads(compiled.compile)
    return cast("Callable[..., Any]", compiled)


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


def portable_entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel that Python calls; while a compiler is at work, run small calls of it in Python."""
    compiled = entry(function)

    @wraps(function)
    def call(*args: Any) -> Any:
        if _compiler is None or _numbers_in(args) > MAX_IN_PYTHON:
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


Record = Any  # an element of a structured array; in a kernel, its fields are attributes, which write to the array


@intrinsic
def _prefetch(typing: Any, array: Any, index: Any) -> Any:
    """Start to fetch an element of an array from memory, without waiting, by LLVM's intrinsic, which numba lacks.

    With all calls of it in `exact`, `sandbox bench --only exact` has 1.24 times as many collisions per second as with
    none, for 100,000 discs that cover 20 % of the arena (426,000 and 346,000; medians of 5); 1.30 times if they cover
    50 %; for 10,000 discs that cover 20 % 1.09 times; for up to 1,000 discs 0.96 to 0.98 times.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        element = builder.gep(context.make_array(array)(context, builder, args[0]).data, [args[1]])
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch.p0", (), kind)
        to_read, and_keep, data = number(0), number(3), number(1)
        builder.call(fetch, [builder.bitcast(element, byte), to_read, and_keep, data])
        return context.get_dummy_value()

    return types.void(array, types.intp), generate


prefetch: Final = cast("Callable[[NDArray[Any], int | np.int64], None]", _prefetch)
