"""Where and when the bodies of a contact first touched: their flight traced back, and checked against the places."""

import math
from typing import Final

from sandbox.analysis.findings import (
    Block,
    SceneConstants,
    Unexplained,
    sum_unsteady,
)
from sandbox.compiled import Record, kernel
from sandbox.engines.walls import ARENA_COUNT
from sandbox.judge.causes import NEGLIGIBLE

TOUCHING: Final = 0.1  # of a depth; bodies that overlapped by less of it before their flight only touched then


@kernel
def real_root(square: float) -> float:
    """Return the square root of a number; 0 if rounding has made it slightly negative."""
    return math.sqrt(max(square, 0.0))


@kernel
def _first_touch(x: float, y: float, wx: float, wy: float, reach: float) -> tuple[float, float, float]:
    """Return how long ago (s) two bodies were `reach` px apart, and the unit normal then.

    (x, y): px from the first to the second; (wx, wy): px/s at which they approach. The time is negative if they have
    not touched yet. For bodies that will miss each other it is the time of closest approach.
    """
    square = wx * wx + wy * wy
    nearest = (x * wx + y * wy) / square
    aside_x, aside_y = x - nearest * wx, y - nearest * wy
    ago = real_root((reach * reach - aside_x * aside_x - aside_y * aside_y) / square) - nearest
    nx, ny = x + ago * wx, y + ago * wy
    distance = math.hypot(nx, ny)
    return ago, nx / distance, ny / distance


@kernel
def first_touch_of_face(depth: float, speed: float, acceleration: float) -> tuple[float, float]:
    """Return how long ago a ball, now `depth` deep in a face, touched it, and its speed then (px, px/s, px/s²)."""
    then = real_root(speed * speed - 2 * acceleration * depth)
    return 2 * depth / (speed + then), then


@kernel
def angle_between(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the angle between two vectors, rad; 0 if one is 0."""
    return abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))


@kernel
def check_geometry(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained, reach: float
) -> tuple[float, float, float]:
    """Compare a contact's normal and depth with the places of its bodies; return the normal and the depth to go by.

    Both are the reported ones, unless the places show otherwise by more than the balls were displaced in the step.
    """
    finding, nx, ny, depth = block.findings[k], contact.normal[0], contact.normal[1], contact.depth
    lx, ly = block.line[k, 0], block.line[k, 1]
    distance = math.hypot(lx, ly)
    of_arena = -ARENA_COUNT <= contact.second < 0
    if of_arena:
        wall = ~contact.second
        outward = -1.0 if wall < 2 else 1.0
        ax, ay = (outward, 0.0) if wall % 2 == 0 else (0.0, outward)
        distance = lx * ax + ly * ay
    elif distance <= NEGLIGIBLE * reach:
        return nx, ny, depth
    else:
        ax, ay = lx / distance, ly / distance
    slack, alone = NEGLIGIBLE * reach + sum_unsteady(unexplained, contact, 1), True
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball >= 0:
            slack += math.hypot(unexplained.place[ball, 0], unexplained.place[ball, 1])
            alone = alone and unexplained.contacts[ball] == 1
    in_line, found_there = False, False
    for lines in (block.line, block.line_after, block.line_before):
        there = math.hypot(lines[k, 0], lines[k, 1])
        in_line = in_line or angle_between(nx, ny, lines[k, 0], lines[k, 1]) * reach <= slack
        found_there = found_there or abs(reach - there - depth) <= slack
    if of_arena:
        in_line = angle_between(nx, ny, ax, ay) * reach <= slack
    if not in_line and (alone or of_arena or slack <= 2 * NEGLIGIBLE * reach):
        finding.turned = angle_between(nx, ny, ax, ay)
        nx, ny = ax, ay
    if alone and not found_there and abs(reach - distance - depth) > slack:
        depth = reach - distance
        wx, wy = finding.before[0, 0] - finding.before[1, 0], finding.before[0, 1] - finding.before[1, 1]
        flown = constants.traced * math.hypot(wx, wy) + slack
        if abs(depth) > flown:
            finding.gap, depth = -depth, contact.depth
    elif not alone and not found_there and distance > 1.5 * reach:
        finding.gap = distance - reach
    return nx, ny, depth


@kernel
def trace_back(
    constants: SceneConstants, contact: Record, finding: Record, reach: float, nx: float, ny: float, depth: float
) -> tuple[float, float, float, float]:
    """Trace a contact back to first touch; return its delay, and the speed of approach and the normal at that time.

    Bodies that overlapped before the last contact of either, and did not only touch, did not come to overlap in this
    flight; their contact counts as found in time, and so does one that is off by rounding.
    """
    wx, wy = finding.before[0, 0] - finding.before[1, 0], finding.before[0, 1] - finding.before[1, 1]
    speed = wx * nx + wy * ny
    if abs(depth) <= NEGLIGIBLE * reach or speed <= 0:
        return 0.0, speed, nx, ny
    j, flight = contact.second, min(finding.free_flight, constants.traced)
    longest = flight / (1 - TOUCHING)
    if j < 0 and abs(constants.wall[~j, 0] * nx + constants.wall[~j, 1] * ny) < NEGLIGIBLE:
        acceleration = constants.fall[0] * nx + constants.fall[1] * ny
        delay, then = first_touch_of_face(depth, speed, acceleration)
        return (min(delay, flight), then, nx, ny) if delay <= longest else (0.0, speed, nx, ny)
    apart = reach - depth
    delay, tx, ty = _first_touch(apart * nx, apart * ny, wx, wy, reach)
    if delay > longest:
        return 0.0, speed, nx, ny
    return min(delay, flight), max(wx * tx + wy * ty, 0.0), tx, ty
