"""Progress bars of a command on a terminal, also while kernels are compiled."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING, Final

from sandbox.signals import signals_deferred
from sandbox.text import console

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.status import Status

    from sandbox.analysis.advice import Trial
    from sandbox.analysis.comparison import Comparison
    from sandbox.run.inputs import Input
    from sandbox.scene.model import Scene
    from sandbox.sweeps import Journal, Sweep
    from sandbox.sweeps.convergence import Convergence
    from sandbox.view.compilation import Compilation

BAR_DELAY: Final = 1.0  # s; shorter runs show no bar


@contextmanager
def displayed(bar: "Progress | Status") -> Iterator[None]:
    """Display a bar, which hides the cursor, and restore the cursor however the block ends."""
    try:
        with signals_deferred():
            bar.start()
        yield
    finally:
        bar.stop()


@contextmanager
def _comparison_bar(title: str) -> Iterator[Callable[[float], object] | None]:
    """Yield a function that shows the fraction of a run that is done as a bar, or None without a terminal."""
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
            with signals_deferred():
                bar.start()

    try:
        yield show
    finally:
        bar.stop()


def frames_bar() -> "Progress":
    """Return a bar over the frames of a recording, which disappears at the end."""
    from rich.progress import Progress

    terminal = console(stderr=True)
    return Progress(console=terminal, transient=True, disable=not terminal.is_terminal)


def _runs_bar() -> "Progress":
    """Return a bar over the runs of a sweep, with their number and the time."""
    from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn

    terminal = console(stderr=True)
    columns = (*Progress.get_default_columns()[:2], MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    return Progress(*columns, console=terminal, disable=not terminal.is_terminal)


def compare_with_bar(
    scene: "Scene", names: Sequence[str] | None, against: str | None, inputs: "Sequence[Input]"
) -> "Comparison":
    """Compare engines, with a bar on a terminal if that takes long."""
    from sandbox.analysis.comparison import compare as compare_engines

    with _comparison_bar(scene.title or scene.name) as progress:
        return compare_engines(scene, names, against=against, inputs=inputs, progress=progress)


def advise_with_bar(scene: "Scene", against: str, inputs: "Sequence[Input]") -> "list[Trial]":
    """Try other settings of Pymunk, with a bar on a terminal if that takes long."""
    from sandbox.analysis.advice import try_settings

    with _comparison_bar("Trying other settings") as progress:
        return try_settings(scene, against, inputs, progress)


def converge_with_bar(scene: "Scene", engines: Sequence[str], rates: Sequence[int], starts: int) -> "Convergence":
    """Measure the order of engines, with a bar on a terminal if that takes long."""
    from sandbox.sweeps.convergence import converge

    with _comparison_bar(scene.title or scene.name) as progress:
        return converge(scene, engines, rates, starts, progress)


def sweep_with_bar(sweep: "Sweep", kept: "Journal", workers: int, scheduler: str | None) -> int:
    """Run the jobs of a sweep that have no row yet, and print each failure; return the number of failures."""
    from sandbox.sweeps import missing, run

    failures, details, bar = 0, "", _runs_bar()
    with displayed(bar):
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
        from rich.progress import BarColumn, Progress, TextColumn

        from sandbox.processes import core_count
        from sandbox.view.compilation import COMPUTATION, Compilation

        terminal = console(stderr=True)
        if not self._compilation:
            self._compilation = Compilation(COMPUTATION, core_count())
            if not terminal.is_terminal:
                print("Compiling what this command needs; that happens once.", file=sys.stderr)
        compilation = self._compilation
        bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            console=terminal,
            transient=True,
            disable=not terminal.is_terminal,
        )
        with displayed(bar):
            task = bar.add_task("", total=compilation.total)
            for progress in compilation.until_compiled(module):
                bar.update(task, description=str(progress), completed=progress.done)


def show_compiling() -> None:
    """From now on, have kernels that are not in the cache compiled in other processes, and show that on a terminal."""
    from sandbox.compiled import compile_by

    compile_by(_TerminalCompiler())
