"""What theory says of many discs: against closed forms, and against runs that can be written down."""

import math

import numpy as np
import pytest
from conftest import scene_of
from hypothesis import given
from hypothesis import strategies as st
from virial import VIRIAL_COEFFICIENTS, virial_series

from sandbox.analysis.gas import (
    enskog_rate,
    expected_counts,
    measure_gas,
    speed_distance,
    speed_law,
    virial_pressure,
    wall_impulse,
    why_no_gas,
)
from sandbox.state import CONTACT, Contacts, Floats, no_contacts

lengths = st.floats(0.1, 1e3)
LEFT, TOP, RIGHT, BOTTOM = ~0, ~1, ~2, ~3


def on_the_sphere(times: int, n: int) -> Floats:
    """Draw velocities of n discs that share an energy, each state of them as likely as any other."""
    velocity = np.random.default_rng(5).normal(size=(times, n, 2))
    velocity /= np.sqrt(np.sum(velocity**2, axis=(1, 2), keepdims=True))
    return velocity


def contacts_of(*rows: tuple[int, int, float]) -> Contacts:
    """Make contacts of (first, second, impulse)."""
    contacts = np.zeros(len(rows), CONTACT)
    contacts["first"], contacts["second"], contacts["impulse"] = zip(*rows, strict=True)
    return contacts


# Speeds


def test_the_squared_speeds_of_two_discs_are_uniform() -> None:
    speed = np.linspace(0, 3, 7)
    assert speed_law(speed, 3.0, 2) == pytest.approx(speed**2 / 9)


