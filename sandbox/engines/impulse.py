"""The textbook's rule in the article's loop: any mass, radius, elasticity, friction and gravity, any segment wall.

It differs from the article in three points: the impulse is (1 + e) v_n / (1/m_i + 1/m_j) (D. Baraff, Physically Based
Modeling, SIGGRAPH 2001 course notes, eq. 8-18) and has friction, the push-out is shared by inverse mass, and a wall
reflects the overshoot, as if the ball had bounced in time. Contacts are still found up to a step late.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.compiled import kernel, portable_entry
from sandbox.engines.neighbours import Grid, begin_turn, fill, new_grid, next_neighbour, note_push
from sandbox.engines.stepped import Snapshot, SteppedEngine, begin_step, log_contact
from sandbox.engines.walls import ARENA_COUNT, RIGHT
from sandbox.quantity import offset_to_segment
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, State, States


class Constants(NamedTuple):
    """What does not change from step to step.

    radius, mass, elasticity, friction: (n,) px, kg, 1, 1; gravity: (2,) px/s²; walls: (m, 7), see `_walls_of`; dt: s;
    rate: 1/s.
    """

    radius: Floats
    mass: Floats
    elasticity: Floats
    friction: Floats
    gravity: Floats
    walls: Floats
    dt: float
    rate: int


@kernel
def normal_to_wall(x: float, y: float, wall: Floats, of_arena: bool) -> tuple[float, float, float]:
    """Return the unit vector from a point to a wall, and how deep the point is in the wall (px, negative outside).

    wall: its row, see `_walls_of`.
    """
    if of_arena:
        return wall[0], wall[1], x * wall[0] + y * wall[1] - wall[2]
    dx, dy = offset_to_segment(x, y, wall[0], wall[1], wall[2], wall[3])
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = (dx / distance, dy / distance) if distance > 0 else (1.0, 0.0)
    return nx, ny, wall[4] - distance


@portable_entry
def steps(
    start: Snapshot,
    steps_before: int,
    states: States,
    constants: Constants,
    grid: Grid | None,
    log: Contacts,
) -> tuple[int, int]:
    """Do steps, see `SteppedEngine.run`. Returns the number of steps done, and of contacts logged in them."""
    count = 0
    for k in range(len(states.position)):
        here, before = begin_step(k, start, states), count
        now = (steps_before + k + 1) / constants.rate
        count = _move(here, constants, log, count, now)
        count = _collide(here, constants, grid, log, count, now)
        if count > len(log):
            return k, before
    return len(states.position), count


@kernel
def _friction_impulse(slip: float, normal_impulse: float, friction: float, mass: float) -> float:
    """Return the impulse along the tangent (kg px/s) that stops a slip (px/s), or the most that friction gives.

    mass: kg, m_i at a wall, 1/(1/m_i + 1/m_j) of two discs; a third of it resists along the tangent, since discs turn
    too (O. R. Walton and R. L. Braun, J. Rheol. 30 (1986) 949, with beta_0 = 0).
    """
    most = friction * normal_impulse
    return min(max(slip * mass / 3, -most), most)


@kernel
def _rub(states: Snapshot, i: int, impulse: float, tx: float, ty: float, mass: float, radius: float) -> None:
    """Change velocity and spin of ball i by an impulse (kg px/s) against the tangent, at its rim."""
    _, velocity, _, spin = states
    velocity[i, 0] -= impulse / mass * tx
    velocity[i, 1] -= impulse / mass * ty
    spin[i] -= 2 * impulse / (mass * radius)


@kernel
def _move(states: Snapshot, constants: Constants, log: Contacts, count: int, now: float) -> int:
    """Move the balls on the parabola of gravity, and bounce off the walls; return the number of contacts in the log."""
    position, velocity, angle, spin = states
    radius, mass, gravity, walls, dt = (
        constants.radius,
        constants.mass,
        constants.gravity,
        constants.walls,
        constants.dt,
    )
    for i in range(len(position)):
        for k in range(2):
            position[i, k] += velocity[i, k] * dt + gravity[k] * dt * dt / 2
            velocity[i, k] += gravity[k] * dt
        angle[i] += spin[i] * dt
        for w in range(len(walls)):
            nx, ny, depth = normal_to_wall(position[i, 0], position[i, 1], walls[w], w < ARENA_COUNT)
            depth += radius[i]
            v_n = velocity[i, 0] * nx + velocity[i, 1] * ny
            if depth > 0 and v_n > 0:
                slip = velocity[i, 1] * nx - velocity[i, 0] * ny + radius[i] * spin[i]
                e = constants.elasticity[i] * walls[w, 5]
                g_n = gravity[0] * nx + gravity[1] * ny
                away = max(0.0, e * v_n - (1 + e) * g_n * depth / v_n)  # found late, gravity pulled too long
                # At most to the opposite wall: row w | RIGHT, right or bottom, has the arena's width or height.
                across = walls[w | RIGHT, 2] if w < ARENA_COUNT else math.inf
                back = min((1 + e) * depth, depth + across - 2 * radius[i])
                for k, n_k in enumerate((nx, ny)):
                    velocity[i, k] -= (v_n + away) * n_k
                    position[i, k] -= back * n_k
                impulse = (v_n + away) * mass[i]
                rubbed = _friction_impulse(slip, impulse, constants.friction[i] * walls[w, 6], mass[i])
                if rubbed != 0:
                    _rub(states, i, rubbed, -ny, nx, mass[i], radius[i])
                    late = min(depth / v_n, dt)
                    position[i, 0] += late * rubbed / mass[i] * ny
                    position[i, 1] -= late * rubbed / mass[i] * nx
                    angle[i] -= late * 2 * rubbed / (mass[i] * radius[i])
                count = log_contact(log, count, now, i, ~w, nx, ny, impulse, depth, rubbed, slip)
    return count


@kernel
def _collide(states: Snapshot, constants: Constants, grid: Grid | None, log: Contacts, count: int, now: float) -> int:
    """Collide every pair i < j that is near enough to touch, at the positions that earlier pairs have left.

    Returns the number of contacts in the log.
    """
    position, velocity, _, spin = states
    radius, mass, elasticity, friction = constants.radius, constants.mass, constants.elasticity, constants.friction
    n = len(position)
    fill(grid, position)
    for i in range(n):
        begin_turn(grid, position, i)
        j = i
        while True:
            j = next_neighbour(grid, j, n)
            if j == n:
                break
            dx = position[i, 0] - position[j, 0]
            dy = position[i, 1] - position[j, 1]
            reach = radius[i] + radius[j]
            if max(abs(dx), abs(dy)) >= reach:  # saves the square root for most pairs
                continue
            distance = math.sqrt(dx * dx + dy * dy)
            if distance < reach:
                nx, ny = (dx / distance, dy / distance) if distance > 0 else (1.0, 0.0)

                # Skip balls that do not approach.
                vx, vy = velocity[i, 0] - velocity[j, 0], velocity[i, 1] - velocity[j, 1]
                v_n = vx * nx + vy * ny
                if v_n >= 0:
                    continue

                per_i, per_j = 1 / mass[i], 1 / mass[j]
                impulse = (1 + elasticity[i] * elasticity[j]) * v_n / (per_i + per_j)
                push = (reach - distance) / (per_i + per_j)
                for k, n_k in enumerate((nx, ny)):
                    velocity[i, k] -= impulse * per_i * n_k
                    velocity[j, k] += impulse * per_j * n_k
                    position[i, k] += push * per_i * n_k
                    position[j, k] -= push * per_j * n_k
                slip = vx * ny - vy * nx + radius[i] * spin[i] + radius[j] * spin[j]
                rubbed = _friction_impulse(slip, -impulse, friction[i] * friction[j], 1 / (per_i + per_j))
                if rubbed != 0:
                    _rub(states, i, rubbed, ny, -nx, mass[i], radius[i])
                    _rub(states, j, rubbed, -ny, nx, mass[j], radius[j])
                note_push(grid, position, i, j)
                count = log_contact(log, count, now, i, j, -nx, -ny, -impulse, reach - distance, rubbed, slip)
    return count


class ImpulseEngine(SteppedEngine):
    """The textbook's rule. Balls whose centres coincide part along x, as in `article` and `exact`."""

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        bodies = scene.bodies
        self._grid = new_grid(len(bodies), 2 * float(bodies.radius.max()), scene.arena.size)
        self._constants = Constants(
            bodies.radius,
            bodies.mass,
            bodies.elasticity,
            bodies.friction,
            np.array(scene.gravity, float),
            _walls_of(scene),
            1 / scene.rate,
            scene.rate,
        )

    def run(self, start: Snapshot, steps_before: int, states: States, log: Contacts) -> tuple[int, int]:
        """Do steps."""
        return steps(start, steps_before, states, self._constants, self._grid, log)


def _walls_of(scene: Scene) -> Floats:
    """Return the walls as the kernel expects them, (m, 7): left, top, right, bottom, then the scene's own.

    A row of the arena: its outward normal, the face's distance along it (px), 0, 0, elasticity, friction. A row of the
    scene's own: both ends (px), half the thickness (px), elasticity, friction. Walls that do not stand are infinitely
    far.
    """
    (width, height), of_arena = scene.arena.size, (scene.arena.elasticity, scene.arena.friction)
    nearest = 0 if scene.arena.walls else math.inf
    faces = [(-1, 0, nearest), (0, -1, nearest), (1, 0, width + nearest), (0, 1, height + nearest)]
    arena = [(*face, 0, 0, *of_arena) for face in faces]
    inner = [(*wall.start, *wall.to, wall.thickness / 2, wall.elasticity, wall.friction) for wall in scene.walls]
    return np.array([*arena, *inner], float)
