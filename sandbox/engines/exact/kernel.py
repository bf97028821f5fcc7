"""The event loop of the exact engine, and its law of contact.

`advance` takes the earliest event and predicts the next one of each disc concerned, until the time is up. Below it
stand three layers: prediction, contacts, and the loop itself.

Discs are smooth: no friction. A contact exchanges momentum along the line of centres as it is, whatever rounding did
to the distance. Its elasticity is the product of the two factors, with three exceptions that keep an inelastic
collapse, infinitely many contacts in finite time, from stopping the clock:

- TC model (S. Luding and S. McNamara, Granular Matter 1 (1998) 113): a contact within CONTACT_TIME of the last contact
  of both discs is elastic; with a wall, one within CONTACT_TIME of the last two contacts, as a corner has two walls.
- Rest under gravity. A bounce off a face that would last less than CONTACT_TIME is not flown: the wall carries the disc
  from then on. Without any events it lies still, slides down a slope, or is held where two walls meet, until another
  disc or a kick moves it or the face ends; each step reports one contact. Round the end of a wall it slides in hops of
  END_HOP_TIME. Discs that lean on each other move apart in hops of about HOP_TIME: at 900 px/s² these are 1.1e-4 px
  high, and cost about 1/HOP_TIME contacts a second for each pair that touches.
- Rattling. A disc enclosed by others that press on it has ever more, ever slower contacts. After MAX_SLOW_CONTACTS of
  them within HOP_TIME it is held where it is, as if its mass were infinite, for HOP_TIME or until something hits it
  faster. So a heap costs about MAX_SLOW_CONTACTS/HOP_TIME contacts a second per disc, however tightly it is packed.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.engines.compiled import Record, entry, kernel, prefetch
from sandbox.engines.exact.event_queue import NO_PARTNER, EventQueue, rank, runner_up, schedule
from sandbox.engines.exact.grid import Grid, enter, leave, prefetch_around
from sandbox.engines.exact.impact import NEVER, time_to_close, time_to_face, time_to_leave, time_to_touch
from sandbox.engines.exact.records import HELD, NONE
from sandbox.engines.walls import ARENA_COUNT
from sandbox.state import Contacts, Floats

CONTACT_TIME: Final = 1e-6  # s, the TC model's t_c: far below the time between contacts, far above the clock's rounding
HOP_TIME: Final = 1e-3  # s, for which discs that lean on each other are apart; less is truer and costs more
END_HOP_TIME: Final = 1e-4  # s, the hops in which a disc slides round the end of a wall
LEAN_TIME: Final = 2 * HOP_TIME  # s, for which a disc counts as leaning after a hop
RATTLE_SPEED: Final = 10  # in units of the hop speed; a slower contact counts as rattling
MAX_SLOW_CONTACTS: Final = 10  # within HOP_TIME, before a disc is held
MIN_PARTING: Final = 1e-12  # of the discs' speeds, where they met again at once: e may be 0
MAX_STREAK: Final = 10_000  # contacts, each within CONTACT_TIME of the last, before a wall stops a disc: it is wedged
MAX_LOSSLESS_STREAK: Final = 10_000_000  # the same if no contact takes energy; then only its normal motion is stopped
FACE_MARGIN: Final = 1e-9  # px beyond its end that a face carries a disc: above rounding, or it would carry it again
MAX_EVENTS_PER_CALL: Final = 1_000_000  # of `advance`: about a second's, so that Ctrl-C can end an endless step
COINCIDENT: Final = 1e-100  # px along x between centres that coincide, so that their normal is (1, 0)


class World(NamedTuple):
    """The data of the event loop. Discs are stored so that those near each other are near in memory too.

    disc: (n,) DISC; event: (n,) EVENT; body: (n,) BODY; piece: (m,) PIECE; gravity: px/s²; falls: whether it is not 0;
    hop_speed: px/s, at which discs that lean on each other part.
    """

    disc: NDArray[np.void]
    event: NDArray[np.void]
    body: NDArray[np.void]
    piece: NDArray[np.void]
    grid: Grid
    queue: EventQueue
    gravity: tuple[float, float]
    falls: bool
    hop_speed: float


class Motion(NamedTuple):
    """Position, velocity and acceleration of a disc: px, px/s, px/s²."""

    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float


# Prediction


@kernel
def _motion(world: World, i: int, now: float) -> Motion:
    disc = world.disc[i]
    dt = now - disc.t
    if not world.falls:
        return Motion(disc.x + dt * disc.vx, disc.y + dt * disc.vy, disc.vx, disc.vy, 0.0, 0.0)
    ax, ay = world.body[i].ax, world.body[i].ay
    x, y = disc.x + dt * (disc.vx + 0.5 * dt * ax), disc.y + dt * (disc.vy + 0.5 * dt * ay)
    return Motion(x, y, disc.vx + dt * ax, disc.vy + dt * ay, ax, ay)


@kernel
def _move_to_now(world: World, i: int, now: float) -> None:
    """Move disc i to its position now."""
    disc, m = world.disc[i], _motion(world, i, now)
    disc.x, disc.y, disc.vx, disc.vy, disc.t = m.x, m.y, m.vx, m.vy, now


@kernel
def _propose_contact(world: World, i: int, time: float, partner: int, serial: int) -> None:
    """Make a contact disc i's next one if it precedes the earliest predicted so far."""
    disc, event, queue = world.disc[i], world.event[i], world.queue
    if time < disc.hit or (time == disc.hit and rank(queue, i, partner) < rank(queue, i, event.partner)):
        disc.hit, event.partner, event.seen = time, partner, serial


