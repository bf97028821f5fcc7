"""All contacts of a step solved together, as a solver of impulses does that converges.

The bodies that overlap are found where they are. Each contact then ends with a relative velocity of at least -e times
that of before, and its impulse pushes or is 0: the complementarity problem that solvers such as Pymunk's iterate on,
by the method of Gauss and Seidel, here until nothing changes. Friction obeys Coulomb's law with each impulse.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, kernel
from sandbox.engines.exact.support import normal_to, unit
from sandbox.engines.laws import time_since_touch
from sandbox.quantity import pass_through
from sandbox.scene.walls import ARENA_COUNT
from sandbox.state import Floats, Integers

TOUCH: Final = np.dtype(
    [
        ("first", "i8"),  # place in the group
        ("second", "i8"),  # likewise, or ~piece
        ("nx", "f8"),  # unit normal, from the first to the second
        ("ny", "f8"),
        ("depth", "f8"),  # px
        ("reach", "f8"),  # px, between the centres when the two touch; infinite for a straight wall
        ("late", "f8"),  # s since they touched, as the solver gets them; infinite if they part
        ("per_mass", "f8"),  # 1/kg, of both bodies
        ("e", "f8"),
        ("mu", "f8"),
        ("closing", "f8"),  # px/s, as the solver gets it
        ("bounce", "f8"),  # px/s, at which the two have to part; of two that part already, they may approach at -bounce
        ("impulse", "f8"),  # kg px/s
        ("tangential", "f8"),
        ("aside", "f8"),  # kg px/s along the tangent, by the turn of the normal in a step
        ("drift", "f8"),  # tangent of the largest turn
        ("wish", "f8"),  # px/s, the closing speed that is to become 0
        ("slide_wish", "f8"),  # px/s, the slip that is
        ("place", "i8"),  # in linear equations
        ("old", "f8"),  # kg px/s, impulses of before
        ("old_tangential", "f8"),
        ("old_aside", "f8"),
        ("way", "f8"),  # kg px/s, direction in which the impulses change
        ("slide_way", "f8"),
    ]
)
TOUCHES_PER_BALL: Final = 12  # that there is room for: discs of one size have 3, and walls, before a step and after it
MAX_ROUNDS: Final = 2000  # of a solver: what is left over of a chain of 24 balls falls by a tenth in less than 100
MAX_WORK: Final = 300_000  # rounds times contacts: 6 ms
MAX_DIRECT: Final = 32  # contacts that are solved by elimination, once for each change of a contact's state
MAX_EQUATIONS: Final = 256  # that are solved by elimination, in 10 ms
BEFORE_DIRECT: Final = 50  # rounds: most converge sooner; mass ratios of 1,000 need thousands
SINGULAR: Final = 1e-12  # of the largest coefficient: a pivot that is rounding
OPEN: Final = 2  # state of a contact without impulse
STICKING: Final = 0  # of one with friction enough; sliding ones have the sign of the friction, 1 or -1
ROUNDS: Final = 100  # of Gauss and Seidel's method, before conjugate gradients
SOLVED: Final = 1e-24  # of the square of the first slope, at which a fit is one
CONVERGED: Final = 1e-14  # of the largest speed, by which a round changes one at most


class Room(NamedTuple):
    """What solving directly works in.

    matrix: (MAX_EQUATIONS, MAX_EQUATIONS + 1); state: (MAX_EQUATIONS,).
    """

    matrix: Floats
    state: Integers


def room_for_contacts() -> Room:
    """Return what solving directly works in."""
    return Room(np.zeros((MAX_EQUATIONS, MAX_EQUATIONS + 1)), np.zeros(MAX_EQUATIONS, np.int64))


@kernel
def depth_in(b: Record, piece: Record) -> float:
    """Return how deep a ball is in a piece of wall, px; -inf if it is not beside it."""
    rx, ry = b.x - piece.x, b.y - piece.y
    along = rx * piece.tx + ry * piece.ty
    reach = b.radius + piece.half_thickness
    if piece.length == 0:
        is_peg = piece.tx == 0 and piece.ty == 0
        return reach - math.hypot(rx, ry) if along > 0 or is_peg else -math.inf
    off = ry * piece.tx - rx * piece.ty
    if piece.wall < ARENA_COUNT:
        return float(reach - off)
    return reach - abs(off) if 0 <= along <= piece.length else -math.inf


@kernel
def reach_of(a: Record, b: Record, piece: NDArray[Any], j: int) -> float:
    """Return how far the centre of ball a is from ball b, or from the end ~piece j, when they touch, px.

    It is infinite for the side of a wall.
    """
    if j >= 0:
        return float(a.radius + b.radius)
    return float(a.radius + piece[~j].half_thickness) if piece[~j].length == 0 else math.inf


@kernel
def time_overlapped(a: Record, b: Record, pair: bool, depth: float, closing: float, reach: float) -> float:
    """Return how long ago ball a touched ball b, or a wall if they are no pair, s. See `time_since_touch`."""
    speed = math.hypot(a.vx - b.vx, a.vy - b.vy) if pair else math.hypot(a.vx, a.vy)
    return float(time_since_touch(depth, closing, speed, reach))


@kernel
def find_touches(ball: NDArray[Any], piece: NDArray[Any], gap: Floats, touch: NDArray[Any], count: int) -> int:
    """Find the bodies that overlap, or are apart by less than their gaps, after the first `count` of `touch`.

    gap: (k,) px, of each ball. Returns their number; only what has room is kept.
    """
    for i in range(len(ball)):
        a = ball[i]
        for p in range(len(piece)):
            depth = depth_in(a, piece[p])
            if depth <= -gap[i]:
                continue
            if count < len(touch):
                t = touch[count]
                t.first, t.second, t.depth, t.per_mass = i, ~p, depth, 1 / a.mass
                t.nx, t.ny, _ = normal_to(a, piece[p])
                t.reach = reach_of(a, a, piece, ~p)
                t.e, t.mu, t.drift = a.elasticity * piece[p].elasticity, a.friction * piece[p].friction, 0.0
            count += 1
        for j in range(i + 1, len(ball)):
            b = ball[j]
            rx, ry, reach = b.x - a.x, b.y - a.y, a.radius + b.radius + gap[i] + gap[j]
            if abs(rx) >= reach or abs(ry) >= reach or rx * rx + ry * ry >= reach * reach:
                continue
            if pass_through(a.filter, b.filter):
                continue
            if count < len(touch):
                t = touch[count]
                t.first, t.second, t.per_mass = i, j, 1 / a.mass + 1 / b.mass
                t.nx, t.ny, distance = unit(rx, ry)
                t.reach = reach_of(a, b, piece, j)
                t.depth = t.reach - distance
                t.e, t.mu, t.drift = a.elasticity * b.elasticity, a.friction * b.friction, 0.0
            count += 1
    return count


@kernel
def closing_speed(ball: NDArray[Any], t: Record) -> float:
    """Return the speed at which the two bodies of a contact approach, px/s."""
    a = ball[t.first]
    if t.second < 0:
        return float(a.vx * t.nx + a.vy * t.ny)
    b = ball[t.second]
    return float((a.vx - b.vx) * t.nx + (a.vy - b.vy) * t.ny)


@kernel
def slip_speed(ball: NDArray[Any], t: Record) -> float:
    """Return the slip of the first's rim on the second's, px/s."""
    a = ball[t.first]
    slip = a.vy * t.nx - a.vx * t.ny + a.radius * a.spin
    if t.second >= 0:
        b = ball[t.second]
        slip += b.radius * b.spin - (b.vy * t.nx - b.vx * t.ny)
    return float(slip)


@kernel
def push(ball: NDArray[Any], t: Record, normal: float, tangential: float) -> None:
    """Give the two bodies of a contact an impulse along its normal and its tangent, kg px/s."""
    x, y = normal * t.nx - tangential * t.ny, normal * t.ny + tangential * t.nx
    a = ball[t.first]
    a.vx -= x / a.mass
    a.vy -= y / a.mass
    a.spin -= 2 * tangential / (a.mass * a.radius)
    if t.second >= 0:
        b = ball[t.second]
        b.vx += x / b.mass
        b.vy += y / b.mass
        b.spin -= 2 * tangential / (b.mass * b.radius)


@kernel
def _response(ball: NDArray[Any], a: Record, normal: float, tangential: float, b: Record, slips: bool) -> float:
    """Return how an impulse (kg px/s) of contact a changes the closing speed of contact b, or its slip, px/s."""
    x, y = normal * a.nx - tangential * a.ny, normal * a.ny + tangential * a.nx
    along_x, along_y = (-b.ny, b.nx) if slips else (b.nx, b.ny)
    total = 0.0
    for end_a in range(2):
        i = a.second if end_a else a.first
        for end_b in range(2):
            if i < 0 or i != (b.second if end_b else b.first):
                continue
            sign = 1.0 if end_a == end_b else -1.0
            total -= sign * (x * along_x + y * along_y) / ball[i].mass
            if slips:
                total -= 2 * tangential / ball[i].mass
    return total


@kernel
def _eliminate(matrix: Floats, size: int) -> bool:
    """Solve linear equations. matrix: (size, size + 1), whose last column gets the solution. False if singular."""
    largest = 0.0
    for row in range(size):
        for column in range(size):
            largest = max(largest, abs(matrix[row, column]))
    for column in range(size):
        pivot = column
        for row in range(column + 1, size):
            pivot = row if abs(matrix[row, column]) > abs(matrix[pivot, column]) else pivot
        if abs(matrix[pivot, column]) <= SINGULAR * largest:
            return False
        for k in range(column, size + 1):
            matrix[column, k], matrix[pivot, k] = matrix[pivot, k], matrix[column, k]
        for row in range(size):
            share = matrix[row, column] / matrix[column, column] if row != column else 0.0
            if share != 0:
                for k in range(column, size + 1):
                    matrix[row, k] -= share * matrix[column, k]
    for row in range(size):
        matrix[row, size] /= matrix[row, row]
    return True


@kernel
def _fill_rows(
    ball: NDArray[Any], touch: NDArray[Any], state: Integers, t: Record, sticks: bool, matrix: Floats
) -> None:
    """Fill the rows of a contact's closing speed, and of its slip if it sticks, with what all impulses do to them."""
    for d in range(len(touch)):
        a = touch[d]
        if state[d] == OPEN:
            continue
        share = 0.0 if state[d] == STICKING else state[d] * a.mu
        columns = 2 if state[d] == STICKING and a.mu > 0 else 1
        for row in range(2 if sticks else 1):
            matrix[t.place + row, a.place] = -_response(ball, a, 1.0, share, t, row == 1)
            if columns == 2:
                matrix[t.place + row, a.place + 1] = -_response(ball, a, 0.0, 1.0, t, row == 1)


