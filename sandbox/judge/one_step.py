"""One step of a few balls from any state, by the exact law or by one with something wrong.

Times of impact, normals and friction are those of `engines.exact`; what can be wrong is in LAW. `run_laws` does the
same step by many laws in one call. A disc that a face carries slides or rolls on it without bouncing, as in `exact`;
what `exact` does with discs that lean on each other, or go round an edge, is not done here.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, entry, kernel
from sandbox.engines.exact.contact import CONTACT_TIME, HOP_TIME, HOPS_ROUND_END
from sandbox.engines.exact.friction import friction_on_face
from sandbox.engines.exact.prediction import time_to_piece
from sandbox.engines.exact.support import normal_to, unit
from sandbox.engines.exact.world import Motion
from sandbox.engines.laws import NEVER, friction_impulse, time_to_touch
from sandbox.judge.free_flight import kept_in, move, slow
from sandbox.judge.law import Exchange, Masses, Mixing, Order, Parting, Place, Scope, Slows, When
from sandbox.judge.thresholds import EVENTS_PER_BALL, MAX_EVENTS, TIE
from sandbox.judge.together import Room, depth_in, find_touches, reach_of, solve_together, time_overlapped
from sandbox.quantity import pass_through
from sandbox.scene.walls import ARENA_COUNT
from sandbox.state import Floats, Integers

MET: Final = np.dtype(
    [
        ("time", "f8"),  # s since the step began
        ("first", "i8"),  # ball
        ("second", "i8"),  # ball, or ~wall
        ("nx", "f8"),
        ("ny", "f8"),
        ("closing", "f8"),  # px/s
        ("impulse", "f8"),  # kg px/s
        ("depth", "f8"),  # px
        ("late", "f8"),  # s since the two touched; infinite if they part
        ("tangential", "f8"),  # kg px/s
        ("elastic", "f8"),  # kg px²/s², what restitution does to the energy
    ]
)


class Group(NamedTuple):
    """A few balls and walls. ball: (k,) BALL, before the step; piece: (m,) PIECE; dt: s."""

    ball: NDArray[np.void]
    piece: NDArray[np.void]
    dt: float


class Scratch(NamedTuple):
    """What a step works in.

    ball: (k,) BALL; met: (MAX_EVENTS,) MET; tally: (2,), their number, and 1 if the step cannot be computed here;
    touch: (some,) TOUCH, contacts that are solved together; gap: (k,) zeros; room: for that;
    elastic: (1,) kg px²/s², what restitution does; plain: (1,) LAW, that of contacts that a law has right;
    time: (k,) s from now, of the first contact of each ball with a wall or a later ball; partner: (k,), that ball, or
    ~piece.
    """

    ball: NDArray[np.void]
    met: NDArray[np.void]
    tally: NDArray[np.int64]
    touch: NDArray[np.void]
    gap: Floats
    room: Room
    elastic: Floats
    plain: NDArray[np.void]
    time: Floats
    partner: NDArray[np.int64]


@kernel
def scratch_of(s: Scratch, k: int) -> Scratch:
    """Return what a step of only k balls works in."""
    return Scratch(s.ball[:k], s.met, s.tally, s.touch, s.gap, s.room, s.elastic, s.plain, s.time, s.partner)


@kernel
def _motion(b: Record) -> Motion:
    return Motion(b.x, b.y, b.vx, b.vy, b.ax, b.ay)


@kernel
def _concerns(law: Record, first: int, second: int) -> bool:
    """Return whether a contact of two numbers is one of those that a law has wrong."""
    scope = law.scope
    if scope == Scope.ONE:
        return bool(law.first == first and law.second == second)
    return bool(scope == Scope.ALL or (scope == Scope.PAIRS) == (second >= 0))


@kernel
def _number_of(group: Group, j: int, ball: NDArray[np.void]) -> int:
    """Return the scene's number of a ball, or ~wall of ~piece."""
    return int(ball[j].number) if j >= 0 else int(~group.piece[~j].wall)


@kernel
def _offset(law: Record, first: int, second: int) -> float:
    """Return by how many px two bodies touch sooner than they should."""
    return float(law.offset) if law.offset != 0 and _concerns(law, first, second) else 0.0


