"""The exact engine, which is right, is accused of nothing if its contacts are not known."""

from pathlib import Path
from typing import Final

import numpy as np
import pytest
from conftest import sample

import sandbox
from sandbox.judge.explain import MAX_TRIED
from sandbox.judge.judge import Judge
from sandbox.judge.timeline import Timeline
from sandbox.run.trajectory import simulate
from sandbox.scene.files import load
from sandbox.state import PUSH, States

SCENES: Final = Path(sandbox.__file__).parent.parent / "scenes"
LARGE: Final = ("gas-1000", "pile", "funnel")  # of heaps that move, or long
FILES: Final = sorted(file for file in SCENES.rglob("*.toml") if file.stem not in LARGE)


@pytest.mark.parametrize("file", sample(FILES, 4), ids=lambda file: file.stem)
def test_the_exact_engine_has_no_error(file: Path) -> None:
    """Where more than MAX_TRIED balls touch at once, a step is not computed, and so unknown."""
    scene = load(str(file))
    trajectory = simulate(scene, "exact", steps=min(scene.steps, int(2 * scene.rate)))
    still = np.zeros(trajectory.position.shape[:2])
    spin = still if trajectory.spin is None else trajectory.spin
    judge = Judge(scene)
    dt = 1 / scene.clock.rates(np.arange(1, len(still)))
    judge.add(States(trajectory.position, trajectory.velocity, still, spin), np.empty(0, PUSH), dt)
    assert [error.because for error in Timeline(judge).errors if len(error.balls) <= MAX_TRIED] == []