@pytest.mark.parametrize("n", [2, 4, 50])
def test_speeds_drawn_from_the_sphere_keep_the_law(n: int) -> None:
    """40,000 speeds: 0.87/√N is 0.0043, and one sample in 10,000 is beyond 2.23/√N."""
    assert speed_distance(on_the_sphere(40_000 // n, n)) < 0.0112


# Pressure


@given(lengths, lengths, st.floats(0.01, 0.49), st.floats(0.1, 100), st.floats(0.1, 100))
def test_a_disc_between_two_walls_presses_as_the_virial_theorem_says(
    width: float, height: float, share: float, speed: float, mass: float
) -> None:
    """It turns every (W - 2r) / v, each time with 2mv: a mean force of mv² / (W - 2r) on two walls of the four."""
    radius = share * min(width, height)
    to_and_fro = 2 * (width - 2 * radius) / speed
    contacts = contacts_of((0, LEFT, 2 * mass * speed), (0, RIGHT, 2 * mass * speed))
    force = mass * speed**2 / (width - 2 * radius)
    wall = wall_impulse(contacts, (width, height)) / to_and_fro
    assert wall == pytest.approx(2 * force / height / 4)
    kinetic = mass * speed**2 / 2
    assert virial_pressure(contacts, np.array([radius]), kinetic, (width, height), to_and_fro) == pytest.approx(wall)


def test_each_wall_s_force_is_over_its_own_length() -> None:
    contacts = contacts_of((0, LEFT, 6.0), (0, TOP, 8.0), (0, RIGHT, 6.0), (0, BOTTOM, 8.0), (0, ~4, 99.0))
    assert wall_impulse(contacts, (4, 3)) / 2.0 == pytest.approx(1)


# The fluid


def test_virial_coefficients_are_those_known_in_closed_form() -> None:
    third = 4 / 3 - math.sqrt(3) / math.pi
    fourth = 2 - 9 * math.sqrt(3) / (2 * math.pi) + 10 / math.pi**2
    assert VIRIAL_COEFFICIENTS[2:4] == pytest.approx((third, fourth), abs=1e-8)
    assert len(VIRIAL_COEFFICIENTS) == 10


@pytest.mark.parametrize("eta", [0.05, 0.1, 0.2])
def test_the_density_at_contact_is_that_of_the_virial_series(eta: float) -> None:
    """Z = 1 + 2ηg, and the rate is n 2r (n/A) g √(π<v²>/2). Henderson's g is the whole series, but for a thousandth."""
    side = math.sqrt(100 * math.pi / eta)
    g = enskog_rate(100, 1.0, (side, side), 2 / math.pi) / (100 * 2 * 100 / side**2)
    assert 1 + 2 * eta * g == pytest.approx(virial_series(eta), rel=1e-3)


# Measured beside expected

GAS = "count = 120\nradius = 5\ngrid = [12, 10]\nspacing = 40\nrms_speed = 100"


def test_a_run_is_compared_with_theory() -> None:
    scene = scene_of(GAS)
    velocity = 1000 * on_the_sphere(300, 120)
    contacts = contacts_of((0, 1, 100.0), (0, LEFT, 300.0), (5, 7, 100.0))
    rows = measure_gas(scene, contacts, velocity, 2.0)
    speeds, pressure, rate = rows
    assert speeds.measured < 2.23 / math.sqrt(300 * 120)
    assert pressure.measured == pytest.approx(300 / 600 / 4 / 2)
    assert pressure.expected == pytest.approx((500_000 + (2 * 100 * 10 + 300 * 5) / 4) / 480_000)
    assert rate.measured == 1
    assert rate.expected == pytest.approx(enskog_rate(120, 5, (800, 600), 1e6 / 120))


@pytest.mark.parametrize(
    ("balls", "more"),
    [
        (GAS + "\nelasticity = 0.9", ""),
        (GAS + "\nfriction = 0.1", ""),
        (GAS, "gravity = [0, 900]"),
        (GAS, "[[walls]]\nfrom = [1, 1]\nto = [1, 9]"),
    ],
    ids=["inelastic", "rough", "falling", "inner wall"],
)
def test_scenes_without_laws_have_no_theory(balls: str, more: str) -> None:
    scene = scene_of(balls, more=more)
    assert why_no_gas(scene)
    assert not measure_gas(scene, no_contacts(), np.ones((1, len(scene.bodies), 2)), 1.0)


@pytest.mark.parametrize("other", ["radius = 6", "radius = 5\nmass = 2"], ids=["larger", "heavier"])
def test_all_balls_must_be_alike(other: str) -> None:
    assert not why_no_gas(scene_of(GAS, "radius = 5\nposition = [20, 20]"))
    assert why_no_gas(scene_of(GAS, f"{other}\nposition = [20, 20]"))


@pytest.mark.parametrize(
    ("balls", "size"),
    [(GAS.replace("120", "99"), "[800, 600]"), (GAS.replace("= 5", "= 20"), "[480, 410]")],
    ids=["few", "above freezing"],
)
def test_discs_that_are_no_fluid_have_the_exact_laws_only(balls: str, size: str) -> None:
    scene = scene_of(balls, size=size)
    assert why_no_gas(scene)
    rows = measure_gas(scene, no_contacts(), np.ones((1, len(scene.bodies), 2)), 1.0)
    assert [row.because for row in rows] == ["equal shares of the energy's sphere", "virial theorem"]


def test_balls_at_rest_have_no_theory() -> None:
    scene = scene_of(GAS)
    assert not why_no_gas(scene)
    assert not measure_gas(scene, no_contacts(), np.zeros((3, 120, 2)), 1.0)


@pytest.mark.parametrize("n", [2, 100, 100_000])
def test_the_law_s_bins_are_maxwell_s_and_count_every_disc(n: int) -> None:
    edges = np.linspace(0, 300, 25)
    counts = expected_counts(edges, 100 * math.sqrt(n), n)
    assert counts.sum() == pytest.approx(n)
    if n == 100_000:
        maxwell = np.exp(-((edges / 100) ** 2))
        assert counts[:-1] == pytest.approx(n * (maxwell[:-2] - maxwell[1:-1]), rel=1e-3)
        assert counts[-1] == pytest.approx(n * maxwell[-2], rel=1e-2)
