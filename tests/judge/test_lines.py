"""The ledger adds up to the whole change, and several contacts at once are explained by what single ones show."""

from typing import Final

import numpy as np
import pytest
from conftest import ball_at, scene_of
from event_driven import EventDriven
from faults import ImpulseTooSmall, judged
from hypothesis import given, settings
from hypothesis import strategies as st
from verdicts import NO_PUSHES, causes_of, on_states, states_of

from sandbox.judge.causes import Cause
from sandbox.judge.summary import Verdict
from sandbox.judge.thresholds import MAX_TOGETHER
from sandbox.quantity import energy
from sandbox.run.mouse import PUSH, Pushes
from sandbox.scene.model import Scene
from sandbox.state import Floats, States

DT: Final = 1 / 60


def lines(verdict: Verdict) -> dict[Cause, float]:
    return {entry.cause: entry.energy for entry in verdict.ledger}


PLAIN: Final = (0.0, 1.0, 0.0)  # gravity, elasticity and friction of the scenes that every engine can run
KINDS: Final = st.tuples(st.sampled_from([0.0, 900.0]), st.sampled_from([1.0, 0.7]), st.sampled_from([0.0, 0.5]))


def small_gas(seed: int, balls: int, kind: tuple[float, float, float]) -> Scene:
    gravity, elasticity, friction = kind
    ball = f"count = {balls}\ninside = [[30, 30], [270, 120]]\nradius = 14\nspeed = 200\nelasticity = {elasticity}"
    more = "spin = {from = -9, to = 9}\n[[walls]]\nfrom = [150, 150]\nto = [200, 170]\nthickness = 6"
    return scene_of(
        f"{ball}\nfriction = {friction}\n{more if kind != PLAIN else ''}",
        size=f"[300, 300]\nfriction = {friction}",
        more=f"seed = {seed}\ngravity = [0, {gravity}]\nseconds = 0.7",
    )


@pytest.mark.parametrize("engine", ["pymunk", "impulse", "exact", "article"])
@settings(max_examples=6)
@given(seed=st.integers(1, 999), balls=st.integers(1, 9), kind=KINDS)
def test_the_lines_add_up_to_the_change_of_energy(
    engine: str, seed: int, balls: int, kind: tuple[float, float, float]
) -> None:
    """And no energy is unknown but that of errors that are."""
    scene = small_gas(seed, balls, PLAIN if engine == "article" else kind)
    states = states_of(scene, engine)
    verdict = on_states(scene, states)
    total = energy(states, scene.bodies, scene.gravity, scene.arena.size)
    entries, close = lines(verdict), 1e-8 * float(np.abs(total).max())
    spin = entries.pop(Cause.SPIN, 0.0)
    assert sum(entries.values()) == pytest.approx(total[-1] - total[0], abs=close)
    unknown = verdict.errors["energy"][verdict.errors["cause"] == Cause.UNKNOWN].sum()
    assert entries.get(Cause.UNKNOWN, 0.0) == pytest.approx(unknown, abs=close)
    turning = (scene.bodies.moment * states.spin**2).sum(axis=1) / 2
    assert spin == pytest.approx(turning[-1] - turning[0], abs=close)


@pytest.mark.parametrize("elasticity", [1.0, 0.8])
def test_what_elasticity_takes_is_the_closed_form(elasticity: float) -> None:
    """(1 - e²) m u²/2 of two equal balls that meet head-on at u, with the reduced mass m; no other line."""
    ball = f"radius = 20\nelasticity = {elasticity**0.5}"
    scene = scene_of(f"{ball}\nposition = [300, 300]\nvelocity = [240, 0]", f"{ball}\nposition = [400, 300]")
    verdict = on_states(scene, states_of(scene, "exact", seconds=0.5))
    heat = (1 - elasticity**2) * float(scene.bodies.mass[0]) / 2 * 240**2 / 2
    assert lines(verdict).get(Cause.ELASTICITY, 0.0) == pytest.approx(-heat)
    assert len(verdict.errors) == 0


