"""Theory of a gas of discs: their speeds, their pressure, how often they collide. docs/method.md has the formulas.

It holds in equilibrium, for smooth elastic discs between straight walls, without gravity. Symbols: n is the number of
discs, r their radius, A the arena's area, η the packing fraction, E the kinetic energy. The speed law and the virial
theorem are exact at any n. Figures in η are for a fluid without walls, which change them by 3 % at n = 100.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sandbox.quantity import kinetic_energy, length
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import Contacts, Floats

MIN_GAS_DISCS: Final = 100  # with fewer, walls change the figures by more than a few per cent
FREEZING: Final = 0.70  # packing fraction up to which discs are a liquid (Bernard and Krauth, PRL 107 (2011) 155704)
SPEEDS: Final = "distance of speeds from their law"
WALL_PRESSURE: Final = "wall pressure, kg/s²"
CONTACT_RATE: Final = "contacts per second"
THEORY_FIGURES: Final = (SPEEDS, WALL_PRESSURE, CONTACT_RATE)


def speed_law(speed: Floats, whole: Floats | float, n: int) -> Floats:
    """Return the fraction of discs that are slower than a speed, F = 1 - (1 - v²/R²)^(n - 1), R² = Σ v².

    speed, whole: v and R, px/s. All points of the sphere of radius R are equally likely, if masses are equal.
    """
    faster: Floats = np.maximum(0.0, 1 - np.square(speed / whole)) ** (n - 1)
    return 1 - faster


def expected_counts(edges: Floats, whole: float, n: int) -> Floats:
    """Return how many of n discs the law expects between each two speeds (px/s): (bins,); the last has all faster."""
    share = speed_law(edges, whole, n)
    share[-1] = 1.0
    return n * np.diff(share)


def speed_distance(velocity: Floats) -> float:
    """Return the Kolmogorov-Smirnov distance of the speeds from their law. velocity: (times, n, 2) px/s."""
    speed = length(velocity)
    whole = np.sqrt(np.sum(speed**2, axis=-1, keepdims=True))
    law = np.sort(speed_law(speed, whole, velocity.shape[-2]), axis=None)
    share = np.arange(law.size + 1) / law.size
    return float(max(np.max(share[1:] - law), np.max(law - share[:-1])))


def wall_impulse(contacts: Contacts, size: Sequence[float]) -> float:
    """Return the momentum per length that the arena's walls took in contacts, the mean of the four, kg/s."""
    width, height = size
    wall = ~contacts["second"]  # negative for a ball
    at_arena = (wall >= 0) & (wall < len(ARENA_WALLS))
    lengths = np.array([height, width, height, width])
    return float(np.sum(contacts["impulse"][at_arena] / lengths[wall[at_arena]])) / len(ARENA_WALLS)


def virial_pressure(contacts: Contacts, radius: Floats, kinetic: float, size: Sequence[float], seconds: float) -> float:
    """Return the pressure by the virial theorem, (E + Σ impulse · reach / (2 · seconds)) / A, kg/s².

    kinetic: E, kg px²/s², its mean over time. It is exact up to (G at the end - G at the start) / (2A · seconds), where
    G = Σ m v·x (B. Li et al., J. Chem. Phys. 157 (2022) 234111, eq. 19a).
    """
    impulse_reach = np.sum(contacts["impulse"] * _reach(contacts, radius))
    return float((kinetic + impulse_reach / (2 * seconds)) / math.prod(size))


def _reach(contacts: Contacts, radius: Floats) -> Floats:
    """Return the distance between the two centres of each contact, or from the centre to the wall, px."""
    of_second = np.append(radius, 0.0)[np.maximum(contacts["second"], -1)]  # any wall gets the 0
    return np.asarray(radius[contacts["first"]] + of_second - contacts["depth"])


def enskog_rate(n: int, radius: float, size: Sequence[float], mean_square_speed: float) -> float:
    """Return the rate of contacts between n equal discs, 1/s: n 2r (n/A) g √(π kT/m), where 2kT/m is <v²>, px²/s².

    S. Chapman and T. G. Cowling, The Mathematical Theory of Non-Uniform Gases, ch. 16, there in three dimensions. g is
    the density of discs at contact relative to the average (D. Henderson, Mol. Phys. 30 (1975) 971).
    """
    area = math.prod(size)
    eta = n * math.pi * radius**2 / area
    g = (1 - 7 * eta / 16) / (1 - eta) ** 2
    return n * 2 * radius * n / area * g * math.sqrt(math.pi * mean_square_speed / 2)


@dataclass(frozen=True)
class TheoryRow:
    """A figure of a run with its expected value. `because` is the law."""

    figure: str
    measured: float
    expected: float
    because: str


def why_lawless(scene: Scene) -> str:
    """Return why the exact laws do not apply to a scene; nothing if they do."""
    bodies, arena = scene.bodies, scene.arena
    reasons = {
        "a single ball": len(bodies) == 1,
        "no walls stand round the arena": not arena.walls,
        "there are inner walls": bool(scene.walls),
        "gravity pulls the balls": any(scene.gravity),
        "the balls are not alike": np.ptp(bodies.radius) > 0 or np.ptp(bodies.mass) > 0,
        "contacts are not elastic": bool(np.any(bodies.elasticity != 1)) or arena.elasticity != 1,
        "there is friction": bool(bodies.friction.any()),
        "balls pass through each other": bodies.are_filtered,
    }
    return next((why for why, holds in reasons.items() if holds), "")


def why_no_gas(scene: Scene) -> str:
    """Return why the theory of fluids does not apply to a scene; nothing if it does."""
    lawless = why_lawless(scene)
    if lawless or len(scene.bodies) < MIN_GAS_DISCS:
        return lawless or f"fewer than {MIN_GAS_DISCS} balls"
    eta = np.pi * np.sum(scene.bodies.radius**2) / math.prod(scene.arena.size)
    return "" if eta < FREEZING else "so dense that it freezes"


def measure_gas(scene: Scene, contacts: Contacts, velocity: Floats, seconds: float) -> tuple[TheoryRow, ...]:
    """Return a run's figures with those that theory expects; none if no law applies to the scene, or nothing moves.

    contacts: all that the run had in `seconds`; velocity: (times, n, 2) px/s, at some times of it.
    """
    bodies, size = scene.bodies, scene.arena.size
    energies = kinetic_energy(velocity, bodies.mass)
    if why_lawless(scene) or not np.all(energies):
        return ()
    n, radius, kinetic = len(bodies), bodies.radius, float(np.mean(energies))
    virial = virial_pressure(contacts, radius, kinetic, size, seconds)
    rows = (
        TheoryRow(SPEEDS, speed_distance(velocity), 0.0, "equal shares of the energy's sphere"),
        TheoryRow(WALL_PRESSURE, wall_impulse(contacts, size) / seconds, virial, "virial theorem"),
    )
    if why_no_gas(scene):
        return rows
    pairs = int(np.count_nonzero(contacts["second"] >= 0))
    rate = enskog_rate(n, float(radius[0]), size, 2 * kinetic / float(bodies.mass.sum()))
    return *rows, TheoryRow(CONTACT_RATE, pairs / seconds, rate, "Enskog")
