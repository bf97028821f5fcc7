"""Energy, momentum, overlap, distances: pure functions of positions, velocities and spins.

position and velocity are (..., n, 2) in px and px/s, and spin is (..., n) in rad/s, where the leading axes may be the
steps of a trajectory; mass, moment (of inertia) and radius are (n,) in kg, kg px² and px; gravity is in px/s², and size
is the arena's width and height, px.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sandbox.compiled import kernel, portable_entry
from sandbox.state import MEETS_ALL, Bodies, Bools, Contacts, Floats, Integers, State, States


def kinetic_energy(velocity: Floats, mass: Floats) -> Floats:
    """Return the kinetic energy of all balls, kg px²/s²: (...)."""
    return 0.5 * np.einsum("...nk,...nk,n->...", velocity, velocity, mass)


def potential_energy(position: Floats, mass: Floats, gravity: Sequence[float], size: Sequence[float]) -> Floats:
    """Return the energy in the gravity field, kg px²/s²: (...). It is 0 in the corner that gravity points to."""
    field = np.asarray(gravity, float)
    lowest = np.where(field > 0, size, 0.0)
    return np.einsum("...nk,k,n->...", lowest - position, field, mass)


def energy(moving: State | States, bodies: Bodies, gravity: Sequence[float], size: Sequence[float]) -> Floats:
    """Return the energy of all balls, of flight, spin and gravity, kg px²/s²: (...)."""
    kinetic = kinetic_energy(moving.velocity, bodies.mass) + spin_energy(moving.spin, bodies.moment)
    return kinetic + potential_energy(moving.position, bodies.mass, gravity, size) if any(gravity) else kinetic


def kinetic_energies(velocity: Floats, spin: Floats, mass: Floats, moment: Floats) -> Floats:
    """Return the energy of flight and spin of each ball, kg px²/s²: (n,)."""
    energies: Floats = 0.5 * mass * (velocity**2).sum(axis=1) + 0.5 * moment * spin**2
    return energies


def spin_energy(spin: Floats, moment: Floats) -> Floats:
    """Return the energy of the spins of all balls, kg px²/s²: (...)."""
    return 0.5 * np.einsum("...n,...n,n->...", spin, spin, moment)


def angular_momentum(moving: State | States, bodies: Bodies) -> Floats:
    """Return the angular momentum of all balls about the origin, positive from x to y, kg px²/s: (...)."""
    position, velocity = moving.position, moving.velocity
    orbital = position[..., 0] * velocity[..., 1] - position[..., 1] * velocity[..., 0]
    return np.einsum("...n,n->...", orbital, bodies.mass) + np.einsum("...n,n->...", moving.spin, bodies.moment)


def momentum(velocity: Floats, mass: Floats) -> Floats:
    """Return the total momentum, kg px/s: (..., 2)."""
    return np.einsum("...nk,n->...k", velocity, mass)


def centre_of_mass(position: Floats, mass: Floats) -> Floats:
    """Return the centre of mass, px: (..., 2)."""
    return np.einsum("...nk,n->...k", position, mass / mass.sum())


def height(centre: Floats, size: Sequence[float]) -> Floats:
    """Return how far points (..., 2), such as centres of mass, are above the arena's lower edge, px: (...)."""
    return size[1] - centre[..., 1]


def length(vector: Floats) -> Floats:
    """Return the length of each vector: (..., 2) -> (...). The length of a velocity is its speed."""
    return np.hypot(vector[..., 0], vector[..., 1])


def outside(position: Floats, size: Sequence[float]) -> Floats:
    """Return how far each ball's centre is outside an arena, px, negative if it is inside: (..., n)."""
    return np.maximum(-position, position - size).max(axis=-1)


@kernel
def pass_through(one: Any, other: Any) -> Any:
    """Return whether two balls pass through each other: they have a group in common, or a mask lacks a category.

    one, other: their filters, (3,), as in `Bodies`; or those of many pairs, (3, ...), which gives (...). The rule is
    that of `pymunk.ShapeFilter`.
    """
    in_one_group = (one[0] != 0) & (one[0] == other[0])
    return in_one_group | ((one[1] & other[2]) == 0) | ((other[1] & one[2]) == 0)


def passing(filters: Integers, first: Integers, second: Integers) -> Bools:
    """Return which pairs of balls pass through each other: (...). filters: (n, 3), as in `Bodies`."""
    passes: Bools = pass_through(filters.T[:, first], filters.T[:, second])
    return passes


