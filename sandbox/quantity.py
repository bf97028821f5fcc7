"""Energy, momentum, overlap: pure functions of positions and velocities.

Arrays may have axes before the balls' (a whole trajectory at once): position and velocity are (..., n, 2)
in px and px/s, mass and radius (n,) in kg and px.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit

from sandbox.state import Floats


def kinetic_energy(velocity: Floats, mass: Floats) -> Floats:
    """Return the kinetic energy of all balls, kg px²/s²: (...)."""
    return 0.5 * np.einsum("...nk,...nk,n->...", velocity, velocity, mass)


def potential_energy(position: Floats, mass: Floats, gravity: Sequence[float], size: Sequence[float]) -> Floats:
    """Return the energy in the gravity field, kg px²/s²: (...). It is 0 in the corner that things fall to."""
    field = np.asarray(gravity, float)
    lowest = np.where(field > 0, size, 0.0)
    return np.einsum("...nk,k,n->...", lowest - position, field, mass)


def momentum(velocity: Floats, mass: Floats) -> Floats:
    """Return the total momentum, kg px/s: (..., 2)."""
    return np.einsum("...nk,n->...k", velocity, mass)


def speed(velocity: Floats) -> Floats:
    """Return the speed of each ball, px/s: (..., n)."""
    return np.hypot(velocity[..., 0], velocity[..., 1])


@njit(cache=True)
def deepest_overlap(position: Floats, radius: Floats) -> tuple[float, int, int]:
    """Find the pair of balls that overlap most: (px, first, second), (0.0, -1, -1) where none do.

    Sweep and prune along the axis on which the balls are spread further (Cohen et al. 1995).
    """
    axis = 0 if np.ptp(position[:, 0]) >= np.ptp(position[:, 1]) else 1
    order = np.argsort(position[:, axis])
    reach = 2.0 * radius.max()
    deepest, first, second = 0.0, -1, -1
    for k in range(len(order)):
        i = order[k]
        for m in range(k + 1, len(order)):
            j = order[m]
            if position[j, axis] - position[i, axis] >= reach:
                break
            distance = np.hypot(position[j, 0] - position[i, 0], position[j, 1] - position[i, 1])
            overlap = radius[i] + radius[j] - distance
            if overlap > deepest:
                deepest, first, second = overlap, min(i, j), max(i, j)
    return deepest, first, second


def segment_distance(point: Floats, start: Sequence[float], end: Sequence[float]) -> Floats:
    """Return how far each point (..., 2) is from a segment, px: (...)."""
    a, along = np.asarray(start, float), np.subtract(end, start)
    share = np.clip((point - a) @ along / (along @ along), 0.0, 1.0)
    away = point - a - share[..., None] * along
    return np.hypot(away[..., 0], away[..., 1])
