"""What is left of discs whose contacts follow each other at one time, for `discs_in_decimal`."""

from collections.abc import Sequence
from decimal import Decimal
from typing import Final

from impacts_in_decimal import Ending, Touch, continued, is_decided, sides, touches_of
from roots_in_decimal import TINY
from table_in_decimal import Table

CLOCK_ERROR: Final = Decimal("1e-13")  # s, between a disc's contacts, whose order is lost in double precision


def settle(table: Table, seeds: set[int], *, in_order: bool) -> str:
    """Resolve the impacts of discs that touch some discs, directly or through others, to their end or limit.

    in_order: whether their order is known. Returns why the run ends, if it does.
    """
    touches = group_of(touches_of(table, lambda disc: CLOCK_ERROR * (abs(disc.vx) + abs(disc.vy)) + TINY), seeds)
    outcome = continued(table.discs, touches)
    if outcome.ending in (Ending.NO_ROOM, Ending.UNKNOWN):
        return str(outcome.ending.value)
    if not in_order and not is_decided(table.discs, touches):
        return "simultaneous"
    for touch, (impulse, tangential) in zip(touches, outcome.impulses, strict=True):
        if touch.second < 0:
            disc = table.discs[touch.first]
            disc.pushed_x -= (impulse * touch.nx - tangential * touch.ny) / disc.mass
            disc.pushed_y -= (impulse * touch.ny + tangential * touch.nx) / disc.mass
    hit = {i for k, touch in enumerate(touches) if outcome.impulses[k][0] > 0 for i, _ in sides(touch)}
    for i in hit:
        disc, after = table.discs[i], outcome.discs[i]
        disc.vx, disc.vy, disc.spin = after.vx, after.vy, after.spin
        disc.release(table.gravity)
    return rest_on(table, [touch for touch, stays in zip(touches, outcome.stays, strict=True) if stays], hit)


def group_of(touches: Sequence[Touch], seeds: set[int]) -> list[Touch]:
    """Return the contacts of some discs, of the discs that they touch, and so on."""
    group, size = set(seeds), 0
    while len(group) > size:
        size = len(group)
        for touch in touches:
            discs = {i for i, _ in sides(touch)}
            if discs & group:
                group |= discs
    return [touch for touch in touches if touch.first in group]


def rest_on(table: Table, touches: Sequence[Touch], discs: set[int]) -> str:
    """Let discs lie on the faces that they still touch, and return what they come to rest on otherwise, if they do."""
    walls = {~wall.number: wall for wall in table.walls}
    on_end = False
    for touch in touches:
        if touch.second >= 0 or touch.first not in discs:
            continue
        disc = table.discs[touch.first]
        presses = table.gravity[0] * touch.nx + table.gravity[1] * touch.ny > TINY
        face = next((face for face in walls[touch.second].faces if (face.ty, -face.tx) == (touch.nx, touch.ny)), None)
        on_end |= presses and face is None
        if presses and face:
            if disc.face:
                return "in a corner"
            disc.lie(face, table.gravity, stuck=abs(face.along(disc.vx, disc.vy) + disc.radius * disc.spin) < TINY)
    for touch in touches:
        disc = table.discs[touch.first]
        is_beside = touch.second < 0 and disc.face and disc.face.wall is not walls[touch.second]
        if is_beside and touch.first in discs and disc.ax * touch.nx + disc.ay * touch.ny > TINY:
            return "in a corner"  # it slides into the other wall
        if touch.second >= 0:
            a, b = disc, table.discs[touch.second]
            if (a.ax - b.ax) * touch.nx + (a.ay - b.ay) * touch.ny > TINY:
                return "on a disc"
    return "on a wall's end" if on_end else ""