def deepest_overlap(position: Floats, radius: Floats, filters: Integers | None = None) -> tuple[float, int, int]:
    """Return the deepest overlap of two balls (px) and the two balls, or (0.0, -1, -1) if none overlap.

    position: (..., n, 2) px, of one state or of several; filters: (n, 3), as in `Bodies`; balls that pass through each
    other do not count. Sweep and prune along the axis of the larger spread (Cohen et al. 1995).
    """
    states = position.reshape(-1, *position.shape[-2:])
    axis = np.ptp(states, axis=1).argmax(axis=1)
    order = np.argsort(states[np.arange(len(states)), :, axis], axis=1)
    ordered = np.take_along_axis(states, order[..., None], axis=1)
    deepest, state, first, second = _sweep(
        ordered, radius[order], _filters_in(order, filters), float(radius.min()), axis
    )
    if deepest == 0:
        return 0.0, -1, -1
    first, second = sorted((int(order[state, first]), int(order[state, second])))
    return deepest, first, second


@portable_entry
def _sweep(
    position: Floats, radius: Floats, filters: Integers, smallest: float, axes: Integers
) -> tuple[float, int, int, int]:
    """Compare each ball with the balls no larger than it, while these are near enough for a new deepest overlap.

    So not every pair is tested, even if one ball is larger than all others or thousands lie in a heap.
    """
    deepest, state, first, second = 0.0, -1, -1, -1
    for s in range(len(position)):
        x, r, axis = position[s], radius[s], axes[s]
        for i in range(len(x)):
            for direction in (1, -1):
                if direction < 0 and r[i] == smallest:
                    break
                j = i + direction
                while 0 <= j < len(x):
                    if abs(x[j, axis] - x[i, axis]) >= 2 * r[i] - deepest:
                        break
                    if r[j] < r[i] or (r[j] == r[i] and direction > 0):
                        overlap = r[i] + r[j] - np.hypot(x[j, 0] - x[i, 0], x[j, 1] - x[i, 1])
                        if overlap > deepest and not pass_through(filters[s, i], filters[s, j]):
                            deepest, state, first, second = overlap, s, i, j
                    j += direction
    return deepest, state, first, second


def count_overlaps(position: Floats, radius: Floats, most: int, filters: Integers | None = None) -> int:
    """Return how many pairs of balls overlap, counting up to a number. position: (n, 2) px; radius: (n,) px.

    filters: (n, 3), as in `Bodies`; balls that pass through each other do not count.
    """
    axis = int(np.ptp(position, axis=0).argmax())
    order = np.argsort(position[:, axis])
    filters = _filters_in(order, filters)
    return _count_overlaps(position[order], radius[order], filters, float(radius.min()), axis, most)


def _filters_in(order: Integers, filters: Integers | None) -> Integers:
    return (
        np.broadcast_to(np.array(MEETS_ALL, np.int64), (*order.shape, 3)).copy() if filters is None else filters[order]
    )


@portable_entry
def _count_overlaps(position: Floats, radius: Floats, filters: Integers, smallest: float, axis: int, most: int) -> int:
    """Compare each ball with the balls no larger than it, as `_sweep` does."""
    count = 0
    for i in range(len(position)):
        for direction in (1, -1):
            if direction < 0 and radius[i] == smallest:
                break
            j = i + direction
            while 0 <= j < len(position) and count < most:
                if abs(position[j, axis] - position[i, axis]) >= 2 * radius[i]:
                    break
                if radius[j] < radius[i] or (radius[j] == radius[i] and direction > 0):
                    distance = np.hypot(position[j, 0] - position[i, 0], position[j, 1] - position[i, 1])
                    count += distance < radius[i] + radius[j] and not pass_through(filters[i], filters[j])
                j += direction
    return count


def dot(a: Floats, b: Floats) -> Floats:
    """Return the scalar product of vectors: (..., 2) and (..., 2) -> (...)."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def impulse_of(contacts: Contacts | np.void) -> Floats:
    """Return what contacts give their second body and take from the first, kg px/s: (..., 2)."""
    normal: Floats = contacts["normal"]
    along: Floats = contacts["impulse"][..., None] * normal
    return along + contacts["tangential"][..., None] * tangent(normal)


def tangent(normal: Floats) -> Floats:
    """Return the tangent of each unit normal, (-normal_y, normal_x): (..., 2) -> (..., 2)."""
    return np.stack([-normal[..., 1], normal[..., 0]], axis=-1)


def slips(contacts: Contacts, row: Integers, velocity: Floats, spin: Floats, radius: Floats) -> Floats:
    """Return how fast the first body's rim slips past the second's in each contact, along the tangent: (k,) px/s.

    row: (k,), of the states in which the contacts slip; velocity, spin: (rows, n, 2) px/s and (rows, n) rad/s; radius:
    (n,) px. A wall is at rest.
    """
    first, second = contacts["first"], contacts["second"]
    along, between = tangent(contacts["normal"]), second >= 0
    slip = dot(velocity[row, first], along) + radius[first] * spin[row, first]
    row, second, along = row[between], second[between], along[between]
    slip[between] += radius[second] * spin[row, second] - dot(velocity[row, second], along)
    return slip
