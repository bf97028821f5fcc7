"""The balls that are placed already, and where there is room for one more.

Balls are sorted by size into levels, each up to twice as large as those of the level below. Each level has square cells
that its largest ball just fits in, and a ball is listed in the one that its centre is in, among its equals. In the
levels above of which balls will be placed at random, it is listed too, among the smaller ones. So a ball that is to be
placed looks at 3 x 3 cells of its own level, smaller ones included, and of each level above, whatever the sizes.
Cells are found by a hash: a list may hold the balls of several.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sandbox.quantity import offset_to_segment
from sandbox.scene.model import Scene
from sandbox.state import Floats

LEVELS: Final = 50  # up to a radius of 2**30 px
LOWEST: Final = -19  # power of two, px: the largest radius of the lowest level, which has those of 1e-6 too
NOTHING: Final = -1  # ends a list


class Crowd(NamedTuple):
    """Ball k is the k-th that was placed.

    ball: (n, 3) x, y, radius, px; wall: (m, 5) both ends and half the thickness, px; asks: (LEVELS,) whether balls of a
    level will be placed at random; equals: (LEVELS,) balls in each; total: (2,) balls, and entries of lists; first: an
    entry of each list; entry: its ball, and another entry of the list.
    """

    ball: Floats
    wall: Floats
    asks: NDArray[np.bool_]
    equals: NDArray[np.int64]
    total: NDArray[np.int64]
    first: NDArray[np.int32]
    entry: NDArray[np.int32]


def empty_crowd(scene: Scene) -> Crowd:
    """Make room for the balls of a scene, among its walls."""
    most = len(scene.bodies)
    asks = np.zeros(LEVELS, bool)
    asks[[_level(group.radius) for group in scene.balls if group.inside]] = True
    wall = np.array([(*wall.start, *wall.to, wall.thickness / 2) for wall in scene.walls], float).reshape(-1, 5)
    entries = most * (1 + int(asks.sum()))
    first = np.full(1 << entries.bit_length(), NOTHING, np.int32)
    counts = np.zeros(LEVELS, np.int64), np.zeros(2, np.int64)
    return Crowd(np.empty((most, 3)), wall, asks, *counts, first, np.empty((entries, 2), np.int32))


def placed(crowd: Crowd) -> int:
    """Return how many balls there are."""
    return int(crowd.total[0])


@njit(cache=True)
def _level(radius):  # type: ignore[no-untyped-def]
    return max(0, math.ceil(math.log2(radius)) - LOWEST)


@njit(cache=True)
def _width(level):  # type: ignore[no-untyped-def]
    return 2.0 ** (level + LOWEST + 1)


@njit(cache=True)
def _list_of(crowd, level, smaller, column, row):  # type: ignore[no-untyped-def]
    """Return the number of the list for a cell of a level: of its equals, or of those smaller."""
    mixed = (int(column) * 73_856_093) ^ (int(row) * 19_349_663) ^ ((2 * level + smaller) * 83_492_791)  # Teschner 2003
    return (mixed ^ (mixed >> 17)) & (len(crowd.first) - 1)


@njit(cache=True)
def _place(crowd, x, y, radius):  # type: ignore[no-untyped-def]
    k, own = crowd.total[0], _level(radius)
    crowd.ball[k, 0], crowd.ball[k, 1], crowd.ball[k, 2] = x, y, radius
    for level in range(own, LEVELS):
        if level == own or crowd.asks[level]:
            e = crowd.total[1]
            where = _list_of(crowd, level, level > own, x // _width(level), y // _width(level))
            crowd.entry[e, 0], crowd.entry[e, 1] = k, crowd.first[where]
            crowd.first[where] = e
            crowd.total[1] += 1
    crowd.equals[own] += 1
    crowd.total[0] += 1


@njit(cache=True)
def forget(crowd, left):  # type: ignore[no-untyped-def]
    """Take those away again that were placed last, until so many are left."""
    while crowd.total[0] > left:
        crowd.total[0] -= 1
        x, y, radius = crowd.ball[crowd.total[0]]
        own = _level(radius)
        crowd.equals[own] -= 1
        for level in range(LEVELS - 1, own - 1, -1):
            if level == own or crowd.asks[level]:
                crowd.total[1] -= 1
                where = _list_of(crowd, level, level > own, x // _width(level), y // _width(level))
                crowd.first[where] = crowd.entry[crowd.total[1], 1]


@njit(cache=True)
def _is_free(crowd, level, smaller, x, y, radius):  # type: ignore[no-untyped-def]
    """Tell whether a ball would overlap none of a level, or none of those smaller."""
    width = _width(level)
    reach = radius + width / 2
    for column in range(int((x - reach) // width), int((x + reach) // width) + 1):
        for row in range(int((y - reach) // width), int((y + reach) // width) + 1):
            e = crowd.first[_list_of(crowd, level, smaller, column, row)]
            while e != NOTHING:
                k = crowd.entry[e, 0]
                if math.hypot(crowd.ball[k, 0] - x, crowd.ball[k, 1] - y) < radius + crowd.ball[k, 2]:
                    return False
                e = crowd.entry[e, 1]
    return True


@njit(cache=True)
def _has_room(crowd, x, y, radius):  # type: ignore[no-untyped-def]
    own = _level(radius)
    for level in range(own, LEVELS):
        if crowd.equals[level] > 0 and not _is_free(crowd, level, False, x, y, radius):
            return False
    if not _is_free(crowd, own, True, x, y, radius):
        return False
    for w in range(len(crowd.wall)):
        x0, y0, x1, y1, thick = crowd.wall[w]
        dx, dy = offset_to_segment(x, y, x0, y0, x1, y1)
        if math.hypot(dx, dy) < radius + thick:
            return False
    return True


@njit(cache=True)
def place_all(crowd, place, radius):  # type: ignore[no-untyped-def]
    """Place balls of a radius (px), whether there is room or not. place: (n, 2) px."""
    for k in range(len(place)):
        _place(crowd, place[k, 0], place[k, 1], radius)


@njit(cache=True)
def place_some(crowd, place, radius, wanted, missed, tries):  # type: ignore[no-untyped-def]
    """Place balls of a radius (px), in order, where there is room; place: (n, 2) px.

    Ends when so many as are wanted are placed, or when as many tries in a row have failed, of which `missed` came
    before these. Returns at how many places it looked, and how many tries in a row have failed by then.
    """
    looked, most = 0, crowd.total[0] + wanted
    while looked < len(place) and crowd.total[0] < most and missed < tries:
        x, y = place[looked, 0], place[looked, 1]
        looked, missed = looked + 1, missed + 1
        if _has_room(crowd, x, y, radius):
            _place(crowd, x, y, radius)
            missed = 0
    return looked, missed


@njit(cache=True)
def have_room(crowd, place, radius):  # type: ignore[no-untyped-def]
    """Tell of each place whether there is room for a ball of a radius (px): (n, 2) px -> (n,)."""
    room = np.empty(len(place), np.bool_)
    for k in range(len(place)):
        room[k] = _has_room(crowd, place[k, 0], place[k, 1], radius)
    return room
