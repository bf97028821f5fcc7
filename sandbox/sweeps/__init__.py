"""Many runs of a scene: seeds, rates, engines and settings -> a table with a row for each.

A row does not depend on where or when it runs: here, on a cluster, or after the sweep was killed and restarted.
"""

from collections.abc import Iterator, Sequence
from typing import Final

from sandbox.engines.machine_code import KERNEL_ENGINES, compile_engines
from sandbox.files import is_replaceable, write_text
from sandbox.sweeps.jobs import COLUMNS, Job, Row, Sweep, in_order, job_of, plan
from sandbox.sweeps.journal import Journal, journal_path, open_journal
from sandbox.sweeps.workers import RowResult, run_locally, run_on_dask
from sandbox.text import csv_text

__all__ = [
    "Job",
    "Journal",
    "Row",
    "RowResult",
    "Sweep",
    "as_csv",
    "in_order",
    "missing",
    "open_journal",
    "plan",
    "run",
    "write",
]


MANY_JOBS: Final = 500  # for which engines are compiled first


def missing(sweep: Sweep, kept: Journal) -> list[Job]:
    """List the jobs of a sweep that have no row yet."""
    done = {job_of(row) for row in kept.rows}
    return [job for job in sweep.jobs if job not in done]


def run(sweep: Sweep, kept: Journal, *, workers: int = 1, scheduler: str | None = None) -> Iterator[RowResult]:
    """Run the jobs that have no row yet, locally or on a Dask cluster; each row is saved before it is yielded."""
    jobs = missing(sweep, kept)
    if len(jobs) >= MANY_JOBS:
        compile_engines(KERNEL_ENGINES)
    for outcome in run_on_dask(sweep, jobs, scheduler) if scheduler else run_locally(sweep, jobs, workers):
        if outcome.row is not None:
            kept.add(outcome.row)
        yield outcome


def as_csv(rows: Sequence[Row]) -> str:
    """Return rows as a CSV table, whose columns are always the same."""
    return csv_text([COLUMNS, *([row.get(column) for column in COLUMNS] for row in rows)])


def write(sweep: Sweep, rows: Sequence[Row], out: str) -> None:
    """Write the table, and delete its journal once every row is there."""
    write_text(out, as_csv(rows))
    if is_replaceable(out) and len(rows) == len(sweep.jobs):
        journal_path(out).unlink(missing_ok=True)
