"""Balls that pass into each other or through a wall without a contact."""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import entry, kernel
from sandbox.judge.causes import NEGLIGIBLE
from sandbox.state import Bools, Contacts, Floats, Integers

FIRST_ROOM: Final = 64  # pairs, or crossings, that a kernel has room for at first
LEAP: Final = 0.8  # of the sum of two radii; the chord of a passage is longer than √3 of it, and one of two flew half
DEEPENING: Final = np.dtype([("key", "i8"), ("counted", "?")])  # n first + second, and whether it is counted already
Deepening = NDArray[np.void]


class Passage(NamedTuple):
    """Two balls that passed into each other, or one that went through an inner wall, without a reported contact."""

    step: int  # in which it happened, counted from 1
    first: int  # ball
    second: int  # ball, or ~wall
    flown: float  # px, by the first in that step; of two that passed within a step, by the one that flew further
    within_step: bool = False  # whether it is of two that were apart before the step and after it


def no_deepening() -> Deepening:
    """Return an empty array of pairs that went deeper into each other."""
    return np.empty(0, DEEPENING)


@kernel
def _depth(position: Floats, reach: float, i: int, j: int) -> float:
    return reach - math.hypot(position[j, 0] - position[i, 0], position[j, 1] - position[i, 1])


@kernel
def _approaches(position: Floats, velocity: Floats, i: int, j: int) -> bool:
    x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
    closing: float = (velocity[i, 0] - velocity[j, 0]) * x + (velocity[i, 1] - velocity[j, 1]) * y
    return closing > 0


@kernel
def _goes_deeper(position: Floats, velocity: Floats, step: int, i: int, j: int, reach: float, depth: float) -> bool:
    """Return whether balls that overlap by a depth (px) after a step overlapped less before it, and approach still."""
    slight = NEGLIGIBLE * reach
    if step == 0 or depth <= slight or not _approaches(position[step], velocity[step], i, j):
        return False
    before = _depth(position[step - 1], reach, i, j)
    return bool(slight < before < depth - slight and _approaches(position[step - 1], velocity[step - 1], i, j))


@kernel
def _is_reported(reported: Integers, begin: int, end: int, key: int) -> bool:
    """Return whether a key is among those from `begin` to `end`, which are sorted."""
    while begin < end:
        middle = (begin + end) // 2
        if reported[middle] == key:
            return True
        if reported[middle] < key:
            begin = middle + 1
        else:
            end = middle
    return False


@kernel
def _was_deepening(earlier: Deepening, count: int, key: int) -> tuple[bool, bool]:
    """Return whether a pair is among the first `count`, and whether it is counted already."""
    for k in range(count):
        if earlier[k].key == key:
            return True, earlier[k].counted
    return False, False


@kernel
def _sort_along(position: Floats, axis: int, order: Integers, along: Floats) -> None:
    """Sort balls by a coordinate, and write it to `along`. By insertion: few have changed places since a step ago."""
    for k in range(len(order)):
        ball, place = order[k], k
        x = position[ball, axis]
        while place > 0 and along[place - 1] > x:
            order[place], along[place] = order[place - 1], along[place - 1]
            place -= 1
        order[place], along[place] = ball, x


@entry
def _find_overlaps(
    position: Floats,
    velocity: Floats,
    radius: Floats,
    widest: float,
    axis: int,
    order: Integers,
    along: Floats,
    reported: Integers,
    bounds: Integers,
    earlier: Deepening,
    deepening: Deepening,
    found: Integers,
) -> tuple[float, int, int]:
    """Find overlaps, see `find_overlaps`. Returns the deepest, and the numbers of pairs found and still deepening.

    widest: px, the largest diameter; order: (n,) the balls along the axis, about, and along: (n,) for their coordinates
    there; earlier: deepening before the block; deepening: (2, room), which the steps use in turn, the last one the row
    of its number modulo 2; found: (room, 2). Stops at a pair that there is no room for, and returns more pairs found
    than there is room for.
    """
    n, room, deepest, passages, earlier_count = len(radius), len(found), 0.0, 0, len(earlier)
    for step in range(len(position)):
        here, now, count = position[step], deepening[step % 2], 0
        _sort_along(here, axis, order, along)
        for a in range(n):
            p = order[a]
            for b in range(a + 1, n):
                if along[b] - along[a] >= widest:
                    break
                q = order[b]
                if abs(here[q, 1 - axis] - here[p, 1 - axis]) >= widest:
                    continue
                i, j = min(p, q), max(p, q)
                reach, key = radius[i] + radius[j], i * n + j
                depth = _depth(here, reach, i, j)
                deepest = max(deepest, depth)
                if not _goes_deeper(position, velocity, step, i, j, reach, depth):
                    continue
                if _is_reported(reported, bounds[step], bounds[step + 1], key):
                    continue
                if max(count, passages) == room:
                    return deepest, room + 1, count
                again, counted = _was_deepening(earlier, earlier_count, key)
                if again and not counted:
                    found[passages, 0], found[passages, 1] = step, key
                    passages += 1
                now[count].key, now[count].counted = key, again
                count += 1
        if step > 0:
            earlier, earlier_count = now, count
    return deepest, passages, earlier_count


