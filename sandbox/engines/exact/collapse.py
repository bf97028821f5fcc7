"""Inelastic collapse: unending sequences of impacts between bodies that touch, and their limits.

A light disc between a heavy one and a wall, discs that close on each other, a disc in a corner: where bodies touch,
impacts follow each other at one time, and if restitution takes more than what the masses return, they never end. Their
approach speeds then fall geometrically, and what is left over is a group that touches and moves on together (V. Acary
and B. Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, ch. 1; C. Glocker, Set-Valued Force Laws,
2001, ch. 9). S. Luding and S. McNamara, Granular Matter 1 (1998) 113, make such impacts elastic instead, as contacts of
a finite duration are; those of `exact` have none.

At one time only velocities change, and the normals stay. So `Collapses` continues the sequence with the contacts of one
group alone, in sweeps over them in the order of the scene, by the law of a single contact. As long as each sweep
resolves the same contacts, and each of them slips or sticks as before, a sweep is one linear map of the velocities, and
when its slowest mode is all that is left, the impulses of all contacts fall by one ratio q. What q, q², q³ ... still
add up to, q / (1 - q), is given at once: not quite all of it, and only until a slip ends or another contact closes.
Then the sequence goes on, so that an inaccurate ratio costs time, not accuracy: every impulse is one that pushes, along
a normal or at the limit of friction, and the sequence ends where no contact closes faster than rounding.

Where q is 1 the bodies have no room to part: a disc in a slot of its own width, a row that fills a floor. Then their
restitution is 0. Where they have room, those that still touch part at the speed of rounding: one that slid along a
face, and by rounding into it, would collide with the end at which it leaves.

Under gravity, discs that lean on each other part in hops (see `contact`). Those of a group are given their hops
together, as impacts with restitution 0 that leave at least this speed. Contacts that cannot all open, because they
bear a load against each other between walls, are recognised by impulses that do not fall, and are given none.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, entry, kernel
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.exact.contact import (
    CONTACT_TIME,
    MIN_APPROACH,
    MIN_STREAK,
    SLOW_HOPS,
    approach_of_discs,
    count_slow_contacts,
    give,
    hop_round_end,
    lean_until,
)
from sandbox.engines.exact.prediction import predict
from sandbox.engines.exact.records import NONE, STATIC
from sandbox.engines.exact.statics import columns_of, equilibrium, pushed
from sandbox.engines.exact.support import MAX_SUPPORTS, normal_to, report_support, unit
from sandbox.engines.exact.touching import gap_to_piece
from sandbox.engines.exact.world import Motion, World, meet, motion, move_to_now, release
from sandbox.engines.laws import friction_impulse
from sandbox.state import CONTACT, Contacts, Floats, Integers

GAP_ROUNDING: Final = 1e-14  # relative, of coordinates, 45 units in the last place: gaps within it are closed
CLOCK_ROUNDING: Final = 1e-15  # relative, of the time, 5 units in the last place
SWEEPS_PER_BLOCK: Final = 12  # whose impulses are compared: cycles of 1, 2, 3, 4 and 6 sweeps fit in
STEADY: Final = 1e-11  # relative, within which the impulses of all contacts fall by one ratio; far above rounding
IMPULSE_ROUNDING: Final = 1e-14  # relative, of impulses at the speed of the fastest bodies, whose rounding all share
ENDLESS_RATIO: Final = 1 - 1e-9  # from which on impulses do not fall: the bodies have no room
LEVEL: Final = 1e-3  # by which the impulses of a block and the next one differ at most where they hardly fall
# Such blocks in a row, times the least loss of an impact, from which on the bodies have no room either: what moves
# between them has long lost its energy, and a slow wedge drives them.
LEVEL_BLOCKS: Final = 8
SHARE_AT_ONCE: Final = 1 - 2**-10  # of what a sequence still adds up to: not all, as the ratio is not exact
IMPACTS_PER_CALL: Final = 200_000  # a few milliseconds, after which Ctrl-C is heard
SLOWED: Final = 1e-3  # of the fastest approach: what is left of an unsteady sequence is solved at once
MAX_IMPACTS: Final = 30_000_000  # of a sequence that does not become steady; then its bodies count as having no room
# Of springs, lightest mass / s². In a full row that is out of line by 1e-5 of a radius, a disc is a wedge, and with
# springs that are 1e4 times softer it would go on to move, and set off the next sequence.
STOP_STIFFNESS: Final = 1e10
FEW: Final = 64  # discs and contacts of a group, for which there is room at first; it grows
RESIDUAL: Final = 4  # times an approach that is left: what contacts among the same bodies may make of it
REST: Final = 1e-13  # of the group's speeds before: a slower approach counts as rest

MEMBER: Final = np.dtype(  # a body of a group; a wall is a member for each of its contacts
    [
        ("disc", "i8"),  # or ~piece of wall
        ("per_mass", "f8"),  # 1/kg, 0 of a wall and in a static island
        ("vx", "f8"),  # px/s
        ("vy", "f8"),
        ("rim", "f8"),  # px/s, radius times spin
        ("is_hit", "i8"),  # whether an impact of the sequence changed these
    ]
)

LINK: Final = np.dtype(  # a contact of a group
    [
        ("first", "i8"),  # member, the ball that precedes in the scene
        ("second", "i8"),  # member
        ("nx", "f8"),  # unit normal from first to second
        ("ny", "f8"),
        ("depth", "f8"),  # px
        ("elasticity", "f8"),
        ("friction", "f8"),
        ("hop", "f8"),  # px/s, the least speed at which it parts
        ("impulse", "f8"),  # kg px/s, along the normal, since the sequence began
        ("tangential", "f8"),
        ("slip", "f8"),  # px/s, before the first impact
        ("block_impulse", "f8"),  # kg px/s, in this block of sweeps
        ("block_tangential", "f8"),
        ("last_impulse", "f8"),  # kg px/s, in the block before; all 0 if there was none
    ]
)


# The outcomes of a sequence of impacts.
PARTED: Final = 0  # no contact closes
ENDLESS: Final = 1  # its impulses do not fall
UNFINISHED: Final = 2  # neither, so far


@kernel
def _closing(member: NDArray[np.void], link: Record) -> float:
    """Return the speed at which a contact closes, px/s."""
    a, b = member[link.first], member[link.second]
    return a.vx * link.nx + a.vy * link.ny - (b.vx * link.nx + b.vy * link.ny)


@kernel
def _slip(member: NDArray[np.void], link: Record) -> float:
    """Return the slip of a contact, px/s."""
    a, b = member[link.first], member[link.second]
    return a.vy * link.nx - a.vx * link.ny + a.rim + (b.rim - (b.vy * link.nx - b.vx * link.ny))


@kernel
def _speed(member: NDArray[np.void], link: Record) -> float:
    """Return the speeds of a contact's bodies, added up, px/s."""
    a, b = member[link.first], member[link.second]
    return abs(a.vx) + abs(a.vy) + (abs(b.vx) + abs(b.vy))


