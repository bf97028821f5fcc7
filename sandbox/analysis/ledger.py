"""The ledger: every change that an engine makes to energy, momentum and positions, entered under its cause.

An engine reports states and contacts. Between two states the balls fly on parabolas, and contacts change momentum by
the impulses that the engine reported. Both are replayed here, in the order in which the engine resolved them. Whatever
the replay leaves unexplained is entered too, so the lines of the ledger always add up to the whole change.

`sandbox.analysis.attribution` attributes a contact's changes to causes, and explains the symbols.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from sandbox.analysis.attribution import (
    FINDING,
    MAX_TRACE_STEPS,
    Block,
    Findings,
    SceneConstants,
    StepLengths,
    Unexplained,
    attribute_displacement,
    attribute_simultaneous,
    attribute_single,
    enter,
    give_impulse,
    line_to_wall,
    mends_overlap,
    of_step,
    pair_friction,
    turn_energy,
)
from sandbox.analysis.causes import NEGLIGIBLE, Cause
from sandbox.analysis.stamps import true_times
from sandbox.analysis.tunnelling import Passage, find_crossings, find_leaps, find_overlaps, no_deepening, wall_distance
from sandbox.compiled import Record, entry, kernel
from sandbox.engines.engine import Traits
from sandbox.quantity import length, spin_energy
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import Bools, Contacts, Damping, Floats, Integers, Pushes, States


@dataclass(frozen=True)
class Entry:
    """A line of the ledger: what a cause changed. That of SPIN is a part of the energy, and a part of no sum."""

    cause: Cause
    contacts: int  # or steps of a ball, for a cause that is not a contact's
    energy: float  # kg px²/s²; the lines add up to the whole change, without that of SPIN
    momentum: float  # kg px/s transferred wrongly, the sum of the lengths
    displacement: float  # px by which balls were displaced wrongly, the sum of the lengths


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
MIN_SHARE_RIGHT: Final = 0.1  # of the balls' steps in flight that are right, for which gravity is
MIN_SHARE_ALIKE: Final = 0.4  # of them that have the same error, for which it is gravity's
MIN_FLIGHTS: Final = 8  # steps of balls in flight, from which another gravity than the scene's is read


class Scratch(NamedTuple):
    """What the replay of a step needs of each ball.

    explained: (n, 2) px/s and spin: (n,) rad/s, the velocity and spin that the contacts so far lead to; flown: (n, 2)
    px since the step began; clock: (n,) s in the step, when the ball was moved last; last: (n,) its last contact in the
    step, or -1; uses: (n,) its contacts among those resolved together, 0 between them; score: (n,) px, how badly the
    best contact so far explains the ball's change; torque: (1,) kg px²/s, the angular momentum that walls, gravity, the
    mouse and damping gave all balls; damped: (n, 2) px/s, the velocity that damping gave.
    """

    explained: Floats
    spin: Floats
    flown: Floats
    clock: Floats
    last: Integers
    uses: Integers
    score: Floats
    torque: Floats
    damped: Floats


@kernel
def _damp(constants: SceneConstants, block: Block, scratch: Scratch, ball: int, substep: float) -> None:
    """Damp a ball at the end of a substep (s): the velocity that it had before gravity pulled in it, and the spin."""
    velocity, flown, lost = scratch.explained[ball], scratch.flown[ball], 1 - constants.left
    x = -lost * (velocity[0] - substep * constants.fall[0])
    y = -lost * (velocity[1] - substep * constants.fall[1])
    turned, moment = -lost * scratch.spin[ball], constants.mass[ball] * constants.radius[ball] ** 2 / 2
    energy = constants.mass[ball] * (x * (velocity[0] + x / 2) + y * (velocity[1] + y / 2))
    energy += turn_energy(constants, ball, scratch.spin[ball], turned)
    enter(block, Cause.DAMPING, energy, 0.0, 0.0)
    scratch.torque[0] += constants.mass[ball] * (flown[0] * y - flown[1] * x) + moment * turned
    for axis, change in enumerate((x, y)):
        velocity[axis] += change
        scratch.damped[ball, axis] += change
    scratch.spin[ball] += turned


@kernel
def _fly(constants: SceneConstants, block: Block, scratch: Scratch, ball: int, now: float) -> None:
    """Let a ball fly to a time in the step (s), and damp it at the end of each substep until then."""
    if constants.left < 1:
        substep = constants.dt / constants.substeps
        begun = int(scratch.clock[ball] / substep + NEGLIGIBLE)
        for end in range(begun + 1, int(now / substep + NEGLIGIBLE) + 1):
            _fall(constants, scratch, ball, end * substep)
            _damp(constants, block, scratch, ball, substep)
    _fall(constants, scratch, ball, now)


@kernel
def _fall(constants: SceneConstants, scratch: Scratch, ball: int, now: float) -> None:
    """Let a ball fly on its parabola to a time in the step (s)."""
    velocity, flown, dt = scratch.explained, scratch.flown, now - scratch.clock[ball]
    before = flown[ball, 0] * velocity[ball, 1] - flown[ball, 1] * velocity[ball, 0]
    for axis in range(2):
        flown[ball, axis] += dt * (velocity[ball, axis] + dt * constants.fall[axis] / 2)
        velocity[ball, axis] += dt * constants.fall[axis]
    after = flown[ball, 0] * velocity[ball, 1] - flown[ball, 1] * velocity[ball, 0]
    scratch.torque[0] += constants.mass[ball] * (after - before)
    scratch.clock[ball] = now


@kernel
def _approach_speed(contact: Record, velocity: Floats) -> float:
    """Return the speed at which the two bodies of a contact approach along its normal. velocity: (2, 2), of both."""
    along_x: float = (velocity[0, 0] - velocity[1, 0]) * contact.normal[0]
    along_y: float = (velocity[0, 1] - velocity[1, 1]) * contact.normal[1]
    return along_x + along_y


@kernel
def _copy_motion(scratch: Scratch, contact: Record, velocity: Floats, spin: Floats) -> None:
    """Copy the velocities and spins of the two bodies of a contact; a wall's are 0."""
    i, j = contact.first, contact.second
    for axis in range(2):
        velocity[0, axis] = scratch.explained[i, axis]
        velocity[1, axis] = scratch.explained[j, axis] if j >= 0 else 0.0
    spin[0], spin[1] = scratch.spin[i], scratch.spin[j] if j >= 0 else 0.0


