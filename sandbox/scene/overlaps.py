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
from sandbox.scene.model import Scene
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


def check_fits(body: int, before: Situation | None, after: Situation) -> None:
    """Raise SandboxError if a ball or a wall of the scene (~wall) overlaps anything more than before an edit.

    before: None for a new one; a new ball may be in other balls as deep as it likes, but in not too many of them.
    """
    balls, depth = len(after.position), _depths(body, after)
    earlier = np.maximum(_depths(body, before), 0.0) if before else np.zeros(len(depth))
    in_wall = (np.arange(len(depth)) >= balls) | (body < 0)
    in_ball = earlier if before else np.inf
    allowed = np.where(in_wall, np.maximum(earlier, after.scene.arena.overlap), in_ball)
    deepest = int((depth - allowed).argmax())
    if depth[deepest] - allowed[deepest] > depth_rounding(after.scene):
        what = f"ball {body}" if body >= 0 else f"wall {~body}"
        into = f"ball {deepest}" if deepest < balls else after.scene.wall_name(deepest - balls)
        shown = after.scene.units.text(Dimension.LENGTH, "{:.3g}", depth[deepest])
        raise SandboxError(f"{what} would overlap {into} by {shown}")
    if body >= 0:
        check_overlaps(after.position, after.scene.bodies)


def _depths(body: int, situation: Situation) -> Floats:
    """Return how deep a ball is in each ball and then in each wall, or each ball in a wall: px, negative if apart."""
    scene, position = situation
    radius, filters = scene.bodies.radius, scene.bodies.filters
    if body < 0:
        return depths_in_wall(scene.walls[~body], position, radius)
    in_balls = radius + radius[body] - length(position - position[body])
    in_balls[pass_through(filters[body], filters.T)] = in_balls[body] = -np.inf
    in_arena = radius[body] - np.concatenate([position[body], scene.arena.size - position[body]])  # as ARENA_WALLS
    if not scene.arena.walls:
        in_arena[:] = -np.inf
    in_walls = [depths_in_wall(wall, position[body], radius[body]) for wall in scene.walls]
    return np.concatenate([in_balls, in_arena, in_walls])