@kernel
def _per_mass(member: NDArray[np.void], link: Record) -> float:
    """Return the sum of the inverse masses of a contact's bodies, 1/kg."""
    return member[link.first].per_mass + member[link.second].per_mass


@kernel
def _push(member: NDArray[np.void], link: Record, impulse: float, tangential: float) -> None:
    """Change the velocities of a contact's bodies by its impulse along the normal and the tangent, kg px/s."""
    x, y = impulse * link.nx - tangential * link.ny, impulse * link.ny + tangential * link.nx
    a, b = member[link.first], member[link.second]
    a.vx -= x * a.per_mass
    a.vy -= y * a.per_mass
    a.rim -= 2 * tangential * a.per_mass
    b.vx += x * b.per_mass
    b.vy += y * b.per_mass
    b.rim -= 2 * tangential * b.per_mass


@kernel
def _sweep(member: NDArray[np.void], link: NDArray[np.void], still: float, is_rough: bool) -> int:
    """Resolve each contact of a group that closes faster than `still` (px/s), in order. Returns how many did."""
    impacts = 0
    for k in range(len(link)):
        c = link[k]
        closing, per_mass = _closing(member, c), _per_mass(member, c)
        if closing + c.hop <= max(still, MIN_APPROACH * _speed(member, c)):
            continue
        impacts += 1
        impulse, tangential = (closing + max(c.elasticity * closing, c.hop)) / per_mass, 0.0
        slip = _slip(member, c)
        if is_rough:
            tangential = friction_impulse(slip, c.friction * impulse, per_mass)
        if c.impulse == 0:
            c.slip = slip
        c.impulse += impulse
        c.tangential += tangential
        c.block_impulse += impulse
        c.block_tangential += tangential
        _push(member, c, impulse, tangential)
    return impacts