@kernel
def _solve_state(ball: NDArray[Any], touch: NDArray[Any], state: Integers, matrix: Floats) -> bool:
    """Solve for the impulses of contacts of a given state: OPEN, STICKING, or sliding, 1 or -1. Returns whether it can.

    Contacts get their `wish` of closing speed and `slide_wish` of slip changed to 0.
    """
    size, rough = 0, 0
    for c in range(len(touch)):
        t = touch[c]
        t.place = size
        size += 0 if state[c] == OPEN else 2 if state[c] == STICKING and t.mu > 0 else 1
        rough = max(rough, 1 if t.mu > 0 else 0)
    if size > min(len(matrix), (2 + rough) * len(ball)):  # more than what balls can do makes them singular
        return False
    for c in range(len(touch)):
        if state[c] == OPEN:
            continue
        t, sticks = touch[c], state[c] == STICKING and touch[c].mu > 0
        matrix[t.place, size] = t.wish
        if sticks:
            matrix[t.place + 1, size] = t.slide_wish
        _fill_rows(ball, touch, state, t, sticks, matrix)
    if not _eliminate(matrix, size):
        return False
    for c in range(len(touch)):
        t = touch[c]
        t.impulse = t.tangential = 0.0
        if state[c] != OPEN:
            t.impulse = matrix[t.place, size]
            t.tangential = t.impulse * state[c] * t.mu
            if state[c] == STICKING:
                t.tangential = matrix[t.place + 1, size] if t.mu > 0 else 0.0
    return True


