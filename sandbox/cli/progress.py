"""Progress bars of a command on a terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING, Final

from sandbox.text import console

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn

    from sandbox.sweeps import Row, Sweep

BAR_DELAY: Final = 1.0  # s; shorter runs show no bar


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[..., object] | None]:
    """Yield a function that shows the fraction of a run that is done, as a bar if that takes long.

    Its second argument is another title. Without a terminal, yield None.
    """
    if not sys.stderr.isatty():
        yield None
        return

    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console(stderr=True), transient=True)
    task, since = bar.add_task(title, total=1.0), monotonic()

    def show(done: float, title: str = title) -> None:
        bar.update(task, completed=done, description=title)
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


def sweep_with_bar(sweep: "Sweep", rows: "list[Row]", workers: int, scheduler: str | None) -> None:
    """Run the jobs of a sweep, add their rows to a list as they finish, and print each failure."""
    from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn

    from sandbox.sweeps import run

    columns = (*Progress.get_default_columns()[:2], MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    details, bar = "", terminal_bar(*columns, transient=False)
    with bar:
        runs = bar.add_task("runs", total=len(sweep.jobs))
        for outcome in run(sweep, workers=workers, scheduler=scheduler):
            bar.advance(runs)
            if outcome.row is not None:
                rows.append(outcome.row)
                continue
            if outcome.details != details:  # the same traceback once, and not for each seed
                print(details := outcome.details, end="", file=sys.stderr)
            when = "" if outcome.time is None else f" at {outcome.time:.3f} s"
            what = outcome.failure.removeprefix(f"{outcome.job.engine}: ")
            print(f"{outcome.job}{when}: {what}", file=sys.stderr)
    if missing := len(sweep.jobs) - len(rows):
        print(f"{missing} of {len(sweep.jobs)} rows are missing", file=sys.stderr)
