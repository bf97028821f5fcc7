"""Event-driven hard discs: from impact to impact, with no time step and no error but rounding.

Between impacts a disc flies on a parabola, so the next impact is known in closed form (`impact`). Each disc has one
event: its earliest contact as foreseen when it was last looked at, or the crossing of its cell's edge (`cells`), if
that comes first; the earliest of all is next (`earliest`). Only the discs that an event concerns are moved (delayed
states: B. D. Lubachevsky, J. Comput. Phys. 94 (1991) 255), and a contact foreseen with a disc that has since been
turned by another is noticed when it comes up, by the partner's serial number, and foreseen anew. Why no contact is
missed: of any two discs, the one that was looked at last saw the other as it still flies.

Discs are smooth: no friction. A contact exchanges momentum along the line of centres as it is, whatever rounding did
to the distance. Elasticity is the product of the two factors, with two exceptions that keep a collapse, endless
bounces in finite time, from stopping the clock:

- TC model (S. Luding and S. McNamara, Granular Matter 1 (1998) 113): a contact is elastic that comes within CONTACT_TIME
  of the last contact of each of its two.
- A bounce so small that gravity would end it within HOP is not flown. Off a face there is none: the disc rests, carried
  by the wall, sliding where the wall slopes, held where two walls meet, until another disc or a kick moves it or the
  face ends. Off a disc or a round end, which curve away, it is flown as a hop of HOP: at 900 px/s² 1.1e-6 px high.

Each step's cost is bounded so: a resting disc has no events, one that leans on discs 1/HOP a second.

Kernels of several files are compiled into `advance`; see `impact` for what that means to numba's cache.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sandbox.engines import Refused
from sandbox.engines.cells import Cells, cells_of, enter, leave
from sandbox.engines.earliest import Queue, empty_queue, schedule
from sandbox.engines.impact import NEVER, time_to_face, time_to_leave, time_to_touch
from sandbox.engines.walls import PIECE, pieces_of
from sandbox.scene import Scene, Vector
from sandbox.state import CONTACT, Contacts, State, no_contacts

CONTACT_TIME: Final = 1e-6  # s, the TC model's t_c: far below the time between contacts, far above rounding of the clock
HOP: Final = 1e-4  # s; shorter is truer and costs more where discs lie on discs
JAM: Final = 10_000  # contacts, each within CONTACT_TIME of the last, after which a wall stops a disc: it is wedged
SPECK: Final = 1e-100  # px along x between centres that coincide, so that their normal is (1, 0)

NOBODY: Final = 2**31 - 1  # no partner; as a rank, behind every other
FREE: Final = -1  # not carried by any wall

# What predictions read, in one line of the cache: position (px), velocity (px/s) and acceleration (px/s²) at time t (s).
DISC: Final = np.dtype([(name, "f8") for name in ("x", "y", "vx", "vy", "ax", "ay", "t", "radius")])

BODY: Final = np.dtype(
    [
        ("mass", "f8"),  # kg
        ("elasticity", "f8"),
        ("last", "f8"),  # s, time of the last contact
        ("ball", "i8"),  # its number in the scene
        ("streak", "i4"),  # how many contacts in a row came within CONTACT_TIME
        ("wall", "i4"),  # the piece it rests on, or FREE
    ]
)

EVENT: Final = np.dtype(
    [
        ("hit", "f8"),  # s, when the next contact is
        ("cross", "f8"),  # s, when the disc leaves its cell
        ("partner", "i4"),  # of the contact: a disc, or ~piece
        ("seen", "i4"),  # the partner's serial when the contact was foreseen
        ("serial", "i4"),  # how often this disc's flight has changed
        ("across", "i1"),  # whether it leaves along x
        ("way", "i1"),  # -1 or 1
    ],
    align=True,
)


class World(NamedTuple):
    """Everything the event loop works on. Discs are stored in order of their cells, to be near those they meet.

    disc: (n,) DISC; body: (n,) BODY; event: (n,) EVENT; piece: (m,) PIECE; gravity: (2,) px/s².
    """

    disc: NDArray[np.void]
    body: NDArray[np.void]
    event: NDArray[np.void]
    piece: NDArray[np.void]
    cells: Cells
    queue: Queue
    gravity: tuple[float, float]


class Motion(NamedTuple):
    """Where a disc is and how it flies now: px, px/s, px/s²."""

    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float


@njit
def _motion(disc, now):  # type: ignore[no-untyped-def]
    dt = now - disc.t
    x = disc.x + dt * (disc.vx + 0.5 * dt * disc.ax)
    y = disc.y + dt * (disc.vy + 0.5 * dt * disc.ay)
    return Motion(x, y, disc.vx + dt * disc.ax, disc.vy + dt * disc.ay, disc.ax, disc.ay)


@njit
def _bring(disc, now):  # type: ignore[no-untyped-def]
    """Move a disc to where it is now."""
    m = _motion(disc, now)
    disc.x, disc.y, disc.vx, disc.vy, disc.t = m.x, m.y, m.vx, m.vy, now


@njit
def _rank(world, i, partner):  # type: ignore[no-untyped-def]
    """Order events of one time by ball, then partner: a wall (as ~wall) before a ball."""
    first = world.body[i].ball
    if partner == NOBODY:
        second = np.int64(NOBODY)
    elif partner < 0:
        second = ~world.piece[~partner].wall
    else:
        first, second = min(first, world.body[partner].ball), max(first, world.body[partner].ball)
    return (first << 32) + second


@njit
def _offer(world, i, time, partner, serial):  # type: ignore[no-untyped-def]
    """Make this disc i's contact to come, if it is earlier than the one foreseen so far."""
    event = world.event[i]
    if time < event.hit or (time == event.hit and _rank(world, i, partner) < _rank(world, i, event.partner)):
        event.hit, event.partner, event.seen = time, partner, serial


