"""Limits on overlaps at the start and after an edit: of balls with each other (pairs), of a ball with a wall (px)."""

import math
from typing import Final

import numpy as np

from sandbox.errors import SandboxError
from sandbox.quantity import count_overlaps
from sandbox.scene.balls import DECIMAL_ROUNDING
from sandbox.scene.model import Scene
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


def needed_overlap(scene: Scene, position: Floats) -> float:
    """Return the `overlap` of the arena with which balls may start at positions (n, 2) px, in px: 0 if in no wall."""
    radius, size = scene.bodies.radius, np.array(scene.arena.size)
    depths = [depths_in_wall(wall, position, radius) for wall in scene.walls]
    if scene.arena.walls:
        depths += [*(radius[:, None] - position).T, *(position + radius[:, None] - size).T]
    deepest = max((float(depth.max()) for depth in depths), default=0.0)
    return 0.0 if deepest <= depth_rounding(scene) else math.ceil(1000 * deepest) / 1000
