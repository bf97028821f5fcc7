"""The event-driven engine against closed-form physics, and against a plain event loop of a few balls."""

import math
import signal
from typing import Any

import numpy as np
import pytest
from conftest import do_steps
from event_driven import EventDriven
from exact_scenes import EXACT, after, ball, box_of, contacts_of, engine_of, play, wall
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sandbox.engines.engine import advance
from sandbox.engines.exact.contact import HOP_TIME
from sandbox.engines.exact.engine import ExactEngine
from sandbox.errors import SandboxError
from sandbox.quantity import deepest_overlap, kinetic_energy, momentum, tangent
from sandbox.scene.files import parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scene.walls import segment_distance
from sandbox.state import States

# Two balls


def test_a_contact_has_its_pair_normal_time_impulse_and_depth() -> None:
    (contact,) = contacts_of(box_of(ball([100, 300], [200, 0], mass=2), ball([300, 312], mass=3)), 1.5)
    assert (contact["first"], contact["second"]) == (0, 1)
    assert contact["normal"] == pytest.approx([0.8, 0.6])
    assert contact["time"] == pytest.approx((200 - 16) / 200)
    assert contact["impulse"] == pytest.approx(2 * 160 / (1 / 2 + 1 / 3))
    assert contact["depth"] == pytest.approx(0, abs=1e-12)


# Walls


