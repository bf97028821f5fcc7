"""The rule of "Simulating Bouncing Balls with Collisions in Python using Pygame", bit for bit.

One radius, equal masses, a box, nothing else. The article divides the impulse by the diameter, where the textbook
divides by the sum of the inverse masses. This amounts to a restitution of 2/r - 1, which is 1 only at r = 1 px.
"""

import math
from typing import Final

import numpy as np
from numba import njit

from sandbox.engines.neighbours import NONE_LEFT, begin_turn, neighbours, next_neighbour, note_push
from sandbox.engines.stepped import SteppedEngine, log_contact
from sandbox.engines.walls import BOTTOM, LEFT, RIGHT, TOP
from sandbox.errors import Refused
from sandbox.scene.model import Scene
from sandbox.state import State

SQUARE: Final = 2.0  # exponent, passed to `frame` as an argument: a compiler turns a constant one into a product
MAX_TOUCHING: Final = 1 + 1e-9  # diameters; balls further apart do not touch, however pow and sqrt round


@njit(cache=True)
def frame(position, velocity, radius, width, height, square, log):  # type: ignore[no-untyped-def]
    """Play one frame of the article, in place.

    position: (n, 2) px; velocity: (n, 2) px per frame; log: of contacts, with the impulse per mass (px per frame).
    Returns the log and the number of contacts, see `log_contact`.

    `dx**2` goes through the C library's pow, as in Python, and does not always round as dx*dx does.
    """
    n, count = len(position), 0

    # Update positions, and bounce off the walls.
    for i in range(n):
        position[i, 0] += velocity[i, 0]
        position[i, 1] += velocity[i, 1]
        x, y = position[i, 0], position[i, 1]
        if x <= radius:
            velocity[i, 0] = -velocity[i, 0]
            position[i, 0] = radius
            log, count = log_contact(log, count, i, ~LEFT, -1.0, 0.0, 2 * velocity[i, 0], radius - x)
        elif x >= width - radius:
            velocity[i, 0] = -velocity[i, 0]
            position[i, 0] = width - radius
            log, count = log_contact(log, count, i, ~RIGHT, 1.0, 0.0, -2 * velocity[i, 0], x - (width - radius))
        if y <= radius:
            velocity[i, 1] = -velocity[i, 1]
            position[i, 1] = radius
            log, count = log_contact(log, count, i, ~TOP, 0.0, -1.0, 2 * velocity[i, 1], radius - y)
        elif y >= height - radius:
            velocity[i, 1] = -velocity[i, 1]
            position[i, 1] = height - radius
            log, count = log_contact(log, count, i, ~BOTTOM, 0.0, 1.0, -2 * velocity[i, 1], y - (height - radius))

    # Collide every pair i < j that is near enough to touch, at the positions that earlier pairs have left.
    grid = neighbours(position, 2 * radius * MAX_TOUCHING, width, height)
    for i in range(n):
        begin_turn(grid, position, i)
        while True:
            j = next_neighbour(grid)
            if j == NONE_LEFT:
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
                log, count = log_contact(log, count, i, j, -nx, -ny, -impulse, overlap)
    return log, count


class ArticleEngine(SteppedEngine):
    """The article's loop. Velocities are kept in px per frame, as in the article; `state` returns px/s.

    Two balls whose centres coincide have no normal: the article stops with an error, this engine takes (1, 0).
    """

    def __init__(self, scene: Scene, initial: State) -> None:
        self.check(scene)
        super().__init__(scene, initial, unit=scene.rate, impulse_unit=scene.rate * float(scene.bodies.mass[0]))
        self._size = scene.arena.size
        self._radius = float(scene.bodies.radius[0])

    @staticmethod
    def check(scene: Scene) -> None:
        """Raise Refused if the scene has anything that the article does not model."""
        unsupported = _unsupported(scene)
        if unsupported:
            *first, last = unsupported
            parts = f"{', '.join(first)} and {last} are" if first else f"{last} is"
            other = "pymunk" if "friction" in unsupported else "impulse"
            raise Refused(f"article: {parts} not part of the article's rule; use --engines {other}")

    def advance(self) -> int:
        """Play one frame."""
        self.log, count = frame(self.position, self.velocity, self._radius, *self._size, SQUARE, self.log)
        return count


def _unsupported(scene: Scene) -> list[str]:
    """List the features of the scene that the article does not model."""
    bodies, arena = scene.bodies, scene.arena
    features = {
        "gravity": scene.gravity != (0, 0),
        "a second radius": np.ptp(bodies.radius) > 0,
        "a second mass": np.ptp(bodies.mass) > 0,
        "an inner wall": len(scene.walls) > 0,
        "elasticity below 1": bodies.elasticity.min() < 1 or arena.elasticity < 1,
        "friction": bodies.friction.max() > 0,
    }
    return [name for name, present in features.items() if present]
