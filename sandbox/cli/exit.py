"""How a command ends: exit codes, signals and closed pipes."""

import errno
import io
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, TextIO

from sandbox.errors import EngineError, SandboxError, Terminated
from sandbox.files import write_errors
from sandbox.signals import signals_as_exceptions

DISK_FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def exit_codes() -> Iterator[None]:
    """Turn exceptions into exits: code 2 and one message for a SandboxError, the signal itself for Terminated.

    A shell reports the latter as 128 + the signal's number: 130 for Ctrl-C, 143 for SIGTERM, 141 for a closed pipe.
    """
    with _checked_streams():
        try:
            with signals_as_exceptions(), _numba_cache_errors():
                try:
                    yield
                finally:
                    if sys.stdout:
                        sys.stdout.flush()
        except SandboxError as error:
            try:
                print_error(error)
            finally:  # even if standard error cannot be written
                sys.exit(2)
        except (Terminated, SystemError) as error:
            end = error if isinstance(error, Terminated) else error.__cause__  # numba's kernels wrap it
            if not isinstance(end, Terminated):
                raise
            from multiprocessing import active_children  # most commands start no process

            for process in active_children():  # which an exit without a signal would stop
                process.terminate()
                process.join()
            signal.signal(end.number, signal.SIG_DFL)
            signal.raise_signal(end.number)


def print_error(error: SandboxError) -> None:
    """Print an error to standard error, after the traceback of an engine that is not built in."""
    if isinstance(error, EngineError):
        print(error.details, end="", file=sys.stderr)
    print(error, file=sys.stderr)


@contextmanager
def _checked_streams() -> Iterator[None]:
    """Replace both output streams by CheckedStreams. Text for a standard error that is closed is discarded."""
    before = sys.stdout, sys.stderr
    open_error = sys.stderr or io.TextIOWrapper(io.BytesIO())
    output = sys.stdout and CheckedStream(sys.stdout, "standard output")
    error = CheckedStream(open_error, "standard error")
    sys.stdout, sys.stderr = output, error
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
        for stream in filter(None, (output, error)):
            stream.detach()  # or it would close the buffer that both share


@contextmanager
def _numba_cache_errors() -> Iterator[None]:
    """Turn a failure to cache compiled engines into a SandboxError; all other writes have `write_errors`."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        if isinstance(error, OSError) and error.errno in DISK_FULL:
            why = error.strerror
        elif "no locator available" in str(error):
            why = "no cache folder is writable"
        else:
            raise
        raise SandboxError(f"compiled engines cannot be written: {why}; set NUMBA_CACHE_DIR to a folder") from None


class CheckedStream(io.TextIOWrapper):
    """Standard output or error that raises its first write error as a SandboxError, and then discards all text."""

    def __init__(self, stream: TextIO, name: str) -> None:
        lines = bool(stream.line_buffering)
        super().__init__(stream.buffer, encoding=stream.encoding, errors="replace", line_buffering=lines)
        self._label = name

    def write(self, text: str) -> int:
        """Write text. Raises SandboxError or Terminated."""
        with self._first_error_only():
            return super().write(text)

    def flush(self) -> None:
        """Write what is buffered. Raises SandboxError or Terminated."""
        with self._first_error_only():
            super().flush()

    @contextmanager
    def _first_error_only(self) -> Iterator[None]:
        try:
            with write_errors(self._label):
                yield
        except (SandboxError, Terminated):
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            raise
