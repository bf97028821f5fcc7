"""Discs that walls carry, and what the walls give them.

On a face with the unit normal n towards it and the tangent t = (-n_y, n_x), a disc that slips along s t, s = +-1, has
the acceleration g_t - mu g_n s, with g_n = g.n and g_t = g.t, until its slip, which changes by g_t - 3 mu g_n s a
second, is 0: uniform discs turn. From there on it rolls with 2/3 g_t if |g_t| <= 3 mu g_n, and otherwise slips with
s = sign(g_t). All of these accelerations are constant.
"""

import math
from typing import Final

from sandbox.compiled import Record, kernel
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.exact.world import COINCIDENT, World, motion, rotation
from sandbox.engines.grid import NONE
from sandbox.engines.laws import NEVER
from sandbox.scene.walls import ARENA_COUNT

MAX_SUPPORTS: Final = 2  # walls that carry a disc


@kernel
def unit(rx: float, ry: float) -> tuple[float, float, float]:
    """Return the unit vector along r, and its length (px)."""
    if rx == 0 and ry == 0:
        rx = COINCIDENT
    distance = math.sqrt(rx * rx + ry * ry)
    return rx / distance, ry / distance, distance


@kernel
def normal_to(disc: Record, piece: Record) -> tuple[float, float, float]:
    """Return the unit normal from a disc to a piece of wall, and the distance of the piece's line or point (px).

    disc: DISC, or a Motion.
    """
    rx, ry = piece.x - disc.x, piece.y - disc.y
    if piece.length == 0:
        return unit(rx, ry)
    off = ry * piece.tx - rx * piece.ty
    side = 1.0 if off > 0 and piece.wall >= ARENA_COUNT else -1.0
    return -side * piece.ty, side * piece.tx, side * off


@kernel
def slip_on(world: World, i: int, nx: float, ny: float) -> float:
    """Return the slip of disc i on a wall, px/s."""
    disc = world.disc[i]
    along = disc.vy * nx - disc.vx * ny
    return along + disc.radius * world.turn[i].spin if world.is_rough else along


@kernel
def _apply_face_friction(world: World, i: int, p: int, nx: float, ny: float, slip: float, now: float) -> None:
    """Apply the friction of face p to the acceleration and the spin of disc i, which it carries. slip: px/s."""
    body, turn = world.body[i], world.turn[i]
    gx, gy = world.gravity
    g_n, g_t = gx * nx + gy * ny, gy * nx - gx * ny
    largest = turn.friction * world.piece[p].friction * g_n
    if largest <= 0 or g_n <= world.min_pull:
        return
    friction = g_t / 3  # it rolls
    if slip != 0 or abs(g_t) > 3 * largest:
        friction = math.copysign(largest, slip if slip != 0 else g_t)
        change = g_t - 3 * friction
        if slip * change < 0:
            turn.slips_until = now - slip / change
    body.ax += friction * ny
    body.ay -= friction * nx
    turn.spin_rate = -2 * friction / world.disc[i].radius


@kernel
def _along(x: float, y: float, nx: float, ny: float, mx: float, my: float) -> tuple[float, float]:
    """Return the components of a vector along two directions n and m, which are not parallel."""
    area = nx * my - ny * mx
    return (x * my - y * mx) / area, (nx * y - ny * x) / area


@kernel
def carry(world: World, i: int, p: int, before: int, shortest_flight: float, now: float, log: Log) -> None:
    """Let face p carry disc i, which has no speed towards it.

    The disc is stopped if it would return within the shortest flight (s) to the face that carried it before. In the
    corner it may go on to turn.
    """
    disc, body = world.disc[i], world.body[i]
    nx, ny, _ = normal_to(disc, world.piece[p])
    _put_on(world, i, p, nx, ny, slip_on(world, i, nx, ny), now)
    if before == NONE:
        return
    mx, my, _ = normal_to(disc, world.piece[before])
    pull = body.ax * mx + body.ay * my
    if pull > world.min_pull and abs(disc.vx * mx + disc.vy * my) <= pull * shortest_flight / 2:
        body.corner = before
        _stop_in_corner(world, i, nx, ny, mx, my, now, log)


@kernel
def _put_on(world: World, i: int, p: int, nx: float, ny: float, slip: float, now: float) -> None:
    """Let face p alone carry disc i, which slips on it at some speed (px/s)."""
    body, event = world.body[i], world.event[i]
    body.ax, body.ay = world.gravity
    pull = body.ax * nx + body.ay * ny
    body.ax -= pull * nx
    body.ay -= pull * ny
    event.carrier, body.corner = p, NONE
    world.turn[i].spin_rate, world.turn[i].slips_until = 0.0, NEVER
    _apply_face_friction(world, i, p, nx, ny, slip, now)


