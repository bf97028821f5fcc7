"""The contacts of all steps at once: which bodies may touch in a step, and when they do on the engine's own flight."""

from typing import Final

import numpy as np

from sandbox.judge.run import NEVER, OUTWARD, Contacts, Run, Vectors, cross, dot
from sandbox.quantity import pass_through
from sandbox.scene.walls import ARENA_COUNT
from sandbox.state import Floats, Integers

BRUTE_FORCE: Final = 1_000_000  # pairs of the fastest balls that are compared with all of their step
NEWTON: Final = 8  # steps of Newton's method, which converge to rounding


def way_of(run: Run) -> Floats:
    """Return how far each ball may move in each step: (steps, n) px."""
    dt = run.dt[:, None]
    fastest = np.maximum(np.abs(run.v0), np.abs(run.v[1:])) * dt
    return np.maximum(fastest, np.abs(run.x[1:] - run.x[:-1])) + abs(run.g) * dt**2 + run.floor


def near_pairs(run: Run, step: Integers, ball: Integers, way: Floats, margin: float = 0.0) -> Contacts:
    """Return the contacts of some balls in steps, (k,) each, that may come within a margin of each other, px.

    Broad phase: they are sorted by (step, cell), and each is compared with those in its cell, the next and the next
    row's three. A cell is as wide as the reach of two balls; the few that fly further are compared with all others.
    """
    meets = run.meets[ball]
    step, ball, way = step[meets], ball[meets], way[meets]
    if not len(ball):
        return Contacts(*[np.empty(0, np.int64)] * 3)
    x, r = run.x[step, ball], run.r[ball]
    most = float(np.quantile(way, max(0.99, 1 - BRUTE_FORCE / (run.n * len(way)))))
    cell = 2 * (float(r.max()) + most) + margin
    column, row = (np.floor(part / cell).astype(np.int64) for part in (x.real, x.imag))
    column, row = column - column.min() + 1, row - row.min() + 1
    across, down = int(column.max()) + 2, int(row.max()) + 2
    key = (step * down + row) * across + column
    order = np.argsort(key)
    key, step, ball, x, fast = key[order], step[order], ball[order], x[order], np.flatnonzero(way[order] > most)
    reach = (way + r + margin / 2)[order]
    beside, a = _ranges(np.arange(1, len(key) + 1), np.searchsorted(key, key + 1, "right"))
    below, c = _ranges(np.searchsorted(key, key + across - 1, "left"), np.searchsorted(key, key + across + 1, "right"))
    of_step, d = _ranges(np.searchsorted(step, step[fast], "left"), np.searchsorted(step, step[fast], "right"))
    a, b = np.concatenate([a, c, fast[d]]), np.concatenate([beside, below, of_step])
    near = np.abs(x[a] - x[b]) <= reach[a] + reach[b]
    a, b = a[near], b[near]
    keep = (step[a] == step[b]) & (ball[a] != ball[b])
    a, b = a[keep], b[keep]
    i, j = np.minimum(ball[a], ball[b]), np.maximum(ball[a], ball[b])
    _, once = np.unique((step[a] * run.n + i) * run.n + j, return_index=True)  # two that are fast are found twice
    found = Contacts(step[a], i, j).part(once)
    filters = run.scene.bodies.filters.T
    return found.part(~np.asarray(pass_through(filters[:, found.i], filters[:, found.j])))


def _ranges(begin: Integers, end: Integers) -> tuple[Integers, Integers]:
    """Return the numbers of some ranges one after another, and which range each is of."""
    size = np.maximum(end - begin, 0)
    of = np.repeat(np.arange(len(size)), size)
    return np.arange(len(of)) + np.repeat(begin + size - np.cumsum(size), size), of


def near_walls(run: Run, step: Integers, ball: Integers, way: Floats, margin: float = 0.0) -> Contacts:
    """Return the contacts of some balls in steps, (k,) each, with walls within their way and a margin, px."""
    found, limit = [Contacts(*[np.empty(0, np.int64)] * 3)], way + run.r[ball] + margin
    at = run.x[step, ball]
    for wall in range(run.walls):
        if wall < ARENA_COUNT:
            near = run.face[wall] - dot(at, OUTWARD[wall]) <= limit
        else:  # within a box round it, at first
            off, half = at - (run.start[wall] + run.end[wall]) / 2, (run.end[wall] - run.start[wall]) / 2
            reach = limit + run.half[wall]
            near = (np.abs(off.real) <= reach + abs(half.real)) & (np.abs(off.imag) <= reach + abs(half.imag))
        rows = np.flatnonzero(near)
        c = Contacts(step[rows], ball[rows], np.full(len(rows), ~wall))
        found.append(c.part(run.depth(c, run.x) >= -way[rows] - margin))
    return Contacts.joined(*found)


