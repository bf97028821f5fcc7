"""The progress bar of a command on a terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sandbox.report.output import console

if TYPE_CHECKING:
    from sandbox.sweeps import Row, Sweep


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[..., object]]:
    """Yield a function that shows the fraction of a run that is done. Its second argument is another title."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    terminal = console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda done, title=title: bar.update(task, completed=done, description=title)


def sweep_with_bar(sweep: "Sweep", rows: "list[Row]", workers: int, scheduler: str | None) -> None:
    """Run the jobs of a sweep, add their rows to a list as they finish, and print each failure."""
    from sandbox.sweeps import run

    details = ""
    with progress_bar("runs") as progress:
        for done, outcome in enumerate(run(sweep, workers=workers, scheduler=scheduler), 1):
            progress(done / len(sweep.jobs))
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
