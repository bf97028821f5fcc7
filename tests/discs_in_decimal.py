"""Hard discs with friction from contact to contact in 50 decimal digits: a second opinion on the exact engine.

It shares nothing with the sandbox: its own formulas and root finder, on Python's `decimal`. Before every contact it
looks at every pair and every wall, without a grid or a queue.

Bodies exchange impulses by the law of restitution and Coulomb's law of friction, for the pair and instant that touch.
A disc that no longer bounces off a face lies on it: it slides or rolls, until something hits it or the face ends. Other
rest is not treated: `run` ends before it.

Contacts that follow each other ever faster (a collapse) are resolved one by one until the bodies touch, and from there
on at one time, by `impacts_in_decimal`, to their limit. So are contacts that double precision cannot order, if their
order does not matter.

Units and directions are those of `table_in_decimal`. `reach` is the distance of two centres at which bodies touch.
"""

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from itertools import combinations
from typing import Final, NamedTuple

from collapses_in_decimal import CLOCK_ERROR, settle
from impacts_in_decimal import impulses_of, speeds
from roots_in_decimal import DIGITS, NEVER, TINY, ZERO, fall_through_zero, first_fall, soon
from table_in_decimal import Disc, End, Face, Table, Vector, Wall

REST: Final = Decimal("1e-9")  # s, that a bounce off a face lasts; after a shorter one the disc lies
BRIEF: Final = Decimal("2e-4")  # s, that a bounce off a face lasts; with a shorter one a disc comes to rest
BRIEF_ON_END: Final = Decimal("5e-3")  # s, off a round end, from which discs slide
BRIEF_ON_DISC: Final = Decimal("2e-3")  # s, off a disc
MAX_OVERLAP: Final = Decimal("1e-12")  # px, by which noise can move discs that touch into each other, or into a wall
TOUCHING: Final = Decimal("1e-9")  # px between a disc that comes to rest on a face and another wall: it is in a corner
MAX_STREAK: Final = 5  # contacts of a disc with changing partners, each within STREAK_TIME of the last
STREAK_TIME: Final = Decimal("1e-6")  # s
BRIEF_CONTACTS: Final = 5  # for each contact that a run may have, with those of discs that come to rest on a face
COLLAPSE_TIME: Final = Decimal("1e-25")  # s, between the last two contacts of a longer streak, if bodies then touch


@dataclass(frozen=True)
class Contact:
    """A contact. second: a disc, or ~number of a wall; at: centre of the first, px.

    impulse, tangential: kg px/s, which the second gets along the normal and the tangent; slip: px/s, before it;
    lighter: kg, of the lighter disc.
    """

    time: Decimal
    first: int
    second: int
    at: Vector
    impulse: Decimal
    tangential: Decimal
    slip: Decimal
    lighter: Decimal


class Meeting(NamedTuple):
    """What a disc meets next. other: None if it stops slipping, or reaches the end of its face."""

    wait: Decimal
    first: int
    other: int | Face | End | None

    @property
    def discs(self) -> set[int]:
        """The discs that touch something then."""
        second = {self.other} if isinstance(self.other, int) else set()
        return second | {self.first} if self.other is not None else second

    def is_rival_of(self, earlier: "Meeting") -> bool:
        """Return whether double precision cannot order two contacts of one disc."""
        return self.wait - earlier.wait < CLOCK_ERROR and bool(self.discs & earlier.discs)


class Noise(NamedTuple):
    """What rounding is like.

    Random changes at the start, and later at each of the times asked for, px, px/s and rad/s; and contacts that are
    resolved before they are due, each by a random share of a distance, px.
    """

    rng: random.Random
    at_start: Decimal = ZERO
    later: Decimal = ZERO
    early: Decimal = ZERO


class Streak(NamedTuple):
    """Contacts that were resolved at one time. since, time: s, of the first and the last; fastest: px/s, then."""

    since: Decimal
    time: Decimal
    fastest: Decimal


@dataclass(frozen=True)
class Run:
    """What happened up to a time, s. snapshots: at the times asked for; ended: the reason, if not all were reached.

    contacts: but for those of discs that come to rest on a face, and of streaks that were resolved at one time;
    leaning: just after the last of these, if it ended the run since discs then lean on each other.
    """

    snapshots: tuple[Table, ...]
    contacts: tuple[Contact, ...]
    streaks: tuple[Streak, ...]
    until: Decimal
    ended: str
    leaning: Table | None = None