@kernel
def _next_state(ball: NDArray[Any], touch: NDArray[Any], state: Integers, slight: float) -> bool:
    """Change the state of the contact that is furthest from what its state says. Returns whether there is any."""
    worst, who, what = slight, -1, OPEN
    for c in range(len(touch)):
        t = touch[c]
        closing, slip = t.wish, t.slide_wish
        for d in range(len(touch)):
            a = touch[d]
            if state[d] != OPEN:
                closing += _response(ball, a, a.impulse, a.tangential, t, False)
                slip += _response(ball, a, a.impulse, a.tangential, t, True)
        if state[c] == OPEN:
            off, into = closing, STICKING
        elif t.impulse < 0:
            off, into = -t.impulse * t.per_mass, OPEN
        elif state[c] == STICKING:
            off, into = (abs(t.tangential) - t.mu * t.impulse) * 3 * t.per_mass if t.mu > 0 else 0.0, 1
            into = 1 if t.tangential > 0 else -1
        else:
            off, into = -slip * state[c], STICKING
        if off > worst:
            worst, who, what = off, c, into
    if who >= 0:
        state[who] = what
    return who >= 0


@kernel
def _solve_directly(ball: NDArray[Any], touch: NDArray[Any], room: Room, fastest: float) -> bool:
    """Solve contacts together exactly, from the state at which iteration has arrived. Returns whether that is found."""
    state = room.state[: len(touch)]
    for c in range(len(touch)):
        t = touch[c]
        push(ball, t, -t.impulse, -t.tangential)
    for c in range(len(touch)):
        t = touch[c]
        t.wish, t.slide_wish = closing_speed(ball, t) + t.bounce, slip_speed(ball, t)
        state[c] = OPEN
        if t.impulse > 0:
            state[c] = STICKING if abs(t.tangential) < t.mu * t.impulse or t.mu == 0 else 1 if t.tangential > 0 else -1
    solved = False
    for _ in range(4 * len(touch) + 4):
        if not _solve_state(ball, touch, state, room.matrix):
            break
        if not _next_state(ball, touch, state, 1e-13 * fastest):
            solved = True
            break
    if solved:
        for c in range(len(touch)):
            push(ball, touch[c], touch[c].impulse, touch[c].tangential)
    return solved


