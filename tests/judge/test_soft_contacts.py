"""Soft contacts: the judge's step is Box2D's, to the precision of float32, and the verdict names what is wrong."""

import math
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from conftest import numbers_in, scene_of

import sandbox
from sandbox.engines import create
from sandbox.judge.causes import Cause
from sandbox.judge.fit import Problem, Trial
from sandbox.judge.free_flight import balls_of
from sandbox.judge.groups import scratch_for
from sandbox.judge.judge import Judge
from sandbox.judge.law import When
from sandbox.judge.one_step import Group
from sandbox.judge.timeline import Timeline
from sandbox.run.trajectory import simulate
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scene.walls import pieces_of
from sandbox.state import PUSH, Floats, State, States

SCENES: Final = Path(sandbox.__file__).parent.parent / "scenes"
FLOOR: Final = 5e-4  # px, of float32 in an arena of 1,000 px
SOFT: Final = {"when": When.SOFT, "substeps": 4, "margin": 2.56}


def problem_of(scene: Scene, before: State, after: State) -> Problem:
    ball = balls_of(scene)
    ball["x"], ball["y"] = before.position.T
    ball["vx"], ball["vy"] = before.velocity.T
    ball["spin"] = before.spin
    end = np.column_stack([after.position, after.velocity, after.spin])
    gravity = float(scene.gravity[0]), float(scene.gravity[1])
    return Problem(Group(ball, pieces_of(scene), 1 / scene.rate), end, gravity, FLOOR, scratch_for(len(ball)))


def wall_bounce(**balls: Any) -> Floats:
    """Return x, y, vx, vy and spin of a ball of 10 px after a soft step; the left wall is at 0, a step is 1/60 s."""
    fields = "\n".join(f"{name} = {value}" for name, value in balls.items())
    scene = scene_of(f"radius = 10\n{fields}")
    start = spawn(scene)
    result: Floats = problem_of(scene, start, start).outcomes([Trial(SOFT)])[0].after[0]
    return result


def test_a_ball_that_meets_a_wall_stays_there_until_the_step_ends() -> None:
    """At 120 px/s it comes 2 px in a step, to the wall 1 px away, and would be back at 11 px."""
    x, y, vx, vy, _ = wall_bounce(position=[11, 100], velocity=[-120, 60])
    assert (x, y, vx, vy) == pytest.approx((10, 101, 120, 60))


def test_friction_is_limited_by_the_impulse_without_restitution() -> None:
    """It slides all the time: Coulomb's limit is 0.1 (1 + 1) 120, of which half is given; the rim gets twice that."""
    scene = scene_of(
        "radius = 10\nposition = [11, 100]\nvelocity = [-120, 600]\nfriction = 0.1", size="[400, 300]\nfriction = 1"
    )
    start = spawn(scene)
    limited, right = (
        problem_of(scene, start, start).outcomes([Trial({**SOFT, "clamped": clamped})])[0].after[0]
        for clamped in (1, 0)
    )
    assert limited[3] == pytest.approx(600 - 12, abs=1)
    assert right[3] == pytest.approx(600 - 24, abs=2)
    assert limited[4] * 10 == pytest.approx(2 * 12, rel=0.1)


@pytest.mark.parametrize("gravity", [0, 900])
@pytest.mark.parametrize("elasticity", [0.0, 0.7, 1.0])
@pytest.mark.parametrize("friction", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("gap", [-2.0, -0.1, 0.3, 2.0])
def test_the_step_is_box2d_s(gap: float, friction: float, elasticity: float, gravity: float) -> None:
    pytest.importorskip("pyb2d3")
    rng = np.random.default_rng(int(1000 + 100 * (gap + friction + elasticity)))
    radius, angle = rng.uniform(10, 30, 2), rng.uniform(0, 2 * math.pi)
    n = np.array([math.cos(angle), math.sin(angle)])
    places = np.array([500.0, 400.0]), np.array([500.0, 400.0]) + n * (radius.sum() + gap)
    velocities = n * rng.uniform(60, 300) + rng.uniform(-100, 100, 2), rng.uniform(-50, 50, 2)
    groups = [
        f"radius = {radius[k]}\nmass = {rng.uniform(1, 4)}\nposition = {places[k].tolist()}\n"
        f"velocity = {velocities[k].tolist()}\nspin = {rng.uniform(-10, 10)}\n"
        f"friction = {math.sqrt(friction)}\nelasticity = {math.sqrt(elasticity)}"
        for k in range(2)
    ]
    scene = scene_of(*groups, size="[1000, 800]", more=f"gravity = [0, {gravity}]")
    engine = create("box2d", scene, spawn(scene))
    before = engine.state()
    engine.step()
    outcome = problem_of(scene, before, engine.state()).outcomes([Trial({**SOFT, "clamped": 1})])[0]
    assert outcome.left < FLOOR / 10


def judged(name: str) -> tuple[Judge, Timeline]:
    """Judge Box2D's run of a scene by its states."""
    pytest.importorskip("pyb2d3")
    scene = load(str(SCENES / f"{name}.toml"))
    run = simulate(scene, "box2d", steps=scene.steps)
    still = np.zeros(run.position.shape[:2])
    judge = Judge(scene)
    states = States(run.position, run.velocity, still, still if run.spin is None else run.spin)
    judge.add(states, np.empty(0, PUSH), 1 / scene.clock.rates(np.arange(1, len(still))))
    return judge, Timeline(judge)


UNKNOWN_AT_MOST: Final = {  # of the error: where few balls meet, nothing is left over
    "head-on": 0.0,
    "oblique": 0.0,
    "article": 0.0,
    "bouncing": 0.0,
    "curling": 0.0,
    "newtons-cradle": 0.0,
    "billiards": 0.03,
    "truths/friction-bounce-slides": 0.0,
    "truths/friction-pair-unequal": 0.0,
    "truths/fall-on-a-round-end": 0.0,
    "truths/thin-wall-60-hz": 0.0,
}


@pytest.mark.wide
@pytest.mark.parametrize("name", UNKNOWN_AT_MOST)
def test_the_verdict_on_box2d_leaves_little_unknown(name: str) -> None:
    suffered = judged(name)[1].suffered
    assert sum(one.share for one in suffered if one.cause == Cause.UNKNOWN) <= UNKNOWN_AT_MOST[name], suffered


def test_box2d_finds_an_oblique_contact_early() -> None:
    """The two are 1.23 px apart before the step in which they would meet after 8.58 ms."""
    timeline = judged("oblique")[1]
    error = timeline.errors[0]
    assert error.cause == Cause.EARLY
    assert numbers_in(timeline.touches.said(error)) == [8.58, 1.23]


def test_box2d_gives_too_little_friction_where_a_bounce_slides() -> None:
    worst = judged("truths/friction-pair-slides")[1].suffered[0]
    assert worst.cause == Cause.FRICTION_SMALL
    assert worst.share > 0.99


def test_box2d_falls_in_four_substeps() -> None:
    """A substep of h = 1/240 s moves at the velocity after it, g h² / 2 too far: four of them 4 · 900 / 240² / 2 px."""
    assert "4 substeps a step" in judged("bouncing")[0].habit.because
    assert f"{4 * 900 / 240**2 / 2:.3g} px beyond the parabola" in judged("bouncing")[0].habit.because
