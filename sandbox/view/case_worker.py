"""A process that compares the run so far, beside the window: no frame waits for it."""

from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from sandbox.analysis.comparison import Comparison
from sandbox.errors import SandboxError
from sandbox.files import whole_file
from sandbox.processes import ChildProcess, serve
from sandbox.report.case import Case, case_of
from sandbox.report.run_so_far import ComparisonSoFar, RunSoFar
from sandbox.signals import signals_deferred

DIED = "the process that compares has died"


class CaseWorker:
    """Does one task after another in a process of its own, which begins with the first task.

    A task's result is what it returns, or the SandboxError that it raises.
    """

    def __init__(self) -> None:
        self._process: ChildProcess | None = None
        self.is_busy = False

    def ask(self, run: RunSoFar, page: str | None = None) -> None:
        """Begin to compare a run so far; write its page into a file if that is named. It must not be busy."""
        if self._process is None:
            with signals_deferred():  # else a process that has just started might never be stopped
                self._process = ChildProcess(_serve)
        self.is_busy = True
        self._process.send((run, page))

    def poll(self) -> Case | SandboxError | None:
        """Return what has become of the task if it is done. The task is then forgotten."""
        if not self.is_busy or self._process is None or not self._process.connection.poll():
            return None
        self.is_busy = False
        try:
            answer: Case | SandboxError = self._process.receive()
        except EOFError:  # a bug, of which it has printed the traceback, or too little memory
            self._process = None
            return SandboxError(DIED)
        return answer

    def stop(self) -> None:
        """End the process, and what it does."""
        self.is_busy = False
        if self._process is not None:
            self._process.stop()
            self._process = None


def _serve(connection: "Connection[Any, Any]") -> None:
    serve(connection, partial(answer, ComparisonSoFar()))


def answer(so_far: ComparisonSoFar, task: tuple[RunSoFar, str | None]) -> Case | SandboxError:
    """Return the summary of a run, and write its page into a file if that is named."""
    run, file = task
    try:
        comparison = so_far.of(run)
        if file is not None:
            _write_page(comparison, file)
        return case_of(run, comparison, so_far.marks)
    except SandboxError as error:
        return SandboxError(str(error))  # others, such as EngineError, cannot be pickled


def _write_page(comparison: Comparison, file: str) -> None:
    from sandbox.report.comparison import page  # noqa: PLC0415  # Bokeh takes a second to import

    with whole_file(file) as opened:
        opened.write(page(comparison).encode())
