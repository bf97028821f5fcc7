"""Scores of engines, and the rows of a sweep, as a script or a notebook uses them."""

import os
from collections.abc import Sequence
from functools import partial

import numpy as np

from sandbox.analysis.advice import TriedSettings, advised, recommend
from sandbox.analysis.advice import as_json as advice_as_json
from sandbox.report.tables import print_advice, print_scores, tally_lines
from sandbox.scores.verify import Board, SceneResults, all_passed, as_json
from sandbox.scripting.arguments import ByName, save
from sandbox.state import Floats
from sandbox.sweeps import Row, RowResult, Sweep, as_csv
from sandbox.text import DEFAULT_WIDTH, counted, json_text, text_of


class Scores(ByName[SceneResults]):
    """How engines met the expectations of scenes.

    `scores["oblique"]["exact"]` is the result of an engine in a scene: its `outcome`, its `scores`, and the `lines`
    that say what was missed. It is a mapping of scenes to their results by engine.

    >>> import sandbox
    >>> scores = sandbox.verify("oblique", ["exact", "article"])
    >>> scores
    <exact: 1 of 1 scene met
     article: 0 of 1 scene met, 1 missed>
    >>> scores["oblique"]["article"].outcome.name, scores.passed("exact")
    ('MISSED', True)
    """

    def __init__(self, board: Board) -> None:
        super().__init__("scene", {scene: ByName("engine", results) for scene, results in board.items()})

    def __repr__(self) -> str:
        return "<" + "\n ".join(tally_lines(self)) + ">"

    def passed(self, *engines: str) -> bool:
        """Return whether engines, by default all, met every expectation that they did not refuse."""
        ran = self[next(iter(self))]
        for name in engines:
            ran[name]  # raises SandboxError if it took no part
        return all_passed(self, list(engines or ran))

    def table(self, width: int = DEFAULT_WIDTH) -> str:
        """Return the text that the command line prints, in so many columns."""
        return text_of(partial(print_scores, self), width)

    def to_json(self) -> str:
        """Return the text that `--json` writes."""
        return json_text(as_json(self))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scores as .json. Raises SandboxError for another ending, or if the file cannot be written."""
        save("scores", path, {".json": self.to_json})


class SweepTable(list[Row]):
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

    def __init__(self, sweep: Sweep, rows: Sequence[Row], failures: Sequence[RowResult]) -> None:
        super().__init__(rows)
        self.sweep, self.failures = sweep, failures

    def __repr__(self) -> str:
        jobs = self.sweep.jobs
        counts = (counted(len({getattr(job, what) for job in jobs}), what) for what in ("seed", "rate", "engine"))
        failed = f"; {len(self.failures)} failed" if self.failures else ""
        rows = f"{counted(len(self), 'row')} against {self.sweep.against}"
        return f"<SweepTable: {self.sweep.scene.name}, {rows}: {', '.join(counts)}{failed}>"

    def column(self, name: str) -> Floats:
        """Return a column of numbers, NaN in rows without it: (rows,). Raises SandboxError if the name is unknown."""
        columns = ByName("column", dict.fromkeys((key for row in self for key in row), np.nan))
        return np.array([row.get(name, columns[name]) for row in self])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table as .csv. Raises SandboxError for another ending, or if the file cannot be written."""
        save("a sweep", path, {".csv": lambda: as_csv(self)})


class Advice(list[TriedSettings]):
    """Other settings of Pymunk that were tried on a scene, and which of them to use.

    Each has its `changes` and its figures; the first is the scene's own settings.

    >>> import sandbox
    >>> advice = sandbox.advise("oblique")
    >>> advice
    <Advice: 6 trials, best substeps=4>
    >>> advice.best.changes, advice[0].gap_rms > advice.best.gap_rms
    ({'substeps': 4}, True)
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

    def table(self, width: int = DEFAULT_WIDTH) -> str:
        """Return the text that `compare --advise` prints, in so many columns."""
        return text_of(partial(print_advice, self), width)

    def to_json(self) -> str:
        """Return what `compare --advise --json` writes about the trials."""
        return json_text(advice_as_json(self))
