"""The friction of a contact, and what the spins of its bodies changed by; `attribution` explains the symbols."""

import math
from typing import Final

from sandbox.analysis.findings import (
    Block,
    SceneConstants,
    Unexplained,
    enter,
    pair_constants,
    sum_unowned,
    sum_unsteady,
    turn_energy,
)
from sandbox.analysis.rest import enter_friction_at_rest
from sandbox.compiled import Record, kernel
from sandbox.judge.causes import NEGLIGIBLE, Cause

WITHIN_ARM: Final = 1e-3  # of friction, that float32 and the iterations of a solver may be off
_OF_FRICTION: Final = (Cause.FRICTION_SMALL, Cause.FRICTION_LARGE, Cause.RESCALED, Cause.UNTOLD)  # its errors
MOMENT_RATIOS: Final = (0.0, 0.5, 1.25, -1.0)  # of a disc's moment to an infinite one, a ring's, a sphere's; wrong sign


@kernel
def explain_spins(
    constants: SceneConstants, block: Block, contact: Record, finding: Record, unexplained: Unexplained
) -> None:
    """Explain spins by a friction that was not reported."""
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball >= 0:
            by_friction = -2 * finding.tangential / (constants.mass[ball] * constants.radius[ball])
            unexplained.spin[ball] -= by_friction
            energy = turn_energy(constants, ball, finding.spin_before[side], by_friction)
            enter(block, Cause.FRICTION, energy, 0.0, 0.0)
            finding.spin_after[side] += by_friction
            slight = 10 * NEGLIGIBLE * (abs(by_friction) + abs(finding.spin_before[side]))
            right = abs(unexplained.spin[ball]) <= slight
            unexplained.spin_cause[ball] = Cause.ROUNDING if right else Cause.UNTOLD


@kernel
def is_moment(turned: float, right: float) -> bool:
    """Return whether friction turned a ball (rad/s) as if its moment of inertia were another. right: rad/s, of a disc.

    That of a ring or of a sphere, or an infinite one; or the turn has the wrong sign. Another change in the step of a
    contact need not be the contact's.
    """
    nearest = math.inf
    for ratio in MOMENT_RATIOS:
        nearest = min(nearest, abs(turned - ratio * right))
    return bool(right != 0 and nearest <= WITHIN_ARM * abs(right))


@kernel
def attribute_spin(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained
) -> tuple[int, float]:
    """Find the cause of what the spins of a contact's balls changed by besides its friction.

    If a contact is found at a distance, its point may be taken from there: then friction has a longer or a shorter arm.
    Returns the cause, or ROUNDING if there is no such error, and the impulse at the rim (kg px/s) that gives as much.
    """
    finding, found, largest = block.findings[k], Cause.ROUNDING, 0.0
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball < 0 or unexplained.spin_cause[ball] == Cause.ROUNDING:
            continue
        change, radius = unexplained.spin[ball], constants.radius[ball]
        at_rim = constants.mass[ball] * abs(change) * radius / 2
        if unexplained.contacts[ball] > 1:
            if unexplained.spin_cause[ball] != Cause.FRICTION:
                unexplained.spin_cause[ball] = Cause.FRICTION if block.friction[k] > 0 else Cause.UNKNOWN
            continue
        if abs(change) * radius <= 3 * unexplained.unsteady[ball, 2]:
            continue
        by_arm = at_rim <= 2 * abs(contact.depth * finding.tangential) / radius
        right = -2 * finding.tangential / (constants.mass[ball] * radius)
        cause = Cause.VELOCITY if is_moment(right + change, right) else Cause.UNKNOWN
        if by_arm and finding.tangential != 0:
            cause = Cause.LATE if contact.depth > 0 else Cause.EARLY
        unexplained.spin_cause[ball], finding.spin_error[side] = cause, change
        finding.spin_after[side] += change
        if at_rim > largest:
            found, largest = cause, at_rim
    return found, largest


@kernel
def coulomb(slip: float, impulse: float, friction: float, mass: float) -> float:
    """Return Coulomb's friction, kg px/s. slip: px/s; impulse: kg px/s along the normal; mass: μ, kg."""
    most = friction * max(impulse, 0.0)
    return min(max(slip * mass / 3, -most), most)


@kernel
def friction_heat(slip: float, tangential: float, mass: float) -> float:
    """Return how friction (kg px/s) changes the energy, kg px²/s². slip: px/s; mass: μ, kg."""
    return tangential * (3 * tangential / (2 * mass) - slip)


@kernel
def _cause_of_friction(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    mass: float,
    otherwise: int,
    right: float,
    within_timing: bool,
) -> int:
    """Return why a contact's friction is not the right one, kg px/s. mass: μ, kg; otherwise: as `_attribute_unmet`.

    At a wall, the slip may lack gravity's pull of the step. If the contact is found at a distance, friction may act in
    the middle of the gap, or of the overlap, and so have another arm. within_timing: whether it is between what is
    right as found and what is right at first touch.
    """
    finding, friction = block.findings[k], block.friction[k]
    tangential, slip = finding.tangential, finding.slip
    pull = 0.0
    if contact.second < 0:
        nx, ny = contact.normal[0], contact.normal[1]
        pull = abs(constants.fall[1] * nx - constants.fall[0] * ny) * constants.dt
    speeds = _speed_of_rims(constants, contact, finding)
    error, slight = abs(tangential - right), NEGLIGIBLE * (10 * abs(right) + mass * speeds)
    least = coulomb(slip - pull, contact.impulse, friction, mass) - slight
    most = coulomb(slip + pull, contact.impulse, friction, mass) + slight
    unsteady = sum_unsteady(unexplained, contact, 0) + sum_unsteady(unexplained, contact, 2)
    if error <= slight:
        cause = Cause.ROUNDING
    elif otherwise == Cause.NORMAL:
        cause = Cause.NORMAL
    elif block.crowded[k]:
        cause = Cause.FRICTION
    elif error <= mass * unsteady:
        cause = Cause.UNTOLD
    elif error <= mass * sum_unowned(unexplained, k, contact):
        cause = Cause.UNKNOWN
    elif least <= tangential <= most:
        cause = Cause.GRAVITY
    elif within_timing or _is_by_arm(constants, contact, finding, friction):
        cause = Cause.LATE if finding.depth > 0 else Cause.EARLY
    elif block.rescaled[k]:
        cause = Cause.RESCALED
    elif tangential * right >= 0 and abs(tangential) > abs(right):
        cause = Cause.FRICTION_LARGE
    else:
        cause = Cause.FRICTION_SMALL
    return cause


