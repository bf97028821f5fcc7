"""Inelastic collapse: unending sequences of impacts between bodies that touch, and their limits.

A light disc between a heavy one and a wall, discs that close on each other, a disc in a corner: where bodies touch,
impacts follow each other at one time, and if restitution takes more than what the masses return, they never end. Their
approach speeds then fall geometrically, and what is left over is a group that touches and moves on together (V. Acary
and B. Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, ch. 1; C. Glocker, Set-Valued Force Laws,
2001, ch. 9). S. Luding and S. McNamara, Granular Matter 1 (1998) 113, make such impacts elastic instead, as contacts of
a finite duration are; those of `exact` have none.

At one time only velocities change, and the normals stay. So a sequence goes on in sweeps over the contacts of a group,
by the law of a single contact. Once the impulses of all contacts fall by one ratio q, they still add up to q / (1 - q)
of the last ones. That is given at once, until a slip ends or another contact closes: then the sequence goes on.

Where q is 1 the bodies have no room to part: a disc in a slot of its own width, a row that fills a floor. Then their
restitution is 0, and if that has no end either, one solution of all contacts together ends the sequence. Bodies as slow
as hops are given that solution without a second round, and without a first one if they had no room within the last hop
time. Where they have room, those that still touch part at the speed of rounding. Under gravity they part in hops (see
`contact`), by a solution that leaves at least these speeds; contacts that cannot all open, because they bear a load
against each other between walls, are given none.
"""

from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.compiled import column
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.exact.contact import (
    CONTACT_TIME,
    MIN_APPROACH,
    SLOW_HOPS,
    count_slow_contacts,
    give,
    hop_round_end,
    lean_until,
)
from sandbox.engines.exact.heaps.islands import products
from sandbox.engines.exact.heaps.statics import columns_of, equilibrium
from sandbox.engines.exact.heaps.touching import Touching, find_touching
from sandbox.engines.exact.support import report_support
from sandbox.engines.exact.world import STATIC, World, motions, move_to_now, release, rotations
from sandbox.engines.grid import NONE
from sandbox.engines.laws import friction_impulse
from sandbox.state import CONTACT, Contacts, Floats, Integers

GAP_ROUNDING: Final = 1e-14  # relative, of coordinates, 45 units in the last place: gaps within it are closed
CLOCK_ROUNDING: Final = 1e-15  # relative, of the time, 5 units in the last place
SWEEPS_PER_BLOCK: Final = 12  # whose impulses are compared: cycles of 1, 2, 3, 4 and 6 sweeps fit in
STEADY: Final = 1e-11  # relative, within which the impulses of all contacts fall by one ratio; far above rounding
IMPULSE_ROUNDING: Final = 1e-14  # relative, of impulses at the speed of the fastest bodies, whose rounding all share
ENDLESS_RATIO: Final = 1 - 1e-9  # from which on impulses do not fall: the bodies have no room
SHARE_AT_ONCE: Final = 1 - 2**-10  # of what a sequence still adds up to: not all, as the ratio is not exact
MAX_CHECKS: Final = 24_000  # of contacts in a sequence, after which it counts as one without end
# Of springs, lightest mass / s². In a full row that is out of line by 1e-5 of a radius, a disc is a wedge, and with
# springs that are 1e4 times softer it would go on to move, and set off the next sequence.
STOP_STIFFNESS: Final = 1e10
OPENS: Final = 1e-6  # of the fastest hop, by which contacts may part more slowly
RESIDUAL: Final = 4  # times an approach that is left: what contacts among the same bodies may make of it
REST: Final = 1e-13  # of the group's speeds before: a slower approach counts as rest


class Law(NamedTuple):
    """Elasticities and frictions of contacts, and the least speeds at which they part, px/s: (c,) each."""

    elasticity: Floats
    friction: Floats
    hop: Floats


