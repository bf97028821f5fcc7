"""Walls with a constant velocity: closed forms, and the same run seen from a frame that moves along."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from sandbox.analysis.comparison import compare
from sandbox.engines import create
from sandbox.errors import LimitReached, Refused
from sandbox.judge.causes import Cause
from sandbox.run.trajectory import simulate
from sandbox.scene.files import dump, load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Floats, State

OPEN: Final[dict[str, Any]] = {"size": (800, 600), "walls": False}
FLOOR: Final[dict[str, Any]] = {"from": (-5000, 502), "to": (5000, 502), "friction": 1}
FALLS: Final[dict[str, Any]] = {"gravity": (0, 900), "arena": OPEN}


def states(scene: Scene, seconds: float) -> list[State]:
    """Return the state of `exact` after each step."""
    engine, found = create("exact", scene, spawn(scene)), []
    for _ in range(round(scene.rate * seconds)):
        engine.step()
        found.append(engine.state())
    return found


def end(seconds: float, **tables: Any) -> State:
    """Return the last state of a scene."""
    return states(Scene(**tables), seconds)[-1]


def row(*balls: tuple[float, float], **keys: Any) -> list[dict[str, Any]]:
    return [{"radius": 20, "position": at, **keys} for at in balls]


HEAP: Final = [(200 + 40 * k, 480) for k in range(3)] + [(220 + 40 * k, 480 - 20 * math.sqrt(3)) for k in range(2)]
SLOPES: Final[list[dict[str, Any]]] = [
    {"from": (100, 300), "to": (300, 400), "friction": 0.6},
    {"from": (300, 400), "to": (500, 300), "friction": 0.6},
]
FRAMED: Final[dict[str, dict[str, Any]]] = {
    "bounces": {"balls": row((100, 300), velocity=(30, 0), elasticity=0.8), "walls": [FLOOR]},
    "spins": {"balls": row((100, 300), velocity=(30, 0), elasticity=0.8, friction=0.4, spin=30), "walls": [FLOOR]},
    "stands": {"balls": row(*HEAP, friction=1, elasticity=0.3), "walls": [FLOOR]},
    "corner": {"balls": row((250, 200), friction=0.5, elasticity=0.3, spin=3), "walls": SLOPES},
    "shelf": {"balls": row((200, 480), velocity=(40, 0)), "walls": [{"from": (100, 502), "to": (280, 502)}]},
    "peg": {"balls": row((301, 100), friction=1), "walls": [{"from": (300, 300), "to": (300, 300), "thickness": 60}]},
}


@pytest.mark.parametrize("velocity", [(0, -37), (300, 20.5)], ids=str)
@pytest.mark.parametrize("tables", FRAMED.values(), ids=FRAMED)
def test_a_frame_that_moves_is_as_good(tables: Mapping[str, Any], velocity: tuple[float, float]) -> None:
    still = Scene(**FALLS, **tables)
    balls = [{**ball, "velocity": np.add(ball.get("velocity", (0, 0)), velocity)} for ball in tables["balls"]]
    moving = Scene(**FALLS, balls=balls, walls=[{**wall, "velocity": velocity} for wall in tables["walls"]])
    for expected, actual in zip(states(still, 3), states(moving, 3), strict=True):
        np.testing.assert_allclose(actual.position - np.multiply(velocity, actual.time), expected.position, atol=1e-9)
        np.testing.assert_allclose(actual.velocity - velocity, expected.velocity, atol=1e-8)
        np.testing.assert_allclose(actual.spin, expected.spin, atol=1e-9)


@pytest.mark.parametrize("elasticity", [0, 0.6, 1])
def test_a_wall_hits_a_ball(elasticity: float) -> None:
    ball = {"radius": 10, "position": (400, 300), "velocity": (-50, 7), "elasticity": elasticity}
    state = end(2, arena=OPEN, balls=[ball], walls=[{"from": (200, 200), "to": (200, 400), "velocity": (100, 30)}])
    hit, after = (400 - 10 - 2 - 200) / 150, 100 + elasticity * 150
    np.testing.assert_allclose(state.velocity, [(after, 7)], rtol=1e-14)
    np.testing.assert_allclose(state.position, [(400 - 50 * hit + after * (2 - hit), 314)], rtol=1e-14)


def test_a_wall_comes_from_outside_and_meets_balls_in_every_cell() -> None:
    places = [(20 + 40 * k, 50 + 25 * k) for k in range(19)]
    wall = {"from": (-1000, -100), "to": (-1000, 700), "thickness": 10, "velocity": (600, 0)}
    state = end(3, arena=OPEN, balls=[{"radius": 5, "position": place} for place in places], walls=[wall])
    hit = (np.array(places)[:, 0] + 990) / 600
    np.testing.assert_allclose(state.position[:, 0], -990 + 600 * hit + 1200 * (3 - hit), rtol=1e-13)


def test_a_wall_is_where_it_is_at_the_time_of_the_state() -> None:
    wall = {"from": (100, 200), "to": (100, 400), "velocity": (100, 0)}
    scene = Scene(arena=OPEN, balls=[{"radius": 10, "position": (400, 300)}], walls=[wall])
    engine = create("exact", scene, replace(spawn(scene), time=2.5))  # the wall's face is then at 352 px
    for _ in range(30):
        engine.step()
    hit = (400 - 10 - 352) / 100
    np.testing.assert_allclose(engine.state().position, [(400 + 200 * (0.5 - hit), 300)], rtol=1e-13)


def test_a_belt_makes_a_ball_roll() -> None:
    ball = {"radius": 10, "position": (400, 490), "friction": 0.2}
    state = end(4, **FALLS, balls=[ball], walls=[{**FLOOR, "velocity": (90, 0)}])
    slips_for = 90 / (3 * 0.2 * 900)  # the rim gains on the belt by 3 mu g
    np.testing.assert_allclose(state.velocity, [(30, 0)], atol=1e-12)
    np.testing.assert_allclose(state.position, [(400 + 30 * (4 - slips_for / 2), 490)], rtol=1e-13)
    np.testing.assert_allclose(state.spin, [-6], rtol=1e-13)


@pytest.mark.parametrize(("friction", "rolls"), [(0, True), (0.3, True), (2, False)])
def test_a_ball_is_pushed_along_a_floor(friction: float, rolls: bool) -> None:
    """The ball rolls on the floor and slips on the wall, or the other way round: on which it slips, friction is less.

    The floor bears 900, the wall 300 px/s² and what the other's friction adds.
    """
    ball = {"radius": 10, "position": (400, 490), "friction": 1, "elasticity": 0.5}
    push = {"from": (300, 300), "to": (300, 495), "velocity": (100, 0), "friction": friction}
    state = end(6, gravity=(-300, 900), arena=OPEN, balls=[ball], walls=[{**FLOOR, "friction": 0.5}, push])
    np.testing.assert_allclose(state.position, [(300 + 600 + 12, 490)], atol=1e-5)
    np.testing.assert_allclose(state.velocity, [(100, 0)], atol=0.1)  # a hop
    np.testing.assert_allclose(state.spin, [10 if rolls else 0], atol=0.05)


def test_a_smooth_ball_is_pushed_along_a_floor() -> None:
    ball = {"radius": 10, "position": (400, 490), "elasticity": 0.5}
    push = {"from": (300, 300), "to": (300, 495), "velocity": (100, 0)}
    state = end(4, gravity=(-300, 900), arena=OPEN, balls=[ball], walls=[FLOOR, push])
    np.testing.assert_allclose(state.position, [(300 + 400 + 12, 490)], rtol=1e-13)
    np.testing.assert_allclose(state.velocity, [(100, 0)], atol=1e-10)


def elastic_bounces(gap: float, speed: float, piston: float, until: float) -> tuple[float, float]:
    """Return how far a point is from a still wall, px, at a time (s), and its velocity away from it, px/s.

    It starts there with a speed, and bounces between the wall and a piston, which starts at a gap (px) and comes.
    """
    time = 0.0
    while True:
        there = gap / (speed + piston)
        if time + there >= until:
            return (until - time) * speed, speed
        time, gap, speed = time + there, speed * there, speed + 2 * piston
        if time + gap / speed >= until:
            return gap - (until - time) * speed, -speed
        time, gap = time + gap / speed, gap - piston * gap / speed


def test_a_piston_heats_a_ball() -> None:
    ball = {"radius": 10, "position": (10, 300), "velocity": (80, 0)}
    piston = {"from": (602, 0), "to": (602, 600), "velocity": (-40, 0)}
    for state in states(Scene(arena={"size": (800, 600)}, balls=[ball], walls=[piston]), 13)[::60]:
        x, v = elastic_bounces(580, 80, 40, state.time)
        np.testing.assert_allclose([state.position[0, 0], state.velocity[0, 0]], [10 + x, v], rtol=1e-10)


def test_work_and_momentum_of_walls_add_up() -> None:
    """Elastic balls, a piston and pegs that move: the walls' impulses J give the momentum J and the energy J w."""
    rng = np.random.default_rng(5)
    balls = [
        {"radius": 12, "mass": rng.uniform(1, 3), "position": (150 + 60 * (k % 8), 100 + 60 * (k // 8))}
        | {"velocity": rng.uniform(-90, 90, 2)}
        for k in range(40)
    ]
    pegs = [{"from": (at, 520), "to": (at, 520), "thickness": 30, "velocity": (0, -20)} for at in (200, 400)]
    piston = {"from": (90, 0), "to": (90, 600), "velocity": (25, 0)}
    scene = Scene(arena={"size": (800, 600)}, balls=balls, walls=[piston, *pegs])
    engine, start = create("exact", scene, spawn(scene)), spawn(scene)
    engine.record_contacts()
    for _ in range(600):
        engine.step()
        position = engine.state().position
        assert np.linalg.norm(position[:, None] - position, axis=-1)[np.triu_indices(40, 1)].min() > 24 - 1e-9
        assert position[:, 0].min() > 90 + 2 + 12 + 25 * engine.state().time - 1e-9
    contacts = engine.contacts()
    contacts = contacts[contacts["second"] < 0]
    push = -contacts["impulse"][:, None] * contacts["normal"]
    velocity = np.array([(0, 0)] * 4 + [wall.velocity for wall in scene.walls])[~contacts["second"]]
    mass, before, after = scene.bodies.mass, start.velocity, engine.state().velocity
    np.testing.assert_allclose(mass @ (after - before), push.sum(axis=0), rtol=1e-10)
    energy = mass @ (after**2 - before**2).sum(axis=1) / 2
    assert energy > 0.5 * mass @ (before**2).sum(axis=1) / 2
    np.testing.assert_allclose(energy, (push * velocity).sum(), rtol=1e-10)


@pytest.mark.parametrize("elasticity", [0, 0.5])
@pytest.mark.parametrize("balls", [1, 4])
def test_walls_that_leave_no_room_end_the_run(balls: int, elasticity: float) -> None:
    placed = [{"radius": 10, "position": (780 - 25 * k, 300), "elasticity": elasticity} for k in range(balls)]
    wall = {"from": (400, 0), "to": (400, 600), "velocity": (100, 0)}
    scene = Scene(arena={"size": (800, 600)}, balls=placed, walls=[wall])
    with pytest.raises(LimitReached, match="walls that move close on balls that have no room") as limit:
        states(scene, 6)
    full = (800 - 400 - 2 - 20 * balls) / 100
    assert limit.value.time == pytest.approx(math.floor(60 * full) / 60)


def deepest(state: State, face: float, width: float) -> float:
    """Return the deepest overlap of a ball of radius 10 and a wall whose face is at x = `face`, px, or of balls."""
    x: Floats = state.position
    apart = np.linalg.norm(x[:, None] - x, axis=-1)[np.triu_indices(len(x), 1)].min()
    return max(face + width - float(x[:, 0].min()), 2 * width - float(apart))


@pytest.mark.parametrize("speed", [3, 50])
def test_a_wall_pushes_a_heap_that_stands(speed: float) -> None:
    """No disc of a heap that stands still may be passed by a wall, which is no disc that could wake it."""
    balls = [
        {"radius": 10, "position": (400 + 20.1 * i, 490 - 20 * j), "elasticity": 0.3, "friction": 0.5}
        for i in range(5)
        for j in range(3)
    ]
    start = 388 - speed * 0.25 - 2
    wall = {"from": (start, 300), "to": (start, 498), "velocity": (speed, 0), "friction": 0.3}
    scene = Scene(**FALLS, balls=balls, walls=[{**FLOOR, "friction": 0.5}, wall])
    for state in states(scene, 2):
        assert deepest(state, start + 2 + speed * state.time, 10) < 1e-6
    assert state.position[:, 0].min() < start + 2 + 2 * speed + 10.1  # it is pushed, and has not flown away


@pytest.mark.parametrize("velocity", [(0, 0), (40, -25)], ids=str)
def test_what_stands_on_a_moving_floor_is_frozen(velocity: tuple[float, float]) -> None:
    """Each step then reports one contact of each pair, with the same forces."""
    balls = row(*HEAP, friction=1, velocity=velocity)
    scene = Scene(**FALLS, balls=balls, walls=[{**FLOOR, "velocity": velocity}])
    engine = create("exact", scene, spawn(scene))
    engine.record_contacts()
    for _ in range(60):
        engine.step()
    contacts = engine.contacts()
    assert len(contacts) == 60 * (3 + 2 + 1 + 4)  # with the floor, of the lower row, of the upper, and between them
    weight = contacts["impulse"][contacts["second"] < 0].sum()
    assert weight == pytest.approx(5 * 900, rel=1e-9)


@pytest.mark.parametrize("engine", ["pymunk", "impulse"])
def test_stepped_engines_give_a_ball_what_the_law_says(engine: str) -> None:
    ball = {"radius": 10, "position": (400, 300), "velocity": (-50, 7), "elasticity": 0.6, "friction": 0.5}
    wall = {"from": (200, 200), "to": (200, 400), "velocity": (100, 30), "friction": 0.4}
    tables: dict[str, Any] = {"arena": OPEN, "balls": [ball], "walls": [wall]}
    stepped, exact = (simulate(Scene(**tables), name, seconds=2) for name in (engine, "exact"))
    np.testing.assert_allclose(stepped.velocity[-1], exact.velocity[-1], rtol=1e-12)
    np.testing.assert_allclose(stepped.spin[-1], exact.spin[-1], rtol=1e-12)
    assert np.abs(stepped.position[-1] - exact.position[-1]).max() < (100 + 190) / 60  # a step late


@pytest.mark.parametrize("engine", ["article", "box2d"])
def test_others_refuse_walls_that_move(engine: str) -> None:
    if engine == "box2d":
        pytest.importorskip("pyb2d3")
    scene = Scene(arena=OPEN, balls=row((100, 100)), walls=[{**FLOOR, "velocity": (1, 0)}])
    with pytest.raises(Refused):
        create(engine, scene, spawn(scene))


def test_pymunk_is_late_at_a_piston_and_its_energy_is_that_of_the_piston() -> None:
    """Energy that a wall gives, 4.69 times that of the start here, is no error, and no elasticity."""
    comparison = compare(load("truths/piston"), ["pymunk", "exact"])
    for run in comparison.runs.values():
        given = [entry.energy for entry in run.figures.ledger if entry.cause == Cause.MOVING_WALLS]
        assert given == [pytest.approx(run.energy[-1] - run.energy[0], rel=1e-9)]
    first = comparison.runs["pymunk"].figures.first_difference
    assert first is not None
    assert first.cause == Cause.LATE
    assert comparison.runs["exact"].figures.first_difference is None


def test_a_scene_saved_in_mid_run_goes_on_as_the_run_does(tmp_path: Path) -> None:
    scene = load("truths/piston")
    run = states(scene, 5)
    dump(scene, tmp_path / "later.toml", state=run[119])
    for later, whole in zip(states(load(tmp_path / "later.toml"), 3), run[120:], strict=True):
        np.testing.assert_allclose(later.position, whole.position, rtol=1e-12)
