"""Event-driven hard discs: from impact to impact, with no time step and no error but rounding.

Between impacts a disc flies on a parabola, so the next impact is known in closed form (`impact`). Each disc has one
event: its earliest contact as foreseen when it was last looked at, or the crossing of its cell's edge (`cells`), if
that comes first; the earliest of all is next (`agenda`). Only the discs that an event concerns are moved (delayed
states: B. D. Lubachevsky, J. Comput. Phys. 94 (1991) 255), and a contact foreseen with a disc that has since been
turned by another is noticed when it comes up, by the partner's serial number, and foreseen anew. Why no contact is
missed: of any two discs, the one that was looked at last saw the other as it still flies.

Discs are smooth: no friction. A contact exchanges momentum along the line of centres as it is, whatever rounding did
to the distance. Elasticity is the product of the two factors, with two exceptions that keep a collapse, endless
bounces in finite time, from stopping the clock:

- TC model (S. Luding and S. McNamara, Granular Matter 1 (1998) 113): a contact within CONTACT_TIME of the last contact
  of each of its two is elastic; with a wall, within that of the last two, as a corner has two walls.
- Rest under gravity. A bounce off a face that gravity would end within CONTACT_TIME is not flown: the wall carries the
  disc from then on. It lies still, slides where the wall slopes, or is held where two walls meet, without any events,
  until another disc or a kick moves it or the face ends; of each such step one contact is told. Round an end it slides
  in hops of SLIDE. Discs that lean on each other do it in hops of HOP or so: at 900 px/s² they are 1.1e-4 px high, and
  cost some 1/HOP contacts a second for each pair that touches.
- Rattling. A disc that is shut in by others which press on it has ever more, ever slower contacts. More than RATTLE of
  them within HOP hold it where it is, as if it had no end of mass, for a HOP, or until something hits it faster. So a
  heap costs some RATTLE/HOP contacts a second and disc, however tightly it is packed.

The clock is one double: after t seconds a contact is late or early by up to 1e-16 t, and 1e-16 t v px deep.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.engines import Refused
from sandbox.engines.agenda import NOBODY, Agenda, empty_agenda, rank, runner_up, schedule
from sandbox.engines.cells import Cells, along_a_curve, cell_at, empty_cells, enter, fetch_discs, leave
from sandbox.engines.discs import BODY, DISC, EVENT, HELD, NONE, aligned
from sandbox.engines.impact import NEVER, time_to_close, time_to_face, time_to_leave, time_to_touch
from sandbox.engines.kernel import Record, entry, kernel, prefetch
from sandbox.engines.walls import ARENA, pieces_of
from sandbox.mistakes import Mistake
from sandbox.scene import Scene, Vector
from sandbox.state import CONTACT, Contacts, Floats, State, no_contacts

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
MOST_KEPT: Final = 5_000_000  # contacts that nobody has asked for yet: half a GB, and five times that in a comparison
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


# What comes next


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


# Contacts


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


# The loop


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


class ExactEngine:
    """Hard discs, event by event. `collisions` is how many contacts between balls there have been."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self.check(scene)
        self._rate = scene.rate
        self._steps = 0
        self._world = _world(scene, initial)
        self._disc_of_ball = np.argsort(self._world.event["ball"])
        self._log = np.empty(64, CONTACT)
        self._found: list[Contacts] | None = None
        self._kept = 0  # contacts in it
        self.collisions = 0
        begin(self._world)

    @staticmethod
    def check(scene: Scene) -> None:
        """Refuse friction."""
        if _has_friction(scene):
            raise Refused("exact: friction is not part of smooth hard discs; use --engines pymunk")

    def step(self) -> None:
        """Play the events of one step. Nothing is computed at its end, so the rate changes no event.

        Raises Mistake where its contacts are collected, and are more than there is room for.
        """
        self._steps += 1
        while self._world.agenda.node[0]["time"] <= self._now:
            count, collisions = advance(self._world, self._now, self._log, self._found is not None)
            self.collisions += collisions
            if self._found is not None:
                self._keep(self._log[:count].copy())
            if count == len(self._log):
                self._log = np.empty(2 * count, CONTACT)
        if self._found is not None and self._world.falls:
            self._keep(self._carried())

    def _keep(self, contacts: Contacts) -> None:
        assert self._found is not None
        self._found.append(contacts)
        self._kept += len(contacts)
        if self._kept > MOST_KEPT:
            raise Mistake(
                f"exact: more than {MOST_KEPT:,} contacts by {self._now:.4g} s are more than are kept; a shorter run "
                "has fewer, and so have balls that are slower or of masses less far apart"
            )

    def _carried(self) -> Contacts:
        """Return a contact for each wall that carries a ball, with what it has pressed in a step, or since it does."""
        event, body = self._world.event, self._world.body
        taken = self._world.gravity - np.column_stack([body["ax"], body["ay"]])
        pull = np.hypot(*taken.T)
        lying = np.flatnonzero((event["wall"] >= 0) & (pull > 0))
        contacts = np.zeros(len(lying), CONTACT)
        contacts["time"] = self._now
        contacts["first"] = event["ball"][lying]
        contacts["second"] = ~self._world.piece["wall"][event["wall"][lying]]
        contacts["normal"] = taken[lying] / pull[lying, None]
        pressed = np.minimum(1 / self._rate, self._now - body["last"][lying])
        contacts["impulse"] = body["mass"][lying] * pull[lying] * pressed
        return contacts

    @property
    def _now(self) -> float:
        return self._steps / self._rate

    def state(self) -> State:
        """Return a snapshot: every ball flown on to now."""
        position = np.empty((len(self._disc_of_ball), 2))
        velocity = np.empty_like(position)
        look(self._world, self._now, position, velocity)
        return State(self._now, position, velocity)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        found, self._found, self._kept = self._found, [], 0
        return np.concatenate(found) if found else no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        kick(self._world, self._disc_of_ball[ball], self._now, float(dv[0]), float(dv[1]))


def _world(scene: Scene, initial: State) -> World:
    bodies, n = scene.bodies, len(scene.bodies)
    piece = pieces_of(scene)
    cells = empty_cells(n, 2 * float(bodies.radius.max()), scene.arena.size, piece)
    cell = cell_at(cells, initial.position)
    ball = np.argsort(along_a_curve(cells, cell), kind="stable")
    disc, event, body = aligned(n, DISC), aligned(n, EVENT), aligned(n, BODY)
    disc["x"], disc["y"] = initial.position[ball].T
    disc["vx"], disc["vy"] = initial.velocity[ball].T
    disc["radius"], disc["next"] = bodies.radius[ball], NONE
    event["cell"], event["ball"], event["wall"] = cell[ball], ball, NONE
    body["ax"], body["ay"] = scene.gravity
    body["mass"], body["elasticity"], body["last"] = bodies.mass[ball], bodies.elasticity[ball], -np.inf
    body["met"] = -np.inf
    gravity = (float(scene.gravity[0]), float(scene.gravity[1]))
    agenda, hop = empty_agenda(disc, event), math.hypot(*gravity) * HOP / 2
    return World(disc, event, body, piece, cells, agenda, gravity, gravity != (0, 0), hop)


def _has_friction(scene: Scene) -> bool:
    """Tell whether any two that can touch have friction, which is the product of their factors."""
    rough = np.count_nonzero(scene.bodies.friction)
    walls = (scene.arena.friction, *(wall.friction for wall in scene.walls))
    return bool(rough > 1 or (rough == 1 and max(walls) > 0))
