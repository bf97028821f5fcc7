"""The balls placed so far, and whether there is room for one more.

Many places are tried at once: most have no room beside the balls placed before, which numpy finds in a grid for each
level of radii; the others are compared one after another with the balls placed since. A level holds radii up to twice
those of the level below, and its cells are as wide as a ball and its largest may be apart: 3 x 3 of them are looked at.
"""

from collections import defaultdict
from typing import Final

import numpy as np

from sandbox.scene.model import Scene
from sandbox.scene.walls import segment_distance
from sandbox.state import Bools, Floats

AROUND: Final = tuple((column, row) for column in (-1, 0, 1) for row in (-1, 0, 1))
ROWS: Final = 2**32  # more than any grid has


class Packing:
    """The balls in the order in which they were placed. place: (n, 2) px; radius: (n,) px."""

    def __init__(self, scene: Scene) -> None:
        self._walls = scene.walls
        self.place = np.empty((0, 2))
        self._radius = np.empty(0)

    def __len__(self) -> int:
        return len(self.place)

    def keep_first(self, count: int) -> None:
        """Keep the first `count` balls and remove those placed later."""
        self.place, self._radius = self.place[:count], self._radius[:count]

    def add(self, place: Floats, radius: float) -> None:
        """Place balls of a radius (px), whether there is room or not. place: (n, 2) px."""
        self.place = np.concatenate([self.place, place])
        self._radius = np.append(self._radius, np.full(len(place), radius))

    def add_some(self, place: Floats, radius: float, wanted: int, missed: int, max_missed: int) -> tuple[int, int]:
        """Place balls of a radius (px) where there is room, in order, until `wanted` are placed. place: (n, 2) px.

        Gives up after `max_missed` places in a row without room; `missed` of them came before the first one here.
        Returns how many places were tried, and how many in a row had no room at the end.
        """
        new, cells, tried, width = list[int](), defaultdict[tuple[int, int], list[complex]](list), 0, 2 * radius
        for k in np.flatnonzero(self.has_room(place, radius)).tolist():
            if len(new) == wanted or missed + k - tried >= max_missed:
                break
            tried, missed = k + 1, missed + k - tried + 1
            x, y = place[k].tolist()
            column, row = int(x // width), int(y // width)
            near = (ball for across, down in AROUND for ball in cells.get((column + across, row + down), ()))
            if all(abs(ball - complex(x, y)) >= width for ball in near):
                cells[column, row].append(complex(x, y))
                new.append(k)
                missed = 0
        if len(new) < wanted:
            rest = min(len(place) - tried, max_missed - missed)
            tried, missed = tried + rest, missed + rest
        self.add(place[new], radius)
        return tried, missed

    def has_room(self, place: Floats, radius: float) -> Bools:
        """Return whether there is room for a ball of a radius (px) at each place: (n, 2) px -> (n,)."""
        free = np.ones(len(place), bool)
        for wall in self._walls:
            free &= segment_distance(place, wall.start, wall.to) >= radius + wall.thickness / 2
        level = np.ceil(np.log2(self._radius))
        for number in np.unique(level):
            self._exclude(place, radius, level == number, free)
        return free

    def _exclude(self, place: Floats, radius: float, level: Bools, free: Bools) -> None:
        """Set `free` to False where a ball would overlap one of a level. level: (balls,)."""
        ball, radii = self.place[level], self._radius[level]
        width = radius + float(radii.max())
        cell = ball // width
        key = cell[:, 0] * ROWS + cell[:, 1]
        order = np.argsort(key)
        key, ball, radii = key[order], ball[order], radii[order]
        for across, down in AROUND:
            tried = np.flatnonzero(free)
            cell = place[tried] // width
            wanted = (cell[:, 0] + across) * ROWS + cell[:, 1] + down
            begin, end = np.searchsorted(key, wanted), np.searchsorted(key, wanted, "right")
            for shift in range(int((end - begin).max(initial=0))):
                has = begin + shift < end
                k, at = begin[has] + shift, tried[has]
                apart = np.hypot(ball[k, 0] - place[at, 0], ball[k, 1] - place[at, 1])
                free[at[apart < radius + radii[k]]] = False
