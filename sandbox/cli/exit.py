"""How a command ends: exit codes, signals and closed pipes."""

import errno
import io
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, TextIO

from sandbox.errors import Ended, SandboxError
from sandbox.files import telling
from sandbox.signals import _signals

NO_ROOM: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


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
        except SandboxError as mistake:
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
def _telling_of_numba() -> Iterator[None]:
    """Turn into a SandboxError that numba cannot keep what it compiles: all else that is written tells of itself."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        if isinstance(error, OSError) and error.errno in NO_ROOM:
            why = error.strerror
        elif "no locator available" in str(error):
            why = "neither the sandbox's own folder nor the user's can be"
        else:
            raise
        raise SandboxError(f"compiled engines cannot be written: {why}; NUMBA_CACHE_DIR names another folder") from None


class Stream(io.TextIOWrapper):
    """Standard output or error that says what is wrong with it, once; then it takes everything, and keeps nothing."""

    def __init__(self, stream: TextIO, name: str) -> None:
        lines = bool(stream.line_buffering)
        super().__init__(stream.buffer, encoding=stream.encoding, errors="replace", line_buffering=lines)
        self._called = name

    def write(self, text: str) -> int:
        """Write text. Raises SandboxError, or Ended."""
        with self._telling():
            return super().write(text)

    def flush(self) -> None:
        """Write what is held back. Raises SandboxError, or Ended."""
        with self._telling():
            super().flush()

    @contextmanager
    def _telling(self) -> Iterator[None]:
        try:
            with telling(self._called):
                yield
        except (SandboxError, Ended):
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            raise