@kernel
def _predict_discs(world: World, i: int, m: Motion, now: float, corner: int, columns: int, rows: int) -> None:
    """Predict disc i's contacts with the discs of a block of cells, given its first cell and its size."""
    disc, grid, event = world.disc, world.grid, world.event
    for row in range(rows):
        for cell in range(corner + row * grid.stride, corner + row * grid.stride + columns):
            j = np.int64(grid.cell[cell].first)
            while j >= 0:
                o = _motion(world, j, now)
                rx, ry, vx, vy = o.x - m.x, o.y - m.y, o.vx - m.vx, o.vy - m.vy
                if rx == 0 and ry == 0:
                    rx = COINCIDENT if event[i].ball < event[j].ball else -COINCIDENT
                ax, ay, reach = o.ax - m.ax, o.ay - m.ay, disc[i].radius + disc[j].radius
                # After j's own next contact, j is predicted anew against all discs, i among them.
                limit = min(disc[i].hit, disc[j].hit) - now
                time = now + time_to_touch(rx, ry, vx, vy, ax, ay, reach, limit)
                if time < NEVER and i != j and time <= disc[j].hit:
                    _propose_contact(world, i, time, j, disc[j].serial)
                j = np.int64(disc[j].next)


@kernel
def _time_to_piece(m: Motion, radius: float, piece: Record, carried: bool) -> float:
    """Return when a disc touches a piece of wall or, if that carries it, when it slides off its end."""
    rx, ry = m.x - piece.x, m.y - piece.y
    if piece.length == 0:
        return time_to_touch(rx, ry, m.vx, m.vy, m.ax, m.ay, radius + piece.thick, NEVER)
    tx, ty = piece.tx, piece.ty
    off, v_off, a_off = ry * tx - rx * ty, m.vy * tx - m.vx * ty, m.ay * tx - m.ax * ty
    if piece.wall < ARENA_COUNT:
        return NEVER if carried else time_to_close(off - radius, v_off, a_off)
    along, v_along, a_along = rx * tx + ry * ty, m.vx * tx + m.vy * ty, m.ax * tx + m.ay * ty
    if carried:
        return time_to_leave(along, v_along, a_along, -FACE_MARGIN, piece.length + FACE_MARGIN)[0]
    return time_to_face(along, v_along, a_along, off, v_off, a_off, piece.length, radius + piece.thick)


@kernel
def _predict_walls(world: World, i: int, m: Motion, now: float) -> None:
    """Predict disc i's contacts with the pieces of wall of its cell."""
    event, grid, piece = world.event[i], world.grid, world.piece
    if event.wall == HELD:
        return
    for k in range(grid.cell[event.cell].begin, grid.cell[event.cell + 1].begin):
        p = grid.piece[k]
        # A disc that a face carries cannot touch the ends of that wall before it leaves the face.
        if event.wall not in (NONE, p) and piece[p].wall == piece[event.wall].wall:
            continue
        time = now + _time_to_piece(m, world.disc[i].radius, piece[p], p == event.wall)
        if time < NEVER:
            _propose_contact(world, i, time, ~p, 0)


