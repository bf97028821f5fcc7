"""Coulomb's law of friction: at an impact, and on a disc that a face of a wall carries.

Throughout: n is the unit normal from a disc to what it touches, t = (-n_y, n_x) the tangent; the slip u (px/s) is the
speed along t of the disc's rim past the other's at the contact; mu is the product of both factors.

An impact with the impulse J along n has the impulse J_t = u m/3 along t, which stops the slip, or mu J if that is less:
uniform discs turn under a third of it, 1/m = 1/m_i + 1/m_j (O. R. Walton and R. L. Braun, J. Rheol. 30 (1986) 949;
S. F. Foerster et al., Phys. Fluids 6 (1994) 1108, with beta_0 = 0). J is unchanged: for discs, n and t decouple.

On a face, with g_n = g.n and g_t = g.t, the disc slips in the direction s = sign(u) with the acceleration
g_t - mu g_n s, until u, which changes by g_t - 3 mu g_n s a second, is 0. From there on it rolls with 2/3 g_t if
|g_t| <= 3 mu g_n, and otherwise slips with s = sign(g_t). All of these accelerations are constant.
"""

import math

from sandbox.compiled import kernel
from sandbox.engines.exact.world import World
from sandbox.engines.laws import NEVER, friction_impulse, mixed


@kernel
def slip_on(world: World, i: int, nx: float, ny: float) -> float:
    """Return the slip of disc i on a wall, px/s."""
    disc = world.disc[i]
    along = disc.vy * nx - disc.vx * ny
    return along + disc.radius * world.turn[i].spin if world.is_rough else along


@kernel
def _apply_tangential(world: World, i: int, nx: float, ny: float, tangential: float, per_mass: float) -> None:
    """Take an impulse along the tangent (kg px/s) from disc i. per_mass: 1/kg, 0 if it is part of a static island."""
    disc = world.disc[i]
    disc.vx += tangential * per_mass * ny
    disc.vy -= tangential * per_mass * nx
    world.turn[i].spin -= 2 * tangential * per_mass / disc.radius


@kernel
def friction_at_wall(world: World, i: int, p: int, nx: float, ny: float, impulse: float) -> tuple[float, float]:
    """Apply the friction of disc i's impact on a piece of wall. impulse: kg px/s, along the normal.

    Returns the impulse along the tangent (kg px/s), and the slip before (px/s).
    """
    slip, per_mass = slip_on(world, i, nx, ny), 1 / world.body[i].mass
    if not world.is_rough:
        return 0.0, slip
    tangential = friction_impulse(slip, mixed(world.turn[i].friction, world.piece[p].friction) * impulse, per_mass)
    _apply_tangential(world, i, nx, ny, tangential, per_mass)
    return tangential, slip


@kernel
def friction_of_discs(
    world: World, i: int, j: int, nx: float, ny: float, impulse: float, per_i: float, per_j: float
) -> tuple[float, float]:
    """Apply the friction of an impact of discs i and j. per_i, per_j: 1/kg; the rest as `friction_at_wall`."""
    slip = slip_on(world, i, nx, ny) + slip_on(world, j, -nx, -ny)
    if not world.is_rough:
        return 0.0, slip
    tangential = friction_impulse(slip, mixed(world.turn[i].friction, world.turn[j].friction) * impulse, per_i + per_j)
    _apply_tangential(world, i, nx, ny, tangential, per_i)
    _apply_tangential(world, j, -nx, -ny, tangential, per_j)
    return tangential, slip


@kernel
def friction_on_face(g_t: float, largest: float, slip: float) -> tuple[float, float]:
    """Return the friction of a face per mass, px/s², and for how long a disc that it carries slips, s.

    g_t: px/s², gravity along the tangent; largest: px/s², what friction can be; slip: px/s.
    """
    if slip == 0 and abs(g_t) <= 3 * largest:
        return g_t / 3, NEVER
    friction = math.copysign(largest, slip if slip != 0 else g_t)
    change = g_t - 3 * friction
    return friction, -slip / change if slip * change < 0 else NEVER


@kernel
def apply_face_friction(world: World, i: int, p: int, nx: float, ny: float, slip: float, now: float) -> None:
    """Apply the friction of face p to the acceleration and the spin of disc i, which it carries. slip: px/s."""
    body, turn = world.body[i], world.turn[i]
    gx, gy = world.gravity
    g_n, g_t = gx * nx + gy * ny, gy * nx - gx * ny
    largest = mixed(turn.friction, world.piece[p].friction) * g_n
    if largest <= 0 or g_n <= world.min_pull:
        return
    friction, slips_for = friction_on_face(g_t, largest, slip)
    if slips_for < NEVER:
        turn.slips_until = now + slips_for
    body.ax += friction * ny
    body.ay -= friction * nx
    turn.spin_rate = -2 * friction / world.disc[i].radius
