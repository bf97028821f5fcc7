"""The textbook's rule in the article's loop: any mass, radius, elasticity and gravity, and any segment wall.

It differs from the article in three points: the impulse is (1 + e) v_n / (1/m_i + 1/m_j) (D. Baraff, Physically Based
Modeling, SIGGRAPH 2001 course notes, eq. 8-18, without rotation), the push-out is shared by inverse mass, and a wall
reflects the overshoot, as if the ball had bounced in time. Contacts are still found up to a step late.
"""

import math

import numpy as np
from numba import njit

from sandbox.engines.neighbours import NONE_LEFT, begin_turn, neighbours, next_neighbour, note_push
from sandbox.engines.stepped import SteppedEngine, log_contact
from sandbox.engines.walls import ARENA_COUNT, BOTTOM, RIGHT
from sandbox.errors import Refused
from sandbox.quantity import offset_to_segment
from sandbox.scene.model import Scene
from sandbox.state import Floats, State


@njit(cache=True)
def normal_to_wall(x, y, wall, of_arena):  # type: ignore[no-untyped-def]
    """Return the unit vector from a point to a wall, and how deep the point is in the wall (px, negative outside).

    wall: its row, see `_walls_of`.
    """
    if of_arena:
        return wall[0], wall[1], x * wall[0] + y * wall[1] - wall[2]
    dx, dy = offset_to_segment(x, y, wall[0], wall[1], wall[2], wall[3])
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = (dx / distance, dy / distance) if distance > 0 else (1.0, 0.0)
    return nx, ny, wall[4] - distance


@njit(cache=True)
def advance(position, velocity, radius, mass, elasticity, gravity, walls, widest, dt, log):  # type: ignore[no-untyped-def]
    """Do one step, in place.

    position: (n, 2) px; velocity: (n, 2) px/s; radius, mass, elasticity: (n,); gravity: (2,) px/s²; walls: (m, 6),
    see `_walls_of`; widest: diameter of the largest ball, px; dt: s; log: of contacts. Returns the log and the number
    of contacts, see `log_contact`.
    """
    n, count = len(position), 0

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
                log, count = log_contact(log, count, i, ~w, nx, ny, (v_n + away) * mass[i], depth)

    # Collide every pair i < j that is near enough to touch, at the positions that earlier pairs have left.
    grid = neighbours(position, widest, walls[RIGHT, 2], walls[BOTTOM, 2])
    for i in range(n):
        begin_turn(grid, position, i)
        while True:
            j = next_neighbour(grid)
            if j == NONE_LEFT:
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
                log, count = log_contact(log, count, i, j, -nx, -ny, -impulse, reach - distance)
    return log, count


class ImpulseEngine(SteppedEngine):
    """The textbook's rule. Balls whose centres coincide part along x, as in `article` and `exact`."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self.check(scene)
        super().__init__(scene, initial)
        bodies = scene.bodies
        self._constants = (
            bodies.radius,
            bodies.mass,
            bodies.elasticity,
            np.array(scene.gravity, float),
            _walls_of(scene),
            2 * float(bodies.radius.max()),
            1 / scene.rate,
        )

    @staticmethod
    def check(scene: Scene) -> None:
        """Raise Refused if the scene has friction."""
        if scene.bodies.friction.max() > 0:
            raise Refused("impulse: friction is not part of its rule; use --engines pymunk")

    def advance(self) -> int:
        """Do one step."""
        self.log, count = advance(self.position, self.velocity, *self._constants, self.log)
        return count


def _walls_of(scene: Scene) -> Floats:
    """Return the walls as the kernel expects them, (m, 6): left, top, right, bottom, then the scene's own.

    A row of the arena: its outward normal, the face's distance along it (px), 0, 0, elasticity. A row of the scene's
    own: both ends (px), half the thickness (px), elasticity.
    """
    (width, height), e = scene.arena.size, scene.arena.elasticity
    arena = [(-1, 0, 0, 0, 0, e), (0, -1, 0, 0, 0, e), (1, 0, width, 0, 0, e), (0, 1, height, 0, 0, e)]
    inner = [(*wall.start, *wall.to, wall.thickness / 2, wall.elasticity) for wall in scene.walls]
    return np.array([*arena, *inner], float)
