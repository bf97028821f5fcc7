"""Prediction of a disc's next event: a contact with a disc or a wall, or its crossing into another cell."""

from typing import Any, Final, NamedTuple

from sandbox.compiled import Record, kernel
from sandbox.engines.exact.contact import CONTACT_TIME, MIN_APPROACH
from sandbox.engines.exact.event_queue import NO_PARTNER, rank, schedule
from sandbox.engines.exact.support import normal_to, unit
from sandbox.engines.exact.world import COINCIDENT, STATIC, Motion, World, motion
from sandbox.engines.grid import NONE, extent
from sandbox.engines.laws import NEVER, time_to_close, time_to_face, time_to_leave, time_to_touch
from sandbox.quantity import pass_through
from sandbox.scene.walls import ARENA_COUNT

MIN_SPEED: Final = 1e-100  # px/s; a slower approach leads nowhere in any run
# How far past its ends a face carries a disc: above rounding, or it would carry it again.
FACE_MARGIN: Final = 1e-14  # relative, of the face's coordinates
RESETTLE_ROUNDING: Final = 1e-14  # relative, of coordinates; and
RESETTLE_HOPS: Final = 1e-5  # heights of a hop: by so much may bodies whose impacts have been resolved overlap
IN_FACE: Final = 1e-9  # relative, of the reach: above rounding, so that a disc is in a face only if it started there
CLOCK_MARGIN: Final = 1e-15  # relative, of the time, 5 units in the last place: after it, a disc is past its face's end


class Approach(NamedTuple):
    """How a disc approaches what it touches.

    nx, ny: unit normal to it; closing: px/s; pull: px/s², pressing; speed: px/s, of both bodies, added up.
    """

    nx: float
    ny: float
    closing: float
    pull: float
    speed: float


@kernel
def _approach_of_discs(m: Motion, o: Motion) -> Approach:
    """Return how a disc that moves like m approaches one that moves like o."""
    nx, ny, _ = unit(o.x - m.x, o.y - m.y)
    closing, pull = (m.vx - o.vx) * nx + (m.vy - o.vy) * ny, (m.ax - o.ax) * nx + (m.ay - o.ay) * ny
    return Approach(nx, ny, closing, pull, abs(m.vx) + abs(m.vy) + abs(o.vx) + abs(o.vy))


@kernel
def _approach_to_piece(m: Motion, piece: Record) -> Approach:
    """Return how a disc that moves like m approaches a piece of wall."""
    nx, ny, _ = normal_to(m, piece)
    return Approach(nx, ny, m.vx * nx + m.vy * ny, m.ax * nx + m.ay * ny, abs(m.vx) + abs(m.vy))


@kernel
def _is_rounding(world: World, approach: Approach) -> bool:
    """Return whether bodies that touch approach only by rounding, and nothing presses them together."""
    rounding = max(MIN_APPROACH * (approach.speed + world.hop_speed), MIN_SPEED)
    return approach.pull <= world.min_pull and approach.closing <= rounding


@kernel
def _parting(m: Motion, approach: Approach) -> Motion:
    """Return how a disc moves that does not approach what it touches, but parts from it at the speed of rounding."""
    change = approach.closing + MIN_APPROACH * approach.speed
    return Motion(m.x, m.y, m.vx - change * approach.nx, m.vy - change * approach.ny, m.ax, m.ay)


@kernel
def _propose_contact(world: World, i: int, time: float, partner: int, serial: int) -> None:
    """Make a contact disc i's next one if it precedes the earliest predicted so far."""
    disc, event = world.disc[i], world.event[i]
    if time < disc.hit or (time == disc.hit and rank(world, i, partner) < rank(world, i, event.partner)):
        disc.hit, event.partner, event.partner_serial = time, partner, serial


