"""`exact` with friction and spin against closed forms: impacts, and one disc that slips and rolls on walls."""

import math
import random
from collections.abc import Iterable
from typing import Any

import exact_scenes
import numpy as np
import pytest
from exact_scenes import EXACT, accounted, after, engine_of, play
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.engines.exact.contact import CONTACT_TIME
from sandbox.quantity import energy
from sandbox.scene.files import parse
from sandbox.scene.model import Arena, Scene, Wall
from sandbox.scene.spawn import spawn

G = 900.0  # px/s²
FALLING = f"gravity = [0, {G}]"
FLOOR = 600.0  # px


def ball(position: Iterable[float], velocity: Iterable[float] = (0, 0), **more: float) -> str:
    return exact_scenes.ball(position, velocity, **{"friction": 1.0} | more)


def wall(start: Iterable[float], to: Iterable[float], friction: float = 0.0, thickness: float = 0.0) -> str:
    return exact_scenes.wall(start, to, thickness, friction=friction)


def box_of(*parts: str, **more: Any) -> Scene:
    return exact_scenes.box_of(*parts, size=(4000, FLOOR), **more)


# Impacts


def test_disc_without_friction_keeps_its_spin_on_a_rough_floor() -> None:
    scene = box_of(
        ball([100, 590], [90, 0], spin=7.0, friction=0.0), ball([300, 590], spin=-5.0, friction=0.0),
        ball([3000, 590]), head=FALLING, friction=1.0,
    )  # fmt: skip
    state = after(scene, 4)
    assert state.spin.tolist() == [7, -5, 0]
    assert state.angle == pytest.approx([28, -20, 0], abs=EXACT)
    assert state.velocity == pytest.approx(np.array([[0, 0], [90, 0], [0, 0]]), abs=EXACT)


# One disc on a face. Along the face, the rim's speed is v - r w if a positive spin rolls it forward.


def sliding(v: float, rim: float, mu: float, g_t: float, g_n: float, time: float) -> tuple[float, float, float, float]:
    """Return the way, speed, angle and spin (times the radius) of a disc on a face, which may slip and then roll.

    Integrates the equations of motion m a = m g_t - F, m r w'/2 = F in closed form, phase by phase.
    """
    way = turned = 0.0
    while time > 0:
        slip = v - rim
        if abs(slip) < 1e-12 and abs(g_t) <= 3 * mu * g_n:
            pull, phase = g_t / 3, time
        else:
            pull = math.copysign(mu * g_n, slip if abs(slip) > 1e-12 else g_t)
            closing = -slip / (g_t - 3 * pull) if g_t != 3 * pull else -1.0
            phase = min(time, closing) if closing > 0 else time
        a, spun = g_t - pull, 2 * pull
        way, turned = way + phase * (v + a * phase / 2), turned + phase * (rim + spun * phase / 2)
        v, rim, time = v + a * phase, rim + spun * phase, time - phase
    return way, v, turned, rim


@pytest.mark.parametrize("mu", [0.02, 0.1])
@pytest.mark.parametrize("e", [0.0, 0.3, 0.6])
def test_bounces_come_to_rest_while_the_disc_slips(e: float, mu: float) -> None:
    """Friction takes mu (1 + e) v_n at each bounce. The speeds and the flights between are geometric series."""
    scene = box_of(ball([100, 590 - 50], [500, 0], elasticity=e), friction=mu, head=FALLING)
    fall = math.sqrt(100 / G)
    v_n, v, x, time, rim = G * fall, 500.0, 100 + 500 * fall, fall, 0.0
    while v_n > 1e-9:
        v -= mu * (1 + e) * v_n
        rim += 2 * mu * (1 + e) * v_n
        v_n *= e
        x += v * 2 * v_n / G
        time += 2 * v_n / G
    assert v > rim
    way, v, _, rim = sliding(v, rim, mu, 0, G, 4 - time)
    state = after(scene, 4)
    assert state.position[0] == pytest.approx([x + way, 590], abs=EXACT)
    assert state.velocity[0] == pytest.approx([v, 0], abs=EXACT)
    assert state.spin[0] * 10 == pytest.approx(rim, abs=EXACT)