@kernel
def _predict_crossing(world: World, i: int, m: Motion, now: float) -> None:
    """Predict when and where disc i leaves its cell or, if it is held, when it is released."""
    grid, event = world.grid, world.event[i]
    if event.wall == HELD:
        event.cross, event.way = world.body[i].until, 0
        return
    row, column = divmod(np.int64(event.cell), grid.stride)
    dt_x, way_x = time_to_leave(m.x, m.vx, m.ax, (column - 1) * grid.width, column * grid.width)
    dt_y, way_y = time_to_leave(m.y, m.vy, m.ay, (row - 1) * grid.height, row * grid.height)
    if dt_x < dt_y:
        event.cross, event.way = now + dt_x, way_x
    else:
        event.cross, event.way = now + dt_y, way_y * grid.stride


@kernel
def _predict(world: World, i: int, now: float) -> None:
    """Predict disc i's next event, from all that it can meet."""
    m = _motion(world, i, now)
    world.disc[i].hit, world.event[i].partner = NEVER, NO_PARTNER
    _predict_walls(world, i, m, now)
    _predict_discs(world, i, m, now, world.event[i].cell - world.grid.stride - 1, 3, 3)
    _predict_crossing(world, i, m, now)
    schedule(world.queue, i)


@kernel
def _cross(world: World, i: int, now: float) -> None:
    """Move disc i to the next cell, and predict what is new: the cell's walls, and the three cells ahead."""
    event, stride = world.event[i], world.grid.stride
    way = np.int64(event.way)
    if way == 0:
        _move_to_now(world, i, now)
        _release(world, i)
        _predict(world, i, now)
        return
    leave(world.grid, world.disc, i, event.cell)
    event.cell += way
    enter(world.grid, world.disc, i, event.cell)
    m = _motion(world, i, now)
    _predict_walls(world, i, m, now)
    if abs(way) == 1:
        _predict_discs(world, i, m, now, event.cell + way - stride, 1, 3)
    else:
        _predict_discs(world, i, m, now, event.cell + way - 1, 3, 1)
    _predict_crossing(world, i, m, now)
    schedule(world.queue, i)


# Contacts


class Parting(NamedTuple):
    """How two bodies part: their relative speed along the normal, px/s; whether in a hop, as they lean; or at rest."""

    speed: float
    hops: bool
    rests: bool


@kernel
def _recent(body: Record, now: float) -> bool:
    return now - body.last < CONTACT_TIME


@kernel
def _pair_parting(world: World, i: int, j: int, closing: float, pull: float, now: float) -> Parting:
    """Return how discs i and j part. closing: px/s; pull: px/s², which presses them together if positive."""
    a, b, of_a, of_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    if _recent(of_a, now) and _recent(of_b, now):
        speed = max(closing, MIN_PARTING * (abs(a.vx) + abs(a.vy) + abs(b.vx) + abs(b.vy)))
    else:
        speed = of_a.elasticity * of_b.elasticity * closing
    if speed < world.hop_speed and (pull > 0 or now < of_a.leans or now < of_b.leans):
        return Parting(world.hop_speed, True, False)
    return Parting(speed, False, False)


@kernel
def _shortest_flight(body: Record, now: float) -> float:
    """Return how long a bounce off a face must last, s, for the disc not to rest instead."""
    return HOP_TIME if now < body.leans else CONTACT_TIME


@kernel
def _wall_parting(world: World, i: int, p: int, closing: float, pull: float, now: float) -> Parting:
    """Return how disc i parts from a piece of wall. closing: px/s; pull: px/s², towards the wall if positive."""
    disc, body, piece = world.disc[i], world.body[i], world.piece[p]
    if _recent(body, now) and body.streak > 0:  # one contact before may have been with a corner's other wall
        speed = max(closing, MIN_PARTING * (abs(disc.vx) + abs(disc.vy)))
    else:
        speed = body.elasticity * piece.elasticity * closing
    leans, is_face = now < body.leans, piece.length > 0
    if is_face and speed <= pull * _shortest_flight(body, now) / 2:
        return Parting(0.0, False, True)
    if leans or (pull > 0 and not is_face):
        hop = world.hop_speed if now - body.met < LEAN_TIME else pull * END_HOP_TIME / 2
        if speed < hop:
            return Parting(hop, True, False)
    return Parting(speed, False, False)


