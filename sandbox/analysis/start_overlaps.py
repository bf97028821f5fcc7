"""Bodies that overlap already when a comparison begins: no step of an engine led them there."""

import math
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from sandbox.analysis.first_touch import TOUCHING
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.quantity import deepest_overlap, length, segment_distance
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import Floats

SINGLE_PRECISION: Final = 4 * float(np.finfo(np.float32).eps)  # of a position: what some operations in float32 round
# What a contact may do wrongly only because of such an overlap: an impulse of the wrong size is an error by itself.
MAY_BE_BY_OVERLAP: Final = (
    Cause.LATE,
    Cause.EARLY,
    Cause.MISSED,
    Cause.PUSHED,
    Cause.PLACED,
    Cause.OVERSHOOT,
    Cause.GRAVITY,
    Cause.ROUNDING,
    Cause.UNKNOWN,
)
MAX_BY_OVERLAP: Final = 2 / TOUCHING  # times its depth, the way that it explains: out of it, and as far again


class StartOverlap(NamedTuple):
    """Two bodies that overlap at the start: how deep, px, and until when they have not come apart since, s."""

    first: int  # ball
    second: int  # ball, or ~wall
    depth: float
    until: float = math.inf


class StartOverlaps:
    """The overlaps at the start of an engine's run, each followed until the two are first apart at the end of a step.

    position: (n, 2) px, at the start.
    """

    def __init__(self, scene: Scene, position: Floats) -> None:
        self._scene = scene
        least = max(NEGLIGIBLE * float(scene.bodies.radius.min()), SINGLE_PRECISION * float(np.abs(position).max()))
        self.found = [*_of_balls(scene, position, least), *_of_walls(scene, position, least)]

    def follow(self, position: Floats, times: Floats) -> None:
        """Follow the overlaps through some steps. position: (steps, n, 2) px and times: (steps,) s, after each step."""
        for k, (first, second, _, until) in enumerate(self.found):
            if until == math.inf and (apart := _depth(self._scene, position, first, second) <= 0).any():
                self.found[k] = self.found[k]._replace(until=float(times[int(apart.argmax())]))


def overlap_of(
    overlaps: Sequence[StartOverlap], bodies: Sequence[int], time: float, displaced: float
) -> StartOverlap | None:
    """Return the overlap of some bodies, a pair or one ball, that can have displaced them by so much (px), or None.

    They must not have come apart before a time (s). What rounding has left of a touch explains no more than rounding.
    """
    alike = (one for one in overlaps if {*bodies} <= {one.first, one.second} and time <= one.until)
    return next((one for one in alike if displaced <= MAX_BY_OVERLAP * one.depth), None)


def _of_balls(scene: Scene, position: Floats, least: float) -> Iterator[StartOverlap]:
    """Find the balls that overlap by more than `least`, px."""
    radius = scene.bodies.radius
    if deepest_overlap(position, radius)[0] <= least:
        return
    for first in range(len(radius)):
        depth = radius[first] + radius[first + 1 :] - length(position[first + 1 :] - position[first])
        for other in np.flatnonzero(depth > least).tolist():
            yield StartOverlap(first, first + 1 + other, float(depth[other]))


def _of_walls(scene: Scene, position: Floats, least: float) -> Iterator[StartOverlap]:
    """Find the balls that overlap a wall by more than `least`, px."""
    walls = range(0 if scene.arena.walls else len(ARENA_WALLS), len(ARENA_WALLS) + len(scene.walls))
    for wall in walls:
        depth = _depth_in_wall(scene, position, slice(None), wall)
        for ball in np.flatnonzero(depth > least).tolist():
            yield StartOverlap(ball, ~wall, float(depth[ball]))


def _depth(scene: Scene, position: Floats, first: int, second: int) -> Floats:
    """Return how deep two bodies are in each other, px: (steps,). position: (steps, n, 2) px."""
    if second < 0:
        return _depth_in_wall(scene, position, first, ~second)
    reach = scene.bodies.radius[first] + scene.bodies.radius[second]
    depth: Floats = reach - length(position[:, first] - position[:, second])
    return depth


def _depth_in_wall(scene: Scene, position: Floats, ball: int | slice, wall: int) -> Floats:
    """Return how deep a ball, or all balls, are in a wall, px; the walls of the arena are solid to any depth."""
    place, radius = position[..., ball, :], scene.bodies.radius[ball]
    if wall >= len(ARENA_WALLS):
        start, to, thickness = scene.wall_line(wall)
        depth: Floats = radius + thickness / 2 - segment_distance(place, start, to)
        return depth
    side, axis = divmod(wall, 2)
    inside = scene.arena.size[axis] - place[..., axis] if side else place[..., axis]
    within: Floats = radius - inside
    return within