@kernel
def _is_missed(law: Record, first: int, second: int) -> bool:
    return bool(law.missed == 1 and _concerns(law, first, second))


@kernel
def _times(law: Record, first: int, second: int) -> int:
    """Return how often a contact is resolved."""
    return 2 if law.twice == 1 and _concerns(law, first, second) else 1


@kernel
def _time_to_pair(law: Record, a: Record, b: Record, left: float) -> float:
    """Return when two balls touch (s), if that is within the time left."""
    if _is_missed(law, a.number, b.number) or pass_through(a.filter, b.filter):
        return NEVER
    rx, ry = b.x - a.x, b.y - a.y
    reach = a.radius + b.radius + _offset(law, a.number, b.number)
    vx, vy, ax, ay = b.vx - a.vx, b.vy - a.vy, b.ax - a.ax, b.ay - a.ay
    if abs(rx) > reach + left * (abs(vx) + left * abs(ax)) or abs(ry) > reach + left * (abs(vy) + left * abs(ay)):
        return NEVER
    rounding = 1e-12 * math.hypot(rx, ry) * (abs(a.vx) + abs(a.vy) + abs(b.vx) + abs(b.vy))
    touch, press = rx * rx + ry * ry <= reach * reach, rx * ax + ry * ay < 0
    if touch and not press and -(rx * vx + ry * vy) <= rounding:
        return NEVER
    return float(time_to_touch(rx, ry, vx, vy, ax, ay, reach, NEVER))


@kernel
def _is_sooner(law: Record, time: float, best: float, left: float) -> bool:
    """Return whether a contact comes before the best so far, within a time (s).

    Of those within TIE of each other the first by number does, or the last if the law reverses the order.
    """
    return bool(time <= left and (time < best - TIE or (law.order == Order.REVERSED and time <= best + TIE)))


@kernel
def _plan(group: Group, law: Record, scratch: Scratch, i: int, left: float) -> None:
    """Find a ball's first contact with a wall or a later ball, within a time (s)."""
    ball, best, partner = scratch.ball, NEVER, 0
    a = ball[i]
    for p in range(len(group.piece)):
        piece = group.piece[p]
        if a.carrier == p or _is_missed(law, a.number, ~piece.wall):
            continue
        if a.carrier >= 0 and group.piece[a.carrier].wall == piece.wall:
            continue
        time = time_to_piece(_motion(a), a.radius + _offset(law, a.number, ~piece.wall), piece, False)
        if _is_sooner(law, time, best, left):
            best, partner = time, ~p
    for j in range(i + 1, len(ball)):
        time = _time_to_pair(law, a, ball[j], left)
        if _is_sooner(law, time, best, left):
            best, partner = time, j
    scratch.time[i], scratch.partner[i] = best, partner


@kernel
def _plan_again(group: Group, law: Record, scratch: Scratch, changed: int, left: float) -> None:
    """Find the first contacts that a ball's new velocity changes: its own, and those of earlier balls with it."""
    ball = scratch.ball
    for i in range(changed):
        with_it = scratch.partner[i] == changed
        if with_it or _time_to_pair(law, ball[i], ball[changed], left) <= min(left, scratch.time[i] + TIE):
            _plan(group, law, scratch, i, left)
    _plan(group, law, scratch, changed, left)


@kernel
def _next_contact(law: Record, scratch: Scratch, left: float) -> tuple[float, int]:
    """Return the first contact within a time (s): when, and which ball has planned it, or -1."""
    best, who = NEVER, -1
    for i in range(len(scratch.ball)):
        if _is_sooner(law, scratch.time[i], best, left):
            best, who = scratch.time[i], i
    return best, who


@kernel
def _fly(scratch: Scratch, time: float) -> None:
    """Let all balls fly, slide or roll for a time (s), so that their first contacts are sooner by that."""
    for i in range(len(scratch.ball)):
        b = scratch.ball[i]
        b.x += time * (b.vx + time * b.ax / 2)
        b.y += time * (b.vy + time * b.ay / 2)
        b.vx += time * b.ax
        b.vy += time * b.ay
        b.spin += time * b.turning
        b.slips_for -= time
        scratch.time[i] -= time


@kernel
def _release(law: Record, b: Record) -> None:
    b.ax, b.ay, b.turning, b.slips_for, b.carrier = law.gx, law.gy, 0.0, NEVER, -1


