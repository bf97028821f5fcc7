"""The exact engine over many contacts, compared with statistical mechanics."""

import math

import numpy as np
import pytest
from conftest import do_steps, scene_of, sizes
from exact_scenes import engine_of

from sandbox.analysis.gas import enskog_rate, measure_gas, speed_distance, virial_pressure, wall_impulse
from sandbox.engines.engine import advance
from sandbox.engines.exact.engine import ExactEngine
from sandbox.quantity import deepest_overlap, kinetic_energy, length
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import CONTACT, Contacts, Floats, States


def gas(n: int, eta: float, *, rate: int = 60, rms_speed: float = 1000) -> Scene:
    """Make a square gas of n discs of radius 5 px."""
    side = 5 * math.sqrt(n * math.pi / eta)
    balls = f"count = {n}\nradius = 5\ninside = [[0, 0], [{side}, {side}]]\nrms_speed = {rms_speed}"
    return scene_of(balls, size=f"[{side}, {side}]", more=f"rate = {rate}")


@pytest.mark.wide
def test_four_discs_have_the_pressure_of_the_virial_theorem() -> None:
    """Li 2022, as in HistoricDisks: radius 0.15 L, L = 1, kT = 1; both pressures are about 10.79."""
    scene = scene_of("grid = [2, 2]\nspacing = 0.5\nradius = 0.15\nrms_speed = 1", size="[1, 1]", more="rate = 10")
    initial = spawn(scene)
    initial.velocity[:] *= math.sqrt(8 / np.sum(initial.velocity**2))  # four discs of mass 1 with 2 kT each
    engine = ExactEngine(scene, initial)
    engine.record_contacts()
    contacts: list[Contacts] = []
    velocities: list[Floats] = []
    steps = 0
    while sum(len(some) for some in contacts) < 200_000:
        states = States.empty(1000, 4)
        advance(engine, states)
        velocities.append(states.velocity)
        steps += 1000
        contacts.append(engine.contacts())
    found, kinetic = np.concatenate(contacts), 4.0
    of_walls = wall_impulse(found, scene.arena.size) / (steps / 10)
    virial = virial_pressure(found, scene.bodies.radius, kinetic, scene.arena.size, steps / 10)
    assert of_walls == pytest.approx(virial, rel=0.005)
    assert of_walls == pytest.approx(10.79, rel=0.005)
    assert speed_distance(np.concatenate(velocities)) < 0.005


@pytest.mark.wide
def test_ten_thousand_discs_have_the_contact_rate_of_theory() -> None:
    """At packing fraction 0.2."""
    scene = gas(10_000, 0.2)
    engine = ExactEngine(scene, spawn(scene))
    do_steps(engine, 30)  # about ten contacts per disc, to reach equilibrium
    engine.record_contacts()
    steps = 120
    do_steps(engine, steps)
    found, seconds = engine.contacts(), steps / scene.rate
    velocity = engine.state().velocity
    rate = np.count_nonzero(found["second"] >= 0) / seconds
    expected = enskog_rate(10_000, 5.0, scene.arena.size, float(np.mean(length(velocity) ** 2)))
    assert rate == pytest.approx(expected, rel=0.015)
    assert measure_gas(scene, found, velocity[None], seconds)


@pytest.mark.parametrize("collisions", sizes(1_000_000, slow=10_000_000))
def test_collisions_lose_no_energy_and_leave_no_overlap(collisions: int) -> None:
    scene = gas(1000, 0.5, rate=10)
    engine, bodies = ExactEngine(scene, spawn(scene)), scene.bodies
    before = kinetic_energy(engine.state().velocity, bodies.mass)
    deepest = 0.0
    while engine.collisions < collisions:
        do_steps(engine, 10)
        position = engine.state().position
        deepest = max(deepest, deepest_overlap(position, bodies.radius)[0], -(position - 5).min())
        deepest = max(deepest, (position + 5 - scene.arena.size).max())
    after = kinetic_energy(engine.state().velocity, bodies.mass)
    assert abs(after / before - 1) < 1e-12
    assert deepest < 1e-9


def test_the_order_of_events_does_not_depend_on_the_rate() -> None:
    orders = []
    for rate in (7, 60, 960):
        engine = engine_of(gas(60, 0.5, rate=rate))
        do_steps(engine, rate)
        orders.append(engine.contacts().tobytes())
    assert len(orders[0]) > 2_000 * CONTACT.itemsize
    assert orders[0] == orders[1] == orders[2]


def closed(corners: list[tuple[float, float]]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the sides of a polygon."""
    return list(zip(corners, corners[1:] + corners[:1], strict=True))


@pytest.mark.wide
@pytest.mark.parametrize("least", sizes(20_000, slow=1_000_000))
@pytest.mark.parametrize("shape", ["funnel", "comb", "polygon"])
def test_no_ball_leaks_through_thin_walls_at_10_000_px_a_second(shape: str, least: int) -> None:
    """Ten balls enclosed by thin walls must still be inside after many impacts on these."""
    corners = [(400 + 250 * math.cos(k * math.tau / 9), 300 + 250 * math.sin(k * math.tau / 9)) for k in range(9)]
    funnel = [(250.0, 100.0), (350.0, 400.0), (450.0, 400.0), (550.0, 100.0)]
    comb = [((200.0 + 2 * k, 400.0), (200.0 + 2 * k, 420.0 + k % 7)) for k in range(201)]
    comb += [((200.0, 400.0), (200.0, 100.0)), ((200.0, 100.0), (600.0, 100.0)), ((600.0, 100.0), (600.0, 420.0))]
    walls = {"funnel": closed(funnel), "comb": comb, "polygon": closed(corners)}[shape]
    tables = "\n".join(f"[[walls]]\nfrom = [{a[0]}, {a[1]}]\nto = [{b[0]}, {b[1]}]\nthickness = 1" for a, b in walls)
    scene = scene_of(f"count = 10\nradius = 3\nspeed = 10000\ninside = [[350, 150], [450, 300]]\n{tables}")
    engine = engine_of(scene)
    impacts = 0
    while impacts < least:
        do_steps(engine, 600)
        impacts += int(np.count_nonzero(engine.contacts()["second"] < -4))
        position = engine.state().position
        inside = {"funnel": (250, 100, 550, 400), "comb": (200, 100, 600, 400), "polygon": (150, 50, 650, 550)}[shape]
        assert (position > inside[:2]).all()
        assert (position < inside[2:]).all()
        assert shape != "polygon" or length(position - [400, 300]).max() < 250 - 3
