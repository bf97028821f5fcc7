"""Which discs may be at rest, and which of them touch each other and walls."""

import math
from typing import Final, NamedTuple

import numpy as np

from sandbox.compiled import entry, kernel
from sandbox.engines.exact.contact import is_jammed, is_slow
from sandbox.engines.exact.records import NONE, STATIC
from sandbox.engines.exact.support import normal_to
from sandbox.engines.exact.world import World, meet, motion
from sandbox.scene.walls import ARENA_COUNT
from sandbox.state import Bools, Floats, Integers

TOUCHING_HOPS: Final = 256  # heights of a hop, between discs that count as touching: 16 of the fastest hop
CARRIED_HOPS: Final = 20  # hop speeds, below which a disc that a smooth wall carries may be at rest; rough, it rolls
MAX_TOUCHING: Final = 8  # contacts per disc: at most 3 with others (the contacts are a planar graph), and some of walls


class Touching(NamedTuple):
    """Contacts between discs that may be at rest, and of these with walls. (k,) each; normal: (k, 2).

    first, second: discs, or ~piece of wall as the second; normal: from first to second.
    """

    first: Integers
    second: Integers
    normal: Floats

    def within(self, disc: Bools) -> "Touching":
        """Return the contacts of some discs (n,) with each other and with walls."""
        kept = disc[self.first] & np.where(self.second < 0, True, disc[np.maximum(self.second, 0)])
        return Touching(self.first[kept], self.second[kept], self.normal[kept])


def find_restless(world: World, now: float, *, is_start: bool) -> tuple[Bools, Touching]:
    """Return the discs that must be examined, with all at rest that they touch, (n,), and their contacts.

    is_start: whether nothing has happened yet; then these are all that are at rest and touch something.
    """
    n = len(world.disc)
    resting, restless = np.empty(n, bool), np.empty(n, bool)
    _find_resting(world, now, is_start, resting, restless)
    capacity = MAX_TOUCHING * n
    first, second, normal = np.empty(capacity, np.int64), np.empty(capacity, np.int64), np.empty((capacity, 2))
    gap = TOUCHING_HOPS * math.hypot(*world.gravity) * world.hop_time**2 / 8
    count = _find_touching(world, now, resting, gap, first, second, normal)
    touching = Touching(first[:count], second[:count], normal[:count])
    group = groups(touching, n)
    wanted = np.zeros(n, bool)
    wanted[group[restless]] = True
    resting &= wanted[group]
    if is_start:
        touches = np.zeros(n, bool)
        touches[touching.first] = touches[touching.second[touching.second >= 0]] = True
        resting &= touches
    return resting, touching.within(resting)


def groups(touching: Touching, count: int) -> Integers:
    """Return a number for each disc, (count,), which is the same for discs that touch."""
    group = np.arange(count)
    _join(touching.first, touching.second, group)
    return group


@kernel
def _is_still(world: World, i: int, now: float) -> bool:
    """Return whether disc i neither moves nor turns."""
    m = motion(world, i, now)
    return m.vx == 0 and m.vy == 0 and (not world.is_rough or world.turn[i].spin == 0)


@kernel
def is_restless(world: World, i: int, now: float) -> bool:
    """Return whether disc i must be examined: it hops though it is slow, is jammed, or carries more than its weight."""
    if world.event[i].carrier == STATIC:
        return world.rest.absorbed[i].load_x != 0 or world.rest.absorbed[i].load_y != 0
    return is_slow(world, i, now) and (is_jammed(world, i, now) or now < world.body[i].leans_until)


@entry
def _find_resting(world: World, now: float, is_start: bool, resting: Bools, restless: Bools) -> None:
    """Find the discs that may be at rest, and those of them that must be examined. resting, restless: (n,), to fill."""
    for i in range(len(world.disc)):
        m = motion(world, i, now)
        restless[i] = is_restless(world, i, now) or (is_start and _is_still(world, i, now))
        slow = world.hop_speed if world.is_rough else CARRIED_HOPS * world.hop_speed
        resting[i] = restless[i] or (world.event[i].carrier != NONE and math.hypot(m.vx, m.vy) < slow)


@kernel
def gap_to_piece(world: World, i: int, p: int, x: float, y: float) -> float:
    """Return the gap (px) between disc i at a place and a piece of wall; infinite if it is not beside the face."""
    disc, piece = world.disc[i], world.piece[p]
    rx, ry = x - piece.x, y - piece.y
    reach = disc.radius + piece.half_thickness
    if piece.length == 0:
        return math.hypot(rx, ry) - reach
    off, along = ry * piece.tx - rx * piece.ty, rx * piece.tx + ry * piece.ty
    if piece.wall < ARENA_COUNT:
        return off - reach
    return abs(off) - reach if 0 <= along <= piece.length else math.inf


@entry
def _find_touching(
    world: World, now: float, resting: Bools, gap: float, first: Integers, second: Integers, normal: Floats
) -> int:
    """Find the contacts of resting discs, at most a gap (px) apart, as in `Touching`. Returns their number."""
    count = 0
    for i in range(len(world.disc)):
        if not resting[i]:
            continue
        m, event, grid = motion(world, i, now), world.event[i], world.grid
        for row in range(-1, 2):
            for cell in range(event.cell + row * grid.stride - 1, event.cell + row * grid.stride + 2):
                j = np.int64(grid.cell[cell].first)
                while j >= 0:
                    o = motion(world, j, now)
                    rx, ry = o.x - m.x, o.y - m.y
                    reach = world.disc[i].radius + world.disc[j].radius
                    is_near = resting[j] and event.ball < world.event[j].ball and rx * rx + ry * ry < (reach + gap) ** 2
                    if is_near and meet(world, i, j) and (rx != 0 or ry != 0) and count < len(first):
                        distance = math.sqrt(rx * rx + ry * ry)
                        first[count], second[count] = i, j
                        normal[count, 0], normal[count, 1] = rx / distance, ry / distance
                        count += 1
                    j = np.int64(world.disc[j].next)
        for k in range(grid.cell[event.cell].begin, grid.cell[event.cell + 1].begin):
            p = grid.piece[k]
            if gap_to_piece(world, i, p, m.x, m.y) < gap and count < len(first):
                first[count], second[count] = i, ~p
                normal[count, 0], normal[count, 1], _ = normal_to(m, world.piece[p])
                count += 1
    return count


@entry
def _join(first: Integers, second: Integers, group: Integers) -> None:
    """Give discs that touch, and those that they touch, one number: the least of theirs. group: (n,), their numbers."""
    for k in range(len(first)):
        if second[k] < 0:
            continue
        a, b = first[k], second[k]
        while group[a] != a:
            a = group[a]
        while group[b] != b:
            b = group[b]
        group[max(a, b)] = min(a, b)
    for i in range(len(group)):
        group[i] = group[group[i]]  # whose own is final, as it is not larger than i
