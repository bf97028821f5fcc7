"""The rule of "Simulating Bouncing Balls with Collisions in Python using Pygame", bit for bit.

One radius, equal masses, a box, nothing else. The article divides the impulse by the diameter, where the textbook
divides by the sum of the inverse masses. This amounts to a restitution of 2/r - 1, which is 1 only at r = 1 px.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from sandbox.compiled import Records, kernel
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.grid import Grid, grid_for
from sandbox.engines.machine_code import MachineCode
from sandbox.engines.neighbours import fill, next_neighbour, note_push
from sandbox.engines.stepped import SteppedEngine, balls_of
from sandbox.errors import Refused
from sandbox.scene.model import Scene
from sandbox.scene.walls import BOTTOM, LEFT, RIGHT, TOP
from sandbox.state import State

SQUARE: Final = 2.0  # exponent, a field of the World: a compiler turns a constant one into a product
POW_PROBES: Final = {  # numbers whose squares only one variant of glibc's pow, with FMA or without, does not round
    "fma": (2.759, 17.341, 22.072, 32.543, 34.682, 44.015, 44.144, 65.086),
    "no fma": (9.395, 15.889, 18.543, 18.79, 20.395, 21.457, 22.785, 27.217),
}
MAX_TOUCHING: Final = 1 + 1e-9  # diameters; balls further apart do not touch, however pow and sqrt round
CODE: Final = MachineCode("article", compiling=150_000, loading=150_000, many=400)  # balls in steps; balls


class World(NamedTuple):
    """The article's balls and arena. radius, width, height: px; velocities are in px per frame."""

    ball: Records
    radius: float
    width: float
    height: float
    square: float
    grid: Grid


@kernel
def frame(world: World, now: float, log: Log) -> None:
    """Play a frame of the article, which ends now (s). log: of contacts, with the impulse per mass (px per frame)."""
    _move(world, now, log)
    _collide(world, now, log)


@kernel
def _move(world: World, now: float, log: Log) -> None:
    """Update positions, and bounce off the walls."""
    radius, width, height = world.radius, world.width, world.height
    for i in range(len(world.ball)):
        ball = world.ball[i]
        ball.x += ball.vx
        ball.y += ball.vy
        x, y = ball.x, ball.y
        if x <= radius:
            ball.vx = -ball.vx
            ball.x = radius
            log_contact(log, now, i, ~LEFT, -1.0, 0.0, 2 * ball.vx, radius - x)
        elif x >= width - radius:
            ball.vx = -ball.vx
            ball.x = width - radius
            log_contact(log, now, i, ~RIGHT, 1.0, 0.0, -2 * ball.vx, x - (width - radius))
        if y <= radius:
            ball.vy = -ball.vy
            ball.y = radius
            log_contact(log, now, i, ~TOP, 0.0, -1.0, 2 * ball.vy, radius - y)
        elif y >= height - radius:
            ball.vy = -ball.vy
            ball.y = height - radius
            log_contact(log, now, i, ~BOTTOM, 0.0, 1.0, -2 * ball.vy, y - (height - radius))


@kernel
def _collide(world: World, now: float, log: Log) -> None:
    """Collide every pair i < j that is near enough to touch, at the positions that earlier pairs have left.

    `dx**2` goes through the C library's pow, as in Python, which does not always round as dx*dx does.
    """
    ball, radius, grid, n = world.ball, world.radius, world.grid, len(world.ball)
    reach = 2 * radius * MAX_TOUCHING
    fill(grid, ball)
    for i in range(n):
        j = i
        while True:
            j = next_neighbour(grid, ball, i, j, reach)
            if j == n:
                break
            a, b = ball[i], ball[j]
            dx = a.x - b.x
            dy = a.y - b.y
            if dx * dx + dy * dy > reach**2:  # saves calling pow for most pairs
                continue
            distance = math.sqrt(dx**world.square + dy**world.square)
            if distance < 2 * radius:
                length = math.sqrt(dx * dx + dy * dy)
                nx, ny = (dx / length, dy / length) if length > 0 else (1.0, 0.0)  # the article stops at length 0

                # Skip balls that move apart.
                v_n = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny
                if v_n > 0:
                    continue

                impulse = 2 * v_n / (2 * radius)
                a.vx -= impulse * nx
                a.vy -= impulse * ny
                b.vx += impulse * nx
                b.vy += impulse * ny

                # Push the two apart, each by half of the overlap.
                overlap = 2 * radius - distance
                a.x += nx * overlap / 2
                a.y += ny * overlap / 2
                b.x -= nx * overlap / 2
                b.y -= ny * overlap / 2
                note_push(grid, ball, j)
                log_contact(log, now, i, j, -nx, -ny, -impulse, overlap)


class ArticleEngine(SteppedEngine):
    """The article's loop. Velocities are kept in px per frame, as in the article; `state` returns px/s.

    Two balls whose centres coincide have no normal: the article stops with an error, this engine takes (1, 0).
    """

    def __init__(self, scene: Scene, initial: State) -> None:
        self.check(scene)
        radius, (width, height) = float(scene.bodies.radius[0]), scene.arena.size
        grid = grid_for(len(scene.bodies), 2 * radius * MAX_TOUCHING, scene.arena.size)
        world = World(balls_of(scene.bodies), radius, float(width), float(height), SQUARE, grid)
        impulse_unit = scene.rate * float(scene.bodies.mass[0])
        super().__init__(scene, initial, world, frame, CODE, unit=scene.rate, impulse_unit=impulse_unit)

    @staticmethod
    def check(scene: Scene) -> None:
        """Raise Refused if the scene has anything that the article does not model."""
        unsupported = _unsupported(scene)
        if unsupported:
            *first, last = unsupported
            parts = f"{', '.join(first)} and {last} are" if first else f"{last} is"
            raise Refused(f"article: {parts} not part of the article's rule; use --engines impulse")


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
