"""What theory says of many discs: their speeds, the pressure, how often they meet.

Beyond the horizon no engine can be right about a path; about these figures it can. They hold in equilibrium, of smooth
elastic discs among straight walls, without gravity. Throughout: n is how many discs, r their radius, σ = 2r, m their
mass, A the arena's area, ρ = n / A, η the packing fraction, E the kinetic energy, kT = E / n.

Two are exact at any n: the speed law, and that wall pressure is virial pressure. Those in η are of a fluid without
walls. Walls keep centres a radius away, and discs beside them meet fewer others, which nearly cancels: at η = 0.2 the
event-driven engine has 0.3 % more contacts than Enskog's rate at n = 10,000, 1 % at 1,000, 3 % at 100. Hence MANY.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sandbox.quantity import kinetic_energy, length
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import Contacts, Floats

MANY: Final = 100  # discs; with fewer the walls are felt by more than the few per cent that theory leaves out
FREEZING: Final = 0.70  # packing fraction up to which discs are a liquid (Bernard and Krauth, PRL 107 (2011) 155704)

# B_k / B_2^(k-1) of hard discs, k from 1 to 10: N. Clisby and B. M. McCoy, J. Stat. Phys. 122 (2006) 15, table 1.
# B_3 and B_4 are known in closed form: 4/3 - √3/π and 2 - 9√3/(2π) + 10/π².
VIRIAL: Final = (
    1.0, 1.0, 0.78200444, 0.53223180, 0.33355604, 0.1988425, 0.1148728, 0.0649930, 0.0362193, 0.0199537,
)  # fmt: skip


# Speeds


def speed_law(speed: Floats, whole: Floats | float, n: int) -> Floats:
    """Return the share of discs that are slower than a speed, F = 1 - (1 - v²/R²)^(n - 1).

    speed: (...) px/s. whole: R in px/s, the speed of one disc that had all of the energy, √(2E/m) = √(Σ v²).

    Energy alone is conserved between four walls, so the 2n components of the velocities are one point of a sphere of
    radius R, any as likely as any other, and two of them have this law. It takes equal masses, not equal radii, and
    n of 2 or more. At large n it is Maxwell's, 1 - exp(-v²/u²) with u² = R²/n the mean square speed. In a periodic box,
    where momentum is conserved too, n - 1 would stand for n, and for R what is left without the centre of mass.
    """
    faster: Floats = np.maximum(0.0, 1 - np.square(speed / whole)) ** (n - 1)
    return 1 - faster


def speed_distance(velocity: Floats) -> float:
    """Return how far speeds are from their law: the largest difference of the two shares (Kolmogorov-Smirnov).

    velocity: (..., n, 2) px/s, n discs at any number of times. R is taken anew each time, so that this tells of the
    law's shape even where an engine does not keep the energy. N independent speeds come to 0.87/√N on average.
    """
    speed = length(velocity)
    whole = np.sqrt(np.sum(speed**2, axis=-1, keepdims=True))
    law = np.sort(speed_law(speed, whole, velocity.shape[-2]), axis=None)
    share = np.arange(law.size + 1) / law.size
    return float(max(np.max(share[1:] - law), np.max(law - share[:-1])))


# Pressure


def wall_pressure(contacts: Contacts, size: Sequence[float], seconds: float) -> float:
    """Return the force per length of the arena's walls, the mean of the four, kg/s².

    size: of the arena, px. The length is the whole wall's, though discs touch only what is a radius from its ends.
    """
    width, height = size
    at_wall = contacts[contacts["second"] < 0]
    impulse = np.bincount(~at_wall["second"], at_wall["impulse"], minlength=len(ARENA_WALLS))[: len(ARENA_WALLS)]
    return float(np.mean(impulse / (height, width, height, width)) / seconds)


def virial_pressure(contacts: Contacts, radius: Floats, kinetic: float, size: Sequence[float], seconds: float) -> float:
    """Return the pressure by the virial theorem, (E + Σ impulse · reach / (2 · seconds)) / A, kg/s².

    radius: (n,) px; kinetic: E, kg px²/s², its mean over time; size: of the arena, px. A contact's reach is the
    distance between its two centres or, at a wall, from the centre to the wall (B. Li et al., J. Chem. Phys. 157
    (2022) 234111, eq. 19a, there with the mean impulse for each).

    It is exact: G = Σ m v·x, with x from the middle of the arena, is bounded, so dG/dt is 0 on average. dG/dt is 2E,
    plus impulse · reach at a pair, less impulse · (half of the arena less the reach) at a wall; and Σ impulse · half of
    the arena is 2A · wall pressure. So both pressures agree in any arena, with any radii and masses, up to
    (G at the end - G at the start) / (2A · seconds). Where the arena is a square of side L and the discs are equal, the
    walls' part can be solved for: the pressure is (E + the pairs' part) / (L (L - 2r)). Over (L - 2r)² it would be
    the force per length of wall that is touched, which is that of a fluid without walls.
    """
    impulse_reach = np.sum(contacts["impulse"] * _reach(contacts, radius))
    return float((kinetic + impulse_reach / (2 * seconds)) / math.prod(size))


def pair_compressibility(contacts: Contacts, radius: Floats, kinetic: float, seconds: float) -> float:
    """Return Z as contacts between discs show it, 1 + Σ impulse · distance / (2E · seconds): no wall enters.

    radius: (n,) px; kinetic: E, kg px²/s², its mean over time.
    """
    pairs = contacts[contacts["second"] >= 0]
    return float(1 + np.sum(pairs["impulse"] * _reach(pairs, radius)) / (2 * kinetic * seconds))


def _reach(contacts: Contacts, radius: Floats) -> Floats:
    """Return how far the two centres of each contact are apart, or the centre from the wall, px."""
    of_second = np.append(radius, 0.0)[np.maximum(contacts["second"], -1)]  # a wall, whatever its number, has the 0
    return np.asarray(radius[contacts["first"]] + of_second - contacts["depth"])


# The fluid


def packing_fraction(radius: Floats, size: Sequence[float]) -> float:
    """Return the share of the arena that discs cover, η. radius: (n,) px; size: of the arena, px."""
    return float(np.pi * np.sum(radius**2) / math.prod(size))


def contact_value(eta: float) -> float:
    """Return g, how much denser discs are at contact than on average (D. Henderson, Mol. Phys. 30 (1975) 971)."""
    return (1 - 7 * eta / 16) / (1 - eta) ** 2


def compressibility(eta: float) -> float:
    """Return Z = pA / (n kT) = 1 + 2ηg."""
    return 1 + 2 * eta * contact_value(eta)


def virial_series(eta: float) -> float:
    """Return Z by the first ten terms in ρ B_2 = 2η: closer than Henderson's up to η = 0.4, 0.6 % short at 0.5."""
    return float(np.polynomial.polynomial.polyval(2 * eta, VIRIAL))


