"""Energies of bodies and springs, and vectors: pure functions of arrays."""

from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.space.memory import JointKind, Snapshot

Floats = NDArray[np.float64]
Rows = NDArray[Any]

_PROGRAM_LAWS: Final = {  # addresses of the functions that call a law of the program
    JointKind.SPRING: int(ffi.cast("uintptr_t", lib.ext_cpDampedSpringForceFunc)),
    JointKind.ROTARY_SPRING: int(ffi.cast("uintptr_t", lib.ext_cpDampedRotarySpringTorqueFunc)),
}


def dot(a: Floats, b: Floats) -> Floats:
    """Return the dot products of vectors."""
    return cast("Floats", (a * b).sum(axis=-1))


def cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def turned(a: Floats) -> Floats:
    """Return vectors turned by +90°."""
    return np.stack([-a[..., 1], a[..., 0]], axis=-1)


def finite(value: Floats) -> Floats:
    """Return masses or moments, 0 for infinite ones, which have no energy here."""
    return np.where(np.isfinite(value), value, 0.0)


def kinetic_energy(mass: Floats, moment: Floats, velocity: Floats, spin: Floats) -> Floats:
    """Return the kinetic energy of each body; none of infinite masses and moments."""
    return (finite(mass) * dot(velocity, velocity) + finite(moment) * spin**2) / 2


def potential_energy(mass: Floats, position: Floats, gravity: Floats) -> Floats:
    """Return the potential energy of each body."""
    return -finite(mass) * (position @ gravity)


def with_static(values: Floats) -> Floats:
    """Return values of bodies, and a row of zeros for what is not in the Space."""
    return np.concatenate([values, np.zeros((1, *values.shape[1:]))])


class Index:
    """Finds rows by their keys, such as bodies by their ids. What is unknown is in a row after the last."""

    def __init__(self, keys: Rows) -> None:
        self._order = np.argsort(keys)
        self._keys = keys[self._order]

    def rows(self, wanted: Rows) -> NDArray[np.intp]:
        """Return the row of each key, or the number of rows if it is unknown."""
        if not len(self._keys):
            return np.zeros(wanted.shape, np.intp)
        place = np.minimum(np.searchsorted(self._keys, wanted), len(self._keys) - 1)
        return np.where(self._keys[place] == wanted, self._order[place], len(self._keys))


def is_within(largest: float, state: Snapshot) -> bool:
    """Return whether all places and velocities are numbers below a bound, px, px/s, rad and rad/s."""
    keys = ("position", "velocity", "angle", "spin")
    return all(bool((np.abs(state.bodies[key]) < largest).all()) for key in keys)


def common(old: Rows, new: Rows, key: str = "id") -> tuple[Rows, Rows]:
    """Return the rows that two tables have in common, by their keys."""
    if np.array_equal(old[key], new[key]):
        return old, new
    _, first, second = np.intersect1d(old[key], new[key], return_indices=True)
    return old[first], new[second]


def is_default_spring(joints: Rows) -> NDArray[np.bool_]:
    """Return which joints are springs with Pymunk's own law."""
    is_default = np.zeros(len(joints), bool)
    for kind, address in _PROGRAM_LAWS.items():
        is_default |= (joints["kind"] == kind) & (joints["function"] != address)
    return is_default


def strain(springs: Rows, read: Snapshot, state: Snapshot) -> Floats:
    """Return how much longer springs are than at rest, px, or their angle less that at rest, rad.

    read: the snapshot which the springs are of; state: that of the bodies' places.
    """
    ends, angles = [], []
    then, now = read.bodies, state.bodies
    index_then, index_now = Index(then["id"]), Index(now["id"])
    for side in ("a", "b"):
        rows = index_now.rows(springs[f"body_{side}"])
        angle = with_static(now["angle"])[rows]
        turn = (angle - with_static(then["angle"])[index_then.rows(springs[f"body_{side}"])])[:, None]
        arm = springs[f"arm_{side}"]
        ends.append(with_static(now["position"])[rows] + np.cos(turn) * arm + np.sin(turn) * turned(arm))
        angles.append(angle)
    length = np.linalg.norm(ends[1] - ends[0], axis=1)
    is_angular = springs["kind"] == JointKind.ROTARY_SPRING
    strain = np.where(is_angular, angles[0] - angles[1], length) - springs["setting"][:, 0]
    return cast("Floats", strain)


def stored_energy(springs: Rows, read: Snapshot, state: Snapshot) -> Floats:
    """Return the elastic energy of each spring."""
    return springs["setting"][:, 1] * strain(springs, read, state) ** 2 / 2


def elastic_energy(read: Snapshot, state: Snapshot) -> float:
    """Return the elastic energy of all springs with Pymunk's own law, for the places in a state."""
    springs = read.joints[is_default_spring(read.joints)]
    return float(stored_energy(springs, read, state).sum()) if len(springs) else 0.0
