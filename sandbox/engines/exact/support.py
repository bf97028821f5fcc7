"""Discs that walls carry, and what the walls give them."""

import math
from typing import Final

import numpy as np

from sandbox.compiled import Record, kernel
from sandbox.engines.exact.log import Log, write
from sandbox.engines.exact.records import NONE
from sandbox.engines.exact.world import COINCIDENT, World
from sandbox.engines.walls import ARENA_COUNT

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
    """Return the unit normal from a disc to a piece of wall, and the distance of the piece's line or point (px)."""
    rx, ry = piece.x - disc.x, piece.y - disc.y
    if piece.length == 0:
        return unit(rx, ry)
    off = ry * piece.tx - rx * piece.ty
    side = 1.0 if off > 0 and piece.wall >= ARENA_COUNT else -1.0
    return -side * piece.ty, side * piece.tx, side * off


@kernel
def _along(x: float, y: float, nx: float, ny: float, mx: float, my: float) -> tuple[float, float]:
    """Return the components of a vector along two directions n and m, which are not parallel."""
    area = nx * my - ny * mx
    return (x * my - y * mx) / area, (nx * y - ny * x) / area


@kernel
def carry(world: World, i: int, p: int, before: int, shortest_flight: float, now: float, log: Log) -> None:
    """Let face p carry disc i, which has no speed towards it.

    The disc is stopped if it would return within the shortest flight (s) to the face that carried it before.
    """
    disc, body, event = world.disc[i], world.body[i], world.event[i]
    nx, ny, _ = normal_to(disc, world.piece[p])
    pull = body.ax * nx + body.ay * ny
    body.ax -= pull * nx
    body.ay -= pull * ny
    event.carrier, body.corner = p, NONE
    if before == NONE:
        return
    mx, my, _ = normal_to(disc, world.piece[before])
    pull = body.ax * mx + body.ay * my
    if pull > world.min_pull and abs(disc.vx * mx + disc.vy * my) <= pull * shortest_flight / 2:
        to_p, to_before = _along(body.mass * disc.vx, body.mass * disc.vy, nx, ny, mx, my)
        _write_support(world, i, p, nx, ny, to_p, now, log)
        _write_support(world, i, before, mx, my, to_before, now, log)
        disc.vx = disc.vy = body.ax = body.ay = 0.0
        body.corner = before


@kernel
def _write_support(world: World, i: int, p: int, nx: float, ny: float, impulse: float, now: float, log: Log) -> None:
    if impulse != 0:
        write(log, now, np.int64(world.event[i].ball), ~world.piece[p].wall, nx, ny, impulse, 0.0)


@kernel
def report_support(world: World, i: int, since: float, now: float, log: Log) -> None:
    """Report what walls that carry disc i gave it until now, since a time (s), or since its last contact if later."""
    disc, event, body = world.disc[i], world.event[i], world.body[i]
    if not log.collects or event.carrier < 0:
        return
    x, y = world.gravity[0] - body.ax, world.gravity[1] - body.ay
    momentum = body.mass * (now - max(since, body.last_contact))
    nx, ny, _ = normal_to(disc, world.piece[event.carrier])
    if body.corner == NONE:
        _write_support(world, i, np.int64(event.carrier), nx, ny, momentum * (x * nx + y * ny), now, log)
        return
    mx, my, _ = normal_to(disc, world.piece[body.corner])
    to_face, to_corner = _along(x, y, nx, ny, mx, my)
    _write_support(world, i, np.int64(event.carrier), nx, ny, momentum * to_face, now, log)
    _write_support(world, i, np.int64(body.corner), mx, my, momentum * to_corner, now, log)