def test_what_friction_takes_and_gives_to_spin_is_the_closed_form() -> None:
    """A disc that grips a wall keeps 2/3 of its speed along it, a third of which turns it: m (v/3)² of the rim."""
    scene = scene_of(ball_at(760, 300, vx=200, vy=90, friction=1), size="[800, 600]\nfriction = 5")
    verdict = on_states(scene, states_of(scene, "exact", seconds=0.3))
    m = float(scene.bodies.mass[0])
    assert lines(verdict)[Cause.FRICTION] == pytest.approx(-m * 90**2 / 6)
    assert lines(verdict)[Cause.SPIN] == pytest.approx(m / 4 * 60**2)
    assert len(verdict.errors) == 0


def test_a_push_is_the_hand_s_and_no_error() -> None:
    scene = scene_of(ball_at(200, 300, vx=60, mass=2))
    pushes: Pushes = np.array([(4, 0, (30.0, -40.0))], PUSH)
    velocity = np.where(np.arange(9)[:, None] < 4, (60.0, 0.0), (90.0, -40.0))
    states = States.empty(9, 1)
    states.velocity[:, 0] = velocity
    states.position[:, 0] = (200, 300) + DT * np.cumsum(np.vstack([[[0, 0]], velocity[1:]]), axis=0)
    verdict = on_states(scene, states, pushes=pushes)
    assert len(verdict.errors) == 0
    assert lines(verdict)[Cause.APPLIED] == pytest.approx(90**2 + 40**2 - 60**2)
    assert causes_of(on_states(scene, states, pushes=NO_PUSHES)) == {Cause.UNREPORTED}


# Several contacts at once


def rows(start: Floats, before: Floats, after: Floats, share: float) -> States:
    """Return a step in which balls move by a share of it at one velocity, and for the rest at another."""
    states = States.empty(2, len(start))
    states.position[:] = start, start + DT * (share * before + (1 - share) * after)
    states.velocity[:] = before, after
    return states


@pytest.mark.parametrize(
    ("places", "before", "after", "share", "causes"),
    [
        ((100, 142, 182, 222), (240, 0, 0, 0), (0, 0, 0, 240), 0.5, set()),
        ((100, 142, 185), (240, 0, -240), (0, -240, 240), 1.0, {Cause.UNKNOWN}),
    ],
    ids=["a blow through a row, in time", "from both sides, at the end of the step"],
)
def test_several_contacts_of_a_step(
    places: tuple[int, ...], before: tuple[int, ...], after: tuple[int, ...], share: float, causes: set[Cause]
) -> None:
    """Equal balls of 20 px swap velocities along x with each that they meet, in turn; 240 px/s are 4 px a step."""
    x, v, u = (np.array([each, np.zeros(len(each))], float).T for each in (places, before, after))
    x[:, 1] = 300
    scene = scene_of(*(f"radius = 20\nposition = {place}" for place in x.tolist()))
    assert causes_of(on_states(scene, rows(x, v, u, share))) == causes


def test_more_contacts_at_once_than_are_judged_are_unknown() -> None:
    """A square of 36 balls that touch has 60 contacts: what a step does to all of them is not looked at."""
    x = np.array([[100.0 + 40 * (k % 6), 100.0 + 40 * (k // 6)] for k in range(36)])
    scene = scene_of(*(f"radius = 20\nposition = {each.tolist()}" for each in x))
    random = np.random.default_rng(1)
    verdict = on_states(scene, rows(x, 3 * (200 - x), random.normal(0, 50, x.shape), 1.0))
    assert MAX_TOGETHER < 60
    assert causes_of(verdict) == {Cause.UNKNOWN}
    assert [each.share for each in verdict.causes] == [1]
    assert len(verdict.errors) == 1


def dense(seed: int) -> Scene:
    balls = "count = 16\nradius = 20\nspeed = 300\ninside = [[20, 20], [240, 240]]"
    return scene_of(balls, size="[260, 260]", more=f"seed = {seed}\nseconds = 0.7")


@pytest.mark.parametrize("seed", [1, 2])
def test_several_contacts_are_explained_by_what_single_ones_show(seed: int) -> None:
    assert len(judged(EventDriven, dense(seed)).errors) == 0
    verdict = judged(ImpulseTooSmall, dense(seed))
    assert causes_of(verdict) == {Cause.SMALL}
    assert verdict.causes[0].parameter == pytest.approx(0.98)
