"""Heaps that come to rest in `exact`: what their floor gets, when they are at rest, and what wakes them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from conftest import do_steps, sample
from exact_scenes import engine_of

from sandbox.engines.engine import advance
from sandbox.engines.exact.engine import ExactEngine
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, Floats, States

G = 900.0  # px/s²
SECONDS = 4
KEPT = 1e-12  # of the weight


def heap(rate: int = 60) -> Scene:
    """Twenty balls of five sizes that fall into a box."""
    groups = "".join(
        f"[[balls]]\ncount = 4\nradius = {r}\nmass = {r * r / 100}\nelasticity = 0.5\ninside = [[0, 0], [120, 300]]\n"
        for r in (8, 9, 10, 11, 12)
    )
    return parse(f"rate = {rate}\ngravity = [0, {G}]\n[arena]\nsize = [120, 300]\nelasticity = 0.5\n{groups}", "test")


def at_rest(scene: Scene) -> ExactEngine:
    engine = engine_of(scene)
    advance(engine, States.empty(SECONDS * scene.rate, len(scene.bodies)))
    engine.contacts()
    return engine


@cache
def rested() -> tuple[Floats, States, Contacts, int]:
    """Run a heap for a second after it has come to rest: places before; states, contacts, collisions in that time."""
    engine = at_rest(heap())
    places, before, states = engine.state().position, engine.collisions, States.empty(60, 20)
    advance(engine, states)
    return places, states, engine.contacts(), engine.collisions - before


def weight() -> Floats:
    return heap().bodies.mass * G


def test_a_heap_comes_to_rest_without_contacts_and_without_creeping() -> None:
    _, states, _, collisions = rested()
    assert collisions == 0
    still = (states.velocity[-1] == 0).all(axis=1)
    assert still.sum() >= 18  # others may slide on the floor, free of the heap
    assert np.array_equal(states.position[0, still], states.position[-1, still])


def test_the_floor_gets_the_weight_of_a_heap_at_rest() -> None:
    _, _, found, _ = rested()
    floor = found[found["second"] == ~3]
    assert floor["impulse"].sum() == pytest.approx(weight().sum(), rel=KEPT)


def test_contacts_of_each_ball_at_rest_carry_it() -> None:
    _, _, found, _ = rested()
    given = np.zeros((20, 2))
    momentum = found["impulse"][:, None] * found["normal"]
    np.subtract.at(given, found["first"], momentum)
    pairs = found["second"] >= 0
    np.add.at(given, found["second"][pairs], momentum[pairs])
    assert pairs.sum() > 60 * 20
    assert given[:, 0] == pytest.approx(0, abs=1e-9)
    assert given[:, 1] == pytest.approx(-weight(), rel=1e-9)
    assert found["impulse"].min() > -1e-9


@pytest.mark.parametrize("rate", sample([240, 7], 2))
def test_when_a_heap_is_at_rest_does_not_depend_on_the_rate(rate: int) -> None:
    assert np.array_equal(at_rest(heap(rate)).state().position, rested()[0])


def test_a_heap_comes_to_rest_the_same_whether_its_contacts_are_read_or_not() -> None:
    scene = heap()
    engine = ExactEngine(scene, spawn(scene))
    do_steps(engine, SECONDS * 60)
    assert np.array_equal(engine.state().position, rested()[0])


def test_an_upright_column_is_not_at_rest() -> None:
    """It is balanced, but not stable."""
    scene = parse(
        f"gravity = [0, {G}]\n[arena]\nsize = [200, 200]\n[[balls]]\nradius = 10\nelasticity = 0.5\ngrid = [1, 3]\n"
        "spacing = 20\nposition = [100, 150]\n",
        "test",
    )
    engine = at_rest(scene)
    before = engine.collisions
    advance(engine, States.empty(60, 3))
    assert engine.collisions - before > 1_000


@pytest.mark.parametrize("speed", sample([20.0, 200.0], 2))
def test_a_heap_that_is_kicked_wakes_and_comes_to_rest_again(speed: float) -> None:
    scene = heap()
    engine, mass = at_rest(scene), scene.bodies.mass
    ball = int(np.argmin(engine.state().position[:, 1]))
    before = engine.state()
    engine.kick(ball, (0.6 * speed, -0.8 * speed))
    states = States.empty(180, 20)
    advance(engine, states)
    found = engine.contacts()
    walls = found[found["second"] < 0]
    given = (walls["impulse"][:, None] * walls["normal"]).sum(axis=0)
    change = mass @ (states.velocity[-1] - before.velocity) + given - [0, 3 * weight().sum()]
    assert change == pytest.approx([0.6 * speed * mass[ball], -0.8 * speed * mass[ball]], abs=1e-6)
    assert not np.array_equal(states.position[5], before.position)
    assert (states.velocity[-1] == 0).all(axis=1).sum() >= 18


def test_balls_that_touch_and_overlap_by_rounding_do_not_stop_the_clock() -> None:
    """Pressed together without speed, they would have contacts at one time without end."""
    scene = load("truths/pyramid-falls")
    start = spawn(scene)
    for units in range(1, 9):
        squeezed = start.position.copy()
        squeezed[:2, 0] += [units * np.spacing(start.position[0, 0]), -units * np.spacing(start.position[1, 0])]
        engine = ExactEngine(scene, replace(start, position=squeezed))
        engine.record_contacts()
        engine.step()
        assert len(engine.contacts()) < 10_000
