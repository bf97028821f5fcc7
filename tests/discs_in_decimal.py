"""Smooth hard discs from contact to contact in 50 decimal digits: a second opinion on the exact engine.

It shares nothing with the sandbox: its own formulas and root finder, on Python's `decimal`. Before every contact it
looks at every pair and every wall, without a grid or a queue. There is no friction, no rest and no treatment of
contacts without end: `run` ends before them.

x, y: px; vx, vy: px/s; t: s; gravity: px/s². A wall is a segment with round ends; its `reach` is the distance of a
disc's centre at which the two touch.
"""

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from itertools import combinations, pairwise
from math import comb
from typing import Final, NamedTuple

DIGITS: Final = 50
TINY: Final = Decimal("1e-34")  # px and s: far above rounding, far below all else
ROOT_ERROR: Final = Decimal("1e-44")  # s
MIN_BOUNCE: Final = Decimal("2e-4")  # s, that a bounce off a face lasts; a shorter one is rest
MIN_BOUNCE_ON_END: Final = Decimal("5e-3")  # s, off a round end, from which discs slide
MAX_STREAK: Final = 40  # contacts of a disc, each within STREAK_TIME of the last
STREAK_TIME: Final = Decimal("1e-6")  # s
CLOCK_ERROR: Final = Decimal("1e-13")  # s, between a disc's contacts, whose order is lost in double precision
ZERO: Final = Decimal(0)
NEVER: Final = Decimal("Infinity")


@dataclass
class Disc:
    """A disc in flight."""

    x: Decimal
    y: Decimal
    vx: Decimal
    vy: Decimal
    radius: Decimal
    mass: Decimal
    elasticity: Decimal


@dataclass(frozen=True)
class Wall:
    """The side of an arena, which only stops what comes from inside, or a wall with two faces and round ends.

    number: 0 to 3 for the arena's left, top, right and bottom; then the others.
    """

    number: int
    x0: Decimal
    y0: Decimal
    x1: Decimal
    y1: Decimal
    half_thickness: Decimal
    elasticity: Decimal
    one_sided: bool = False


class Contact(NamedTuple):
    """A contact. second: a disc, or ~number of a wall; at: centre of the first, px; impulse: kg px/s.

    lighter: kg, of the lighter disc; rests: gravity brings the disc back to the wall at once.
    """

    time: Decimal
    first: int
    second: int
    at: tuple[Decimal, Decimal]
    impulse: Decimal
    lighter: Decimal
    rests: bool


class Meeting(NamedTuple):
    """The next contact, as found. at: the point of the wall that is touched, (x, y); None for two discs."""

    wait: Decimal
    first: int
    second: int
    at: tuple[Decimal, Decimal] | None


@dataclass
class Table:
    """All discs at one time, the walls and gravity."""

    discs: list[Disc]
    walls: tuple[Wall, ...]
    gravity: tuple[Decimal, Decimal]
    time: Decimal = ZERO

    def copy(self) -> "Table":
        """Return a copy that can go its own way."""
        return replace(self, discs=[replace(disc) for disc in self.discs])

    def nudged(self, by: Decimal, seed: int) -> "Table":
        """Return a copy whose coordinates and velocities all differ at random, by up to `by` (px, px/s)."""
        rng, twin = random.Random(seed), self.copy()
        with localcontext(prec=DIGITS):
            for disc in twin.discs:
                disc.x, disc.y, disc.vx, disc.vy = (
                    number + by * Decimal(rng.uniform(-1, 1)) for number in (disc.x, disc.y, disc.vx, disc.vy)
                )
        return twin

    def fly(self, wait: Decimal) -> None:
        """Move all discs on their parabolas."""
        gx, gy = self.gravity
        for disc in self.discs:
            disc.x += wait * (disc.vx + gx * wait / 2)
            disc.y += wait * (disc.vy + gy * wait / 2)
            disc.vx += gx * wait
            disc.vy += gy * wait
        self.time += wait


@dataclass(frozen=True)
class Run:
    """What happened up to a time, s. snapshots: at the times asked for; ended: the reason, if not all were reached."""

    snapshots: tuple[Table, ...]
    contacts: tuple[Contact, ...]
    until: Decimal
    ended: str


def fall_through_zero(c: Decimal, b: Decimal, a: Decimal) -> Decimal:
    """Return the time at which c + b t + a t² falls through zero; a parabola does so once at most.

    Its slope there is minus the root of the discriminant, which gives two forms, each without cancellation for one sign
    of b.
    """
    discriminant = b * b - 4 * a * c
    if discriminant <= 0:
        return NEVER
    slope = -discriminant.sqrt()
    if b < 0:
        return 2 * c / (-b - slope)
    return (slope - b) / (2 * a) if a < 0 else NEVER


