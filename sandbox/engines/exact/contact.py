"""The law of contact: two discs collide, or one bounces off a wall.

A contact exchanges momentum along the line of centres as it is, whatever rounding did to the distance, and `friction`
adds a part along the tangent. Its elasticity is the product of the two factors, with three exceptions that keep an
inelastic collapse, infinitely many contacts in finite time, from stopping the clock:

- Collapse. A contact is elastic if both bodies, or the disc that meets a wall, have had MAX_STREAK contacts, each
  within CONTACT_TIME of the last. In the TC model of S. Luding and S. McNamara, Granular Matter 1 (1998) 113, it is
  elastic as soon as either disc had another contact within t_c before. That models the duration of real contacts. Here
  contacts have no duration: discs that touch in a row have several in one instant, and each must take its energy. Only
  what a collapse would still take after MAX_STREAK contacts is kept.
- Rest under gravity. A bounce off a face that would last less than CONTACT_TIME is not computed: the face carries the
  disc from then on. The disc lies still, slides or rolls down a slope, or is stopped where two walls meet, until
  another disc or a kick moves it or the face ends; the only event meanwhile is the end of slipping. What a wall gives
  to a disc that it carries is a contact at the end of each step, and before each other contact. The disc goes round the
  end of a wall in hops: one of radius 10 px that goes off a shelf of 4 px at 20 or 50 px/s leaves it up to 0.03 px/s
  too fast and, with friction up to 1, its rim up to 0.1 px/s too slow. Discs that lean on each other move apart in hops
  of about the world's hop time: at 900 px/s² and HOP_TIME these are 1.1e-4 px high. A disc that carries others hops
  faster, so that the contacts of a pair, about 1/HOP_TIME a second, grow only as the root of the load. Hops exchange
  momentum as all contacts do, so the walls get the weight of a heap.
- Jams. Discs that fill the room between walls to the last bit have contacts without end. After MAX_SLOW_CONTACTS slow
  ones in a hop time, a slow disc is held where it is, as if its mass were infinite, for a hop time or until something
  fast hits it, and later again after HELD_CONTACTS. What holds it is no wall, so no contact reports it: it remains as
  unexplained momentum. Only discs whose contacts reached a wall within a hop time are held, so none in flight is.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from sandbox.compiled import Record, kernel
from sandbox.engines.exact.friction import rub_discs, rub_wall
from sandbox.engines.exact.impact import NEVER
from sandbox.engines.exact.log import Log, write
from sandbox.engines.exact.records import HELD
from sandbox.engines.exact.support import carry, normal_to, report_support, stop_slipping, unit
from sandbox.engines.exact.world import World, move_to_now, release

CONTACT_TIME: Final = 1e-6  # s, far below the time between contacts, far above the clock's rounding
MAX_STREAK: Final = 50  # contacts of a disc, each within CONTACT_TIME of the last, after which they are elastic
MAX_WEDGED_STREAK: Final = 10_000  # the same, after which a wall returns no speed: the disc is wedged
MAX_LOSSLESS_STREAK: Final = 10_000_000  # the same where no contact takes energy
MIN_PARTING: Final = 1e-12  # of the discs' speeds, so that they part even where e = 0 has left no closing speed
HOP_TIME: Final = 1e-3  # s, for which discs that lean on each other are apart; less is truer and costs more
HOPS_ROUND_END: Final = 10  # hops in a hop time, in which a disc slides round the end of a wall
LEAN_HOPS: Final = 2  # hop times, for which a disc counts as leaning after a hop
SLOW_HOPS: Final = 10  # hop speeds; a contact below this is slow, and a disc below twice this
CONTACTS_PER_LOAD: Final = 4  # slow contacts of a disc in a hop time that make its hops faster by one hop speed
MAX_LOAD: Final = 4  # hop speeds, the fastest hop
MAX_SLOW_CONTACTS: Final = 300  # of a slow disc in a hop time, before it counts as jammed
MAX_JAMMED_CONTACTS: Final = 1000  # the same of a disc that is not slow
HELD_CONTACTS: Final = 10  # the same of a slow disc that has been held


class Parting(NamedTuple):
    """How two bodies part. speed: px/s, along the normal; hops: they lean on each other; rests: the face carries it."""

    speed: float
    hops: bool
    rests: bool


@kernel
def _contact_is_recent(body: Record, now: float) -> bool:
    """Return whether a body's last contact was within CONTACT_TIME."""
    return now - body.last_contact < CONTACT_TIME


@kernel
def _collapses(body: Record, now: float) -> bool:
    """Return whether a body has had more contacts than MAX_STREAK, each within CONTACT_TIME of the last."""
    return body.streak >= MAX_STREAK and _contact_is_recent(body, now)