def wait_to_touch(relative: Sequence[Decimal], reach: Decimal, limit: Decimal) -> Decimal:
    """Return when two centres come within reach, if before a limit. relative: their x, y, vx, vy, ax, ay."""
    x, y, vx, vy, ax, ay = relative
    approach = x * vx + y * vy
    if ax == ay == 0:
        if approach >= -TINY * reach:
            return NEVER
        if x * x + y * y <= reach * reach:
            return ZERO
        speed2 = vx * vx + vy * vy
        cross = x * vy - y * vx  # speed times the distance at which they would pass
        miss2 = reach * reach * speed2 - cross * cross
        return soon((-approach - miss2.sqrt()) / speed2) if miss2 > 0 else NEVER
    distance = (x * x + y * y).sqrt()
    gap = distance - reach
    if gap > limit * (abs(vx) + abs(vy) + (abs(ax) + abs(ay)) * limit / 2):
        return NEVER
    gap2 = [gap * (distance + reach), 2 * approach]
    gap2 += [vx * vx + vy * vy + x * ax + y * ay, vx * ax + vy * ay, (ax * ax + ay * ay) / 4]
    if gap < TINY:  # they touch now: without the root at 0, which is double if they neither part nor approach
        gap2 = gap2[2 if abs(approach) < TINY * reach else 1 :]
        if gap2[0] < 0:
            return ZERO
    assert gap > -MAX_OVERLAP, "a disc is inside another or a wall"
    return first_fall(gap2, limit)


def wait_for_disc(a: Disc, b: Disc, limit: Decimal) -> Decimal:
    """Return when two discs touch, if before a limit."""
    relative = b.x - a.x, b.y - a.y, b.vx - a.vx, b.vy - a.vy, b.ax - a.ax, b.ay - a.ay
    return wait_to_touch(relative, a.radius + b.radius, limit)


def wait_for_end(disc: Disc, end: End, limit: Decimal) -> Decimal:
    """Return when a disc touches the round end of a wall, if before a limit."""
    relative = disc.x - end.x, disc.y - end.y, disc.vx, disc.vy, disc.ax, disc.ay
    return wait_to_touch(relative, disc.radius + end.wall.half_thickness, limit)


def wait_for_face(disc: Disc, face: Face) -> Decimal:
    """Return when a disc touches a face."""
    rx, ry = disc.x - face.x, disc.y - face.y
    gap = -face.into(rx, ry) - disc.radius - face.wall.half_thickness
    speed, change = -face.into(disc.vx, disc.vy), -face.into(disc.ax, disc.ay)
    if abs(gap) < TINY and abs(speed) < TINY and change >= 0:  # they neither part nor approach
        return NEVER
    wait = ZERO if -MAX_OVERLAP < gap < 0 and speed < -TINY else soon(fall_through_zero(gap, speed, change / 2))
    if wait == NEVER:
        return NEVER
    along = face.along(rx, ry) + wait * (face.along(disc.vx, disc.vy) + face.along(disc.ax, disc.ay) * wait / 2)
    return wait if face.has(along) else NEVER


def wait_on_face(disc: Disc, face: Face) -> Decimal:
    """Return when a disc that lies on a face stops slipping, or reaches an end."""
    wait = NEVER
    speed, change = face.along(disc.vx, disc.vy), face.along(disc.ax, disc.ay)
    braking = -disc.way * (change + disc.radius * disc.turning)
    if braking > 0:
        wait = max(ZERO, disc.way * (speed + disc.radius * disc.spin) / braking)
    if face.wall.one_sided:
        return wait
    along = face.along(disc.x - face.x, disc.y - face.y)
    to_start = soon(fall_through_zero(along, speed, change / 2))
    return min(wait, to_start, soon(fall_through_zero(face.length - along, -speed, -change / 2)))


def next_meetings(table: Table, limit: Decimal) -> list[Meeting]:
    """Return what discs may meet next, the earliest first; what is later than that, or a limit, may be left out."""
    found: list[Meeting] = []
    free = [[wall for wall in table.walls if not disc.face or wall is not disc.face.wall] for disc in table.discs]
    for i, disc in enumerate(table.discs):
        if disc.face:
            found.append(Meeting(wait_on_face(disc, disc.face), i, None))
        found += [Meeting(wait_for_face(disc, face), i, face) for wall in free[i] for face in wall.faces]
    limit = min(limit, *(meeting.wait for meeting in found)) + CLOCK_ERROR
    for i, j in combinations(range(len(table.discs)), 2):
        found.append(Meeting(wait_for_disc(table.discs[i], table.discs[j], limit), i, j))
        limit = min(limit, found[-1].wait + CLOCK_ERROR)
    for i, disc in enumerate(table.discs):
        for end in (end for wall in free[i] for end in wall.ends):
            found.append(Meeting(wait_for_end(disc, end, limit), i, end))
            limit = min(limit, found[-1].wait + CLOCK_ERROR)
    return sorted((meeting for meeting in found if meeting.wait < NEVER), key=lambda meeting: meeting.wait)


