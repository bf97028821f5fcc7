"""The law of contact: two discs collide, or one bounces off a wall.

A contact exchanges momentum along the line of centres as it is, whatever rounding did to the distance. Its elasticity
and its friction are the products of two factors. With n the unit normal from a disc to what it touches and
t = (-n_y, n_x) the tangent, the slip u (px/s) is the speed along t of the disc's rim past the other's. An impact with
the impulse J along n has along t the impulse u m/3, which stops the slip, or mu J if that is less (S. F. Foerster et
al., Phys. Fluids 6 (1994) 1108, with beta_0 = 0).

Three exceptions keep contacts from stopping the clock:

- A disc's contacts that follow each other at one time may have no end. From MIN_STREAK on, `heaps.collapse` takes over.
- A face carries a disc from a bounce on that would last less than CONTACT_TIME (see `support`). Discs that lean on each
  other, or on the end of a wall, part in hops, which exchange momentum as all contacts do (see `heaps`).
- A static island, as `heaps.islands` describes, is infinitely heavy to slow discs, and a fast hit wakes it.
"""

from typing import Any, Final, NamedTuple

from sandbox.compiled import Record, kernel
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.exact.support import carry, normal_to, report_support, slip_on, stop_slipping, unit
from sandbox.engines.exact.world import STATIC, World, motion, move_to_now, release
from sandbox.engines.laws import friction_impulse

CONTACT_TIME: Final = 1e-6  # s, far below the time between contacts, far above the clock's rounding
MIN_STREAK: Final = 64  # contacts of a disc, each within CONTACT_TIME of the last, from which on they may have no end
MIN_APPROACH: Final = 1e-12  # of the speeds of bodies that touch, and of a hop; a slower approach is rounding
HOP_TIME: Final = 1e-3  # s, for which discs that lean on each other are apart; less is truer and costs more
HOPS_ROUND_END: Final = 10  # hops in a hop time, in which a disc slides round the end of a wall; more are truer
LEAN_HOPS: Final = 2  # hop times, for which a disc counts as leaning after a hop: until after the next contact
SLOW_HOPS: Final = 10  # hop speeds; a contact below this is slow, and a disc below twice this
CONTACTS_PER_LOAD: Final = 4  # slow contacts of a disc in a hop time that make its hops faster by one hop speed
MAX_LOAD: Final = 4  # hop speeds, the fastest hop: its heat grows with the square
JAMMED_CONTACTS: Final = 100  # slow ones of a disc in a hop time, from which on it counts as jammed
MAX_SLOW_CONTACTS: Final = 300  # the same, at which it is examined at once


class Parting(NamedTuple):
    """How two bodies part.

    speed: px/s, along the normal; hop_time: s, of the hop in which bodies that lean on each other part, or 0; rests:
    whether the face carries the disc from now on.
    """

    speed: float
    hop_time: float
    rests: bool


@kernel
def collapses(world: World, i: int, now: float) -> bool:
    """Return whether disc i has had so many contacts in a row that they may have no end."""
    body = world.body[i]
    is_due = body.streak >= MIN_STREAK and body.streak & (body.streak - 1) == 0
    return is_due and now - body.last_contact < CONTACT_TIME


@kernel
def _hop_speed(world: World, i: int, now: float) -> float:
    """Return the speed at which disc i parts from others that it leans on, px/s: faster if it has many contacts."""
    body = world.body[i]
    if now - body.slow_since > world.hop_time:
        return world.hop_speed
    return world.hop_speed * min(max(1.0, body.slow_contacts / CONTACTS_PER_LOAD), MAX_LOAD)


@kernel
def _pair_parting(world: World, i: int, j: int, closing: float, pull: float, now: float) -> Parting:
    """Return how discs i and j part. closing: px/s; pull: px/s², which presses them together if positive."""
    of_a, of_b = world.body[i], world.body[j]
    speed = of_a.elasticity * of_b.elasticity * closing
    leans = pull > world.min_pull or now < of_a.leans_until or now < of_b.leans_until
    if world.has_gravity and leans:
        hop = world.hop_speed
        if now - min(of_a.last_contact, of_b.last_contact) >= CONTACT_TIME:
            hop = max(_hop_speed(world, i, now), _hop_speed(world, j, now))
        # Friction presses them together only while they slip on what carries them.
        time = min(world.hop_time, world.turn[i].slips_until - now, world.turn[j].slips_until - now)
        hop *= time / world.hop_time
        if speed < hop:
            return Parting(hop, time, False)
    return Parting(speed, 0.0, False)


