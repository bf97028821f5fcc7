"""A process that compares the run so far, beside the window: no frame waits for it."""

import multiprocessing
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from sandbox.analysis.comparison import Comparison
from sandbox.errors import SandboxError
from sandbox.files import whole_file
from sandbox.report.case import Case, RunSoFar, case_of
from sandbox.signals import sigint_blocked, signals_deferred

DIED = "the process that compares has died"


class CaseWorker:
    """Does one task after another in a process of its own, which begins with the first task.

    A task's result is what it returns, or the SandboxError that it raises.
    """

    def __init__(self) -> None:
        self._process: BaseProcess | None = None
        self.is_busy = False

    def ask(self, run: RunSoFar, page: str | None = None) -> None:
        """Begin to compare a run so far; write its page into a file if that is named. It must not be busy."""
        if self._process is None:
            self._start()
        self.is_busy = True
        with suppress(OSError):  # it has died, which `poll` notices
            self._connection.send((run, page))

    def poll(self) -> Case | SandboxError | None:
        """Return what has become of the task if it is done. The task is then forgotten."""
        if not self.is_busy or not self._connection.poll():
            return None
        self.is_busy = False
        try:
            answer: Case | SandboxError = self._connection.recv()
        except (EOFError, OSError):  # a bug, of which it has printed the traceback, or too little memory
            self.stop()
            return SandboxError(DIED)
        return answer

    def stop(self) -> None:
        """End the process, and what it does."""
        self.is_busy = False
        if self._process is not None:
            self._connection.close()
            self._process.terminate()
            self._process.join()
            self._process = None

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")  # a forked process would share the locks of running threads
        self._connection, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs,), daemon=True)
        with signals_deferred(), sigint_blocked():  # else a process that has just started might never be stopped
            process.start()
            self._process = process
        theirs.close()


def _serve(connection: "Connection[Any, Any]") -> None:
    """Do tasks until the other end of the connection is closed."""
    with suppress(EOFError, OSError):
        while True:
            connection.send(_answer(*connection.recv()))


def _answer(run: RunSoFar, file: str | None) -> Case | SandboxError:
    try:
        comparison = run.compare()
        if file is not None:
            _write_page(comparison, file)
        return case_of(run, comparison)
    except SandboxError as error:
        return SandboxError(str(error))  # others, such as EngineError, cannot be pickled


def _write_page(comparison: Comparison, file: str) -> None:
    from sandbox.report.comparison import page  # noqa: PLC0415  # Bokeh takes a second to import

    with whole_file(file) as opened:
        opened.write(page(comparison).encode())
