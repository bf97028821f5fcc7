"""Balls that pass into each other or through a wall without a contact."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sandbox.analysis.causes import SHARE


class Passage(NamedTuple):
    """Two balls that passed into each other, or one that went through an inner wall, with no contact told."""

    step: int  # in which it was, counted from 1
    first: int  # ball
    second: int  # ball, or ~wall
    flown: float  # px, by the first in that step


@njit(cache=True)
def _depth(position, reach, i, j):  # type: ignore[no-untyped-def]
    return reach - math.hypot(position[j, 0] - position[i, 0], position[j, 1] - position[i, 1])


@njit(cache=True)
def _nears(position, velocity, i, j):  # type: ignore[no-untyped-def]
    x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
    return (velocity[i, 0] - velocity[j, 0]) * x + (velocity[i, 1] - velocity[j, 1]) * y > 0


@njit(cache=True)
def _overlaps(position, velocity, radius, told, bounds, passing, longer):  # type: ignore[no-untyped-def]
    """Sweep over the overlapping pairs of each state, along the axis on which the balls are spread further.

    told: keys of the contacts, n first + second, sorted in each step, which has those from bounds[step] on; passing:
    keys of the pairs that went deeper, untold, in the step before the block, and longer: of those that are found.
    Returns how deep the deepest overlap is (px); the step and key of each pair that has gone deeper into each other for
    two steps, in which no contact of theirs is told, (passages, 2); and both keys of the last step.
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
                deepest, slight = max(deepest, depth), SHARE * reach
                if depth <= slight or not _nears(here, velocity[step], i, j):
                    continue
                earlier = _depth(before, reach, i, j)
                if not slight < earlier < depth - slight or not _nears(before, velocity[step - 1], i, j):
                    continue
                key = i * n + j
                at = bounds[step] + np.searchsorted(told[bounds[step] : bounds[step + 1]], key)
                if at < bounds[step + 1] and told[at] == key:
                    continue
                now.append(key)
                if np.any(passing == key):
                    again.append(key)
                    if not np.any(longer == key):
                        found.append((step, key))
        if step > 0:
            passing, longer = np.array(now)[1:], np.array(again)[1:]
    return deepest, np.array(found)[1:], passing, longer


@njit(cache=True)
def _crossings(position, ends, arena, contacts, early, bounds):  # type: ignore[no-untyped-def]
    """Find where balls cross the centre line of an inner wall: step, ball and ~wall of each, (crossings, 3).

    ends: (m, 4) px, of the walls that follow so many of the arena's; early: whether a contact is told before its step
    ends; bounds: of the contacts of each step. Left out is who has a contact with that wall in the step, and who has an
    early one with anything: that may have led round the wall.
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
                told = not 0 <= along <= ax * ax + ay * ay
                for k in range(bounds[step], bounds[step + 1]):
                    of_ball = contacts[k].first == ball or contacts[k].second == ball
                    told = told or (of_ball and (early[k] or contacts[k].second == ~(arena + w)))
                if not told:
                    found.append((step, ball, ~(arena + w)))
    return np.array(found)[1:]