@kernel
def _slip(constants: SceneConstants, contact: Record, velocity: Floats, spin: Floats) -> float:
    """Return the slip of a contact's first body on its second, px/s. velocity, spin: (2, 2) and (2,), of both."""
    nx, ny = contact.normal[0], contact.normal[1]
    slip: float = (velocity[0, 1] - velocity[1, 1]) * nx - (velocity[0, 0] - velocity[1, 0]) * ny
    slip += constants.radius[contact.first] * spin[0]
    if contact.second >= 0:
        slip += constants.radius[contact.second] * spin[1]
    return slip


@kernel
def _fly_to_contacts(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    contacts: Contacts,
    begin: int,
    end: int,
    within: Floats,
    touched: Floats,
    unexplained: Unexplained,
) -> None:
    """Let the balls of contacts that were resolved together fly there."""
    for k in range(begin, end):
        i, j = contacts[k].first, contacts[k].second
        scratch.last[i] = k
        unexplained.contacts[i] += 1
        unexplained.partner[i] = j
        _fly(constants, block, scratch, i, within[k])
        since = touched[i]
        if j >= 0:
            scratch.last[j] = k
            unexplained.contacts[j] += 1
            unexplained.partner[j] = i
            _fly(constants, block, scratch, j, within[k])
            since = max(since, touched[j])
        block.findings[k].free_flight = contacts[k].time - since


@kernel
def _find_lines(
    constants: SceneConstants,
    scratch: Scratch,
    unexplained: Unexplained,
    contact: Record,
    before: Floats,
    after: Floats,
    k: int,
    block: Block,
) -> None:
    """Find the vector from the first to the second body of a contact: as flown, before the step, and after it.

    before, after: (n, 2) px, where the balls are.
    """
    i, j = contact.first, contact.second
    x, y = before[i, 0] + scratch.flown[i, 0], before[i, 1] + scratch.flown[i, 1]
    if j >= 0:
        for axis in range(2):
            flown_axis = scratch.flown[j, axis] - scratch.flown[i, axis]
            block.line_before[k, axis] = before[j, axis] - before[i, axis]
            block.line[k, axis] = block.line_before[k, axis] + flown_axis
            block.line_after[k, axis] = after[j, axis] - after[i, axis]
    else:
        block.line[k, 0], block.line[k, 1] = line_to_wall(constants, ~j, x, y)
        block.line_before[k, 0], block.line_before[k, 1] = line_to_wall(constants, ~j, before[i, 0], before[i, 1])
        block.line_after[k, 0], block.line_after[k, 1] = line_to_wall(constants, ~j, after[i, 0], after[i, 1])
        nx, ny, rubs = contact.normal[0], contact.normal[1], contact.tangential
        on_x, on_y = contact.impulse * nx - rubs * ny, contact.impulse * ny + rubs * nx
        lever_x, lever_y = x - constants.centre[0], y - constants.centre[1]
        scratch.torque[0] -= lever_x * on_y - lever_y * on_x + constants.radius[i] * rubs
    depth = max(contact.depth, 0.0)
    unexplained.room[i] += depth
    if j >= 0:
        unexplained.room[j] += depth


