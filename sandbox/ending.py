"""How a command ends: at a mistake, a signal, a pipe that nobody reads. What it has begun is undone first."""

import errno
import io
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final, TextIO

from sandbox.mistakes import Mistake
from sandbox.output import Ended, telling

SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, *((signal.SIGHUP,) if sys.platform != "win32" else ()))
SOON: Final = 0.001  # s
NO_ROOM: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

_holding: Final[list[None]] = []  # one for each `held` that one is in
_waiting: Final[list[int]] = []  # signals that came there


@contextmanager
def ending() -> Iterator[None]:
    """End the program as what happens within says: exit code 2 and one message at a mistake, by a signal at a signal.

    A shell tells the latter as 128 + its number: 130 for Ctrl-C, 143 for SIGTERM, 141 for a closed pipe.
    """
    with _streams():
        try:
            with _signals(), _telling_of_numba():
                try:
                    yield
                finally:
                    if sys.stdout:
                        sys.stdout.flush()
        except Mistake as mistake:
            try:
                print(mistake, file=sys.stderr)
            finally:  # also where nobody can be told
                sys.exit(2)
        except (Ended, SystemError) as error:
            end = error if isinstance(error, Ended) else error.__cause__  # as it comes out of numba's kernels
            if not isinstance(end, Ended):
                raise
            signal.signal(end.number, signal.SIG_DFL)
            signal.raise_signal(end.number)


@contextmanager
def _streams() -> Iterator[None]:
    """Have both outputs say what is wrong with them. Standard error, where it is closed, takes everything."""
    before = sys.stdout, sys.stderr
    open_error = sys.stderr or io.TextIOWrapper(io.BytesIO())
    output, error = sys.stdout and Stream(sys.stdout, "standard output"), Stream(open_error, "standard error")
    sys.stdout, sys.stderr = output, error
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
        for stream in filter(None, (output, error)):
            stream.detach()  # or it would close what both write to


@contextmanager
def _signals() -> Iterator[None]:
    """Raise Ended at a signal, but for those that are ignored, as nohup has it, or that are not Python's to handle."""
    handlers = {each: signal.getsignal(each) for each in SIGNALS}
    before = {each: handler for each, handler in handlers.items() if handler not in (signal.SIG_IGN, None)}
    hook = sys.unraisablehook
    for each in before:
        signal.signal(each, _end)
    sys.unraisablehook = _raise_again
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for each, handler in before.items():
            signal.signal(each, handler)


@contextmanager
def _telling_of_numba() -> Iterator[None]:
    """Turn into a Mistake that numba cannot keep what it compiles: all else that is written tells of itself."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        if isinstance(error, OSError) and error.errno in NO_ROOM:
            why = error.strerror
        elif "no locator available" in str(error):
            why = "neither the sandbox's own folder nor the user's can be"
        else:
            raise
        raise Mistake(f"compiled engines cannot be written: {why}; NUMBA_CACHE_DIR names another folder") from None


@contextmanager
def held() -> Iterator[None]:
    """Let a signal wait until something is done that must not be done by half."""
    _holding.append(None)
    try:
        yield
    finally:
        _holding.pop()
        if _waiting and not _holding:
            _end(_waiting.pop())


def _end(number: int, _frame: FrameType | None = None) -> None:
    if _holding:
        _waiting.append(number)
        return
    signal.signal(number, signal.SIG_DFL)  # who asks twice does not want to wait
    raise Ended(number)


def _raise_again(lost: "sys.UnraisableHookArgs") -> None:
    """Raise again, a little later, what was raised where nothing can be: in what C calls back, or as an object goes."""
    end = lost.exc_value
    if sys.platform == "win32" or not isinstance(end, Ended):  # Windows has no such timer
        sys.__unraisablehook__(lost)
        return
    number = end.number
    signal.signal(signal.SIGALRM, lambda *_: _end(number))
    signal.setitimer(signal.ITIMER_REAL, SOON)


class Stream(io.TextIOWrapper):
    """Standard output or error that says what is wrong with it, once; then it takes everything, and keeps nothing."""

    def __init__(self, stream: TextIO, name: str) -> None:
        lines = bool(stream.line_buffering)
        super().__init__(stream.buffer, encoding=stream.encoding, errors="replace", line_buffering=lines)
        self._called = name

    def write(self, text: str) -> int:
        """Write text. Raises Mistake, or Ended."""
        with self._telling():
            return super().write(text)

    def flush(self) -> None:
        """Write what is held back. Raises Mistake, or Ended."""
        with self._telling():
            super().flush()

    @contextmanager
    def _telling(self) -> Iterator[None]:
        try:
            with telling(self._called):
                yield
        except (Mistake, Ended):
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            raise
