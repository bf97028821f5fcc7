"""The event loop of the exact engine, compiled."""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.engines.compiled import Record, entry, kernel, prefetch
from sandbox.engines.exact.event_queue import NOBODY, Agenda, rank, runner_up, schedule
from sandbox.engines.exact.grid import Cells, enter, fetch_discs, leave
from sandbox.engines.exact.impact import NEVER, time_to_close, time_to_face, time_to_leave, time_to_touch
from sandbox.engines.exact.records import HELD, NONE
from sandbox.engines.walls import ARENA
from sandbox.state import Contacts, Floats

CONTACT_TIME: Final = 1e-6  # s, the TC model's t_c: far below the time between contacts, far above the clock's rounding


HOP: Final = 1e-3  # s, how long a disc that leans on others is off them; less is truer and costs more


SLIDE: Final = 1e-4  # s, the hops in which a disc slides round the end of a wall


LEAN: Final = 2 * HOP  # s, how long after such a hop a disc still counts as leaning


ROUNDING: Final = 1e-12  # share of its speed at which a pair parts at least, where it met again at once: e may be 0


SLOW: Final = 10  # hops' speeds, below which a contact counts as rattling


RATTLE: Final = 10  # slow contacts within HOP before a disc is held


JAM: Final = 10_000  # contacts, each within CONTACT_TIME of the last, after which a wall stops a disc: it is wedged


PATIENCE: Final = 10_000_000  # as many where nothing takes energy: then only what goes to and fro is stopped


PAST: Final = 1e-9  # px beyond its end that a face carries a disc: above rounding, or it would catch it once more


BREATH: Final = 1_000_000  # events, about a second's, between two chances for Ctrl C to end a step of ever more


SPECK: Final = 1e-100  # px along x between centres that coincide, so that their normal is (1, 0)


class World(NamedTuple):
    """All that the event loop works on. Discs are stored so that those near each other are near in memory too.

    disc: (n,) DISC; event: (n,) EVENT; body: (n,) BODY; piece: (m,) PIECE; gravity: px/s²; falls: whether there is any;
    hop: px/s, at which discs that lean on each other part.
    """

    disc: NDArray[np.void]
    event: NDArray[np.void]
    body: NDArray[np.void]
    piece: NDArray[np.void]
    cells: Cells
    agenda: Agenda
    gravity: tuple[float, float]
    falls: bool
    hop: float


class Motion(NamedTuple):
    """Where a disc is now and how it flies: px, px/s, px/s²."""

    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float


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
def _bring(world: World, i: int, now: float) -> None:
    """Move disc i to where it is now."""
    disc, m = world.disc[i], _motion(world, i, now)
    disc.x, disc.y, disc.vx, disc.vy, disc.t = m.x, m.y, m.vx, m.vy, now


@kernel
def _offer(world: World, i: int, time: float, partner: int, serial: int) -> None:
    """Make this disc i's next contact, if it is earlier than the one foreseen so far."""
    disc, event, agenda = world.disc[i], world.event[i], world.agenda
    if time < disc.hit or (time == disc.hit and rank(agenda, i, partner) < rank(agenda, i, event.partner)):
        disc.hit, event.partner, event.seen = time, partner, serial


@kernel
def _look_around(world: World, i: int, m: Motion, now: float, corner: int, columns: int, rows: int) -> None:
    """Foresee disc i's contacts with the discs of a block of cells, which begins at its corner."""
    disc, cells, event = world.disc, world.cells, world.event
    for row in range(rows):
        for cell in range(corner + row * cells.stride, corner + row * cells.stride + columns):
            j = np.int64(cells.cell[cell].first)
            while j >= 0:
                o = _motion(world, j, now)
                rx, ry, vx, vy = o.x - m.x, o.y - m.y, o.vx - m.vx, o.vy - m.vy
                if rx == 0 and ry == 0:
                    rx = SPECK if event[i].ball < event[j].ball else -SPECK
                ax, ay, reach = o.ax - m.ax, o.ay - m.ay, disc[i].radius + disc[j].radius
                # What comes after j's own next contact can wait: j looks at all discs anew by then, and sees i.
                limit = min(disc[i].hit, disc[j].hit) - now
                time = now + time_to_touch(rx, ry, vx, vy, ax, ay, reach, limit)
                if time < NEVER and i != j and time <= disc[j].hit:
                    _offer(world, i, time, j, disc[j].serial)
                j = np.int64(disc[j].next)