def gap_to(disc: Disc, wall: Wall) -> Decimal:
    """Return the distance between the surfaces of a disc and a wall, px."""
    return wall.nearest(disc.x, disc.y)[2] - disc.radius - wall.half_thickness


def turn(table: Table, i: int) -> None:
    """Let a disc that lies on a face leave it at its end, or stop slipping."""
    disc = table.discs[i]
    assert disc.face
    along = disc.face.along(disc.x - disc.face.x, disc.y - disc.face.y)
    if disc.face.wall.one_sided or TINY < along < disc.face.length - TINY:
        disc.lie(disc.face, table.gravity, stuck=True)
    else:
        disc.release(table.gravity)


def strike(table: Table, meeting: Meeting) -> tuple[Contact, bool, str]:
    """Exchange impulses by the laws of restitution and friction.

    Returns the contact; whether gravity brings the disc back to the face at once; and why the run ends, if it does.
    """
    a, other = table.discs[meeting.first], meeting.other
    assert other is not None
    at, bodies = (a.x, a.y), [(a, 1)]
    touched: Disc | Wall
    if isinstance(other, int):
        b = touched = table.discs[other]
        bodies.append((b, -1))
        x, y, number = b.x - a.x, b.y - a.y, other
    elif isinstance(other, Face):
        touched, x, y, number = other.wall, other.ty, -other.tx, ~other.wall.number
    else:
        touched, x, y, number = other.wall, other.x - a.x, other.y - a.y, ~other.wall.number
    distance = (x * x + y * y).sqrt()
    nx, ny = x / distance, y / distance
    tx, ty = -ny, nx

    closing = sum((side * (disc.vx * nx + disc.vy * ny) for disc, side in bodies), ZERO)
    slip = sum((side * (disc.vx * tx + disc.vy * ty) + disc.radius * disc.spin for disc, side in bodies), ZERO)
    pull = sum((side * (disc.ax * nx + disc.ay * ny) for disc, side in bodies), ZERO)
    per_mass = sum((1 / disc.mass for disc, _ in bodies), ZERO)
    e, lies = a.elasticity * touched.elasticity, False
    if isinstance(other, Face) and 2 * e * closing < REST * pull:
        e, lies = ZERO, True
    impulse, tangential = impulses_of(closing, slip, per_mass, e, a.friction * touched.friction)
    lighter = min(disc.mass for disc, _ in bodies)
    contact = Contact(table.time, meeting.first, number, at, impulse, tangential, slip, lighter)

    px, py = impulse * nx + tangential * tx, impulse * ny + tangential * ty
    for disc, side in bodies:
        face = disc.face
        disc.vx -= side * px / disc.mass
        disc.vy -= side * py / disc.mass
        disc.spin -= 2 * tangential / (disc.mass * disc.radius)
        disc.release(table.gravity)
        if face and abs(face.into(disc.vx, disc.vy)) < TINY:
            disc.lie(face, table.gravity)
    if not isinstance(other, int):
        a.pushed_x -= px / a.mass
        a.pushed_y -= py / a.mass
    if isinstance(other, Face) and lies:
        a.lie(other, table.gravity)
    return contact, *what_follows(table, a, other, e * closing, pull)


def what_follows(
    table: Table, disc: Disc, other: int | Face | End, rebound: Decimal, pull: Decimal
) -> tuple[bool, str]:
    """Return whether gravity brings a disc back to a face at once; and why the run ends, if rest seems to follow.

    rebound: px/s; pull: px/s², which brings it back.
    """
    if isinstance(other, Face):
        is_in_corner = disc.face is other and any(
            gap_to(disc, wall) < TOUCHING for wall in table.walls if wall is not other.wall
        )
        return 2 * rebound < BRIEF * pull, "in a corner" if is_in_corner else ""
    gravity = (table.gravity[0] ** 2 + table.gravity[1] ** 2).sqrt()
    shortest, end = (BRIEF_ON_DISC, "on a disc") if isinstance(other, int) else (BRIEF_ON_END, "on a wall's end")
    return False, end if pull > TINY and 2 * rebound < shortest * gravity else ""


