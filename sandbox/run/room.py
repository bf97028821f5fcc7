"""Whether there is room for what an edit puts somewhere: it may not be deeper in anything than it was before."""

from typing import NamedTuple

import numpy as np

from sandbox.errors import SandboxError
from sandbox.quantity import length, segment_distance
from sandbox.scene.balls import DECIMAL_ROUNDING
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import Floats


class Situation(NamedTuple):
    """A scene, and where an engine has its balls: (n, 2) px."""

    scene: Scene
    position: Floats


def check_ball_fits(ball: int, before: Situation, after: Situation) -> None:
    """Raise SandboxError if a ball is deeper in another ball or in a wall than before."""
    depth, balls = _depths_of_ball(ball, after), len(after.position)
    into = _deepest(depth, _depths_of_ball(ball, before), after.scene)
    if into is not None:
        other = f"ball {into}" if into < balls else after.scene.wall_name(into - balls)
        raise SandboxError(f"ball {ball} would overlap {other} by {depth[into]:.3g} px")


def check_wall_fits(wall: int, before: Situation | None, after: Situation) -> None:
    """Raise SandboxError if a ball is deeper in a wall of the scene than before, when there was none if None."""
    depth = _depths_in_wall(wall, after)
    into = _deepest(depth, _depths_in_wall(wall, before) if before else np.zeros(len(depth)), after.scene)
    if into is not None:
        raise SandboxError(f"wall {wall} would overlap ball {into} by {depth[into]:.3g} px")


def _deepest(depth: Floats, before: Floats, scene: Scene) -> int | None:
    """Return where a depth has grown most, by more than rounding; None if nowhere. depth, before: (k,) px."""
    grown = depth - np.maximum(before, 0.0)
    deepest = int(grown.argmax())
    return deepest if grown[deepest] > DECIMAL_ROUNDING * max(scene.arena.size) else None


def _depths_of_ball(ball: int, situation: Situation) -> Floats:
    """Return how deep a ball is in each ball, then in each wall by its number: px, negative if they are apart."""
    scene, position = situation
    here, radius = position[ball], scene.bodies.radius
    in_balls = radius + radius[ball] - length(position - here)
    in_balls[ball] = -np.inf
    width, height = scene.arena.size
    beyond = radius[ball] - np.array([here[0], here[1], width - here[0], height - here[1]])  # in the order of walls
    in_arena = beyond if scene.arena.walls else np.full(len(ARENA_WALLS), -np.inf)
    return np.concatenate([in_balls, in_arena, [_depths_in_wall(k, situation)[ball] for k in range(len(scene.walls))]])


def _depths_in_wall(wall: int, situation: Situation) -> Floats:
    """Return how deep each ball is in a wall of the scene: (n,) px, negative if they are apart."""
    of = situation.scene.walls[wall]
    distance = segment_distance(situation.position, of.start, of.to)
    return situation.scene.bodies.radius + of.thickness / 2 - distance
