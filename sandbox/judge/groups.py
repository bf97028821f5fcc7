"""Which balls belong together in a step, and which of these groups did something else than the exact step.

Balls are joined by contacts that the exact step has, and, where one does not fly as it should, by being near. Balls
alone are judged by their flight; a group is computed exactly. All of a block's steps are done in one call.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, entry, kernel
from sandbox.engines.exact.prediction import time_to_piece
from sandbox.engines.exact.world import Motion
from sandbox.engines.laws import NEVER, time_to_touch
from sandbox.judge.free_flight import BALL, fill_ball
from sandbox.judge.law import LAW, law
from sandbox.judge.one_step import MET, Group, Scratch, run_law, scratch_of
from sandbox.judge.thresholds import MAX_EVENTS, NEAR, TIE
from sandbox.judge.together import TOUCH, TOUCHES_PER_BALL, depth_in, room_for_contacts
from sandbox.quantity import pass_through
from sandbox.state import Bools, Floats, Integers, States

MAX_COMPUTED: Final = 256  # balls of a group that is computed at all; a step of more is not judged
FOUND: Final = np.dtype(
    [
        ("step", "i8"),  # row of the state that it leads to
        ("begin", "i8"),  # of its balls in `member`
        ("count", "i8"),
        ("ended", "i8"),  # whether the exact step came to its end
        ("elastic", "f8"),  # kg px²/s², what restitution takes in it
    ]
)


class Flown(NamedTuple):
    """A block of steps as the engine did them, and exactly.

    before, after: the engine's states of (steps, n), with pushes already in the velocities before; exact: what the
    exact step has after, written; dt: (steps,) s; off: (steps, n) whether a ball did not fly as the engine flies;
    floor: px, below which a difference is rounding; piece: PIECE, of the walls.
    """

    before: States
    after: States
    exact: States
    dt: Floats
    off: Bools
    floor: float
    piece: NDArray[np.void]


class Work(NamedTuple):
    """What screening works in, (n,) each.

    Of the groups, by their first ball: whether it ended, elastic, and met contacts.
    """

    order: Integers
    low: Floats
    root: Integers
    touched: Bools
    members: Integers
    ended: Bools
    elastic: Floats
    met: Integers


@kernel
def find_root(root: Integers, i: int) -> int:
    """Return the ball that stands for all that a ball is joined with. root: (n,), another that each is joined with."""
    while root[i] != i:
        i = root[i]
    return i


@kernel
def link(root: Integers, i: int, j: int) -> None:
    """Join two balls, and all that each is joined with."""
    a, b = find_root(root, i), find_root(root, j)
    root[max(a, b)] = min(a, b)


@kernel
def _swept(f: Flown, step: int, i: int, axis: int, gravity: tuple[float, float]) -> tuple[float, float]:
    """Return the range of a ball's centre along an axis in a step, exactly and in the engine."""
    x, v, dt = f.before.position[step, i, axis], f.before.velocity[step, i, axis], f.dt[step]
    end, seen = x + dt * (v + dt * gravity[axis] / 2), f.after.position[step, i, axis]
    sag = abs(gravity[axis]) * dt * dt / 8
    return min(x, end, seen) - sag, max(x, end, seen) + sag


@kernel
def _joined(f: Flown, ball: NDArray[np.void], step: int, i: int, j: int) -> bool:
    """Return whether two balls have a contact in the exact step, or are near and one does not fly as it should."""
    x, v, dt = f.before.position[step], f.before.velocity[step], f.dt[step]
    rx, ry, vx, vy = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], v[j, 0] - v[i, 0], v[j, 1] - v[i, 1]
    reach = ball[i].radius + ball[j].radius
    if time_to_touch(rx, ry, vx, vy, 0.0, 0.0, reach, NEVER) <= dt + TIE:
        return True
    if not (f.off[step, i] or f.off[step, j]):
        return False
    speed = vx * vx + vy * vy
    t = min(max(-(rx * vx + ry * vy) / speed, 0.0), dt) if speed > 0 else 0.0
    nearest = math.hypot(rx + t * vx, ry + t * vy)
    y = f.after.position[step]
    nearest = min(nearest, math.hypot(y[j, 0] - y[i, 0], y[j, 1] - y[i, 1]))
    return bool(nearest < reach + NEAR * min(ball[i].radius, ball[j].radius))