@njit
def _look_in_three_cells(world, i, m, now, middle, step):  # type: ignore[no-untyped-def]
    """Foresee disc i's contacts with the discs of a cell and of those a step either side of it."""
    disc, event, cells = world.disc, world.event, world.cells
    for cell in range(middle - step, middle + step + 1, step):
        j = cells.first[cell]
        while j >= 0:
            o = _motion(disc[j], now)
            rx, ry, vx, vy = o.x - m.x, o.y - m.y, o.vx - m.vx, o.vy - m.vy
            if rx == 0 and ry == 0:
                rx = SPECK if world.body[i].ball < world.body[j].ball else -SPECK
            dt = time_to_touch(rx, ry, vx, vy, o.ax - m.ax, o.ay - m.ay, disc[i].radius + disc[j].radius)
            # What comes after j's own event can wait: j will look for all its contacts anew by then, and see i.
            if dt < NEVER and i != j and now + dt <= event[j].hit:
                _offer(world, i, now + dt, j, event[j].serial)
            j = cells.link[j].next


@njit
def _time_to_piece(m, radius, piece, rests):  # type: ignore[no-untyped-def]
    """Return when a disc touches a piece of wall or, if it rests on it, when it slides off its end."""
    rx, ry, reach = m.x - piece.x, m.y - piece.y, radius + piece.thick
    if piece.length == 0:
        return time_to_touch(rx, ry, m.vx, m.vy, m.ax, m.ay, reach)
    along, v_along, a_along = (rx * piece.tx + ry * piece.ty, m.vx * piece.tx + m.vy * piece.ty, m.ax * piece.tx + m.ay * piece.ty)
    if rests:
        return time_to_leave(along, v_along, a_along, 0.0, piece.length)[0]
    off, v_off, a_off = (ry * piece.tx - rx * piece.ty, m.vy * piece.tx - m.vx * piece.ty, m.ay * piece.tx - m.ax * piece.ty)
    return time_to_face(along, v_along, a_along, off, v_off, a_off, piece.length, reach)


@njit
def _look_at_walls(world, i, m, now, cell):  # type: ignore[no-untyped-def]
    """Foresee disc i's contacts with the pieces of wall of its cell."""
    cells, on = world.cells, world.body[i].wall
    for k in range(cells.begin[cell], cells.begin[cell + 1]):
        p = cells.piece[k]
        # A disc that rests on a face cannot touch that wall's ends before it leaves the face.
        if on != FREE and p != on and world.piece[p].wall == world.piece[on].wall:
            continue
        dt = _time_to_piece(m, world.disc[i].radius, world.piece[p], p == on)
        if dt < NEVER:
            _offer(world, i, now + dt, ~p, 0)


