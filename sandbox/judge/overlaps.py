"""How deep balls are in each other and in walls."""

import numpy as np
from numpy.typing import NDArray

from sandbox.quantity import length
from sandbox.scene.walls import ARENA_COUNT
from sandbox.state import Floats


def in_each_other(x: Floats, radius: Floats) -> Floats:
    """Return how deep balls are in each other, px, in the order of `itertools.combinations`. x: (k, 2) px."""
    first, second = np.triu_indices(len(x), 1)
    return radius[first] + radius[second] - length(x[first] - x[second])


def in_walls(x: Floats, radius: Floats, piece: NDArray[np.void]) -> Floats:
    """Return how deep balls are in walls, px: (k, walls). piece: PIECE, of all walls, by their numbers."""
    if not len(piece):
        return np.empty((len(x), 0))
    rx, ry = x[:, :1] - piece["x"], x[:, 1:] - piece["y"]
    along, off = rx * piece["tx"] + ry * piece["ty"], ry * piece["tx"] - rx * piece["ty"]
    is_end, is_arena = piece["length"] == 0, piece["wall"] < ARENA_COUNT
    distance = np.where(is_end, np.hypot(rx, ry), np.where(is_arena, off, np.abs(off)))
    beside = is_arena | np.where(is_end, along > 0, (along >= 0) & (along <= piece["length"]))
    depth = np.where(beside, radius[:, None] + piece["half_thickness"] - distance, -np.inf)
    starts = np.flatnonzero(np.diff(piece["wall"], prepend=-1))
    depths: Floats = np.maximum.reduceat(depth, starts, axis=1)
    return depths