@pytest.mark.parametrize("v", [20.0, 50.0])
@pytest.mark.parametrize("mu", [0.0, 0.3, 1.0])
def test_disc_slides_or_rolls_round_the_end_of_a_wall(v: float, mu: float) -> None:
    """Within the error of the hops in which it goes round. The equations of motion are integrated in steps of 10 µs.

    It rolls first, then slips as the end carries less of it, and leaves where the end carries nothing.
    """
    shelf = wall([100, 300], [500, 300], mu, thickness=4.0)
    scene = box_of(shelf, ball([490, 288], [v, 0], spin=v / 10 if mu else 0.0), head=FALLING)
    angle, speed, rim, radius, dt = 0.0, v, v if mu else 0.0, 12.0, 1e-5
    while (carried := G * math.cos(angle) - speed**2 / radius) > 0:
        friction = min(G * math.sin(angle) / 3, mu * carried)
        middle = angle + dt / 2 * speed / radius
        speed, rim = speed + dt * (G * math.sin(middle) - friction), rim + dt * 2 * friction
        angle = middle + dt / 2 * speed / radius
    state = after(scene, 1)
    assert state.velocity[0, 0] == pytest.approx(speed * math.cos(angle), abs=0.03)
    assert state.spin[0] * 10 == pytest.approx(rim, abs=0.1 if mu else 0)


@pytest.mark.parametrize("at", [0.1, 0.5])
@pytest.mark.parametrize("kick", [250.0, -500.0])
def test_kick_of_a_disc_that_slips_or_rolls(at: float, kick: float) -> None:
    scene = box_of(ball([2000, 590], [300, 0]), friction=0.3, head=FALLING)
    engine = engine_of(scene)
    play(engine, round(60 * at))
    engine.kick(0, (kick, 0.0))
    state = play(engine, round(60 * (1.5 - at)))
    first, v, turned, rim = sliding(300, 0, 0.3, 0, G, at)
    way, v, more, rim = sliding(v + kick, rim, 0.3, 0, G, 1.5 - at)
    assert state.position[0] == pytest.approx([2000 + first + way, 590], abs=EXACT)
    assert state.angle[0] * 10 == pytest.approx(turned + more, abs=EXACT)
    assert [state.velocity[0, 0], state.spin[0] * 10] == pytest.approx([v, rim], abs=EXACT)


def test_kick_into_the_air_keeps_the_spin() -> None:
    scene = box_of(ball([2000, 590], [200, 0], spin=20.0), friction=0.3, head=FALLING)
    engine = engine_of(scene)
    play(engine, 30)
    engine.kick(0, (0.0, -450.0))
    state = play(engine, 30)
    assert state.position[0] == pytest.approx([2200, 590 - 225 + 112.5], abs=EXACT)
    assert [state.spin[0], state.angle[0]] == pytest.approx([20, 20], abs=EXACT)


# Corners


def groove(b: float, mu: float, spin: float, radius: float = 10.0, far: float = 300.0) -> Scene:
    """Return a disc that lies in a V-groove, whose faces are at an angle b to the horizontal, and turns."""
    bottom, along = np.array([2000.0, 500.0]), far * np.array([math.cos(b), -math.sin(b)])
    sides = wall(bottom, bottom + along, mu), wall(bottom, bottom + along * (-1, 1), mu)
    inside = 1e-12  # px, so that rounding leaves no gap through which it would fall
    place = bottom - [0, radius / math.cos(b) - inside]
    return box_of(*sides, ball(place, spin=spin, radius=radius, elasticity=0.0), head=FALLING)


@pytest.mark.parametrize("spin", [-40.0, 40.0])
@pytest.mark.parametrize(("degrees", "mu"), [(30, 0.1), (45, 0.3), (45, 0.99), (60, 1.0), (75, 0.5)])
def test_disc_that_turns_in_a_groove(degrees: float, mu: float, spin: float) -> None:
    """Both faces slip: N_1 + N_2 = m g/((1 + mu²) cos b); the spin falls by 2 mu g/((1 + mu²) r cos b) a second."""
    b, r = math.radians(degrees), 10.0
    scene = groove(b, mu, spin)
    rate = 2 * mu * G / ((1 + mu**2) * r * math.cos(b))
    rest = abs(spin) / rate
    engine, start = engine_of(scene), spawn(scene).position[0]
    for step in range(1, 121):
        engine.step()
        state, time = engine.state(), min(step / 60, rest)
        assert state.spin[0] == pytest.approx(math.copysign(abs(spin) - rate * time, spin), abs=EXACT)
        assert state.angle[0] == pytest.approx(math.copysign(abs(spin) * time - rate * time**2 / 2, spin), abs=EXACT)
        assert state.position[0] == pytest.approx(start, abs=EXACT)
    found = engine.contacts()
    turning = (found["time"] > 1 / 60 + 1e-9) & (found["time"] < rest - 1e-9)
    per_step = found["impulse"][turning].sum() / (turning.sum() / 2)
    if turning.any():
        assert per_step == pytest.approx(G / 60 / ((1 + mu**2) * math.cos(b)), rel=1e-9)
        assert np.abs(found["tangential"])[turning] == pytest.approx(mu * found["impulse"][turning], rel=1e-9)
    at_rest = found[found["time"] > rest + 1 / 60]
    assert at_rest["tangential"].tolist() == [0.0] * len(at_rest)
    assert at_rest["impulse"] == pytest.approx(G / 60 / (2 * math.cos(b)), rel=1e-9)
    accounted(scene, 120)