@kernel
def largest_speed(ball: NDArray[Any]) -> float:
    """Return the largest component of a velocity, or speed of a rim, px/s."""
    fastest = 0.0
    for i in range(len(ball)):
        fastest = max(fastest, abs(ball[i].vx), abs(ball[i].vy), abs(ball[i].spin) * ball[i].radius)
    return float(fastest)


@kernel
def square_of(b: Record, vx: float, vy: float, spin: float) -> float:
    """Return the square of a velocity and a spin of a ball: twice the energy, kg px²/s²."""
    return float(b.mass * (vx * vx + vy * vy + (b.radius * spin) ** 2 / 2))


@kernel
def solve_together(
    ball: NDArray[Any], touch: NDArray[Any], fall_x: float, fall_y: float, kept: float, room: Room
) -> None:
    """Solve contacts together, and change the velocities of their balls.

    fall_x, fall_y, kept: the velocities are kept times those which bounce, and this in px/s.
    """
    fastest = largest_speed(ball)
    for k in range(len(touch)):
        t = touch[k]
        t.closing = closing_speed(ball, t)
        a, b, pair = ball[t.first], ball[max(t.second, 0)], t.second >= 0
        t.late = time_overlapped(a, b, pair, t.depth, t.closing, t.reach)
        fallen = fall_x * t.nx + fall_y * t.ny if t.second < 0 else 0.0
        t.bounce = t.e * (t.closing - fallen) / kept
        t.impulse = t.tangential = 0.0
    most = min(MAX_ROUNDS, MAX_WORK // max(1, len(touch)))
    for round_number in range(most):
        changed = 0.0
        for k in range(len(touch)):
            t = touch[k]
            normal = max(0.0, t.impulse + (closing_speed(ball, t) + t.bounce) / t.per_mass)
            tangential = t.tangential
            if t.mu > 0:
                limit = t.mu * normal
                tangential = max(-limit, min(limit, t.tangential + slip_speed(ball, t) / (3 * t.per_mass)))
            of_normal, of_tangential = normal - t.impulse, tangential - t.tangential
            if of_normal != 0 or of_tangential != 0:
                push(ball, t, of_normal, of_tangential)
                changed = max(changed, abs(of_normal) * t.per_mass, abs(of_tangential) * t.per_mass)
            t.impulse, t.tangential = normal, tangential
        if changed <= CONVERGED * fastest:
            return
        if round_number == BEFORE_DIRECT and len(touch) <= MAX_DIRECT:
            for k in range(len(touch)):
                touch[k].old, touch[k].old_tangential = touch[k].impulse, touch[k].tangential
            if _solve_directly(ball, touch, room, fastest):
                return
            for k in range(len(touch)):
                t = touch[k]
                t.impulse, t.tangential = t.old, t.old_tangential
                push(ball, t, t.impulse, t.tangential)


@kernel
def fit_freely(ball: NDArray[Any], touch: NDArray[Any]) -> None:
    """Take from velocities and spins what impulses along contacts explain, in either direction, by least squares.

    As `fit_impulses`. Where contacts are more than what balls can do, the impulses are the least that do it.
    """
    for c in range(len(touch)):
        touch[c].impulse = touch[c].tangential = 0.0
    _fit_by_gradients(ball, touch, True, False, 0.0)


@kernel
def _fit_by_gradients(ball: NDArray[Any], touch: NDArray[Any], turns: bool, only_pushing: bool, enough: float) -> None:
    """Change impulses to explain more, by the method of conjugate gradients (Hestenes and Stiefel, 1952).

    only_pushing: only those that push so far; turns, enough: as in `fit_impulses`.
    """
    first = before = 0.0
    for turn in range(min(MAX_ROUNDS, MAX_WORK // max(1, len(touch)))):
        slope = _set_slopes(ball, touch, only_pushing)
        first = slope if turn == 0 else first
        if slope <= SOLVED * first or largest_speed(ball) <= enough:
            return
        response = _set_directions(ball, touch, slope / before if turn > 0 else 0.0, turns)
        if response <= 0:
            return
        _go(ball, touch, slope / response)
        before = slope


@kernel
def _set_slopes(ball: NDArray[Any], touch: NDArray[Any], only_pushing: bool) -> float:
    """Set what impulses along each contact are to change: `wish`, `slide_wish`. Returns the square, kg px²/s²."""
    slope = 0.0
    for c in range(len(touch)):
        t = touch[c]
        closing, slip = closing_speed(ball, t), slip_speed(ball, t) if t.mu > 0 else 0.0
        if only_pushing and t.impulse <= 0:
            closing = slip = 0.0
        t.wish, t.slide_wish = -closing, -slip
        slope += closing * closing / t.per_mass + slip * slip / (3 * t.per_mass)
    return slope


@kernel
def _set_directions(ball: NDArray[Any], touch: NDArray[Any], share: float, turns: bool) -> float:
    """Set in which direction impulses change: as wished, and a share of the last. Returns the square of what that does.

    What it does to each ball is left in `ax`, `ay` and `turning`; the square is in kg px²/s².
    """
    for i in range(len(ball)):
        ball[i].ax = ball[i].ay = ball[i].turning = 0.0
    for c in range(len(touch)):
        t = touch[c]
        t.way = t.wish / t.per_mass + share * t.way
        t.slide_way = t.slide_wish / (3 * t.per_mass) + share * t.slide_way
        x, y = t.way * t.nx - t.slide_way * t.ny, t.way * t.ny + t.slide_way * t.nx
        for end in range(2 if t.second >= 0 else 1):
            b, sign = ball[t.second if end else t.first], 1.0 if end else -1.0
            b.ax += sign * x / b.mass
            b.ay += sign * y / b.mass
            b.turning -= 2 * t.slide_way / (b.mass * b.radius) if turns else 0.0
    square = 0.0
    for i in range(len(ball)):
        b = ball[i]
        square += square_of(b, b.ax, b.ay, b.turning)
    return square


@kernel
def _go(ball: NDArray[Any], touch: NDArray[Any], share: float) -> None:
    """Change impulses by a share of their directions, and what is left of the balls' velocities and spins."""
    for c in range(len(touch)):
        touch[c].impulse += share * touch[c].way
        touch[c].tangential += share * touch[c].slide_way
    for i in range(len(ball)):
        b = ball[i]
        b.vx -= share * b.ax
        b.vy -= share * b.ay
        b.spin -= share * b.turning


@kernel
def could_explain_anything(ball: NDArray[Any], touch: NDArray[Any]) -> bool:
    """Return whether impulses along contacts explain any velocities and spins, those of no order as well.

    ball: their velocities are written. Contacts in loops do less than their number says.
    """
    for i in range(len(ball)):
        b = ball[i]
        b.vx, b.vy, b.spin = math.sin(1.0 + 9 * i), math.sin(2.0 + 7 * i * i), math.sin(3.0 + 5 * i) / b.radius
    fit_freely(ball, touch)
    return bool(largest_speed(ball) <= 0.01)  # of 1


@kernel
def fit_impulses(ball: NDArray[Any], touch: NDArray[Any], turns: bool, enough: float) -> None:
    """Take from velocities and spins what impulses that push can explain, by least squares.

    ball: its velocities are what is to be explained, and then what is left over, weighted by masses. The impulses are
    within Coulomb's cone, and along normals that turn by `drift` at most. turns: whether spins are explained too;
    enough: px/s, of what is left over.
    """
    for k in range(len(touch)):
        touch[k].impulse = touch[k].tangential = touch[k].aside = 0.0
    before, most = math.inf, min(MAX_ROUNDS, MAX_WORK // max(1, len(touch)))
    for _ in range(max(1, most // ROUNDS)):
        _fit_in_turn(ball, touch, turns, enough)
        left = largest_speed(ball)
        if left <= 0.1 * enough or left > 0.99 * before:
            return
        _fit_by_gradients(ball, touch, turns, True, 0.01 * enough)  # of which the next round keeps what pushes
        before = left


@kernel
def _fit_in_turn(ball: NDArray[Any], touch: NDArray[Any], turns: bool, enough: float) -> None:
    """Change impulses to explain more, each in its turn as if the others stayed (Gauss and Seidel).

    All go on by a share of how they have changed, which grows until that explains less (Nesterov, 1983; O'Donoghue and
    Candès, 2015).
    """
    momentum, before = 1.0, math.inf
    for k in range(len(touch)):
        t = touch[k]
        t.old, t.old_tangential, t.old_aside = t.impulse, t.tangential, t.aside
    for _ in range(ROUNDS):
        changed = 0.0
        for k in range(len(touch)):
            changed = max(changed, _fit_one(ball, touch[k], turns))
        if changed <= 0.01 * enough:
            return
        left = 0.0
        for i in range(len(ball)):
            left += square_of(ball[i], ball[i].vx, ball[i].vy, ball[i].spin)
        grown = (1 + math.sqrt(1 + 4 * momentum * momentum)) / 2
        share = (momentum - 1) / grown if left < before else 0.0
        momentum, before = grown if left < before else 1.0, left
        for k in range(len(touch)):
            t = touch[k]
            normal, tangential, aside = t.impulse - t.old, t.tangential - t.old_tangential, t.aside - t.old_aside
            t.old, t.old_tangential, t.old_aside = t.impulse, t.tangential, t.aside
            _take(ball, t, share * normal, share * tangential, turns)
            _take_aside(ball, t, share * aside)
            t.impulse, t.tangential, t.aside = (
                t.old + share * normal,
                t.old_tangential + share * tangential,
                t.old_aside + share * aside,
            )


@kernel
def _fit_one(ball: NDArray[Any], t: Record, turns: bool) -> float:
    """Take from the velocities what a contact explains besides the others. Returns by how much they change, px/s."""
    normal, along, changed = t.impulse - closing_speed(ball, t) / t.per_mass, 0.0, 0.0
    if t.mu > 0:
        along = t.tangential - slip_speed(ball, t) / (3 * t.per_mass)
        normal, along = _onto_cone(normal, math.sqrt(3.0) * along, math.sqrt(3.0) * t.mu)
        along /= math.sqrt(3.0)
        normal = max(normal, 0.0)
        changed = _take(ball, t, normal - t.impulse, along - t.tangential, turns)
        t.impulse, t.tangential = normal, along
        limit = t.drift * t.impulse
        aside = max(-limit, min(limit, t.aside - _sideways(ball, t) / t.per_mass))
    else:
        normal, aside = _onto_cone(normal, t.aside - _sideways(ball, t) / t.per_mass, t.drift)
        changed = _take(ball, t, normal - t.impulse, 0.0, turns)
        t.impulse = normal
    changed = max(changed, _take_aside(ball, t, aside - t.aside))
    t.aside = aside
    return float(changed)


@kernel
def _onto_cone(x: float, y: float, slope: float) -> tuple[float, float]:
    """Return the point of the cone |y| <= slope x that is nearest to one."""
    if x >= 0 and abs(y) <= slope * x:
        return x, y
    along = (x + slope * abs(y)) / (1 + slope * slope)
    return (along, math.copysign(slope * along, y)) if along > 0 else (0.0, 0.0)


@kernel
def _sideways(ball: NDArray[Any], t: Record) -> float:
    """Return the velocity of the first's centre past the second's, px/s."""
    a = ball[t.first]
    speed = a.vy * t.nx - a.vx * t.ny
    if t.second >= 0:
        b = ball[t.second]
        speed -= b.vy * t.nx - b.vx * t.ny
    return float(speed)


@kernel
def _take(ball: NDArray[Any], t: Record, normal: float, tangential: float, turns: bool) -> float:
    """Take from the velocities what an impulse explains. Returns by how much they change at most, px/s."""
    push(ball, t, -normal, -tangential)
    if not turns:
        ball[t.first].spin = ball[max(t.second, 0)].spin = 0.0
    return float(max(abs(normal), abs(tangential)) * t.per_mass)


@kernel
def _take_aside(ball: NDArray[Any], t: Record, impulse: float) -> float:
    """Likewise of an impulse across the normal that turns nothing."""
    a = ball[t.first]
    a.vx -= impulse * t.ny / a.mass
    a.vy += impulse * t.nx / a.mass
    if t.second >= 0:
        b = ball[t.second]
        b.vx += impulse * t.ny / b.mass
        b.vy -= impulse * t.nx / b.mass
    return float(abs(impulse) * t.per_mass)
