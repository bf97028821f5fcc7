"""What explains the steps of groups: known laws, overlaps pushed apart, and impulses along contacts.

A group falls into parts, of balls that touch each other. Of each part, first the places are explained, then the
velocities: by pushes along the normals of what overlaps, and by the contacts that a solver of impulses gets once these
are gone, all of them solved together, or by impulses along them that such a solver leaves before it has converged.
All of a block's groups are done in one call.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, entry, kernel
from sandbox.engines.exact.support import normal_to, unit
from sandbox.judge.causes import NEGLIGIBLE
from sandbox.judge.free_flight import BALL, fill_ball, fly, kept_in
from sandbox.judge.groups import MAX_COMPUTED, Flown, differs, find_root, link
from sandbox.judge.law import Slows, When
from sandbox.judge.one_step import Group, Scratch, run_law, scratch_of
from sandbox.judge.thresholds import LEFT_OVER, PULLS
from sandbox.judge.together import (
    closing_speed,
    could_explain_anything,
    depth_in,
    find_touches,
    fit_freely,
    fit_impulses,
    largest_speed,
    solve_together,
    square_of,
)
from sandbox.quantity import pass_through
from sandbox.state import Floats, Integers

UNCOMPUTED: Final = -1  # the exact step is not known
UNEXPLAINED: Final = 0
EXACT: Final = 1
BY_LAW: Final = 2
TOGETHER: Final = 3  # contacts found late, and solved together
COMPRESSIVE: Final = 4  # impulses that push, along contacts, but are not those of the solution
PULLING: Final = 5  # impulses along contacts, of which some pull
BY_FLIGHT: Final = 6  # the engine's way to fly
LEANING: Final = 7  # balls that lean on each other, of which the exact step is not known: nothing is wrong
EXACT_LAWS: Final = 10  # laws that are exact: with contacts at a step's ends or not, and ties in either order
LEAN_LEFT_OVER: Final = 1e-3  # of a change of velocity, that a slowly converging fit to many contacts may leave
MAX_TRIED: Final = 24  # balls of a part of which more than the exact steps are computed from contact to contact
TINY: Final = 1e-12  # px, of a ball that is not pushed
PUSHED_WAYS: Final = 3  # times at which overlaps are pushed apart, see `_unpush`


class Part(NamedTuple):
    """What explains the step of a part of a group."""

    step: int  # row of the state that it leads to
    begin: int  # of its balls in `member`
    size: int
    kind: int
    fits: int  # bit k: known law k leaves nothing over
    pushed: float  # px, the largest push, or 0
    overlap: float  # px, of that contact
    way: int  # of pushing, see `_unpush`
    pushed_first: int  # ball
    pushed_second: int  # ball, or ~wall
    first: int  # of the deepest contact, or of the worst
    second: int
    depth: float  # px
    closing: float  # px/s, before the contacts
    late: float  # s since the two touched; infinite if they part
    least: float  # px/s, the least of all contacts' closing speeds
    after: float  # px/s, at which it still approaches
    leans: int  # whether the exact step is not known
    moved: int  # whether the law's velocities are others than the exact ones
    base: int  # of the ways to fly, the one that explains it
    elastic: float  # kg px²/s², what restitution does in the exact step


PART: Final = np.dtype([(name, np.dtype(kind)) for name, kind in Part.__annotations__.items()])


class Desk(NamedTuple):
    """What explaining works in. Each is of as many balls as a scene has.

    ball: of a group; mine: of a part; start: of it without pushes; work: of what is left over; after: (n, 5), what the
    engine has of a part; end: of it without pushes; exact: (n, 5); shift: (n, 2) px, pushes; solved: (n, 3), velocities
    and spins by contacts solved together; gap: (n,) px; label: (n,), of parts; order, sorted:
    (n,), for dividing.
    """

    ball: NDArray[np.void]
    mine: NDArray[np.void]
    start: NDArray[np.void]
    work: NDArray[np.void]
    after: Floats
    end: Floats
    exact: Floats
    shift: Floats
    solved: Floats
    gap: Floats
    label: Integers
    order: Integers
    sorted: Integers


class Remains(NamedTuple):
    """What is written for the balls of explained parts, (steps, n, 2), (steps, n, 3) and (steps, n, 5).

    shift: px, by which they are pushed; solved: px/s and rad/s, the velocity and spin of contacts solved together;
    exact: x, y, vx, vy and spin of the exact step.
    """

    shift: Floats
    solved: Floats
    exact: Floats


def desk_for(n: int) -> Desk:
    """Return what explaining works in."""
    ball, mine, start, work = (np.zeros(n, BALL) for _ in range(4))
    after, end, exact, shift, solved = (np.zeros((n, width)) for width in (5, 5, 5, 2, 3))
    label, order, in_order = (np.zeros(n, np.int64) for _ in range(3))
    return Desk(ball, mine, start, work, after, end, exact, shift, solved, np.zeros(n), label, order, in_order)


@kernel
def _left_of_velocities(ball: NDArray[Any], after: Floats, dt: float) -> float:
    """Return what is over between velocities and spins and what they should be, px in a step. after: (k, 5)."""
    left = 0.0
    for i in range(len(ball)):
        b = ball[i]
        left = max(left, abs(b.vx - after[i, 2]) * dt, abs(b.vy - after[i, 3]) * dt)
        left = max(left, abs(b.spin - after[i, 4]) * b.radius * dt)
    return left


@kernel
def _left(ball: NDArray[Any], after: Floats, dt: float) -> float:
    """Return what is over between balls and what they should be, px."""
    left = _left_of_velocities(ball, after, dt)
    for i in range(len(ball)):
        left = max(left, abs(ball[i].x - after[i, 0]), abs(ball[i].y - after[i, 1]))
    return float(left)


@kernel
def _set_gaps(desk: Desk, group: Group, law: Record, floor: float) -> None:
    """Set how far balls may be from where they would be in free flight at any time in a step: `gap`, px."""
    for i in range(len(group.ball)):
        b, x = group.ball[i], desk.after[i]
        change = abs(x[2] - b.vx - law.gx * group.dt) + abs(x[3] - b.vy - law.gy * group.dt)
        desk.gap[i] = change * group.dt + floor


@kernel
def _divide(desk: Desk, group: Group, floor: float, leans: bool) -> None:
    """Label the parts of a group: balls that overlap before a step or after it, or would meet in free flight.

    leans: or may have met, as they have changed their velocities.
    """
    ball, k = group.ball, len(group.ball)
    for i in range(k):
        desk.label[i] = i
    for i in range(k):
        for j in range(i + 1, k):
            rx, ry, vx, vy = (
                ball[j].x - ball[i].x,
                ball[j].y - ball[i].y,
                ball[j].vx - ball[i].vx,
                ball[j].vy - ball[i].vy,
            )
            speed, reach = vx * vx + vy * vy, ball[i].radius + ball[j].radius + floor
            t = min(max(-(rx * vx + ry * vy) / speed, 0.0), group.dt) if speed > 0 else 0.0
            before = min(math.hypot(rx, ry), math.hypot(rx + t * vx, ry + t * vy))
            after = math.hypot(desk.after[j, 0] - desk.after[i, 0], desk.after[j, 1] - desk.after[i, 1])
            reach += desk.gap[i] + desk.gap[j] if leans else 0.0
            if min(before, after) < reach and not pass_through(ball[i].filter, ball[j].filter):
                link(desk.label, i, j)
    for i in range(k):
        desk.label[i] = find_root(desk.label, i)


@kernel
def _smallest(group: Group) -> float:
    """Return the smallest radius, px."""
    smallest = math.inf
    for i in range(len(group.ball)):
        smallest = min(smallest, group.ball[i].radius)
    return smallest


@kernel
def _leaves(group: Group, law: Record, scratch: Scratch, end: Floats) -> float:
    """Return what is over of some ends (k, 5) when a law has done its step, px; infinite if that has no end."""
    s, k = scratch, len(group.ball)
    ended = run_law(group, law, scratch_of(s, k))
    return _left(s.ball[:k], end, group.dt) if ended else math.inf


@kernel
def _try_laws(
    desk: Desk,
    group: Group,
    end: Floats,
    laws: NDArray[Any],
    bases: int,
    scratch: Scratch,
    part: Record,
    floor: float,
    first: bool,
) -> int:
    """Try the exact step, flight and known laws, of which all count that leave nothing over. Returns the kind.

    end: (k, 5), what the laws should come to; first: whether this is the step as it was: the exact one is written.
    """
    k, kind, enough = len(group.ball), UNEXPLAINED, 0.0
    part.fits = 0
    if k > MAX_COMPUTED:
        return UNCOMPUTED
    for number in range(len(laws)):
        law, is_exact = laws[number], number < EXACT_LAWS
        if k > MAX_TRIED and number >= 2 and law.when == When.IN_TIME:
            continue
        left = _leaves(group, law, scratch, end)
        if number == 0:
            if left == math.inf:
                return UNCOMPUTED
            enough = max(2 * floor, LEFT_OVER * left)
            if first:
                part.elastic = scratch.elastic[0]
                _keep(scratch.ball[:k], desk.exact)
        if is_exact and left <= max(3 * floor, NEGLIGIBLE * _smallest(group)):
            part.elastic = scratch.elastic[0]
            return EXACT
        if is_exact or left > enough or (law.when != When.IN_TIME and scratch.tally[0] == 0):
            continue
        if number < EXACT_LAWS + bases:
            part.base = number - EXACT_LAWS
            return BY_FLIGHT
        part.fits |= 1 << (number - EXACT_LAWS - bases)
        if kind == UNEXPLAINED:
            kind = BY_LAW
            _note_contact(scratch, part)
            part.moved = 1 if _left_of_velocities(scratch.ball[:k], desk.exact, group.dt) > enough else 0
    return kind


@kernel
def _keep(ball: NDArray[Any], state: Floats) -> None:
    """Write what some balls do: (k, 5)."""
    for i in range(len(ball)):
        b = ball[i]
        state[i, 0], state[i, 1], state[i, 2], state[i, 3], state[i, 4] = b.x, b.y, b.vx, b.vy, b.spin


@kernel
def _note_contact(scratch: Scratch, part: Record) -> None:
    """Note the first contact of a law's step, and how fast that of all contacts closes that closes least."""
    part.depth = part.closing = part.late = 0.0
    part.least = math.inf
    for c in range(min(scratch.tally[0], len(scratch.met))):
        m = scratch.met[c]
        if c == 0 or m.depth > part.depth:
            part.first, part.second, part.depth, part.closing, part.late = m.first, m.second, m.depth, m.closing, m.late
        part.least = min(part.least, m.closing)


