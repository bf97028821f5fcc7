"""Walls as a disc's centre meets them: straight faces, and a round end at either end of a face."""

from itertools import chain, pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sandbox.scene.model import ARENA_WALLS, Scene, Vector

ARENA_COUNT: Final = len(ARENA_WALLS)  # the first walls are the arena's, solid to any depth; others have two sides
LEFT, TOP, RIGHT, BOTTOM = range(ARENA_COUNT)

PIECE: Final = np.dtype(
    [
        ("x", "f8"),  # start, px
        ("y", "f8"),
        ("tx", "f8"),  # unit vector along it; its normal is (-ty, tx)
        ("ty", "f8"),
        ("length", "f8"),  # px; 0 for a round end
        ("half_thickness", "f8"),  # of the wall, px
        ("elasticity", "f8"),  # the wall's factor
        ("wall", "i8"),
    ]
)


def pieces_of(scene: Scene) -> NDArray[np.void]:
    """List the faces of the arena (left, top, right, bottom), then a face and two ends for each wall of the scene."""
    width, height = scene.arena.size
    corners: list[Vector] = [(0, height), (0, 0), (width, 0), (width, height), (0, height)]
    arena = [_face(wall, start, end, 0, scene.arena.elasticity) for wall, (start, end) in enumerate(pairwise(corners))]
    inner = (
        (
            _face(number, wall.start, wall.to, wall.thickness / 2, wall.elasticity),
            _end(number, wall.start, wall.thickness / 2, wall.elasticity),
            _end(number, wall.to, wall.thickness / 2, wall.elasticity),
        )
        for number, wall in enumerate(scene.walls, len(arena))
    )
    return np.array([*arena, *chain.from_iterable(inner)], PIECE)


def _face(wall: int, start: Vector, end: Vector, thick: float, elasticity: float) -> tuple[float, ...]:
    along = np.subtract(end, start)
    length = float(np.hypot(*along))
    return (*start, *(along / length), length, thick, elasticity, wall)


def _end(wall: int, at: Vector, thick: float, elasticity: float) -> tuple[float, ...]:
    return (*at, 0.0, 0.0, 0.0, thick, elasticity, wall)
