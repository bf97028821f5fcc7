"""How an engine flies is read off flights: each drag by its law, in any order, however gravity is integrated."""

from collections.abc import Callable
from typing import Final

import numpy as np
import pytest
from conftest import scene_of

from sandbox.judge.causes import Cause
from sandbox.judge.flight import Habit
from sandbox.judge.judge import Judge
from sandbox.judge.timeline import Timeline
from sandbox.scene.model import Scene
from sandbox.state import PUSH, Floats, States

STEPS: Final = 40
DT: Final = 1 / 60
G: Final = np.array([0.0, 300.0])
RADIUS, MASS = np.array([10.0, 20.0, 30.0]), np.array([1.0, 3.0, 0.5])
START: Final = np.array([[500.0, 500.0], [1500.0, 500.0], [1000.0, 1200.0]])
VELOCITY: Final = np.array([[220.0, -150.0], [-90.0, -60.0], [70.0, 180.0]])

Change = Callable[[Floats], Floats]  # of velocities (n, 2) in a step


def field(gravity: Floats, mass: Floats = MASS) -> Scene:
    """Three balls far from each other and from all walls, for a second."""
    tables = (
        f"radius = {r}\nmass = {m}\nposition = {x.tolist()}\nvelocity = {v.tolist()}"
        for r, m, x, v in zip(RADIUS, mass, START, VELOCITY, strict=True)
    )
    return scene_of(*tables, size="[2000, 2000]", more=f"gravity = {gravity.tolist()}")


def states_of(change: Change, gravity: Floats, fall: str, *, first: bool = True) -> States:
    """Fly by a change of velocities in each step, before its move or after it.

    fall: whether velocities fall before the move, after it, or half before and half after it.
    """
    states = States.empty(STEPS + 1, 3)
    x, v = START.copy(), VELOCITY.copy()
    before = {"before": 1.0, "after": 0.0, "half": 0.5}[fall]
    states.position[0], states.velocity[0] = x, v
    for step in range(1, STEPS + 1):
        v = v + before * DT * gravity
        v = change(v) if first else v
        x = x + DT * v
        v = v if first else change(v)
        v = v + (1 - before) * DT * gravity
        states.position[step], states.velocity[step] = x, v
    return states


def judged(states: States, gravity: Floats, mass: Floats = MASS) -> Judge:
    judge = Judge(field(gravity, mass))
    judge.add(states, np.empty(0, PUSH), np.full(STEPS, DT))
    judge.finish()
    return judge


def habit_of(states: States, gravity: Floats) -> Habit:
    return judged(states, gravity).habit


def slowed_by(acceleration: Callable[[Floats], Floats]) -> Change:
    """Return the change by a drag. acceleration: px/s² against the velocity, of speeds (n,) px/s."""

    def change(v: Floats) -> Floats:
        speed = np.hypot(*v.T)
        return np.asarray(v * np.maximum(0, 1 - DT * acceleration(speed) / speed)[:, None])

    return change


DRAGS: Final = {
    "Each second of flight takes 0.0005 v² px/s off a ball's speed v.": slowed_by(lambda v: 5e-4 * v**2),
    "Each second of flight takes 20 px/s off a ball's speed.": slowed_by(lambda v: 20 + 0 * v),
    "Each second of flight adds 30 px/s to a ball's speed.": slowed_by(lambda v: -30 + 0 * v),
    "Each second of flight takes 0.4 v / m px/s off a ball's speed v (m its mass).": slowed_by(
        lambda v: 0.4 * v / MASS
    ),
    "Each second of flight takes 0.02 v r px/s off a ball's speed v (r its radius).": slowed_by(
        lambda v: 0.02 * v * RADIUS
    ),
    "Each second of flight takes 0.03 v r / m px/s off a ball's speed v (r its radius, m its mass).": slowed_by(
        lambda v: 0.03 * v * RADIUS / MASS
    ),
    "Each second of flight takes 1e-06 v² r² / m px/s off a ball's speed v (r its radius, m its mass).": slowed_by(
        lambda v: 1e-6 * v**2 * RADIUS**2 / MASS
    ),
    "Every step multiplies velocities by 0.99, without a contact.": lambda v: 0.99 * v,
    "Every step multiplies velocities along x by 0.98, without a contact.": lambda v: v * [0.98, 1],
    "Every step multiplies velocities along y by 1.01, without a contact.": lambda v: v * [1, 1.01],
}
FALLS: Final = {
    "before": "which move balls at the velocity after it: each step ends 0.0417 px beyond the parabola.",
    "after": "which move balls at the velocity before it: each step ends 0.0417 px short of the parabola.",
}


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("because", DRAGS)
def test_a_drag_is_named_with_its_law(because: str, first: bool) -> None:
    habit = habit_of(states_of(DRAGS[because], 0 * G, "half", first=first), 0 * G)
    assert (habit.because, habit.cause, habit.within) == (because, Cause.UNREPORTED, None)


