"""The data of the event loop, and how a disc moves between its events."""

from typing import Any, Final, NamedTuple

from sandbox.compiled import Records, kernel
from sandbox.engines.exact.records import NONE
from sandbox.engines.grid import Grid
from sandbox.engines.laws import NEVER
from sandbox.quantity import pass_through
from sandbox.state import Floats

COINCIDENT: Final = 1e-100  # px along x between centres that coincide, so that their normal is (1, 0)


class World(NamedTuple):
    """The data of the event loop. Discs are stored so that those near each other are near in memory too.

    disc: (n,) DISC; event: (n,) EVENT; body: (n,) BODY; turn: (n,) TURN, which is read only if something is_rough: has
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


@kernel
def meet(world: World, i: int, j: int) -> bool:
    """Return whether discs i and j do not pass through each other."""
    return not (world.is_filtered and pass_through(world.filters[i], world.filters[j]))


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


@kernel
def write_state(world: World, now: float, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
    """Write the state of each ball now, in scene order: (n, 2) px and px/s, (n,) rad and rad/s."""
    for i in range(len(world.disc)):
        m, ball = motion(world, i, now), world.event[i].ball
        position[ball, 0], position[ball, 1] = m.x, m.y
        velocity[ball, 0], velocity[ball, 1] = m.vx, m.vy
        if world.is_rough:
            angle[ball], spin[ball] = rotation(world, i, now)
