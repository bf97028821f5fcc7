"""Progress bars of a command on a terminal, also while kernels are compiled."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING, Final

from sandbox.text import console

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn

    from sandbox.sweeps import Journal, Sweep
    from sandbox.view.compilation import Compilation

BAR_DELAY: Final = 1.0  # s; shorter runs show no bar


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float], object] | None]:
    """Yield a function that shows the fraction of a run that is done, as a bar if that takes long.

    Without a terminal, yield None.
    """
    if not sys.stderr.isatty():
        yield None
        return

    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console(stderr=True), transient=True)
    task, since = bar.add_task(title, total=1.0), monotonic()

    def show(done: float) -> None:
        bar.update(task, completed=done)
        if monotonic() - since > BAR_DELAY:
            bar.start()

    try:
        yield show
    finally:
        bar.stop()


def terminal_bar(*columns: "str | ProgressColumn", transient: bool = True) -> "Progress":
    """Return a bar that is shown on a terminal only.

    columns: by default those of rich; transient: whether it disappears at the end.
    """
    from rich.progress import Progress

    terminal = console(stderr=True)
    return Progress(*columns, console=terminal, transient=transient, disable=not terminal.is_terminal)


def sweep_with_bar(sweep: "Sweep", kept: "Journal", workers: int, scheduler: str | None) -> int:
    """Run the jobs of a sweep that have no row yet, and print each failure; return the number of failures."""
    from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn

    from sandbox.sweeps import missing, run

    columns = (*Progress.get_default_columns()[:2], MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    failures, details, bar = 0, "", terminal_bar(*columns, transient=False)
    with bar:
        runs = bar.add_task("runs", total=len(sweep.jobs), completed=len(sweep.jobs) - len(missing(sweep, kept)))
        for outcome in run(sweep, kept, workers=workers, scheduler=scheduler):
            bar.advance(runs)
            if outcome.failure:
                failures += 1
                if outcome.details != details:  # the same traceback once, and not for each seed
                    print(details := outcome.details, end="", file=sys.stderr)
                when = "" if outcome.time is None else f" at {outcome.time:.3f} s"
                what = outcome.failure.removeprefix(f"{outcome.job.engine}: ")
                print(f"{outcome.job}{when}: {what}", file=sys.stderr)
    if failures:
        print(f"{failures} of {len(sweep.jobs)} rows are missing; the same command tries again", file=sys.stderr)
    return failures


class _TerminalCompiler:
    """Compiles what is missing in other processes, and shows on a terminal how far that is while it is waited for."""

    shows_frames = False

    def __init__(self) -> None:
        self._compilation: Compilation | None = None

    def note_missing(self, module: str) -> None:
        """Do nothing: a command that gets by without compiling ends sooner without it."""

    def wait(self, module: str) -> None:
        """Show the progress until the kernels of a module are compiled."""
        from rich.progress import BarColumn, TextColumn

        from sandbox.processes import core_count
        from sandbox.view.compilation import COMPUTATION, Compilation

        if not self._compilation:
            self._compilation = Compilation(COMPUTATION, core_count())
            if not console(stderr=True).is_terminal:
                print("Compiling what this command needs; that happens once.", file=sys.stderr)
        compilation = self._compilation
        bar = terminal_bar(TextColumn("{task.description}"), BarColumn())
        with bar:
            task = bar.add_task("", total=compilation.total)
            for progress in compilation.until_compiled(module):
                bar.update(task, description=str(progress), completed=progress.done)


def show_compiling() -> None:
    """From now on, have kernels that are not in the cache compiled in other processes, and show that on a terminal."""
    from sandbox.compiled import compile_by

    compile_by(_TerminalCompiler())
