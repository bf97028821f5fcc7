"""Walls as a solver needs them: as segments, or as pieces that a disc can touch (straight faces, and round ends)."""

from itertools import chain, pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.quantity import nearest_on_segment
from sandbox.scene.fields import Vector
from sandbox.scene.model import ARENA_WALLS, Arena, Scene, Wall
from sandbox.state import Floats, Integers

ARENA_COUNT: Final = len(ARENA_WALLS)  # these walls come first, and are solid to any depth; others have two sides
LEFT, TOP, RIGHT, BOTTOM = range(ARENA_COUNT)

PIECE: Final = np.dtype(
    [
        ("x", "f8"),  # start, px
        ("y", "f8"),
        ("tx", "f8"),  # unit vector along it, of a round end outward; its normal is (-ty, tx)
        ("ty", "f8"),
        ("length", "f8"),  # px; 0 for a round end
        ("half_thickness", "f8"),  # of the wall, px
        ("elasticity", "f8"),  # the wall's factor
        ("friction", "f8"),  # the wall's factor
        ("wall", "i8"),  # its number: the arena's from 0, then the scene's
    ]
)


class Segments(NamedTuple):
    """The centre lines of walls. start, end: (m, 2) px; half_thickness: (m,) px."""

    start: Floats
    end: Floats
    half_thickness: Floats


def separation(
    position: Floats, radius: Floats, segments: Segments, first: Integers, second: Integers
) -> tuple[Floats, Floats]:
    """Return the vector from each first ball to its second ball or wall, and the length at which they touch, px.

    position: (n, 2) px; radius: (n,) px; first, second: (k,) as in CONTACT. The vector, (k, 2), ends at the ball's
    centre, or at the nearest point of the wall's centre line; the length is (k,).
    """
    of_wall, ball, wall = second < 0, np.maximum(second, 0), np.maximum(~second, 0)
    start, end, half_thickness = (part[wall] for part in segments)
    on_wall = nearest_on_segment(position[first], start, end)
    away = np.where(of_wall[:, None], on_wall, position[ball]) - position[first]
    return away, radius[first] + np.where(of_wall, half_thickness, radius[ball])


def pieces_of(scene: Scene) -> NDArray[np.void]:
    """Return the faces of the arena if they stand (left, top, right, bottom), then a face and two ends of each wall."""
    width, height = scene.arena.size
    corners: list[Vector] = [(0, height), (0, 0), (width, 0), (width, height), (0, height)]
    arena = [_face(start, end, 0, scene.arena, wall) for wall, (start, end) in enumerate(pairwise(corners))]
    inner = (
        (
            _face(wall.start, wall.to, wall.thickness / 2, wall, number),
            _end(wall.start, wall.to, wall.thickness / 2, wall, number),
            _end(wall.to, wall.start, wall.thickness / 2, wall, number),
        )
        for number, wall in enumerate(scene.walls, len(arena))
    )
    return np.array([*(arena if scene.arena.walls else ()), *chain.from_iterable(inner)], PIECE)


def _face(start: Vector, end: Vector, half_thickness: float, of: Arena | Wall, number: int) -> tuple[float, ...]:
    along = np.subtract(end, start)
    length = float(np.hypot(*along))
    return (*start, *(along / length), length, half_thickness, of.elasticity, of.friction, number)


def _end(at: Vector, other_end: Vector, half_thickness: float, of: Wall, number: int) -> tuple[float, ...]:
    outward = np.subtract(at, other_end)
    return (*at, *(outward / np.hypot(*outward)), 0.0, half_thickness, of.elasticity, of.friction, number)
