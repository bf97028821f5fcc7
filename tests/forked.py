"""Commands and functions in a forked process, which has everything imported already."""

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from warnings import catch_warnings, simplefilter

from sandbox.cli import main
from sandbox.files import whole_file


def forked(act: Callable[[], object], out: int | None = None, error: int | None = None) -> int:
    """Start an act in a forked process, with other standard streams; return its id."""
    with catch_warnings():
        simplefilter("ignore", DeprecationWarning)  # of threads, which numpy's libraries have
        process = os.fork()
    if process:
        return process
    code = 120  # as Python's own, where a stream cannot be flushed
    try:
        for number, stream in ((1, out), (2, error)):
            if stream is not None:
                os.dup2(stream, number)
        streams = open(1, "w", closefd=False), open(2, "w", buffering=1, closefd=False)  # noqa: SIM115 (until the end)
        sys.stdout, sys.stderr = streams
        signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            act()
            code = 0
        except SystemExit as end:
            code = int(end.code or 0)
        if sys.stdout:
            sys.stdout.flush()
    except BaseException:
        sys.excepthook(*sys.exc_info())
        sys.stderr.flush()
    finally:
        os._exit(code)


def exit_code_of(process: int) -> int:
    """Wait for a process, and return its exit code; for a signal, minus its number."""
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def main_with(*arguments: str) -> Callable[[], None]:
    """Return a function that runs the command line."""

    def act() -> None:
        sys.argv[1:] = arguments
        main()

    return act


def outcome_of(*arguments: str, out: int | None = None) -> tuple[int, str]:
    """Run a command to its end; return its exit code and its standard error."""
    with Path("stderr").open("w+b") as error, Path(os.devnull).open("wb") as nowhere:
        code = exit_code_of(forked(main_with(*arguments), nowhere.fileno() if out is None else out, error.fileno()))
        error.seek(0)
        message = error.read().decode()
    Path("stderr").unlink()
    return code, message


def write_text(content: str, path: str) -> None:
    with whole_file(path) as file:
        file.write(content.encode())
