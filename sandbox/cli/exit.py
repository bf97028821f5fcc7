"""How a command ends: exit codes, Ctrl-C, closed pipes and full disks."""

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, NoReturn

from sandbox.errors import EngineError, SandboxError

CTRL_C: Final = 130  # as shells report the signal
CLOSED_PIPE: Final = 141


@contextmanager
def exit_codes() -> Iterator[None]:
    """Turn exceptions into exit codes: 2 and one message for an error that a user can correct, 130 and 141.

    Letters that a stream lacks are replaced; text for a standard error that is closed is discarded.
    """
    sys.stderr = sys.stderr or io.StringIO()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        try:
            yield
        finally:
            if sys.stdout:
                sys.stdout.flush()
    except KeyboardInterrupt:
        _leave(CTRL_C)
    except BrokenPipeError:
        _leave(CLOSED_PIPE)
    except SandboxError as error:
        _leave(2, error)
    except OSError as error:  # such as a full disk; what fails at a file that the user named is a SandboxError
        _leave(2, SandboxError(f"{error.filename or 'output'}: {error.strerror or error}"))


def _leave(code: int, error: SandboxError | None = None) -> NoReturn:
    """Exit with a message, and discard what cannot be written."""
    try:
        if error:
            print_error(error)
    except OSError:
        pass
    finally:
        for stream in filter(None, (sys.stdout, sys.stderr)):
            try:
                stream.flush()
            except OSError:
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        sys.exit(code)


def print_error(error: SandboxError) -> None:
    """Print an error to standard error, after the traceback of an engine that is not built in."""
    if isinstance(error, EngineError):
        print(error.details, end="", file=sys.stderr)
    print(error, file=sys.stderr)