@kernel
def _ratio(member: NDArray[np.void], link: NDArray[np.void]) -> tuple[float, bool]:
    """Return the ratio of the impulses to those of the block before, or 0 if there was none; whether all have it."""
    total, last, largest, fastest = 0.0, 0.0, 0.0, 0.0
    for k in range(len(link)):
        total += link[k].block_impulse
        last += link[k].last_impulse
        largest = max(largest, link[k].block_impulse)
        fastest = max(fastest, _speed(member, link[k]))
    if last == 0:
        return 0.0, False
    ratio = total / last
    for k in range(len(link)):
        tolerance = STEADY * largest + IMPULSE_ROUNDING * fastest / _per_mass(member, link[k])
        if abs(link[k].block_impulse - ratio * link[k].last_impulse) > tolerance:
            return ratio, False
    return ratio, True


@kernel
def _loss(link: NDArray[np.void]) -> float:
    """Return the least share of its energy that an impact of this block loses."""
    elasticity = 0.0
    for k in range(len(link)):
        if link[k].block_impulse > 0:
            elasticity = max(elasticity, link[k].elasticity)
    return 1 - elasticity**2


@kernel
def _continue_geometrically(
    member: NDArray[np.void], change: NDArray[np.void], link: NDArray[np.void], ratio: float
) -> None:
    """Give at once what a sequence still adds up to, as long as contacts go on to slip as they do, and none closes.

    change: copies of the members, for the changes of their velocities.
    """
    rest = ratio / (1 - ratio)
    for i in range(len(change)):
        change[i].vx = change[i].vy = change[i].rim = 0.0
    for k in range(len(link)):
        _push(change, link[k], rest * link[k].block_impulse, rest * link[k].block_tangential)
    share = SHARE_AT_ONCE
    for k in range(len(link)):
        c = link[k]
        closing, slip = _closing(member, c) + c.hop, _slip(member, c)
        more_closing, more_slip = _closing(change, c), _slip(change, c)
        if c.block_impulse == 0 and closing <= 0 < closing + more_closing:
            share = min(share, -closing / more_closing)
        slips = c.block_impulse > 0 and abs(c.block_tangential) >= (1 - STEADY) * c.friction * c.block_impulse
        if slips and slip * (slip + more_slip) < 0:
            share = min(share, SHARE_AT_ONCE * slip / -more_slip)
    for i in range(len(member)):
        member[i].vx += share * change[i].vx
        member[i].vy += share * change[i].vy
        member[i].rim += share * change[i].rim
    for k in range(len(link)):
        link[k].impulse += share * rest * link[k].block_impulse
        link[k].tangential += share * rest * link[k].block_tangential


@entry
def _continue(
    member: NDArray[np.void], change: NDArray[np.void], link: NDArray[np.void], still: float, is_rough: bool
) -> tuple[int, int]:
    """Continue a sequence of impacts. Returns its outcome and the number of impacts."""
    impacts, level = 0, 0
    while impacts < IMPACTS_PER_CALL:
        for k in range(len(link)):
            link[k].block_impulse = link[k].block_tangential = 0.0
        for _ in range(SWEEPS_PER_BLOCK):
            more = _sweep(member, link, still, is_rough)
            impacts += more
            if more == 0:
                return PARTED, impacts
        ratio, is_steady = _ratio(member, link)
        level = level + 1 if abs(1 - ratio) < LEVEL and not is_steady else 0
        if (is_steady and ratio >= ENDLESS_RATIO) or level * _loss(link) >= LEVEL_BLOCKS:
            return ENDLESS, impacts
        if is_steady:
            _continue_geometrically(member, change, link, ratio)
        for k in range(len(link)):
            link[k].last_impulse = 0.0 if is_steady else link[k].block_impulse
    return UNFINISHED, impacts


@kernel
def _add_link(link: NDArray[np.void], count: int, first: int, second: int, nx: float, ny: float, depth: float) -> int:
    """Add a contact, if there is room for it. Returns the number of contacts, with those that had no room."""
    if count < len(link):
        c = link[count]
        c.first, c.second, c.nx, c.ny, c.depth = first, second, nx, ny, depth
    return count + 1