@kernel
def _carry(group: Group, law: Record, b: Record, p: int, nx: float, ny: float) -> bool:
    """Let a face carry a ball, or two faces stop it. Returns whether that can be computed: not if it may turn there."""
    g_n = law.gx * nx + law.gy * ny
    if b.carrier >= 0 and b.carrier != p:
        b.vx, b.vy, b.ax, b.ay, b.turning, b.slips_for = 0.0, 0.0, 0.0, 0.0, 0.0, NEVER
        return bool(b.spin == 0)
    b.carrier, b.ax, b.ay = p, law.gx - g_n * nx, law.gy - g_n * ny
    g_t, slip = law.gy * nx - law.gx * ny, b.vy * nx - b.vx * ny + b.radius * b.spin
    b.turning, b.slips_for = 0.0, NEVER
    largest = b.friction * group.piece[p].friction * g_n * law.coefficient
    if largest <= 0:
        return True
    friction, b.slips_for = friction_on_face(g_t, largest, slip if abs(slip) > 1e-9 * abs(b.vx + b.vy) else 0.0)
    b.ax += friction * ny
    b.ay -= friction * nx
    b.turning = -2 * friction / b.radius
    return True


@kernel
def _mixed(law: Record, a: float, b: float) -> float:
    """Return the coefficient of friction of two factors."""
    if law.mixing == Mixing.PRODUCT:
        return a * b
    if law.mixing == Mixing.SUM:
        return a + b
    return math.sqrt(a * b) if law.mixing == Mixing.ROOT else max(a, b)


@kernel
def _restitution(law: Record, e: float) -> float:
    """Return the restitution that a law has where the scene has e."""
    return float(e * law.restitution if law.constant < 0 else law.constant)


@kernel
def _mass_in(law: Record, b: Record) -> float:
    """Return the mass that an impulse is computed with."""
    if law.masses <= Masses.SWAPPED:
        return float(b.mass)
    if law.masses == Masses.EQUAL:
        return 1.0
    return float(b.radius ** (law.masses - Masses.BY_RADIUS + 1))


@kernel
def _reflect_with(b: Record, speed: float, nx: float, ny: float) -> None:
    """Reflect a velocity at the tangent, and give it a speed (px/s)."""
    before, along = math.hypot(b.vx, b.vy), 2 * (b.vx * nx + b.vy * ny)
    share = speed / before if before > 0 else 0.0
    b.vx, b.vy = share * (b.vx - along * nx), share * (b.vy - along * ny)


@kernel
def _flip(law: Record, b: Record, flips_x: bool) -> None:
    """Change the sign of a velocity, or of a component, or stop it."""
    if law.exchange == Exchange.STOP:
        b.vx = b.vy = 0.0
    elif law.exchange == Exchange.REVERSED:
        b.vx, b.vy = -b.vx, -b.vy
    elif flips_x:
        b.vx = -b.vx
    else:
        b.vy = -b.vy


@kernel
def _exchange(law: Record, a: Record, b: Record, pair: bool, nx: float, ny: float) -> None:
    """Change velocities as the law does instead of an impulse."""
    if law.exchange == Exchange.WHOLE and pair:
        a.vx, b.vx = b.vx, a.vx
        a.vy, b.vy = b.vy, a.vy
    elif law.exchange == Exchange.SPEEDS and pair:
        of_a, of_b = math.hypot(a.vx, a.vy), math.hypot(b.vx, b.vy)
        _reflect_with(a, of_b, nx, ny)
        _reflect_with(b, of_a, nx, ny)
    elif law.exchange == Exchange.EACH:
        _reflect_with(a, math.hypot(a.vx, a.vy), nx, ny)
        if pair:
            _reflect_with(b, math.hypot(b.vx, b.vy), nx, ny)
    elif law.exchange == Exchange.TANGENTS and pair:
        along = (b.vy - a.vy) * nx - (b.vx - a.vx) * ny
        a.vx, a.vy = a.vx - along * ny, a.vy + along * nx
        b.vx, b.vy = b.vx + along * ny, b.vy - along * nx
    elif law.exchange == Exchange.MERGE and pair:
        of_a = a.mass / (a.mass + b.mass)
        a.vx = b.vx = of_a * a.vx + (1 - of_a) * b.vx
        a.vy = b.vy = of_a * a.vy + (1 - of_a) * b.vy
    elif law.exchange >= Exchange.REVERSED:
        _flip(law, a, abs(nx) > abs(ny))
        if pair:
            _flip(law, b, abs(nx) > abs(ny))