def find_overlaps(
    position: Floats, velocity: Floats, radius: Floats, reported: Integers, bounds: Integers, deepening: Deepening
) -> tuple[float, Integers, Deepening]:
    """Find the deepest overlap, and the pairs that went deeper into each other for two steps without a contact.

    Sweep and prune along the axis on which the balls are spread further. reported: keys of the contacts, n first +
    second, sorted within each step; those of a step begin at bounds[step]. deepening: the pairs that went deeper
    without a contact in the step before the block.
    Returns the deepest overlap (px); the step and key of each pair found, (passages, 2); and deepening after the last
    step.
    """
    axis = int(np.ptp(position[0], axis=0).argmax())
    order = np.argsort(position[0, :, axis], kind="stable")
    along, widest = np.empty(len(radius)), 2 * float(radius.max())
    room = FIRST_ROOM
    while True:
        pairs, found = np.empty((2, room), DEEPENING), np.empty((room, 2), np.int64)
        deepest, passages, count = _find_overlaps(
            position, velocity, radius, widest, axis, order, along, reported, bounds, deepening, pairs, found
        )
        if passages <= room:
            last = pairs[(len(position) - 1) % 2, :count] if len(position) > 1 else deepening
            return deepest, found[:passages], last
        room *= 2


@entry
def _find_crossings(
    position: Floats,
    ends: Floats,
    arena_walls: int,
    contacts: Contacts,
    early: Bools,
    bounds: Integers,
    found: Integers,
) -> int:
    """Write the crossings, see `find_crossings`, while there is room: (room, 3); return their number."""
    count = 0
    for step in range(1, len(position)):
        for ball in range(position.shape[1]):
            x, y = position[step - 1, ball, 0], position[step - 1, ball, 1]
            dx, dy = position[step, ball, 0] - x, position[step, ball, 1] - y
            for w in range(len(ends)):
                ax, ay = ends[w, 2] - ends[w, 0], ends[w, 3] - ends[w, 1]
                rx, ry = x - ends[w, 0], y - ends[w, 1]
                off, across = rx * ay - ry * ax, dx * ay - dy * ax
                if (off < 0) == (off + across < 0):
                    continue
                share = -off / across
                along = (rx + share * dx) * ax + (ry + share * dy) * ay
                left_out = not 0 <= along <= ax * ax + ay * ay
                for k in range(bounds[step], bounds[step + 1]):
                    of_ball = contacts[k].first == ball or contacts[k].second == ball
                    left_out = left_out or (of_ball and (early[k] or contacts[k].second == ~(arena_walls + w)))
                if not left_out:
                    if count < len(found):
                        found[count, 0], found[count, 1], found[count, 2] = step, ball, ~(arena_walls + w)
                    count += 1
    return count


def find_crossings(
    position: Floats, ends: Floats, arena_walls: int, contacts: Contacts, early: Bools, bounds: Integers
) -> Integers:
    """Find where balls cross the centre line of an inner wall: step, ball and ~wall of each, (crossings, 3).

    ends: (m, 4) px, of the inner walls, which are numbered after the arena's; early: whether a contact is reported
    before its step ends; bounds: of the contacts of each step. A ball that has a contact with that wall in the step is
    left out, and so is one with an early contact with anything, which may have led it round the wall.
    """
    found = np.empty((FIRST_ROOM, 3), np.int64)
    while (count := _find_crossings(position, ends, arena_walls, contacts, early, bounds, found)) > len(found):
        found = np.empty((count, 3), np.int64)
    return found[:count]


@kernel
def _passes(position: Floats, step: int, i: int, j: int, reach: float) -> bool:
    """Return whether two balls, apart before and after a step, come within half of their reach on straight paths."""
    x, y = position[step - 1, j, 0] - position[step - 1, i, 0], position[step - 1, j, 1] - position[step - 1, i, 1]
    dx = position[step, j, 0] - position[step, i, 0] - x
    dy = position[step, j, 1] - position[step, i, 1] - y
    square = dx * dx + dy * dy
    share = -(x * dx + y * dy) / square if square > 0 else 0.0
    if not 0 < share < 1:
        return False
    apart = min(math.hypot(x, y), math.hypot(x + dx, y + dy)) > reach
    return bool(apart and math.hypot(x + share * dx, y + share * dy) < reach / 2)


@entry
def _find_leaps(
    position: Floats, radius: Floats, contacts: Contacts, bounds: Integers, met: Bools, found: Integers
) -> int:
    """Write the leaps, see `find_leaps`, while there is room: (room, 3); return their number. met: (n,), to work in."""
    count, n = 0, len(radius)
    for step in range(1, len(position)):
        met[:] = False
        for k in range(bounds[step], bounds[step + 1]):
            met[contacts[k].first] = True
            if contacts[k].second >= 0:
                met[contacts[k].second] = True
        for i in range(n):
            dx = position[step, i, 0] - position[step - 1, i, 0]
            dy = position[step, i, 1] - position[step - 1, i, 1]
            far = math.hypot(dx, dy)
            if met[i] or far <= LEAP * radius[i]:
                continue
            for j in range(n):
                if met[j] or j == i or far <= LEAP * (radius[i] + radius[j]):
                    continue
                x, y = position[step, j, 0] - position[step - 1, j, 0], position[step, j, 1] - position[step - 1, j, 1]
                other = math.hypot(x, y)
                if other > far or (other == far and j < i):  # the one that flies further finds it
                    continue
                if _passes(position, step, i, j, radius[i] + radius[j]):
                    if count < len(found):
                        found[count, 0], found[count, 1], found[count, 2] = step, i, j
                    count += 1
    return count


def find_leaps(position: Floats, radius: Floats, contacts: Contacts, bounds: Integers) -> Integers:
    """Find the balls that flew through others within a step: step, the one that flew further, the other, (leaps, 3).

    Balls with a contact in the step are left out: it may have led them round each other. bounds: of the contacts of
    each step.
    """
    found, met = np.empty((FIRST_ROOM, 3), np.int64), np.empty(len(radius), np.bool_)
    while (count := _find_leaps(position, radius, contacts, bounds, met, found)) > len(found):
        found = np.empty((count, 3), np.int64)
    return found[:count]
