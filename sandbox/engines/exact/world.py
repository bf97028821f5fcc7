"""The data of the event loop, and how a disc moves between its events.

A disc has one record for what other discs' predictions read, one for events, one for contacts. At 100,000 discs most of
the time is spent waiting for memory. So the first record is as long as a cache line, and discs that are near each other
are near in memory too.
"""

from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.compiled import Records, column, columns, kernel
from sandbox.engines.grid import NONE, Grid
from sandbox.engines.laws import NEVER
from sandbox.state import Floats

STATIC: Final = -2  # instead of a carrier: the disc is part of a static island
COINCIDENT: Final = 1e-100  # px along x between centres that coincide, so that their normal is (1, 0)

DISC: Final = np.dtype(
    [
        ("x", "f8"),  # px
        ("y", "f8"),
        ("vx", "f8"),  # px/s
        ("vy", "f8"),
        ("t", "f8"),  # s, of x, y, vx and vy
        ("radius", "f8"),  # px
        ("hit", "f8"),  # s, time of its next contact
        ("serial", "i4"),  # counts the changes of its course
        ("next", "i4"),  # disc in the same cell, or NONE
    ]
)

EVENT: Final = np.dtype(
    [
        ("crossing", "f8"),  # s, time at which it leaves its cell
        ("cell_offset", "i4"),  # from its cell's number to the next cell's
        ("cell", "i4"),
        ("partner", "i4"),  # of the next contact: a disc, or ~piece of wall
        ("partner_serial", "i4"),  # at the prediction
        ("ball", "i4"),  # its number in the scene
        ("carrier", "i4"),  # piece of wall that carries it, or NONE, or STATIC
    ]
)

BODY: Final = np.dtype(
    [
        ("ax", "f8"),  # px/s²: gravity, less what a wall supports
        ("ay", "f8"),
        ("mass", "f8"),  # kg
        ("elasticity", "f8"),
        ("last_contact", "f8"),  # s, time of the last contact, or change from slipping to rolling
        ("last_disc_contact", "f8"),  # s, time of the last contact with a disc
        ("leans_until", "f8"),  # s, until when it counts as leaning on others
        ("slow_since", "f8"),  # s, start of the count of slow contacts
        ("slow_contacts", "i4"),  # since then
        ("corner", "i4"),  # second piece of wall that carries it, where it lies in a corner, or NONE
        ("settled", "f8"),  # s, time of its last sequence of impacts that was resolved as one
        ("residual", "f8"),  # px/s, approaches that this may have left; infinite if its bodies had no room
        ("streak", "i4"),  # contacts in a row, each within CONTACT_TIME of the one before
    ]
)

TURN: Final = np.dtype(
    [
        ("angle", "f8"),  # rad, at the disc's time
        ("spin", "f8"),  # rad/s
        ("spin_rate", "f8"),  # rad/s², while walls carry it
        ("friction", "f8"),  # its factor
        ("slips_until", "f8"),  # s, when it ceases to slip on the walls that carry it, or NEVER
    ]
)

ABSORBED: Final = np.dtype(  # momentum that a disc of a static island has absorbed, kg px/s
    [
        ("x", "f8"),  # since it was last passed on to the walls
        ("y", "f8"),
        ("load_x", "f8"),  # since the island was last examined
        ("load_y", "f8"),
    ]
)

OF_DISC: Final = DISC, EVENT, BODY, TURN, ABSORBED  # the records of a disc
NODE: Final = np.dtype([("time", "f8"), ("disc", "i8")])  # of the event queue; time: s


class World(NamedTuple):
    """The data of the event loop.

    disc: (n,) DISC; event: (n,) EVENT; body: (n,) BODY; turn: (n,) TURN, which changes only if something is_rough: has
    friction or spin; absorbed: (n,) ABSORBED; filters: (n, 3), as in `Bodies`, which are read only if it is_filtered;
    piece: (m,) PIECE; node: of the event queue; gravity: px/s²; has_gravity: whether it is not 0; min_pull: px/s²,
    below which a pull is rounding; hop_time: s, for which discs that lean on each other are apart; hop_speed: px/s, at
    which they part.
    """

    disc: Records
    event: Records
    body: Records
    turn: Records
    absorbed: Records
    filters: Any
    piece: Records
    grid: Grid
    node: Records
    gravity: tuple[float, float]
    has_gravity: bool
    is_rough: bool
    is_filtered: bool
    min_pull: float
    hop_time: float
    hop_speed: float


class Motion(NamedTuple):
    """Position, velocity and acceleration of a disc: px, px/s, px/s²."""

    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float


@kernel
def motion(world: World, i: int, now: float) -> Motion:
    """Return where disc i is now, and how it moves, without moving it there."""
    disc = world.disc[i]
    dt = now - disc.t
    if not world.has_gravity:
        return Motion(disc.x + dt * disc.vx, disc.y + dt * disc.vy, disc.vx, disc.vy, 0.0, 0.0)
    ax, ay = world.body[i].ax, world.body[i].ay
    x, y = disc.x + dt * (disc.vx + 0.5 * dt * ax), disc.y + dt * (disc.vy + 0.5 * dt * ay)
    return Motion(x, y, disc.vx + dt * ax, disc.vy + dt * ay, ax, ay)


@kernel
def rotation(world: World, i: int, now: float) -> tuple[float, float]:
    """Return the angle (rad) and the spin (rad/s) of disc i now."""
    turn, dt = world.turn[i], now - world.disc[i].t
    return turn.angle + dt * (turn.spin + 0.5 * dt * turn.spin_rate), turn.spin + dt * turn.spin_rate


@kernel
def move_to_now(world: World, i: int, now: float) -> None:
    """Move disc i to its position now."""
    disc, m = world.disc[i], motion(world, i, now)
    if world.is_rough:
        world.turn[i].angle, world.turn[i].spin = rotation(world, i, now)
    disc.x, disc.y, disc.vx, disc.vy, disc.t = m.x, m.y, m.vx, m.vy, now


@kernel
def release(world: World, i: int) -> None:
    """Let disc i fly freely, whatever carried it, and invalidate what was predicted with it."""
    event, body = world.event[i], world.body[i]
    event.carrier = NONE
    body.ax, body.ay = world.gravity
    if world.is_rough:
        world.turn[i].spin_rate, world.turn[i].slips_until = 0.0, NEVER
    world.disc[i].serial += 1


def motions(world: World, now: float | Floats) -> Any:
    """Return where all discs are now, and how they move: a Motion of arrays, (n,) each; of times (k, 1), s, (k, n)."""
    x, y, vx, vy, t = columns(world.disc, "x", "y", "vx", "vy", "t")
    ax, ay = columns(world.body, "ax", "ay")
    dt = now - t
    if not world.has_gravity:
        return Motion(x + dt * vx, y + dt * vy, vx, vy, ax, ay)
    return Motion(x + dt * (vx + 0.5 * dt * ax), y + dt * (vy + 0.5 * dt * ay), vx + dt * ax, vy + dt * ay, ax, ay)


def rotations(world: World, now: float | Floats) -> tuple[Floats, Floats]:
    """Return the angles (rad) and the spins (rad/s) of all discs now, in the shape of `motions`."""
    angle, spin, rate = columns(world.turn, "angle", "spin", "spin_rate")
    dt = now - column(world.disc, "t")
    return angle + dt * (spin + 0.5 * dt * rate), spin + dt * rate