@njit
def _look_at_edges(world, i, m, now):  # type: ignore[no-untyped-def]
    """Foresee when disc i leaves its cell."""
    cells, event, link = world.cells, world.event[i], world.cells.link[i]
    x, y = (link.column - 1) * cells.width, (link.row - 1) * cells.height
    dt_x, way_x = time_to_leave(m.x, m.vx, m.ax, x, link.column * cells.width)
    dt_y, way_y = time_to_leave(m.y, m.vy, m.ay, y, link.row * cells.height)
    event.across = dt_x < dt_y
    event.cross = now + min(dt_x, dt_y)
    event.way = way_x if event.across else way_y


@njit
def _schedule(world, i):  # type: ignore[no-untyped-def]
    event = world.event[i]
    if event.hit <= event.cross:
        schedule(world.queue, i, event.hit, _rank(world, i, event.partner))
    else:
        schedule(world.queue, i, event.cross, _rank(world, i, NOBODY))


@njit
def _foresee(world, i, now):  # type: ignore[no-untyped-def]
    """Look for all that can happen next to disc i."""
    cells, event, link = world.cells, world.event[i], world.cells.link[i]
    cell = link.row * cells.stride + link.column
    m = _motion(world.disc[i], now)
    event.hit, event.partner = NEVER, NOBODY
    _look_at_walls(world, i, m, now, cell)
    for middle in (cell - cells.stride, cell, cell + cells.stride):
        _look_in_three_cells(world, i, m, now, middle, 1)
    _look_at_edges(world, i, m, now)
    _schedule(world, i)


@njit
def _cross(world, i, now):  # type: ignore[no-untyped-def]
    """Take disc i into the next cell, and look at what is new there: three cells, and the cell's walls."""
    cells, event, link = world.cells, world.event[i], world.cells.link[i]
    leave(cells, i)
    if event.across:
        link.column += event.way
        ahead, sideways = np.int64(event.way), cells.stride
    else:
        link.row += event.way
        ahead, sideways = event.way * cells.stride, 1
    enter(cells, i)
    cell = link.row * cells.stride + link.column
    m = _motion(world.disc[i], now)
    _look_at_walls(world, i, m, now, cell)
    _look_in_three_cells(world, i, m, now, cell + ahead, sideways)
    _look_at_edges(world, i, m, now)
    _schedule(world, i)


@njit
def _recent(body, now):  # type: ignore[no-untyped-def]
    return now - body.last < CONTACT_TIME


@njit
def _touched(world, i, now):  # type: ignore[no-untyped-def]
    """Note that disc i had a contact, and let it fly freely."""
    disc, body = world.disc[i], world.body[i]
    body.streak = body.streak + 1 if _recent(body, now) else 0
    body.last = now
    body.wall = FREE
    disc.ax, disc.ay = world.gravity
    world.event[i].serial += 1


@njit
def _collide(world, i, j, now):  # type: ignore[no-untyped-def]
    """Exchange momentum between two discs. Returns the normal from i to j, the impulse (kg px/s) and the depth (px)."""
    a, b, body_a, body_b = world.disc[i], world.disc[j], world.body[i], world.body[j]
    _bring(a, now)
    _bring(b, now)
    rx, ry = b.x - a.x, b.y - a.y
    if rx == 0 and ry == 0:
        rx = SPECK
    distance = math.sqrt(rx * rx + ry * ry)
    nx, ny = rx / distance, ry / distance
    closing = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny
    pull = (a.ax - b.ax) * nx + (a.ay - b.ay) * ny
    elastic = _recent(body_a, now) and _recent(body_b, now)
    parting = closing if elastic else closing * body_a.elasticity * body_b.elasticity
    parting = max(parting, pull * HOP / 2)
    impulse = (closing + parting) / (1 / body_a.mass + 1 / body_b.mass)
    a.vx -= impulse / body_a.mass * nx
    a.vy -= impulse / body_a.mass * ny
    b.vx += impulse / body_b.mass * nx
    b.vy += impulse / body_b.mass * ny
    _touched(world, i, now)
    _touched(world, j, now)
    return nx, ny, impulse, a.radius + b.radius - distance


