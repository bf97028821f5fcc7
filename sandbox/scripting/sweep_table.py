"""The rows of a sweep, as a script or a notebook uses them."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from sandbox.files import whole_file
from sandbox.scripting.arguments import known, output
from sandbox.state import Floats
from sandbox.sweeps import Outcome, Row, Sweep, as_csv
from sandbox.text import counted


@dataclass(frozen=True, repr=False)
class SweepTable(Sequence[Row]):
    """The rows of a sweep, each a dictionary of its columns without the empty ones.

    sweep: what was planned; failures: the runs that failed, each with its `job` and why, `failure`.
    `pandas.DataFrame(table)` makes a pandas table of it.

    >>> import sandbox
    >>> table = sandbox.sweep("article", ["pymunk", "article"], seeds=range(2), seconds=2)
    >>> table
    <SweepTable: article, 4 rows against exact: 2 seeds, 1 rate, 2 engines>
    >>> table[1]["engine"], table.column("energy_ratio").round(3)
    ('article', array([1.   , 0.957, 1.   , 0.97 ]))
    """

    sweep: Sweep
    rows: list[Row]
    failures: list[Outcome]

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: slice) -> list[Row]: ...
    def __getitem__(self, index: int | slice) -> Row | list[Row]:
        return self.rows[index]

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        jobs = self.sweep.jobs
        counts = (counted(len({getattr(job, what) for job in jobs}), what) for what in ("seed", "rate", "engine"))
        failed = f"; {len(self.failures)} failed" if self.failures else ""
        rows = f"{counted(len(self), 'row')} against {self.sweep.against}"
        return f"<SweepTable: {self.sweep.scene.name}, {rows}: {', '.join(counts)}{failed}>"

    def column(self, name: str) -> Floats:
        """Return a column of numbers, NaN in rows without it: (rows,). Raises SandboxError if the name is unknown."""
        known("column", name, dict.fromkeys(key for row in self.rows for key in row))
        return np.array([row.get(name, np.nan) for row in self.rows])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table as .csv, or charts as one .html page, by the path's ending.

        Raises SandboxError for another ending, or if the file cannot be written.
        """
        file_name = output("a sweep", path, [".csv", ".html"])
        if file_name.endswith(".csv"):
            text = as_csv(self.rows)
        else:
            from sandbox.report.sweep import page  # noqa: PLC0415  (Bokeh is slow to import)

            text = page(self.sweep, self.rows)
        with whole_file(file_name) as file:
            file.write(text.encode())
