"""Until when the reference means anything: chaos, contacts of which no law says which comes first, and heaps."""

import math
import random
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np
import pytest
from conftest import ball_at, do_steps, sample, scene_of

from sandbox.analysis.comparison import compare
from sandbox.analysis.reference import Twins
from sandbox.engines import create
from sandbox.engines.exact import ExactEngine
from sandbox.engines.stand_ins import RenumberedEngine
from sandbox.judge.causes import Cause
from sandbox.report.trajectory import simulate
from sandbox.run.inputs import Grab, Input, Kick, Move, Release
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Floats, States


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


def test_the_horizon_is_never_later_than_that_of_a_shift_of_one_ball() -> None:
    scene = load("gas-100")
    x = spawn(scene).position[0, 0]
    gap = gaps(float(np.nextafter(x, np.inf) - x), 5)
    first = int(np.argmax(gap > scene.bodies.radius[0])) + 1
    comparison = compare(scene, ["exact", "impulse"])
    assert comparison.trust.horizon is not None
    assert first / 60 / 2 < comparison.trust.horizon <= first / 60
    assert comparison.trusted_until == comparison.trust.horizon


@pytest.mark.parametrize("seed", sample([1, 2, 4, 5], 4))
def test_a_shift_that_the_first_contacts_absorb_hides_no_horizon(seed: int) -> None:
    """A shift of ball 0 by one unit in the last place is gone, to the bit, after some contacts of these seeds."""
    assert compare(load("article").changed(seconds=60.0, seed=seed), ["exact"]).trust.horizon is not None


def test_a_first_ball_that_meets_no_other_hides_no_horizon() -> None:
    walled_off = "[[walls]]\nfrom = [0, 50]\nto = [300, 50]\n"
    gas = "count = 4\nradius = 60\ninside = [[0, 55], [300, 355]]\nspeed = 300"
    scene = scene_of("radius = 10\nposition = [100, 20]\nvelocity = [50, 0]", f"{gas}\n{walled_off}", size="[300, 360]")
    assert compare(scene.changed(seconds=20.0), ["exact"]).trust.horizon is not None


def test_beyond_the_horizon_few_balls_have_statistics_too() -> None:
    """Four of 60 px in a small box collide often enough to forget where they were within 20 s."""
    scene = scene_of("count = 4\nradius = 60\ninside = [[0, 0], [300, 300]]\nspeed = 300", size="[300, 300]")
    comparison = compare(scene.changed(seconds=20.0), ["impulse", "exact"])
    assert comparison.trust.horizon is not None
    for run in comparison.runs.values():
        assert [row.because for row in run.theory] == ["equal shares of the energy's sphere", "virial theorem"]
    short = compare(scene.changed(seconds=0.5), ["impulse", "exact"])
    assert short.trust.horizon is None
    assert not any(run.theory for run in short.runs.values())


ONE_HITS_TWO = scene_of(ball_at(100, 300, 200), ball_at(300, 279), ball_at(300, 321), more="seconds = 2")


def test_one_ball_that_hits_two_at_once_is_undecided_from_then_on() -> None:
    """They touch when the centres are 40 px apart, 21 px of that across: after 200 - √(40² - 21²) px at 200 px/s."""
    comparison = compare(ONE_HITS_TWO, ["pymunk", "exact"])
    assert (
        comparison.trust.undecided == math.ceil(60 * (200 - math.sqrt(40**2 - 21**2)) / 200) / 60
    )  # the end of its step
    assert comparison.trust.ball in (0, 1, 2)
    assert comparison.trusted_until == comparison.trust.undecided
    exact, pymunk = comparison.runs["exact"].final.velocity, comparison.runs["pymunk"].final.velocity
    assert abs(exact[1, 0] - exact[2, 0]) > 1  # not symmetric
    assert pymunk[1, 0] == pytest.approx(pymunk[2, 0])
    assert comparison.runs["pymunk"].apart is None
    assert {one.cause for one in comparison.runs["pymunk"].differences} <= {
        Cause.LATE,
        Cause.POSITION_CORRECTION,
        Cause.UNKNOWN,
    }


def test_before_a_tie_an_engine_is_still_judged() -> None:
    """In the article's rule, two other balls lose energy well before the tie."""
    early = (ball_at(100, 100, 200), ball_at(160, 100))
    scene = scene_of(ball_at(100, 300, 200), ball_at(300, 279), ball_at(300, 321), *early, more="seconds = 2")
    comparison = compare(scene, ["article", "exact"])
    first = comparison.runs["article"].figures.first_difference
    assert comparison.trust.undecided is not None
    assert first is not None
    assert (first.first, first.second) == (3, 4)
    assert first.time < comparison.trust.undecided


MIRROR: Final = 400.0  # px, where the mirror of the scenes below stands