@njit
def _normal(disc, piece):  # type: ignore[no-untyped-def]
    """Return the unit normal from a disc to a piece of wall, and how far the piece's line or point is (px)."""
    rx, ry = piece.x - disc.x, piece.y - disc.y
    if piece.length > 0:
        off = ry * piece.tx - rx * piece.ty
        side = 1.0 if off > 0 else -1.0
        return -side * piece.ty, side * piece.tx, side * off
    if rx == 0 and ry == 0:
        rx = SPECK
    distance = math.sqrt(rx * rx + ry * ry)
    return rx / distance, ry / distance, distance


@njit
def _rest(world, i, p, on, nx, ny):  # type: ignore[no-untyped-def]
    """Let face p carry disc i, which has no velocity along the normal left, and holds it if face `on` did before."""
    disc, body = world.disc[i], world.body[i]
    pull = disc.ax * nx + disc.ay * ny
    disc.ax -= pull * nx
    disc.ay -= pull * ny
    body.wall = p
    if on != FREE:
        mx, my, _ = _normal(disc, world.piece[on])
        pull = disc.ax * mx + disc.ay * my
        if abs(disc.vx * mx + disc.vy * my) <= pull * HOP / 2:
            disc.vx = disc.vy = disc.ax = disc.ay = 0.0


@njit
def _bounce(world, i, p, now):  # type: ignore[no-untyped-def]
    """Turn disc i round at a piece of wall. Returns the normal to the wall, the impulse (kg px/s), the depth (px)."""
    disc, body, piece = world.disc[i], world.body[i], world.piece[p]
    _bring(disc, now)
    nx, ny, distance = _normal(disc, piece)
    closing = disc.vx * nx + disc.vy * ny
    pull = disc.ax * nx + disc.ay * ny
    parting = closing if _recent(body, now) else closing * body.elasticity * piece.elasticity
    on = body.wall
    _touched(world, i, now)
    if body.streak > JAM:
        disc.vx = disc.vy = disc.ax = disc.ay = 0.0
    elif on == p:  # slid off its end
        closing = parting = 0.0
    elif piece.length > 0 and parting <= pull * HOP / 2:
        parting = 0.0
        disc.vx -= closing * nx
        disc.vy -= closing * ny
        _rest(world, i, p, on, nx, ny)
    else:
        parting = max(parting, pull * HOP / 2)
        disc.vx -= (closing + parting) * nx
        disc.vy -= (closing + parting) * ny
    return nx, ny, body.mass * (closing + parting), disc.radius + piece.thick - distance


@njit
def _note(log, count, time, first, second, contact):  # type: ignore[no-untyped-def]
    if count == len(log):
        longer = np.empty(2 * count, log.dtype)
        longer[:count] = log
        log = longer
    row = log[count]
    row.time, row.first, row.second = time, first, second
    row.normal[0], row.normal[1], row.impulse, row.depth = contact
    return log, count + 1


@njit(cache=True)
def advance(world, until, log, collect):  # type: ignore[no-untyped-def]
    """Play every event up to a time (s), in place.

    log: (capacity,) CONTACT, which gets a row per contact if `collect`. Returns the log, longer where it had to be,
    how many rows of it are filled, and how many contacts there were between discs.
    """
    event, body = world.event, world.body
    count = collisions = 0
    while world.queue.node[1].time <= until:
        now, i = world.queue.node[1].time, world.queue.node[1].disc
        partner = event[i].partner
        if event[i].cross < event[i].hit:
            _cross(world, i, now)
        elif partner < 0:
            contact = _bounce(world, i, ~partner, now)
            _foresee(world, i, now)
            if collect and contact[2] > 0:
                log, count = _note(log, count, now, body[i].ball, ~world.piece[~partner].wall, contact)
        elif event[partner].serial != event[i].seen:
            _foresee(world, i, now)
        else:
            i, j = (i, partner) if body[i].ball < body[partner].ball else (partner, i)
            contact = _collide(world, i, j, now)
            _foresee(world, i, now)
            _foresee(world, j, now)
            collisions += 1
            if collect:
                log, count = _note(log, count, now, body[i].ball, body[j].ball, contact)
    return log, count, collisions