@kernel
def _friction(
    law: Record,
    a: Record,
    b: Record,
    pair: bool,
    other_friction: float,
    along: float,
    impulse: float,
    e: float,
    per_mass: float,
) -> float:
    """Return the impulse along the tangent, kg px/s. along: px/s, of the centres; per_mass: of both bodies, 1/kg."""
    rims = a.radius * a.spin + (b.radius * b.spin if pair else 0.0)
    mu = _mixed(law, a.friction, other_friction) * law.coefficient + law.added
    if mu <= 0:
        return 0.0
    limit = math.inf if law.unlimited == 1 else mu * impulse / (1 + e if law.clamped == 1 else 1.0)
    # An inertia of moment times m r²/2 needs moment / (2 + moment) of m u to stop the slip.
    slip = 3 * law.moment / (2 + law.moment) * (along + (rims if law.without_spin == 0 else 0.0))
    return float(law.friction * friction_impulse(slip, limit, per_mass))


@kernel
def _note(
    scratch: Scratch,
    time: float,
    first: int,
    second: int,
    nx: float,
    ny: float,
    closing: float,
    impulse: float,
    depth: float,
    late: float,
    tangential: float,
    elastic: float,
) -> None:
    """Note a contact, whose fields are those of MET, if there is room."""
    scratch.elastic[0] += elastic
    count = scratch.tally[0]
    if count < len(scratch.met):
        m = scratch.met[count]
        m.time, m.first, m.second, m.nx, m.ny, m.closing = time, first, second, nx, ny, closing
        m.impulse, m.depth, m.late, m.tangential, m.elastic = impulse, depth, late, tangential, elastic
        scratch.tally[0] = count + 1


@kernel
def _put_apart(law: Record, a: Record, b: Record, pair: bool, nx: float, ny: float) -> None:
    """Put two bodies apart by what the law says, px."""
    a.x -= law.apart * nx
    a.y -= law.apart * ny
    if pair:
        b.x += law.apart * nx
        b.y += law.apart * ny


@kernel
def _brake(law: Record, a: Record, nx: float, ny: float) -> None:
    """Multiply the velocity along the tangent by what the law says."""
    along = (a.vy * nx - a.vx * ny) * (law.slope - 1)
    a.vx -= along * ny
    a.vy += along * nx


@kernel
def _normal_in(law: Record, a: Record, b: Record, pair: bool, nx: float, ny: float) -> tuple[float, float]:
    """Return the normal that a law takes for the right one."""
    if pair and law.exchange == Exchange.ALONG_VELOCITY:
        along_x, along_y, _ = unit(a.vx - b.vx, a.vy - b.vy)
        return along_x, along_y
    c, s = math.cos(law.turn), math.sin(law.turn)
    return nx * c - ny * s, nx * s + ny * c


