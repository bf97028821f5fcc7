"""What the contacts of a step leave unexplained: errors of a flight, or changes that a contact made besides."""

import math
from typing import NamedTuple

from sandbox.analysis.displacement import mends_overlap
from sandbox.analysis.findings import (
    Block,
    SceneConstants,
    Unexplained,
    enter,
    turn_energy,
)
from sandbox.analysis.replay import (
    Scratch,
    fly,
)
from sandbox.compiled import kernel
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.state import Contacts, Floats, Integers


class Flights(NamedTuple):
    """How an engine errs in flight, where no contact explains it.

    step: (n, 5), the first step in which a ball's velocity changed, it was put elsewhere, it was pushed out of an
    overlap, its spin changed, or it was damped: the columns VELOCITY_CHANGED, PUT_ELSEWHERE, PUSHED_OUT, SPIN_CHANGED
    and DAMPED; 0 if never; change: (n, 5, 2) px/s or px, by how much in that step, of a spin (rad/s, 0); before:
    (n, 5, 2) px/s, the velocity before it, or (spin, 0); gravity: px/s², what pulls at the balls; off_parabola: px/s²,
    by which, times the square of its length, a step ends off the parabola of that gravity; damping: the share of
    velocities left after a second.
    """

    step: Integers
    change: Floats
    before: Floats
    gravity: tuple[float, float] = (0.0, 0.0)
    off_parabola: tuple[float, float] = (0.0, 0.0)
    damping: float = 1.0


VELOCITY_CHANGED, PUT_ELSEWHERE, PUSHED_OUT, SPIN_CHANGED, DAMPED = range(KINDS_OF_FLIGHT := 5)


@kernel
def find_unexplained(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    unexplained: Unexplained,
    before: tuple[Floats, Floats, Floats],
    after: tuple[Floats, Floats, Floats],
    off_parabola: Floats,
) -> float:
    """Find what the contacts of a step leave unexplained, and enter what gravity does otherwise than the scene's.

    before, after: positions, velocities and spins, (n, 2) px and px/s, (n,) rad/s; off_parabola: as `Flights` has it,
    (2,). Returns the largest unexplained momentum of a ball without a contact in the step, kg px/s.
    """
    pull = math.hypot(constants.gravity[0], constants.gravity[1]) * constants.dt
    fastest, furthest, momentum, unflown = 0.0, 0.0, 0.0, False
    for ball in range(len(constants.mass)):
        fly(constants, block, scratch, ball, constants.dt)
        by_gravity = error = away = slight = 0.0
        for axis in range(2):
            moved = after[0][ball, axis] - before[0][ball, axis]
            by_gravity += (constants.fall[axis] - constants.gravity[axis]) * scratch.flown[ball, axis]
            off = off_parabola[axis] * constants.dt**2
            by_gravity -= constants.gravity[axis] * off
            unexplained.place[ball, axis] = moved - scratch.flown[ball, axis] - off
            unexplained.velocity[ball, axis] = after[1][ball, axis] - scratch.explained[ball, axis]
            error += abs(unexplained.velocity[ball, axis])  # no less than the length, which takes longer
            away += abs(unexplained.place[ball, axis])
            slight += abs(after[1][ball, axis]) + abs(before[1][ball, axis])
            other, sign = 1 - axis, 1 - 2 * axis
            lever = before[0][ball, axis] - constants.centre[axis]
            turned = lever * constants.fall[other] * constants.dt + off * after[1][ball, other]
            turned += lever * scratch.damped[ball, other]
            scratch.torque[0] += sign * constants.mass[ball] * turned
        radius = constants.radius[ball]
        unexplained.spin[ball], unexplained.spin_cause[ball] = after[2][ball] - scratch.spin[ball], Cause.UNTOLD
        turned, turns = radius * abs(unexplained.spin[ball]), radius * (abs(after[2][ball]) + abs(before[2][ball]))
        if turned <= NEGLIGIBLE * (slight + turns + pull):
            unexplained.spin_cause[ball], turned = Cause.ROUNDING, 0.0
        if by_gravity != 0:
            enter(block, Cause.GRAVITY, constants.mass[ball] * by_gravity, 0.0, 0.0)
        if error <= NEGLIGIBLE * (slight + pull):
            unexplained.cause[ball], error = Cause.ROUNDING, 0.0
        if scratch.last[ball] < 0:
            unexplained.unsteady[ball, 0], unexplained.unsteady[ball, 2] = error, turned
            fastest, momentum = max(fastest, error), max(momentum, constants.mass[ball] * error)
            if away > NEGLIGIBLE * constants.radius[ball] and not mends_overlap(
                constants, unexplained, before[0], ball, away
            ):
                furthest = max(furthest, away)
        else:
            unflown = unflown or not unexplained.flown[ball]
    if unflown:
        for ball in range(len(constants.mass)):
            if not unexplained.flown[ball] and scratch.last[ball] >= 0:
                unexplained.unsteady[ball, 0], unexplained.unsteady[ball, 1] = fastest, furthest
    return momentum


