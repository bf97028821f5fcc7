"""Energy, momentum, overlap, distances: pure functions of positions and velocities.

position and velocity are (..., n, 2) in px and px/s, where the leading axes may be the steps of a trajectory; mass and
radius are (n,) in kg and px; gravity is in px/s², and size is the arena's width and height, px.
"""

from collections.abc import Sequence

import numpy as np

from sandbox.compiled import kernel, portable_entry
from sandbox.state import Floats


def kinetic_energy(velocity: Floats, mass: Floats) -> Floats:
    """Return the kinetic energy of all balls, kg px²/s²: (...)."""
    return 0.5 * np.einsum("...nk,...nk,n->...", velocity, velocity, mass)


def potential_energy(position: Floats, mass: Floats, gravity: Sequence[float], size: Sequence[float]) -> Floats:
    """Return the energy in the gravity field, kg px²/s²: (...). It is 0 in the corner that gravity points to."""
    field = np.asarray(gravity, float)
    lowest = np.where(field > 0, size, 0.0)
    return np.einsum("...nk,k,n->...", lowest - position, field, mass)


def energy(position: Floats, velocity: Floats, mass: Floats, gravity: Sequence[float], size: Sequence[float]) -> Floats:
    """Return kinetic and potential energy of all balls, kg px²/s²: (...)."""
    return kinetic_energy(velocity, mass) + potential_energy(position, mass, gravity, size)


def momentum(velocity: Floats, mass: Floats) -> Floats:
    """Return the total momentum, kg px/s: (..., 2)."""
    return np.einsum("...nk,n->...k", velocity, mass)


def length(vector: Floats) -> Floats:
    """Return the length of each vector: (..., 2) -> (...). The length of a velocity is its speed."""
    return np.hypot(vector[..., 0], vector[..., 1])


def outside(position: Floats, size: Sequence[float]) -> Floats:
    """Return how far each ball's centre is outside an arena, px, negative if it is inside: (..., n)."""
    return np.maximum(-position, position - size).max(axis=-1)


def deepest_overlap(position: Floats, radius: Floats) -> tuple[float, int, int]:
    """Return the deepest overlap of two balls (px) and the two balls, or (0.0, -1, -1) if none overlap.

    Sweep and prune along the axis of the larger spread (Cohen et al. 1995).
    """
    axis = int(np.ptp(position, axis=0).argmax())
    order = np.argsort(position[:, axis])
    overlap, first, second = _sweep(position[order], radius[order], float(radius.min()), axis)
    if overlap == 0:
        return 0.0, -1, -1
    first, second = sorted((int(order[first]), int(order[second])))
    return overlap, first, second


@portable_entry
def _sweep(position: Floats, radius: Floats, smallest: float, axis: int) -> tuple[float, int, int]:
    """Compare each ball with the balls no larger than it, while these are near enough for a new deepest overlap.

    So not every pair is tested, even if one ball is larger than all others or thousands lie in a heap.
    """
    deepest, first, second = 0.0, -1, -1
    for i in range(len(position)):
        for direction in (1, -1):
            if direction < 0 and radius[i] == smallest:
                break
            j = i + direction
            while 0 <= j < len(position):
                if abs(position[j, axis] - position[i, axis]) >= 2 * radius[i] - deepest:
                    break
                if radius[j] < radius[i] or (radius[j] == radius[i] and direction > 0):
                    distance = np.hypot(position[j, 0] - position[i, 0], position[j, 1] - position[i, 1])
                    overlap = radius[i] + radius[j] - distance
                    if overlap > deepest:
                        deepest, first, second = overlap, i, j
                j += direction
    return deepest, first, second


def dot(a: Floats, b: Floats) -> Floats:
    """Return the scalar product of vectors: (..., 2) and (..., 2) -> (...)."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def nearest_on_segment(point: Floats, start: Floats, end: Floats) -> Floats:
    """Return the point of a segment nearest to each point: (..., 2) px each."""
    along = end - start
    fraction = np.clip(dot(along, point - start) / dot(along, along), 0.0, 1.0)
    return start + along * fraction[..., None]


def segment_distance(point: Floats, start: Sequence[float], end: Sequence[float]) -> Floats:
    """Return the distance of each point (..., 2) px from a segment: (...) px."""
    return length(nearest_on_segment(point, np.asarray(start, float), np.asarray(end, float)) - point)


@kernel
def offset_to_segment(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float]:
    """Return the vector from (x, y) to the nearest point of a segment, px: `nearest_on_segment` for kernels."""
    along_x, along_y = x1 - x0, y1 - y0
    fraction = ((x - x0) * along_x + (y - y0) * along_y) / (along_x * along_x + along_y * along_y)
    fraction = min(max(fraction, 0.0), 1.0)
    return x0 + fraction * along_x - x, y0 + fraction * along_y - y
