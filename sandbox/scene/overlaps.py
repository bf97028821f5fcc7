"""Limits on overlaps at the start and after an edit: of balls with each other (pairs), of a ball with a wall (px).

An edit may put nothing deeper into anything than it was before, and no ball deeper into a wall than a scene's balls may
start. An added ball may overlap other balls.
"""

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from sandbox.errors import SandboxError
from sandbox.quantity import count_overlaps, length, pass_through
from sandbox.scene.balls import DECIMAL_ROUNDING
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.scene.units import Dimension
from sandbox.scene.validation import Problem
from sandbox.scene.walls import depths_in_wall
from sandbox.state import Bodies, Floats

MAX_OVERLAPS: Final = 10_000  # pairs of balls
MAX_OVERLAPS_PER_BALL: Final = 10  # besides; of discs that only touch, at most 3 (a planar graph)


def check_overlaps(position: Floats, bodies: Bodies) -> int:
    """Return how many pairs of balls overlap, without those that pass through each other. position: (n, 2) px.

    Raises SandboxError if they are more than the limit. Pymunk takes about 2 µs and 0.5 kB for each in a step.
    """
    limit = MAX_OVERLAPS + MAX_OVERLAPS_PER_BALL * len(bodies)
    count = count_overlaps(position, bodies.radius, limit + 1, bodies.filters)
    if count > limit:
        raise SandboxError(
            f"balls overlap in more than {limit:,} pairs, the limit for {len(bodies):,} balls: {MAX_OVERLAPS:,}, and "
            f"{MAX_OVERLAPS_PER_BALL} per ball; place them further apart"
        )
    return count


def depth_rounding(scene: Scene) -> float:
    """Return the depth below which an overlap is rounding, px."""
    return DECIMAL_ROUNDING * max(scene.arena.size)


def balls_in_walls(scene: Scene) -> Iterator[Problem]:
    """Yield the places of balls, other than random ones, that are deeper in a wall than the arena's `overlap`.

    A scene with errors is looked at as far as it is valid.
    """
    walls = [(number, wall) for number, wall in enumerate(scene.walls or ()) if None not in vars(wall).values()]
    if not walls or not scene.arena:
        return
    groups = [(k, group) for k, group in enumerate(scene.balls or ()) if group.is_placed and not group.is_drawn]
    places = [
        (*place, group.radius or 0.0, index, ball)
        for index, group in groups
        for ball, place in enumerate(group.points(scene.arena.size))
    ]
    position, radius, of_group, ball = np.split(np.array(places, float).reshape(-1, 5), (2, 3, 4), axis=1)
    allowed = scene.arena.overlap or 0.0
    for number, wall in walls:
        depth = depths_in_wall(wall, position, radius[:, 0])
        for k in np.flatnonzero(depth > allowed + depth_rounding(scene)).tolist():
            index, reach = int(of_group[k, 0]), radius[k, 0] + wall.thickness / 2
            key, of_wall = scene.balls[index].placement_key, "peg's centre" if wall.is_peg else "wall's centre line"
            path = ("balls", index, key, int(ball[k, 0])) if key == "positions" else ("balls", index, key)
            message = (
                f"puts a ball into wall {number}: its centre must be at least {reach - allowed:g} px from the "
                f"{of_wall}, got {reach - depth[k]:.6g} (or allow it with overlap in [arena])"
            )
            yield path, message


def needed_overlap(scene: Scene, position: Floats) -> float:
    """Return the `overlap` of the arena with which balls may start at positions (n, 2) px, in px: 0 if in no wall."""
    radius, size = scene.bodies.radius, np.array(scene.arena.size)
    depths = [depths_in_wall(wall, position, radius) for wall in scene.walls]
    if scene.arena.walls:
        depths += [*(radius[:, None] - position).T, *(position + radius[:, None] - size).T]
    deepest = max((float(depth.max()) for depth in depths), default=0.0)
    return 0.0 if deepest <= depth_rounding(scene) else math.ceil(1000 * deepest) / 1000


class Situation(NamedTuple):
    """A scene, and where an engine has its balls: (n, 2) px."""

    scene: Scene
    position: Floats


def check_ball_fits(ball: int, before: Situation | None, after: Situation) -> None:
    """Raise SandboxError if a ball is deeper in another ball or in a wall than before, or in too many balls.

    before: None for a new ball, which may be in other balls as deep as it likes.
    """
    balls = len(after.position)
    depth = _depths_of_ball(ball, after)
    earlier = _depths_of_ball(ball, before) if before else np.where(np.arange(len(depth)) < balls, np.inf, 0.0)
    earlier[balls:] = np.maximum(earlier[balls:], after.scene.arena.overlap)
    into = _deepest(depth, earlier, after.scene)
    if into is not None:
        body = f"ball {into}" if into < balls else after.scene.wall_name(into - balls)
        raise SandboxError(f"ball {ball} would overlap {body} by {_shown(after.scene, depth[into])}")
    check_overlaps(after.position, after.scene.bodies)


def check_wall_fits(wall: int, before: Situation | None, after: Situation) -> None:
    """Raise SandboxError if a ball is deeper in a wall of the scene than before, when there was none if None."""
    depth = _depths_in_wall(wall, after)
    earlier = np.full(len(depth), after.scene.arena.overlap)
    into = _deepest(depth, np.maximum(earlier, _depths_in_wall(wall, before)) if before else earlier, after.scene)
    if into is not None:
        raise SandboxError(f"wall {wall} would overlap ball {into} by {_shown(after.scene, depth[into])}")


def _shown(scene: Scene, depth: float) -> str:
    return scene.units.text(Dimension.LENGTH, "{:.3g}", depth)


def _deepest(depth: Floats, before: Floats, scene: Scene) -> int | None:
    """Return where a depth has grown most, by more than rounding; None if nowhere. depth, before: (k,) px."""
    grown = depth - np.maximum(before, 0.0)
    deepest = int(grown.argmax())
    return deepest if grown[deepest] > depth_rounding(scene) else None


def _depths_of_ball(ball: int, situation: Situation) -> Floats:
    """Return how deep a ball is in each ball, then in each wall by its number: px, negative if they are apart."""
    scene, position = situation
    here, radius, filters = position[ball], scene.bodies.radius, scene.bodies.filters
    in_balls = radius + radius[ball] - length(position - here)
    in_balls[pass_through(filters[ball], filters.T)] = in_balls[ball] = -np.inf
    width, height = scene.arena.size
    beyond = radius[ball] - np.array([here[0], here[1], width - here[0], height - here[1]])  # in the order of walls
    in_arena = beyond if scene.arena.walls else np.full(len(ARENA_WALLS), -np.inf)
    return np.concatenate([in_balls, in_arena, [_depths_in_wall(k, situation)[ball] for k in range(len(scene.walls))]])


def _depths_in_wall(wall: int, situation: Situation) -> Floats:
    """Return how deep each ball is in a wall of the scene: (n,) px, negative if they are apart."""
    return depths_in_wall(situation.scene.walls[wall], situation.position, situation.scene.bodies.radius)