@kernel
def _hop_speed(world: World, i: int, now: float) -> float:
    """Return the speed at which disc i parts from others that it leans on, px/s: faster if it has many contacts."""
    body = world.body[i]
    if now - body.slow_since > world.hop_time or now - body.held_until <= world.hop_time:
        return world.hop_speed
    return world.hop_speed * min(max(1.0, body.slow_contacts / CONTACTS_PER_LOAD), MAX_LOAD)


@kernel
def _pair_parting(world: World, i: int, j: int, closing: float, pull: float, now: float) -> Parting:
    """Return how discs i and j part. closing: px/s; pull: px/s², which presses them together if positive."""
    a, b, of_a, of_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    speed = of_a.elasticity * of_b.elasticity * closing
    if _contact_is_recent(of_a, now) and _contact_is_recent(of_b, now):
        if _collapses(of_a, now) and _collapses(of_b, now):
            speed = closing
        speed = max(speed, MIN_PARTING * (abs(a.vx) + abs(a.vy) + abs(b.vx) + abs(b.vy)))
    if world.has_gravity and (pull > world.min_pull or now < of_a.leans_until or now < of_b.leans_until):
        hop = world.hop_speed
        if not (_contact_is_recent(of_a, now) and _contact_is_recent(of_b, now)):
            hop = max(_hop_speed(world, i, now), _hop_speed(world, j, now))
        if speed < hop:
            return Parting(hop, True, False)
    return Parting(speed, False, False)


@kernel
def _lean_time(world: World) -> float:
    """Return how long a disc counts as leaning after a hop, s."""
    return LEAN_HOPS * world.hop_time


@kernel
def _shortest_flight(world: World, body: Record, now: float) -> float:
    """Return how long a bounce off a face must last, s, for the disc not to rest instead."""
    return world.hop_time if now < body.leans_until else CONTACT_TIME


@kernel
def _is_wedged(world: World, body: Record, piece: Record) -> bool:
    """Return whether a body's contacts never end."""
    lossless = not world.has_gravity and not world.is_rough and body.elasticity * piece.elasticity == 1
    return body.streak > (MAX_LOSSLESS_STREAK if lossless else MAX_WEDGED_STREAK)


@kernel
def _wall_parting(world: World, i: int, p: int, closing: float, pull: float, now: float) -> Parting:
    """Return how disc i parts from a piece of wall. closing: px/s; pull: px/s², towards the wall if positive."""
    disc, body, piece = world.disc[i], world.body[i], world.piece[p]
    speed = body.elasticity * piece.elasticity * closing
    if _contact_is_recent(body, now):
        if _collapses(body, now):
            speed = closing
        speed = max(speed, MIN_PARTING * (abs(disc.vx) + abs(disc.vy)))
        if _is_wedged(world, body, piece):
            speed = 0.0
    leans, is_face = now < body.leans_until, piece.length > 0
    if is_face and speed <= pull * _shortest_flight(world, body, now) / 2:
        return Parting(0.0, False, True)
    if leans or (pull > world.min_pull and not is_face):
        touches_discs = now - body.last_disc_contact < _lean_time(world)
        hop = _hop_speed(world, i, now) if touches_discs else pull * (world.hop_time / HOPS_ROUND_END) / 2
        if speed < hop:
            return Parting(hop, True, False)
    return Parting(speed, False, False)


@kernel
def _is_slow(world: World, i: int) -> bool:
    """Return whether disc i is about as slow as hops are."""
    return math.hypot(world.disc[i].vx, world.disc[i].vy) < 2 * SLOW_HOPS * world.hop_speed


@kernel
def _inverse_mass(world: World, i: int, other: int, closing: float) -> float:
    """Return 1/mass of disc i, 1/kg: 0 if it is held, and a contact as slow as this (px/s) does not release it."""
    holds = (
        world.has_gravity
        and world.event[i].carrier == HELD
        and closing < SLOW_HOPS * world.hop_speed
        and _is_slow(world, other)
    )
    return 0.0 if holds else 1 / world.body[i].mass