def enskog_rate(n: int, radius: float, size: Sequence[float], mean_square_speed: float) -> float:
    """Return how many contacts n equal discs have with each other, 1/s: n σ ρ g √(π kT/m).

    radius: px; size: of the arena, px; mean_square_speed: px²/s², which is 2kT/m.

    A disc sweeps 2σ · √(π kT/m) of area in a second, √(π kT/m) being the mean relative speed, and meets ρ g to each; a
    contact is two discs' (S. Chapman and T. G. Cowling, The Mathematical Theory of Non-Uniform Gases, ch. 16, there in
    three dimensions). Short of g and of 1/(8n) of the speed it is exact.
    """
    area = math.prod(size)
    g = contact_value(n * math.pi * radius**2 / area)
    return n * 2 * radius * n / area * g * math.sqrt(math.pi * mean_square_speed / 2)


# Measured beside expected


@dataclass(frozen=True)
class Row:
    """A figure of a run beside what it must be. `because` is the law."""

    figure: str
    measured: float
    expected: float
    because: str


def obeys_laws(scene: Scene) -> bool:
    """Tell whether the laws that are exact speak of a scene: equal elastic discs, smooth, only four walls."""
    bodies = scene.bodies
    alike = np.ptp(bodies.radius) == 0 and np.ptp(bodies.mass) == 0
    elastic = bool(np.all(bodies.elasticity == 1)) and scene.arena.elasticity == 1
    alone = not scene.walls and not any(scene.gravity) and not bodies.friction.any()
    return bool(len(bodies) > 1 and alike and elastic and alone)


def is_gas(scene: Scene) -> bool:
    """Tell whether the theory of fluids speaks of a scene too: of many discs, below freezing."""
    fluid = packing_fraction(scene.bodies.radius, scene.arena.size) < FREEZING
    return obeys_laws(scene) and len(scene.bodies) >= MANY and fluid


def beside_theory(scene: Scene, contacts: Contacts, velocity: Floats, seconds: float) -> tuple[Row, ...] | None:
    """Put a run's figures beside theory's, or return None: for a scene that has no law, or where nothing moves.

    contacts: all those of so many seconds; velocity: (times, n, 2) px/s, at some times among them. The run is to be
    in equilibrium, which takes some contacts per disc from a start that is not.
    """
    bodies, size = scene.bodies, scene.arena.size
    energies = kinetic_energy(velocity, bodies.mass)
    if not obeys_laws(scene) or not np.all(energies):
        return None
    n, kinetic = len(bodies), float(np.mean(energies))
    radius, mean_square_speed = float(bodies.radius[0]), 2 * kinetic / float(bodies.mass.sum())
    pairs = int(np.count_nonzero(contacts["second"] >= 0))
    exact = (
        Row("distance of speeds from their law", speed_distance(velocity), 0.0, "equal shares of the energy's sphere"),
        Row(
            "wall pressure, kg/s²",
            wall_pressure(contacts, size, seconds),
            virial_pressure(contacts, bodies.radius, kinetic, size, seconds),
            "virial theorem",
        ),
    )
    if not is_gas(scene):
        return exact
    return (
        *exact,
        Row(
            "compressibility",
            pair_compressibility(contacts, bodies.radius, kinetic, seconds),
            compressibility(packing_fraction(bodies.radius, size)),
            "Henderson 1975",
        ),
        Row("contacts per second", pairs / seconds, enskog_rate(n, radius, size, mean_square_speed), "Enskog"),
    )
