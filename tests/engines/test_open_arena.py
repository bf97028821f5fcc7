"""`arena.walls = false`: nothing stands round the arena, so balls may be anywhere."""

import math
from typing import Final

import numpy as np
import pytest
from recorded import recorded

from sandbox.analysis.comparison import compare
from sandbox.engines import refusal, registry
from sandbox.scene.model import Scene
from sandbox.state import Contacts, State

OPEN: Final = {"size": (800, 600), "walls": False}
ENGINES: Final = [name for name in ("exact", "impulse", "pymunk", "box2d") if name in registry()]
PX: Final = {"exact": 1e-6, "impulse": 1e-6, "pymunk": 1e-6, "box2d": 0.1}  # box2d computes in float32


def run(name: str, scene: Scene) -> tuple[State, Contacts]:
    engine, contacts = recorded(name, scene, scene.steps)
    return engine.state(), contacts


@pytest.mark.parametrize("name", ENGINES)
def test_two_balls_meet_far_outside_the_arena(name: str) -> None:
    """Equal masses exchange their velocities: at 1 s, 100 px from where each began."""
    balls = [
        {"radius": 10, "position": (4890, 300), "velocity": (100, 0)},
        {"radius": 10, "position": (5110, 300), "velocity": (-100, 0)},
    ]
    state, contacts = run(name, Scene(arena=OPEN, balls=balls, seconds=3))
    if name != "box2d":
        assert [(one["first"], one["second"]) for one in contacts if one["impulse"] > 0] == [(0, 1)]
        assert contacts["time"] == pytest.approx([1.0], abs=1.01 / 60)
    assert state.velocity == pytest.approx(np.array([[-100, 0], [100, 0]]), abs=1e-3)
    assert state.position == pytest.approx(np.array([[4790, 300], [5210, 300]]), abs=1.02 * 100 / 60)  # a step late


@pytest.mark.parametrize("name", ENGINES)
def test_a_ball_falls_freely_for_ten_seconds(name: str) -> None:
    balls = [{"radius": 10, "position": (400, 300), "velocity": (-300, -60)}]
    state, contacts = run(name, Scene(arena=OPEN, balls=balls, gravity=(0, 900), seconds=10))
    late = 900 / 60 * 10 / 2 * {"pymunk": 1, "box2d": 1}.get(name, 0)  # half a step's fall, as they integrate
    assert len(contacts) == 0
    assert state.velocity == pytest.approx(np.array([[-300, 8940]]), rel=1e-5)
    assert state.position == pytest.approx(np.array([[-2600, 300 - 600 + 45_000]]), abs=late + PX[name])


@pytest.mark.parametrize("name", ["exact", "impulse"])
def test_pairs_meet_all_round_the_arena(name: str) -> None:
    """With a grid, whose cells end at the arena's edge: each of 60 pairs exchanges its velocities."""
    angle = 2 * math.pi * np.arange(60) / 60
    out, along = np.stack([np.cos(angle), np.sin(angle)], 1), np.stack([-np.sin(angle), np.cos(angle)], 1)
    middle = (400, 300) + out * np.linspace(420, 9000, 60)[:, None]
    positions = np.concatenate([middle - 15 * along, middle + 15 * along])
    velocities = np.concatenate([25 * along, -25 * along])
    group = {"radius": 5, "positions": positions.tolist(), "velocities": velocities.tolist()}
    state, contacts = run(name, Scene(arena=OPEN, balls=[group], seconds=1))
    assert sorted(zip(contacts["first"].tolist(), contacts["second"].tolist(), strict=True)) == [
        (ball, ball + 60) for ball in range(60)
    ]
    assert state.velocity == pytest.approx(-velocities)


@pytest.mark.parametrize("name", ["exact", "impulse"])
def test_a_wall_that_leaves_the_arena_is_solid_to_its_end(name: str) -> None:
    """Balls beside a slope from inside the arena to far outside of it bounce off it, wherever they are."""
    along, off = np.array([0.8, 0.6]), np.array([0.6, -0.8])
    start = np.array([600.0, 500.0])
    positions = start + np.linspace(10, 3990, 40)[:, None] * along + 20 * off
    wall = {"from": start.tolist(), "to": (start + 4000 * along).tolist(), "thickness": 10}
    group = {"radius": 5, "positions": positions.tolist(), "velocity": (-20 * off).tolist()}
    state, contacts = run(name, Scene(arena=OPEN, balls=[group], walls=[wall], seconds=1))
    assert sorted(contacts["first"]) == [*range(40)]
    assert set(contacts["second"].tolist()) == {-5}, "the scene's walls have the same numbers as beside the arena's"
    assert state.velocity == pytest.approx(np.tile(20 * off, (40, 1)))


def test_the_article_refuses_an_arena_without_walls() -> None:
    assert refusal("article", Scene(arena=OPEN, balls=[{"radius": 20, "position": (100, 100)}])) == (
        "article: arena.walls = false is not part of the article's rule; use --engines impulse"
    )


def test_no_ball_escapes_from_an_arena_without_walls() -> None:
    group = {"count": 120, "radius": 3, "inside": ((0, 0), (800, 600)), "speed": 900}
    comparison = compare(Scene(arena=OPEN, balls=[group], seconds=1), ["pymunk", "exact"])
    for run_ in comparison.runs.values():
        assert (run_.figures.escaped, run_.figures.wall_contacts, run_.escape, run_.theory) == (0, 0, None, ())
        assert (run_.final.position < 0).any(), "balls must have left the view"


def test_surfaces_that_do_not_stand_make_nothing_rough() -> None:
    balls = [{"radius": 10, "position": (100, 100), "friction": 0.5}]
    assert not Scene(arena=OPEN | {"friction": 0.5}, balls=balls).is_rough
    assert Scene(arena=OPEN | {"friction": 0.5, "walls": True}, balls=balls).is_rough