@kernel
def lean_until(world: World, i: int, hop_time: float, now: float) -> None:
    """Let disc i count as leaning after a hop (s)."""
    body = world.body[i]
    body.leans_until = max(body.leans_until, now + LEAN_HOPS * hop_time)


@kernel
def _leans_on_discs(world: World, body: Record, now: float) -> bool:
    """Return whether a body's last contact with a disc is as recent as if it leaned on the disc."""
    return now - body.last_disc_contact < LEAN_HOPS * world.hop_time


@kernel
def hop_round_end(world: World, pull: Any) -> Any:
    """Return the speed of the hops in which a disc goes round the end of a wall, px/s. pull: px/s², towards it."""
    return pull * (world.hop_time / HOPS_ROUND_END) / 2


@kernel
def _wall_parting(
    world: World, i: int, p: int, closing: float, pull: float, shortest_flight: float, now: float
) -> Parting:
    """Return how disc i parts from a piece of wall, or rests on it instead of a flight shorter than that (s).

    closing: px/s; pull: px/s², towards the wall if positive.
    """
    body, piece = world.body[i], world.piece[p]
    speed = body.elasticity * piece.elasticity * closing
    leans, is_face = now < body.leans_until, piece.length > 0
    if is_face and speed <= pull * shortest_flight / 2:
        return Parting(0.0, 0.0, True)
    if leans or (pull > world.min_pull and not is_face):
        hop = _hop_speed(world, i, now) if _leans_on_discs(world, body, now) else hop_round_end(world, pull)
        if speed < hop:
            return Parting(hop, world.hop_time, False)
    return Parting(speed, 0.0, False)


@kernel
def wakes(world: World, i: int, striker: int, now: float) -> bool:
    """Return whether disc i is part of a static island, and another disc hits it so fast that it wakes it."""
    if world.event[i].carrier != STATIC:
        return False
    disc, m = world.disc[i], motion(world, striker, now)
    nx, ny, _ = unit(disc.x - m.x, disc.y - m.y)
    return m.vx * nx + m.vy * ny >= SLOW_HOPS * world.hop_speed


@kernel
def _inverse_mass(world: World, i: int) -> float:
    """Return 1/mass of disc i, 1/kg: 0 if it is part of a static island."""
    return 0.0 if world.has_gravity and world.event[i].carrier == STATIC else 1 / world.body[i].mass


@kernel
def _apply_friction(world: World, i: int, nx: float, ny: float, tangential: float, per_mass: float) -> None:
    """Take an impulse along the tangent (kg px/s) from disc i. per_mass: 1/kg, 0 if it is part of a static island."""
    disc = world.disc[i]
    disc.vx += tangential * per_mass * ny
    disc.vy -= tangential * per_mass * nx
    world.turn[i].spin -= 2 * tangential * per_mass / disc.radius


@kernel
def collide(world: World, i: int, j: int, since: float, now: float, log: Log) -> bool:
    """Exchange momentum between two discs. since: s, the start of the step. Returns whether one is jammed."""
    a, b, of_a, of_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    move_to_now(world, i, now)
    move_to_now(world, j, now)
    if world.has_gravity:
        report_support(world, i, since, now, log)
        report_support(world, j, since, now, log)
    nx, ny, distance = unit(b.x - a.x, b.y - a.y)
    closing = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny
    pull = (of_a.ax - of_b.ax) * nx + (of_a.ay - of_b.ay) * ny
    course = _pair_parting(world, i, j, closing, pull, now)

    per_a, per_b = _inverse_mass(world, i), _inverse_mass(world, j)
    impulse = max(0.0, closing + course.speed) / (per_a + per_b)
    a.vx -= impulse * per_a * nx
    a.vy -= impulse * per_a * ny
    b.vx += impulse * per_b * nx
    b.vy += impulse * per_b * ny
    tangential, slip = 0.0, 0.0
    if world.is_rough or log.collects:
        slip = slip_on(world, i, nx, ny) + slip_on(world, j, -nx, -ny)
    if world.is_rough:
        limit = world.turn[i].friction * world.turn[j].friction * impulse
        tangential = friction_impulse(slip, limit, per_a + per_b)
        _apply_friction(world, i, nx, ny, tangential, per_a)
        _apply_friction(world, j, -nx, -ny, tangential, per_b)
    depth = a.radius + b.radius - distance
    of_i, of_j = world.event[i].ball, world.event[j].ball
    log_contact(log, now, of_i, of_j, nx, ny, impulse, depth, tangential, slip)

    of_a.last_disc_contact = of_b.last_disc_contact = now
    if course.hop_time > 0:
        lean_until(world, i, course.hop_time, now)
        lean_until(world, j, course.hop_time, now)
    to_b_x, to_b_y = impulse * nx - tangential * ny, impulse * ny + tangential * nx
    jams = False
    for k, per_k, sign in ((i, per_a, -1), (j, per_b, 1)):
        if per_k == 0:
            give(world, k, sign * to_b_x, sign * to_b_y)
        else:
            _count_contact(world, k, now)
            if world.has_gravity and count_slow_contacts(world, k, closing, now):
                jams = True
    return jams


