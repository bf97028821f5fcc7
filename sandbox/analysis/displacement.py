"""How a contact displaced its balls, and why; `attribution` explains the symbols."""

import math

from sandbox.analysis.findings import (
    NO_ERROR,
    Block,
    SceneConstants,
    Unexplained,
    enter,
    line_to_wall,
    pair_constants,
    sum_unsteady,
)
from sandbox.compiled import Record, kernel
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.state import Floats, Integers


@kernel
def _depth_in(constants: SceneConstants, position: Floats, ball: int, other: int) -> float:
    """Return how deep a ball is in another, or in ~wall, px; 0 if they do not overlap. position: (n, 2) px."""
    x, y = position[ball, 0], position[ball, 1]
    if other >= 0:
        reach = constants.radius[ball] + constants.radius[other]
        dx, dy = position[other, 0] - x, position[other, 1] - y
        if abs(dx) >= reach or abs(dy) >= reach:  # nearly all pairs, which are spared a root
            return 0.0
    else:
        reach = constants.radius[ball] + constants.wall[~other, 2]
        dx, dy = line_to_wall(constants, ~other, x, y)
    depth: float = max(reach - math.hypot(dx, dy), 0.0)
    return depth


@kernel
def mends_overlap(constants: SceneConstants, unexplained: Unexplained, before: Floats, ball: int, moved: float) -> bool:
    """Return whether a ball that was moved (px) overlaps others by half as much: in the step, or before it.

    before: (n, 2) px, positions at the start of the step. A solver that resolves contacts together hands what it mends
    on from ball to ball: there all overlaps of the step count. Looks first at what the ball touched last.
    """
    other, room = unexplained.partner[ball], unexplained.room[ball]
    depth = _depth_in(constants, before, ball, other)
    if 2 * (room + depth) >= moved:
        return True
    for one in range(-len(constants.wall), len(constants.mass)):
        if one not in (ball, other):
            depth += _depth_in(constants, before, ball, one)
    if constants.together and room + depth > 0:
        for one in range(len(constants.mass)):
            room += unexplained.room[one] if one != ball else 0.0
    enough: bool = 2 * (room + depth) >= moved
    return enough


@kernel
def _displacement_by_friction_at_rest(constants: SceneConstants, contact: Record, finding: Record, ball: int) -> float:
    """Return how far (px) friction at rest puts a ball from where the same impulse at once, at the end, would have it.

    It acts for as long as the two touch, at most for a step. 0 of a contact that is not at rest.
    """
    held: float = abs(contact.tangential) / constants.mass[ball] * min(finding.free_flight, constants.dt) / 2
    return held if finding.rests else 0.0


@kernel
def attribute_displacement(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    last: Integers,
    before: Floats,
) -> None:
    """Attribute how a contact displaced its balls.

    last: (n,) each ball's last contact; before: (n, 2) px, positions at the start of the step.
    """
    finding, nx, ny = block.findings[k], contact.normal[0], contact.normal[1]
    energy = energy_expected = put_back = moved = error = finding.displacement_error = 0.0
    mends = True
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball < 0:
            continue
        sign = 1 - 2 * side
        x, y = unexplained.place[ball, 0], unexplained.place[ball, 1]
        if last[ball] != k:
            along, across = x * nx + y * ny, y * nx - x * ny
            held = _displacement_by_friction_at_rest(constants, contact, finding, ball)
            across = min(max(across, -held), held)
            x, y = along * nx - across * ny, along * ny + across * nx
        unexplained.place[ball, 0] -= x
        unexplained.place[ball, 1] -= y
        expected_x = -sign * block.expected_shift[k, 0] / constants.mass[ball]
        expected_y = -sign * block.expected_shift[k, 1] / constants.mass[ball]
        energy -= constants.mass[ball] * (constants.gravity[0] * x + constants.gravity[1] * y)
        energy_expected -= constants.mass[ball] * (
            constants.gravity[0] * expected_x + constants.gravity[1] * expected_y
        )
        off = math.hypot(x - expected_x, y - expected_y)
        error, finding.displacement_error = error + off, max(finding.displacement_error, off)
        put_back -= sign * (x * nx + y * ny)
        by = math.hypot(x, y)
        moved += by
        if by > NEGLIGIBLE * constants.radius[ball]:
            mends = mends and mends_overlap(constants, unexplained, before, ball, by)
    cause = _cause_of_displacement(constants, block, k, contact, unexplained, error, put_back, moved, mends)
    is_error = cause not in NO_ERROR
    enter(block, block.timing[k], energy_expected, 0.0, 0.0)
    enter(block, cause, energy - energy_expected, 0.0, error if is_error else 0.0)
    if finding.cause in NO_ERROR:
        finding.cause = cause


@kernel
def _cause_of_displacement(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    error: float,
    put_back: float,
    moved: float,
    mends: bool,
) -> int:
    """Return why a contact displaced its balls wrongly.

    error: px, of both together; put_back: px along the normal, away from the other body; moved: px, of both together;
    mends: whether overlaps are deep enough for that.
    """
    finding, slight = block.findings[k], NEGLIGIBLE * constants.radius[contact.first]
    fall = math.hypot(constants.fall[0], constants.fall[1])
    delay, at_rest = finding.delay, block.timing[k] == Cause.GRAVITY
    _, per_i, per_j, reach = pair_constants(constants, contact)
    depth = reach - math.hypot(block.line[k, 0], block.line[k, 1])
    overlap = max(contact.depth, reach - math.hypot(block.line_before[k, 0], block.line_before[k, 1]), 0.0)
    mends = mends and depth <= 2 * overlap + slight  # or else they were held before they overlapped
    way = 0.0  # px, by which the impulse parts the two in the time in which they came as deep
    if finding.approach > 0:
        way = abs(depth / finding.approach * contact.impulse) * (per_i + per_j)
    if error <= slight:
        cause = Cause.ROUNDING
    elif error <= 3 * sum_unsteady(unexplained, contact, 1):
        cause = Cause.PLACED
    elif error <= 3 * sum_unsteady(unexplained, contact, 0) * constants.dt:
        cause = Cause.UNTOLD
    elif error <= 2 * fall * (constants.dt**2 if at_rest else delay * delay if contact.second < 0 else 0.0):
        cause = Cause.GRAVITY
    elif moved <= slight:
        cause = Cause.LATE if delay > 0 else Cause.EARLY
    elif mends:
        shift, nx, ny = block.expected_shift[k], contact.normal[0], contact.normal[1]
        way_back = (shift[0] * nx + shift[1] * ny) / constants.mass[contact.first]
        mistimed = Cause.LATE if delay > 0 else Cause.EARLY
        put_on_wall = Cause.OVERSHOOT if contact.depth / 2 < put_back < way_back - slight else mistimed
        cause = Cause.PUSHED if contact.second >= 0 or delay == 0 else put_on_wall
    elif abs(depth) <= 10 * slight or error > 3 * way:
        cause = Cause.PLACED
    else:  # resolved at another time than reported
        cause = Cause.LATE if depth > 0 else Cause.EARLY
        if contact.second < 0 and depth / 2 < put_back < way - slight:
            cause, finding.displacement_error = Cause.OVERSHOOT, way - put_back
        if finding.cause in NO_ERROR:  # or else its time has explained a larger error
            finding.depth, finding.delay = depth, depth / finding.approach
    return cause