@pytest.mark.parametrize("spin", [-40.0, 40.0])
@pytest.mark.parametrize(("degrees", "mu"), [(30, 0.6), (45, 1.2)])
def test_disc_that_turns_climbs_out_of_a_groove_if_friction_exceeds_its_slope(
    degrees: float, mu: float, spin: float
) -> None:
    """mu > tan(b): friction on one face pushes it up that face, off the other."""
    b = math.radians(degrees)
    scene = groove(b, mu, spin)
    up = np.array([math.copysign(math.cos(b), spin), -math.sin(b)])
    way, v, turned, rim = sliding(0, 400, mu, -G * math.sin(b), G * math.cos(b), 0.1)
    state = after(scene, 0.1)
    assert way > 0
    assert state.position[0] == pytest.approx(spawn(scene).position[0] + way * up, abs=EXACT)
    assert state.velocity[0] == pytest.approx(v * up, abs=EXACT)
    assert abs(state.spin[0]) * 10 == pytest.approx(rim, abs=EXACT)
    assert abs(state.angle[0]) * 10 == pytest.approx(turned, abs=EXACT)
    _, found = accounted(scene, 600)
    assert after(scene, 10).velocity[0].tolist() == [0, 0]
    assert after(scene, 10).spin[0] == 0
    assert len(found) < 5_000


@pytest.mark.parametrize("mu", [0.2, 1.0])
def test_disc_that_turns_between_floor_and_wall(mu: float) -> None:
    """Friction presses it against the wall, which lifts it: N_floor = m g/(1 + mu²), N_wall = mu N_floor."""
    scene = box_of(ball([3990, 590], spin=50.0, elasticity=0.0), friction=mu, head=FALLING)
    floor, side = G / (1 + mu**2), mu * G / (1 + mu**2)
    rate = 2 * mu * (floor + side) / 10
    engine = engine_of(scene)
    play(engine, 6)
    engine.record_contacts()
    state = play(engine, 6)
    assert state.position[0].tolist() == [3990, 590]
    assert state.spin[0] == pytest.approx(50 - rate * 0.2, abs=EXACT)
    found = engine.contacts()
    for number, n in ((~3, floor), (~2, side)):
        assert found["impulse"][found["second"] == number] == pytest.approx(n / 60, rel=1e-9)
    state = play(engine, 120)
    assert state.spin[0] == 0
    assert state.position[0].tolist() == [3990, 590]


@pytest.mark.wide
@pytest.mark.parametrize("seed", range(40))
def test_disc_in_a_groove_comes_to_rest(seed: int) -> None:
    """Of any slopes, frictions and elasticity, with contacts that end, and energy that never grows."""
    rng = random.Random(seed)
    left, right = math.radians(rng.uniform(15, 80)), math.radians(rng.uniform(15, 80))
    mu, other = (rng.choice([0.0, rng.uniform(0, 1.5), 5.0]) for _ in range(2))
    bottom, radius = np.array([2000.0, 500.0]), rng.uniform(3, 15)
    half = (math.pi - left - right) / 2
    out = np.array([math.cos(right + half), -math.sin(right + half)])
    scene = box_of(
        wall(bottom, bottom + 300 * np.array([math.cos(right), -math.sin(right)]), mu),
        wall(bottom, bottom + 300 * np.array([-math.cos(left), -math.sin(left)]), other),
        ball(
            bottom + rng.choice([1.0, 1.2]) * radius / math.sin(half) * out,
            (rng.uniform(-50, 50), rng.uniform(-50, 50)),
            radius=radius,
            spin=rng.uniform(-30, 30),
            elasticity=rng.choice([0.0, 0.3, 0.7]),
        ),
        head=FALLING,
    )
    states, found = accounted(scene, 900)
    height = energy(states, scene.bodies, scene.gravity, scene.arena.size)
    assert (np.diff(height) < 1e-9 * height[0]).all()
    assert np.abs(states.velocity[-1]).max() < 1e-3
    assert len(found) < 20_000