@kernel
def collide(world: World, i: int, j: int, since: float, now: float, log: Log) -> None:
    """Exchange momentum between two discs. since: s, the start of the step."""
    a, b, of_a, of_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    move_to_now(world, i, now)
    move_to_now(world, j, now)
    if world.has_gravity:
        report_support(world, i, since, now, log)
        report_support(world, j, since, now, log)
    nx, ny, distance = unit(b.x - a.x, b.y - a.y)
    closing = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny
    pull = (of_a.ax - of_b.ax) * nx + (of_a.ay - of_b.ay) * ny
    parting = _pair_parting(world, i, j, closing, pull, now)

    per_a, per_b = _inverse_mass(world, i, j, closing), _inverse_mass(world, j, i, closing)
    impulse = (closing + parting.speed) / (per_a + per_b)
    a.vx -= impulse * per_a * nx
    a.vy -= impulse * per_a * ny
    b.vx += impulse * per_b * nx
    b.vy += impulse * per_b * ny
    tangential, slip = 0.0, 0.0
    if world.is_rough or log.collects:
        tangential, slip = rub_discs(world, i, j, nx, ny, impulse, per_a, per_b)
    depth = a.radius + b.radius - distance
    of_i, of_j = np.int64(world.event[i].ball), np.int64(world.event[j].ball)
    write(log, now, of_i, of_j, nx, ny, impulse, depth, tangential, slip)

    of_a.last_disc_contact = of_b.last_disc_contact = now
    if parting.hops:
        of_a.leans_until = of_b.leans_until = now + _lean_time(world)
    if closing < SLOW_HOPS * world.hop_speed:
        of_a.last_support = of_b.last_support = max(of_a.last_support, of_b.last_support)
    for k, per_k, per_other in ((i, per_a, per_b), (j, per_b, per_a)):
        if per_k > 0:
            _count_contact(world, k, now)
            if world.has_gravity:
                if per_other == 0:
                    world.body[k].last_support = now
                _hold_if_jammed(world, k, closing, now)


@kernel
def bounce(world: World, i: int, p: int, since: float, now: float, log: Log) -> None:
    """Reflect disc i off a piece of wall. since: s, the start of the step."""
    disc, body, piece, carrier = world.disc[i], world.body[i], world.piece[p], np.int64(world.event[i].carrier)
    move_to_now(world, i, now)
    report_support(world, i, since, now, log)
    nx, ny, distance = normal_to(disc, piece)
    if p == carrier:
        if world.is_rough and now == world.turn[i].slips_until:
            stop_slipping(world, i, now)
        else:  # it has reached the end of the face that carries it
            release(world, i)
        return
    closing = disc.vx * nx + disc.vy * ny
    pull = body.ax * nx + body.ay * ny
    if carrier >= 0:
        mx, my, _ = normal_to(disc, world.piece[carrier])
        if nx * mx + ny * my > 0:  # bouncing off this face, it leaves the other too, and falls freely
            pull = max(pull, world.gravity[0] * nx + world.gravity[1] * ny)
    parting = _wall_parting(world, i, p, closing, pull, now)

    disc.vx -= (closing + parting.speed) * nx
    disc.vy -= (closing + parting.speed) * ny
    impulse = body.mass * (closing + parting.speed)
    if impulse > 0:
        tangential, slip = rub_wall(world, i, p, nx, ny, impulse)
        depth = disc.radius + piece.half_thickness - distance
        write(log, now, np.int64(world.event[i].ball), ~piece.wall, nx, ny, impulse, depth, tangential, slip)

    _count_contact(world, i, now)
    body.last_support = now
    if parting.rests:
        carry(world, i, p, carrier, _shortest_flight(world, body, now), now, log)
    if parting.hops:
        body.leans_until = now + _lean_time(world)
    if now - body.last_disc_contact < _lean_time(world):
        _hold_if_jammed(world, i, closing, now)


@kernel
def _count_contact(world: World, i: int, now: float) -> None:
    """Count a contact of disc i, and let it fly freely."""
    body = world.body[i]
    body.streak = body.streak + 1 if _contact_is_recent(body, now) else 0
    body.last_contact = now
    release(world, i)


@kernel
def _hold_if_jammed(world: World, i: int, closing: float, now: float) -> None:
    """Count disc i's slow contacts and, if they are too many, hold it for a hop time."""
    disc, body = world.disc[i], world.body[i]
    if closing >= SLOW_HOPS * world.hop_speed:
        return
    if now - body.slow_since > world.hop_time:
        body.slow_since, body.slow_contacts = now, 0
    body.slow_contacts += 1
    is_supported = now - body.last_support < world.hop_time
    limit = MAX_SLOW_CONTACTS if _is_slow(world, i) else MAX_JAMMED_CONTACTS
    if is_supported and body.slow_contacts > limit:
        disc.vx = disc.vy = body.ax = body.ay = 0.0
        if world.is_rough:
            world.turn[i].spin_rate, world.turn[i].slips_until = 0.0, NEVER
        world.event[i].carrier, body.held_until = HELD, now + world.hop_time
        body.slow_since, body.slow_contacts = body.held_until, MAX_SLOW_CONTACTS - HELD_CONTACTS