class Group:
    """Discs that touch, their velocities and their contacts.

    disc: (m,); v: (3 m,) px/s, of each disc vx, vy and radius times spin; touching: (c,); normal, tangent: (c, 3 m),
    which give the speeds of closing and slip; impulse: (2, c) kg px/s, so far; slip: (c,) px/s, before the first.
    """

    def __init__(self, world: World, disc: Integers, velocity: Floats, touching: Touching) -> None:
        self.world, self.disc, self.v, self.touching = world, disc, velocity.ravel(), touching
        count = len(touching.first)
        self.mass = column(world.body, "mass")[disc]
        self.yields = np.stack([1 / self.mass, 1 / self.mass, 2 / self.mass], axis=1).ravel()  # 1/kg
        self.normal, self.tangent = np.zeros((2, count, len(self.v)))
        self.impulse, self.slip = np.zeros((2, count)), np.zeros(count)
        local = np.full(len(world.disc), NONE)
        local[disc] = np.arange(len(disc))
        self.first, self.second = local[touching.first], np.where(touching.second < 0, NONE, local[touching.partner])
        nx, ny = touching.normal.T
        for end, sign in ((self.first, 1.0), (self.second, -1.0)):
            c = np.flatnonzero(end != NONE)
            self.normal[c, 3 * end[c]], self.normal[c, 3 * end[c] + 1] = sign * nx[c], sign * ny[c]
            self.tangent[c, 3 * end[c]], self.tangent[c, 3 * end[c] + 1] = -sign * ny[c], sign * nx[c]
            self.tangent[c, 3 * end[c] + 2] = 1.0
        self.still = REST * max(np.abs(self.v).max(), world.hop_speed)

    def fastest(self) -> float:
        """Return the fastest approach, px/s."""
        return float((self.normal @ self.v).max(initial=0.0))

    def go_on(self, law: Law) -> bool:
        """Continue the impacts until none closes and return True, or False if they have no end or do not show one."""
        last, rows = np.zeros_like(self.slip), self._rows(law)
        for _ in range(0, MAX_CHECKS, SWEEPS_PER_BLOCK * max(1, len(rows))):
            block, closes = self._sweeps(rows)
            if not closes:
                return True
            ratio, last = self._ratio(block[0], last), block[0]
            if ratio >= ENDLESS_RATIO:
                return False
            if ratio > 0:
                self._add_rest(law, block, ratio / (1 - ratio))
                last = np.zeros_like(last)
        return False

    def _sweeps(self, rows: list[Any]) -> tuple[Floats, bool]:
        """Do the impacts of a block of sweeps over the contacts, or fewer if none closes any more.

        Returns their impulses, (2, c), and whether they go on.
        """
        v, closes, sweeps = [*self.v.tolist(), 0.0, 0.0, 0.0], True, 0
        normal, tangential, slips = ([0.0] * len(rows) for _ in range(3))
        while closes and sweeps < SWEEPS_PER_BLOCK:
            closes, sweeps = False, sweeps + 1
            for c, (i, j, per_i, per_j, nx, ny, e, mu, hop) in enumerate(rows):
                closing = (v[i] * nx + v[i + 1] * ny) - (v[j] * nx + v[j + 1] * ny)
                speed = abs(v[i]) + abs(v[i + 1]) + abs(v[j]) + abs(v[j + 1])
                if closing + hop <= max(self.still, MIN_APPROACH * speed):
                    continue
                slip = (v[i + 1] * nx - v[i] * ny + v[i + 2]) - (v[j + 1] * nx - v[j] * ny - v[j + 2])
                impulse = (closing + max(e * closing, hop)) / (per_i + per_j)
                rub = friction_impulse(slip, mu * impulse, per_i + per_j)
                x, y = impulse * nx - rub * ny, impulse * ny + rub * nx
                for k, signed in ((i, -per_i), (j, per_j)):
                    v[k] += signed * x
                    v[k + 1] += signed * y
                    v[k + 2] -= 2 * abs(signed) * rub
                slips[c] = slips[c] if normal[c] > 0 else slip
                normal[c] += impulse
                tangential[c] += rub
                closes = True
        self.v, self.slip = np.array(v[:-3]), np.where(self.impulse[0] > 0, self.slip, slips)
        block = np.array([normal, tangential])
        self.impulse += block
        return block, closes

    def _rows(self, law: Law) -> list[Any]:
        """Return for each contact where its bodies' velocities begin, their inverse masses, its normal and its law.

        What does not move has the inverse mass 0, and a velocity of its own behind those of the discs.
        """
        ends = [np.where(end == NONE, len(self.disc), end) for end in (self.first, self.second)]
        per_mass = np.append(1 / self.mass, 0.0)
        parts = *(3 * end for end in ends), *(per_mass[end] for end in ends), *self.touching.normal.T, *law
        return list(zip(*(part.tolist() for part in parts), strict=True))

    def _ratio(self, block: Floats, last: Floats) -> float:
        """Return the ratio of the impulses to those of the block before, 0 if not all have the same."""
        ratio = float(block.sum() / last.sum()) if last.any() else 0.0
        rounding = IMPULSE_ROUNDING * ((self.normal != 0) @ np.abs(self.v)).max() / (self.normal**2 @ self.yields)
        return ratio if (np.abs(block - ratio * last) <= STEADY * block.max() + rounding).all() else 0.0

    def _add_rest(self, law: Law, block: Floats, rest: float) -> None:
        """Give at once what the sequence still adds up to, while contacts go on to slip as they do, and none closes."""
        change = -rest * self.yields * (block[0] @ self.normal + block[1] @ self.tangent)
        closing, more = self.normal @ self.v + law.hop, self.normal @ change
        slip, more_slip = self.tangent @ self.v, self.tangent @ change
        closes = (block[0] == 0) & (closing <= 0) & (closing + more > 0)
        slips = (block[0] > 0) & (np.abs(block[1]) >= (1 - STEADY) * law.friction * block[0])
        ends = slips & (slip * (slip + more_slip) < 0)
        shares = *(-closing[closes] / more[closes]), *(-SHARE_AT_ONCE * slip[ends] / more_slip[ends])
        share = min(SHARE_AT_ONCE, *shares) if shares else SHARE_AT_ONCE
        self.v = self.v + share * change
        self.impulse += share * rest * block

    def solve(self, hop: Floats) -> Floats:
        """Solve all contacts together, with restitution 0 and without friction, so that they part at these speeds.

        hop: (c,) px/s. Returns the speeds at which they close nevertheless, as they cannot all part: (c,) px/s.
        """
        swap = self.first == NONE  # only the first of a column moves
        first, second = np.where(swap, self.second, self.first), np.where(swap, NONE, self.second)
        normal = np.where(swap[:, None], -1, 1) * self.touching.normal
        nothing, mass = np.zeros(len(first)), np.repeat(self.mass[:, None], 2, axis=1)
        load, stiffness = mass * self.v.reshape(-1, 3)[:, :2], STOP_STIFFNESS * float(self.mass.min())
        columns = columns_of(first, second, normal, nothing)
        _, impulse = equilibrium(columns, mass, load, stiffness=stiffness, least=hop)
        self.v = self.v - self.yields * (impulse @ self.normal)
        self.impulse[0] += impulse
        closing: Floats = self.normal @ self.v
        return closing