@kernel
def _add_member(world: World, member: NDArray[np.void], count: int, i: int, now: float, place: Integers) -> None:
    """Add disc i as the next member. place: (n,), the number of each disc's member plus 1, or 0."""
    new, m = member[count], motion(world, i, now)
    new.disc, new.vx, new.vy = i, m.vx, m.vy
    new.per_mass = 0.0 if world.event[i].carrier == STATIC else 1 / world.body[i].mass
    if world.is_rough:
        new.rim = world.disc[i].radius * (world.turn[i].spin + (now - world.disc[i].t) * world.turn[i].spin_rate)
    place[i] = count + 1


@kernel
def _slack(world: World, i: int, closing: float, way: float, now: float) -> float:
    """Return the largest gap at disc i that is closed, px: rounding and, if it closes as slowly as hops, a short way.

    closing: px/s; way: px.
    """
    disc = world.disc[i]
    rounding = GAP_ROUNDING * (abs(disc.x) + abs(disc.y) + disc.radius)
    rounding += CLOCK_ROUNDING * now * (abs(disc.vx) + abs(disc.vy))
    return rounding + (way if abs(closing) < SLOW_HOPS * world.hop_speed else 0.0)


@kernel
def _add_walls(
    world: World,
    at: int,
    way: float,
    now: float,
    member: NDArray[np.void],
    members: int,
    link: NDArray[np.void],
    links: int,
) -> tuple[int, int]:
    """Add the walls that member `at` touches, and its contacts with them. Returns the numbers as `_gather` does."""
    i = np.int64(member[at].disc)
    m, cell, grid = motion(world, i, now), world.event[i].cell, world.grid
    for k in range(grid.cell[cell].begin, grid.cell[cell + 1].begin):
        p = np.int64(grid.piece[k])
        gap = gap_to_piece(world, i, p, m.x, m.y)
        nx, ny, _ = normal_to(m, world.piece[p])
        if gap <= _slack(world, i, m.vx * nx + m.vy * ny, way, now):
            if members < len(member):
                member[members].disc = ~p
            links = _add_link(link, links, at, members, nx, ny, -gap)
            members += 1
    return members, links


@kernel
def _gap(world: World, i: int, j: int, m: Motion, o: Motion) -> float:
    """Return the gap between discs i and j, which move like m and o, px."""
    rx, ry = o.x - m.x, o.y - m.y
    return math.sqrt(rx * rx + ry * ry) - world.disc[i].radius - world.disc[j].radius


@entry
def _gather(
    world: World, seed: int, way: float, now: float, place: Integers, member: NDArray[np.void], link: NDArray[np.void]
) -> tuple[int, int]:
    """Collect the discs that touch a disc now, those that touch these, and so on, with the walls, and their contacts.

    Stops at static islands, and where there is no room. Returns the number of members and of contacts, with the first
    that had no room.
    """
    members, links, at = 1, 0, 0
    _add_member(world, member, 0, seed, now, place)
    while at < members <= len(member):
        i, at = np.int64(member[at].disc), at + 1
        if member[at - 1].per_mass == 0:
            continue
        m, event, grid = motion(world, i, now), world.event[i], world.grid
        for row in range(-1, 2):
            for cell in range(event.cell + row * grid.stride - 1, event.cell + row * grid.stride + 2):
                j = np.int64(grid.cell[cell].first)
                while j >= 0:
                    o = motion(world, j, now)
                    gap = _gap(world, i, j, m, o)
                    closing = approach_of_discs(m, o).closing
                    if (
                        i != j
                        and meet(world, i, j)
                        and gap <= _slack(world, i, closing, way, now) + _slack(world, j, closing, way, now)
                    ):
                        if place[j] == 0:
                            if members < len(member):
                                _add_member(world, member, members, j, now, place)
                            members += 1
                        is_first = event.ball < world.event[j].ball
                        if place[j] > 0 and (is_first or member[place[j] - 1].per_mass == 0):
                            nx, ny, _ = unit(o.x - m.x, o.y - m.y)
                            a, b, sign = (at - 1, place[j] - 1, 1.0) if is_first else (place[j] - 1, at - 1, -1.0)
                            links = _add_link(link, links, a, b, sign * nx, sign * ny, -gap)
                    j = np.int64(world.disc[j].next)
        members, links = _add_walls(world, at - 1, way, now, member, members, link, links)
    return members, links


