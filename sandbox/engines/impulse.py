"""The textbook's rule in the article's loop: any mass, radius, elasticity and gravity, and any segment wall.

It differs from the article in three points: the impulse is (1 + e) v_n / (1/m_i + 1/m_j) (D. Baraff, Physically Based
Modeling, SIGGRAPH 2001 course notes, eq. 8-18, without rotation), the push-out is shared by inverse mass, and a wall
reflects the overshoot, as if the ball had bounced in time. Contacts are still found up to a step late.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.compiled import kernel, portable_entry
from sandbox.engines.neighbours import Grid, begin_turn, fill, new_grid, next_neighbour, note_push
from sandbox.engines.stepped import SteppedEngine, begin_step, log_contact
from sandbox.engines.walls import ARENA_COUNT, RIGHT
from sandbox.errors import Refused
from sandbox.quantity import offset_to_segment
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, State


class Constants(NamedTuple):
    """What does not change from step to step.

    radius, mass, elasticity: (n,) px, kg, 1; gravity: (2,) px/s²; walls: (m, 6), see `_walls_of`; dt: s; rate: 1/s.
    """

    radius: Floats
    mass: Floats
    elasticity: Floats
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
    start: tuple[Floats, Floats],
    steps_before: int,
    position: Floats,
    velocity: Floats,
    constants: Constants,
    grid: Grid | None,
    log: Contacts,
) -> tuple[int, int]:
    """Do steps, see `SteppedEngine.run`. position, velocity: (steps, n, 2) px, px/s; log: of contacts.

    Returns the number of steps done, and of contacts logged in them.
    """
    count = 0
    for k in range(len(position)):
        here = begin_step(k, start, position, velocity)
        before = count
        count = _step(*here, constants, grid, log, count, (steps_before + k + 1) / constants.rate)
        if count > len(log):
            return k, before
    return len(position), count


@kernel
def _step(
    position: Floats,
    velocity: Floats,
    constants: Constants,
    grid: Grid | None,
    log: Contacts,
    count: int,
    now: float,
) -> int:
    """Do one step, in place; return the number of contacts in the log."""
    n, radius, mass, elasticity = len(position), constants.radius, constants.mass, constants.elasticity
    gravity, walls, dt = constants.gravity, constants.walls, constants.dt

    # Update positions on the parabola of gravity, and bounce off the walls.
    for i in range(n):
        for k in range(2):
            position[i, k] += velocity[i, k] * dt + gravity[k] * dt * dt / 2
            velocity[i, k] += gravity[k] * dt
        for w in range(len(walls)):
            nx, ny, depth = normal_to_wall(position[i, 0], position[i, 1], walls[w], w < ARENA_COUNT)
            depth += radius[i]
            v_n = velocity[i, 0] * nx + velocity[i, 1] * ny
            if depth > 0 and v_n > 0:
                e = elasticity[i] * walls[w, 5]
                g_n = gravity[0] * nx + gravity[1] * ny
                away = max(0.0, e * v_n - (1 + e) * g_n * depth / v_n)  # found late, gravity pulled too long
                # At most to the opposite wall: row w | RIGHT, right or bottom, has the arena's width or height.
                across = walls[w | RIGHT, 2] if w < ARENA_COUNT else math.inf
                back = min((1 + e) * depth, depth + across - 2 * radius[i])
                for k, n_k in enumerate((nx, ny)):
                    velocity[i, k] -= (v_n + away) * n_k
                    position[i, k] -= back * n_k
                count = log_contact(log, count, now, i, ~w, nx, ny, (v_n + away) * mass[i], depth)

    # Collide every pair i < j that is near enough to touch, at the positions that earlier pairs have left.
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
                v_n = (velocity[i, 0] - velocity[j, 0]) * nx + (velocity[i, 1] - velocity[j, 1]) * ny
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
                note_push(grid, position, i, j)
                count = log_contact(log, count, now, i, j, -nx, -ny, -impulse, reach - distance)
    return count


class ImpulseEngine(SteppedEngine):
    """The textbook's rule. Balls whose centres coincide part along x, as in `article` and `exact`."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self.check(scene)
        super().__init__(scene, initial)
        bodies = scene.bodies
        self._grid = new_grid(len(bodies), 2 * float(bodies.radius.max()), scene.arena.size)
        self._constants = Constants(
            bodies.radius,
            bodies.mass,
            bodies.elasticity,
            np.array(scene.gravity, float),
            _walls_of(scene),
            1 / scene.rate,
            scene.rate,
        )

    @staticmethod
    def check(scene: Scene) -> None:
        """Raise Refused if the scene has friction."""
        if scene.bodies.friction.max() > 0:
            raise Refused("impulse: friction is not part of its rule; use --engines pymunk")

    def run(
        self, start: tuple[Floats, Floats], steps_before: int, position: Floats, velocity: Floats, log: Contacts
    ) -> tuple[int, int]:
        """Do steps."""
        return steps(start, steps_before, position, velocity, self._constants, self._grid, log)


def _walls_of(scene: Scene) -> Floats:
    """Return the walls as the kernel expects them, (m, 6): left, top, right, bottom, then the scene's own.

    A row of the arena: its outward normal, the face's distance along it (px), 0, 0, elasticity. A row of the scene's
    own: both ends (px), half the thickness (px), elasticity.
    """
    (width, height), e = scene.arena.size, scene.arena.elasticity
    arena = [(-1, 0, 0, 0, 0, e), (0, -1, 0, 0, 0, e), (1, 0, width, 0, 0, e), (0, 1, height, 0, 0, e)]
    inner = [(*wall.start, *wall.to, wall.thickness / 2, wall.elasticity) for wall in scene.walls]
    return np.array([*arena, *inner], float)