@kernel
def _time_to_piece(m: Motion, radius: float, piece: Record, carried: bool) -> float:
    """Return when a disc touches a piece of wall or, where that carries it, when it slides off its end."""
    rx, ry = m.x - piece.x, m.y - piece.y
    if piece.length == 0:
        return time_to_touch(rx, ry, m.vx, m.vy, m.ax, m.ay, radius + piece.thick, NEVER)
    tx, ty = piece.tx, piece.ty
    off, v_off, a_off = ry * tx - rx * ty, m.vy * tx - m.vx * ty, m.ay * tx - m.ax * ty
    if piece.wall < ARENA:
        return NEVER if carried else time_to_close(off - radius, v_off, a_off)
    along, v_along, a_along = rx * tx + ry * ty, m.vx * tx + m.vy * ty, m.ax * tx + m.ay * ty
    if carried:
        return time_to_leave(along, v_along, a_along, -PAST, piece.length + PAST)[0]
    return time_to_face(along, v_along, a_along, off, v_off, a_off, piece.length, radius + piece.thick)


@kernel
def _look_at_walls(world: World, i: int, m: Motion, now: float) -> None:
    """Foresee disc i's contacts with the pieces of wall of its cell."""
    event, cells, piece = world.event[i], world.cells, world.piece
    if event.wall == HELD:
        return
    for k in range(cells.cell[event.cell].begin, cells.cell[event.cell + 1].begin):
        p = cells.piece[k]
        # A disc that a face carries cannot touch that wall's ends before it has left the face.
        if event.wall not in (NONE, p) and piece[p].wall == piece[event.wall].wall:
            continue
        time = now + _time_to_piece(m, world.disc[i].radius, piece[p], p == event.wall)
        if time < NEVER:
            _offer(world, i, time, ~p, 0)


@kernel
def _look_at_edges(world: World, i: int, m: Motion, now: float) -> None:
    """Foresee when disc i leaves its cell, and which way; of one that is held, when it is let go."""
    cells, event = world.cells, world.event[i]
    if event.wall == HELD:
        event.cross, event.way = world.body[i].until, 0
        return
    row, column = divmod(np.int64(event.cell), cells.stride)
    dt_x, way_x = time_to_leave(m.x, m.vx, m.ax, (column - 1) * cells.width, column * cells.width)
    dt_y, way_y = time_to_leave(m.y, m.vy, m.ay, (row - 1) * cells.height, row * cells.height)
    if dt_x < dt_y:
        event.cross, event.way = now + dt_x, way_x
    else:
        event.cross, event.way = now + dt_y, way_y * cells.stride


@kernel
def _foresee(world: World, i: int, now: float) -> None:
    """Look at all that can happen next to disc i."""
    m = _motion(world, i, now)
    world.disc[i].hit, world.event[i].partner = NEVER, NOBODY
    _look_at_walls(world, i, m, now)
    _look_around(world, i, m, now, world.event[i].cell - world.cells.stride - 1, 3, 3)
    _look_at_edges(world, i, m, now)
    schedule(world.agenda, i)


@kernel
def _cross(world: World, i: int, now: float) -> None:
    """Take disc i into the next cell, and look at what is new there: the cell's walls, and the three cells ahead."""
    event, stride = world.event[i], world.cells.stride
    way = np.int64(event.way)
    if way == 0:
        _bring(world, i, now)
        _set_free(world, i)
        _foresee(world, i, now)
        return
    leave(world.cells, world.disc, i, event.cell)
    event.cell += way
    enter(world.cells, world.disc, i, event.cell)
    m = _motion(world, i, now)
    _look_at_walls(world, i, m, now)
    if abs(way) == 1:
        _look_around(world, i, m, now, event.cell + way - stride, 1, 3)
    else:
        _look_around(world, i, m, now, event.cell + way - 1, 3, 1)
    _look_at_edges(world, i, m, now)
    schedule(world.agenda, i)


@kernel
def _recent(body: Record, now: float) -> bool:
    return now - body.last < CONTACT_TIME


@kernel
def _rattles(world: World, i: int, closing: float, now: float) -> bool:
    """Count disc i's slow contacts, which only gravity brings about; tell whether they are too many."""
    body = world.body[i]
    if closing >= SLOW * world.hop:
        return False
    if now - body.since > HOP:
        body.since, body.slow = now, 0
    body.slow += 1
    return body.slow > RATTLE


@kernel
def _hold(world: World, i: int, now: float) -> None:
    """Keep disc i where it is for a HOP."""
    disc, body = world.disc[i], world.body[i]
    disc.vx = disc.vy = body.ax = body.ay = 0.0
    world.event[i].wall, body.until = HELD, now + HOP


