"""Scores of engines, as a script or a notebook uses them."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

from sandbox.analysis.verify import Board, Row, all_passed, as_json, as_junit
from sandbox.files import whole_file
from sandbox.report.tables import print_scores, tally_lines
from sandbox.scripting.arguments import known, output
from sandbox.text import DEFAULT_WIDTH, json_text, text_of


@dataclass(frozen=True, repr=False)
class Scores:
    """How engines met the expectations of scenes.

    `scores["oblique"]["exact"]` is the result of an engine in a scene: its `outcome`, its `scores`, and the `lines`
    that say what was missed. board: by scene, then by engine.

    >>> import sandbox
    >>> scores = sandbox.verify("oblique", ["exact", "article"])
    >>> scores
    <exact: 1 of 1 scene met
     article: 0 of 1 scene met, 1 missed>
    >>> scores["oblique"]["article"].outcome.name, scores.passed("exact")
    ('MISSED', True)
    """

    board: Board

    def __getitem__(self, scene: str) -> Row:
        """Return the results of a scene by engine. Raises SandboxError if the scene was not scored."""
        return self.board[known("scene", scene, self.board)]

    def __iter__(self) -> Iterator[str]:
        return iter(self.board)

    def __len__(self) -> int:
        return len(self.board)

    def __repr__(self) -> str:
        return "<" + "\n ".join(tally_lines(self.board)) + ">"

    def passed(self, *engines: str) -> bool:
        """Return whether engines, by default all, met every expectation that they did not refuse."""
        ran = list(next(iter(self.board.values())))
        return all_passed(self.board, [known("engine", name, ran) for name in engines] or ran)

    def table(self, width: int = DEFAULT_WIDTH) -> str:
        """Return the text that the command line prints, in so many columns."""
        return text_of(partial(print_scores, self.board), width)

    def to_json(self) -> str:
        """Return the text that `--json` writes."""
        return json_text(as_json(self.board))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scores as .json, or as JUnit .xml, by the path's ending.

        Raises SandboxError for another ending, or if the file cannot be written.
        """
        file_name = output("scores", path, [".json", ".xml"])
        with whole_file(file_name) as file:
            file.write((as_junit(self.board) if file_name.endswith(".xml") else self.to_json()).encode())
