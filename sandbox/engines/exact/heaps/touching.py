"""Which discs touch each other and walls, and which of them may be at rest."""

import math
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.compiled import column, columns
from sandbox.engines.exact.contact import JAMMED_CONTACTS, SLOW_HOPS
from sandbox.engines.exact.world import STATIC, World, motions, rotations
from sandbox.engines.grid import NONE
from sandbox.quantity import overlaps
from sandbox.scene.walls import ARENA_COUNT
from sandbox.state import Bools, Floats, Integers

TOUCHING_HOPS: Final = 256  # heights of a hop, between discs that count as touching: 16 of the fastest hop
CARRIED_HOPS: Final = 20  # hop speeds, below which a disc that a smooth wall carries may be at rest; rough, it rolls


class Touching(NamedTuple):
    """Contacts between discs, and of discs with walls, in the order of the scene. (k,) each; normal: (k, 2).

    first, second: discs, or ~piece of wall as the second; normal: from first to second; gap: px.
    """

    first: Integers
    second: Integers
    normal: Floats
    gap: Floats

    @property
    def partner(self) -> Integers:
        """The second discs, and 0 instead of walls: (k,)."""
        return np.maximum(self.second, 0)

    def where(self, kept: Bools | Integers) -> "Touching":
        """Return some of the contacts, by a mask or by their numbers."""
        return Touching(self.first[kept], self.second[kept], self.normal[kept], self.gap[kept])

    def within(self, disc: Bools) -> "Touching":
        """Return the contacts of some discs (n,) with each other and with walls."""
        return self.where(disc[self.first] & ((self.second < 0) | disc[self.partner]))

    def groups(self, count: int) -> Integers:
        """Return a number for each disc, (count,), the least of the discs that touch it, directly or through others."""
        group, pairs = np.arange(count), self.second >= 0
        first, second = self.first[pairs], self.second[pairs]
        while (group[first] != group[second]).any():
            lower = np.minimum(group[first], group[second])
            for side in (first, second):
                np.minimum.at(group, group[side], lower)
            group = group[group]
        return group


def find_touching(world: World, m: Any, among: Bools, gap: float) -> Touching:
    """Return the contacts of some discs, (n,), with each other and with walls, up to a gap (px). m: of all discs."""
    radius, ball, disc = column(world.disc, "radius"), column(world.event, "ball"), np.flatnonzero(among)
    filters = np.array(world.filters)[disc] if world.is_filtered else None
    near = overlaps(np.stack([m.x, m.y], axis=1)[None, disc], radius[disc] + gap, filters) if len(disc) else ()
    first, second = np.concatenate([np.empty((2, 0), np.int64), *(disc[[a, b]] for _, a, b in near)], axis=1)
    swap = ball[first] > ball[second]
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    r = np.stack([m.x[second] - m.x[first], m.y[second] - m.y[first]], axis=1)
    distance = np.sqrt((r**2).sum(axis=1))
    pairs = Touching(first, second, _unit(r, distance), distance - radius[first] - radius[second])
    both = [pairs.where(pairs.gap <= gap), _at_walls(world, m, radius, among, gap)]
    contacts = Touching(*map(np.concatenate, zip(*both, strict=True)))
    number = np.where(contacts.second < 0, contacts.second, ball[contacts.partner])
    return contacts.where(np.lexsort((number, ball[contacts.first])))


def _at_walls(world: World, m: Any, radius: Floats, among: Bools, gap: float) -> Touching:
    """Return the contacts of some discs with walls: beside their faces, or with their ends."""
    names = ("x", "y", "tx", "ty", "length", "half_thickness", "wall")
    x, y, tx, ty, length, half_thickness, wall = (column(world.piece, name) for name in names)
    disc = np.flatnonzero(among)
    rx, ry = m.x[disc, None] - x, m.y[disc, None] - y
    off, along = ry * tx - rx * ty, rx * tx + ry * ty
    is_end, is_arena = length == 0, wall < ARENA_COUNT
    distance = np.where(is_end, np.hypot(rx, ry), np.where(is_arena, off, np.abs(off)))
    distance[~is_end & ~is_arena & ~((along >= 0) & (along <= length))] = np.inf
    gaps = distance - (radius[disc, None] + half_thickness)
    k, p = np.nonzero(gaps <= gap)
    side = np.where((off[k, p] < 0) & ~is_arena[p], 1.0, -1.0)
    of_face = np.stack([-side * ty[p], side * tx[p]], axis=1)
    of_end = _unit(-np.stack([rx[k, p], ry[k, p]], axis=1), np.hypot(rx[k, p], ry[k, p]))
    return Touching(disc[k], ~p, np.where(is_end[p, None], of_end, of_face), gaps[k, p])


def _unit(r: Floats, distance: Floats) -> Floats:
    return np.where(distance[:, None] > 0, r / np.where(distance > 0, distance, 1.0)[:, None], (1.0, 0.0))


def find_restless(world: World, now: float, *, is_start: bool) -> tuple[Bools, Touching]:
    """Return the discs that must be examined, with all at rest that they touch, (n,), and their contacts.

    is_start: whether nothing has happened yet; then these are all that are at rest.
    """
    m = motions(world, now)
    restless = _are_restless(world, m, now)
    if is_start:
        restless |= (m.vx == 0) & (m.vy == 0) & (column(world.turn, "spin") == 0)
    slow = world.hop_speed if world.is_rough else CARRIED_HOPS * world.hop_speed
    resting = restless | ((column(world.event, "carrier") != NONE) & (np.hypot(m.vx, m.vy) < slow))
    gap = TOUCHING_HOPS * math.hypot(*world.gravity) * world.hop_time**2 / 8
    touching = find_touching(world, m, resting, gap)
    group = touching.groups(len(restless))
    resting &= np.isin(group, group[restless])
    return resting, touching.within(resting)


def _are_restless(world: World, m: Any, now: float) -> Bools:
    """Return which discs must be examined: those that hop or are jammed though slow, and those that got a load, (n,).

    A disc is slow if it, and its rim, are about as slow as hops are. m: of all discs.
    """
    slow_since, slow_contacts, leans_until = columns(world.body, "slow_since", "slow_contacts", "leans_until")
    rim = np.abs(rotations(world, now)[1]) * column(world.disc, "radius")
    is_slow = np.maximum(np.sqrt(m.vx**2 + m.vy**2), rim) < 2 * SLOW_HOPS * world.hop_speed
    is_jammed = (now - slow_since <= world.hop_time) & (slow_contacts >= JAMMED_CONTACTS)
    is_loaded = (column(world.absorbed, "load_x") != 0) | (column(world.absorbed, "load_y") != 0)
    is_static = column(world.event, "carrier") == STATIC
    return np.where(is_static, is_loaded, is_slow & (is_jammed | (now < leans_until)))
