"""A comparison as a script or a notebook uses it: figures by engine, text, files, a page."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Final, Self

from sandbox.analysis import comparison, verdict
from sandbox.analysis.figures import Figures
from sandbox.analysis.verdict import key_figures
from sandbox.report.tables import headline, print_comparison
from sandbox.run.trajectory import data_frame
from sandbox.scripting.arguments import ByName, save
from sandbox.text import DEFAULT_WIDTH, json_text, text_of

if TYPE_CHECKING:
    import pandas

IN_REPR: Final = ("energy change", "RMS gap", "first difference")  # rows of the table


class Comparison(comparison.Comparison, Mapping[str, Figures]):
    """Several engines' runs of one scene. `comparison["article"]` has the figures of an engine's run.

    It is a mapping of engines to their figures. The name of an engine that took no part raises a SandboxError that is a
    KeyError too, here and in `runs`.

    >>> import sandbox
    >>> comparison = sandbox.compare("oblique", ["pymunk", "exact"])
    >>> comparison
    <Oblique: 2 balls, 3 s at 60 steps a second, seed 0; reference: exact
      pymunk: RMS gap 6.991 px, first difference 0.867 s
      exact: RMS gap 0 px, first difference ->
    >>> comparison["pymunk"].causes[0].cause.key
    'late'
    >>> comparison["pymunk"].pair_contacts
    1
    >>> [name for name, figures in comparison.items() if figures.gap_rms > 5]
    ['pymunk']
    """

    @classmethod
    def of(cls, measured: comparison.Comparison) -> Self:
        """Return what was measured, as a comparison with text, files and a page."""
        values = {field.name: getattr(measured, field.name) for field in fields(measured)}
        return cls(**values | {"runs": ByName("engine", measured.runs)})

    def __getitem__(self, engine: str) -> Figures:
        """Return an engine's figures, under their names in JSON. Raises SandboxError if it took no part."""
        return self.runs[engine].figures

    def __iter__(self) -> Iterator[str]:
        return iter(self.runs)

    def __len__(self) -> int:
        return len(self.runs)

    def __repr__(self) -> str:
        rows = {label.partition(" until ")[0]: values for label, *values in key_figures(self)}
        lines = (
            f"  {name}: " + ", ".join(f"{label} {rows[label][number]}" for label in IN_REPR if label in rows)
            for number, name in enumerate(self.runs)
        )
        return f"<{headline(self)}\n" + "\n".join(lines) + ">"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the page."""
        from sandbox.report.notebook import html_of  # noqa: PLC0415  (Bokeh is slow to import)

        return html_of(self)

    @property
    def verdict(self) -> str:
        """A paragraph for each engine, the worst first: its energy, its causes, until when its paths agree."""
        return verdict.verdict(self)

    def table(
        self, width: int = DEFAULT_WIDTH, *, all_rows: bool = False, first: bool = False, contacts: int | None = None
    ) -> str:
        """Return the text that the command line prints, in so many columns, with `--all`, `--first`, `--contacts`."""
        return text_of(partial(print_comparison, self, all_rows=all_rows, first=first, contacts=contacts), width)

    def to_json(self) -> str:
        """Return the text that `--json` writes; `as_json` returns it as a dictionary."""
        return json_text(self.as_json())

    def to_dataframe(self) -> "pandas.DataFrame":
        """Return a pandas table with a row for each engine, and the columns of the CSV.

        Raises SandboxError if pandas is not installed.
        """
        return data_frame(self.rows())

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the page, as one .html file. Raises SandboxError if it cannot be written."""
        save("a report", path, {".html": self._page})

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the figures as .json or .csv, or the page as .html, by the path's ending.

        Raises SandboxError for another ending, or if the file cannot be written.
        """
        save("a comparison", path, {".json": self.to_json, ".csv": self.as_csv, ".html": self._page})

    def _page(self) -> str:
        from sandbox.report.comparison_page import page  # noqa: PLC0415  (Bokeh is slow to import)

        return page(self)