@entry
def _leave(place: Integers, member: NDArray[np.void]) -> None:
    """Forget the members of a group."""
    for k in range(len(member)):
        if member[k].disc >= 0:
            place[member[k].disc] = 0


@kernel
def _set_course(world: World, m: Record, residual: float, since: float, now: float, log: Log) -> None:
    """Give a disc the velocities that a sequence has left it, and let it fly freely. residual: px/s, see BODY."""
    i = np.int64(m.disc)
    move_to_now(world, i, now)
    report_support(world, i, since, now, log)
    world.disc[i].vx, world.disc[i].vy = m.vx, m.vy
    if world.is_rough:
        world.turn[i].spin = m.rim / world.disc[i].radius
    release(world, i)
    body = world.body[i]
    body.last_contact = body.settled = now
    body.residual, body.streak, body.fastest = residual, 0, 0.0


@kernel
def _note_contact(world: World, c: Record, m: Record, sign: float, partner: int, count: int, now: float) -> None:
    """Note what contact c of a group has done to one of its members.

    sign: 1 if that is the second, else -1; partner: a ball, or ~wall, as the second in CONTACT; count: of contacts that
    it stands for.
    """
    i = np.int64(m.disc)
    if m.per_mass == 0:
        give(world, i, sign * (c.impulse * c.nx - c.tangential * c.ny), sign * (c.impulse * c.ny + c.tangential * c.nx))
        return
    body = world.body[i]
    if partner >= 0:
        body.last_disc_contact = now
    if c.hop > 0:
        lean_until(world, i, world.hop_time, now)
    if world.has_gravity:
        count_slow_contacts(world, i, 0.0, now, count)


@entry
def _write_back(
    world: World, member: NDArray[np.void], link: NDArray[np.void], residual: float, since: float, now: float, log: Log
) -> None:
    """Give the discs of a group what a sequence has left them, report the sums of its impulses, and predict anew.

    residual: px/s, see BODY.
    """
    for k in range(len(link)):
        if link[k].impulse != 0:
            member[link[k].first].is_hit = member[link[k].second].is_hit = 1
    for k in range(len(member)):
        if member[k].is_hit and member[k].per_mass > 0:
            _set_course(world, member[k], residual, since, now, log)
    count = 1 if residual < math.inf else MIN_STREAK  # a sequence without end jams discs
    for k in range(len(link)):
        c = link[k]
        if c.impulse == 0:
            continue
        first, second = member[c.first], member[c.second]
        is_wall = second.disc < 0
        partner = ~world.piece[~second.disc].wall if is_wall else np.int64(world.event[second.disc].ball)
        _note_contact(world, c, first, -1.0, partner, count, now)
        if not is_wall:
            _note_contact(world, c, second, 1.0, partner, count, now)
        ball = np.int64(world.event[first.disc].ball)
        log_contact(log, now, ball, partner, c.nx, c.ny, c.impulse, c.depth, c.tangential, c.slip)
    for k in range(len(member)):
        if member[k].is_hit and member[k].per_mass > 0:
            predict(world, np.int64(member[k].disc), now)


def _closings(member: NDArray[np.void], link: NDArray[np.void]) -> Floats:
    """Return the speeds at which contacts close, (k,) px/s."""
    first, second = member[link["first"]], member[link["second"]]
    vx, vy = (first[key] - second[key] for key in ("vx", "vy"))
    closing: Floats = vx * link["nx"] + vy * link["ny"]
    return closing