@kernel
def _resolve(
    group: Group, law: Record, scratch: Scratch, i: int, j: int, nx: float, ny: float, depth: float, time: float
) -> float:
    """Let two bodies exchange momentum. Returns the speed at which they part then, px/s, as the law has it."""
    ball, pair = scratch.ball, j >= 0
    a, b = ball[i], ball[j if pair else i]
    first, second = np.int64(a.number), _number_of(group, j, ball)
    here = law if _concerns(law, first, second) else scratch.plain[0]
    nx, ny = _normal_in(here, a, b, pair, nx, ny)
    closing = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny if pair else a.vx * nx + a.vy * ny
    along = (b.vx - a.vx) * ny - (b.vy - a.vy) * nx if pair else a.vy * nx - a.vx * ny
    late = time_overlapped(a, b, pair, depth, closing, reach_of(a, b, group.piece, j))
    other_e = b.elasticity if pair else group.piece[~j].elasticity
    other_mu = b.friction if pair else group.piece[~j].friction
    e = _restitution(here, a.elasticity * other_e)
    parting = e * closing
    if not pair and law.wall_place == Place.FALLEN and law.when == When.AFTER_MOVE:
        parting = max(0.0, parting - (1 + e) * (law.gx * nx + law.gy * ny) * depth / closing) if closing > 0 else 0.0
    per_a, per_b = 1 / _mass_in(here, a), 1 / _mass_in(here, b) if pair else 0.0
    impulse = (closing + parting) / (per_a + per_b) * here.impulse
    tangential = _friction(here, a, b, pair, other_mu, along, impulse, e, per_a + per_b)
    if here.exchange > Exchange.ALONG_VELOCITY:
        _exchange(here, a, b, pair, nx, ny)
        impulse, tangential = 0.0, 0.0
    _push(here, a, b, pair, nx, ny, impulse, here.tangential * impulse, per_a, per_b)
    brake = 0.0 if pair else math.copysign(here.brake * impulse, along)
    _push(scratch.plain[0], a, b, pair, nx, ny, 0.0, tangential + brake, per_a, per_b)
    a.spin -= 2 * tangential * per_a / (a.radius * here.moment) * here.first_turns
    if pair:
        b.spin -= 2 * tangential * per_b / (b.radius * here.moment) * here.second_turns
    if here.slope != 1:
        _brake(here, a, nx, ny)
    if here.scaled != 1:
        a.vx, a.vy = here.scaled * a.vx, here.scaled * a.vy
        if pair:
            b.vx, b.vy = here.scaled * b.vx, here.scaled * b.vy
    elastic = -(1 - e * e) * closing * closing / 2 / (per_a + per_b)
    _note(scratch, time, first, second, nx, ny, closing, impulse, depth, late, tangential, elastic)
    if here.apart != 0:
        _put_apart(here, a, b, pair, nx, ny)
    return float(parting)


@kernel
def _push(
    law: Record,
    a: Record,
    b: Record,
    pair: bool,
    nx: float,
    ny: float,
    along_n: float,
    along_t: float,
    per_a: float,
    per_b: float,
) -> None:
    """Give two bodies an impulse along the normal and the tangent, kg px/s."""
    x, y = along_n * nx - along_t * ny, along_n * ny + along_t * nx
    swapped = law.masses == Masses.SWAPPED and pair
    to_a, to_b = law.first_share * (per_b if swapped else per_a), law.second_share * (per_a if swapped else per_b)
    a.vx -= x * to_a
    a.vy -= y * to_a
    if pair:
        b.vx += x * to_b
        b.vy += y * to_b


@kernel
def _part(law: Record, a: Record, b: Record, nx: float, ny: float, depth: float) -> None:
    """Push two balls apart by their overlap, as the law does."""
    of_a, of_b = 0.0, 0.0
    if law.pair_place == Place.HALVES:
        of_a = of_b = depth / 2
    elif law.pair_place == Place.BY_MASS:
        of_a, of_b = depth * b.mass / (a.mass + b.mass), depth * a.mass / (a.mass + b.mass)
    a.x -= of_a * nx
    a.y -= of_a * ny
    b.x += of_b * nx
    b.y += of_b * ny


@kernel
def _resolve_in_time(group: Group, law: Record, scratch: Scratch, i: int, j: int, time: float) -> None:
    """Resolve a contact of bodies that have just met."""
    ball = scratch.ball
    a = ball[i]
    if j >= 0:
        b = ball[j]
        nx, ny, distance = unit(b.x - a.x, b.y - a.y)
        depth = a.radius + b.radius - distance
        returns = a.elasticity * b.elasticity * ((a.vx - b.vx) * nx + (a.vy - b.vy) * ny)
        hop = ((a.ax - b.ax) * nx + (a.ay - b.ay) * ny) * HOP_TIME / 2
        _release(law, b)
    else:
        piece = group.piece[~j]
        nx, ny, distance = normal_to(a, piece)
        depth = a.radius + piece.half_thickness - distance
        returns = a.elasticity * piece.elasticity * (a.vx * nx + a.vy * ny)
        hop = 0.0 if piece.length > 0 else (law.gx * nx + law.gy * ny) * HOP_TIME / HOPS_ROUND_END / 2
    if hop > 0 and returns < hop:
        scratch.tally[1] = 1  # balls lean on each other, or one goes round an edge
    carrier = a.carrier
    _release(law, a)
    times, parting = _times(law, np.int64(a.number), _number_of(group, j, ball)), 0.0
    for _ in range(times):
        parting = _resolve(group, law, scratch, i, j, nx, ny, depth, time)
    if times == 2:
        a.carrier = ~j if j < 0 else -1  # it goes on into the wall, without meeting that again in this step
    if j >= 0:
        _part(law, a, ball[j], nx, ny, max(depth, 0.0))
    if j < 0 and group.piece[~j].length > 0 and a.carrier < 0:
        pull = law.gx * nx + law.gy * ny
        away = -(a.vx * nx + a.vy * ny)
        if pull > 0 and parting >= 0 and abs(away) <= pull * CONTACT_TIME / 2 + 1e-12 * (abs(a.vx) + abs(a.vy)):
            a.vx += away * nx
            a.vy += away * ny
            a.carrier = carrier
            if not _carry(group, law, a, ~j, nx, ny):
                scratch.tally[1] = 1