def soon(time: Decimal) -> Decimal:
    """Return a time of contact that rounding may have put before now; one that is past is never."""
    return max(time, ZERO) if time > -TINY else NEVER


def wait_for_disc(a: Disc, b: Disc) -> Decimal:
    """Return when two discs touch: gravity moves both alike, so they fly straight past each other."""
    x, y, vx, vy, reach = b.x - a.x, b.y - a.y, b.vx - a.vx, b.vy - a.vy, a.radius + b.radius
    approach = x * vx + y * vy
    if approach >= 0:
        return NEVER
    speed2 = vx * vx + vy * vy
    cross = x * vy - y * vx  # speed times the distance at which their centres would pass
    miss2 = reach * reach * speed2 - cross * cross
    return soon((-approach - miss2.sqrt()) / speed2) if miss2 > 0 else NEVER


def waits_for_faces(disc: Disc, wall: Wall, gravity: tuple[Decimal, Decimal]) -> Iterator[tuple[Decimal, Decimal]]:
    """Yield when a disc touches each face of a wall, and where along the wall, px from its start."""
    dx, dy = wall.x1 - wall.x0, wall.y1 - wall.y0
    length = (dx * dx + dy * dy).sqrt()
    ux, uy = dx / length, dy / length
    rx, ry, reach = disc.x - wall.x0, disc.y - wall.y0, disc.radius + wall.half_thickness
    for side in (1,) if wall.one_sided else (1, -1):
        nx, ny = -uy * side, ux * side
        wait = soon(
            fall_through_zero(
                rx * nx + ry * ny - reach,
                disc.vx * nx + disc.vy * ny,
                (gravity[0] * nx + gravity[1] * ny) / 2,
            )
        )
        if wait < NEVER:
            x = rx + wait * (disc.vx + gravity[0] * wait / 2)
            y = ry + wait * (disc.vy + gravity[1] * wait / 2)
            along = x * ux + y * uy
            if wall.one_sided or 0 <= along <= length:
                yield wait, along / length


def wait_for_end(
    disc: Disc, x: Decimal, y: Decimal, reach: Decimal, gravity: tuple[Decimal, Decimal], limit: Decimal
) -> Decimal:
    """Return when a disc touches the round end of a wall, if before a limit."""
    rx, ry, vx, vy, (gx, gy) = disc.x - x, disc.y - y, disc.vx, disc.vy, gravity
    distance = (rx * rx + ry * ry).sqrt()
    gap = distance - reach
    if gap > limit * (abs(vx) + abs(vy) + (abs(gx) + abs(gy)) * limit / 2):
        return NEVER
    gap2 = [gap * (distance + reach), 2 * (rx * vx + ry * vy)]
    gap2 += [vx * vx + vy * vy + rx * gx + ry * gy, vx * gx + vy * gy, (gx * gx + gy * gy) / 4]
    if abs(gap) < TINY:
        if gap2[1] < 0:
            return ZERO
        gap2 = gap2[1:]  # it has just left: without the root at 0
    assert gap2[0] >= 0, "a disc is inside a wall"
    return first_fall(gap2, limit)


def first_fall(power: Sequence[Decimal], limit: Decimal) -> Decimal:
    """Return the first root from 0 to a limit of a polynomial that begins positive, by its Bernstein coefficients.

    They bound it: without a change of sign among them it has no root, and with one change exactly one. Else the
    interval is halved, by de Casteljau's rule. power: coefficients of 1, t, t², ...
    """
    degree = len(power) - 1
    scaled = [coefficient * limit**k for k, coefficient in enumerate(power)]
    bernstein = [sum((scaled[k] * comb(i, k) / comb(degree, k) for k in range(i + 1)), ZERO) for i in range(degree + 1)]
    pending = [(ZERO, limit, bernstein)]
    while pending:
        low, high, coefficients = pending.pop()
        signs = [coefficient > 0 for coefficient in coefficients]
        changes = sum(a != b for a, b in pairwise(signs))
        if changes == 1:
            return bisect(power, low, high)
        if changes > 1 and high - low > TINY:
            left, right = halve(coefficients)
            middle = (low + high) / 2
            pending += [(middle, high, right), (low, middle, left)]
    return NEVER


def halve(bernstein: list[Decimal]) -> tuple[list[Decimal], list[Decimal]]:
    """Return the Bernstein coefficients on both halves of an interval."""
    left, right, row = [], [], bernstein
    while row:
        left.append(row[0])
        right.append(row[-1])
        row = [(a + b) / 2 for a, b in pairwise(row)]
    return left, right[::-1]


def bisect(power: Sequence[Decimal], low: Decimal, high: Decimal) -> Decimal:
    """Return the only root of a polynomial from low to high, where it falls."""
    while high - low > ROOT_ERROR:
        middle, value = (low + high) / 2, ZERO
        for coefficient in reversed(power):
            value = value * middle + coefficient
        low, high = (middle, high) if value > 0 else (low, middle)
    return (low + high) / 2