def test_closed_polygon_keeps_its_balls() -> None:
    corners = [(400 + 180 * math.cos(k * math.tau / 7), 300 + 180 * math.sin(k * math.tau / 7)) for k in range(7)]
    walls = [wall(a, b, 1) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    scene = box_of(*walls, "[[balls]]\ncount = 20\nradius = 5\nspeed = 10000\ninside = [[320, 220], [480, 380]]\n")
    engine = engine_of(scene)
    play(engine, 3000)
    found, position = engine.contacts(), engine.state().position
    assert (found["second"] < 0).sum() > 20_000
    assert set(~found["second"][found["second"] < 0]) == set(range(4, 11))
    assert found["depth"].max() < 1e-9
    for side in scene.walls:
        assert segment_distance(position, side.start, side.to).min() >= 5.5 - EXACT
    assert np.hypot(*(position - [400, 300]).T).max() < 180


# Gravity


def test_bouncing_ends_in_rest_at_the_limit_of_the_series() -> None:
    e, h, g = 0.8, 400.0, 900.0
    scene = box_of(ball([400, 180], [7, 0], radius=20, elasticity=e), head=f"gravity = [0, {g}]")
    total = math.sqrt(2 * h / g) * (1 + e) / (1 - e)
    found = contacts_of(scene, 30)
    resting = np.isclose(found["time"] * 60 % 1, [[0], [1]], atol=1e-6).any(axis=0)  # reported at the end of a step
    assert found["time"][~resting][-1] == pytest.approx(total, abs=1e-5)
    assert found["impulse"][resting].sum() == pytest.approx(g * (30 - total), abs=0.01)  # its weight
    assert (~resting).sum() < 100
    state = after(scene, 30)
    assert state.position[0] == pytest.approx([400 + 7 * 30, 580], abs=EXACT)
    assert state.velocity[0] == pytest.approx([7, 0], abs=EXACT)


@pytest.mark.parametrize("e", [1.0, 0.5, 0.0])
def test_ball_at_rest_stays_at_rest(e: float) -> None:
    scene = box_of(ball([400, 590], elasticity=e), head="gravity = [0, 900]")
    found = contacts_of(scene, 60)
    assert len(found) == 3600  # one a step, with its weight
    assert found["impulse"] == pytest.approx(900 / 60)
    assert (found["normal"] == [0, 1]).all()
    assert after(scene, 60).position[0].tolist() == [400, 590]


def test_ball_slides_down_a_slope_and_comes_to_rest_in_the_corner() -> None:
    """Frictionless, so that it slides at g sin(a); on the level it goes on, until the tilted box's corner holds it."""
    slope = wall([100, 100], [500, 400], 0, elasticity=0)
    nx, ny = 0.6, -0.8  # out of the slope
    start = np.array([180, 160]) + 10 * np.array([nx, ny])
    engine = engine_of(box_of(slope, ball(start), head="gravity = [0, 500]"))
    play(engine, 60)
    slid = 500 * 0.6 / 2
    assert engine.state().position[0] == pytest.approx(start + slid * np.array([0.8, 0.6]), abs=1e-8)

    tilted = box_of(ball([100, 300], [0, 50], elasticity=0.5), head="gravity = [300, 900]")
    state = after(tilted, 60)
    assert (state.position[0].tolist(), state.velocity[0].tolist()) == ([790, 590], [0, 0])


def test_half_the_hop_time_leaves_a_quarter_of_the_height_to_discs_that_lean() -> None:
    """A hop of t seconds is at most g t² / 8 high."""

    def height(hop_time: float) -> float:
        scene = box_of(ball([400, 590]), ball([400, 570], elasticity=0.5), head="gravity = [0, 900]\nrate = 100_000")
        engine = ExactEngine(scene, spawn(scene), hop_time)
        states = States.empty(2000, 2)
        advance(engine, states)
        return 570 - float(states.position[1000:, 1, 1].min())

    assert 0 < height(HOP_TIME) <= 900 * HOP_TIME**2 / 8
    assert height(HOP_TIME / 2) == pytest.approx(height(HOP_TIME) / 4, rel=0.01)


# Rounding, overlaps, inelastic collapse


@pytest.mark.parametrize(
    ("mass", "digits"), [(1, 3), (100, 31), (10_000, 314), (1_000_000, 3141), (100_000_000, 31415)]
)
def test_contacts_of_a_light_ball_between_a_wall_and_a_heavy_one_count_the_digits_of_pi(
    mass: float, digits: int
) -> None:
    """G. Galperin, Regular and Chaotic Dynamics 8 (2003) 375: floor(pi sqrt(M / m)) contacts."""
    scene = box_of(ball([100, 50]), ball([300, 50], [-100, 0], mass=mass), size=(20_000, 100))
    assert len(contacts_of(scene, 10)) == digits


def full_row_under_a_heap(count: int, heap: int, friction: float, seed: int) -> Scene:
    """Make a row of balls that fills the floor from wall to wall to the last bit, and balls that fall on it."""
    kind = f"[[balls]]\nradius = 10\nelasticity = 0.7\nfriction = {friction}\n"
    row = f"{kind}grid = [{count}, 1]\nspacing = 20\nposition = [10, 190]\n"
    falling = f"{kind}count = {heap}\ninside = [[0, 20], [{20 * count}, 150]]\n"
    return box_of(row, falling, head=f"seed = {seed}\ngravity = [0, 900]", size=(20 * count, 200))


@pytest.mark.wide
@pytest.mark.parametrize(
    ("count", "heap", "friction", "seed"),
    [
        pytest.param(2, 4, 0.0, 0, id="balls between walls beside each other", marks=pytest.mark.slow),
        pytest.param(2, 4, 0.0, 2, id="two", marks=pytest.mark.slow),
        pytest.param(5, 7, 0.0, 1, id="five"),
        pytest.param(5, 7, 0.5, 0, id="friction"),
    ],
)
def test_full_row_under_a_heap_comes_to_rest_at_bounded_cost(count: int, heap: int, friction: float, seed: int) -> None:
    """Those on top press the row together, or part it and fall back into no room at all."""
    scene = full_row_under_a_heap(count, heap, friction, seed)
    engine, balls = engine_of(scene), count + heap
    play(engine, 120)
    assert engine.collisions < balls * 2 * 50_000  # 50,000 per ball and second
    state, found = engine.state(), engine.contacts()
    assert not state.velocity.any()
    assert not state.spin.any()
    assert deepest_overlap(state.position, scene.bodies.radius)[0] < 1e-8
    walls = found[found["second"] < 0]
    to_walls = walls["impulse"] @ walls["normal"] + walls["tangential"] @ tangent(walls["normal"])
    assert to_walls == pytest.approx([0, balls * 900 * 2], abs=1e-9 * balls * 900 * 2)


def test_balls_that_overlap_collide_if_they_approach_and_not_if_they_part() -> None:
    overlapping = [ball([300, 300], [v, 0]) + ball([315, 300]) for v in (50, -50)]
    approaching, parting = (contacts_of(box_of(pair), 1) for pair in overlapping)
    assert approaching["time"].tolist() == [0.0]
    assert approaching["depth"] == pytest.approx([5.0])
    assert len(parting) == 0
    assert after(box_of(overlapping[0]), 1).velocity == pytest.approx(np.array([[0, 0], [50, 0]]), abs=EXACT)


def test_centres_that_coincide_part_along_x() -> None:
    (contact,) = contacts_of(box_of(ball([300, 300], [50, 7]), ball([300, 300])), 1)
    assert contact["normal"].tolist() == [1.0, 0.0]
    assert after(box_of(ball([300, 300], [50, 7]), ball([300, 300])), 1).velocity.tolist() == [[0, 7], [50, 0]]


def test_balls_that_stick_go_on_together() -> None:
    """With e = 0 rounding alone decides whether the two still approach."""
    pair = ball([300, 300], [97, 31], mass=18.24, elasticity=0), ball([340, 311], [-13, 7], radius=8.3, elasticity=0)
    for head in ("", "gravity = [0, 100]"):
        assert len(contacts_of(box_of(*pair, head=head), 1)) < 10


# Many balls


def gas(rate: int = 60) -> Scene:
    return parse(
        f"rate = {rate}\n[arena]\nsize = [200, 200]\n"
        f"[[balls]]\ncount = 64\nradius = 8\nspeed = 200\ninside = [[0, 0], [200, 200]]\n",
        "test",
    )


def test_a_step_of_endless_impacts_can_be_interrupted() -> None:
    """A second of 2e9 bounces would take minutes."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    engine = engine_of(box_of(ball([0.5, 0.5], [1e9, 0], radius=0.25), head="rate = 1", size=(1, 1)))
    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    with pytest.raises(KeyboardInterrupt):
        engine.step()
    signal.signal(signal.SIGALRM, before)


def test_contacts_without_end_raise_an_error_instead_of_filling_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """A comparison of two balls of 1e9 kg and 1e-6 kg at 1e9 px/s took 24 GB, and the system ended it."""
    monkeypatch.setattr("sandbox.engines.exact.engine.MAX_LOGGED_CONTACTS", 10_000)
    scene = box_of(ball([50, 50], [1e8, 0]), size=(100, 100))
    engine = ExactEngine(scene, spawn(scene))
    play(engine, 1)  # not recorded yet
    engine.record_contacts()
    with pytest.raises(SandboxError, match=r"^exact ends at 0\.01667 s: the next step exceeds the limit of 10,000"):
        engine.step()
    assert len(engine.contacts()) > 10_000


def test_energy_and_momentum_are_conserved_and_nothing_overlaps() -> None:
    scene = gas()
    engine, mass = engine_of(scene), scene.bodies.mass
    before = engine.state()
    play(engine, 600)
    state, found = engine.state(), engine.contacts()
    assert engine.collisions == (found["second"] >= 0).sum() > 5_000
    assert kinetic_energy(state.velocity, mass) == pytest.approx(kinetic_energy(before.velocity, mass), rel=1e-13)
    given = np.zeros(2)
    for contact in found[found["second"] < 0]:
        given -= contact["impulse"] * contact["normal"]
    assert momentum(state.velocity, mass) - momentum(before.velocity, mass) == pytest.approx(given, abs=1e-7)
    assert found["depth"].max() < 1e-11
    assert np.all((state.position > 8 - EXACT) & (state.position < 192 + EXACT))
    order = list(zip(found["time"], found["first"], found["second"], strict=True))
    assert order == sorted(order)


def test_rate_of_stepping_changes_no_event() -> None:
    logs = []
    for rate in (60, 240, 7, 1):
        engine = engine_of(gas(rate=rate))
        for _ in range(2 * rate):
            engine.step()
            engine.state()
        logs.append(engine.contacts().tobytes())
    assert len(set(logs)) == 1


class ByBruteForce(EventDriven):
    """Every pair and wall is tested for every event."""

    def report(self, *contact: Any) -> None:
        super().report(*contact)
        assume(len(self.found) < 500)  # an unending sequence of impacts has a test of its own


@settings(max_examples=60, derandomize=True)
@given(
    balls=st.lists(
        st.tuples(st.floats(4, 20), st.floats(0.1, 50), st.sampled_from([1.0, 0.9, 0.7]), st.floats(1, 300)),
        min_size=1,
        max_size=6,
    ),
    seed=st.integers(0, 2**32),
)
def test_few_balls_agree_with_the_oracle(balls: list[tuple[float, float, float, float]], seed: int) -> None:
    groups = "".join(
        f"[[balls]]\nradius = {r}\nmass = {m}\nelasticity = {e}\nspeed = {v}\ninside = [[0, 0], [240, 240]]\n"
        for r, m, e, v in balls
    )
    scene = parse(f"seed = {seed}\n[arena]\nsize = [240, 240]\nelasticity = 0.95\n{groups}", "test")
    oracle, engine = ByBruteForce(scene, spawn(scene)), engine_of(scene)
    do_steps(oracle, 30)
    do_steps(engine, 30)
    met, expected, found, state = oracle.contacts(), oracle.state(), engine.contacts(), engine.state()
    assert found[["first", "second"]].tolist() == met[["first", "second"]].tolist()
    assert np.abs(state.position - expected.position).max() < 1e-6
    assert np.abs(state.velocity - expected.velocity).max() < 1e-4