def lead(table: Table, meeting: Meeting, gap: Decimal) -> Decimal:
    """Return how long before a contact there is still a gap, s; less if that is not in the future. gap: px."""
    if not gap or meeting.other is None:
        return ZERO
    after = table.copy()
    after.fly(meeting.wait)
    disc, other = after.discs[meeting.first], meeting.other
    if isinstance(other, int):
        second = after.discs[other]
        x, y, vx, vy = second.x - disc.x, second.y - disc.y, disc.vx - second.vx, disc.vy - second.vy
    else:
        x, y = (other.ty, -other.tx) if isinstance(other, Face) else (other.x - disc.x, other.y - disc.y)
        vx, vy = disc.vx, disc.vy
    closing = (x * vx + y * vy) / (x * x + y * y).sqrt()
    return min(meeting.wait, gap / closing) if closing > 0 else ZERO


class Streaks:
    """Counts each disc's contacts with changing partners, each within STREAK_TIME of the last."""

    def __init__(self, discs: int) -> None:
        self.last = [(-NEVER, 0)] * discs  # time and partner
        self.start = [ZERO] * discs
        self.count = [0] * discs

    def add(self, contact: Contact) -> bool:
        """Count a contact, and return whether the bodies touch and infinitely many may follow."""
        endless = False
        for disc, partner in ((contact.first, contact.second), (contact.second, contact.first)):
            if disc >= 0:
                time, before = self.last[disc]
                self.last[disc] = contact.time, partner
                if contact.time - time >= STREAK_TIME:
                    self.start[disc], self.count[disc] = contact.time, 0
                elif partner != before:
                    self.count[disc] += 1
                endless |= self.count[disc] > MAX_STREAK and contact.time - time < COLLAPSE_TIME
        return endless

    def began(self, discs: Iterable[int], now: Decimal) -> Decimal:
        """Return when the streak began in which some discs are, s; if they are in none, now."""
        return min((self.start[disc] for disc in discs if now - self.last[disc][0] < STREAK_TIME), default=now)


def run(start: Table, times: Sequence[Decimal], max_contacts: int, noise: Noise | None = None) -> Run:
    """Play up to the last of some times, without noise or with it.

    Ends before it at a number of contacts; where a disc comes to rest on another, on a wall's end or in a corner; and
    where the order of simultaneous contacts matters. If one of these ends a streak, the run ends where that began.
    """
    table, streaks = start.copy(), Streaks(len(start.discs))
    snapshots: list[Table] = []
    contacts: list[Contact] = []
    resolved: list[Streak] = []
    leaning, count = None, 0
    with localcontext(prec=DIGITS):
        if noise:
            table.nudge(noise.at_start, noise.rng)
        for disc in table.discs:
            disc.release(table.gravity)
        ended = ""
        while not ended:
            if len(snapshots) == len(times):
                return Run(tuple(snapshots), tuple(contacts), tuple(resolved), times[-1], "")
            due = times[len(snapshots)] - table.time
            meetings = next_meetings(table, due)
            if not meetings or meetings[0].wait > due:
                table.fly(due)
                snapshots.append(table.copy())
                if noise:
                    table.nudge(noise.later, noise.rng)
                continue
            rivals = [meeting for meeting in meetings[1:] if meeting.is_rival_of(meetings[0])]
            early = ZERO
            if noise and noise.early and not rivals:
                early = lead(table, meetings[0], noise.early * Decimal(noise.rng.random()))
            table.fly(meetings[0].wait - early)
            until, discs = table.time, meetings[0].discs
            collapses = bool(rivals)
            if not rivals and meetings[0].other is None:
                turn(table, meetings[0].first)
            elif not rivals:
                contact, brief, ended = strike(table, meetings[0])
                collapses = streaks.add(contact)
                count += 1
                if len(contacts) == max_contacts or count > BRIEF_CONTACTS * max_contacts:
                    ended = "contacts"
                elif not brief:
                    contacts.append(contact)
                until = streaks.began(discs, table.time)
            if collapses and not ended:
                until = streaks.began(discs, table.time)
                contacts = [contact for contact in contacts if contact.time < until]
                fastest = max(abs(speed) for disc in table.discs for speed in speeds(disc))
                resolved.append(Streak(until, table.time, fastest))
                ended = settle(table, discs, in_order=noise is not None)
                leaning = table if ended == "on a disc" else None
        until -= CLOCK_ERROR
    seen = tuple(snapshot for snapshot in snapshots if snapshot.time < until)
    before = tuple(contact for contact in contacts if contact.time < until)
    return Run(seen, before, tuple(resolved), until, ended, leaning)
