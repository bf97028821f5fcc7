"""The first difference of an engine from another."""

from collections.abc import Sequence
from typing import Any

from sandbox.analysis.comparison import compare
from sandbox.analysis.difference import Difference
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene


def first_difference(scene: Scene, engine: Any, against: str = "exact", inputs: Sequence[Input] = ()) -> Difference:
    """Return the first difference of a run; fail if there is none. engine: a spec or a class."""
    engines = {"engine": engine, against: against}
    difference = compare(scene, engines, against=against, inputs=inputs).runs["engine"].figures.first_difference
    assert difference is not None
    return difference