@kernel
def _apply_contacts(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    contacts: Contacts,
    begin: int,
    end: int,
    touched: Floats,
) -> None:
    """Change velocities by contacts that were resolved together, and note those that share a ball."""
    uses = scratch.uses
    for k in range(begin, end):
        contact, finding = contacts[k], block.findings[k]
        _copy_motion(scratch, contact, finding.before, finding.spin_before)
        finding.approach = _approach_speed(contact, finding.before)
        finding.slip = _slip(constants, contact, finding.before, finding.spin_before)
        finding.tangential = contact.tangential
        uses[contact.first] += 1
        if contact.second >= 0:
            uses[contact.second] += 1
    for k in range(begin, end):
        contact = contacts[k]
        give_impulse(constants, contact, scratch.explained)
        for ball in (contact.first, contact.second):
            if ball >= 0 and contact.tangential != 0:
                scratch.spin[ball] -= 2 * contact.tangential / (constants.mass[ball] * constants.radius[ball])
    for k in range(begin, end):
        contact, finding = contacts[k], block.findings[k]
        _copy_motion(scratch, contact, finding.after, finding.spin_after)
        finding.approach_after = _approach_speed(contact, finding.after)
        finding.slip_after = _slip(constants, contact, finding.after, finding.spin_after)
        block.shared[k] = uses[contact.first] > 1 or (contact.second >= 0 and uses[contact.second] > 1)
    for k in range(begin, end):
        contact = contacts[k]
        uses[contact.first], touched[contact.first] = 0, contact.time
        if contact.second >= 0:
            uses[contact.second], touched[contact.second] = 0, contact.time


@kernel
def _begin_step(scratch: Scratch, unexplained: Unexplained, velocity: Floats, spin: Floats) -> None:
    """Begin a step with the velocities (n, 2) px/s and spins (n,) rad/s before it."""
    scratch.torque[0] = 0.0
    for ball in range(len(velocity)):
        scratch.spin[ball] = spin[ball]
        scratch.clock[ball], scratch.last[ball] = 0.0, -1
        unexplained.owner[ball], unexplained.cause[ball], unexplained.contacts[ball] = -1, Cause.UNTOLD, 0
        unexplained.room[ball] = 0.0
        for axis in range(2):
            scratch.explained[ball, axis], scratch.flown[ball, axis] = velocity[ball, axis], 0.0
            scratch.damped[ball, axis] = 0.0


@kernel
def _push(constants: SceneConstants, block: Block, scratch: Scratch, position: Floats, push: Record) -> None:
    """Enter what a hand gives a ball before a step. position: (n, 2) px."""
    ball, velocity, mass = push.ball, scratch.explained, constants.mass[push.ball]
    for axis in range(2):
        mean = velocity[ball, axis] + push.dv[axis] / 2
        enter(block, Cause.HAND, mass * push.dv[axis] * mean, 0.0, 0.0)
        velocity[ball, axis] += push.dv[axis]
        lever = mass * (position[ball, 1 - axis] - constants.centre[1 - axis])
        scratch.torque[0] += (2 * axis - 1) * lever * push.dv[axis]


