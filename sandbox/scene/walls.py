"""A scene's walls: a table of all, the nearest point of one, and the pieces of it that a disc can touch."""

from collections.abc import Sequence
from itertools import chain, pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import kernel
from sandbox.quantity import dot, length
from sandbox.scene.fields import Vector
from sandbox.scene.model import ARENA_WALLS, Arena, Scene, Wall
from sandbox.state import Floats

ARENA_COUNT: Final = len(ARENA_WALLS)  # these walls come first, and are solid to any depth; others have two sides
LEFT, TOP, RIGHT, BOTTOM = range(ARENA_COUNT)
OUTWARD: Final = np.array([(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)])  # normals of the arena's walls

PIECE: Final = np.dtype(
    [
        ("x", "f8"),  # start, px
        ("y", "f8"),
        ("tx", "f8"),  # unit vector along it, of a round end outward, of a peg 0; its normal is (-ty, tx)
        ("ty", "f8"),
        ("length", "f8"),  # px; 0 for a round end
        ("half_thickness", "f8"),  # of the wall, px
        ("elasticity", "f8"),  # the wall's factor
        ("friction", "f8"),  # the wall's factor
        ("wall", "i8"),  # its number: the arena's from 0, then the scene's
    ]
)


class Walls(NamedTuple):
    """Walls by number. start, end: (m, 2) px, of the centre lines; the rest (m,): px and the walls' factors."""

    start: Floats
    end: Floats
    half_thickness: Floats
    elasticity: Floats
    friction: Floats


def walls_of(scene: Scene, depth: float = 0.0) -> Walls:
    """Return the arena's walls, whether they stand or not, and then the scene's own.

    depth: px, half the thickness of the arena's, which stand outside: their inner faces are on the arena's edge.
    """
    width, height = scene.arena.size
    top_left, top_right, bottom_left, bottom_right = (0.0, 0.0), (width, 0.0), (0.0, height), (width, height)
    starts = top_left, top_left, top_right, bottom_left, *(wall.start for wall in scene.walls)
    ends = bottom_left, top_right, bottom_right, bottom_right, *(wall.to for wall in scene.walls)
    start, end = np.array(starts, float), np.array(ends, float)
    out, along = depth * OUTWARD, depth * np.abs(OUTWARD[:, ::-1])
    start[:ARENA_COUNT] += out - along
    end[:ARENA_COUNT] += out + along
    half_thickness = np.array([*[depth] * ARENA_COUNT, *(wall.thickness / 2 for wall in scene.walls)])
    surfaces = (*[scene.arena] * ARENA_COUNT, *scene.walls)
    factors = (np.array([getattr(each, key) for each in surfaces], float) for key in ("elasticity", "friction"))
    return Walls(start, end, half_thickness, *factors)


def arena_faces(scene: Scene) -> Floats:
    """Return the distance of each arena wall from the origin, along its normal: (4,) px, infinite if none stands."""
    faces = np.maximum(OUTWARD @ scene.arena.size, 0.0)
    return faces if scene.arena.walls else np.full(ARENA_COUNT, np.inf)


def nearest_on_segment(point: Floats, start: Floats, end: Floats) -> Floats:
    """Return the point of a segment nearest to each point: (..., 2) px each."""
    along = end - start
    square = dot(along, along)
    fraction = np.clip(dot(along, point - start) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return start + along * fraction[..., None]


def segment_distance(point: Floats, start: Sequence[float] | Floats, end: Sequence[float] | Floats) -> Floats:
    """Return the distance of each point (..., 2) px from a segment: (...) px."""
    return length(nearest_on_segment(point, np.asarray(start, float), np.asarray(end, float)) - point)


@kernel
def offset_to_segment(x: float, y: float, start: Floats, end: Floats) -> tuple[float, float]:
    """Return the vector from (x, y) to the nearest point of a segment, px: `nearest_on_segment` for kernels."""
    along_x, along_y = end[0] - start[0], end[1] - start[1]
    square = along_x * along_x + along_y * along_y
    fraction = ((x - start[0]) * along_x + (y - start[1]) * along_y) / (square if square > 0 else 1.0)
    fraction = min(max(fraction, 0.0), 1.0)
    return start[0] + fraction * along_x - x, start[1] + fraction * along_y - y


def depths_in_wall(wall: Wall, position: Floats, radius: Floats) -> Floats:
    """Return how deep each ball is in a wall: (n,) px, negative if they are apart."""
    return radius + wall.thickness / 2 - segment_distance(position, wall.start, wall.to)


def pieces_of(scene: Scene) -> NDArray[np.void]:
    """Return the faces of the arena if they stand (left, top, right, bottom), then the pieces of each wall.

    These are a face and two ends; of a peg, which has no face, the whole circle.
    """
    width, height = scene.arena.size
    corners: list[Vector] = [(0, height), (0, 0), (width, 0), (width, height), (0, height)]
    arena = [_face(start, end, 0, scene.arena, wall) for wall, (start, end) in enumerate(pairwise(corners))]
    inner = (_pieces_of_wall(wall, number) for number, wall in enumerate(scene.walls, len(arena)))
    return np.array([*(arena if scene.arena.walls else ()), *chain.from_iterable(inner)], PIECE)


def _pieces_of_wall(wall: Wall, number: int) -> tuple[tuple[float, ...], ...]:
    start, end, half_thickness = wall.start, wall.to, wall.thickness / 2
    if wall.is_peg:
        return ((*start, 0.0, 0.0, 0.0, half_thickness, wall.elasticity, wall.friction, number),)
    ends = (_end(start, end, half_thickness, wall, number), _end(end, start, half_thickness, wall, number))
    return _face(start, end, half_thickness, wall, number), *ends


def _face(start: Vector, end: Vector, half_thickness: float, of: Arena | Wall, number: int) -> tuple[float, ...]:
    along = np.subtract(end, start)
    length = float(np.hypot(*along))
    return (*start, *(along / length), length, half_thickness, of.elasticity, of.friction, number)


def _end(at: Vector, other_end: Vector, half_thickness: float, of: Wall, number: int) -> tuple[float, ...]:
    outward = np.subtract(at, other_end)
    return (*at, *(outward / np.hypot(*outward)), 0.0, half_thickness, of.elasticity, of.friction, number)
