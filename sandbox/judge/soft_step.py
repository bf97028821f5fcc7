"""The step of Box2D v3: several substeps, with soft contacts that are solved before bodies touch.

Catto's "TGS soft" (Solver2D, 2024). The contacts of a step, and their normals, are those of its start. In each substep
gravity changes velocities, the impulses of the substep before act again, and each contact is solved: so that the two
just touch if they are apart, or are pushed out of their overlap slowly. Then the balls move, and the contacts are
solved again without that push. After the last substep each contact that has pushed gives its restitution, of the speed
at which the two approached before the step. Until then, bodies that have met stay in touch.

A fast ball that has met a wall without a contact is stopped on its way, where it touches the wall (continuous
collision); its velocity stays.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, entry, kernel
from sandbox.engines.exact.support import normal_to, unit
from sandbox.judge.free_flight import BALL
from sandbox.judge.law import Order
from sandbox.judge.one_step import Group
from sandbox.judge.thresholds import EVENTS_PER_BALL
from sandbox.judge.together import depth_in, reach_of, time_overlapped
from sandbox.quantity import pass_through
from sandbox.state import Floats, Integers

HERTZ: Final = 30.0  # of a contact of balls, Box2D's default; twice that at a wall, and at most a quarter of substeps'
DAMPING_RATIO: Final = 10.0  # Box2D's default
DISC_TURNS: Final = 2.0  # m r²/I of a disc
ALIKE: Final = 1e-3  # of a radius, between distances of bodies that are the same but for rounding

SOFT: Final = np.dtype(
    [
        ("first", "i8"),  # ball of the group
        ("second", "i8"),  # ball, or ~piece
        ("colour", "i8"),  # contacts are solved colour by colour; those of one share no ball
        ("nx", "f8"),
        ("ny", "f8"),
        ("depth", "f8"),  # px, at the start of the step
        ("closing", "f8"),  # px/s, then
        ("normal", "f8"),  # kg px/s, the impulse of this substep
        ("tangential", "f8"),
        ("given", "f8"),  # kg px/s, since the step began
        ("rubbed", "f8"),
        ("pushed", "i8"),  # 1 if it ever has
    ]
)


NO_CONTACTS: Final = np.empty(0, SOFT)


class SoftScratch(NamedTuple):
    """What a step works in.

    ball: (k,) BALL; angle: (k,) rad, by which each has turned; contact: (some,) SOFT, whose colour is -1 if there are
    fewer; warm: (some,) SOFT, those of the step before, whose impulses act again.
    """

    ball: NDArray[np.void]
    angle: Floats
    contact: NDArray[np.void]
    warm: NDArray[np.void]


def soft_scratch_for(balls: int, warm: NDArray[np.void]) -> SoftScratch:
    """Return what a step of so many balls works in."""
    return SoftScratch(np.zeros(balls, BALL), np.zeros(balls), np.zeros(EVENTS_PER_BALL * balls, SOFT), warm)


@kernel
def _add(s: SoftScratch, law: Record, count: int, i: int, j: int, nx: float, ny: float, depth: float) -> int:
    """Add a contact of ball i with ball j or ~piece j, if it is near enough. Returns how many there are."""
    if depth + law.margin < 0 or count >= len(s.contact):
        return count
    c = s.contact[count]
    c.first, c.second, c.nx, c.ny, c.depth, c.pushed, c.colour = i, j, nx, ny, depth, 0, -1
    c.normal = c.tangential = c.given = c.rubbed = 0.0
    for k in range(len(s.warm)):
        w = s.warm[k]
        if w.first == i and w.second == j:
            c.normal, c.tangential, c.colour = w.normal, w.tangential, w.colour
    c.closing = _closing(s.ball[i], s.ball[max(j, 0)], j >= 0, c)
    return count + 1


@kernel
def _add_walls(group: Group, law: Record, s: SoftScratch, count: int) -> int:
    for i in range(len(s.ball)):
        for p in range(len(group.piece)):
            depth = depth_in(s.ball[i], group.piece[p])
            if depth > -math.inf:
                nx, ny, _ = normal_to(s.ball[i], group.piece[p])
                count = _add(s, law, count, i, ~p, nx, ny, depth)
    return count


@kernel
def _add_pairs(law: Record, s: SoftScratch, count: int) -> int:
    n = len(s.ball)
    for k in range(n):
        i = n - 1 - k if law.order == Order.REVERSED else k
        for m in range(i + 1, n):
            j = n + i - m if law.order == Order.REVERSED else m
            a, b = s.ball[i], s.ball[j]
            if pass_through(a.filter, b.filter):
                continue
            nx, ny, distance = unit(b.x - a.x, b.y - a.y)
            count = _add(s, law, count, i, j, nx, ny, a.radius + b.radius - distance)
    return count


@kernel
def _next(s: SoftScratch, count: int, dt: float, margin: float) -> int:
    """Return the contact without a colour that was made first: of those found a step ago, that of the nearest then."""
    best, least = 0, math.inf
    for k in range(count):
        c = s.contact[k]
        gap = min(max(c.closing * dt - c.depth, 0.0), margin)
        if c.colour < 0 and gap < least - ALIKE * s.ball[c.first].radius:
            best, least = k, gap
    return best


@kernel
def _colour(s: SoftScratch, count: int, dt: float, margin: float) -> int:
    """Give each new contact the first colour that none of its balls has, at a wall not the first. Returns how many."""
    colours, new = 0, 0
    for k in range(count):
        colours, new = max(colours, s.contact[k].colour + 1), new + (s.contact[k].colour < 0)
    for _ in range(new):
        chosen: int = _next(s, count, dt, margin)
        c = s.contact[chosen]
        colour, taken = 0 if c.second >= 0 else 1, True
        while taken:
            taken = False
            for k in range(count):
                d = s.contact[k]
                shares = (
                    d.first in (c.first, c.second) or d.second == c.first or (d.second >= 0 and d.second == c.second)
                )
                taken |= d.colour == colour and shares
            colour += taken
        c.colour = colour
        colours = max(colours, colour + 1)
    return colours


@kernel
def _push(a: Record, b: Record, c: Record, along_n: float, along_t: float) -> None:
    """Give two bodies an impulse at the middle of their overlap or gap. along_n, along_t: kg px/s."""
    x, y = along_n * c.nx - along_t * c.ny, along_n * c.ny + along_t * c.nx
    a.vx -= x / a.mass
    a.vy -= y / a.mass
    a.spin -= DISC_TURNS * along_t * (a.radius - c.depth / 2) / (a.mass * a.radius * a.radius)
    if c.second >= 0:
        b.vx += x / b.mass
        b.vy += y / b.mass
        b.spin -= DISC_TURNS * along_t * (b.radius - c.depth / 2) / (b.mass * b.radius * b.radius)
    c.given += along_n
    c.rubbed += along_t


@kernel
def _closing(a: Record, b: Record, pair: bool, c: Record) -> float:
    """Return how fast two bodies approach, px/s."""
    if pair:
        return float((a.vx - b.vx) * c.nx + (a.vy - b.vy) * c.ny)
    return float(a.vx * c.nx + a.vy * c.ny)


@kernel
def _restitution(group: Group, a: Record, b: Record, c: Record) -> float:
    return float(a.elasticity * (b.elasticity if c.second >= 0 else group.piece[~c.second].elasticity))


@kernel
def _rub(group: Group, law: Record, a: Record, b: Record, c: Record) -> None:
    """Give the friction of a contact, limited by its impulse so far; by Coulomb's law, by that with restitution."""
    pair = c.second >= 0
    mu = a.friction * (b.friction if pair else group.piece[~c.second].friction)
    if mu <= 0:
        return
    lever = 1 - c.depth / (2 * a.radius)
    along, per_mass = a.vy * c.nx - a.vx * c.ny + lever * a.radius * a.spin, (1 + DISC_TURNS * lever * lever) / a.mass
    if pair:
        lever = 1 - c.depth / (2 * b.radius)
        along += b.vx * c.ny - b.vy * c.nx + lever * b.radius * b.spin
        per_mass += (1 + DISC_TURNS * lever * lever) / b.mass
    limit = mu * c.normal * (1.0 if law.clamped == 1 else 1 + _restitution(group, a, b, c))
    total = min(max(c.tangential + along / per_mass, -limit), limit)
    _push(a, b, c, 0.0, total - c.tangential)
    c.tangential = total


