"""Engines with one known fault each: the first difference never has a cause that is not true."""

from functools import cache
from importlib.metadata import EntryPoint
from typing import Final

import numpy as np
import pytest
from conftest import scene_of
from faults import FAULTS

import sandbox.engines
from sandbox.analysis.comparison import Reference, compare_with, run_reference
from sandbox.analysis.measurement import Run
from sandbox.judge.causes import Cause
from sandbox.scene.model import Scene

EIGHT: Final = "count = 8\nradius = 20\nspeed = 200\ninside = [[20, 20], [380, 280]]"
MIXED: Final = (
    "count = 4\nradius = 15\nspeed = 250\ninside = [[20, 20], [190, 280]]",
    "count = 3\nradius = 25\nmass = 5\nspeed = 120\ninside = [[200, 20], [380, 280]]",
)
WALLS: Final = """
[[walls]]
from = [130, 60]
to = [130, 150]
thickness = 6
[[walls]]
from = [230, 250]
to = [330, 180]
"""


ROUGH: Final = "\nfriction = 0.5\nspin = {from = -20, to = 20}"
FAST: Final = ("gas", "gravity", "inner walls", "mixed", "rough", "rough bounce", "rough and falling")

ROUGH_WALLS: Final = WALLS.replace("thickness = 6", "thickness = 6\nfriction = 0.9")


def gas(*balls: str, seed: int = 1, more: str = "", arena: str = "", walls: str = "") -> Scene:
    groups = [*balls[:-1], f"{balls[-1]}\n{walls}"]
    return scene_of(*groups, size=f"[400, 300]\n{arena}", more=f"seed = {seed}\nseconds = 1\n{more}")


@cache
def scenes(seed: int) -> dict[str, Scene]:
    return {
        "gas": gas(EIGHT, seed=seed),
        "gravity": gas(EIGHT, seed=seed, more="gravity = [0, 900]"),
        "rough": gas(EIGHT + ROUGH, seed=seed, arena="friction = 0.8"),
        "rough bounce": gas(EIGHT.replace("8", "1", 1) + ROUGH, seed=seed, arena="friction = 0.4"),
        "rough and falling": gas(
            *(group + ROUGH for group in MIXED), seed=seed, more="gravity = [0, 900]", arena="friction = 2"
        ),
        "rough inner walls": gas(EIGHT.replace("8", "6", 1) + ROUGH, seed=seed, walls=ROUGH_WALLS),
        "rough and soft": gas(EIGHT + ROUGH + "\nelasticity = 0.8", seed=seed, arena="friction = 0.3"),
        "inner walls": gas(EIGHT.replace("8", "6", 1), seed=seed, walls=WALLS),
        "two balls": gas(EIGHT.replace("8", "2", 1), seed=seed),
        "elasticity": gas(EIGHT + "\nelasticity = 0.9", seed=seed, arena="elasticity = 0.8"),
        "mixed": gas(*MIXED, seed=seed),
        "sideways": gas(*MIXED, seed=seed, more="gravity = [-300, 200]", walls=WALLS),
    }


@cache
def reference(name: str, seed: int) -> Reference:
    return run_reference(scenes(seed)[name], "exact")


def run_of(engine: str, name: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run an engine of `faults`, measured against exact."""
    entry = EntryPoint("faulty", f"faults:{engine}", sandbox.engines.ENTRY_POINTS)
    monkeypatch.setitem(sandbox.engines._BUILT_IN, "faulty", entry)
    return compare_with(reference(name, seed), scenes(seed)[name], "faulty").runs["faulty"]


def remainder(run: Run) -> float:
    """Return how far the ledger's lines are from adding up to the change of energy, as a share of the most."""
    change = run.energy[-1] - run.energy[0]
    lines = sum(entry.energy for entry in run.figures.ledger if entry.cause != Cause.SPIN)
    return float(abs(lines - change) / np.abs(run.energy).max())


@pytest.mark.parametrize("name", scenes(1))
def test_an_event_driven_engine_without_a_fault_does_not_differ(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(1, 4):
        run = run_of("EventDriven", name, seed, monkeypatch)
        assert run.differences == ()
        rightful = {Cause.ELASTICITY, Cause.FRICTION, Cause.SPIN, Cause.ROUNDING}
        assert {entry.cause for entry in run.figures.ledger} <= rightful


def judge(engine: str, seeds: range, names: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Print each cause named, and check that it is true, and that a cause is named often enough."""
    fault, shown, named = FAULTS[engine], 0, 0
    true = ", ".join(sorted(cause.key for cause in fault.true))
    for name in names:
        for seed in seeds:
            if not fault.fits(scenes(seed)[name]):
                continue
            run = run_of(engine, name, seed, monkeypatch)
            assert remainder(run) < 1e-9
            one = run.figures.first_difference
            print(f"{engine:28}{name:14}{seed:3}  {one.cause.key if one else '-':12}true: {true}")
            if one:
                assert one.cause in {*fault.true, Cause.UNKNOWN}, f"{name}, seed {seed}: {one.because} {fault.why}"
                shown += 1
                named += one.cause in fault.true
    assert shown or not fault.true
    assert named >= fault.named * shown, f"{named} of {shown} are named"


@pytest.mark.parametrize("engine", FAULTS)
def test_the_first_difference_of_a_known_fault(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    judge(engine, range(1, 3), FAST, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("engine", FAULTS)
def test_the_first_differences_of_a_known_fault_in_many_scenes(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    judge(engine, range(1, 5), tuple(scenes(1)), monkeypatch)


def test_the_faults_are_shown() -> None:
    """Each fault is shown by a fitting scene, or the test above would judge nothing."""
    assert len(FAULTS) >= 24
    for fault in FAULTS.values():
        assert any(fault.fits(scene) for scene in scenes(1).values())