@kernel
def _meets_wall(f: Flown, ball: NDArray[np.void], step: int, i: int, gravity: tuple[float, float]) -> bool:
    """Return whether a ball has a contact with a wall in the exact step, or is near one and flies otherwise."""
    x, v = f.before.position[step, i], f.before.velocity[step, i]
    reach, b = ball[i].radius * (1 + NEAR if f.off[step, i] else 1.0), ball[len(ball) - 1]
    m = Motion(x[0], x[1], v[0], v[1], gravity[0], gravity[1])
    b.x, b.y, b.radius = m.x, m.y, reach
    for p in range(len(f.piece)):
        if f.off[step, i] and depth_in(b, f.piece[p]) > 0:
            return True
        if time_to_piece(m, reach, f.piece[p], False) <= f.dt[step] + TIE:
            return True
    return False


@kernel
def differs(f: Flown, step: int, i: int, radius: float) -> bool:
    """Return whether a ball's state after a step is another than the exact one."""
    off, dt = 0.0, f.dt[step]
    for axis in range(2):
        off = max(off, abs(f.after.position[step, i, axis] - f.exact.position[step, i, axis]))
        off = max(off, abs(f.after.velocity[step, i, axis] - f.exact.velocity[step, i, axis]) * dt)
    return bool(max(off, abs(f.after.spin[step, i] - f.exact.spin[step, i]) * radius * dt) > f.floor)


@kernel
def _compute(f: Flown, ball: NDArray[np.void], law: Record, scratch: Scratch, step: int, w: Work, k: int) -> bool:
    """Compute the exact step of the first k of `members`. Returns whether it came to its end."""
    if k > MAX_COMPUTED:
        return False
    own = ball[len(ball) - k :]
    for a in range(k):
        own[a] = ball[w.members[a]]
    for a in range(k):
        fill_ball(own[a], f.before, step, w.members[a])
    return bool(run_law(Group(own, f.piece, f.dt[step]), law, scratch_of(scratch, k)))


@kernel
def _members(w: Work, root: int) -> int:
    """Collect the balls of a group in `members`. Returns their number."""
    k = 0
    for i in range(root, len(w.root)):
        if w.root[i] == root:
            w.members[k] = i
            k += 1
    return k


@kernel
def _write(f: Flown, scratch: Scratch, w: Work, step: int, k: int, ended: bool) -> None:
    """Write the exact step of the first k of `members`; where it has no end, what the engine has."""
    for a in range(k):
        i, source = w.members[a], scratch.ball[a]
        if ended:
            f.exact.position[step, i, 0], f.exact.position[step, i, 1] = source.x, source.y
            f.exact.velocity[step, i, 0], f.exact.velocity[step, i, 1] = source.vx, source.vy
            f.exact.spin[step, i] = source.spin
        else:
            for axis in range(2):
                f.exact.position[step, i, axis] = f.after.position[step, i, axis]
                f.exact.velocity[step, i, axis] = f.after.velocity[step, i, axis]
            f.exact.spin[step, i] = f.after.spin[step, i]


@kernel
def _meet_later(f: Flown, ball: NDArray[np.void], step: int, i: int, j: int) -> bool:
    """Return whether two balls overlap after the exact steps of their groups, or touch and approach."""
    x, v, dt = f.exact.position[step], f.exact.velocity[step], f.dt[step]
    rx, ry = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
    gap = math.hypot(rx, ry) - ball[i].radius - ball[j].radius
    closing = (v[i, 0] - v[j, 0]) * rx + (v[i, 1] - v[j, 1]) * ry
    return bool(gap < f.floor and closing * dt > f.floor * math.hypot(rx, ry))


@kernel
def _join(
    f: Flown, ball: NDArray[np.void], w: Work, step: int, gravity: tuple[float, float], widest: float, later: bool
) -> bool:
    """Join balls that have a contact, or, later, that meet only as others lead them to. Returns whether any are new."""
    n, new = len(w.root), False
    for a in range(n):
        i = w.order[a]
        reach = (1 + NEAR) * ball[i].radius
        top = _swept(f, step, i, 0, gravity)[1] + reach + widest
        below, above = _swept(f, step, i, 1, gravity)
        for b in range(a + 1, n):
            j = w.order[b]
            if w.low[j] > top:
                break
            low, high = _swept(f, step, j, 1, gravity)
            if low > above + reach + ball[j].radius or high < below - reach - ball[j].radius:
                continue
            if pass_through(ball[i].filter, ball[j].filter):
                continue
            if later:
                is_new = (w.touched[i] or w.touched[j]) and find_root(w.root, i) != find_root(w.root, j)
                is_new = is_new and _meet_later(f, ball, step, i, j)
            else:
                is_new = _joined(f, ball, step, min(i, j), max(i, j))
            if is_new:
                link(w.root, i, j)
                w.touched[i] = w.touched[j] = new = True
    if new:
        for i in range(n):
            if w.touched[i]:
                w.touched[find_root(w.root, i)] = True
    return new


