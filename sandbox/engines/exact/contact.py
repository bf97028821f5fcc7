"""The law of contact of smooth discs: two discs collide, or one bounces off a wall.

There is no friction. A contact exchanges momentum along the line of centres as it is, whatever rounding did to the
distance. Its elasticity is the product of the two factors, with three exceptions that keep an inelastic collapse,
infinitely many contacts in finite time, from stopping the clock:

- TC model (S. Luding and S. McNamara, Granular Matter 1 (1998) 113): a contact within CONTACT_TIME of the last contact
  of both discs is elastic; with a wall, one within CONTACT_TIME of the last two contacts, as a corner has two walls.
- Rest under gravity. A bounce off a face that would last less than CONTACT_TIME is not computed: the face carries the
  disc from then on. The disc lies still, slides down a slope, or is stopped where two walls meet, all without events,
  until another disc or a kick moves it or the face ends; each step reports one contact. It slides round the end of a
  wall in hops. Discs that lean on each other move apart in hops of about the world's hop time: at 900 px/s² and
  HOP_TIME these are 1.1e-4 px high, and cost about 1/HOP_TIME contacts a second for each pair that touches.
- Rattling. A disc enclosed by others that press on it has ever more, ever slower contacts. After MAX_SLOW_CONTACTS of
  them within a hop time it is held where it is, as if its mass were infinite, for a hop time or until something hits
  it faster. So a heap costs about MAX_SLOW_CONTACTS/HOP_TIME contacts a second per disc, however tightly it is packed.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from sandbox.compiled import Record, kernel
from sandbox.engines.exact.records import HELD, NONE
from sandbox.engines.exact.world import COINCIDENT, World, move_to_now, release
from sandbox.engines.walls import ARENA_COUNT

CONTACT_TIME: Final = 1e-6  # s, the TC model's t_c: far below the time between contacts, far above the clock's rounding
HOP_TIME: Final = 1e-3  # s, for which discs that lean on each other are apart; less is truer and costs more
HOPS_ROUND_END: Final = 10  # hops in a hop time, in which a disc slides round the end of a wall
LEAN_HOPS: Final = 2  # hop times, for which a disc counts as leaning after a hop
RATTLE_SPEED: Final = 10  # in units of the hop speed; a slower contact counts as rattling
MAX_SLOW_CONTACTS: Final = 10  # within a hop time, before a disc is held
MIN_PARTING: Final = 1e-12  # of the discs' speeds, so that they part even where e = 0 has left no closing speed
MAX_STREAK: Final = 10_000  # contacts, each within CONTACT_TIME of the last, before a wall stops a disc: it is wedged
MAX_LOSSLESS_STREAK: Final = 10_000_000  # the same if no contact takes energy; then only its normal motion is stopped


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
def _pair_parting(world: World, i: int, j: int, closing: float, pull: float, now: float) -> Parting:
    """Return how discs i and j part. closing: px/s; pull: px/s², which presses them together if positive."""
    a, b, of_a, of_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    if _contact_is_recent(of_a, now) and _contact_is_recent(of_b, now):
        speed = max(closing, MIN_PARTING * (abs(a.vx) + abs(a.vy) + abs(b.vx) + abs(b.vy)))
    else:
        speed = of_a.elasticity * of_b.elasticity * closing
    if speed < world.hop_speed and (pull > 0 or now < of_a.leans_until or now < of_b.leans_until):
        return Parting(world.hop_speed, True, False)
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
def _wall_parting(world: World, i: int, p: int, closing: float, pull: float, now: float) -> Parting:
    """Return how disc i parts from a piece of wall. closing: px/s; pull: px/s², towards the wall if positive."""
    disc, body, piece = world.disc[i], world.body[i], world.piece[p]
    if _contact_is_recent(body, now) and body.streak > 0:  # one contact before may have been with a corner's other wall
        speed = max(closing, MIN_PARTING * (abs(disc.vx) + abs(disc.vy)))
    else:
        speed = body.elasticity * piece.elasticity * closing
    leans, is_face = now < body.leans_until, piece.length > 0
    if is_face and speed <= pull * _shortest_flight(world, body, now) / 2:
        return Parting(0.0, False, True)
    if leans or (pull > 0 and not is_face):
        touches_discs = now - body.last_disc_contact < _lean_time(world)
        hop = world.hop_speed if touches_discs else pull * (world.hop_time / HOPS_ROUND_END) / 2
        if speed < hop:
            return Parting(hop, True, False)
    return Parting(speed, False, False)


@kernel
def _inverse_mass(world: World, i: int, closing: float) -> float:
    """Return 1/mass of disc i, 1/kg: 0 if it is held, and stays held in a contact as slow as this (px/s)."""
    holds = closing < RATTLE_SPEED * world.hop_speed and world.event[i].carrier == HELD
    return 0.0 if holds else 1 / world.body[i].mass


@kernel
def collide(world: World, i: int, j: int, now: float) -> tuple[float, float, float, float]:
    """Exchange momentum between two discs. Returns the normal from i to j, the impulse (kg px/s), the depth (px)."""
    a, b, of_a, of_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    move_to_now(world, i, now)
    move_to_now(world, j, now)
    nx, ny, distance = _unit(b.x - a.x, b.y - a.y)
    closing = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny
    pull = (of_a.ax - of_b.ax) * nx + (of_a.ay - of_b.ay) * ny
    parting = _pair_parting(world, i, j, closing, pull, now)

    per_a, per_b = _inverse_mass(world, i, closing), _inverse_mass(world, j, closing)
    impulse = (closing + parting.speed) / (per_a + per_b)
    a.vx -= impulse * per_a * nx
    a.vy -= impulse * per_a * ny
    b.vx += impulse * per_b * nx
    b.vy += impulse * per_b * ny

    of_a.last_disc_contact = of_b.last_disc_contact = now
    if parting.hops:
        of_a.leans_until = of_b.leans_until = now + _lean_time(world)
    for k, per_k in ((i, per_a), (j, per_b)):
        if per_k > 0:
            _count_contact(world, k, now)
            _hold_if_it_rattles(world, k, closing, now)
    return nx, ny, impulse, a.radius + b.radius - distance


@kernel
def _unit(rx: float, ry: float) -> tuple[float, float, float]:
    """Return the unit vector along r, and its length (px)."""
    if rx == 0 and ry == 0:
        rx = COINCIDENT
    distance = math.sqrt(rx * rx + ry * ry)
    return rx / distance, ry / distance, distance


@kernel
def _normal(disc: Record, piece: Record) -> tuple[float, float, float]:
    """Return the unit normal from a disc to a piece of wall, and the distance of the piece's line or point (px)."""
    rx, ry = piece.x - disc.x, piece.y - disc.y
    if piece.length == 0:
        return _unit(rx, ry)
    off = ry * piece.tx - rx * piece.ty
    side = 1.0 if off > 0 and piece.wall >= ARENA_COUNT else -1.0
    return -side * piece.ty, side * piece.tx, side * off