def test_a_law_that_all_balls_share_comes_before_a_simpler_one_that_most_do() -> None:
    """Two of three have a mass of 1, with which a drag over the mass is one without it."""
    mass = np.array([1.0, 1.0, 2.0])
    states = states_of(slowed_by(lambda v: 0.01 * v**2 / mass), 0 * G, "half")
    habit = judged(states, 0 * G, mass).habit
    assert habit.because == "Each second of flight takes 0.01 v² / m px/s off a ball's speed v (m its mass)."


@pytest.mark.parametrize("fall", FALLS)
@pytest.mark.parametrize("because", DRAGS)
def test_a_drag_is_named_beside_the_way_in_which_gravity_is_integrated(because: str, fall: str) -> None:
    habit = habit_of(states_of(DRAGS[because], G, fall), G)
    assert habit.because == because
    assert habit.within is not None
    assert habit.within.cause == Cause.GRAVITY
    assert habit.within.because.endswith(FALLS[fall])


@pytest.mark.parametrize("because", DRAGS)
def test_a_drag_is_named_beside_gravity_that_is_left_out(because: str) -> None:
    habit = habit_of(states_of(DRAGS[because], 0 * G, "half"), G)
    assert habit.because == because
    assert habit.within is not None
    assert habit.within.because == "Balls in flight do not fall: gravity is left out."


def test_a_drag_and_the_fall_have_a_line_each() -> None:
    """Energy: what gravity gives where it should not be missing, and what drag takes, each by a sum over the steps."""
    states = states_of(DRAGS["Every step multiplies velocities by 0.99, without a contact."], 0 * G, "half")
    sums = Timeline(judged(states, G)).sums[0]
    kinetic = (MASS[:, None] * states.velocity**2 / 2).sum(axis=(1, 2))
    fallen = (MASS[:, None] * (states.velocity[:-1] + DT * G) ** 2 / 2).sum(axis=(1, 2)) - kinetic[:-1]
    height = (MASS * ((states.position[1:] - states.position[:-1]) @ G)).sum(axis=1)
    parabola = (MASS * ((states.velocity[:-1] * DT + DT**2 * G / 2) @ G)).sum(axis=1)
    assert fallen.sum() == pytest.approx(parabola.sum())  # the fall that is due keeps the energy
    assert sums[Cause.UNREPORTED] + sums[Cause.GRAVITY] == pytest.approx(np.diff(kinetic).sum() - height.sum())
    dragged = -(MASS[:, None] * states.velocity[:-1] ** 2).sum() / 2 * (1 - 0.99**2)
    moved = (MASS * ((states.velocity[:-1] * DT * 0.01) @ G)).sum()  # less far
    assert sums[Cause.UNREPORTED] == pytest.approx(dragged + moved)


@pytest.mark.parametrize(("grid", "how"), [(np.rint, "rounded"), (np.trunc, "cut")])
@pytest.mark.parametrize("fall", ["before", "after", "half"])
def test_positions_in_whole_pixels(grid: Callable[[Floats], Floats], how: str, fall: str) -> None:
    gravity = 0 * G if fall == "half" else 10 * G  # less would fall alike in whole px
    states = states_of(lambda v: v, gravity, fall)
    for step in range(1, STEPS + 1):
        moved = states.velocity[step - 1] if fall == "after" else states.velocity[step]
        states.position[step] = grid(states.position[step - 1] + DT * moved)
    habit = habit_of(states, gravity)
    assert habit.because == f"Positions are {how} to whole pixels in each step."
    assert (habit.within is None) == (fall == "half")