@kernel
def _set_free(world: World, i: int) -> None:
    """Let disc i fly on a course of its own, whatever carried it, and whatever was foreseen with it."""
    world.event[i].wall = NONE
    world.body[i].ax, world.body[i].ay = world.gravity
    world.disc[i].serial += 1


@kernel
def _touched(world: World, i: int, now: float) -> None:
    """Note that disc i has a contact now."""
    body = world.body[i]
    body.streak = body.streak + 1 if _recent(body, now) else 0
    body.last = now
    _set_free(world, i)


@kernel
def _collide(world: World, i: int, j: int, now: float) -> tuple[float, float, float, float]:
    """Exchange momentum between two discs. Returns the normal from i to j, the impulse (kg px/s), the depth (px)."""
    a, b, of_a, of_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    _bring(world, i, now)
    _bring(world, j, now)
    rx, ry = b.x - a.x, b.y - a.y
    if rx == 0 and ry == 0:
        rx = SPECK
    distance = math.sqrt(rx * rx + ry * ry)
    nx, ny = rx / distance, ry / distance
    closing = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny
    pull = (of_a.ax - of_b.ax) * nx + (of_a.ay - of_b.ay) * ny
    slow = closing < SLOW * world.hop
    a_held, b_held = slow and world.event[i].wall == HELD, slow and world.event[j].wall == HELD
    if _recent(of_a, now) and _recent(of_b, now):
        parting = max(closing, ROUNDING * (abs(a.vx) + abs(a.vy) + abs(b.vx) + abs(b.vy)))
    else:
        parting = of_a.elasticity * of_b.elasticity * closing
    if parting < world.hop and (pull > 0 or now < of_a.leans or now < of_b.leans):
        parting = world.hop
        of_a.leans = of_b.leans = now + LEAN
    of_a.met = of_b.met = now
    per_a = 0.0 if a_held else 1 / of_a.mass
    per_b = 0.0 if b_held else 1 / of_b.mass
    impulse = (closing + parting) / (per_a + per_b)
    a.vx -= impulse * per_a * nx
    a.vy -= impulse * per_a * ny
    b.vx += impulse * per_b * nx
    b.vy += impulse * per_b * ny
    for k, held in ((i, a_held), (j, b_held)):
        if not held:
            _touched(world, k, now)
            if _rattles(world, k, closing, now):
                _hold(world, k, now)
    return nx, ny, impulse, a.radius + b.radius - distance


@kernel
def _normal(disc: Record, piece: Record) -> tuple[float, float, float]:
    """Return the unit normal from a disc to a piece of wall, and how far its centre line, or point, is (px)."""
    rx, ry = piece.x - disc.x, piece.y - disc.y
    if piece.length > 0:
        off = ry * piece.tx - rx * piece.ty
        side = 1.0 if off > 0 and piece.wall >= ARENA else -1.0
        return -side * piece.ty, side * piece.tx, side * off
    if rx == 0 and ry == 0:
        rx = SPECK
    distance = math.sqrt(rx * rx + ry * ry)
    return rx / distance, ry / distance, distance


@kernel
def _bounce(world: World, i: int, p: int, now: float) -> tuple[float, float, float, float]:
    """Turn disc i round at a piece of wall. Returns the normal to it, the impulse (kg px/s), the depth (px)."""
    disc, body, piece, carrier = world.disc[i], world.body[i], world.piece[p], np.int64(world.event[i].wall)
    _bring(world, i, now)
    nx, ny, distance = _normal(disc, piece)
    if p == carrier:  # the face ends here
        _set_free(world, i)
        return nx, ny, 0.0, 0.0
    closing = disc.vx * nx + disc.vy * ny
    pull = body.ax * nx + body.ay * ny
    if _recent(body, now) and body.streak > 0:  # one before may have been a corner's other wall
        parting = max(closing, ROUNDING * (abs(disc.vx) + abs(disc.vy)))
    else:
        parting = body.elasticity * piece.elasticity * closing
    leans, face = now < body.leans, piece.length > 0
    shortest = HOP if leans else CONTACT_TIME
    rests = face and parting <= pull * shortest / 2
    if rests:
        parting = 0.0
    elif leans or (pull > 0 and not face):
        hop = world.hop if now - body.met < LEAN else pull * SLIDE / 2
        if parting < hop:
            parting = hop
            body.leans = now + LEAN
    disc.vx -= (closing + parting) * nx
    disc.vy -= (closing + parting) * ny
    _touched(world, i, now)
    if rests:
        _carry(world, i, p, carrier, shortest, nx, ny)
    if now - body.met < LEAN and _rattles(world, i, closing, now):
        _hold(world, i, now)
    lossless = not world.falls and body.elasticity * piece.elasticity == 1
    if lossless and body.streak > PATIENCE:
        disc.vx += parting * nx
        disc.vy += parting * ny
    elif not lossless and body.streak > JAM:
        disc.vx = disc.vy = body.ax = body.ay = 0.0
    return nx, ny, body.mass * (closing + parting), disc.radius + piece.thick - distance


