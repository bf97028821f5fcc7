"""The horizon: when a copy of the reference, begun one unit in the last place to the right, is a radius away."""

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import scene_of

from sandbox.analysis.comparison import compare
from sandbox.engines import create
from sandbox.run.inputs import Grab, Input, Release
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn
from sandbox.state import Floats


def gaps(aside: float, seconds: float) -> Floats:
    """Return how far, px, the furthest ball of gas-100 is after each step from where it would be with no offset."""
    scene = load("gas-100")
    initial = spawn(scene)
    moved = initial.position.copy()
    moved[0, 0] += aside
    engines = [create("exact", scene, state) for state in (initial, replace(initial, position=moved))]
    found = []
    for _ in range(round(seconds * scene.rate)):
        for engine in engines:
            engine.step()
        found.append(np.linalg.norm(engines[0].state().position - engines[1].state().position, axis=1).max())
    return np.array(found)


def test_the_horizon_of_a_gas_follows_from_the_growth_of_an_offset() -> None:
    scene = load("gas-100")
    radius, x = scene.bodies.radius[0], spawn(scene).position[0, 0]
    gap = gaps(1e-10, 4)
    growing = slice(int(np.argmax(gap > 1e-9)), int(np.argmax(gap > 0.1)))
    growth = np.polyfit(np.arange(len(gap))[growing] / scene.rate, np.log(gap[growing]), 1)[0]
    expected = math.log(radius / (np.nextafter(x, np.inf) - x)) / growth
    horizon = compare(scene, ["exact"]).horizon
    assert horizon is not None
    print(f"horizon {horizon:.3f} s, expected ~{expected:.3f} s")
    assert expected / 2 < horizon < expected * 2


def test_the_horizon_is_when_the_twin_is_a_radius_away() -> None:
    scene = load("gas-100")
    x = spawn(scene).position[0, 0]
    gap = gaps(float(np.nextafter(x, np.inf) - x), 5)
    first = int(np.argmax(gap > scene.bodies.radius[0])) + 1
    assert compare(scene, ["exact", "impulse"]).horizon == first / 60


def test_balls_without_contacts_have_no_horizon() -> None:
    assert compare(load("head-on")).horizon is None


def test_beyond_the_horizon_few_balls_have_statistics_too() -> None:
    """Four of 60 px in a small box collide often enough to forget where they were within 20 s."""
    scene = scene_of("count = 4\nradius = 60\ninside = [[0, 0], [300, 300]]\nspeed = 300", size="[300, 300]")
    comparison = compare(scene.changed(seconds=20.0), ["impulse", "exact"])
    assert comparison.horizon is not None
    for run in comparison.runs.values():
        assert [row.because for row in run.theory] == ["equal shares of the energy's sphere", "virial theorem"]
    short = compare(scene.changed(seconds=0.5), ["impulse", "exact"])
    assert short.horizon is None
    assert not any(run.theory for run in short.runs.values())


def test_the_mouse_pulls_the_twin_too() -> None:
    scene = scene_of("radius = 20\nposition = [100, 100]").changed(seconds=2.0)
    inputs: list[Input] = [Grab(step=6, ball=0, at=(700, 500)), Release(step=60)]
    assert compare(scene, ["exact"], inputs=inputs).horizon is None


@pytest.mark.parametrize("against", ["pymunk", "article"])
def test_any_reference_has_a_twin(against: str) -> None:
    comparison = compare(load("gas-100").changed(seconds=8.0), ["pymunk", "article"], against=against)
    assert comparison.against == against
    assert comparison.horizon is None or 0 < comparison.horizon < 8
    assert "twin" not in " ".join(comparison.runs)