@kernel
def _depth(group: Group, law: Record, s: SoftScratch, c: Record) -> float:
    """Return how deep two bodies are in each other, along the normal of the step's start, px.

    What touches are the points that did so then, which turn with the balls.
    """
    a, start = s.ball[c.first], group.ball[c.first]
    moved = (a.x - start.x) * c.nx + (a.y - start.y) * c.ny
    turned = (a.radius - c.depth / 2) * (1 - math.cos(s.angle[c.first]))
    if c.second >= 0:
        b, start = s.ball[c.second], group.ball[c.second]
        moved -= (b.x - start.x) * c.nx + (b.y - start.y) * c.ny
        turned += (b.radius - c.depth / 2) * (1 - math.cos(s.angle[c.second]))
    return float(c.depth + moved - turned + law.offset)


@kernel
def _solve(group: Group, law: Record, s: SoftScratch, c: Record, h: float, pushes: bool) -> None:
    """Solve a contact in a substep of h s. pushes: whether it is pushed out of an overlap."""
    pair = c.second >= 0
    a, b = s.ball[c.first], s.ball[max(c.second, 0)]
    depth, due, share, forgotten = _depth(group, law, s, c), 0.0, 1.0, 0.0
    if depth < 0:
        due = depth / h
    elif pushes:
        omega = 2 * math.pi * min(HERTZ, 1 / (4 * h)) * (1.0 if pair else 2.0)
        a1 = 2 * DAMPING_RATIO + h * omega
        forgotten = 1 / (1 + h * omega * a1)
        due, share = depth * omega / a1, 1 - forgotten
    per_mass = 1 / a.mass + (1 / b.mass if pair else 0.0)
    impulse = share * (_closing(a, b, pair, c) + due) / per_mass - forgotten * c.normal
    total = max(c.normal + impulse, 0.0)
    _push(a, b, c, total - c.normal, 0.0)
    c.normal = total
    c.pushed |= total > 0
    _rub(group, law, a, b, c)


