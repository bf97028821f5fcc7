"""Energy, momentum, overlap, distances: pure functions of positions, velocities and spins.

position and velocity are (..., n, 2) in px and px/s, and spin is (..., n) in rad/s, where the leading axes may be the
steps of a trajectory; mass, moment (of inertia) and radius are (n,) in kg, kg px² and px; gravity is in px/s², and size
is the arena's width and height, px.
"""

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from sandbox.compiled import kernel
from sandbox.state import Bodies, Bools, Contacts, Floats, Integers, State, States

PAIRS_AT_ONCE: Final = 100_000  # of balls compared, some 10 MB
SWEEP_MARGIN: Final = 1e-12  # relative, of coordinates along the axis: above rounding


def kinetic_energy(velocity: Floats, mass: Floats) -> Floats:
    """Return the kinetic energy of all balls, kg px²/s²: (...)."""
    return 0.5 * np.einsum("...nk,...nk,n->...", velocity, velocity, mass)


def potential_energy(position: Floats, mass: Floats, gravity: Sequence[float], size: Sequence[float]) -> Floats:
    """Return the energy in the gravity field, kg px²/s²: (...). It is 0 in the corner that gravity points to."""
    field = np.asarray(gravity, float)
    lowest = np.where(field > 0, size, 0.0)
    return np.einsum("...nk,k,n->...", lowest - position, field, mass)


def energy(moving: State | States, bodies: Bodies, gravity: Sequence[float] = (), size: Sequence[float] = ()) -> Floats:
    """Return the energy of all balls, of flight, spin and gravity, kg px²/s²: (...)."""
    kinetic = kinetic_energy(moving.velocity, bodies.mass) + spin_energy(moving.spin, bodies.moment)
    return kinetic + potential_energy(moving.position, bodies.mass, gravity, size) if any(gravity) else kinetic


def spin_energy(spin: Floats, moment: Floats) -> Floats:
    """Return the energy of the spins of all balls, kg px²/s²: (...)."""
    return 0.5 * np.einsum("...n,...n,n->...", spin, spin, moment)


def momentum(velocity: Floats, mass: Floats) -> Floats:
    """Return the total momentum, kg px/s: (..., 2)."""
    return np.einsum("...nk,n->...k", velocity, mass)


def length(vector: Floats) -> Floats:
    """Return the length of each vector: (..., 2) -> (...). The length of a velocity is its speed."""
    return np.hypot(vector[..., 0], vector[..., 1])


@kernel
def pass_through(one: Any, other: Any) -> Any:
    """Return whether two balls pass through each other: they have a group in common, or a mask lacks a category.

    one, other: their filters, (3,), as in `Bodies`; or those of many pairs, (3, ...), which gives (...). The rule is
    that of `pymunk.ShapeFilter`.
    """
    in_one_group = (one[0] != 0) & (one[0] == other[0])
    return in_one_group | ((one[1] & other[2]) == 0) | ((other[1] & one[2]) == 0)


def meeting(filters: Integers) -> Bools:
    """Return which balls can meet another ball: (n,). filters: (n, 3), as in `Bodies`."""
    kinds, kind, count = np.unique(filters, axis=0, return_inverse=True, return_counts=True)
    meets: Bools = ~pass_through(kinds.T[:, :, None], kinds.T[:, None])
    meets[np.diag_indices(len(kinds))] &= count > 1
    return np.asarray(meets.any(axis=1))[kind.ravel()]


def deepest_overlap(position: Floats, radius: Floats, filters: Integers | None = None) -> tuple[float, int, int]:
    """Return the deepest overlap of two balls (px) and the two balls, or (0.0, -1, -1) if none overlap.

    position: (..., n, 2) px, of one state or of several; filters: (n, 3), as in `Bodies`; balls that pass through each
    other do not count.
    """
    deepest, first, second = 0.0, -1, -1
    for overlap, a, b in overlaps(position.reshape(-1, *position.shape[-2:]), radius, filters):
        k = int(overlap.argmax())
        if overlap[k] > deepest:
            deepest, first, second = float(overlap[k]), *sorted((int(a[k]), int(b[k])))
    return deepest, first, second


def overlaps(position: Floats, radius: Floats, filters: Integers | None) -> Iterator[tuple[Floats, Integers, Integers]]:
    """Yield overlaps (px) and the balls of each, (k,), some pairs at a time.

    position: (states, n, 2) px; filters: (n, 3), as in `Bodies`; balls that pass through each other do not count.
    Sweep and prune along the axis of the larger spread (Cohen et al. 1995): each ball is compared with the balls no
    larger than it that are within its diameter along the axis, so that one large ball does not slow down many small.
    """
    states, n = position.shape[:2]
    along = np.take_along_axis(position, np.ptp(position, axis=1).argmax(axis=1)[:, None, None], axis=2)[..., 0]
    ball = np.argsort(along, axis=1, kind="stable")
    x, y = np.take_along_axis(position, ball[..., None], axis=1).reshape(-1, 2).T
    along, radii, ball = np.take_along_axis(along, ball, axis=1), radius[ball].ravel(), ball.ravel()
    apart = np.ptp(along) + 3 * radii.max()  # between the states, on one axis
    along = ((along - along.min()) + apart * np.arange(states)[:, None]).ravel()
    reach = 2 * radii * (1 + SWEEP_MARGIN) + SWEEP_MARGIN * apart * states
    begin, end = np.arange(1, states * n + 1), np.searchsorted(along, along + reach, "right")
    larger = np.flatnonzero(radii > radii.min())
    begin[larger] = np.searchsorted(along, along[larger] - reach[larger])
    counts = end - begin
    for balls in np.split(np.arange(states * n), np.flatnonzero(np.diff(np.cumsum(counts) // PAIRS_AT_ONCE)) + 1):
        count = counts[balls]
        first = np.repeat(balls, count)
        second = np.arange(len(first)) + np.repeat(begin[balls] + count - np.cumsum(count), count)
        is_near = np.abs(y[second] - y[first]) < 2 * radii[first]
        first, second = first[is_near], second[is_near]
        if len(larger):
            is_counted = (radii[second] < radii[first]) | ((radii[second] == radii[first]) & (first < second))
            first, second = first[is_counted], second[is_counted]
        overlap = radii[first] + radii[second] - np.hypot(x[second] - x[first], y[second] - y[first])
        meets = overlap > 0
        a, b = ball[first[meets]], ball[second[meets]]
        if filters is not None:
            meets[meets] = is_met = ~pass_through(filters.T[:, a], filters.T[:, b])
            a, b = a[is_met], b[is_met]
        if len(a):
            yield overlap[meets], a, b


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
