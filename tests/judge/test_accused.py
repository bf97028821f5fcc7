"""Engines of the sandbox in bundled scenes are accused of nothing that they do not do."""

from pathlib import Path
from typing import Final

import numpy as np
import pytest
from conftest import sample
from verdicts import causes_of, on_states, states_of

import sandbox
from sandbox.errors import Refused
from sandbox.judge.causes import Cause
from sandbox.scene.files import load

SCENES: Final = Path(sandbox.__file__).parent.parent / "scenes"
LARGE: Final = ("gas-1000", "gas-dense", "plinko", "pile", "marble-run", "galton-board", "funnel")
FILES: Final = sorted(SCENES.rglob("*.toml"), key=lambda file: (file.stem in LARGE, file))
SECONDS: Final = 1.5
STEPPED: Final = frozenset({Cause.LATE, Cause.MISSED})
DO: Final = {
    "exact": frozenset[Cause](),
    "impulse": STEPPED | {Cause.POSITION_CORRECTION},
    "pymunk": STEPPED | {Cause.POSITION_CORRECTION, Cause.GRAVITY, Cause.WARM_START, Cause.UNCONVERGED, Cause.DAMPING},
}


@pytest.mark.parametrize("engine", DO)
@pytest.mark.parametrize("file", sample(FILES, 8), ids=lambda file: file.stem)
def test_an_engine_is_not_accused_of_what_it_does_not_do(file: Path, engine: str) -> None:
    scene = load(str(file))
    try:
        states = states_of(scene, engine, seconds=min(scene.seconds, SECONDS))
    except Refused:
        pytest.skip(f"{engine} cannot run {file.stem}")
    verdict = on_states(scene, states)
    assert causes_of(verdict) <= DO[engine] | {Cause.UNKNOWN}, verdict.causes


@pytest.mark.parametrize("name", ["bouncing", "truths/friction-pair-slides", "newtons-cradle"])
def test_contacts_of_box2d_are_not_judged(name: str) -> None:
    """They last several steps."""
    pytest.importorskip("pyb2d3")
    scene = load(str(SCENES / f"{name}.toml"))
    verdict = on_states(scene, states_of(scene, "box2d"), is_soft=True)
    assert causes_of(verdict) <= {Cause.GRAVITY}


def test_what_article_does_is_named_with_its_parameter() -> None:
    """It divides impulses by the diameter of 40 px, finds contacts at the ends of steps, and puts balls on walls."""
    scene = load("article")
    verdict = on_states(scene, states_of(scene, "article", seconds=2))
    worst = verdict.causes[0]
    assert worst.cause == Cause.SMALL
    assert worst.parameter == pytest.approx(1 / 20)
    assert "40 px" in worst.sentence
    assert causes_of(verdict) <= {Cause.SMALL, Cause.LATE, Cause.MISSED, Cause.OVERSHOOT, Cause.UNKNOWN}


def test_what_pymunk_does_is_late_or_a_push_out_of_an_overlap_and_how_deep_is_said_of_islands_too() -> None:
    scene = load("newtons-cradle")
    errors = on_states(scene, states_of(scene, "pymunk")).errors
    assert set(errors["cause"]) == {Cause.LATE, Cause.POSITION_CORRECTION}
    assert set(errors["second"][errors["cause"] == Cause.POSITION_CORRECTION] < 0) == {True, False}
    assert np.isfinite(errors["depth"]).all()
