"""The replay of a step: balls fly on their parabolas, and contacts change their velocities by reported impulses."""

import math
from typing import Final, NamedTuple

from sandbox.analysis.findings import (
    Block,
    SceneConstants,
    Unexplained,
    enter,
    give_impulse,
    line_to_wall,
    pair_constants,
    turn_energy,
)
from sandbox.compiled import Record, kernel
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.state import Contacts, Floats, Integers

ROUNDING: Final = 1e-12  # of the speeds of two bodies: what their approach may be off


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
def fly(constants: SceneConstants, block: Block, scratch: Scratch, ball: int, now: float) -> None:
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
def fly_to_contacts(
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
        fly(constants, block, scratch, i, within[k])
        since = touched[i]
        if j >= 0:
            scratch.last[j] = k
            unexplained.contacts[j] += 1
            unexplained.partner[j] = i
            fly(constants, block, scratch, j, within[k])
            since = max(since, touched[j])
        block.findings[k].free_flight = contacts[k].time - since


@kernel
def find_lines(
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
def apply_contacts(
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
def are_sums(constants: SceneConstants, block: Block, contacts: Contacts, begin: int, end: int) -> bool:
    """Return whether contacts of one time, which were applied one by one, do not obey the law of restitution so.

    Then they are sums of impacts. What gravity holds together obeys none.
    """
    slow = 2 * math.hypot(constants.fall[0], constants.fall[1]) * constants.dt
    for k in range(begin, end):
        finding, (e, _, _, _) = block.findings[k], pair_constants(constants, contacts[k])
        u, after, before = finding.approach, finding.approach_after, finding.before
        speed = math.hypot(before[0, 0], before[0, 1]) + math.hypot(before[1, 0], before[1, 1])
        is_lawful = abs(after + e * u) <= NEGLIGIBLE * (abs(u) + abs(after)) + ROUNDING * speed
        if not is_lawful and max(abs(u), abs(after)) > slow:
            return True
    return False


@kernel
def apply_together(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    contacts: Contacts,
    begin: int,
    end: int,
    touched: Floats,
) -> None:
    """Take back what contacts of one time have done one by one, and apply them together."""
    for back in range(end - begin):
        contact, finding = contacts[end - 1 - back], block.findings[end - 1 - back]
        for side, ball in enumerate((contact.first, contact.second)):
            if ball >= 0:
                scratch.spin[ball] = finding.spin_before[side]
                for axis in range(2):
                    scratch.explained[ball, axis] = finding.before[side, axis]
    apply_contacts(constants, block, scratch, contacts, begin, end, touched)


@kernel
def begin_step(scratch: Scratch, unexplained: Unexplained, velocity: Floats, spin: Floats) -> None:
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
def enter_push(constants: SceneConstants, block: Block, scratch: Scratch, position: Floats, push: Record) -> None:
    """Enter what a hand gives a ball before a step. position: (n, 2) px."""
    ball, velocity, mass = push.ball, scratch.explained, constants.mass[push.ball]
    for axis in range(2):
        mean = velocity[ball, axis] + push.dv[axis] / 2
        enter(block, Cause.HAND, mass * push.dv[axis] * mean, 0.0, 0.0)
        velocity[ball, axis] += push.dv[axis]
        lever = mass * (position[ball, 1 - axis] - constants.centre[1 - axis])
        scratch.torque[0] += (2 * axis - 1) * lever * push.dv[axis]


@kernel
def sum_damped(constants: SceneConstants, scratch: Scratch, momentum: Floats) -> None:
    """Write the momentum that damping gave all balls in a step: (2,) kg px/s."""
    for axis in range(2):
        momentum[axis] = 0.0
        for ball in range(len(constants.mass)):
            momentum[axis] += constants.mass[ball] * scratch.damped[ball, axis]