@kernel
def _end_of_slip(group: Group, law: Record, ball: NDArray[np.void], left: float) -> tuple[float, int]:
    """Return when the first of the balls that slide begins to roll, within a time (s)."""
    best, who = NEVER, -1
    for i in range(len(ball)):
        if ball[i].carrier >= 0 and ball[i].slips_for < min(best, left):
            best, who = max(0.0, float(ball[i].slips_for)), i
    return best, who


@kernel
def _on_faces(group: Group, ball: NDArray[np.void]) -> bool:
    """Return whether each ball that a face carries is still on it, and not beyond its end."""
    for i in range(len(ball)):
        b = ball[i]
        if b.carrier >= 0 and b.ax * b.ax + b.ay * b.ay + b.vx * b.vx + b.vy * b.vy > 0:
            piece = group.piece[b.carrier]
            along = (b.x - piece.x) * piece.tx + (b.y - piece.y) * piece.ty
            if piece.wall >= ARENA_COUNT and not 0 <= along <= piece.length:
                return False
    return True


@kernel
def _let_roll(group: Group, law: Record, b: Record) -> None:
    """Let a ball that slides on a face roll from now on."""
    p = np.int64(b.carrier)
    nx, ny, _ = normal_to(b, group.piece[p])
    b.spin = -(b.vy * nx - b.vx * ny) / b.radius
    _carry(group, law, b, p, nx, ny)


@kernel
def _run_in_time(group: Group, law: Record, scratch: Scratch, dt: float) -> bool:
    """Do a step from contact to contact. Returns whether it came to its end."""
    ball, left = scratch.ball, dt
    for i in range(len(ball)):
        _plan(group, law, scratch, i, left)
    for _ in range(MAX_EVENTS + EVENTS_PER_BALL * len(ball)):
        time, i = _next_contact(law, scratch, left)
        rolls, who = _end_of_slip(group, law, ball, left)
        if who < 0 or rolls >= time:
            rolls, who = time, -1
        if who < 0 and i < 0:
            _fly(scratch, left)
            return bool(scratch.tally[1] == 0 and _on_faces(group, ball))
        _fly(scratch, rolls)
        left -= rolls
        if who >= 0:
            _let_roll(group, law, ball[who])
            _plan_again(group, law, scratch, who, left)
            continue
        j = scratch.partner[i]
        _resolve_in_time(group, law, scratch, i, j, dt - left)
        if scratch.tally[1]:
            return False
        _plan_again(group, law, scratch, i, left)
        if j >= 0:
            _plan_again(group, law, scratch, j, left)
    return False