def next_meeting(table: Table) -> Meeting | None:
    """Return the earliest contact of all pairs and walls."""
    best = Meeting(NEVER, 0, 0, None)
    for i, j in combinations(range(len(table.discs)), 2):
        wait = wait_for_disc(table.discs[i], table.discs[j])
        if wait < best.wait:
            best = Meeting(wait, i, j, None)
    for i, disc in enumerate(table.discs):
        for wall in table.walls:
            for wait, share in waits_for_faces(disc, wall, table.gravity):
                if wait < best.wait:
                    at = wall.x0 + share * (wall.x1 - wall.x0), wall.y0 + share * (wall.y1 - wall.y0)
                    best = Meeting(wait, i, ~wall.number, at)
    for i, disc in enumerate(table.discs):
        for wall in table.walls:
            reach = disc.radius + wall.half_thickness
            for x, y in () if wall.one_sided else ((wall.x0, wall.y0), (wall.x1, wall.y1)):
                wait = wait_for_end(disc, x, y, reach, table.gravity, best.wait)
                if wait < best.wait:
                    best = Meeting(wait, i, ~wall.number, (x, y))
    return best if best.wait < NEVER else None


def strike(table: Table, meeting: Meeting) -> Contact:
    """Exchange momentum by the law of restitution, along the line of centres or the normal of the wall."""
    a, at = table.discs[meeting.first], meeting.at
    if at is None:
        b = table.discs[meeting.second]
        x, y, e = b.x - a.x, b.y - a.y, a.elasticity * b.elasticity
        closing = (a.vx - b.vx) * x + (a.vy - b.vy) * y  # times the distance, as is the impulse until the end
        impulse = (1 + e) * closing / (1 / a.mass + 1 / b.mass)
        norm2, lighter, rests = x * x + y * y, min(a.mass, b.mass), False
        b.vx += impulse / b.mass * x / norm2
        b.vy += impulse / b.mass * y / norm2
    else:
        (gx, gy), wall = table.gravity, table.walls[~meeting.second]
        x, y, e = at[0] - a.x, at[1] - a.y, a.elasticity * wall.elasticity
        closing, pull = a.vx * x + a.vy * y, gx * x + gy * y
        impulse = (1 + e) * closing * a.mass
        norm2, lighter = x * x + y * y, a.mass
        shortest = MIN_BOUNCE * pull
        if at in ((wall.x0, wall.y0), (wall.x1, wall.y1)):
            shortest = MIN_BOUNCE_ON_END * ((gx * gx + gy * gy) * norm2).sqrt()
        rests = pull > 0 and 2 * e * closing < shortest
    a.vx -= impulse / a.mass * x / norm2
    a.vy -= impulse / a.mass * y / norm2
    return Contact(table.time, meeting.first, meeting.second, (a.x, a.y), impulse / norm2.sqrt(), lighter, rests)


def run(start: Table, times: Sequence[Decimal], max_contacts: int) -> Run:
    """Play up to the last of some times.

    Ends before it at a number of contacts, and before infinitely many seem to follow: where a disc comes to rest on a
    wall, and at a collapse, where a disc has a streak of MAX_STREAK contacts or two within CLOCK_ERROR.
    """
    table = start.copy()
    snapshots: list[Table] = []
    contacts: list[Contact] = []
    last, streak = [-NEVER] * len(table.discs), [0] * len(table.discs)
    with localcontext(prec=DIGITS):
        while len(snapshots) < len(times):
            meeting = next_meeting(table)
            wait = meeting.wait if meeting else NEVER
            for time in times[len(snapshots) :]:
                if time < table.time + wait:
                    snapshots.append(table.copy())
                    snapshots[-1].fly(time - table.time)
            if meeting is None or len(snapshots) == len(times):
                break
            if len(contacts) == max_contacts:
                return Run(tuple(snapshots), tuple(contacts), table.time, "contacts")
            table.fly(wait)
            contact = strike(table, meeting)
            collapses = False
            for disc in (contact.first, contact.second)[: 1 + (contact.second >= 0)]:
                since, last[disc] = contact.time - last[disc], contact.time
                streak[disc] = streak[disc] + 1 if since < STREAK_TIME else 0
                collapses |= since < CLOCK_ERROR or streak[disc] > MAX_STREAK
            if contact.rests or collapses:
                until = contact.time - CLOCK_ERROR
                before = tuple(one for one in contacts if one.time < until)
                return Run(tuple(snapshots), before, until, "rest" if contact.rests else "collapse")
            contacts.append(contact)
    return Run(tuple(snapshots), tuple(contacts), times[-1], "")
