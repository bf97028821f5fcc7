"""The scoreboard: how well engines meet the expectations of scenes."""

from collections.abc import Iterable, Sequence

from sandbox.analysis.comparison import compare
from sandbox.analysis.expectations import Score, worst
from sandbox.analysis.reference import REFERENCE
from sandbox.errors import Refused
from sandbox.scene.model import Scene

Board = dict[str, dict[str, Score | Refused]]  # scene -> engine -> its worst score, or why it refused the scene


def verify(scenes: Iterable[Scene], engines: Sequence[str]) -> Board:
    """Score engines on scenes by the expectation that each misses most, relative to its tolerance.

    Scenes without expectations are left out. Raises SandboxError for an unknown engine.
    """
    return {scene.name: {name: _score(scene, name) for name in engines} for scene in scenes if scene.expect}


def _score(scene: Scene, engine: str) -> Score | Refused:
    try:
        end = max(1 / scene.rate, *(expect.at for expect in scene.expect))  # s; a run has at least one step
        run = compare(scene.changed(seconds=end), [engine]).runs[engine]
    except Refused as refusal:
        return refusal
    return worst(run.scores)


def as_json(board: Board) -> dict[str, object]:
    """Return what `--json` writes."""

    def entry(result: Score | Refused) -> dict[str, object]:
        if isinstance(result, Refused):
            return {"refused": str(result)}
        return {"error": result.error, "tolerance": result.expect.tolerance, "passed": result.passed}

    return {"scenes": {scene: {name: entry(one) for name, one in row.items()} for scene, row in board.items()}}


def all_passed(board: Board, engines: Sequence[str] | None) -> bool:
    """Return whether the given engines, by default the exact one, met every expectation that they did not refuse."""
    must_pass = engines or [REFERENCE]
    return all(
        result.passed
        for row in board.values()
        for name, result in row.items()
        if name in must_pass and isinstance(result, Score)
    )