@kernel
def _inverse_mass(world: World, i: int, closing: float) -> float:
    """Return 1/mass of disc i, 1/kg: 0 if it is held, and stays so in a contact as slow as this (px/s)."""
    holds = closing < RATTLE_SPEED * world.hop_speed and world.event[i].wall == HELD
    return 0.0 if holds else 1 / world.body[i].mass


@kernel
def _collide(world: World, i: int, j: int, now: float) -> tuple[float, float, float, float]:
    """Exchange momentum between two discs. Returns the normal from i to j, the impulse (kg px/s), the depth (px)."""
    a, b, of_a, of_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    _move_to_now(world, i, now)
    _move_to_now(world, j, now)
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

    of_a.met = of_b.met = now
    if parting.hops:
        of_a.leans = of_b.leans = now + LEAN_TIME
    for k, per_k in ((i, per_a), (j, per_b)):
        if per_k > 0:
            _record_contact(world, k, now)
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
    """Return the unit normal from a disc to a piece of wall, and the distance of its centre line, or point (px)."""
    rx, ry = piece.x - disc.x, piece.y - disc.y
    if piece.length == 0:
        return _unit(rx, ry)
    off = ry * piece.tx - rx * piece.ty
    side = 1.0 if off > 0 and piece.wall >= ARENA_COUNT else -1.0
    return -side * piece.ty, side * piece.tx, side * off


@kernel
def _bounce(world: World, i: int, p: int, now: float) -> tuple[float, float, float, float]:
    """Reflect disc i off a piece of wall. Returns the normal to it, the impulse (kg px/s), the depth (px)."""
    disc, body, piece, carrier = world.disc[i], world.body[i], world.piece[p], np.int64(world.event[i].wall)
    _move_to_now(world, i, now)
    nx, ny, distance = _normal(disc, piece)
    if p == carrier:  # the face ends here
        _release(world, i)
        return nx, ny, 0.0, 0.0
    closing = disc.vx * nx + disc.vy * ny
    pull = body.ax * nx + body.ay * ny
    parting = _wall_parting(world, i, p, closing, pull, now)

    disc.vx -= (closing + parting.speed) * nx
    disc.vy -= (closing + parting.speed) * ny

    _record_contact(world, i, now)
    if parting.rests:
        _carry(world, i, p, carrier, now, nx, ny)
    if parting.hops:
        body.leans = now + LEAN_TIME
    if now - body.met < LEAN_TIME:
        _hold_if_it_rattles(world, i, closing, now)
    _stop_if_wedged(world, i, p, parting.speed, nx, ny)
    return nx, ny, body.mass * (closing + parting.speed), disc.radius + piece.thick - distance


@kernel
def _record_contact(world: World, i: int, now: float) -> None:
    """Count a contact of disc i, and let it fly freely."""
    body = world.body[i]
    body.streak = body.streak + 1 if _recent(body, now) else 0
    body.last = now
    _release(world, i)


@kernel
def _release(world: World, i: int) -> None:
    """Let disc i fly freely, whatever carried or held it. What was predicted with it is no longer valid."""
    world.event[i].wall = NONE
    world.body[i].ax, world.body[i].ay = world.gravity
    world.disc[i].serial += 1


@kernel
def _stop(disc: Record, body: Record) -> None:
    disc.vx = disc.vy = body.ax = body.ay = 0.0


@kernel
def _hold_if_it_rattles(world: World, i: int, closing: float, now: float) -> None:
    """Count disc i's slow contacts, which only gravity causes, and hold it for HOP_TIME if they are too many."""
    body = world.body[i]
    if closing >= RATTLE_SPEED * world.hop_speed:
        return
    if now - body.since > HOP_TIME:
        body.since, body.slow = now, 0
    body.slow += 1
    if body.slow > MAX_SLOW_CONTACTS:
        _stop(world.disc[i], body)
        world.event[i].wall, body.until = HELD, now + HOP_TIME