@kernel
def _solve_all(group: Group, law: Record, s: SoftScratch, count: int, colours: int, h: float, pushes: bool) -> None:
    for colour in range(colours):
        for k in range(count):
            if s.contact[k].colour == colour:
                _solve(group, law, s, s.contact[k], h, pushes)


@kernel
def _substep(group: Group, law: Record, s: SoftScratch, count: int, colours: int, h: float) -> None:
    for i in range(len(s.ball)):
        s.ball[i].vx += h * law.gx
        s.ball[i].vy += h * law.gy
    for k in range(count):
        c = s.contact[k]
        _push(s.ball[c.first], s.ball[max(c.second, 0)], c, c.normal, c.tangential)
    for pushes in range(2):
        _solve_all(group, law, s, count, colours, h, pushes == 0)
        if pushes == 0:
            for i in range(len(s.ball)):
                b = s.ball[i]
                b.x += h * b.vx
                b.y += h * b.vy
                s.angle[i] += math.atan(h * b.spin)


@kernel
def _give_restitution(group: Group, s: SoftScratch, count: int, colours: int) -> None:
    """Let each contact that has pushed part at its restitution."""
    for colour in range(colours):
        for k in range(count):
            c = s.contact[k]
            a, b, pair = s.ball[c.first], s.ball[max(c.second, 0)], c.second >= 0
            e = _restitution(group, a, b, c)
            if c.colour == colour and c.pushed and c.closing >= 0 and e > 0:
                per_mass = 1 / a.mass + (1 / b.mass if pair else 0.0)
                total = max(c.normal + (_closing(a, b, pair, c) + e * c.closing) / per_mass, 0.0)
                _push(a, b, c, total - c.normal, 0.0)
                c.normal = total