@kernel
def _is_by_arm(constants: SceneConstants, contact: Record, finding: Record, friction: float) -> bool:
    """Return whether friction is right for a point of contact in the middle of the overlap, or of the gap."""
    _, per_i, per_j, _ = pair_constants(constants, contact)
    slip, per_mass = finding.slip, 0.0
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball >= 0:
            short = contact.depth / (2 * constants.radius[ball])
            slip -= short * constants.radius[ball] * finding.spin_before[side]
            per_mass += (per_i if side == 0 else per_j) * (1 + 2 * (1 - short) ** 2)
    right = coulomb(3 * slip / per_mass, contact.impulse, friction, 1.0)
    return bool(contact.depth != 0 and abs(finding.tangential - right) <= WITHIN_ARM * abs(right))


@kernel
def _speed_of_rims(constants: SceneConstants, contact: Record, finding: Record) -> float:
    """Return the sum of the speeds of a contact's bodies, of flight and at their rims, px/s."""
    total: float = abs(finding.spin_before[0]) * constants.radius[contact.first]
    if contact.second >= 0:
        total += abs(finding.spin_before[1]) * constants.radius[contact.second]
    for side in range(2):
        total += math.hypot(finding.before[side, 0], finding.before[side, 1])
    return total


@kernel
def attribute_friction(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    touch: tuple[float, float, float],
    expected: float,
    causes: tuple[int, int, int],
    at_rest: bool,
) -> tuple[int, float, float]:
    """Attribute the friction of a contact that was resolved by itself.

    touch: the normal of first touch and the impulse along it (kg px/s); expected: kg px/s, the expected impulse along
    the normal; causes: of what the contact did besides, of the error of its impulse, and of its time; at_rest: whether
    the two rest on each other. Returns the cause of friction's error, its size, and the right friction at first touch,
    kg px/s.
    """
    finding, friction = block.findings[k], block.friction[k]
    otherwise, of_impulse, timing = causes
    _, per_i, per_j, _ = pair_constants(constants, contact)
    mass, slip, tangential = 1 / (per_i + per_j), finding.slip, finding.tangential
    tx, ty, at_touch = touch
    wx, wy = finding.before[0, 0] - finding.before[1, 0], finding.before[0, 1] - finding.before[1, 1]
    slip_t = slip + wx * (contact.normal[1] - ty) + wy * (tx - contact.normal[0])
    if contact.second < 0:
        slip_t -= (constants.fall[1] * tx - constants.fall[0] * ty) * finding.delay
    right, right_t = coulomb(slip, contact.impulse, friction, mass), coulomb(slip_t, at_touch, friction, mass)
    within_timing = finding.delay != 0 and (tangential - right) * (tangential - right_t) < 0
    finding.expected_tangential = right_t if abs(tangential - right_t) < abs(tangential - right) else right
    right = finding.expected_tangential
    cause = _cause_of_friction(constants, block, k, contact, unexplained, mass, otherwise, right, within_timing)
    error = abs(tangential - right) if cause in _OF_FRICTION else 0.0
    is_reported = tangential == contact.tangential  # or else its energy is entered with the velocities
    unaccused = tangential if cause == Cause.FRICTION else right
    heat, heat_t = friction_heat(slip, unaccused, mass), friction_heat(slip_t, right_t, mass)
    if of_impulse == Cause.ROUNDING or right == right_t:
        of_impulse = timing
    enter(block, cause, friction_heat(slip, tangential, mass) - heat, error, 0.0)
    if not is_reported:
        enter(block, Cause.FRICTION, -friction_heat(slip, tangential, mass), 0.0, 0.0)
    if at_rest:
        enter_friction_at_rest(constants, block, contact, finding, unaccused, heat, mass)
    elif cause == Cause.FRICTION:
        enter(block, Cause.FRICTION, heat, 0.0, 0.0)
    else:
        heat_expected = friction_heat(slip, coulomb(slip, expected, friction, mass), mass)
        enter(block, of_impulse, heat - heat_expected, 0.0, 0.0)
        heat_later = friction_heat(
            slip, right_t, mass
        )  # gravity does the difference, on the way that a late contact lacks
        enter(block, timing, heat_later - heat_t, 0.0, 0.0)
        pulled = timing if timing in (Cause.LATE, Cause.EARLY) else Cause.GRAVITY
        enter(block, pulled, heat_expected - heat_later, 0.0, 0.0)
        enter(block, Cause.FRICTION, heat_t, 0.0, 0.0)
    return cause, error, right_t