def resolve(world: World, seed: int, since: float, now: float, *, collects: bool) -> tuple[Integers, Contacts, bool]:
    """Resolve the sequence of impacts in which disc `seed` is, to its end or to its limit.

    since: s, start of the step; collects: whether contacts are recorded. Returns the discs whose events must be
    predicted anew, the contacts to report, and whether a disc is jammed.
    """
    body = world.body[seed]
    body.streak += 1  # so that the contact is resolved by itself if it is part of no group
    group = _group_of(world, seed, 0.0, now)
    is_slow = world.has_gravity and np.abs(group.normal @ group.v).max(initial=0.0) < SLOW_HOPS * world.hop_speed
    if is_slow:  # it is resolved across gaps too short for contacts of their own
        group = _group_of(world, seed, CONTACT_TIME * world.hop_speed, now)
    nothing = np.zeros(len(group.slip))
    law = Law(products(world, group.touching, "elasticity"), products(world, group.touching, "friction"), nothing)
    had_no_room = is_slow and body.residual == np.inf and now - body.settled < world.hop_time
    has_room, law = not had_no_room and group.go_on(law), law._replace(elasticity=nothing)
    if has_room:
        _part(group, law)
    elif is_slow or not group.go_on(law):
        before, impulse, closing = group.v, group.impulse.copy(), group.fastest()
        if group.solve(nothing).max(initial=0.0) > closing:  # than which the springs' rounding would be faster
            group.v, group.impulse = before, impulse
    hops = _hop(group) if world.has_gravity else nothing
    at_rest = len(nothing) * group.still  # a disc at rest is as fast as the approaches to it, added up
    group.v[np.abs(group.v) < at_rest] = 0.0
    residual = RESIDUAL * max(at_rest, group.fastest()) if has_room else np.inf
    return _write_back(group, hops, residual, since, now, collects=collects)


def _group_of(world: World, seed: int, way: float, now: float) -> Group:
    """Return the discs that a disc touches, directly or through others, but not through static islands.

    way: px, that is closed if bodies approach as slowly as hops.
    """
    m = motions(world, now)
    rounding = GAP_ROUNDING * (np.abs(m.x) + np.abs(m.y) + column(world.disc, "radius"))
    rounding += CLOCK_ROUNDING * now * (np.abs(m.vx) + np.abs(m.vy))
    everything = np.full(len(m.x), True)
    touching = find_touching(world, m, everything, 2 * float(rounding.max()) + 2 * way)
    first, partner, pairs = touching.first, touching.partner, touching.second >= 0
    velocity = np.stack([m.vx, m.vy], axis=1)
    closing = ((velocity[first] - velocity[partner] * pairs[:, None]) * touching.normal).sum(axis=1)
    slack = rounding + way
    near = touching.gap <= np.where(
        np.abs(closing) < SLOW_HOPS * world.hop_speed,
        slack[first] + slack[partner] * pairs,
        rounding[first] + rounding[partner] * pairs,
    )
    moves = column(world.event, "carrier") != STATIC
    number = touching.where(near & moves[first] & moves[partner] & pairs).groups(len(m.x))
    members = moves & (number == number[seed])
    touching = touching.where(near & (members[first] | (members[partner] & pairs)))
    disc = np.flatnonzero(members)
    rim = (column(world.disc, "radius") * rotations(world, now)[1])[disc]
    return Group(world, disc, np.column_stack([velocity[disc], rim]), touching)