@kernel
def _stop_if_wedged(world: World, i: int, p: int, parting: float, nx: float, ny: float) -> None:
    """Stop disc i if its contacts follow one another without end; if none takes energy, stop it along the normal."""
    disc, body = world.disc[i], world.body[i]
    lossless = not world.falls and body.elasticity * world.piece[p].elasticity == 1
    if lossless and body.streak > MAX_LOSSLESS_STREAK:
        disc.vx += parting * nx
        disc.vy += parting * ny
    elif not lossless and body.streak > MAX_STREAK:
        _stop(disc, body)


@kernel
def _carry(world: World, i: int, p: int, before: int, now: float, nx: float, ny: float) -> None:
    """Let face p carry disc i; stop it if it would soon be back on the face that carried it before, too."""
    disc, body = world.disc[i], world.body[i]
    pull = body.ax * nx + body.ay * ny
    body.ax -= pull * nx
    body.ay -= pull * ny
    world.event[i].wall = p
    if before != NONE:
        mx, my, _ = _normal(disc, world.piece[before])
        pull = body.ax * mx + body.ay * my
        if pull > 0 and abs(disc.vx * mx + disc.vy * my) <= pull * _shortest_flight(body, now) / 2:
            _stop(disc, body)


# Event loop


@kernel
def _prefetch_event(world: World, i: int) -> None:
    """Prefetch what is read first when disc i's event comes up."""
    prefetch(world.disc, i)
    prefetch(world.event, i)


@kernel
def _prefetch_contact(world: World, i: int) -> None:
    """Prefetch what a contact reads of disc i and of the discs around it."""
    prefetch(world.body, i)
    prefetch_around(world.grid, world.disc, world.event[i].cell)


@kernel
def _write_row(row: Record, time: float, first: int, second: int, contact: tuple[float, float, float, float]) -> None:
    row.time, row.first, row.second = time, first, second
    row.normal[0], row.normal[1], row.impulse, row.depth = contact


@entry
def advance(world: World, until: float, log: Contacts, collect: bool) -> tuple[int, int]:
    """Process events, in place, up to a time (s), or until the log is full, or for MAX_EVENTS_PER_CALL.

    log: (capacity,) CONTACT, which gets a row per contact if `collect`. Returns the number of rows filled, and the
    number of contacts between discs.
    """
    disc, event, root = world.disc, world.event, world.queue.node[0]
    count = collisions = events = 0
    while root.time <= until and count < len(log) and events < MAX_EVENTS_PER_CALL:
        now, i = root.time, root.disc
        events += 1
        _prefetch_event(world, runner_up(world.queue))
        partner = np.int64(event[i].partner)
        if event[i].cross < disc[i].hit:
            _cross(world, i, now)
        elif partner < 0:
            contact = _bounce(world, i, ~partner, now)
            _predict(world, i, now)
            if collect and contact[2] > 0:
                _write_row(log[count], now, event[i].ball, ~world.piece[~partner].wall, contact)
                count += 1
        elif disc[partner].serial != event[i].seen:
            _predict(world, i, now)
        else:
            _prefetch_contact(world, i)
            _prefetch_contact(world, partner)
            i, j = (i, partner) if event[i].ball < event[partner].ball else (partner, i)
            contact = _collide(world, i, j, now)
            _predict(world, i, now)
            _predict(world, j, now)
            collisions += 1
            if collect:
                _write_row(log[count], now, event[i].ball, event[j].ball, contact)
                count += 1
    return count, collisions


@entry
def snapshot(world: World, now: float, position: Floats, velocity: Floats) -> None:
    """Write the position and velocity of each ball now, in scene order: (n, 2) px, px/s."""
    for i in range(len(world.disc)):
        m, ball = _motion(world, i, now), world.event[i].ball
        position[ball, 0], position[ball, 1] = m.x, m.y
        velocity[ball, 0], velocity[ball, 1] = m.vx, m.vy


@entry
def start(world: World) -> None:
    """Enter every disc in its cell, and predict its first event."""
    for i in range(len(world.disc)):
        enter(world.grid, world.disc, i, world.event[i].cell)
    for i in range(len(world.disc)):
        _predict(world, i, world.disc[i].t)


@entry
def kick(world: World, i: int, now: float, dvx: float, dvy: float) -> None:
    """Add to the velocity of disc i (px/s), and predict its next event."""
    _move_to_now(world, i, now)
    world.disc[i].vx += dvx
    world.disc[i].vy += dvy
    _release(world, i)
    _predict(world, i, now)
