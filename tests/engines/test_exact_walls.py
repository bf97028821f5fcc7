"""Discs that overlap walls, and that several walls hold, in `exact`."""

import math

import numpy as np
import pytest
from conftest import sample, sizes
from recorded import recorded
from walls_at_random import play, scene_at_random

from sandbox.scene.fields import Vector
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.state import Contacts

ARENA = {"size": (400.0, 300.0), "walls": False, "overlap": 1000.0}
CENTRE = np.array([200.0, 150.0])


def wall_towards(angle: float, depth: float, **more: float) -> dict[str, object]:
    """Return a wall across a direction from the centre, in which a ball of radius 40 there is so deep (px)."""
    normal, along = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    middle = CENTRE + (40 - depth) * normal
    return {"start": tuple(middle - 100 * along), "to": tuple(middle + 100 * along), "thickness": 0, **more}


def scene_of_walls(*walls: dict[str, object], gravity: Vector = (0, 0), **ball: object) -> Scene:
    return Scene(
        arena=ARENA, balls=[{"radius": 40, "mass": 3, "position": tuple(CENTRE), **ball}], walls=walls, gravity=gravity
    )


def given(contacts: Contacts) -> np.ndarray:
    """Return what the ball gave to the walls, (2,) kg px/s."""
    return np.asarray((contacts["impulse"][:, None] * contacts["normal"]).sum(axis=0))


def test_a_ball_that_slides_deep_in_a_wall_to_the_end_of_another_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    slides = load("truths/incline-slides")
    ball = slides.balls[2].model_copy(update={"radius": 186.0})
    arena = slides.arena.model_copy(update={"overlap": 1000.0})
    play(slides.changed(balls=[*slides.balls[:2], ball], arena=arena, expect=()), monkeypatch)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("gravity", [(0, 0), (0, 900)])
def test_a_ball_that_three_walls_hold_stops_and_they_take_its_momentum_and_weight(
    e: float, gravity: tuple[float, float]
) -> None:
    walls = [wall_towards(angle, 5, elasticity=e) for angle in (0.3, 0.3 + 2, 0.3 + 4.2)]
    scene = scene_of_walls(*walls, velocity=(60, -20), gravity=gravity)
    engine, contacts = recorded("exact", scene, 30)
    state = engine.state()
    assert state.velocity.tolist() == [[0, 0]]
    assert state.position == pytest.approx(CENTRE[None], abs=1e-6)  # it settles in much less than a hop
    expected = 3 * (np.array([60.0, -20.0]) + 0.5 * np.array(gravity))
    assert given(contacts) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0])
def test_a_ball_squeezed_between_two_parallel_walls_keeps_only_its_motion_along_them(angle: float) -> None:
    along = np.array([-math.sin(angle), math.cos(angle)])
    velocity = 30 * along + 70 * np.array([math.cos(angle), math.sin(angle)])
    scene = scene_of_walls(wall_towards(angle, 2), wall_towards(angle + math.pi, 7), velocity=tuple(velocity))
    engine, contacts = recorded("exact", scene, 60)
    state = engine.state()
    assert state.position[0] == pytest.approx(CENTRE + 30 * along, abs=1e-9)
    assert state.velocity[0] == pytest.approx(30 * along, abs=1e-9)
    assert given(contacts) == pytest.approx(3 * (velocity - 30 * along), abs=1e-9)


def test_a_ball_squeezed_between_upright_walls_falls_freely() -> None:
    scene = scene_of_walls(wall_towards(0, 2), wall_towards(math.pi, 7), velocity=(50, 0), gravity=(0, 100))
    state = recorded("exact", scene, 30)[0].state()
    assert state.position[0] == pytest.approx([200, 150 + 100 * 0.5**2 / 2], abs=1e-9)


def test_a_ball_in_a_wall_bounces_off_its_face_and_not_off_its_far_end() -> None:
    """Moving along the wall, it approaches the end, which is no nearer than the face until it has passed it."""
    wall = {"start": (150.0, 180.0), "to": (230.0, 180.0), "thickness": 0}
    engine, contacts = recorded("exact", scene_of_walls(wall, velocity=(120, 0)), 60)
    assert len(contacts) == 0
    assert engine.state().position[0] == pytest.approx([320, 150], abs=1e-9)


@pytest.mark.parametrize("count", sizes(60, slow=3_000))
@pytest.mark.parametrize("may_overlap", sample([False, True], 2), ids=["free", "inside"])
def test_no_ball_hangs(may_overlap: bool, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(count):
        with monkeypatch.context() as patch:
            play(scene_at_random(seed, may_overlap=may_overlap), patch)