@kernel
def _stop(group: Group, law: Record, s: SoftScratch, met: NDArray[np.void], noted: int) -> int:
    """Put a ball back on its way, to where it touches a wall, and note that. Returns the number of contacts noted.

    Puts it nowhere if it has a contact with that wall.
    """
    b, start, deepest, wall = s.ball[law.stops], group.ball[law.stops], -math.inf, 0
    share = law.stop / math.hypot(b.x - start.x, b.y - start.y)
    b.x = start.x + share * (b.x - start.x)
    b.y = start.y + share * (b.y - start.y)
    for p in range(len(group.piece)):
        depth = depth_in(b, group.piece[p])
        if depth > deepest:
            deepest, wall = depth, p
    for k in range(len(s.contact)):
        c = s.contact[k]
        if (
            c.colour >= 0
            and c.first == law.stops
            and c.second < 0
            and group.piece[~c.second].wall == group.piece[wall].wall
        ):
            b.x = math.nan
    if noted >= len(met):
        return noted
    m = met[noted]
    m.nx, m.ny, _ = normal_to(b, group.piece[wall])
    m.time, m.first, m.second, m.depth = 0.0, b.number, ~group.piece[wall].wall, deepest
    m.closing, m.impulse, m.tangential, m.elastic = b.vx * m.nx + b.vy * m.ny, 0.0, 0.0, 0.0
    return noted + 1


@kernel
def _due(group: Group, c: Record) -> float:
    """Return when two bodies would touch in flight, s since the step began; before it if they overlapped then."""
    a, b = group.ball[c.first], group.ball[max(c.second, 0)]
    reach = reach_of(a, b, group.piece, c.second)
    return -float(time_overlapped(a, b, c.second >= 0, c.depth, c.closing, reach))


@kernel
def _run(group: Group, law: Record, s: SoftScratch, met: NDArray[np.void]) -> int:
    """Do a step. Returns how many contacts it notes."""
    for i in range(len(s.ball)):
        s.ball[i] = group.ball[i]
        s.angle[i] = 0.0
    for k in range(len(s.contact)):
        s.contact[k].colour = -1
    count = _add_walls(group, law, s, 0) if law.order == Order.WALLS_FIRST else 0
    count = _add_pairs(law, s, count)
    if law.order != Order.WALLS_FIRST:
        count = _add_walls(group, law, s, count)
    colours = _colour(s, count, group.dt, law.margin)
    for _ in range(law.substeps):
        _substep(group, law, s, count, colours, group.dt / law.substeps)
    _give_restitution(group, s, count, colours)
    noted = 0
    for k in range(count):
        c = s.contact[k]
        if c.pushed and noted < len(met):
            m = met[noted]
            m.time, m.nx, m.ny, m.closing, m.depth = _due(group, c), c.nx, c.ny, c.closing, c.depth
            m.impulse, m.tangential, m.elastic = c.given, c.rubbed, 0.0
            m.first = s.ball[c.first].number
            m.second = s.ball[c.second].number if c.second >= 0 else ~group.piece[~c.second].wall
            noted += 1
    return _stop(group, law, s, met, noted) if law.stops >= 0 else noted


@entry
def run_soft(
    group: Group, laws: NDArray[Any], scratch: SoftScratch, after: Floats, met: NDArray[np.void], counts: Integers
) -> None:
    """Do the same step by each of some laws, as `run_laws` does."""
    for number in range(len(laws)):
        counts[number] = _run(group, laws[number], scratch, met[number])
        for i in range(len(scratch.ball)):
            b = scratch.ball[i]
            after[number, i, 0], after[number, i, 1] = b.x, b.y
            after[number, i, 2], after[number, i, 3], after[number, i, 4] = b.vx, b.vy, b.spin