def due(run: Run, c: Contacts) -> Floats:
    """Return when bodies meet on the engine's own flight: s from the step's start, NEVER if not within it."""
    dt, ball = run.flown[c.k], np.stack([c.i, c.other])
    t = until(run, c.i, c.j, run.x[c.k, ball], run.u[c.k, ball], dt)
    t[t > dt * (1 + 1e-9)] = NEVER
    return t


def until(run: Run, i: Integers, j: Integers, x: Vectors, v: Vectors, limit: Floats) -> Floats:
    """Return when balls i and bodies j meet, s, NEVER if not; x, v: (2, k) px, px/s; limit: s, about which it matters.

    Both fall, so that two balls meet as if neither did.
    """
    t, wall, pull = np.full(len(i), NEVER), ~j, np.asarray(run.pull)
    pairs, faces, inner = j >= 0, (j < 0) & (wall < ARENA_COUNT), wall >= ARENA_COUNT
    t[pairs] = to_touch((x[1] - x[0])[pairs], (v[0] - v[1])[pairs], (run.r[i] + run.r[np.maximum(j, 0)])[pairs])
    n = OUTWARD[wall[faces]]
    gap = run.face[wall[faces]] - dot(x[0, faces], n) - run.r[i[faces]]
    t[faces] = to_close(gap, -dot(v[0, faces], n), -dot(pull, n))
    if not inner.any():
        return t
    w, x, v, dt = wall[inner], x[0, inner], v[0, inner], limit[inner]
    reach, along = run.r[i[inner]] + run.half[w], run.along[w]
    off, v_off, g_off = cross(along, x - run.start[w]), cross(along, v), cross(along, pull)
    side = np.where(off >= 0, 1.0, -1.0)
    face = to_close(side * off - reach, side * v_off, side * g_off)
    s = np.where(np.isfinite(face), face, 0.0)
    part = dot(along, x + s * (v + s * run.pull / 2) - run.start[w])
    face = np.where((part >= 0) & (part <= run.length[w]), face, NEVER)
    at_ends = to_touch(np.stack([run.start[w], run.end[w]]) - x, v, reach, run.pull, dt)
    t[inner] = np.minimum(face, at_ends.min(axis=0))
    return t


def to_close(gap: Floats, v: Floats, a: Floats) -> Floats:
    """Return when gaps (px) that change by v t + a t²/2 are 0 and shrinking, s."""
    with np.errstate(all="ignore"):
        root = np.sqrt(v * v - 2 * a * gap)
        ahead = np.where((v < 0) | (a < 0), 2 * gap / (-v + root), NEVER)
        inside = np.where((v < 0) | ((v == 0) & (a < 0)), 0.0, NEVER)
        back = np.where(a < 0, (v + np.sqrt(np.maximum(v * v - 2 * a * gap, 0))) / -a, NEVER)
        t = np.where(v <= 0, np.where(gap > 0, ahead, inside), back)
        found: Floats = np.where(np.isfinite(t), np.maximum(t, 0), NEVER)
    return found


def to_touch(r: Vectors, u: Vectors, reach: Floats, g: complex = 0j, limit: Floats | float = NEVER) -> Floats:
    """Return when centres r apart (px) that approach by u (px/s) come within reach, s.

    g: px/s², of the first alone, as at the end of a wall. The time is then Newton's method's, from a straight flight's
    or, where that passes, from its nearest point.
    """
    b, c = dot(r, u), np.abs(r) ** 2 - reach**2
    with np.errstate(all="ignore"):
        t = np.where(b > 0, np.maximum(c, 0) / (b + np.sqrt(b * b - np.abs(u) ** 2 * c)), NEVER)
        t = np.where(np.isfinite(t), t, NEVER)
        if g:
            t = np.where(np.isfinite(t), t, np.clip(b / np.abs(u) ** 2, 0, limit))
            for _ in range(NEWTON):
                d = r - u * t - g * t * t / 2
                t = t + (np.abs(d) ** 2 - reach**2) / (2 * dot(d, u + g * t))
            d = r - u * t - g * t * t / 2
            good = (np.abs(np.abs(d) - reach) < 1e-9 * reach) & (t >= -1e-12) & (dot(d, u + g * t) > 0)
            t = np.where((c <= 0) & (b > 0), 0.0, np.where(good, np.maximum(t, 0), NEVER))
    return t


def components(count: int, a: Integers, b: Integers) -> Integers:
    """Return the least number of each node's component. a, b: the nodes of edges."""
    label = np.arange(count)
    while True:
        low, before = np.minimum(label[a], label[b]), label.copy()
        np.minimum.at(label, a, low)
        np.minimum.at(label, b, low)
        label = label[label]
        if (label == before).all():
            return label


def keys_of(c: Contacts, run: Run) -> Integers:
    """Return a number for each contact; that of the same bodies one step later is 1 more."""
    bodies = run.n + run.walls
    keys: Integers = (c.i * bodies + np.where(c.pair, c.j, run.n + ~c.j)) * (run.steps + 1) + c.k
    return keys