def _part(group: Group, law: Law) -> None:
    """Let bodies that still touch part at the speed of rounding, but for discs that gravity presses on walls."""
    at_wall, pull = group.touching.second < 0, group.touching.normal @ np.array(group.world.gravity)
    vx, vy, _ = np.abs(group.v.reshape(-1, 3)).T
    rounding = 2 * max(group.still, MIN_APPROACH * 2 * (vx + vy).max())  # so that what is parted is beyond rounding
    touches = (group.impulse[0] > 0) & ~(at_wall & (pull > group.world.min_pull))
    before, impulse = group.v, group.impulse.copy()
    if not group.go_on(law._replace(hop=np.where(touches, rounding, 0.0))):
        group.v, group.impulse = before, impulse


def _hop(group: Group) -> Floats:
    """Let discs that lean on each other part at the speed of a hop, but for contacts that cannot all open.

    Returns these speeds, (c,) px/s.
    """
    hop, before, impulse = _hops(group), group.v, group.impulse.copy()
    while hop.any():
        cannot_open = group.solve(hop) + hop > OPENS * hop.max()
        if not cannot_open.any() and np.abs(group.v - before).max() <= hop.sum():
            break
        hop = np.where(cannot_open, 0.0, hop) if (cannot_open & (hop > 0)).any() else np.zeros_like(hop)
        group.v, group.impulse = before, impulse.copy()
    return hop


def _hops(group: Group) -> Floats:
    """Return the least speeds at which contacts part, (c,) px/s, so that what presses them takes a hop time."""
    world, touching, at_wall = group.world, group.touching, group.touching.second < 0
    at_face = np.zeros_like(at_wall)
    at_face[at_wall] = column(world.piece, "length")[~touching.second[at_wall]] > 0
    pull = np.zeros_like(group.v).reshape(-1, 3)
    pull[:, :2] = world.gravity
    for c in np.flatnonzero(at_face):  # which carries the disc
        into = max(0.0, pull[group.first[c], :2] @ touching.normal[c])
        pull[group.first[c], :2] -= into * touching.normal[c]
    pressing = group.normal @ pull.ravel()
    hop = np.where(at_wall, hop_round_end(world, pressing), pressing * world.hop_time / 2)
    return np.where((pressing > world.min_pull) & ~at_face, hop, 0.0)


def _write_back(
    group: Group, hops: Floats, residual: float, since: float, now: float, *, collects: bool
) -> tuple[Integers, Contacts, bool]:
    """Give discs what a sequence has left them, and report the sums of its impulses. residual: px/s, see BODY."""
    world, touching, hit = group.world, group.touching, group.impulse[0] != 0
    log = Log(np.zeros(len(hit) + 2 * len(group.disc), CONTACT), np.zeros(1, np.int64), collects)
    is_hit = (group.normal[hit] != 0).any(axis=0).reshape(-1, 3).any(axis=1)
    for i, (vx, vy, rim) in zip(group.disc[is_hit].tolist(), group.v.reshape(-1, 3)[is_hit].tolist(), strict=True):
        move_to_now(world, i, now)
        report_support(world, i, since, now, log)
        disc, body = world.disc[i], world.body[i]
        disc.vx, disc.vy = vx, vy
        if world.is_rough:
            world.turn[i].spin = rim / disc.radius
        release(world, i)
        body.last_contact = body.settled = now
        body.residual, body.streak = residual, 0
    jams = False
    for c in np.flatnonzero(hit):
        i, j, (impulse, rub) = int(touching.first[c]), int(touching.second[c]), group.impulse[:, c].tolist()
        nx, ny = touching.normal[c].tolist()
        for k, sign in ((i, -1), (j, 1)):
            if k >= 0 and world.event[k].carrier == STATIC:
                give(world, k, sign * (impulse * nx - rub * ny), sign * (impulse * ny + rub * nx))
            elif k >= 0:
                if j >= 0:
                    world.body[k].last_disc_contact = now
                if hops[c] > 0:
                    lean_until(world, k, world.hop_time, now)
                if world.has_gravity:
                    jams |= count_slow_contacts(world, k, 0.0, now)
        second = ~world.piece[~j].wall if j < 0 else world.event[j].ball
        depth, slip = -float(touching.gap[c]), float(group.slip[c])
        log_contact(log, now, world.event[i].ball, second, nx, ny, impulse, depth, rub, slip)
    return group.disc[is_hit], log.row[: log.filled[0]], jams
