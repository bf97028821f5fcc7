"""What a command shows on a terminal while it runs: progress bars, and a notice while numba compiles."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from time import monotonic
from typing import TYPE_CHECKING, Final

from sandbox.signals import signals_deferred
from sandbox.text import console

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.status import Status

    from sandbox.analysis.comparison import Comparison
    from sandbox.run.inputs import Input
    from sandbox.scene.model import Scene
    from sandbox.sweep import Journal, Sweep

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


def sweep_with_bar(sweep: "Sweep", kept: "Journal", workers: int, scheduler: str | None) -> int:
    """Run the jobs of a sweep that have no row yet, and print each failure; return the number of failures."""
    from sandbox.sweep import missing, run

    failures, bar = 0, _runs_bar()
    with displayed(bar):
        runs = bar.add_task("runs", total=len(sweep.jobs), completed=len(sweep.jobs) - len(missing(sweep, kept)))
        for outcome in run(sweep, kept, workers=workers, scheduler=scheduler):
            bar.advance(runs)
            if outcome.failure:
                failures += 1
                print(f"{outcome.job}: {outcome.failure}", file=sys.stderr)
    if failures:
        print(f"{failures} of {len(sweep.jobs)} rows are missing; the same command tries again", file=sys.stderr)
    return failures


@cache
def announce_compiling() -> None:
    """Print a notice, once in a process, if numba has to compile; it does so once and caches the result on disk."""
    from numba.core import event

    class Listener(event.Listener):
        announced = False

        def on_start(self, _event: event.Event) -> None:
            if not Listener.announced:
                print("Compiling the engines; this happens once.", file=sys.stderr)
            Listener.announced = True

        def on_end(self, _event: event.Event) -> None: ...

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]
