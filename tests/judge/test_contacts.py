"""What may touch is what brute force finds, and when it does is what closed forms say."""

import math
from typing import Final

import numpy as np
import pytest
from conftest import scene_of
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.judge.contacts import due, near_pairs, near_walls, to_touch
from sandbox.judge.run import NEVER, Contacts, Run
from sandbox.run.mouse import PUSH
from sandbox.scene.model import Scene
from sandbox.state import States

DT: Final = 1 / 60
WALLS: Final = (
    "[[walls]]\nfrom = [130, 60]\nto = [130, 150]\nthickness = 6\n[[walls]]\nfrom = [230, 250]\nto = [330, 180]"
)


def run_of(scene: Scene, states: States) -> Run:
    steps = len(states.position) - 1
    return Run(scene, states, np.empty(0, PUSH), np.full(steps, DT))


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), balls=st.integers(2, 40), steps=st.integers(1, 3))
def test_what_is_near_is_what_brute_force_finds(seed: int, balls: int, steps: int) -> None:
    """Balls of all sizes in a random place each step, some beyond the arena."""
    random = np.random.default_rng(seed)
    groups = "\n[[balls]]\n".join(f"radius = {r}\nposition = [200, 150]" for r in random.uniform(2, 30, balls))
    scene = scene_of(f"{groups}\n{WALLS}", size="[400, 300]\noverlap = 1000")
    states = States.empty(steps + 1, balls)
    states.position[:] = random.uniform(-20, 420, states.position.shape)
    states.velocity[:] = 0
    run = run_of(scene, states)
    way = random.uniform(0, 20, (steps, balls))
    found = {
        tuple(row) for row in zip(*(part.tolist() for part in near_pairs(run, *run.every, way.ravel())), strict=True)
    }
    x, r = run.x[:-1], run.r
    gap = np.abs(x[:, :, None] - x[:, None]) - r[:, None] - r - way[:, :, None] - way[:, None]
    assert found == {(k, i, j) for k, i, j in np.argwhere(gap <= 0).tolist() if i < j}
    walls = near_walls(run, *(part.ravel() for part in (*np.indices(way.shape), way)))
    k, i, j = (part.ravel() for part in np.indices((steps, balls, run.walls)))
    every = Contacts(k, i, ~j)
    right = every.part(run.depth(every, x) + way[k, i] >= 0)
    assert sorted(zip(*walls, strict=True)) == sorted(zip(*right, strict=True))


@pytest.mark.parametrize(
    ("wall", "more", "height"),
    [
        (3, "", 300.0),
        (4, "[[walls]]\nfrom = [100, 200]\nto = [300, 200]\nthickness = 6", 197.0),
        (4, "[[walls]]\nfrom = [200, 200]\nto = [200, 200]\nthickness = 6", 197.0),
        (4, "[[walls]]\nfrom = [200, 200]\nto = [200, 290]\nthickness = 6", 197.0),
    ],
    ids=["floor", "wall", "peg", "round end"],
)
@pytest.mark.parametrize(("gap", "speed"), [(1.0, 200.0), (2.0, 150.0), (2.0, 1.0), (-0.5, 20.0), (0.2, -10.0)])
def test_when_a_falling_disc_meets_what_is_below(wall: int, more: str, height: float, gap: float, speed: float) -> None:
    """From s = v t + g t²/2; what is in it already is due at once, if it approaches, or when it comes back."""
    g = 900.0
    scene = scene_of(f"radius = 20\nposition = [200, 100]\n{more}", size="[400, 300]", more=f"gravity = [0, {g}]")
    states = States.empty(2, 1)
    states.position[:], states.velocity[:] = (200, height - 20 - gap), (0, speed)
    run = run_of(scene, states)
    run.fly(run.x[:-1] + run.v0 * DT + run.g * DT**2 / 2, run.v0 + run.g * DT, run.g, 1.0, 1.0)
    [time] = due(run, Contacts(*(np.array([part]) for part in (0, 0, ~wall))))
    right = (-speed + math.sqrt(speed**2 + 2 * g * gap)) / g if gap > 0 else 0.0
    assert time == (pytest.approx(right, abs=1e-12) if right <= DT else NEVER)


@pytest.mark.parametrize(("aside", "meets"), [(0.0, True), (30.0, True), (39.99, True), (40.01, False)])
def test_when_two_moving_discs_meet(aside: float, meets: bool) -> None:
    """Of radii 15 and 25, at 300 px/s along x: they touch where their distance along x is sqrt(40² - aside²)."""
    away, closing = np.array([60 + 1j * aside, 60, 60, 30]), np.array([300, -300, 0, -1]) + 0j  # three that part
    [time, *others] = to_touch(away, closing, np.full(4, 40.0))
    assert time == (pytest.approx((60 - math.sqrt(1600 - aside**2)) / 300) if meets else NEVER)
    assert others == [NEVER] * 3
