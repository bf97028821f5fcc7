"""Many runs of a scene: seeds, rates, engines and settings -> a table with a row for each.

A row does not depend on where or when it runs: here, in another process, or on a cluster.
"""

from collections.abc import Iterator, Sequence
from typing import Final

from sandbox.engines.machine_code import KERNEL_ENGINES, compile_engines
from sandbox.errors import SandboxError
from sandbox.sweeps.jobs import COLUMNS, Job, Row, RowResult, Sweep, in_order, plan
from sandbox.sweeps.workers import run_locally, run_on_dask
from sandbox.text import csv_text

__all__ = ["Job", "Row", "RowResult", "Sweep", "as_csv", "in_order", "plan", "run"]


MANY_JOBS: Final = 500  # for which engines are compiled first


def run(sweep: Sweep, *, workers: int = 1, scheduler: str | None = None) -> Iterator[RowResult]:
    """Run the jobs of a sweep, locally or on a Dask cluster.

    Raises SandboxError if a row ran with another variant of pow than those before.
    """
    if len(sweep.jobs) >= MANY_JOBS:
        compile_engines(KERNEL_ENGINES)
    pow_before = None
    for result in run_on_dask(sweep, sweep.jobs, scheduler) if scheduler else run_locally(sweep, sweep.jobs, workers):
        if result.row is not None:
            pow_before = pow_before or result.row["pow"]
            if result.row["pow"] != pow_before:
                raise SandboxError(
                    f"{result.job}: ran where the C library's pow is the variant {result.row['pow']!r}, the rows "
                    f"before where it is {pow_before!r}, so results may differ; use processors of one kind"
                )
        yield result


def as_csv(rows: Sequence[Row]) -> str:
    """Return rows as a CSV table, whose columns are always the same."""
    return csv_text([COLUMNS, *([row.get(column) for column in COLUMNS] for row in rows)])