def test_a_shift_is_told_from_the_way_in_which_gravity_is_integrated() -> None:
    states = states_of(lambda v: v, G, "before")
    states.position[:, :, 0] += 0.01 * np.arange(STEPS + 1)[:, None]
    habit = habit_of(states, G)
    assert habit.because == "Every step puts each ball 0.01 px further than its flight leads, by (0.01, 0)."
    assert habit.within is not None
    assert habit.within.because.endswith(FALLS["before"])


def test_velocities_at_random_are_no_habit() -> None:
    random = np.random.default_rng(1)
    habit = habit_of(states_of(lambda v: v + random.normal(0, 1, v.shape), G, "before"), G)
    assert not habit.is_known
    assert habit.cause is None


def test_balls_that_are_stopped_most_of_the_time_do_not_say_that_there_is_no_gravity() -> None:
    """Those slower than 100 px/s stand still; the one that is faster falls."""

    def stop(v: Floats) -> Floats:
        return np.asarray(np.where(np.hypot(*v.T)[:, None] < 120, 0.0, v))

    habit = habit_of(states_of(stop, G, "before"), G)
    assert habit.because.endswith(FALLS["before"])


CHANGES: Final = {
    "Speeds become 240 px/s, without a contact.": lambda v: v * np.minimum(1, 240 / np.hypot(*v.T))[:, None],
    "Velocities along an axis become 200 px/s, without a contact.": lambda v: np.clip(v, -200, 200),
    "Balls are stopped, without a contact.": lambda v: np.where(np.hypot(*v.T)[:, None] < 140, 0.0, v),
}


@pytest.mark.parametrize("because", CHANGES)
def test_changes_that_end_alike_are_said_once(because: str) -> None:
    """Gravity accelerates the balls again after each."""
    suffered = Timeline(judged(states_of(CHANGES[because], G, "before"), G)).suffered
    [says] = [one.because for one in suffered if one.cause == Cause.UNREPORTED]
    assert says == because


@pytest.mark.parametrize(
    ("after", "because"),
    [
        ((100.0, 0.0), "The speed of ball 0 became 100 px/s, where 200 px/s is due"),
        ((0.0, 0.0), "Ball 0 was stopped, where 200 px/s is due"),
        ((-200.0, 0.0), "The velocity along x of ball 0 became -200 px/s, where 200 px/s is due"),
        ((200.0, 30.0), "The velocity along y of ball 0 became 30 px/s, where 0 px/s is due"),
        ((120.0, 50.0), "The velocity of ball 0 became (120, 50) px/s, where (200, 0) px/s is due"),
    ],
)
def test_a_change_of_one_velocity_is_said_as_what_it_is(after: tuple[float, float], because: str) -> None:
    assert said_of_change((200, 0), after, (0, 0)) == f"{because}, in the step to 0.017 s, without a contact."


def test_a_ball_that_should_fall_faster_is_not_said_to_have_had_the_speed_that_is_due() -> None:
    """Its velocity stays as it is, where gravity should change it."""
    said = said_of_change((0, 30), (0, 30), (0, 900))
    assert said.startswith("The speed of ball 0 became 30 px/s, where 45 px/s is due,")


def said_of_change(before: tuple[float, float], after: tuple[float, float], gravity: tuple[float, float]) -> str:
    """Return what is said of a ball in flight whose velocity becomes another in one step, px/s."""
    scene = scene_of("radius = 20\nposition = [300, 300]", more=f"rate = 60\ngravity = {list(gravity)}")
    states = States.empty(2, 1)
    states.position[0], states.velocity[0] = (300, 300), before
    states.position[1], states.velocity[1] = np.add((300, 300), np.multiply(after, DT)), after
    judge = Judge(scene)
    judge.add(states, np.empty(0, PUSH), np.full(1, DT))
    [error] = Timeline(judge).errors
    return error.because
