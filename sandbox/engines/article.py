"""The rule of "Simulating Bouncing Balls with Collisions in Python using Pygame", bit for bit.

One radius, equal masses, a box, nothing else. The article divides the impulse by the diameter, where the textbook
divides by the sum of the inverse masses. This amounts to a restitution of 2/r - 1, which is 1 only at r = 1 px.
"""

import math
from typing import Final

import numpy as np

from sandbox.compiled import kernel, portable_entry
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.neighbours import NeighbourGrid, begin_turn, fill, new_grid, next_neighbour, note_push
from sandbox.engines.stepped import Snapshot, SteppedEngine, begin_step
from sandbox.errors import Refused
from sandbox.scene.model import Scene
from sandbox.scene.walls import BOTTOM, LEFT, RIGHT, TOP
from sandbox.state import Floats, State, States

SQUARE: Final = 2.0  # exponent, passed to `frames` as an argument: a compiler turns a constant one into a product
POW_PROBES: Final = {  # numbers whose squares only one variant of glibc's pow, with FMA or without, does not round
    "fma": (2.759, 17.341, 22.072, 32.543, 34.682, 44.015, 44.144, 65.086),
    "no fma": (9.395, 15.889, 18.543, 18.79, 20.395, 21.457, 22.785, 27.217),
}
MAX_TOUCHING: Final = 1 + 1e-9  # diameters; balls further apart do not touch, however pow and sqrt round


@portable_entry
def frames(
    start: Snapshot,
    frames_before: int,
    rate: int,
    states: States,
    radius: float,
    width: float,
    height: float,
    square: float,
    grid: NeighbourGrid | None,
    log: Log,
) -> tuple[int, int]:
    """Play frames of the article, see `SteppedEngine.run`.

    states: with velocities in px per frame; log: of contacts, with the impulse per mass (px per frame). Returns the
    number of frames played, and of contacts logged in them.
    """
    for k in range(len(states.position)):
        position, velocity, _, _ = begin_step(k, start, states)
        now, logged = (frames_before + k + 1) / rate, log.filled[0]
        _move(position, velocity, radius, width, height, log, now)
        _collide(position, velocity, radius, square, grid, log, now)
        if log.filled[0] > len(log.row):
            return k, logged
    return len(states.position), log.filled[0]


@kernel
def _move(
    position: Floats,
    velocity: Floats,
    radius: float,
    width: float,
    height: float,
    log: Log,
    now: float,
) -> None:
    """Update positions, and bounce off the walls."""
    for i in range(len(position)):
        position[i, 0] += velocity[i, 0]
        position[i, 1] += velocity[i, 1]
        x, y = position[i, 0], position[i, 1]
        if x <= radius:
            velocity[i, 0] = -velocity[i, 0]
            position[i, 0] = radius
            log_contact(log, now, i, ~LEFT, -1.0, 0.0, 2 * velocity[i, 0], radius - x)
        elif x >= width - radius:
            velocity[i, 0] = -velocity[i, 0]
            position[i, 0] = width - radius
            log_contact(log, now, i, ~RIGHT, 1.0, 0.0, -2 * velocity[i, 0], x - (width - radius))
        if y <= radius:
            velocity[i, 1] = -velocity[i, 1]
            position[i, 1] = radius
            log_contact(log, now, i, ~TOP, 0.0, -1.0, 2 * velocity[i, 1], radius - y)
        elif y >= height - radius:
            velocity[i, 1] = -velocity[i, 1]
            position[i, 1] = height - radius
            log_contact(log, now, i, ~BOTTOM, 0.0, 1.0, -2 * velocity[i, 1], y - (height - radius))


