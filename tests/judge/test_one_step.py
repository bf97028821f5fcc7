"""The step of a few balls is that of the exact engine, and a law that is wrong in one thing does that thing."""

from typing import Final

import numpy as np
import pytest
from conftest import scene_of

from sandbox.engines.exact.engine import ExactEngine
from sandbox.judge.free_flight import balls_of
from sandbox.judge.groups import scratch_for
from sandbox.judge.law import LAW, Exchange, Masses, Place, When, law
from sandbox.judge.one_step import MET, Group, run_laws
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scene.walls import pieces_of
from sandbox.state import Floats, State

TWO: Final = (
    "radius = 10\nmass = 1\nposition = [100, 100]\nvelocity = [120, 0]",
    "radius = 10\nmass = 3\nposition = [121, 100]",
)


def step(scene: Scene, state: State, **fields: float) -> Floats:
    """Return x, y, vx, vy and spin of each ball after a step by a law."""
    ball = balls_of(scene)
    ball["x"], ball["y"] = state.position.T
    ball["vx"], ball["vy"] = state.velocity.T
    ball["spin"] = state.spin
    gravity = (float(scene.gravity[0]), float(scene.gravity[1]))
    laws, n = np.array([law(gravity, **fields)], LAW), len(ball)
    after, met, counts = np.empty((1, n, 5)), np.zeros((1, 4), MET), np.zeros(1, np.int64)
    run_laws(Group(ball, pieces_of(scene), 1 / scene.rate), laws, scratch_for(n), after, met, counts)
    result: Floats = after[0]
    return result


@pytest.mark.parametrize("more", ["", "gravity = [0, 900]", "gravity = [-300, 200]"], ids=["gas", "falling", "aslant"])
def test_it_is_the_exact_engine_s_step(more: str) -> None:
    balls = (
        "count = 5\nradius = 15\nspeed = 200\nfriction = 0.5\nelasticity = 0.8\nspin = {from = -20, to = 20}\n"
        "inside = [[20, 20], [380, 280]]\n[[walls]]\nfrom = [130, 60]\nto = [130, 150]\nthickness = 6\nfriction = 0.9"
    )
    scene = scene_of(balls, size="[400, 300]\nfriction = 0.4", more=f"seed = 1\n{more}")
    engine, contacts = ExactEngine(scene, spawn(scene)), 0
    engine.record_contacts()
    for _ in range(40):
        before = engine.state()
        engine.step()
        state = engine.state()
        contacts += len(engine.contacts())
        right = np.column_stack([state.position, state.velocity, state.spin])
        assert step(scene, before) == pytest.approx(right, abs=1e-8)
    assert contacts > 3


def test_a_ball_that_presses_on_another_is_seen_whatever_else_happens() -> None:
    """One lies on the floor, one leans on it: no sequence of impacts, with a third that hits the floor or without."""
    lying, leaning = "radius = 10\nposition = [100, 290]", "radius = 10\nposition = [91, 273]"
    falling = "radius = 10\nposition = [300, 285]\nvelocity = [0, 600]"
    for balls in ((lying, leaning), (lying, leaning, falling)):
        scene = scene_of(*balls, size="[400, 300]\noverlap = 1\nelasticity = 0.5", more="gravity = [0, 900]")
        assert np.isnan(step(scene, spawn(scene))).all()


def test_a_step_of_many_is_that_of_each_few_alone() -> None:
    """Ten falling pairs, each of which meets and hits a wall, in one box and one by one."""
    rng, pairs = np.random.default_rng(1), []
    for k in range(10):
        x, y = 30 + 40 * k, rng.uniform(100, 102, 2)
        ball = "radius = 10\nelasticity = 0.7\nfriction = 0.5\nposition = [{}, {}]\nvelocity = [{}, {}]"
        pairs.append([ball.format(x, 287, *rng.uniform(-99, 99, 2)), ball.format(x, 266 + y[0] - 100, 0, 300 + y[1])])
    options = {"size": "[430, 300]\nfriction = 0.5", "more": "gravity = [0, 900]"}
    together = scene_of(*(ball for pair in pairs for ball in pair), **options)
    alone = [scene_of(*pair, **options) for pair in pairs]
    parts = np.concatenate([step(scene, spawn(scene)) for scene in alone])
    assert step(together, spawn(together)) == pytest.approx(parts, abs=1e-9)


def velocities(**fields: float) -> Floats:
    """Return the velocities along x after a ball of 1 kg at 120 px/s has met one of 3 kg at rest, head-on."""
    scene = scene_of(*TWO)
    return step(scene, spawn(scene), **fields)[:, 2]


def test_a_law_is_wrong_in_what_it_says() -> None:
    """The right velocities are (1 - 3)/4 and 2/4 of 120 px/s."""
    assert velocities() == pytest.approx([-60, 60])
    assert velocities(impulse=0.5) == pytest.approx([30, 30])
    assert velocities(restitution=0.0) == pytest.approx([30, 30])
    assert velocities(missed=1) == pytest.approx([120, 0])
    assert velocities(exchange=Exchange.WHOLE) == pytest.approx([0, 120])
    assert velocities(second_share=0.0) == pytest.approx([-60, 0])
    assert velocities(masses=Masses.EQUAL) == pytest.approx([0, 120])
    assert velocities(masses=Masses.SWAPPED) == pytest.approx([60, 180])
    assert velocities(second_share=0.5) == pytest.approx([-60, 30])
    assert velocities(kept=0.9) == pytest.approx([-54, 54])


def test_a_rule_of_steps_finds_the_two_where_they_are_after_the_move() -> None:
    """After 2 px of flight they are 1 px deep; each is put back by half of it."""
    scene = scene_of(*TWO)
    left = step(scene, spawn(scene), when=When.AFTER_MOVE)
    apart = step(scene, spawn(scene), when=When.AFTER_MOVE, pair_place=Place.HALVES)
    assert left[:, 0] == pytest.approx([102, 121])
    assert apart[:, 0] == pytest.approx([101.5, 121.5])
    assert left[:, 2] == pytest.approx([-60, 60])
