"""The textbook's rule in the article's loop: any mass, radius, elasticity, friction and gravity, any segment wall.

It differs from the article in three points: the impulse is (1 + e) v_n / (1/m_i + 1/m_j) (D. Baraff, Physically Based
Modeling, SIGGRAPH 2001 course notes, eq. 8-18) and has friction, the push-out is shared by inverse mass, and a wall
reflects the overshoot, as if the ball had bounced in time. Contacts are still found up to a step late.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.compiled import Record, Records, kernel
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.grid import Grid, grid_for
from sandbox.engines.laws import friction_impulse
from sandbox.engines.machine_code import MachineCode
from sandbox.engines.neighbours import fill, next_neighbour, note_push
from sandbox.engines.stepped import SteppedEngine, balls_of
from sandbox.quantity import pass_through
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT, OUTWARD, RIGHT, arena_faces, offset_to_segment, walls_of
from sandbox.state import State

BOX_MARGIN: Final = 1e-9  # of the arena, far above rounding
WALLS_AS_LONG: Final = 40  # walls to test take as long as the rest of a ball's step
CODE: Final = MachineCode("impulse", compiling=150_000, loading=150_000, many=400)  # balls in steps; balls
WALL: Final = np.dtype(
    [
        *((name, "f8") for name in ("x", "y", "end_x", "end_y", "half_thickness")),  # px, of the centre line
        ("elasticity", "f8"),  # the wall's factor
        ("friction", "f8"),  # the wall's factor
        *((name, "f8") for name in ("nx", "ny", "face")),  # outward normal of the arena's, and its distance, px
        ("across", "f8"),  # px, from the opposite wall of the arena; infinite of others
        *((name, "f8") for name in ("left", "right", "top", "bottom")),  # px, of a box that holds the wall
    ]
)


class World(NamedTuple):
    """The balls and the walls.

    filters: (n, 3), as in `Bodies`; collides: whether balls can; gravity: px/s²; dt: s; reach: px, between the centres
    of balls that may touch.
    """

    ball: Records
    wall: Records
    filters: Any
    collides: bool
    gravity: tuple[float, float]
    dt: float
    reach: float
    grid: Grid


def _wall_records(scene: Scene) -> Any:
    walls, count = walls_of(scene), ARENA_COUNT
    record = np.zeros(len(walls.start), WALL).view(np.recarray)
    record["x"], record["y"] = walls.start.T
    record["end_x"], record["end_y"] = walls.end.T
    for name in ("half_thickness", "elasticity", "friction"):
        record[name] = getattr(walls, name)
    record["nx"][:count], record["ny"][:count] = OUTWARD.T
    face = record["face"][:count] = arena_faces(scene)
    record["across"] = np.inf
    record["across"][:count] = face[np.arange(count) | RIGHT]  # right or bottom, at the arena's width or height
    reach = walls.half_thickness[:, None] + BOX_MARGIN * max(scene.arena.size)
    low, high = np.minimum(walls.start, walls.end) - reach, np.maximum(walls.start, walls.end) + reach
    low[:count], high[:count] = -np.inf, np.inf  # beyond a wall of the arena, all is in the wall
    (record["left"], record["top"]), (record["right"], record["bottom"]) = low.T, high.T
    return record


@kernel
def _normal_to_wall(wall: Record, w: int, x: float, y: float) -> tuple[float, float, float]:
    """Return the unit vector from a point to wall w, and how deep the point is in the wall (px, negative outside)."""
    if w < ARENA_COUNT:
        return wall.nx, wall.ny, x * wall.nx + y * wall.ny - wall.face
    dx, dy = offset_to_segment(x, y, (wall.x, wall.y), (wall.end_x, wall.end_y))
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = (dx / distance, dy / distance) if distance > 0 else (1.0, 0.0)
    return nx, ny, wall.half_thickness - distance


@kernel
def step(world: World, now: float, log: Log) -> None:
    """Do a step, which ends now (s)."""
    _move(world, now, log)
    if world.collides:
        _collide(world, now, log)


@kernel
def _apply_friction(ball: Record, impulse: float, tx: float, ty: float) -> None:
    """Change velocity and spin of a ball by an impulse (kg px/s) against the tangent, at its rim."""
    ball.vx -= impulse / ball.mass * tx
    ball.vy -= impulse / ball.mass * ty
    ball.spin -= 2 * impulse / (ball.mass * ball.radius)


@kernel
def _move(world: World, now: float, log: Log) -> None:
    """Move the balls on the parabola of gravity, and bounce off the walls."""
    (gx, gy), dt = world.gravity, world.dt
    for i in range(len(world.ball)):
        ball = world.ball[i]
        ball.x += ball.vx * dt + gx * dt * dt / 2
        ball.y += ball.vy * dt + gy * dt * dt / 2
        ball.vx += gx * dt
        ball.vy += gy * dt
        ball.angle += ball.spin * dt
        for w in range(len(world.wall)):
            wall, r = world.wall[w], ball.radius
            if not (wall.left - r < ball.x < wall.right + r and wall.top - r < ball.y < wall.bottom + r):
                continue
            nx, ny, depth = _normal_to_wall(wall, w, ball.x, ball.y)
            depth += ball.radius
            v_n = ball.vx * nx + ball.vy * ny
            if depth > 0 and v_n > 0:
                slip = ball.vy * nx - ball.vx * ny + ball.radius * ball.spin
                e = ball.elasticity * wall.elasticity
                g_n = gx * nx + gy * ny
                away = max(0.0, e * v_n - (1 + e) * g_n * depth / v_n)  # found late, gravity pulled too long
                back = min((1 + e) * depth, depth + wall.across - 2 * ball.radius)  # at most to the opposite wall
                ball.vx -= (v_n + away) * nx
                ball.vy -= (v_n + away) * ny
                ball.x -= back * nx
                ball.y -= back * ny
                impulse = (v_n + away) * ball.mass
                tangential = friction_impulse(slip, ball.friction * wall.friction * impulse, 1 / ball.mass)
                if tangential != 0:
                    _apply_friction(ball, tangential, -ny, nx)
                    late = min(depth / v_n, dt)
                    ball.x += late * tangential / ball.mass * ny
                    ball.y -= late * tangential / ball.mass * nx
                    ball.angle -= late * 2 * tangential / (ball.mass * ball.radius)
                log_contact(log, now, i, ~w, nx, ny, impulse, depth, tangential, slip)
            elif depth > ball.radius:  # others have pushed its centre into the wall, which it could leave behind
                ball.x -= depth * nx
                ball.y -= depth * ny


@kernel
def _collide(world: World, now: float, log: Log) -> None:
    """Collide every pair i < j that is near enough to touch, at the positions that earlier pairs have left."""
    ball, grid, n = world.ball, world.grid, len(world.ball)
    fill(grid, ball)
    for i in range(n):
        j = i
        while True:
            j = next_neighbour(grid, ball, i, j, world.reach)
            if j == n:
                break
            a, b = ball[i], ball[j]
            dx = a.x - b.x
            dy = a.y - b.y
            reach = a.radius + b.radius
            if max(abs(dx), abs(dy)) >= reach:  # saves the square root for most pairs
                continue
            distance = math.sqrt(dx * dx + dy * dy)
            if distance < reach and not pass_through(world.filters[i], world.filters[j]):
                nx, ny = (dx / distance, dy / distance) if distance > 0 else (1.0, 0.0)

                # Skip balls that do not approach.
                vx, vy = a.vx - b.vx, a.vy - b.vy
                v_n = vx * nx + vy * ny
                if v_n >= 0:
                    continue

                per_a, per_b = 1 / a.mass, 1 / b.mass
                impulse = (1 + a.elasticity * b.elasticity) * v_n / (per_a + per_b)
                push = (reach - distance) / (per_a + per_b)
                a.vx -= impulse * per_a * nx
                a.vy -= impulse * per_a * ny
                b.vx += impulse * per_b * nx
                b.vy += impulse * per_b * ny
                a.x += push * per_a * nx
                a.y += push * per_a * ny
                b.x -= push * per_b * nx
                b.y -= push * per_b * ny
                slip = vx * ny - vy * nx + a.radius * a.spin + b.radius * b.spin
                tangential = friction_impulse(slip, a.friction * b.friction * -impulse, per_a + per_b)
                if tangential != 0:
                    _apply_friction(a, tangential, ny, -nx)
                    _apply_friction(b, tangential, -ny, nx)
                note_push(grid, ball, j)
                log_contact(log, now, i, j, -nx, -ny, -impulse, reach - distance, tangential, slip)


class ImpulseEngine(SteppedEngine):
    """The textbook's rule. Balls whose centres coincide part along x, as in `article` and `exact`."""

    def __init__(self, scene: Scene, initial: State) -> None:
        bodies, gravity = scene.bodies, (float(scene.gravity[0]), float(scene.gravity[1]))
        reach = 2 * float(bodies.radius.max())
        grid = grid_for(len(bodies), reach, scene.arena.size)
        kinds = np.unique(bodies.filters, axis=0)
        collides = len(kinds) > 1 or not pass_through(kinds[0], kinds[0])
        walls, dt = _wall_records(scene), 1 / scene.rate
        world = World(balls_of(bodies), walls, bodies.filters.copy(), collides, gravity, dt, reach, grid)
        super().__init__(scene, initial, world, step, CODE)
        self._work = len(bodies) * (1 + len(world.wall) // WALLS_AS_LONG)