@kernel
def _number(group: Group, j: int) -> int:
    return int(group.ball[j].number) if j >= 0 else int(~group.piece[~j].wall)


@kernel
def _shift_of(desk: Desk, group: Group, law: Record, how: int, shift: Floats) -> float:
    """Write how far each ball is from where its move leads, (k, 2) px, and leave it there in `work`.

    Returns the largest.
    """
    dt, work, largest = group.dt, desk.work, 0.0
    for i in range(len(group.ball)):
        work[i] = group.ball[i]
        fly(law, work[i], dt)
        if how == 2:
            work[i].x = group.ball[i].x + dt * desk.after[i, 2]
            work[i].y = group.ball[i].y + dt * desk.after[i, 3]
        shift[i, 0], shift[i, 1] = desk.after[i, 0] - work[i].x, desk.after[i, 1] - work[i].y
        largest = max(largest, abs(shift[i, 0]), abs(shift[i, 1]))
    return float(largest)


@kernel
def _is_explained(work: NDArray[Any], touch: NDArray[Any], enough: float) -> bool:
    """Return whether nothing is left over of places, and no contact pulls."""
    fits = largest_speed(work) <= enough
    for c in range(len(touch)):
        fits = fits and touch[c].impulse * touch[c].per_mass >= -enough
    return bool(fits)