@kernel
def _any_differs(f: Flown, ball: NDArray[np.void], w: Work, step: int, k: int) -> bool:
    """Return whether one of the first k of `members` is not where the exact step has it."""
    for a in range(k):  # noqa: SIM110  # kernels have no generators
        if differs(f, step, w.members[a], ball[w.members[a]].radius):
            return True
    return False


@kernel
def _compute_all(
    f: Flown, ball: NDArray[np.void], law: Record, scratch: Scratch, step: int, w: Work, widest: float
) -> None:
    """Compute the groups of a step, and again those that grow, until none does."""
    n, gravity = len(w.root), (law.gx, law.gy)
    _join(f, ball, w, step, gravity, widest, False)
    grows = True
    while grows:
        for i in range(n):
            if w.root[i] != i:
                w.root[i] = find_root(w.root, i)
        for r in range(n):
            if w.root[r] == r and w.touched[r]:
                k = _members(w, r)
                w.ended[r] = _compute(f, ball, law, scratch, step, w, k)
                w.elastic[r], w.met[r] = scratch.elastic[0], scratch.tally[0]
                _write(f, scratch, w, step, k, w.ended[r])
        grows = _join(f, ball, w, step, gravity, widest, True)


@entry
def screen(
    f: Flown,
    ball: NDArray[np.void],
    laws: NDArray[np.void],
    scratch: Scratch,
    w: Work,
    found: NDArray[np.void],
    member: Integers,
    elastic: Floats,
    contacts: Integers,
) -> int:
    """Compute every group of every step, and note those that the engine has otherwise.

    ball: (n + MAX_COMPUTED,) BALL, of which the last are worked in; laws: (1,) LAW, the exact one; found: (steps n,)
    FOUND and member: (steps n,), the groups noted; elastic: (steps,) kg px²/s², what restitution takes exactly;
    contacts: (1,), those of the exact steps are added. Returns how many groups are noted.
    """
    n, law = len(w.root), laws[0]
    gravity, widest = (law.gx, law.gy), 0.0
    for i in range(n):
        widest = max(widest, ball[i].radius)
    rows, filled = 0, 0
    for step in range(len(f.dt)):
        for i in range(n):
            w.root[i] = i
            w.touched[i] = _meets_wall(f, ball, step, i, gravity)
        _sort(f, w, step, gravity)
        _compute_all(f, ball, law, scratch, step, w, widest)
        for r in range(n):
            if w.root[r] != r or not w.touched[r]:
                continue
            k = _members(w, r)
            if w.ended[r]:
                elastic[step] += w.elastic[r]
                contacts[0] += w.met[r]
                if not _any_differs(f, ball, w, step, k):
                    continue
            _note_group(w, r, step, found[rows], filled, member[filled : filled + k])
            rows += 1
            filled += k
    return rows


@kernel
def _note_group(w: Work, r: int, step: int, group: Record, begin: int, members: Integers) -> None:
    """Note the group of a root, and its members, (k,) written, of which the first is at `begin`."""
    group.step, group.begin, group.count = step, begin, len(members)
    group.ended, group.elastic = w.ended[r], w.elastic[r]
    for a in range(len(members)):
        members[a] = w.members[a]


@kernel
def _sort(f: Flown, w: Work, step: int, gravity: tuple[float, float]) -> None:
    """Sort the balls by where they begin along x. By insertion: few have changed places since a step ago."""
    for i in range(len(w.root)):
        w.low[i] = _swept(f, step, i, 0, gravity)[0]
    for k in range(1, len(w.order)):
        ball, place = w.order[k], k
        while place > 0 and w.low[w.order[place - 1]] > w.low[ball]:
            w.order[place] = w.order[place - 1]
            place -= 1
        w.order[place] = ball


def work_for(n: int) -> Work:
    """Return what screening works in."""
    order, root, members, met = (np.arange(n) for _ in range(4))
    (touched, ended), (low, elastic) = np.empty((2, n), bool), np.empty((2, n))
    return Work(order, low, root, touched, members, ended, elastic, met)


def scratch_for(balls: int) -> Scratch:
    """Return what a step of so many balls works in."""
    touch = np.zeros(TOUCHES_PER_BALL * balls, TOUCH)
    return Scratch(
        np.zeros(balls, BALL),
        np.zeros(MAX_EVENTS, MET),
        np.zeros(2, np.int64),
        touch,
        np.zeros(balls),
        room_for_contacts(),
        np.zeros(1),
        np.array([law((0.0, 0.0))], LAW),
        np.zeros(balls),
        np.zeros(balls, np.int64),
    )