@kernel
def _bearing(world: World, i: int, sense: float) -> tuple[float, float, float, float]:
    """Return how both faces of a corner bear disc i, which turns with a spin of this sign; 0 if it rests.

    That is what its carrier and the other face bear along their normals, and then along the tangents, signed as the
    slip: px/s², per mass. Without friction if it rests: then the forces are not unique.
    """
    disc, p, q = world.disc[i], world.event[i].carrier, world.body[i].corner
    nx, ny, _ = normal_to(disc, world.piece[p])
    mx, my, _ = normal_to(disc, world.piece[q])
    at_n, at_m = 0.0, 0.0
    if sense != 0:
        signed = math.copysign(world.turn[i].friction, sense)
        at_n, at_m = signed * world.piece[p].friction, signed * world.piece[q].friction
    gx, gy = world.gravity
    to_n, to_m = _along(gx, gy, nx - at_n * ny, ny + at_n * nx, mx - at_m * my, my + at_m * mx)
    return to_n, to_m, at_n * to_n, at_m * to_m


@kernel
def _stop_in_corner(world: World, i: int, nx: float, ny: float, mx: float, my: float, now: float, log: Log) -> None:
    """Stop disc i where the two faces that carry it meet, and let it turn there until friction has stopped that too.

    n, m: unit normals to its carrier and to the other face.
    """
    disc, body, turn, p, q = world.disc[i], world.body[i], world.turn[i], world.event[i].carrier, world.body[i].corner
    at_n, at_m, friction_n, friction_m = _bearing(world, i, turn.spin)
    # Where it can neither turn on both faces nor climb either, it jams, and each face takes half of its spin.
    jams = min(at_n, at_m) < -world.min_pull
    each = body.mass * disc.radius * turn.spin / 4 if jams else 0.0
    x, y = body.mass * disc.vx + each * (ny + my), body.mass * disc.vy - each * (nx + mx)
    to_n, to_m = _along(x, y, nx, ny, mx, my)
    _log_support(world, i, p, to_n, each, slip_on(world, i, nx, ny), now, log)
    _log_support(world, i, q, to_m, each, slip_on(world, i, mx, my), now, log)
    disc.vx = disc.vy = body.ax = body.ay = 0.0
    friction = friction_n + friction_m
    turn.spin_rate, turn.slips_until = 0.0, NEVER
    if jams or turn.spin == 0:
        stop_slipping(world, i, now)
    elif friction != 0:
        turn.spin_rate = -2 * friction / disc.radius
        turn.slips_until = now + turn.spin / -turn.spin_rate


@kernel
def stop_slipping(world: World, i: int, now: float) -> None:
    """Let disc i, whose slip has become 0, go on: on its face, or at rest in its corner or on either of its faces."""
    disc, body, turn = world.disc[i], world.body[i], world.turn[i]
    p, q = world.event[i].carrier, body.corner
    nx, ny, _ = normal_to(disc, world.piece[p])
    disc.serial += 1
    body.last_contact = now
    _put_on(world, i, p, nx, ny, 0.0, now)
    if q == NONE:
        return
    turn.spin = 0.0
    mx, my, _ = normal_to(disc, world.piece[q])
    if body.ax * mx + body.ay * my > 0:
        _put_on(world, i, q, mx, my, 0.0, now)
        if body.ax * nx + body.ay * ny > 0:
            body.ax = body.ay = turn.spin_rate = 0.0
            turn.slips_until, body.corner = NEVER, p


@kernel
def _log_support(
    world: World, i: int, p: int, impulse: float, tangential: float, slip: float, now: float, log: Log
) -> None:
    if impulse != 0 or tangential != 0:
        nx, ny, _ = normal_to(world.disc[i], world.piece[p])
        wall = ~world.piece[p].wall
        log_contact(log, now, world.event[i].ball, wall, nx, ny, impulse, 0.0, tangential, slip)


@kernel
def report_support(world: World, i: int, since: float, now: float, log: Log) -> None:
    """Report what walls that carry disc i gave it until now, since a time (s), or since its last contact if later.

    The slip reported is that at the start of this time.
    """
    disc, event, body = world.disc[i], world.event[i], world.body[i]
    if not log.collects or event.carrier < 0:
        return
    start = max(since, body.last_contact)
    rim, turning = disc.radius * rotation(world, i, start)[1], -world.turn[i].spin_rate
    momentum, p = body.mass * (now - start), event.carrier
    if body.corner != NONE:
        to_n, to_m, friction_n, friction_m = _bearing(world, i, turning)
        _log_support(world, i, p, momentum * to_n, momentum * friction_n, rim, now, log)
        _log_support(world, i, body.corner, momentum * to_m, momentum * friction_m, rim, now, log)
        return
    nx, ny, _ = normal_to(disc, world.piece[p])
    x, y, m = world.gravity[0] - body.ax, world.gravity[1] - body.ay, motion(world, i, start)
    friction = momentum * (y * nx - x * ny) if world.is_rough else 0.0
    slip = m.vy * nx - m.vx * ny + rim
    _log_support(world, i, p, momentum * (x * nx + y * ny), friction, slip, now, log)


@kernel
def report_supports(world: World, since: float, now: float, log: Log) -> None:
    """Report what walls gave all discs that they carry until now, since a time (s)."""
    for i in range(len(world.disc)):
        report_support(world, i, since, now, log)