@kernel
def _carry(world: World, i: int, p: int, before: int, shortest: float, nx: float, ny: float) -> None:
    """Let face p carry disc i; and hold it, if it would be off the face that carried it before for no longer either."""
    disc, body = world.disc[i], world.body[i]
    pull = body.ax * nx + body.ay * ny
    body.ax -= pull * nx
    body.ay -= pull * ny
    world.event[i].wall = p
    if before != NONE:
        mx, my, _ = _normal(disc, world.piece[before])
        pull = body.ax * mx + body.ay * my
        if pull > 0 and abs(disc.vx * mx + disc.vy * my) <= pull * shortest / 2:
            disc.vx = disc.vy = body.ax = body.ay = 0.0


@kernel
def _fetch_early(world: World, i: int) -> None:
    """Ask for what is read first when disc i's event comes up."""
    prefetch(world.disc, i)
    prefetch(world.event, i)


@kernel
def _fetch(world: World, i: int) -> None:
    """Ask for what is read of disc i and of those round it when it has a contact."""
    prefetch(world.body, i)
    fetch_discs(world.cells, world.disc, world.event[i].cell)


@kernel
def _note(row: Record, time: float, first: int, second: int, contact: tuple[float, float, float, float]) -> None:
    row.time, row.first, row.second = time, first, second
    row.normal[0], row.normal[1], row.impulse, row.depth = contact


@entry
def advance(world: World, until: float, log: Contacts, collect: bool) -> tuple[int, int]:
    """Play events in place up to a time (s), or until the log is full, or for a BREATH.

    log: (capacity,) CONTACT, which gets a row per contact if `collect`. Returns how many rows of it are filled, and how
    many contacts there were between discs.
    """
    disc, event, root = world.disc, world.event, world.agenda.node[0]
    count = collisions = events = 0
    while root.time <= until and count < len(log) and events < BREATH:
        now, i = root.time, root.disc
        events += 1
        _fetch_early(world, runner_up(world.agenda))
        partner = np.int64(event[i].partner)
        if event[i].cross < disc[i].hit:
            _cross(world, i, now)
        elif partner < 0:
            contact = _bounce(world, i, ~partner, now)
            _foresee(world, i, now)
            if collect and contact[2] > 0:
                _note(log[count], now, event[i].ball, ~world.piece[~partner].wall, contact)
                count += 1
        elif disc[partner].serial != event[i].seen:
            _foresee(world, i, now)
        else:
            _fetch(world, i)
            _fetch(world, partner)
            i, j = (i, partner) if event[i].ball < event[partner].ball else (partner, i)
            contact = _collide(world, i, j, now)
            _foresee(world, i, now)
            _foresee(world, j, now)
            collisions += 1
            if collect:
                _note(log[count], now, event[i].ball, event[j].ball, contact)
                count += 1
    return count, collisions


@entry
def look(world: World, now: float, position: Floats, velocity: Floats) -> None:
    """Write where each ball is now, and how it flies, in scene order: (n, 2) px, px/s."""
    for i in range(len(world.disc)):
        m, ball = _motion(world, i, now), world.event[i].ball
        position[ball, 0], position[ball, 1] = m.x, m.y
        velocity[ball, 0], velocity[ball, 1] = m.vx, m.vy


@entry
def begin(world: World) -> None:
    """Enter every disc in its cell, and foresee its first event."""
    for i in range(len(world.disc)):
        enter(world.cells, world.disc, i, world.event[i].cell)
    for i in range(len(world.disc)):
        _foresee(world, i, world.disc[i].t)


@entry
def kick(world: World, i: int, now: float, dvx: float, dvy: float) -> None:
    """Add to the velocity of disc i (px/s), and foresee its events anew."""
    _bring(world, i, now)
    world.disc[i].vx += dvx
    world.disc[i].vy += dvy
    _set_free(world, i)
    _foresee(world, i, now)