@kernel
def _find_unexplained(
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
    (2,). Returns the
    largest unexplained momentum of a ball without a contact in the step, kg px/s.
    """
    pull = math.hypot(constants.gravity[0], constants.gravity[1]) * constants.dt
    fastest, furthest, momentum, unflown = 0.0, 0.0, 0.0, False
    for ball in range(len(constants.mass)):
        _fly(constants, block, scratch, ball, constants.dt)
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
def _find_owners(
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
def _explain_places(
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
def _enter_unexplained(
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


@kernel
def _sum_damped(constants: SceneConstants, scratch: Scratch, momentum: Floats) -> None:
    """Write the momentum that damping gave all balls in a step: (2,) kg px/s."""
    for axis in range(2):
        momentum[axis] = 0.0
        for ball in range(len(constants.mass)):
            momentum[axis] += constants.mass[ball] * scratch.damped[ball, axis]


@kernel
def _attribute_displacement_once(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    unexplained: Unexplained,
    contacts: Contacts,
    k: int,
    before: Floats,
) -> None:
    """Attribute how a contact displaced its balls, unless its wall carries the ball on: then its last contact tells."""
    contact, last = contacts[k], contacts[scratch.last[contacts[k].first]]
    if last.second >= 0 or last.second != contact.second or last.time <= contact.time:
        ball = contact.first
        x, y = unexplained.place[ball, 0], unexplained.place[ball, 1]
        attribute_displacement(constants, block, k, contact, unexplained, scratch.last, before)
        if contact.second < 0:
            moved_x, moved_y = x - unexplained.place[ball, 0], y - unexplained.place[ball, 1]
            turned = moved_x * scratch.explained[ball, 1] - moved_y * scratch.explained[ball, 0]
            scratch.torque[0] += constants.mass[ball] * turned


@entry
def _replay(
    every_step: SceneConstants,
    block: Block,
    scratch: Scratch,
    unexplained: Unexplained,
    flights: Flights,
    lengths: StepLengths,
    states: States,
    pushes: Pushes,
    off_parabola: Floats,
    contacts: Contacts,
    step_of: Integers,
    within: Floats,
    touched: Floats,
    steps_before: int,
    torques: Floats,
    damped: Floats,
) -> int:
    """Replay a block of steps, and enter everything that changes. Returns the number of contacts replayed.

    every_step: without what it has of one step; states: of steps + 1 rows; pushes: by a hand, by row; off_parabola: as
    in `Flights`, (2,); contacts: (contacts,) CONTACT, step_of: their steps, within: s since these began; touched: (n,)
    s, when each ball last had a contact; steps_before: of the run before the block; torques: (steps,) kg px²/s, and
    damped: (steps, 2) kg px/s, both written.
    """
    position, velocity, _, spin = states
    n, at, pushed = position.shape[1], 0, 0
    for step in range(1, len(position)):
        constants = of_step(every_step, lengths, step)
        before = position[step - 1], velocity[step - 1], spin[step - 1]
        after = position[step], velocity[step], spin[step]
        _begin_step(scratch, unexplained, velocity[step - 1], spin[step - 1])
        while pushed < len(pushes) and pushes[pushed].row == step:
            _push(constants, block, scratch, before[0], pushes[pushed])
            pushed += 1

        # Replay contact by contact, or all contacts of a time if they are resolved together.
        begin = at
        while at < len(contacts) and step_of[at] == step:
            end = at + 1
            while constants.together and end < len(contacts) and step_of[end] == step and within[end] == within[at]:
                end += 1
            _fly_to_contacts(constants, block, scratch, contacts, at, end, within, touched, unexplained)
            for k in range(at, end):
                _find_lines(constants, scratch, unexplained, contacts[k], before[0], after[0], k, block)
            _apply_contacts(constants, block, scratch, contacts, at, end, touched)
            at = end

        # Attribute what each contact did to velocities, then to places, and enter what is left.
        elsewhere = _find_unexplained(constants, block, scratch, unexplained, before, after, off_parabola)
        _find_owners(constants, scratch, unexplained, contacts, begin, at, within, elsewhere)
        for k in range(begin, at):
            if block.shared[k]:
                attribute_simultaneous(constants, block, k, contacts[k], unexplained)
            else:
                attribute_single(constants, block, k, contacts[k], unexplained)
        for ball in range(n):
            _explain_places(constants, block, unexplained, within, ball)
        for k in range(begin, at):
            _attribute_displacement_once(constants, block, scratch, unexplained, contacts, k, before[0])
        for ball in range(n):
            _enter_unexplained(
                constants, block, scratch, unexplained, flights, ball, before, after, steps_before + step
            )
        torques[step - 1] = scratch.torque[0]
        _sum_damped(constants, scratch, damped[step - 1])
    return at


def why_unjudged(traits: Traits) -> Cause | None:
    """Return why an engine's contacts cannot be judged one by one, None if they can."""
    if not traits.reports_contacts:
        return Cause.SILENT
    return Cause.SOFT if traits.soft else None


class Ledger:
    """The ledger of one engine, kept block by block of steps.

    traits: the engine's, whose changes all are on the line of `why_unjudged` if its contacts cannot be judged;
    max_overlap: px, of two balls at the end of any step; missed: passages without a reported contact.
    """

    def __init__(self, scene: Scene, traits: Traits) -> None:
        self._scene, self._clock = scene, scene.clock
        self._damping, self._unjudged = traits.damping, why_unjudged(traits)
        bodies, damping = scene.bodies, traits.damping
        gravity = (float(scene.gravity[0]), float(scene.gravity[1]))
        self._constants = SceneConstants(
            bodies.radius,
            bodies.mass,
            bodies.elasticity,
            _wall_constants(scene),
            gravity,
            gravity,
            traits.together,
            traits.infers_impulses,
            (scene.arena.size[0] / 2, scene.arena.size[1] / 2),
            damping.substeps,
        )
        n = len(bodies)
        self._scratch = Scratch(
            explained=np.empty((n, 2)),
            spin=np.empty(n),
            flown=np.empty((n, 2)),
            clock=np.empty(n),
            last=np.empty(n, np.int64),
            uses=np.zeros(n, np.int64),
            score=np.empty(n),
            torque=np.empty(1),
            damped=np.empty((n, 2)),
        )
        self._unexplained = Unexplained(
            velocity=np.empty((n, 2)),
            place=np.empty((n, 2)),
            spin=np.empty(n),
            cause=np.empty(n, np.int64),
            spin_cause=np.empty(n, np.int64),
            owner=np.empty(n, np.int64),
            unsteady=np.zeros((n, 3)),
            flown=np.zeros(n, np.bool_),
            contacts=np.empty(n, np.int64),
            partner=np.full(n, -1),
            room=np.empty(n),
        )
        kinds = (n, KINDS_OF_FLIGHT)
        self._flights = Flights(np.zeros(kinds, np.int64), np.zeros((*kinds, 2)), np.zeros((*kinds, 2)))
        self._off_parabola: Floats | None = None
        self._findings: list[Findings] = []
        self._sums = np.zeros((4, len(Cause)))  # energy, momentum, displacement, contacts
        self._touched = np.full(len(bodies), -np.inf)
        self._deepening = no_deepening()
        self.missed: list[Passage] = []
        self.max_overlap = 0.0
        self._steps = 0

    def add(self, states: States, contacts: Contacts, pushes: Pushes) -> tuple[Floats, Floats]:
        """Enter a block of steps. states: of steps + 1 rows, from the last state of the block before.

        pushes: by a hand, by row. Returns what was given in each step: the angular momentum about the arena's centre by
        walls, gravity, hand and damping, (steps,) kg px²/s, and the momentum by damping, (steps, 2) kg px/s.
        """
        position, velocity = states.position, states.velocity
        steps = len(position) - 1
        clock, lengths = self._clock, self._lengths(steps)
        step_of = clock.steps_containing(contacts["time"])
        within = np.clip(contacts["time"] - clock.times(step_of - 1), 0.0, 1 / clock.rates(step_of))
        step_of = np.clip(step_of - self._steps, 1, steps)
        if not self._constants.together:
            at_start = (within <= lengths.dt[step_of - 1] * NEGLIGIBLE) & (step_of > 1) & (contacts["impulse"] != 0)
            step_of = step_of - at_start
            within = np.where(at_start, lengths.dt[step_of - 1], within)
            moved = self._resolved_next(lengths.dt, velocity, contacts, step_of, within)
            step_of, within = step_of + moved, np.where(moved, 0.0, within)
        if not self._steps:
            self._note_touching(position[0], contacts)
        if self._off_parabola is None and self._unjudged is None:
            self._read_gravity(lengths.dt, position, velocity, contacts, step_of)
        within = true_times(self._constants, lengths, position, velocity, contacts, step_of, within)
        energy, momentum, displacement, count = self._sums
        block = Block(
            energy,
            momentum,
            displacement,
            count,
            findings=np.zeros(len(contacts), FINDING),
            expected_shift=np.zeros((len(contacts), 2)),
            timing=np.full(len(contacts), int(Cause.ROUNDING)),
            line=np.empty((len(contacts), 2)),
            line_before=np.empty((len(contacts), 2)),
            line_after=np.empty((len(contacts), 2)),
            shared=np.zeros(len(contacts), np.bool_),
            crowded=_crowded(contacts),
            friction=pair_friction(self._scene, contacts),
        )
        torques, damped = np.empty(steps), np.empty((steps, 2))
        replayed = _replay(
            self._constants,
            block,
            self._scratch,
            self._unexplained,
            self._flights,
            lengths,
            states,
            pushes,
            np.zeros(2) if self._off_parabola is None else self._off_parabola,
            contacts,
            step_of,
            within,
            self._touched,
            self._steps,
            torques,
            damped,
        )
        assert replayed == len(contacts)
        if len(block.findings):
            self._findings.append(block.findings)
        self._steps += steps
        if self._scene.is_rough:
            turning = spin_energy(states.spin[[0, -1]], self._scene.bodies.moment)
            self._sums[0, Cause.SPIN] += turning[1] - turning[0]
        self._check_overlaps(position, velocity, contacts, step_of)
        if self._unjudged is None:
            at_end = within >= lengths.dt[step_of - 1] * (1 - NEGLIGIBLE)
            self._check_inner_walls(position, contacts, step_of, ~at_end)
            self._check_leaps(position, contacts, step_of)
        return torques, damped

    def _lengths(self, steps: int) -> StepLengths:
        """Return what the ledger needs of each of the next steps."""
        numbers, damping = self._steps + np.arange(1, steps + 1), self._damping
        dt, traced = 1 / self._clock.rates(numbers), self._clock.lengths_around(numbers, MAX_TRACE_STEPS)
        return StepLengths(dt, traced, np.array([damping.left_after(one / damping.substeps) for one in dt.tolist()]))

    def _note_touching(self, position: Floats, contacts: Contacts) -> None:
        """Note the balls that touch a wall at the start, or a ball that they have a contact with."""
        radius = self._constants.radius
        self._touched[wall_distance(self._scene, position) <= radius * (1 + NEGLIGIBLE)] = 0.0
        first, second = (contacts[key][contacts["second"] >= 0] for key in ("first", "second"))
        reach = (radius[first] + radius[second]) * (1 + NEGLIGIBLE)
        touching = length(position[first] - position[second]) <= reach
        self._touched[np.concatenate([first[touching], second[touching]])] = 0.0

    def _resolved_next(
        self, dt: Floats, velocity: Floats, contacts: Contacts, step_of: Integers, within: Floats
    ) -> Bools:
        """Return which contacts at the end of a step were resolved at the start of the next: (contacts,).

        The velocity of one of the two changes in the next step only, and neither changes in this one, unless by an
        earlier contact of the step. If that is so for most, the engine reports the start of the step for all.
        dt: (steps,) s.
        """
        steps = len(velocity) - 1
        fall = np.multiply.outer(dt, self._constants.gravity)
        slight = np.abs(contacts["impulse"]) / 1000
        at_end = (within >= dt[step_of - 1] * (1 - NEGLIGIBLE)) & (step_of < steps) & (slight > 0)

        def changes(key: str, step: Integers, numbers: Integers) -> Bools:
            ball = np.maximum(contacts[key][numbers], 0)
            change = np.abs(velocity[step, ball] - velocity[step - 1, ball] - fall[step - 1]).sum(axis=1)
            changed: Bools = (change * self._constants.mass[ball] > slight[numbers]) & (contacts[key][numbers] >= 0)
            return changed

        numbers = np.flatnonzero(at_end)
        stays = [
            ~changes(key, step_of[numbers], numbers) & (contacts[key][numbers] >= 0) for key in ("first", "second")
        ]
        numbers = numbers[stays[0] | stays[1]]
        found = step_of.copy()
        led_on: set[tuple[int, int]] = set()  # balls with such a contact, with its step: their later ones follow it
        for k in numbers.tolist():
            one, step = np.array([k]), step_of[[k]]
            balls = [int(contacts[key][k]) for key in ("first", "second")]
            earlier = contacts[:k][step_of[:k] == step]
            next_only = moved = False
            for key, ball in zip(("first", "second"), balls, strict=True):
                now = bool(changes(key, step, one)[0])
                next_only |= not now and bool(changes(key, step + 1, one)[0])
                moved |= now and ball not in earlier["first"] and ball not in earlier["second"]
            follows = any((ball, int(step[0])) in led_on for ball in balls)
            if (follows or next_only) and not moved:
                found[k] += 1
                led_on |= {(ball, int(step[0])) for ball in balls if ball >= 0}
        resolved_next: Bools = np.minimum.accumulate(found[::-1])[::-1] > step_of  # steps must not descend
        return at_end if 2 * np.count_nonzero(resolved_next) > np.count_nonzero(at_end) else resolved_next

    def _read_gravity(
        self, dt: Floats, position: Floats, velocity: Floats, contacts: Contacts, step_of: Integers
    ) -> None:
        """Read from the flights of a block what pulls at the balls, and how far they are from its parabola. dt: s."""
        read = _engine_gravity(self._scene, self._damping, dt, position, velocity, contacts, step_of)
        if read is not None:
            fall, self._off_parabola = read
            fall_x, fall_y = fall.tolist()
            self._constants = self._constants._replace(fall=(fall_x, fall_y))

    @property
    def flights(self) -> Flights:
        """How the engine errs in flight, so far."""
        off = (0.0, 0.0) if self._off_parabola is None else (float(self._off_parabola[0]), float(self._off_parabola[1]))
        damping = self._damping.per_second
        return self._flights._replace(gravity=self._constants.fall, off_parabola=off, damping=damping)

    def _check_overlaps(self, position: Floats, velocity: Floats, contacts: Contacts, step_of: Integers) -> None:
        """Find the deepest overlap, and the pairs that pass into each other without a reported contact."""
        n = position.shape[1]
        reported = contacts["first"] * n + contacts["second"]
        reported[contacts["second"] < 0] = -1
        order = np.lexsort((reported, step_of))
        bounds = np.searchsorted(step_of, np.arange(len(position) + 1))
        deepest, passed, self._deepening = find_overlaps(
            position, velocity, self._constants.radius, reported[order], bounds, self._deepening
        )
        self.max_overlap = max(self.max_overlap, deepest)
        if self._unjudged is None:
            self._enter_missed(position, [(step, *divmod(key, n)) for step, key in passed.tolist()])

    def _check_inner_walls(self, position: Floats, contacts: Contacts, step_of: Integers, early: Bools) -> None:
        """Find the balls that go through an inner wall without a reported contact. early: before the end of a step."""
        ends = np.array([(*wall.start, *wall.to) for wall in self._scene.walls], float)
        if len(ends):
            bounds = np.searchsorted(step_of, np.arange(len(position) + 1))
            crossings = find_crossings(position, ends, len(ARENA_WALLS), contacts, early, bounds)
            self._enter_missed(position, crossings.tolist())

    def _check_leaps(self, position: Floats, contacts: Contacts, step_of: Integers) -> None:
        """Find the balls that fly through others within a step."""
        bounds, before = np.searchsorted(step_of, np.arange(len(position) + 1)), self._steps - len(position) + 1
        for step, ball, other in find_leaps(position, self._constants.radius, contacts, bounds).tolist():
            flown = math.dist(position[step, ball], position[step - 1, ball])
            self.missed.append(Passage(before + step, min(ball, other), max(ball, other), flown, within_step=True))
            self._sums[3, Cause.MISSED] += 1

    def _enter_missed(self, position: Floats, found: Iterable[tuple[int, int, int]]) -> None:
        """Enter the contacts missed in a block: step in it, first and second."""
        before = self._steps - len(position) + 1
        for step, first, second in found:
            flown = math.dist(position[step, first], position[step - 1, first])
            self.missed.append(Passage(before + step, first, second, flown))
            self._sums[3, Cause.MISSED] += 1

    @property
    def findings(self) -> Findings:
        """What was found about every contact so far."""
        return np.concatenate(self._findings) if self._findings else np.empty(0, FINDING)

    def entries(self) -> tuple[Entry, ...]:
        """Return a line for each cause that occurred, in the order of Cause."""
        sums = self._sums if self._unjudged is None else _in_one_line(self._sums, self._unjudged)
        return tuple(
            Entry(cause, int(contacts), float(energy), float(momentum), float(displacement))
            for cause, (energy, momentum, displacement, contacts) in zip(Cause, sums.T, strict=True)
            if energy or contacts
        )


def _in_one_line(sums: Floats, line: Cause) -> Floats:
    """Return the sums of a ledger, (4, causes), with all that the engine changes in one line."""
    changed, kept = np.zeros_like(sums), [Cause.SPIN, Cause.HAND, Cause.ROUNDING]
    changed[:, kept] = sums[:, kept]
    changed[:, line] = np.delete(sums, kept, axis=1).sum(axis=1)
    return changed


def _crowded(contacts: Contacts) -> Bools:
    """Return whether a ball of each contact has another contact at the same time: (k,)."""
    ball = np.concatenate([contacts["first"], contacts["second"]])
    time = np.concatenate([contacts["time"]] * 2)
    order = np.lexsort((time, ball))
    again = (np.diff(ball[order]) == 0) & (np.diff(time[order]) == 0) & (ball[order[1:]] >= 0)
    crowded = np.zeros(len(ball), bool)
    crowded[order[1:]] = again
    crowded[order[:-1]] |= again
    return crowded[: len(contacts)] | crowded[len(contacts) :]


def _wall_constants(scene: Scene) -> Floats:
    """Return the walls as in `SceneConstants`, those of the arena without thickness: (m, 7).

    Those that do not stand are infinitely far behind their lines, so that nothing overlaps them.
    """
    rows = []
    elasticities = [scene.arena.elasticity] * len(ARENA_WALLS) + [wall.elasticity for wall in scene.walls]
    for wall, elasticity in enumerate(elasticities):
        start, to, thickness = scene.wall_line(wall)
        size = math.dist(start, to)
        along = ((to[0] - start[0]) / size, (to[1] - start[1]) / size)
        half = thickness / 2 if wall >= len(ARENA_WALLS) or scene.arena.walls else -math.inf
        rows.append((*along, half, elasticity, *start, size))
    return np.array(rows, float)


def _damped_flight(velocity: Floats, gravity: Floats, dt: Floats, damping: Damping) -> tuple[Floats, Floats]:
    """Return by how much damping changes velocities and places in a step of flight, (k, 2) px/s and px.

    velocity: (k, 2) px/s, before the step; gravity: (2,) px/s²; dt: (k, 1) s.
    """
    slowed, behind, substep = np.zeros_like(velocity), np.zeros_like(velocity), dt / damping.substeps
    left = damping.per_second**substep
    for k in range(damping.substeps):
        behind += slowed * substep
        slowed = left * slowed - (1 - left) * (velocity + k * substep * gravity)
    return slowed, behind


def _engine_gravity(
    scene: Scene,
    damping: Damping,
    dt: Floats,
    position: Floats,
    velocity: Floats,
    contacts: Contacts,
    step_of: Integers,
) -> tuple[Floats, Floats] | None:
    """Return what pulls at balls in flight, and how far they are off its parabola, as in `Flights`: (2,) px/s² each.

    Gravity does the same to all balls in all steps. What differs from ball to ball, or from step to step, is not
    gravity's; nor is a displacement along gravity that no integration of it in steps gives: it gives half a step's fall
    too much or too little, or with substeps a whole part of that. A step after a contact does not count: in it, a
    solver may still push the balls apart. dt: (steps,) s. Returns None if no ball flies in the block.
    """
    gravity, still = np.array(scene.gravity, float), np.zeros(2)
    if not gravity.any():
        return gravity, still
    flying = np.ones((len(position) - 1, position.shape[1]), bool)
    between = contacts["second"] >= 0
    for step in (step_of, np.minimum(step_of + 1, len(flying))):
        flying[step - 1, contacts["first"]] = False
        flying[step[between] - 1, contacts["second"][between]] = False
    steps, balls = np.nonzero(flying)
    if not len(steps):
        return None
    before, dt, g = velocity[:-1][steps, balls], dt[steps, None], float(np.hypot(*gravity))
    fall = g * dt
    sped = (np.diff(velocity, axis=0)[steps, balls] - gravity * dt) / fall
    moved = (np.diff(position, axis=0)[steps, balls] - before * dt - gravity * dt * dt / 2) / (fall * dt)
    if damping.per_second < 1:
        slowed, behind = _damped_flight(before, gravity, dt, damping)
        sped, moved = sped - slowed / fall, moved - behind / (fall * dt)
    slight = 1e-7 + NEGLIGIBLE * length(before) / fall[:, 0]
    if _share(sped, still, slight) * _share(moved, still, slight) > MIN_SHARE_RIGHT:
        return gravity, still
    faster, off = np.median(sped, axis=0), np.median(moved, axis=0)
    unaltered, alike = (_share(sped, value, slight) for value in (still, faster))
    if unaltered > MIN_SHARE_ALIKE or alike < MIN_SHARE_ALIKE or len(steps) < MIN_FLIGHTS:
        faster = still
    off -= faster / 2
    off_alike = _share(moved - faster / 2, off, slight) >= MIN_SHARE_ALIKE
    if faster.any() and not off_alike:
        return gravity, still
    if not off_alike or not _is_integration(off, gravity):
        off = still
    return gravity + faster * g, off * g


def _share(values: Floats, value: Floats, slight: Floats) -> float:
    """Return the fraction of some vectors (k, 2) that are no further from another than slight (k,)."""
    return float(np.mean(length(values - value) <= slight))


def _is_integration(off: Floats, gravity: Floats) -> bool:
    """Return whether integrating gravity in steps gives a displacement (2,), in units of gravity times dt²."""
    size = float(np.hypot(*off))
    if size <= NEGLIGIBLE:
        return False
    substeps = 1 / (2 * size)
    aside = abs(off[0] * gravity[1] - off[1] * gravity[0]) / float(np.hypot(*gravity))
    return aside <= NEGLIGIBLE * size + 1e-7 and abs(substeps - round(substeps)) <= 1e-4 * substeps