@kernel
def _resolve_overlap(group: Group, law: Record, scratch: Scratch, i: int, j: int) -> None:
    """Resolve the contact of a ball with ball j or ~piece j, if they overlap, and part them as the law does."""
    a, pair = scratch.ball[i], j >= 0
    b = scratch.ball[j if pair else i]
    first, second = np.int64(a.number), _number_of(group, j, scratch.ball)
    if pair:
        nx, ny, distance = unit(b.x - a.x, b.y - a.y)
        depth = a.radius + b.radius - distance
    else:
        depth = depth_in(a, group.piece[~j])
        nx, ny, _ = normal_to(a, group.piece[~j])
    if depth + _offset(law, first, second) <= 0 or _is_missed(law, first, second):
        return
    if pair and pass_through(a.filter, b.filter):
        return
    closing = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny if pair else a.vx * nx + a.vy * ny
    parting = 0.0
    if_parting = law.pair_parting if pair else law.wall_parting
    if closing > 0 or if_parting == Parting.RESOLVE:
        for _ in range(_times(law, first, second)):
            parting = _resolve(group, law, scratch, i, j, nx, ny, depth, group.dt)
    elif if_parting == Parting.NONE:
        return
    if pair and law.pair_place == Place.BEGIN:
        a.x, a.y, b.x, b.y = group.ball[i].x, group.ball[i].y, group.ball[j].x, group.ball[j].y
    elif pair:
        _part(law, a, b, nx, ny, depth)
    else:
        _put_back(group, law, scratch, i, ~j, nx, ny, depth, closing, parting)


@kernel
def _put_back(
    group: Group,
    law: Record,
    scratch: Scratch,
    i: int,
    p: int,
    nx: float,
    ny: float,
    depth: float,
    closing: float,
    parting: float,
) -> None:
    """Put a ball that was found in a wall where the law has it. closing, parting: px/s, before and after."""
    b, back = scratch.ball[i], 0.0
    if law.wall_place in (Place.REFLECT, Place.FALLEN):
        here = law if _concerns(law, np.int64(b.number), np.int64(~group.piece[p].wall)) else scratch.plain[0]
        back = (1 + _restitution(here, b.elasticity * group.piece[p].elasticity)) * depth
    elif law.wall_place == Place.MIRROR:
        back = 2 * depth
    elif law.wall_place == Place.ON:
        back = depth
    elif law.wall_place == Place.BEGIN_ACROSS:
        back = (b.x - group.ball[i].x) * nx + (b.y - group.ball[i].y) * ny
    elif law.wall_place == Place.BEGIN:
        b.x, b.y = group.ball[i].x, group.ball[i].y
    b.x -= back * nx
    b.y -= back * ny
    if law.wall_place == Place.FALLEN and closing > 0 and parting >= 0:
        tangential = scratch.met[min(scratch.tally[0], len(scratch.met)) - 1].tangential
        late = min(depth / closing, group.dt) * tangential / b.mass
        b.x += late * ny
        b.y -= late * nx


@kernel
def _run_one_by_one(group: Group, law: Record, scratch: Scratch, dt: float) -> None:
    """Do a step that moves each ball and resolves its contacts before the next one moves."""
    n, walls = len(scratch.ball), len(group.piece)
    for i in range(n):
        move(law, scratch.ball[i], dt)
        for k in range(walls + n):
            j = k - walls
            if j < 0:
                _resolve_overlap(group, law, scratch, i, ~k)
            elif j > i or (j < i and law.order == Order.WALLS_FIRST):
                _resolve_overlap(group, law, scratch, min(i, j), max(i, j))


@kernel
def _resolve_together(group: Group, law: Record, scratch: Scratch, fall_x: float, fall_y: float, kept: float) -> None:
    """Solve the contacts of all that overlap where they are together, and part them as the law does."""
    ball = scratch.ball
    count = find_touches(ball, group.piece, scratch.gap, scratch.touch, 0)
    if count > len(scratch.touch):
        scratch.tally[1] = 1
        return
    solve_together(ball, scratch.touch[:count], fall_x, fall_y, kept, scratch.room)
    for k in range(count):
        t = scratch.touch[k]
        a = ball[t.first]
        if t.impulse > 0:
            first, second = np.int64(a.number), _number_of(group, t.second, ball)
            elastic = -t.impulse * (t.closing - t.bounce) / 2
            met = t.closing, t.impulse, t.depth, t.late, t.tangential
            _note(scratch, group.dt, first, second, t.nx, t.ny, *met, elastic)
        if t.second >= 0:
            _part(law, a, ball[t.second], t.nx, t.ny, t.depth)
        elif law.wall_place == Place.ON:
            a.x -= t.depth * t.nx
            a.y -= t.depth * t.ny