# Scenes at random


RANDOM = st.tuples(st.floats(4, 20), st.floats(0.1, 50), st.sampled_from([1.0, 0.9, 0.6, 0.2]), st.floats(0, 2))


def random_scene(balls: list[tuple[float, float, float, float]], seed: int, head: str) -> Scene:
    """Return balls with random places, speeds and spins, and two walls, in a small arena."""
    groups = "".join(
        f"[[balls]]\nradius = {r}\nmass = {m}\nelasticity = {e}\nfriction = {mu}\nspeed = 200\n"
        "spin = { from = -40, to = 40 }\ninside = [[0, 0], [240, 240]]\n"
        for r, m, e, mu in balls
    )
    arena = "[arena]\nsize = [240, 240]\nelasticity = 0.95\nfriction = 0.7\n"
    walls = wall([60, 160], [120, 200], 0.5, thickness=3.0) + wall([150, 90], [220, 60], 1.5, thickness=3.0)
    return parse(f"seed = {seed}\n{head}\n{arena}{walls}{groups}", "test")


@settings(max_examples=60, derandomize=True)
@given(balls=st.lists(RANDOM, min_size=1, max_size=6), seed=st.integers(0, 2**32), falls=st.booleans())
def test_contacts_account_for_all_velocities_and_spins(balls: list[Any], seed: int, falls: bool) -> None:
    """And obey Coulomb's law; without gravity, the heat that they state is the energy that is lost."""
    scene = random_scene(balls, seed, FALLING if falls else "")
    bodies = scene.bodies
    walls: list[Arena | Wall] = [*scene.walls[::-1], *[scene.arena] * 4]  # so that ~wall is its index
    states, found = accounted(scene, 30)
    first, second, slip, tangential = (found[key] for key in ("first", "second", "slip", "tangential"))
    friction = np.array([*bodies.friction, *(each.friction for each in walls)])
    largest = friction[first] * friction[second] * found["impulse"]
    assert (np.abs(tangential) <= largest * (1 + 1e-12) + 1e-12).all()
    if not falls:
        per_mass = np.array([*1 / bodies.mass, *[0.0] * len(walls)])
        per_mass = per_mass[first] + per_mass[second]
        apart = np.diff(found["time"], prepend=-np.inf, append=np.inf) > CONTACT_TIME
        alone = apart[1:] & apart[:-1]  # not one of a sequence, which may be stated as one contact
        assert tangential[alone] == pytest.approx(np.clip(slip / (3 * per_mass), -largest, largest)[alone])
        kinetic = energy(states, bodies, scene.gravity, scene.arena.size)
        assert (np.diff(kinetic) <= 1e-12 * kinetic[:-1]).all()
        elasticity = np.array([*bodies.elasticity, *(each.elasticity for each in walls)])
        e = elasticity[first] * elasticity[second]
        closing = found["impulse"] * per_mass / (1 + e)
        lost = (1 - e**2) * closing**2 / per_mass / 2 + tangential * slip - 1.5 * per_mass * tangential**2
        if np.diff(found["time"]).min(initial=1) > CONTACT_TIME:  # not so for sequences stated as one contact
            assert kinetic[0] - kinetic[-1] == pytest.approx(lost.sum(), rel=1e-9, abs=1e-9 * kinetic[0])


@pytest.mark.parametrize("elasticity", [0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("first", [(0.1, 0.0), (0.05, -0.05), (10.0, 9.9), (100.0, 99.9)])
def test_rolling_balls_that_meet_slowly_never_part_faster(first: tuple[float, float], elasticity: float) -> None:
    """Friction presses the two together only until they roll again, which is far shorter than a hop takes."""
    at = 100.0, 120.0 + (first[0] - first[1]) / 2
    balls = (
        ball((x, FLOOR - 10), (v, 0), friction=0.5, elasticity=elasticity, spin=v / 10)
        for x, v in zip(at, first, strict=True)
    )
    scene = box_of(*balls, head=FALLING, friction=0.5)
    engine, apart = engine_of(scene), first[0] - first[1]
    before = engine.state()
    contacts = 0
    for _ in range(60):
        engine.step()
        state = engine.state()
        contacts += int((engine.contacts()["second"] >= 0).sum())
        kinetic = [energy(each, scene.bodies, (0, 0), scene.arena.size) for each in (before, state)]
        assert kinetic[1] <= kinetic[0] * (1 + 1e-12)
        assert state.velocity[1, 0] - state.velocity[0, 0] <= elasticity**2 * apart * (1 + 1e-9)
        before = state
    assert contacts > 0
