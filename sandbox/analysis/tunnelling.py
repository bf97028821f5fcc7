"""Balls that pass into each other or through a wall without a contact."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sandbox.analysis.causes import NEGLIGIBLE


class Passage(NamedTuple):
    """Two balls that passed into each other, or one that went through an inner wall, without a reported contact."""

    step: int  # in which it happened, counted from 1
    first: int  # ball
    second: int  # ball, or ~wall
    flown: float  # px, by the first in that step


@njit(cache=True)
def _depth(position, reach, i, j):  # type: ignore[no-untyped-def]
    return reach - math.hypot(position[j, 0] - position[i, 0], position[j, 1] - position[i, 1])


@njit(cache=True)
def _approaches(position, velocity, i, j):  # type: ignore[no-untyped-def]
    x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
    return (velocity[i, 0] - velocity[j, 0]) * x + (velocity[i, 1] - velocity[j, 1]) * y > 0


@njit(cache=True)
def find_overlaps(position, velocity, radius, reported, bounds, deepening, counted):  # type: ignore[no-untyped-def]
    """Find the deepest overlap, and the pairs that went deeper into each other for two steps without a contact.

    Sweep and prune along the axis on which the balls are spread further. reported: keys of the contacts, n first +
    second, sorted within each step; those of a step begin at bounds[step]. deepening: keys of the pairs that went
    deeper without a contact in the step before the block; counted: those of them that are counted already.
    Returns the deepest overlap (px); the step and key of each pair found, (passages, 2); and deepening and counted
    after the last step.
    """
    n, widest, deepest = len(radius), 2 * radius.max(), 0.0
    spread_x, spread_y = np.ptp(position[0, :, 0]), np.ptp(position[0, :, 1])
    axis = 0 if spread_x >= spread_y else 1
    found = [(0, 0)]
    for step in range(len(position)):
        here, before = position[step], position[max(step - 1, 0)]
        order = np.argsort(here[:, axis])
        along, across = here[order, axis], here[order, 1 - axis]
        now, again = [np.int64(-1)], [np.int64(-1)]
        for a in range(n):
            for b in range(a + 1, n):
                if along[b] - along[a] >= widest:
                    break
                if abs(across[b] - across[a]) >= widest:
                    continue
                i, j = min(order[a], order[b]), max(order[a], order[b])
                reach = radius[i] + radius[j]
                depth = _depth(here, reach, i, j)
                deepest, slight = max(deepest, depth), NEGLIGIBLE * reach
                if depth <= slight or not _approaches(here, velocity[step], i, j):
                    continue
                earlier = _depth(before, reach, i, j)
                if not slight < earlier < depth - slight or not _approaches(before, velocity[step - 1], i, j):
                    continue
                key = i * n + j
                at = bounds[step] + np.searchsorted(reported[bounds[step] : bounds[step + 1]], key)
                if at < bounds[step + 1] and reported[at] == key:
                    continue
                now.append(key)
                if np.any(deepening == key):
                    again.append(key)
                    if not np.any(counted == key):
                        found.append((step, key))
        if step > 0:
            deepening, counted = np.array(now)[1:], np.array(again)[1:]
    return deepest, np.array(found)[1:], deepening, counted


@njit(cache=True)
def find_crossings(position, ends, arena_walls, contacts, early, bounds):  # type: ignore[no-untyped-def]
    """Find where balls cross the centre line of an inner wall: step, ball and ~wall of each, (crossings, 3).

    ends: (m, 4) px, of the inner walls, which are numbered after the arena's; early: whether a contact is reported
    before its step ends; bounds: of the contacts of each step. A ball that has a contact with that wall in the step is
    left out, and so is one with an early contact with anything, which may have led it round the wall.
    """
    found = [(0, 0, 0)]
    for step in range(1, len(position)):
        for ball in range(position.shape[1]):
            x, y = position[step - 1, ball]
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
                    found.append((step, ball, ~(arena_walls + w)))
    return np.array(found)[1:]