@kernel
def find_owners(
    constants: SceneConstants,
    scratch: Scratch,
    unexplained: Unexplained,
    contacts: Contacts,
    begin: int,
    end: int,
    within: Floats,
    elsewhere: float,
) -> None:
    """Find for each ball the contact of the step that changed its velocity besides its impulse, if one did.

    elsewhere: kg px/s, the largest unexplained momentum of a ball without a contact: if that is as large, the contact
    may have had no part in it. A velocity that changed after some part of a step displaces the ball by the rest of it;
    the contact that fits this best is taken, unless the change fits the start or the end of the step by far better, or
    is as large as in flight.
    """
    for k in range(begin, end):
        for side in range(2):
            ball = contacts[k].first if side == 0 else contacts[k].second
            if ball < 0 or unexplained.cause[ball] == Cause.ROUNDING:
                continue
            vx, vy = unexplained.velocity[ball, 0], unexplained.velocity[ball, 1]
            x, y = unexplained.place[ball, 0], unexplained.place[ball, 1]
            size = math.hypot(vx, vy)
            if size <= 3 * max(unexplained.unsteady[ball, 0], elsewhere / constants.mass[ball]):
                continue
            rest = constants.dt - within[k]
            score = math.hypot(x - rest * vx, y - rest * vy)
            if unexplained.owner[ball] < 0:
                slight = size * constants.dt / 1000
                from_start = math.hypot(x - constants.dt * vx, y - constants.dt * vy)
                at_end = math.hypot(x, y)
                if min(from_start, at_end) <= slight and score > 10 * slight:
                    scratch.score[ball] = min(from_start, at_end)
                else:
                    scratch.score[ball] = math.inf
            if score < scratch.score[ball]:
                scratch.score[ball], unexplained.owner[ball] = score, k


@kernel
def explain_places(
    constants: SceneConstants, block: Block, unexplained: Unexplained, within: Floats, ball: int
) -> None:
    """Enter the way that a ball flew since its velocity changed unexplained, under the same cause."""
    vx, vy = unexplained.velocity[ball, 0], unexplained.velocity[ball, 1]
    x, y = unexplained.place[ball, 0], unexplained.place[ball, 1]
    if unexplained.cause[ball] == Cause.ROUNDING:
        return
    if unexplained.owner[ball] >= 0:
        rest = constants.dt - within[unexplained.owner[ball]]
    else:
        rest = min(max((x * vx + y * vy) / (vx * vx + vy * vy), 0.0), constants.dt)
        if math.hypot(x - rest * vx, y - rest * vy) > math.hypot(vx, vy) * constants.dt / 100:
            return
    unexplained.place[ball, 0] -= rest * vx
    unexplained.place[ball, 1] -= rest * vy
    work = rest * (constants.gravity[0] * vx + constants.gravity[1] * vy)
    enter(block, unexplained.cause[ball], -constants.mass[ball] * work, 0.0, 0.0)


@kernel
def _note_flight(flights: Flights, ball: int, kind: int, step: int, change: Floats, before: Floats) -> None:
    """Note the first change of a kind of a ball in flight."""
    if flights.step[ball, kind] == 0:
        flights.step[ball, kind] = step
        for axis in range(2):
            flights.change[ball, kind, axis], flights.before[ball, kind, axis] = change[axis], before[axis]


@kernel
def _enter_spin(
    constants: SceneConstants,
    block: Block,
    unexplained: Unexplained,
    flights: Flights,
    ball: int,
    before: float,
    after: float,
    step: int,
) -> None:
    """Enter what is still unexplained of a ball's spin, rad/s before and after a step, as an impulse at its rim."""
    change, cause = unexplained.spin[ball], unexplained.spin_cause[ball]
    block.energy[cause] += turn_energy(constants, ball, after - change, change)
    if cause == Cause.ROUNDING:
        return
    enter(block, cause, 0.0, constants.mass[ball] * constants.radius[ball] * abs(change) / 2, 0.0)
    if cause == Cause.UNTOLD and flights.step[ball, SPIN_CHANGED] == 0:
        flights.step[ball, SPIN_CHANGED] = step
        flights.change[ball, SPIN_CHANGED, 0], flights.before[ball, SPIN_CHANGED, 0] = change, before


@kernel
def enter_unexplained(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    unexplained: Unexplained,
    flights: Flights,
    ball: int,
    before: tuple[Floats, Floats, Floats],
    after: tuple[Floats, Floats, Floats],
    step: int,
) -> None:
    """Enter what is still unexplained of a ball's change in a step."""
    change, place, cause = unexplained.velocity[ball], unexplained.place[ball], unexplained.cause[ball]
    vx, vy = after[1][ball, 0] - change[0] / 2, after[1][ball, 1] - change[1] / 2
    block.energy[cause] += constants.mass[ball] * (change[0] * vx + change[1] * vy)
    if cause != Cause.ROUNDING:
        enter(block, cause, 0.0, constants.mass[ball] * math.hypot(change[0], change[1]), 0.0)
        if cause == Cause.UNTOLD:
            _note_flight(flights, ball, VELOCITY_CHANGED, step, change, before[1][ball])
    if constants.left < 1 and (before[1][ball].any() or before[2][ball] != 0):
        _note_flight(flights, ball, DAMPED, step, scratch.damped[ball], before[1][ball])
    _enter_spin(constants, block, unexplained, flights, ball, before[2][ball], after[2][ball], step)
    energy, unsteady = -constants.mass[ball] * (constants.gravity[0] * place[0] + constants.gravity[1] * place[1]), 0.0
    if abs(place[0]) + abs(place[1]) <= NEGLIGIBLE * constants.radius[ball]:
        block.energy[Cause.ROUNDING] += energy
    else:
        moved = math.hypot(place[0], place[1])
        if mends_overlap(constants, unexplained, before[0], ball, moved):
            enter(block, Cause.PUSHED, energy, 0.0, moved)
            if unexplained.partner[ball] < 0:
                turned = place[0] * after[1][ball, 1] - place[1] * after[1][ball, 0]
                scratch.torque[0] += constants.mass[ball] * turned
            _note_flight(flights, ball, PUSHED_OUT, step, place, before[1][ball])
        else:
            unsteady = moved
            enter(block, Cause.PLACED, energy, 0.0, moved)
            _note_flight(flights, ball, PUT_ELSEWHERE, step, place, before[1][ball])
    if scratch.last[ball] < 0:
        unexplained.unsteady[ball, 1] = unsteady
        unexplained.flown[ball] = True
