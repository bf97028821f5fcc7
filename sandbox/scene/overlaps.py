"""Limits on overlaps: of balls with each other at the start, of a ball with a wall at the start and after an edit.

An edit may put no ball deeper into a wall than a scene's balls may start, or than one was before.
"""

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from sandbox.errors import SandboxError
from sandbox.quantity import overlaps
from sandbox.scene.balls import DECIMAL_ROUNDING
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.scene.validation import Problem
from sandbox.scene.walls import depths_in_wall
from sandbox.state import Floats

MAX_OVERLAPS: Final = 10_000  # pairs of balls
MAX_OVERLAPS_PER_BALL: Final = 10  # besides; of discs that only touch, at most 3 (a planar graph)


def check_overlaps(scene: Scene, position: Floats) -> int:
    """Return how many pairs of balls overlap, without those that pass through each other. position: (n, 2) px.

    Raises SandboxError if they are more than the limit. Pymunk takes about 2 µs and 0.5 kB for each in a step.
    """
    bodies = scene.bodies
    limit = MAX_OVERLAPS + MAX_OVERLAPS_PER_BALL * len(bodies)
    count = 0
    for pairs, _, _ in overlaps(position[None], bodies.radius, bodies.filters):
        count += len(pairs)
        if count > limit:
            message = (
                f"balls overlap in more than {limit:,} pairs, the limit for {len(bodies):,} balls: {MAX_OVERLAPS:,}, "
                f"and {MAX_OVERLAPS_PER_BALL} per ball; place them further apart"
            )
            raise SandboxError(scene.at_key((), message))
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


def depths_in_walls(scene: Scene, position: Floats) -> Floats:
    """Return how deep each ball is in each wall, by their numbers: (n, walls) px, negative if they are apart.

    position: (n, 2) px. In a wall of the arena that does not stand, the depth is -inf.
    """
    radius = scene.bodies.radius
    in_arena = radius[:, None] - np.hstack([position, scene.arena.size - position])  # as ARENA_WALLS
    if not scene.arena.walls:
        in_arena[:] = -np.inf
    return np.column_stack([in_arena, *(depths_in_wall(wall, position, radius) for wall in scene.walls)])


def needed_overlap(scene: Scene, position: Floats) -> float:
    """Return the `overlap` of the arena with which balls may start at positions (n, 2) px, in px: 0 if in no wall."""
    deepest = float(depths_in_walls(scene, position).max())
    return 0.0 if deepest <= depth_rounding(scene) else math.ceil(1000 * deepest) / 1000


def check_walls(scene: Scene, position: Floats, allowed: float) -> None:
    """Raise SandboxError if a ball at a position (n, 2) px is deeper in a wall than allowed, px."""
    depth = depths_in_walls(scene, position)
    ball, wall = np.unravel_index(depth.argmax(), depth.shape)
    if depth[ball, wall] > max(allowed, scene.arena.overlap) + depth_rounding(scene):
        by = scene.units.text(Dimension.LENGTH, "{:.3g}", depth[ball, wall])
        raise SandboxError(f"ball {ball} would overlap {scene.wall_name(int(wall))} by {by}")
