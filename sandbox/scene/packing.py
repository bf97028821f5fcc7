"""The balls placed so far, and whether there is room for one more.

Balls are sorted by radius into levels; each holds radii up to twice those of the level below. A level has a grid of
square cells that its largest ball just fits in. A ball is listed in the cell of its centre, among the balls of its own
level; and in each higher level whose balls are placed at random, among the smaller balls. So the search for room looks
at 3 x 3 cells of the ball's own level, smaller balls included, and of each higher level, whatever the radii. The lists
are found by hashing the cell, so a list may hold the balls of several cells.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import kernel, portable_entry
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT, Walls, offset_to_segment, walls_of
from sandbox.state import Bools, Floats

LEVELS: Final = 50  # up to a radius of 2**30 px
LOWEST_EXPONENT: Final = -19  # the largest radius of level 0 is 2**-19 px; it holds all smaller ones too
END_OF_LIST: Final = -1


class Packing(NamedTuple):
    """The balls in the order in which they were placed, and the lists of the cells.

    ball: (n, 3) x, y, radius, px; walls: by number; random: (LEVELS,) whether balls of a level are placed at random;
    population: (LEVELS,) balls in each; total: (2,) numbers of balls and of list entries;
    first: the index of each list's first entry; entry: (..., 2) its ball, and the index of the list's next entry.
    """

    ball: Floats
    walls: Walls
    random: NDArray[np.bool_]
    population: NDArray[np.int64]
    total: NDArray[np.int64]
    first: NDArray[np.int32]
    entry: NDArray[np.int32]


@kernel
def _level(radius: float) -> int:
    """Return the level of balls of a radius (px)."""
    return max(0, math.ceil(math.log2(radius)) - LOWEST_EXPONENT)


@kernel
def _cell_width(level: int) -> float:
    """Return the width of a level's cells, px: its largest diameter."""
    return 2.0 ** (level + LOWEST_EXPONENT + 1)


@kernel
def _list_of(packing: Packing, level: int, smaller: bool, column: float, row: float) -> int:
    """Return the number of a cell's list: of the balls of its level, or of the smaller ones."""
    mixed = (int(column) * 73_856_093) ^ (int(row) * 19_349_663) ^ ((2 * level + smaller) * 83_492_791)  # Teschner 2003
    return (mixed ^ (mixed >> 17)) & (len(packing.first) - 1)


@kernel
def _place(packing: Packing, x: float, y: float, radius: float) -> None:
    k, lowest = packing.total[0], _level(radius)
    packing.ball[k, 0], packing.ball[k, 1], packing.ball[k, 2] = x, y, radius
    for level in range(lowest, LEVELS):
        if level == lowest or packing.random[level]:
            e = packing.total[1]
            number = _list_of(packing, level, level > lowest, x // _cell_width(level), y // _cell_width(level))
            packing.entry[e, 0], packing.entry[e, 1] = k, packing.first[number]
            packing.first[number] = e
            packing.total[1] += 1
    packing.population[lowest] += 1
    packing.total[0] += 1


@portable_entry
def keep_first(packing: Packing, count: int) -> None:
    """Keep the first `count` balls and remove those placed later."""
    while packing.total[0] > count:
        packing.total[0] -= 1
        x, y, radius = packing.ball[packing.total[0]]
        lowest = _level(radius)
        packing.population[lowest] -= 1
        for level in range(LEVELS - 1, lowest - 1, -1):
            if level == lowest or packing.random[level]:
                packing.total[1] -= 1
                number = _list_of(packing, level, level > lowest, x // _cell_width(level), y // _cell_width(level))
                packing.first[number] = packing.entry[packing.total[1], 1]


@kernel
def _is_free(packing: Packing, level: int, smaller: bool, x: float, y: float, radius: float) -> bool:
    """Return whether a ball would overlap no ball of a level, or no smaller one listed there."""
    width = _cell_width(level)
    reach = radius + width / 2
    for column in range(int((x - reach) // width), int((x + reach) // width) + 1):
        for row in range(int((y - reach) // width), int((y + reach) // width) + 1):
            e = packing.first[_list_of(packing, level, smaller, column, row)]
            while e != END_OF_LIST:
                k = packing.entry[e, 0]
                if np.hypot(packing.ball[k, 0] - x, packing.ball[k, 1] - y) < radius + packing.ball[k, 2]:
                    return False
                e = packing.entry[e, 1]
    return True


@kernel
def _has_room(packing: Packing, x: float, y: float, radius: float) -> bool:
    lowest = _level(radius)
    for level in range(lowest, LEVELS):
        if packing.population[level] > 0 and not _is_free(packing, level, False, x, y, radius):
            return False
    if not _is_free(packing, lowest, True, x, y, radius):
        return False
    walls = packing.walls
    for w in range(ARENA_COUNT, len(walls.start)):
        dx, dy = offset_to_segment(x, y, walls.start[w], walls.end[w])
        if np.hypot(dx, dy) < radius + walls.half_thickness[w]:
            return False
    return True


@portable_entry
def place_all(packing: Packing, place: Floats, radius: float) -> None:
    """Place balls of a radius (px), whether there is room or not. place: (n, 2) px."""
    for k in range(len(place)):
        _place(packing, place[k, 0], place[k, 1], radius)


@portable_entry
def place_some(
    packing: Packing, place: Floats, radius: float, wanted: int, missed: int, max_missed: int
) -> tuple[int, int]:
    """Place balls of a radius (px) where there is room, in order, until `wanted` are placed. place: (n, 2) px.

    Gives up after `max_missed` places in a row without room; `missed` of them came before the first one here.
    Returns how many places were tried, and how many in a row had no room at the end.
    """
    tried, most = 0, packing.total[0] + wanted
    while tried < len(place) and packing.total[0] < most and missed < max_missed:
        x, y = place[tried, 0], place[tried, 1]
        tried, missed = tried + 1, missed + 1
        if _has_room(packing, x, y, radius):
            _place(packing, x, y, radius)
            missed = 0
    return tried, missed


@portable_entry
def _mark_room(packing: Packing, place: Floats, radius: float, room: Bools) -> None:
    """Write whether there is room for a ball of a radius (px) at each place: (n, 2) px -> (n,)."""
    for k in range(len(place)):
        room[k] = _has_room(packing, place[k, 0], place[k, 1], radius)


def have_room(packing: Packing, place: Floats, radius: float) -> Bools:
    """Return whether there is room for a ball of a radius (px) at each place: (n, 2) px -> (n,)."""
    room = np.empty(len(place), bool)
    _mark_room(packing, place, radius, room)
    return room


def empty_packing(scene: Scene) -> Packing:
    """Return a packing of the walls of a scene, with room for its balls."""
    balls = len(scene.bodies)
    random = np.zeros(LEVELS, bool)
    random[[_level(group.radius) for group in scene.balls if group.inside]] = True
    entries = balls * (1 + int(random.sum()))
    first = np.full(1 << entries.bit_length(), END_OF_LIST, np.int32)
    counts = np.zeros(LEVELS, np.int64), np.zeros(2, np.int64)
    return Packing(np.empty((balls, 3)), walls_of(scene), random, *counts, first, np.empty((entries, 2), np.int32))


def placed(packing: Packing) -> int:
    """Return the number of balls placed so far."""
    return int(packing.total[0])