@njit(cache=True)
def _begin(world):  # type: ignore[no-untyped-def]
    """Enter every disc in its cell, and foresee its first event."""
    for i in range(len(world.disc)):
        enter(world.cells, i)
    for i in range(len(world.disc)):
        _foresee(world, i, world.disc[i].t)


@njit(cache=True)
def _kick(world, i, now, dvx, dvy):  # type: ignore[no-untyped-def]
    """Change the velocity of disc i, and foresee its events anew."""
    disc = world.disc[i]
    _bring(disc, now)
    disc.vx += dvx
    disc.vy += dvy
    disc.ax, disc.ay = world.gravity
    world.body[i].wall = FREE
    world.event[i].serial += 1
    _foresee(world, i, now)


class ExactEngine:
    """Hard discs, event by event. `collisions` is how many contacts between balls there have been."""

    def __init__(self, scene: Scene, initial: State) -> None:
        if _has_friction(scene):
            raise Refused("exact: friction is not part of smooth hard discs; use --engines pymunk")
        self._rate = scene.rate
        self._steps = 0
        self._world = _world(scene, initial)
        self._slot = np.argsort(self._world.body["ball"])
        self._log = np.empty(64, CONTACT)
        self._found: list[Contacts] | None = None
        self.collisions = 0
        _begin(self._world)

    def step(self) -> None:
        """Play the events of one step. Nothing is computed at its end, so the rate changes no event."""
        self._steps += 1
        collect = self._found is not None
        self._log, count, collisions = advance(self._world, self._steps / self._rate, self._log, collect)
        self.collisions += collisions
        if self._found is not None and count:
            self._found.append(self._log[:count].copy())

    def state(self) -> State:
        """Return a snapshot: every ball flown on to now."""
        now = self._steps / self._rate
        disc = self._world.disc[self._slot]
        dt = (now - disc["t"])[:, None]
        position, velocity, acceleration = (
            np.column_stack([disc[x], disc[y]]) for x, y in (("x", "y"), ("vx", "vy"), ("ax", "ay"))
        )
        return State(now, position + dt * (velocity + 0.5 * dt * acceleration), velocity + dt * acceleration)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        found, self._found = self._found, []
        if not found:
            return no_contacts()
        contacts = np.concatenate(found)
        return contacts[np.lexsort((contacts["second"], contacts["first"], contacts["time"]))]

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        _kick(self._world, self._slot[ball], self._steps / self._rate, float(dv[0]), float(dv[1]))


def _world(scene: Scene, initial: State) -> World:
    bodies, n = scene.bodies, len(scene.bodies)
    piece = pieces_of(scene)
    cells = cells_of(initial.position, bodies.radius, scene.arena.size, piece)
    order = np.lexsort((cells.link["column"], cells.link["row"]))
    gravity = (float(scene.gravity[0]), float(scene.gravity[1]))
    disc, body, event = np.zeros(n, DISC), np.zeros(n, BODY), np.zeros(n, EVENT)
    disc["x"], disc["y"] = initial.position[order].T
    disc["vx"], disc["vy"] = initial.velocity[order].T
    disc["ax"], disc["ay"] = gravity
    disc["radius"] = bodies.radius[order]
    body["mass"], body["elasticity"] = bodies.mass[order], bodies.elasticity[order]
    body["last"], body["wall"], body["ball"] = -np.inf, FREE, order
    event["hit"] = NEVER
    return World(disc, body, event, piece, cells._replace(link=cells.link[order]), empty_queue(n), gravity)


def _has_friction(scene: Scene) -> bool:
    """Tell whether any two that can touch have friction, which is the product of their factors."""
    rough = np.count_nonzero(scene.bodies.friction)
    walls = (scene.arena.friction, *(wall.friction for wall in scene.walls))
    return rough > 1 or (rough == 1 and max(walls) > 0)