@kernel
def bounce(world: World, i: int, p: int, now: float) -> tuple[float, float, float, float]:
    """Reflect disc i off a piece of wall. Returns the normal to it, the impulse (kg px/s), the depth (px)."""
    disc, body, piece, carrier = world.disc[i], world.body[i], world.piece[p], np.int64(world.event[i].carrier)
    move_to_now(world, i, now)
    nx, ny, distance = _normal(disc, piece)
    if p == carrier:  # it has reached the end of the face that carries it
        release(world, i)
        return nx, ny, 0.0, 0.0
    closing = disc.vx * nx + disc.vy * ny
    pull = body.ax * nx + body.ay * ny
    parting = _wall_parting(world, i, p, closing, pull, now)

    disc.vx -= (closing + parting.speed) * nx
    disc.vy -= (closing + parting.speed) * ny

    _count_contact(world, i, now)
    if parting.rests:
        _carry(world, i, p, carrier, now, nx, ny)
    if parting.hops:
        body.leans_until = now + _lean_time(world)
    if now - body.last_disc_contact < _lean_time(world):
        _hold_if_it_rattles(world, i, closing, now)
    _stop_if_wedged(world, i, p, parting.speed, nx, ny)
    return nx, ny, body.mass * (closing + parting.speed), disc.radius + piece.half_thickness - distance


@kernel
def _count_contact(world: World, i: int, now: float) -> None:
    """Count a contact of disc i, and let it fly freely."""
    body = world.body[i]
    body.streak = body.streak + 1 if _contact_is_recent(body, now) else 0
    body.last_contact = now
    release(world, i)


@kernel
def _stop(disc: Record, body: Record) -> None:
    disc.vx = disc.vy = body.ax = body.ay = 0.0


@kernel
def _hold_if_it_rattles(world: World, i: int, closing: float, now: float) -> None:
    """Count disc i's slow contacts, which only gravity causes, and hold it for a hop time if they are too many."""
    body = world.body[i]
    if closing >= RATTLE_SPEED * world.hop_speed:
        return
    if now - body.slow_since > world.hop_time:
        body.slow_since, body.slow_contacts = now, 0
    body.slow_contacts += 1
    if body.slow_contacts > MAX_SLOW_CONTACTS:
        _stop(world.disc[i], body)
        world.event[i].carrier, body.held_until = HELD, now + world.hop_time


@kernel
def _stop_if_wedged(world: World, i: int, p: int, parting: float, nx: float, ny: float) -> None:
    """Stop disc i if its contacts never end; if none of them takes energy, stop only its motion along the normal."""
    disc, body = world.disc[i], world.body[i]
    lossless = not world.has_gravity and body.elasticity * world.piece[p].elasticity == 1
    if lossless and body.streak > MAX_LOSSLESS_STREAK:
        disc.vx += parting * nx
        disc.vy += parting * ny
    elif not lossless and body.streak > MAX_STREAK:
        _stop(disc, body)


@kernel
def _carry(world: World, i: int, p: int, before: int, now: float, nx: float, ny: float) -> None:
    """Let face p carry disc i; stop it if it would soon return to the face that carried it before."""
    disc, body = world.disc[i], world.body[i]
    pull = body.ax * nx + body.ay * ny
    body.ax -= pull * nx
    body.ay -= pull * ny
    world.event[i].carrier = p
    if before != NONE:
        mx, my, _ = _normal(disc, world.piece[before])
        pull = body.ax * mx + body.ay * my
        if pull > 0 and abs(disc.vx * mx + disc.vy * my) <= pull * _shortest_flight(world, body, now) / 2:
            _stop(disc, body)