@kernel
def give(world: World, i: int, x: float, y: float) -> None:
    """Give momentum (kg px/s) to disc i of a static island."""
    momentum = world.absorbed[i]
    momentum.x += x
    momentum.y += y
    momentum.load_x += x
    momentum.load_y += y


@kernel
def bounce(world: World, i: int, p: int, since: float, now: float, log: Log) -> bool:
    """Reflect disc i off a piece of wall. since: s, the start of the step. Returns whether the disc is jammed."""
    disc, body, piece, carrier = world.disc[i], world.body[i], world.piece[p], world.event[i].carrier
    move_to_now(world, i, now)
    report_support(world, i, since, now, log)
    nx, ny, distance = normal_to(disc, piece)
    if p == carrier:
        if world.is_rough and now == world.turn[i].slips_until:
            stop_slipping(world, i, now)
        else:  # it has reached the end of the face that carries it
            release(world, i)
        return False
    closing = disc.vx * nx + disc.vy * ny
    pull = body.ax * nx + body.ay * ny
    if carrier >= 0:
        mx, my, _ = normal_to(disc, world.piece[carrier])
        if nx * mx + ny * my > 0:  # bouncing off this face, it leaves the other too, and falls freely
            pull = max(pull, world.gravity[0] * nx + world.gravity[1] * ny)
    shortest_flight = world.hop_time if now < body.leans_until else CONTACT_TIME
    course = _wall_parting(world, i, p, closing, pull, shortest_flight, now)

    change = max(0.0, closing + course.speed)
    disc.vx -= change * nx
    disc.vy -= change * ny
    impulse = body.mass * change
    if impulse > 0:
        tangential, slip = 0.0, slip_on(world, i, nx, ny)
        if world.is_rough:
            limit = world.turn[i].friction * piece.friction * impulse
            tangential = friction_impulse(slip, limit, 1 / body.mass)
            _apply_friction(world, i, nx, ny, tangential, 1 / body.mass)
        depth = disc.radius + piece.half_thickness - distance
        log_contact(log, now, world.event[i].ball, ~piece.wall, nx, ny, impulse, depth, tangential, slip)

    _count_contact(world, i, now)
    if course.rests:
        carry(world, i, p, carrier, shortest_flight, now, log)
    if course.hop_time > 0:
        lean_until(world, i, course.hop_time, now)
    if course.hop_time > 0 or _leans_on_discs(world, body, now):
        return count_slow_contacts(world, i, closing, now)
    return False


@kernel
def _count_contact(world: World, i: int, now: float) -> None:
    """Count a contact of disc i, and let it fly freely."""
    body = world.body[i]
    body.streak = body.streak + 1 if now - body.last_contact < CONTACT_TIME else 0
    body.last_contact = now
    release(world, i)


@kernel
def count_slow_contacts(world: World, i: int, closing: float, now: float) -> bool:
    """Count a contact of disc i if it is slow, and return whether these are too many. closing: px/s."""
    body = world.body[i]
    if closing >= SLOW_HOPS * world.hop_speed:
        return False
    if now - body.slow_since > world.hop_time:
        body.slow_since, body.slow_contacts = now, 0
    body.slow_contacts += 1
    return body.slow_contacts >= MAX_SLOW_CONTACTS
