"""Pegs, the static circles that balls bounce off: closed forms, in every engine."""

import math

import numpy as np
import pytest
from recorded import recorded

from sandbox import simulate
from sandbox.analysis.comparison import compare
from sandbox.engines.exact import ExactEngine
from sandbox.judge.causes import Cause
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene

RADIUS, PEG = 10.0, 20.0
CENTRE = (400.0, 300.0)


def towards_a_peg(offset: float, *, rate: int = 60, **more: object) -> Scene:
    """Return a ball that flies to the right at a peg, above its centre by an offset (px)."""
    return Scene(
        arena={"size": (800, 600), "walls": False},
        balls=[{"radius": RADIUS, "position": (100, CENTRE[1] - offset), "velocity": (200, 0)}],
        pegs=[{"radius": PEG, "positions": [CENTRE], **more}],
        rate=rate,
        seconds=3,
    )


def deflection(velocity: Vector) -> float:
    """Return the angle by which a velocity differs from one to the right, upwards, degrees."""
    return math.degrees(math.atan2(-velocity[1], velocity[0])) % 360


@pytest.mark.parametrize("offset", [0.0, 5.0, 15.0, 29.0, 29.99])
def test_a_ball_leaves_a_peg_at_the_angle_of_its_impact_parameter(offset: float) -> None:
    """The normal at the impact is at asin(b / (r + R)) to the path, and so is the path after it."""
    run = simulate(towards_a_peg(offset), "exact", seconds=3)
    expected = 180 - 2 * math.degrees(math.asin(offset / (RADIUS + PEG)))
    assert deflection(run.velocity[-1, 0]) == pytest.approx(expected, abs=1e-9)
    assert np.linalg.norm(run.velocity[-1, 0]) == pytest.approx(200, rel=1e-12)


@pytest.mark.parametrize("engine", ["pymunk", "impulse", "box2d"])
def test_stepped_engines_deflect_at_that_angle_as_steps_become_short(engine: str) -> None:
    if engine == "box2d":
        pytest.importorskip("pyb2d3")
    expected = 180 - 2 * math.degrees(math.asin(0.5))
    run = simulate(towards_a_peg(15, rate=6000), engine, seconds=2)
    assert deflection(run.velocity[-1, 0]) == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_only_the_part_along_the_normal_is_reflected_by_the_elasticity(e: float) -> None:
    run = simulate(towards_a_peg(15, elasticity=e), "exact", seconds=3)
    normal, along = np.array([math.cos(math.pi / 6), math.sin(math.pi / 6)]), np.array([-0.5, math.cos(math.pi / 6)])
    assert run.velocity[-1, 0] @ normal == pytest.approx(-e * 200 * math.cos(math.pi / 6), abs=1e-9)
    assert run.velocity[-1, 0] @ along == pytest.approx(-200 * 0.5, rel=1e-12)


def test_friction_on_a_peg_is_that_on_a_wall() -> None:
    """A ball without spin keeps 2/3 of its speed along the surface if friction stops the slip."""
    scene = towards_a_peg(15, friction=10)
    rough = scene.balls[0].model_copy(update={"friction": 1.0})
    run = simulate(scene.changed(balls=[rough]), "exact", seconds=3)
    along = np.array([-0.5, math.cos(math.pi / 6)])
    assert run.velocity[-1, 0] @ along == pytest.approx(-200 * 0.5 * 2 / 3, rel=1e-12)


def test_a_ball_bounces_between_two_pegs_for_ever() -> None:
    pegs = [{"radius": PEG, "positions": [(100, 300), (300, 300)]}]
    ball = {"radius": RADIUS, "position": (200, 300), "velocity": (140, 0)}
    scene = Scene(arena={"size": (800, 600)}, balls=[ball], pegs=pegs)
    _, contacts = recorded("exact", scene, 10 * 60)
    assert contacts["time"] == pytest.approx(np.arange(0.5, 10, 1), rel=1e-12)  # 70 px there, 140 px back and forth
    assert contacts["second"].tolist() == [~5, ~4] * 5


def test_no_ball_of_many_enters_a_peg() -> None:
    at = [(100 + 60 * column + 30 * (row % 2), 200 + 50 * row) for row in range(6) for column in range(10)]
    scene = Scene(
        arena={"size": (740, 600), "elasticity": 0.8},
        balls=[{"radius": 8, "grid": (20, 3), "spacing": 30, "position": (80, 20), "elasticity": 0.8, "friction": 0.3}],
        pegs=[{"radius": 12, "positions": at, "friction": 0.5}],
        gravity=(0, 900),
    )
    run = simulate(scene, "exact", seconds=4)
    distance = np.linalg.norm(run.position[:, :, None] - np.array(at), axis=3)
    assert distance.min() > 20 - 1e-6, f"{20 - distance.min()} px deep"
    assert (run.contacts["second"] < ~3).sum() > 200


def test_the_judge_finds_no_error_in_an_exact_engine_and_finds_a_late_contact_with_a_peg() -> None:
    scene = towards_a_peg(15)
    runs = compare(scene, {"again": ExactEngine, "pymunk": "pymunk", "exact": "exact"}).runs
    assert runs["again"].figures.first_difference is None
    difference = runs["pymunk"].figures.first_difference
    assert difference is not None
    assert (difference.first, difference.second, difference.cause) == (0, ~4, Cause.LATE)