@kernel
def _time_of_next(world: World, i: int, j: int, m: Motion, approach: Approach, time: float, now: float) -> float:
    """Return when discs i and j, or i and a wall (then j is i), that touch soon after now have their next contact, s.

    If a sequence of impacts that both were in has just been resolved, an approach that this has left first leads a
    little deeper. A faster one is a contact of its own.
    """
    of_i, of_j = world.body[i], world.body[j]
    since = now - min(of_i.settled, of_j.settled)
    if since >= CONTACT_TIME or approach.closing > max(of_i.residual, of_j.residual):
        return time
    depth = RESETTLE_ROUNDING * (abs(m.x) + abs(m.y)) + RESETTLE_HOPS * world.hop_speed * world.hop_time / 4
    delay = depth / approach.closing if approach.closing > 0 else CONTACT_TIME
    if approach.pull > world.min_pull:
        delay = min(delay, CONTACT_TIME / 2)  # so that a face carries it then
    return max(time, now + (delay if since == 0 else min(delay, CONTACT_TIME)))


@kernel
def _time_to_disc(world: World, i: int, j: int, m: Motion, o: Motion, now: float) -> float:
    """Return when discs i and j, which move like m and o, touch, s. After the next contact of either, perhaps `inf`."""
    disc, event = world.disc, world.event
    rx, ry = o.x - m.x, o.y - m.y
    if rx == 0 and ry == 0:
        rx = COINCIDENT if event[i].ball < event[j].ball else -COINCIDENT
    # After j's own next contact, j is predicted anew against all discs, i among them.
    limit, reach = min(disc[i].hit, disc[j].hit) - now, disc[i].radius + disc[j].radius
    return now + time_to_touch(rx, ry, o.vx - m.vx, o.vy - m.vy, o.ax - m.ax, o.ay - m.ay, reach, limit)


@kernel
def _predict_discs(world: World, i: int, m: Motion, now: float, corner: int, columns: int, rows: int) -> None:
    """Predict disc i's contacts with the discs of a block of cells, given its first cell and its size in cells."""
    disc, grid = world.disc, world.grid
    for row in range(rows):
        for cell in range(corner + row * grid.stride, corner + row * grid.stride + columns):
            j = grid.cell[cell].first
            while j >= 0:
                o = motion(world, j, now)
                passes = world.is_filtered and pass_through(world.filters[i], world.filters[j])
                time = NEVER if passes else _time_to_disc(world, i, j, m, o, now)
                if time < now + CONTACT_TIME and i != j:
                    approach = _approach_of_discs(m, o)
                    if time == now and _is_rounding(world, approach):
                        time = _time_to_disc(world, i, j, _parting(m, approach), o, now)
                        time = time if time > now else NEVER
                    time = _time_of_next(world, i, j, m, approach, time, now)
                if time < NEVER and i != j and time <= disc[j].hit:
                    _propose_contact(world, i, time, j, disc[j].serial)
                j = disc[j].next


@kernel
def _time_to_end(rx: float, ry: float, m: Motion, reach: float, piece: Record) -> float:
    """Return when a disc, r (px) from the round end of a wall, touches it: only beyond the face, where it is nearest.

    A disc that is in the face cannot touch the end before it leaves the face.
    """
    vx, vy, ax, ay, start = m.vx, m.vy, m.ax, m.ay, 0.0
    beyond = rx * piece.tx + ry * piece.ty
    if beyond < 0 and abs(ry * piece.tx - rx * piece.ty) < reach * (1 - IN_FACE):
        v, a = vx * piece.tx + vy * piece.ty, ax * piece.tx + ay * piece.ty
        start = time_to_close(-beyond, -v, -a)
        if start == NEVER:
            return NEVER
        rx, ry = rx + start * (vx + start * ax / 2), ry + start * (vy + start * ay / 2)
        vx, vy = vx + start * ax, vy + start * ay
    return start + time_to_touch(rx, ry, vx, vy, ax, ay, reach, NEVER)


