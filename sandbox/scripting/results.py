"""What the functions of a script return: a comparison, scores, the rows of a sweep, advice."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from sandbox.analysis import comparison, verdict
from sandbox.analysis.advice import TriedSettings, advised, recommend
from sandbox.analysis.figures import Figures
from sandbox.errors import SandboxError
from sandbox.files import write_text
from sandbox.report.output import DEFAULT_WIDTH, json_text, text_of
from sandbox.report.tables import headline, print_comparison, print_scores, tally_lines
from sandbox.scores.verify import SceneResults, all_passed, as_json
from sandbox.sweeps import Row, RowResult, Sweep, as_csv
from sandbox.text import counted


def save(path: str | os.PathLike[str], texts: Mapping[str, Callable[[], str]]) -> None:
    """Write the text for the ending of a path. Raises SandboxError for another ending, or if it cannot be written."""
    if (ending := Path(path).suffix) not in texts:
        raise SandboxError(f"{path}: must end in {' or '.join(texts)}")
    write_text(str(path), texts[ending]())


class Comparison(comparison.Comparison, Mapping[str, Figures]):
    """Several engines' runs of one scene: a mapping of engines to their figures, under their names in JSON.

    >>> import sandbox
    >>> comparison = sandbox.compare("oblique", ["pymunk", "exact"])
    >>> comparison
    <Oblique: 2 balls, 3 s at 60 steps a second, seed 0; reference: exact>
    >>> comparison["pymunk"].causes[0].cause.key
    'late'
    >>> comparison["pymunk"].pair_contacts
    1
    >>> [name for name, figures in comparison.items() if figures.gap_rms > 5]
    ['pymunk']
    """

    def __getitem__(self, engine: str) -> Figures:
        return self.runs[engine].figures

    def __iter__(self) -> Iterator[str]:
        return iter(self.runs)

    def __len__(self) -> int:
        return len(self.runs)

    def __repr__(self) -> str:
        return f"<{headline(self)}>"

    @property
    def verdict(self) -> str:
        """A paragraph for each engine, the worst first: its energy, its causes, until when its paths agree."""
        return verdict.verdict(self)

    def table(
        self, width: int = DEFAULT_WIDTH, *, all_rows: bool = False, first: bool = False, contacts: int | None = None
    ) -> str:
        """Return the text that the command line prints, in so many columns, with `--all`, `--first`, `--contacts`."""
        return text_of(partial(print_comparison, self, all_rows=all_rows, first=first, contacts=contacts), width)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the figures as .json or .csv, or the page as .html, by the path's ending.

        Raises SandboxError for another ending, or if the file cannot be written.
        """
        save(path, {".json": lambda: json_text(self.as_json()), ".csv": self.as_csv, ".html": self._page})

    def _page(self) -> str:
        from sandbox.report.comparison_page import page  # noqa: PLC0415  (Bokeh is slow to import)

        return page(self)


class Scores(dict[str, SceneResults]):
    """How engines met the expectations of scenes: a dictionary of scenes to their results by engine.

    `scores["oblique"]["exact"]` is the result of an engine in a scene: its `outcome`, its `scores`, and the `lines`
    that say what was missed.

    >>> import sandbox
    >>> scores = sandbox.verify("oblique", ["exact", "article"])
    >>> scores
    <exact: 1 of 1 scene met
     article: 0 of 1 scene met, 1 missed>
    >>> scores["oblique"]["article"].outcome.name, scores.passed()
    ('MISSED', False)
    """

    def __repr__(self) -> str:
        return "<" + "\n ".join(tally_lines(self)) + ">"

    def passed(self) -> bool:
        """Return whether all engines met every expectation that they did not refuse."""
        return all_passed(self, list(next(iter(self.values()))))

    def table(self, width: int = DEFAULT_WIDTH) -> str:
        """Return the text that the command line prints, in so many columns."""
        return text_of(partial(print_scores, self), width)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scores as .json. Raises SandboxError for another ending, or if the file cannot be written."""
        save(path, {".json": lambda: json_text(as_json(self))})


class SweepTable(list[Row]):
    """The rows of a sweep, each a dictionary of its columns without the empty ones.

    sweep: what was planned; failures: the runs that failed, each with its `job` and why, `failure`.
    `pandas.DataFrame(table)` makes a pandas table of it.

    >>> import sandbox
    >>> table = sandbox.sweep("article", ["pymunk", "article"], seeds=range(2), seconds=2)
    >>> table
    <SweepTable: article, 4 rows>
    >>> [(row["engine"], round(row["energy_ratio"], 3)) for row in table[:2]]
    [('pymunk', 1.0), ('article', 0.957)]
    """

    def __init__(self, sweep: Sweep, rows: Sequence[Row], failures: Sequence[RowResult]) -> None:
        super().__init__(rows)
        self.sweep, self.failures = sweep, failures

    def __repr__(self) -> str:
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"<SweepTable: {self.sweep.scene.name}, {counted(len(self), 'row')}{failed}>"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table as .csv. Raises SandboxError for another ending, or if the file cannot be written."""
        save(path, {".csv": lambda: as_csv(self)})


class Advice(list[TriedSettings]):
    """Other settings of Pymunk that were tried on a scene, and which of them to use.

    Each has its `changes` and its figures; the first is the scene's own settings.

    >>> import sandbox
    >>> advice = sandbox.advise("oblique")
    >>> advice
    <Advice: 6 trials, best substeps=4>
    >>> advice[0].gap_rms > advice.best.gap_rms
    True
    """

    def __repr__(self) -> str:
        return f"<Advice: {counted(len(self), 'trial')}, best {self.best.settings}>"

    @property
    def best(self) -> TriedSettings:
        """The trial to use; it is the first if no other is better."""
        return advised(self)

    @property
    def recommendation(self) -> str:
        """A paragraph: what to change, what that gains, and what becomes worse."""
        return recommend(self)