def mirrored(seed: int) -> Scene:
    """Return pairs of balls that mirror each other, and one on the mirror; no place is a short binary fraction."""
    rng, balls = random.Random(seed), list[str]()
    places = [(MIRROR, rng.uniform(50, 150), 12.0)]
    balls.append(f"radius = 12\nposition = [{MIRROR}, {places[0][1]!r}]\nvelocity = [0, {rng.uniform(-300, 300)!r}]")
    while len(places) < 4:
        radius = rng.uniform(10, 30)
        x, y = rng.uniform(radius + 1, MIRROR - radius - 1), rng.uniform(radius + 1, 399 - radius)
        if all(math.dist((x, y), place[:2]) > radius + place[2] + 1 for place in places):
            places.append((x, y, radius))
            vx, vy = rng.uniform(-300, 300), rng.uniform(-300, 300)
            group = f"radius = {radius!r}\npositions = [[{x!r}, {y!r}], [{2 * MIRROR - x!r}, {y!r}]]\n"
            balls.append(f"{group}velocities = [[{vx!r}, {vy!r}], [{-vx!r}, {vy!r}]]")
    return scene_of(*balls, size=f"[{2 * MIRROR}, 400]", more="seconds = 3\ngravity = [0, 200]")


@pytest.mark.parametrize(("scenes", "at_least"), [(5, 3), pytest.param(40, 6, marks=pytest.mark.wide)])
def test_an_answer_without_the_scene_s_symmetry_is_never_trusted(scenes: int, at_least: int) -> None:
    """Rounding orders the contacts of a ball on the mirror, so that the numbers of the balls alone decide nothing."""
    unsymmetric = 0
    for scene in map(mirrored, range(scenes)):
        comparison, position = compare(scene, ["exact"]), simulate(scene, "exact").position
        left, right = position[:, 1::2], position[:, 2::2]
        off = np.abs(left - right * (-1, 1) - (2 * MIRROR, 0)).max(axis=(1, 2)) > 1.0
        if off.any():
            unsymmetric += 1
            assert comparison.trusted_until is not None
            assert comparison.trusted_until <= off.argmax() / scene.rate
    assert unsymmetric >= at_least


@pytest.mark.parametrize(
    "balls",
    [
        pytest.param([ball_at(100, 100, -200, -200)], id="corner"),
        pytest.param([ball_at(100, 100, -200, -200, elasticity=0.5)], id="corner that takes energy"),
        pytest.param([ball_at(100, 300, 200), *(ball_at(300 + 40 * k, 300) for k in range(4))], id="touching cradle"),
        pytest.param(
            [ball_at(100, 300, 200), *(ball_at(300 + 40 * k, 300) for k in range(3)), ball_at(580, 300, -200)],
            id="touching cradle, hit from both sides",
        ),
        pytest.param([ball_at(100, 300, 200), ball_at(300, 300), ball_at(500, 300, -200)], id="two hit one, head-on"),
        pytest.param(
            [ball_at(200, 300, 100), ball_at(600, 300, -100), ball_at(400, 100, 0, 100), ball_at(400, 500, 0, -100)],
            id="four meet",
        ),
    ],
)
def test_simultaneous_contacts_whose_order_does_not_matter_are_decided(balls: list[str]) -> None:
    comparison = compare(scene_of(*balls, more="seconds = 2"), ["exact"])
    assert (comparison.trust.undecided, comparison.trust.ball, comparison.trusted_until) == (None, None, None)


def test_a_cradle_of_other_masses_that_is_hit_from_both_sides_is_undecided() -> None:
    row = [ball_at(300 + 40 * k, 300, mass=mass) for k, mass in enumerate((2, 3, 2))]
    comparison = compare(scene_of(ball_at(100, 300, 200), *row, ball_at(580, 300, -200), more="seconds = 2"), ["exact"])
    assert comparison.trust.undecided in (
        48 / 60,
        49 / 60,
    )  # after (300 - 40 - 100) / 200 s, on a step but for rounding


@pytest.mark.parametrize("seed", range(5))
def test_generic_scenes_do_not_depend_on_the_numbers_of_their_balls(seed: int) -> None:
    scene = load("gas-100").changed(seed=seed, seconds=1.0)
    engines = [create("exact", scene, spawn(scene)), RenumberedEngine(partial(create, "exact"), scene, spawn(scene))]
    for _ in range(scene.steps):
        for engine in engines:
            engine.step()
    one, other = (engine.state() for engine in engines)
    assert one.position.tobytes() == other.position.tobytes()
    assert one.velocity.tobytes() == other.velocity.tobytes()


def test_a_renumbered_engine_has_the_scene_s_numbers_outside() -> None:
    scene = scene_of("radius = 20\nposition = [100, 300]\nvelocity = [240, 0]", "radius = 30\nposition = [300, 310]")
    end = 180  # steps, after the first ball has also hit a wall
    engines = [
        create("impulse", scene, spawn(scene)),
        RenumberedEngine(partial(create, "impulse"), scene, spawn(scene)),
    ]
    for engine in engines:
        engine.record_contacts()
        engine.kick(0, (60.0, 0.0))
        do_steps(engine, end)
    one, other = (engine.contacts() for engine in engines)
    assert len(one) > 1
    assert one.tobytes() == other.tobytes()