@kernel
def _resolve_all(group: Group, law: Record, scratch: Scratch, fall_x: float, fall_y: float, kept: float) -> None:
    """Resolve the contacts of all that overlap where they are. fall_x, fall_y, kept: as for `solve_together`."""
    if law.order == Order.TOGETHER:
        _resolve_together(group, law, scratch, fall_x, fall_y, kept)
        return
    n = len(scratch.ball)
    for turn in range(2):
        if (turn == 0) != (law.order == Order.PAIRS_FIRST):
            for i in range(n):
                for p in range(len(group.piece)):
                    _resolve_overlap(group, law, scratch, i, ~p)
        else:
            for k in range(n):
                i = n - 1 - k if law.order == Order.REVERSED else k
                for m in range(i + 1, n):
                    j = n + i - m if law.order == Order.REVERSED else m
                    _resolve_overlap(group, law, scratch, i, j)


@kernel
def _run_in_steps(group: Group, law: Record, scratch: Scratch, dt: float) -> None:
    """Do a step that finds contacts where the balls are after its move, or before."""
    ball = scratch.ball
    if law.when == When.ONE_BY_ONE:
        _run_one_by_one(group, law, scratch, dt)
        return
    fallen = dt if law.when == When.AFTER_MOVE and law.rebound == 1 else 0.0
    kept = kept_in(law, fallen) if fallen > 0 and law.slows_first == Slows.AFTER_MOVE else 1.0
    for turn in range(2):
        if (turn == 1) == (law.when == When.AFTER_MOVE):
            _resolve_all(group, law, scratch, law.gx * fallen, law.gy * fallen, kept)
        for i in range(len(ball) if turn == 0 else 0):
            move(law, ball[i], dt)
    for i in range(len(ball) if law.after == 1 else 0):
        ball[i].vx += law.gx * dt
        ball[i].vy += law.gy * dt


@kernel
def _finish(law: Record, ball: NDArray[np.void], dt: float) -> None:
    """Do what a law does to every ball after a step."""
    for i in range(len(ball)):
        b = ball[i]
        b.x += law.dx
        b.y += law.dy
        if law.slows_first == Slows.LAST or (law.slows_first >= Slows.BEFORE_MOVE and law.when == When.IN_TIME):
            slow(law, b, dt)
        speed = math.hypot(b.vx, b.vy)
        if speed > law.cap:
            b.vx *= law.cap / speed
            b.vy *= law.cap / speed


@kernel
def run_law(group: Group, law: Record, scratch: Scratch) -> bool:
    """Do a step by a law. Returns whether it came to its end."""
    for i in range(len(group.ball)):
        scratch.ball[i] = group.ball[i]
        _release(law, scratch.ball[i])
        if law.slows_first == Slows.FIRST:
            slow(law, scratch.ball[i], group.dt * law.clock)
    scratch.tally[0] = scratch.tally[1] = 0
    scratch.elastic[0] = 0.0
    dt, ended = group.dt * law.clock, True
    if law.when == When.IN_TIME:
        ended = _run_in_time(group, law, scratch, dt)
        for i in range(len(scratch.ball)):
            b = scratch.ball[i]
            b.x += (law.theta - 0.5) * law.gx * dt * dt
            b.y += (law.theta - 0.5) * law.gy * dt * dt
    else:
        _run_in_steps(group, law, scratch, dt)
        ended = scratch.tally[1] == 0
    _finish(law, scratch.ball, dt)
    return bool(ended)


@entry
def run_laws(
    group: Group, laws: NDArray[Any], scratch: Scratch, after: Floats, met: NDArray[np.void], counts: Integers
) -> None:
    """Do the same step by each of some laws.

    after: (laws, k, 5), for x, y, vx, vy and spin, NaN where a step has no end; met: (laws, some) MET, for the first
    contacts, and counts: (laws,) of all.
    """
    for number in range(len(laws)):
        ended = run_law(group, laws[number], scratch)
        for i in range(len(scratch.ball)):
            b = scratch.ball[i]
            after[number, i, 0], after[number, i, 1] = b.x, b.y
            after[number, i, 2], after[number, i, 3], after[number, i, 4] = b.vx, b.vy, b.spin
            if not ended:
                after[number, i, :] = np.nan
        counts[number] = scratch.tally[0]
        for k in range(min(scratch.tally[0], met.shape[1])):
            met[number, k] = scratch.met[k]