class Collapses:
    """The inelastic collapses of a world."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._place = np.zeros(len(world.disc), np.int64)
        self._member, self._link = np.empty(FEW, MEMBER), np.empty(FEW, LINK)

    def resolve(self, seed: int, since: float, now: float, *, collects: bool) -> Contacts:
        """Resolve the sequence of impacts in which disc `seed` is, to its end or to its limit.

        since: s, start of the step; collects: whether contacts are recorded. Returns the contacts to report.
        """
        world = self._world
        world.rest.plan["collapsing"] = NONE
        world.body["streak"][seed] += 1  # so that the contact is resolved by itself if it is part of no group
        member, link = self._group(seed, 0.0, now)
        if world.has_gravity and self._is_slow(member, link, now):
            # A sequence that was as slow as hops from its start is resolved across gaps too short for contacts of their
            # own. One that has slowed down to this ends before bodies meet that are apart.
            member, link = self._group(seed, CONTACT_TIME * world.hop_speed, now)
        speeds = (np.abs(member[key]).max() for key in ("vx", "vy", "rim"))
        still = REST * max(*speeds, world.hop_speed)
        fastest = _closings(member, link).max(initial=0.0)
        outcome = self._continue(member, link, still, SLOWED * fastest)
        has_room = outcome == PARTED
        if outcome == ENDLESS:
            link["elasticity"] = 0.0
            outcome = self._continue(member, link, still, SLOWED * fastest)
        if outcome != PARTED:
            self._stop(member, link)
        if has_room:
            self._part(member, link, still)
        if world.has_gravity:
            self._hop(member, link, still)
        at_rest = len(link) * still  # a disc at rest is as fast as the approaches between it and a wall, added up
        for key in ("vx", "vy", "rim"):
            member[key][np.abs(member[key]) < at_rest] = 0.0
        rows = np.zeros(len(link) + MAX_SUPPORTS * len(member), CONTACT)
        log = Log(rows, np.zeros(1, np.int64), collects)
        residual = RESIDUAL * max(at_rest, _closings(member, link).max(initial=0.0)) if has_room else np.inf
        _write_back(world, member, link, residual, since, now, log)
        return rows[: log.filled[0]]

    def _group(self, seed: int, way: float, now: float) -> tuple[NDArray[np.void], NDArray[np.void]]:
        """Return the discs that a disc touches, directly or through others, and their contacts, in order.

        way: px, that is closed if bodies approach as slowly as hops.
        """
        while True:
            self._member[:], self._link[:] = 0, 0
            members, links = _gather(self._world, seed, way, now, self._place, self._member, self._link)
            _leave(self._place, self._member[: min(members, len(self._member))])
            if members <= len(self._member) and links <= len(self._link):
                break
            self._member, self._link = np.empty(2 * len(self._member), MEMBER), np.empty(2 * len(self._link), LINK)
        member, link = self._member[:members], self._link[:links]
        self._set_law(member, link)
        disc = member["disc"]
        number = np.where(disc < 0, disc, self._world.event["ball"][np.maximum(disc, 0)])
        return member, link[np.lexsort((number[link["second"]], number[link["first"]]))]

    def _is_slow(self, member: NDArray[np.void], link: NDArray[np.void], now: float) -> bool:
        """Return whether the contacts of a group are as slow as hops, and so were those of its discs' streaks."""
        body = self._world.body[member["disc"][member["per_mass"] > 0]]
        streaks = body["fastest"][now - body["last_contact"] < CONTACT_TIME]
        slow = SLOW_HOPS * self._world.hop_speed
        return bool(max(np.abs(_closings(member, link)).max(initial=0.0), streaks.max(initial=0.0)) < slow)

    def _set_law(self, member: NDArray[np.void], link: NDArray[np.void]) -> None:
        """Set the elasticity and the friction of contacts."""
        is_wall = member["disc"] < 0
        disc, piece = member["disc"][~is_wall], ~member["disc"][is_wall]
        for key, of_disc in (("elasticity", self._world.body), ("friction", self._world.turn)):
            factor = np.empty(len(member))
            factor[~is_wall], factor[is_wall] = of_disc[key][disc], self._world.piece[key][piece]
            link[key] = factor[link["first"]] * factor[link["second"]]

    def _continue(self, member: NDArray[np.void], link: NDArray[np.void], still: float, slow: float) -> int:
        """Continue a sequence of impacts until it ends, or shows that it does not, or has hardly an effect."""
        link["last_impulse"], impacts = 0.0, 0
        while impacts < MAX_IMPACTS:
            outcome, more = _continue(member, member.copy(), link, still, self._world.is_rough)
            impacts += more
            if outcome != UNFINISHED:
                return int(outcome)
            if _closings(member, link).max() < slow:
                break
        return UNFINISHED

    def _stop(self, member: NDArray[np.void], link: NDArray[np.void]) -> None:
        """Solve all contacts of a group together, with restitution 0 and without friction.

        If they close so slowly that the springs' rounding would be faster, nothing is changed.
        """
        closing = _closings(member, link).max()
        member_before, link_before = member.copy(), link.copy()
        moves = member["per_mass"] > 0
        number = np.where(moves, np.cumsum(moves) - 1, NONE)
        first, second = number[link["first"]], number[link["second"]]
        normal = np.stack([link["nx"], link["ny"]], axis=1)
        swaps = first == NONE  # only the first of a column moves
        normal[swaps] *= -1
        first, second = np.where(swaps, second, first), np.where(swaps, NONE, second)
        columns = columns_of(first, second, normal, np.zeros(len(link)))
        mass = np.repeat(1 / member["per_mass"][moves, None], 2, axis=1)
        before = np.stack([member["vx"], member["vy"]], axis=1)[moves]
        nothing = np.zeros(len(link))
        stiffness = STOP_STIFFNESS * float(mass.min())
        _, impulse = equilibrium(columns, mass, mass * before, nothing, nothing > 0, stiffness)
        after = before + pushed(columns, impulse, len(mass)) / mass
        member["vx"][moves], member["vy"][moves] = after.T
        link["impulse"] += impulse
        if _closings(member, link).max() > closing:
            member[:], link[:] = member_before, link_before

    def _part(self, member: NDArray[np.void], link: NDArray[np.void], still: float) -> None:
        """Let bodies that still touch part at the speed of rounding, but for discs that gravity presses on walls."""
        at_wall = member["disc"][link["second"]] < 0
        pull = link["nx"] * self._world.gravity[0] + link["ny"] * self._world.gravity[1]
        fastest = 2 * (np.abs(member["vx"]) + np.abs(member["vy"])).max()
        rounding = 2 * max(still, MIN_APPROACH * fastest)  # so that what is parted is beyond rounding
        touches = (link["impulse"] > 0) & ~(at_wall & (pull > self._world.min_pull))
        before, links_before = member.copy(), link.copy()
        link["elasticity"], link["hop"] = 0.0, np.where(touches, rounding, 0.0)
        if _continue(member, member.copy(), link, still, self._world.is_rough)[0] != PARTED:
            member[:], link[:] = before, links_before
        link["elasticity"], link["hop"] = links_before["elasticity"], 0.0

    def _hop(self, member: NDArray[np.void], link: NDArray[np.void], still: float) -> None:
        """Let discs that lean on each other part at the speed of a hop, but for contacts that cannot all open."""
        hop = self._hops(member, link)
        link["elasticity"] = 0.0
        before, links_before = member.copy(), link.copy()
        while hop.any():
            link["hop"], link["last_impulse"] = hop, 0.0
            outcome = _continue(member, member.copy(), link, still, self._world.is_rough)[0]
            gained = max(np.abs(member[key] - before[key]).max() for key in ("vx", "vy"))
            if outcome == PARTED and gained <= hop.sum():
                break
            cannot_open = (link["block_impulse"] > 0) & (hop > 0)
            hop[cannot_open if outcome != PARTED and cannot_open.any() else slice(None)] = 0.0
            member[:], link[:] = before, links_before

    def _hops(self, member: NDArray[np.void], link: NDArray[np.void]) -> Floats:
        """Return the least speeds at which contacts part, (k,) px/s, so that what presses them takes a hop time."""
        world, disc = self._world, member["disc"][link["second"]]
        at_wall = disc < 0
        at_face = at_wall.copy()
        at_face[at_wall] = world.piece["length"][~disc[at_wall]] > 0
        normal = np.stack([link["nx"], link["ny"]], axis=1)
        pull = np.where(member["per_mass"][:, None] > 0, world.gravity, 0.0)
        for k in np.flatnonzero(at_face):  # which carries the disc
            into = pull[link["first"][k]] @ normal[k]
            pull[link["first"][k]] -= max(0.0, into) * normal[k]
        pressing = ((pull[link["first"]] - pull[link["second"]]) * normal).sum(axis=1)
        hop = np.where(at_wall, hop_round_end(world, pressing), pressing * world.hop_time / 2)
        return np.where((pressing > world.min_pull) & ~at_face, hop, 0.0)