def test_a_chaotic_difference_by_rounding_is_not_called_undecided() -> None:
    """The order of Pymunk's contacts changes the last bits in a dense gas; chaos makes more of them."""
    comparison = compare(load("gas-100").changed(seconds=4.0), ["exact"])
    assert comparison.trust.horizon is not None
    assert comparison.trust.undecided is None


def test_a_heap_is_unresolved_once_another_hop_puts_a_ball_a_radius_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """So coarse a hop that the heap in the funnel soon differs, whatever the engine makes of heaps."""
    monkeypatch.setattr("sandbox.analysis.reference.HOP_TIME", 0.02)
    scene = load("funnel").changed(seconds=1.4)
    initial = spawn(scene)
    engines = [create("exact", scene, initial), ExactEngine(scene, initial, hop_time=0.01)]
    parted = None
    for step in range(1, scene.steps + 1):
        for engine in engines:
            engine.step()
        offset = engines[0].state().position - engines[1].state().position
        if parted is None and np.linalg.norm(offset, axis=1).max() > scene.bodies.radius[0]:
            parted = step / scene.rate
    comparison = compare(scene, ["exact"])
    assert comparison.trust.unresolved == parted is not None
    assert comparison.trusted_until == parted
    assert comparison.trust.undecided is None  # balls that lean on each other are not hit
    assert compare(scene.changed(seconds=0.3), ["exact"]).trusted_until is None


def test_only_the_exact_engine_under_gravity_has_heaps_to_resolve() -> None:
    falls = scene_of(ball_at(100, 300), ball_at(200, 300), more="gravity = [0, 900]\nseconds = 0.1")
    for engine, gravity, twins in (("exact", 900, 5), ("exact", 0, 4), ("pymunk", 900, 4)):
        lockstep = Lockstep(falls.changed(gravity=(0, gravity)), [engine])
        assert len(Twins(lockstep, engine).runners) == twins


@pytest.mark.parametrize("steps_at_once", [1, 7, 80])
def test_the_mouse_and_kicks_act_on_every_twin_however_far_behind(steps_at_once: int) -> None:
    inputs: list[Input] = [
        Kick(step=5, ball=0, velocity=(50, 0)),
        Kick(step=20, ball=0, velocity=(0, 20)),
        Grab(step=20, ball=1, at=(500, 500)),
        Move(step=30, at=(200, 500)),
        Release(step=60),
    ]
    scene = scene_of(ball_at(100, 300, 200), ball_at(400, 100), more="seconds = 2\ngravity = [0, 100]")
    assert compare(scene, ["exact"], inputs=inputs).trusted_until is None
    lockstep = Lockstep(scene, ["exact"], inputs)
    twins, states, times = Twins(lockstep, "exact"), States.empty(80, 2), lockstep.clock.times(np.arange(1, 81))
    for step in range(80):
        lockstep.step()
        states.fill(step, lockstep.states()["exact"])
    for begin in range(0, 80, steps_at_once):
        rows = slice(begin, begin + steps_at_once)
        twins.follow(states.rows(rows), times[rows])
    assert len(twins.runners) == 5
    for runner in twins.runners:
        assert runner.state().position == pytest.approx(lockstep.states()["exact"].position, abs=1e-9)


@pytest.mark.parametrize("rate", [59, 60])
def test_a_tie_at_the_end_of_a_step_is_found_however_rounding_orders_it(rate: int) -> None:
    """At 0.5 s, both targets are 32 px ahead along (0.8, 0.6) and 24 px off the line of flight: 40 px away."""
    scene = scene_of(
        ball_at(300, 300, vx=120, vy=90), ball_at(400, 345), ball_at(371.2, 383.4), more=f"seconds = 1\nrate = {rate}"
    )
    comparison = compare(scene, ["pymunk", "exact"])
    assert comparison.trust.undecided in (30 / rate, 31 / rate)  # 0.5 s is on a step of 1/60 s but for rounding
    assert {one.cause for one in comparison.runs["pymunk"].differences} <= {
        Cause.LATE,
        Cause.POSITION_CORRECTION,
        Cause.UNKNOWN,
    }


def test_a_wall_and_a_ball_at_the_end_of_a_step_are_no_tie() -> None:
    """Two balls far from each other have contacts at exactly 0.5 s; rounding may put one of them into the next step."""
    scene = scene_of(
        ball_at(70.1, 300, vx=-100.2),
        ball_at(730.3, 100, vx=99.4),
        ball_at(400.7, 300, vx=0.3, vy=7),
        more="seconds = 1",
    )
    assert compare(scene, ["pymunk", "exact"]).trust.undecided is None
