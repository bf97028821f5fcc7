"""The textbook's rule in the article's loop: any mass, radius, elasticity, friction and gravity, any segment wall.

It differs from the article in three points: the impulse is (1 + e) v_n / (1/m_i + 1/m_j) (D. Baraff, Physically Based
Modeling, SIGGRAPH 2001 course notes, eq. 8-18) and has friction, the push-out is shared by inverse mass, and a wall
reflects the overshoot, as if the ball had bounced in time. Contacts are still found up to a step late.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.compiled import kernel, portable_entry
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.laws import coulomb, mixed
from sandbox.engines.neighbours import NeighbourGrid, begin_turn, fill, new_grid, next_neighbour, note_push
from sandbox.engines.stepped import Snapshot, SteppedEngine, begin_step
from sandbox.quantity import pass_through
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT, OUTWARD, RIGHT, Walls, arena_faces, offset_to_segment, walls_of
from sandbox.state import Floats, Integers, State, States


class Constants(NamedTuple):
    """The constants of a run.

    radius, mass, elasticity, friction: (n,) px, kg, 1, 1; filters: (n, 3), as in `Bodies`; gravity: (2,) px/s²; walls:
    by number; outward, face: (4, 2) and (4,) px, of the arena, see `arena_faces`; dt: s; rate: 1/s.
    """

    radius: Floats
    mass: Floats
    elasticity: Floats
    friction: Floats
    filters: Integers
    gravity: Floats
    walls: Walls
    outward: Floats
    face: Floats
    dt: float
    rate: int


@kernel
def _normal_to_wall(constants: Constants, x: float, y: float, w: int) -> tuple[float, float, float]:
    """Return the unit vector from a point to wall w, and how deep the point is in the wall (px, negative outside)."""
    if w < ARENA_COUNT:
        nx, ny = constants.outward[w, 0], constants.outward[w, 1]
        return nx, ny, x * nx + y * ny - constants.face[w]
    walls = constants.walls
    dx, dy = offset_to_segment(x, y, walls.start[w], walls.end[w])
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = (dx / distance, dy / distance) if distance > 0 else (1.0, 0.0)
    return nx, ny, walls.half_thickness[w] - distance


@portable_entry
def steps(
    start: Snapshot,
    steps_before: int,
    states: States,
    constants: Constants,
    grid: NeighbourGrid | None,
    log: Log,
) -> tuple[int, int]:
    """Do steps, see `SteppedEngine.run`. Returns the number of steps done, and of contacts logged in them."""
    for k in range(len(states.position)):
        here, logged = begin_step(k, start, states), log.filled[0]
        now = (steps_before + k + 1) / constants.rate
        _move(here, constants, log, now)
        _collide(here, constants, grid, log, now)
        if log.filled[0] > len(log.row):
            return k, logged
    return len(states.position), log.filled[0]


@kernel
def _friction_impulse(slip: float, normal_impulse: float, friction: float, mass: float) -> float:
    """Return the impulse along the tangent (kg px/s) that stops a slip (px/s), or the most that friction gives.

    mass: kg, m_i at a wall, 1/(1/m_i + 1/m_j) of two discs; a third of it resists along the tangent, since discs turn
    too (O. R. Walton and R. L. Braun, J. Rheol. 30 (1986) 949, with beta_0 = 0).
    """
    return coulomb(slip * mass / 3, friction * normal_impulse)


@kernel
def _apply_friction(states: Snapshot, i: int, impulse: float, tx: float, ty: float, mass: float, radius: float) -> None:
    """Change velocity and spin of ball i by an impulse (kg px/s) against the tangent, at its rim."""
    _, velocity, _, spin = states
    velocity[i, 0] -= impulse / mass * tx
    velocity[i, 1] -= impulse / mass * ty
    spin[i] -= 2 * impulse / (mass * radius)


@kernel
def _move(states: Snapshot, constants: Constants, log: Log, now: float) -> None:
    """Move the balls on the parabola of gravity, and bounce off the walls."""
    position, velocity, angle, spin = states
    radius, mass, gravity, dt = constants.radius, constants.mass, constants.gravity, constants.dt
    walls, face = constants.walls, constants.face
    for i in range(len(position)):
        for k in range(2):
            position[i, k] += velocity[i, k] * dt + gravity[k] * dt * dt / 2
            velocity[i, k] += gravity[k] * dt
        angle[i] += spin[i] * dt
        for w in range(len(walls.start)):
            nx, ny, depth = _normal_to_wall(constants, position[i, 0], position[i, 1], w)
            depth += radius[i]
            v_n = velocity[i, 0] * nx + velocity[i, 1] * ny
            if depth > 0 and v_n > 0:
                slip = velocity[i, 1] * nx - velocity[i, 0] * ny + radius[i] * spin[i]
                e = mixed(constants.elasticity[i], walls.elasticity[w])
                g_n = gravity[0] * nx + gravity[1] * ny
                away = max(0.0, e * v_n - (1 + e) * g_n * depth / v_n)  # found late, gravity pulled too long
                # At most to the opposite wall: w | RIGHT is right or bottom, at the arena's width or height.
                across = face[w | RIGHT] if w < ARENA_COUNT else math.inf
                back = min((1 + e) * depth, depth + across - 2 * radius[i])
                for k, n_k in enumerate((nx, ny)):
                    velocity[i, k] -= (v_n + away) * n_k
                    position[i, k] -= back * n_k
                impulse = (v_n + away) * mass[i]
                tangential = _friction_impulse(slip, impulse, mixed(constants.friction[i], walls.friction[w]), mass[i])
                if tangential != 0:
                    _apply_friction(states, i, tangential, -ny, nx, mass[i], radius[i])
                    late = min(depth / v_n, dt)
                    position[i, 0] += late * tangential / mass[i] * ny
                    position[i, 1] -= late * tangential / mass[i] * nx
                    angle[i] -= late * 2 * tangential / (mass[i] * radius[i])
                log_contact(log, now, i, ~w, nx, ny, impulse, depth, tangential, slip)
            elif depth > radius[i]:  # others have pushed its centre into the wall, which it could leave on the far side
                for k, n_k in enumerate((nx, ny)):
                    position[i, k] -= depth * n_k


@kernel
def _collide(states: Snapshot, constants: Constants, grid: NeighbourGrid | None, log: Log, now: float) -> None:
    """Collide every pair i < j that is near enough to touch, at the positions that earlier pairs have left."""
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
            if distance < reach and not pass_through(constants.filters[i], constants.filters[j]):
                nx, ny = (dx / distance, dy / distance) if distance > 0 else (1.0, 0.0)

                # Skip balls that do not approach.
                vx, vy = velocity[i, 0] - velocity[j, 0], velocity[i, 1] - velocity[j, 1]
                v_n = vx * nx + vy * ny
                if v_n >= 0:
                    continue

                per_i, per_j = 1 / mass[i], 1 / mass[j]
                impulse = (1 + mixed(elasticity[i], elasticity[j])) * v_n / (per_i + per_j)
                push = (reach - distance) / (per_i + per_j)
                for k, n_k in enumerate((nx, ny)):
                    velocity[i, k] -= impulse * per_i * n_k
                    velocity[j, k] += impulse * per_j * n_k
                    position[i, k] += push * per_i * n_k
                    position[j, k] -= push * per_j * n_k
                slip = vx * ny - vy * nx + radius[i] * spin[i] + radius[j] * spin[j]
                tangential = _friction_impulse(slip, -impulse, mixed(friction[i], friction[j]), 1 / (per_i + per_j))
                if tangential != 0:
                    _apply_friction(states, i, tangential, ny, -nx, mass[i], radius[i])
                    _apply_friction(states, j, tangential, -ny, nx, mass[j], radius[j])
                note_push(grid, position, i, j)
                log_contact(log, now, i, j, -nx, -ny, -impulse, reach - distance, tangential, slip)


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
            bodies.filters,
            np.array(scene.gravity, float),
            walls_of(scene),
            OUTWARD,
            arena_faces(scene),
            1 / scene.rate,
            scene.rate,
        )

    def run(self, start: Snapshot, steps_before: int, states: States, log: Log) -> tuple[int, int]:
        """Do steps."""
        return steps(start, steps_before, states, self._constants, self._grid, log)