@kernel
def _collide(
    position: Floats,
    velocity: Floats,
    radius: float,
    square: float,
    grid: NeighbourGrid | None,
    log: Log,
    now: float,
) -> None:
    """Collide every pair i < j that is near enough to touch, at the positions that earlier pairs have left.

    `dx**2` goes through the C library's pow, as in Python, which does not always round as dx*dx does.
    """
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
            if dx * dx + dy * dy > (2 * radius * MAX_TOUCHING) ** 2:  # saves calling pow for most pairs
                continue
            distance = math.sqrt(dx**square + dy**square)
            if distance < 2 * radius:
                length = math.sqrt(dx * dx + dy * dy)
                nx, ny = (dx / length, dy / length) if length > 0 else (1.0, 0.0)  # the article stops at length 0

                # Skip balls that move apart.
                v_n = (velocity[i, 0] - velocity[j, 0]) * nx + (velocity[i, 1] - velocity[j, 1]) * ny
                if v_n > 0:
                    continue

                impulse = 2 * v_n / (2 * radius)
                velocity[i, 0] -= impulse * nx
                velocity[i, 1] -= impulse * ny
                velocity[j, 0] += impulse * nx
                velocity[j, 1] += impulse * ny

                # Push the two apart, each by half of the overlap.
                overlap = 2 * radius - distance
                position[i, 0] += nx * overlap / 2
                position[i, 1] += ny * overlap / 2
                position[j, 0] -= nx * overlap / 2
                position[j, 1] -= ny * overlap / 2
                note_push(grid, position, i, j)
                log_contact(log, now, i, j, -nx, -ny, -impulse, overlap)


class ArticleEngine(SteppedEngine):
    """The article's loop. Velocities are kept in px per frame, as in the article; `state` returns px/s.

    Two balls whose centres coincide have no normal: the article stops with an error, this engine takes (1, 0).
    """

    def __init__(self, scene: Scene, initial: State) -> None:
        self.check(scene)
        super().__init__(scene, initial, unit=scene.rate, impulse_unit=scene.rate * float(scene.bodies.mass[0]))
        radius, (width, height) = float(scene.bodies.radius[0]), scene.arena.size
        grid = new_grid(len(scene.bodies), 2 * radius * MAX_TOUCHING, scene.arena.size)
        self._constants = radius, float(width), float(height), SQUARE, grid

    @staticmethod
    def check(scene: Scene) -> None:
        """Raise Refused if the scene has anything that the article does not model."""
        unsupported = _unsupported(scene)
        if unsupported:
            *first, last = unsupported
            parts = f"{', '.join(first)} and {last} are" if first else f"{last} is"
            raise Refused(f"article: {parts} not part of the article's rule; use --engines impulse")

    def run(self, start: Snapshot, steps_before: int, states: States, log: Log) -> tuple[int, int]:
        """Play frames."""
        return frames(start, steps_before, self._rate, states, *self._constants, log)


def pow_variant() -> str:
    """Return which pow this process has: glibc's "fma" or "no fma", "rounded" if squares are products, or "other".

    The article's bits depend on it. glibc has two variants, and chooses by whether the processor has FMA.
    """
    by_pow = [x**SQUARE != x * x for probes in POW_PROBES.values() for x in probes]
    for name in POW_PROBES:
        if by_pow == [name == variant for variant, probes in POW_PROBES.items() for _ in probes]:
            return name
    return "other" if any(by_pow) else "rounded"


def _unsupported(scene: Scene) -> list[str]:
    """List the features of the scene that the article does not model."""
    bodies, arena = scene.bodies, scene.arena
    features = {
        "arena.walls = false": not arena.walls,
        "gravity": scene.gravity != (0, 0),
        "a second radius": np.ptp(bodies.radius) > 0,
        "a second mass": np.ptp(bodies.mass) > 0,
        "an inner wall": len(scene.walls) > 0,
        "elasticity below 1": bodies.elasticity.min() < 1 or arena.elasticity < 1,
        "friction": bodies.friction.max() > 0,
        "a filter": bodies.are_filtered,
        "spin": any(group.spin for group in scene.balls),
    }
    return [name for name, present in features.items() if present]