@kernel
def time_to_piece(m: Motion, radius: float, piece: Record, carried: bool) -> float:
    """Return when a disc touches a piece of wall or, if the piece carries the disc, when it slides off an end."""
    rx, ry = m.x - piece.x, m.y - piece.y
    if piece.length == 0:
        return _time_to_end(rx, ry, m, radius + piece.half_thickness, piece)
    tx, ty = piece.tx, piece.ty
    off, v_off, a_off = ry * tx - rx * ty, m.vy * tx - m.vx * ty, m.ay * tx - m.ax * ty
    if piece.wall < ARENA_COUNT:
        return NEVER if carried else time_to_close(off - radius, v_off, a_off)
    along, v_along, a_along = rx * tx + ry * ty, m.vx * tx + m.vy * ty, m.ax * tx + m.ay * ty
    if carried:
        margin = FACE_MARGIN * (abs(piece.x) + abs(piece.y) + piece.length)
        return time_to_leave(along, v_along, a_along, -margin, piece.length + margin)[0]
    return time_to_face(along, v_along, a_along, off, v_off, a_off, piece.length, radius + piece.half_thickness)


@kernel
def _predict_walls(world: World, i: int, m: Motion, now: float) -> None:
    """Predict disc i's contacts with the pieces of wall of its cell."""
    event, grid, piece = world.event[i], world.grid, world.piece
    if event.carrier == STATIC:
        return
    for k in range(grid.cell[event.cell].begin, grid.cell[event.cell + 1].begin):
        p = grid.piece[k]
        # A disc that a face carries cannot touch the ends of that wall before it leaves the face.
        if event.carrier not in (NONE, p) and piece[p].wall == piece[event.carrier].wall:
            continue
        time = now + time_to_piece(m, world.disc[i].radius, piece[p], p == event.carrier)
        if p == event.carrier:
            time *= 1 + CLOCK_MARGIN
        elif time < now + CONTACT_TIME:
            approach = _approach_to_piece(m, piece[p])
            if time == now and _is_rounding(world, approach):
                radius = world.disc[i].radius
                time = now + time_to_piece(_parting(m, approach), radius, piece[p], False)
                time = time if time > now else NEVER
            time = _time_of_next(world, i, i, m, approach, time, now)
        if time < NEVER:
            _propose_contact(world, i, time, ~p, 0)


@kernel
def _predict_crossing(world: World, i: int, m: Motion, now: float) -> None:
    """Predict when and where disc i leaves its cell."""
    grid, event = world.grid, world.event[i]
    row, column = divmod(event.cell, grid.stride)
    left, right = extent(column, grid.stride - 2, grid.width)
    top, bottom = extent(row, len(grid.cell) // grid.stride - 2, grid.height)
    dt_x, way_x = time_to_leave(m.x, m.vx, m.ax, left, right)
    dt_y, way_y = time_to_leave(m.y, m.vy, m.ay, top, bottom)
    dt, offset = (dt_x, way_x) if dt_x < dt_y else (dt_y, way_y * grid.stride)
    event.crossing, event.cell_offset = now + dt, offset


@kernel
def predict(world: World, i: int, now: float) -> None:
    """Predict disc i's next event, from all that it can meet."""
    world.disc[i].hit, world.event[i].partner = NEVER, NO_PARTNER
    if world.is_rough and world.turn[i].slips_until < NEVER:
        _propose_contact(world, i, world.turn[i].slips_until, ~world.event[i].carrier, 0)
    update_prediction(world, i, now, world.event[i].cell - world.grid.stride - 1, 3, 3)


@kernel
def update_prediction(world: World, i: int, now: float, corner: int, columns: int, rows: int) -> None:
    """Predict disc i's next event, from what was predicted before and what it can meet in its cell and in a block.

    corner, columns, rows: the block's first cell, and its size in cells.
    """
    m = motion(world, i, now)
    _predict_walls(world, i, m, now)
    _predict_discs(world, i, m, now, corner, columns, rows)
    _predict_crossing(world, i, m, now)
    schedule(world, i)


@kernel
def predict_each(world: World, discs: Any, now: float) -> None:
    """Predict the next event of discs, from all that they can meet."""
    for i in discs:
        predict(world, i, now)