@kernel
def _unpush(
    desk: Desk,
    group: Group,
    law: Record,
    scratch: Scratch,
    way: int,
    allowed: bool,
    shift: Floats,
    part: Record,
    floor: float,
) -> int:
    """Explain places by pushes along the normals of what overlaps, all of which part it.

    way: 0: of what overlaps before the step, before its contacts are found; 1: of what overlaps after its move; 2: of
    what overlaps before it, after a move at the velocity that contacts leave; 3 to 5: likewise, half each; 6 to 8:
    likewise, of two balls, each by any share.
    allowed: whether there may be pushes; shift: (k, 2) px, written. Returns 0 if that fails, 1 if nothing is pushed,
    2 if something is.
    """
    k, work, how = len(group.ball), desk.work, way % PUSHED_WAYS
    largest = _shift_of(desk, group, law, how, shift)
    if largest <= 2 * floor:
        shift[:] = 0.0
        return 1
    if not allowed:
        return 0
    found = find_touches(work[:k] if how == 1 else group.ball, group.piece, scratch.gap, scratch.touch, 0)
    if found == 0 or found > len(scratch.touch):
        return 0
    touch, enough = scratch.touch[:found], max(2 * floor, LEFT_OVER * largest)
    for only_pushing in (False, True):
        _begin_pushes(work[:k], touch, shift, way // PUSHED_WAYS)
        if only_pushing:
            fit_impulses(work[:k], touch, True, enough)
        else:
            fit_freely(work[:k], touch)
        if _is_explained(work[:k], touch, enough):
            return int(_note_push(group, touch, shift, way, enough, part))
    return 0


@kernel
def _begin_pushes(work: NDArray[Any], touch: NDArray[Any], shift: Floats, shares: int) -> None:
    """Let balls have their shifts for velocities, and contacts no friction.

    shares: 0: heavy balls are pushed less; 1: all alike; 2: as they are shifted.
    """
    for i in range(len(work)):
        work[i].vx, work[i].vy, work[i].spin = shift[i, 0], shift[i, 1], 0.0
        if shares > 0:
            work[i].mass = 1.0 if shares == 1 else 1 / max(math.hypot(shift[i, 0], shift[i, 1]), TINY)
    for c in range(len(touch)):
        t = touch[c]
        t.mu = 0.0
        if shares > 0:
            t.per_mass = 1 / work[t.first].mass + (1 / work[t.second].mass if t.second >= 0 else 0.0)


@kernel
def _note_push(group: Group, touch: NDArray[Any], shift: Floats, way: int, enough: float, part: Record) -> int:
    """Note the contact that is pushed apart furthest. Returns 2, or 0 if that is by more than anything overlaps."""
    part.pushed = deepest = 0.0
    for c in range(len(touch)):
        deepest = max(deepest, touch[c].depth)
    for c in range(len(touch)):
        t = touch[c]
        if t.impulse * t.per_mass <= enough:
            continue
        apart = -(shift[t.first, 0] * t.nx + shift[t.first, 1] * t.ny)
        if t.second >= 0:
            apart += shift[t.second, 0] * t.nx + shift[t.second, 1] * t.ny
        if apart > (2 if t.second >= 0 else 1) * deepest + enough:
            return 0
        if apart > part.pushed:
            part.pushed, part.overlap, part.way = apart, t.depth, way
            part.pushed_first, part.pushed_second = _number(group, t.first), _number(group, t.second)
    return 2 if part.pushed > 0 else 0


@kernel
def _solve(desk: Desk, group: Group, law: Record, scratch: Scratch, found: int, rebound: bool, solved: Floats) -> float:
    """Solve the contacts found of a part together: solved: (k, 3), written. Returns what is over, px."""
    k, dt, work = len(group.ball), group.dt, desk.work
    kept = kept_in(law, dt) if law.slows_first == Slows.AFTER_MOVE and rebound else 1.0
    for i in range(k):
        work[i] = group.ball[i]
        fly(law, work[i], dt)
    fall_x, fall_y = (law.gx * dt, law.gy * dt) if rebound else (0.0, 0.0)
    solve_together(work[:k], scratch.touch[:found], fall_x, fall_y, kept, scratch.room)
    for i in range(k):
        solved[i, 0], solved[i, 1], solved[i, 2] = work[i].vx, work[i].vy, work[i].spin
    return float(_left_of_velocities(work[:k], desk.end, dt))


@kernel
def _set_changes(desk: Desk, group: Group, law: Record) -> None:
    """Set `work` to how the contacts of a part have changed velocities and spins."""
    for i in range(len(group.ball)):
        desk.work[i] = group.ball[i]
        b, end = desk.work[i], desk.end[i]
        fly(law, b, group.dt)
        b.vx, b.vy, b.spin = end[2] - b.vx, end[3] - b.vy, end[4] - b.spin


@kernel
def _fit(desk: Desk, group: Group, law: Record, touch: NDArray[Any], floor: float) -> int:
    """Explain the velocities of a part by impulses along contacts. Returns the kind."""
    k, work = len(group.ball), desk.work
    _set_changes(desk, group, law)
    largest, pushes = largest_speed(work[:k]), True
    enough = max(2 * floor / group.dt, LEFT_OVER * largest)
    fit_freely(work[:k], touch)
    if largest_speed(work[:k]) > enough:
        return UNEXPLAINED
    for c in range(len(touch)):
        t = touch[c]
        beyond = max(-t.impulse, (abs(t.tangential) - t.mu * max(0.0, t.impulse)) if t.mu > 0 else 0.0)
        pushes = pushes and beyond * t.per_mass <= enough
    if pushes:
        return COMPRESSIVE
    _set_changes(desk, group, law)  # contacts that are more than what balls can do may push otherwise
    fit_impulses(work[:k], touch, True, enough)
    return PULLING if largest_speed(work[:k]) > max(enough, PULLS * largest) else COMPRESSIVE


@kernel
def _off_exact(desk: Desk, group: Group) -> float:
    """Return how far velocities are from the exact ones, px in a step."""
    off, dt = 0.0, group.dt
    for i in range(len(group.ball)):
        x, y = desk.exact[i], desk.end[i]
        off = max(off, abs(x[2] - y[2]) * dt, abs(x[3] - y[3]) * dt, abs(x[4] - y[4]) * dt * group.ball[i].radius)
    return off


@kernel
def _shows(ball: NDArray[Any], touch: NDArray[Any]) -> bool:
    """Return whether impulses of several contacts could not explain anything, so that it means something if they do."""
    rough = 0
    for c in range(len(touch)):
        rough = max(rough, 1 if touch[c].mu > 0 else 0)
    if len(touch) < 2 or len(touch) * (1 + rough) < len(ball) * (2 + rough):
        return len(touch) >= 2
    return not could_explain_anything(ball, touch)


@kernel
def _together(
    desk: Desk, group: Group, law: Record, scratch: Scratch, way: int, solved: Floats, part: Record, floor: float
) -> int:
    """Explain the velocities of a part by its contacts. Returns its kind."""
    k, dt, work = len(group.ball), group.dt, desk.work
    for i in range(k):
        work[i] = group.ball[i]
        if way % PUSHED_WAYS != 2:
            work[i].x, work[i].y = desk.end[i, 0], desk.end[i, 1]
    found = find_touches(work[:k], group.piece, scratch.gap, scratch.touch, 0)
    if found > len(scratch.touch):
        return UNEXPLAINED
    of_exact = 0.0 if part.leans == 1 else _off_exact(desk, group)
    enough = max(2 * floor, LEFT_OVER * of_exact)
    best, rebounds = math.inf, True
    for turn in range(3):  # the last, to have again what leaves less over
        rebound = turn == 0 or (turn == 2 and rebounds)
        left = _solve(desk, group, law, scratch, found, rebound, solved)
        if left < best:
            best, rebounds = left, rebound
        if best <= enough or (turn == 1 and not rebounds):
            break
    if found == 0:
        return BY_FLIGHT if best <= enough and _flies_otherwise(group, law, work, floor) else UNEXPLAINED
    if best <= enough:
        resolved = _note_deepest(group, scratch.touch[:found], part, floor / dt)
        return TOGETHER if resolved or part.leans == 1 else UNEXPLAINED
    approach = _note_worst(desk, group, scratch.touch[:found], part)
    kind = _fit(desk, group, law, scratch.touch[:found], floor)
    if (part.leans == 0 or kind == PULLING) and not _shows(work[:k], scratch.touch[:found]):
        return UNEXPLAINED
    if part.leans == 1 and kind == COMPRESSIVE and approach * dt <= 2 * floor:
        kind = LEANING if _keeps_energy(group, law, desk.end, part) else kind
    return int(kind)


@kernel
def _note(group: Group, t: Record, part: Record) -> None:
    """Note a contact as the one that a part is named by."""
    part.first, part.second = _number(group, t.first), _number(group, t.second)
    part.depth, part.closing, part.late = t.depth, t.closing, t.late


@kernel
def _note_worst(desk: Desk, group: Group, touch: NDArray[Any], part: Record) -> float:
    """Note the contact that is furthest from the velocity which it has in the solution.

    Returns the largest speed at which two approach, px/s.
    """
    work, k, worst, fastest = desk.work, len(group.ball), -1.0, 0.0
    for c in range(len(touch)):
        t = touch[c]
        t.tangential = closing_speed(work[:k], t)
    for i in range(k):
        work[i].vx, work[i].vy, work[i].spin = desk.end[i, 2], desk.end[i, 3], desk.end[i, 4]
    for c in range(len(touch)):
        t = touch[c]
        after = closing_speed(work[:k], t)
        off = abs(after - t.tangential)
        if off * group.dt > worst:
            worst = off * group.dt
            _note(group, t, part)
            part.after = after
        fastest = max(fastest, after)
    return fastest


@kernel
def _flies_otherwise(group: Group, law: Record, work: NDArray[Any], floor: float) -> bool:
    """Return whether a law's flight ends elsewhere than the exact one."""
    dt = group.dt
    for i in range(len(group.ball)):
        before, b = group.ball[i], work[i]
        b.x, b.y, b.vx, b.vy = before.x, before.y, before.vx, before.vy
        fly(law, b, dt)
        off_x = b.x - before.x - dt * (before.vx + law.gx * dt / 2)
        off_y = b.y - before.y - dt * (before.vy + law.gy * dt / 2)
        if max(abs(off_x), abs(off_y)) > floor:
            return True
    return False


@kernel
def _keeps_energy(group: Group, law: Record, end: Floats, part: Record) -> bool:
    """Return whether contacts have given a part no energy, and, if they are elastic and smooth, taken none."""
    change, scale, lossy, pull = 0.0, 0.0, False, (law.gx * law.gx + law.gy * law.gy) * group.dt * group.dt
    for i in range(len(group.ball)):
        b = group.ball[i]
        before, after = square_of(b, b.vx, b.vy, b.spin) / 2, square_of(b, end[i, 2], end[i, 3], end[i, 4]) / 2
        fallen = b.mass * (law.gx * (end[i, 0] - b.x) + law.gy * (end[i, 1] - b.y))
        change += after - before - fallen
        scale += 1e-6 * (after + before + abs(fallen)) + LEAN_LEFT_OVER * b.mass * pull / 2
        lossy = lossy or b.elasticity < 1 or b.friction > 0
    for p in range(len(group.piece)):
        lossy = lossy or group.piece[p].elasticity < 1
    part.elastic = change if lossy else 0.0
    return bool(change <= scale and (lossy or change >= -scale))


@kernel
def _let_drift(ball: NDArray[Any], piece: NDArray[Any], t: Record) -> None:
    """Let the normal of a contact drift from that at one end of a step to that at the other, where the balls are."""
    a = ball[t.first]
    if t.second >= 0:
        x, y, _ = unit(ball[t.second].x - a.x, ball[t.second].y - a.y)
    else:
        x, y, _ = normal_to(a, piece[~t.second])
    turned = abs(math.atan2(t.nx * y - t.ny * x, t.nx * x + t.ny * y))
    t.nx, t.ny, _ = unit(t.nx + x, t.ny + y)
    t.drift = math.tan(min(turned, 1.0))  # twice what is between the two, for paths that are not straight


@kernel
def _find_drifting(desk: Desk, group: Group, scratch: Scratch) -> int:
    """Find what touches at either end of a step, with normals that drift from one to the other. Returns the number."""
    k, work, found = len(group.ball), desk.work, 0
    for turn in range(2):
        for i in range(k):
            work[i] = group.ball[i]
            if turn == 1:
                work[i].x, work[i].y = desk.after[i, 0], desk.after[i, 1]
        begin, found = found, find_touches(work[:k], group.piece, desk.gap, scratch.touch, found)
        for i in range(k):
            x = group.ball[i]
            work[i].x, work[i].y = (x.x, x.y) if turn == 1 else (desk.after[i, 0], desk.after[i, 1])
        for c in range(begin, min(found, len(scratch.touch))):
            _let_drift(work, group.piece, scratch.touch[c])
    return found


@kernel
def _set_wanted(desk: Desk, group: Group, law: Record, of_places: bool) -> None:
    """Set `work` to what contacts are to explain: changes of velocities and spins, or of places, px/s in a step."""
    dt = group.dt
    for i in range(len(group.ball)):
        b, x, before = desk.work[i], desk.after[i], group.ball[i]
        if of_places:
            b.vx = (x[0] - before.x) / dt - before.vx - law.gx * dt / 2
            b.vy = (x[1] - before.y) / dt - before.vy - law.gy * dt / 2
            b.spin = 0.0
        else:
            b.vx, b.vy = x[2] - before.vx - law.gx * dt, x[3] - before.vy - law.gy * dt
            b.spin = x[4] - before.spin


@kernel
def _leans_in_time(desk: Desk, group: Group, law: Record, scratch: Scratch, part: Record, floor: float) -> bool:
    """Return whether a part that leans does what contacts in time can do.

    Its velocities and places change by impulses that push along what touches in the step, and give no energy; nothing
    overlaps. A contact's normal is between that before the step and that after it.
    """
    work, enough = desk.work[: len(group.ball)], 0.0
    _set_gaps(desk, group, law, floor)
    found = _find_drifting(desk, group, scratch)
    if found > len(scratch.touch):
        return False
    for c in range(found):
        if scratch.touch[c].depth > 3 * floor + NEGLIGIBLE * work[scratch.touch[c].first].radius:
            return False
    for of_places in (False, True):
        _set_wanted(desk, group, law, of_places)
        enough = enough if of_places else max(2 * floor / group.dt, LEAN_LEFT_OVER * largest_speed(work))
        fit_impulses(work, scratch.touch[:found], not of_places, enough)
        if largest_speed(work) > enough:
            return False
    return bool(_keeps_energy(group, law, desk.after, part))


@kernel
def _note_deepest(group: Group, touch: NDArray[Any], part: Record, least: float) -> bool:
    """Note the contact that was found deepest, of those that change a velocity by at least so much, px/s.

    Returns whether there is one.
    """
    part.depth, resolved = 0.0, False
    for c in range(len(touch)):
        t = touch[c]
        if t.impulse * t.per_mass > least and (t.depth > part.depth or not resolved):
            _note(group, t, part)
            resolved = True
    return resolved


@kernel
def _has_one_mass(ball: NDArray[Any]) -> bool:
    """Return whether all balls have the same mass: pushes by the inverse masses are then by half each."""
    for i in range(1, len(ball)):  # noqa: SIM110  # kernels have no generators
        if ball[i].mass != ball[0].mass:
            return False
    return True


@kernel
def _explain(
    desk: Desk, group: Group, laws: NDArray[Any], bases: int, scratch: Scratch, part: Record, floor: float
) -> None:
    """Explain a part's step: as it is, and without pushes of each kind."""
    k, dt = len(group.ball), group.dt
    start, shift, end = Group(desk.start[:k], group.piece, dt), desk.shift[:k], desk.end[:k]
    part.pushed, part.elastic, part.leans = 0.0, 0.0, 0
    ways = PUSHED_WAYS * (3 if k == 2 else 1 if _has_one_mass(group.ball) else 2)
    for turn in range(1 + 2 * bases * ways):  # once without pushes, whatever the flight, and once with them
        way = (turn - 1) % ways
        part.base = max(0, turn - 1) // ways % bases
        with_pushes = turn > bases * ways
        law, pushes = laws[EXACT_LAWS + part.base], 2
        part.pushed = 0.0
        if turn == 0:
            shift[:] = 0.0
        else:
            pushes = _unpush(desk, group, law, scratch, way, with_pushes, shift, part, floor)
        if pushes == 0 or (pushes == 1 and (with_pushes or way not in (0, 2))):
            continue
        _prepare(desk, group, way if turn > 0 else 0)
        part.kind = UNEXPLAINED
        if pushes == 2 and part.leans == 0:
            part.kind = _try_laws(desk, start, end, laws, bases, scratch, part, floor, turn == 0)
        if part.kind == UNCOMPUTED and turn == 0:
            part.leans = 1
            part.kind = LEANING if _leans_in_time(desk, group, laws[0], scratch, part, floor) else UNEXPLAINED
        if part.kind <= UNEXPLAINED and turn > 0:
            part.kind = _together(desk, start, law, scratch, way, desk.solved[:k], part, floor)
        if part.kind > UNEXPLAINED:
            break
    if part.leans == 1 and part.kind > UNEXPLAINED:
        _account(desk, start, laws[0], part)
    if part.kind <= UNEXPLAINED:
        part.kind, part.pushed = UNCOMPUTED if part.leans == 1 else UNEXPLAINED, 0.0


@kernel
def _prepare(desk: Desk, group: Group, way: int) -> None:
    """Set the start and the end of a step to what they are without pushes of some way."""
    for i in range(len(group.ball)):
        start, end, shift = desk.start[i : i + 1], desk.end[i], desk.shift[i]
        start[0] = group.ball[i]
        for axis in range(5):
            end[axis] = desk.after[i, axis]
        if way % PUSHED_WAYS == 0:
            start[0].x += shift[0]
            start[0].y += shift[1]
        else:
            end[0] -= shift[0]
            end[1] -= shift[1]


@kernel
def _account(desk: Desk, start: Group, law: Record, part: Record) -> None:
    """Set what restitution takes of a part whose exact step is not known: all that is lost without an error."""
    end = desk.end[: len(start.ball)]
    if part.kind in (TOGETHER, BY_FLIGHT):
        part.kind = LEANING
    elif part.kind != LEANING:
        for i in range(len(end)):
            end[i, 2], end[i, 3], end[i, 4] = desk.solved[i, 0], desk.solved[i, 1], desk.solved[i, 2]
    _keeps_energy(start, law, end, part)


@kernel
def _touches_nothing(group: Group, i: int, after: Floats, work: NDArray[Any], floor: float) -> bool:
    """Return whether a ball touches no wall before a step nor after it."""
    work[0] = group.ball[i]
    for _ in range(2):
        for p in range(len(group.piece)):
            if depth_in(work[0], group.piece[p]) > -floor:
                return False
        work[0].x, work[0].y = after[i, 0], after[i, 1]
    return True


@kernel
def _order_parts(
    f: Flown, desk: Desk, group: Group, law: Record, step: int, leans: bool, whole: bool, member: Integers
) -> None:
    """Divide a group into parts, and put the balls of each together in `member`. whole: into one."""
    k = len(group.ball)
    _set_gaps(desk, group, law, f.floor)
    _divide(desk, group, f.floor, leans)
    for i in range(k):
        alone = True
        for j in range(k):
            alone = alone and (j == i or desk.label[j] != desk.label[i])
        if alone and differs(f, step, member[i], group.ball[i].radius):
            whole = whole or _touches_nothing(group, i, desk.after, desk.work, f.floor)
    for i in range(k):
        desk.label[i] = 0 if whole else desk.label[i]
        desk.order[i] = member[i]
    filled = 0
    for root in range(k):
        for i in range(k):
            if desk.label[i] == root:
                member[filled], desk.sorted[filled] = desk.order[i], root
                filled += 1
    for i in range(k):
        desk.label[i] = desk.sorted[i]


@kernel
def _is_apart(f: Flown, desk: Desk, step: int, members: Integers, floor: float) -> bool:
    """Return whether the exact step of a part alone is that of its group."""
    for a in range(len(members)):
        i, radius = members[a], desk.mine[a].radius
        for axis in range(2):
            if abs(desk.exact[a, axis] - f.exact.position[step, i, axis]) > floor:
                return False
            if abs(desk.exact[a, 2 + axis] - f.exact.velocity[step, i, axis]) * f.dt[step] > floor:
                return False
        if abs(desk.exact[a, 4] - f.exact.spin[step, i]) * radius * f.dt[step] > floor:
            return False
    return True


@kernel
def _save(desk: Desk, remains: Remains, step: int, members: Integers, part: Record) -> None:
    """Save what explaining has found of a part."""
    for a in range(len(members)):
        for axis in range(2):
            remains.shift[step, members[a], axis] = desk.shift[a, axis] if part.pushed > 0 else 0.0
        for axis in range(3):
            remains.solved[step, members[a], axis] = desk.solved[a, axis]
        for axis in range(5):
            remains.exact[step, members[a], axis] = desk.exact[a, axis]


@kernel
def _write(f: Flown, remains: Remains, step: int, members: Integers, part: Record) -> None:
    """Write the exact step of a part; where it has no other error than pushes, what the engine has without these."""
    for a in range(len(members)):
        i = members[a]
        for axis in range(2):
            f.exact.position[step, i, axis] = remains.exact[step, i, axis]
            f.exact.velocity[step, i, axis] = remains.exact[step, i, 2 + axis]
            if part.kind == EXACT or part.leans == 1:
                f.exact.position[step, i, axis] = f.after.position[step, i, axis] - remains.shift[step, i, axis]
                f.exact.velocity[step, i, axis] = f.after.velocity[step, i, axis]
            if part.leans == 1 and part.kind in (COMPRESSIVE, PULLING):
                f.exact.velocity[step, i, axis] = remains.solved[step, i, axis]
        f.exact.spin[step, i] = f.after.spin[step, i] if part.kind in (EXACT, LEANING) else remains.exact[step, i, 4]
        if part.leans == 1 and part.kind in (COMPRESSIVE, PULLING):
            f.exact.spin[step, i] = remains.solved[step, i, 2]


@kernel
def _explain_parts(
    f: Flown,
    ball: NDArray[Any],
    laws: NDArray[Any],
    bases: int,
    desk: Desk,
    scratch: Scratch,
    remains: Remains,
    group: Record,
    members: Integers,
    parts: NDArray[Any],
    count: int,
) -> tuple[int, bool]:
    """Explain the parts of a group, of which `count` are before. Returns how many then are, and whether they are apart.

    They are not if the exact step of one of them alone is another than that of the group.
    """
    at, apart, step, leans, k = 0, True, group.step, group.ended == 0, len(members)
    while at < k and apart:
        size, part = _size_of_part(desk.label[at:k]), parts[count]
        of_part = members[at : at + size]
        part.step, part.begin, part.size = step, group.begin + at, size
        _fill(f, desk.mine, desk.after, ball, step, of_part)
        _explain(desk, Group(desk.mine[:size], f.piece, f.dt[step]), laws, bases, scratch, part, f.floor)
        apart = size == k or leans or _is_apart(f, desk, step, of_part, f.floor)
        _save(desk, remains, step, of_part, part)
        at += size
        count += 1
    return count, apart


@kernel
def _write_parts(
    f: Flown, remains: Remains, elastic: Floats, group: Record, member: Integers, parts: NDArray[Any]
) -> None:
    """Write the exact step of a group that is the parts of it that are explained."""
    step = group.step
    elastic[step] -= 0.0 if group.ended == 0 else group.elastic
    for p in range(len(parts)):
        part = parts[p]
        if part.kind != UNCOMPUTED:
            _write(f, remains, step, member[part.begin : part.begin + part.size], part)
            elastic[step] += part.elastic


@entry
def explain(
    f: Flown,
    ball: NDArray[Any],
    laws: NDArray[Any],
    bases: int,
    desk: Desk,
    scratch: Scratch,
    remains: Remains,
    found: NDArray[Any],
    member: Integers,
    parts: NDArray[Any],
    elastic: Floats,
) -> int:
    """Explain the steps of some groups. Returns the number of their parts.

    laws: the exact one, `bases` of them of how the engine flies, and known ones; found: (groups,) FOUND, their balls in
    `member`, which is put in order of the parts; parts: (balls,) PART, written; elastic: (steps,) kg px²/s².
    """
    count, g, whole = 0, 0, False
    while g < len(found):
        step, begin, k, first = found[g].step, found[g].begin, found[g].count, count
        members = member[begin : begin + k]
        for a in range(k if whole else 0):  # in the order that they had before they were divided
            members[a] = desk.order[a]
        _fill(f, desk.ball, desk.after, ball, step, members)
        leans = found[g].ended == 0
        _order_parts(f, desk, Group(desk.ball[:k], f.piece, f.dt[step]), laws[0], step, leans, whole, members)
        count, apart = _explain_parts(f, ball, laws, bases, desk, scratch, remains, found[g], members, parts, first)
        whole = not apart
        if apart:
            _write_parts(f, remains, elastic, found[g], member, parts[first:count])
            g += 1
        else:  # balls that meet only as others lead them to
            count = first
    return count


@kernel
def _size_of_part(label: Integers) -> int:
    """Return how many balls the first part has. label: (k,), of parts one after another."""
    size = 0
    while size < len(label) and label[size] == label[0]:
        size += 1
    return size


@kernel
def _fill(f: Flown, own: NDArray[Any], after: Floats, ball: NDArray[Any], step: int, members: Integers) -> None:
    """Set some balls to the state before a step, and what the engine has after it."""
    for a in range(len(members)):
        i = members[a]
        own[a] = ball[i]
        fill_ball(own[a], f.before, step, i)
        for axis in range(2):
            after[a, axis], after[a, 2 + axis] = f.after.position[step, i, axis], f.after.velocity[step, i, axis]
        after[a, 4] = f.after.spin[step, i]
