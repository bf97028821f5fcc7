"""Bodies that overlap before any step is done, until they come apart: no engine led them into each other.

Engines part them in different ways. So what is wrong with the place, the time or the order of such a contact is no
error of a step; what is wrong with its impulse or its friction is.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.touching import StepError, Touches
from sandbox.quantity import length
from sandbox.scene.model import Scene
from sandbox.scene.overlaps import depth_rounding
from sandbox.scene.walls import ARENA_COUNT, wall_distance
from sandbox.state import Floats

SEVERAL: Final = 10  # times its depth at the start, up to which an overlap explains what is found later
OF_OVERLAP: Final = (
    *(Cause.LATE, Cause.EARLY, Cause.POSITION_CORRECTION, Cause.TELEPORTED, Cause.OVERSHOOT, Cause.DOUBLE_BOUNCE),
    *(Cause.WARM_START, Cause.UNCONVERGED, Cause.UNKNOWN),
)


class StartOverlaps:
    """The bodies of a scene that overlap at the start and have not come apart since, with their depths then, px."""

    def __init__(self, scene: Scene, position: Floats, touches: Touches) -> None:
        self._scene, self._touches = scene, touches
        least = depth_rounding(scene)
        depths = {pair: touches.depth(position, pair) for pair in _near(scene, position)}
        self._depths = {pair: depth for pair, depth in depths.items() if depth > least}

    def follow(self, position: Floats, errors: list[StepError]) -> None:
        """Excuse the errors of a step that come from an overlap, and forget those that the step ended."""
        for error in errors if self._depths else ():
            pair = self._overlap_of(error)
            if pair is not None:
                error.because = self._because(pair)
                error.cause, error.candidates = Cause.OVERLAPPED, []
        for pair in [pair for pair in self._depths if self._touches.depth(position, pair) <= 0]:
            del self._depths[pair]

    def _overlap_of(self, error: StepError) -> tuple[int, int] | None:
        """Return the overlap that an error comes from: of its contact, or of its ball in flight."""
        if error.contact is None:
            return next((pair for pair in self._depths if pair[1] < 0 and error.balls == pair[:1]), None)
        if error.contact not in self._depths or error.cause not in OF_OVERLAP:
            return None
        depth = error.displacement if error.depth is None or error.cause == Cause.TELEPORTED else error.depth
        return error.contact if depth <= SEVERAL * self._depths[error.contact] else None

    def _because(self, pair: tuple[int, int]) -> str:
        first, second = pair
        partner = f"ball {second}" if second >= 0 else self._scene.wall_name(~second)
        return (
            f"Ball {first} and {partner} overlapped by {self._depths[pair]:.3g} px when the comparison began: no step "
            "led them into each other."
        )


def _near(scene: Scene, position: Floats) -> Iterator[tuple[int, int]]:
    """Yield the pairs of bodies that may overlap: first and second. position: (n, 2) px."""
    radius = scene.bodies.radius
    order = np.argsort(position[:, 0], kind="stable")
    x, largest = position[order], 2 * float(radius.max())
    for by in range(1, len(order)):
        near = x[by:, 0] - x[:-by, 0] < largest
        if not near.any():
            break
        apart = length(x[by:] - x[:-by]) < radius[order[by:]] + radius[order[:-by]]
        for k in np.flatnonzero(near & apart).tolist():
            first, second = sorted((int(order[k]), int(order[k + by])))
            yield first, second
    for ball in np.flatnonzero(wall_distance(scene, position) < radius).tolist():
        for wall in range(0 if scene.arena.walls else ARENA_COUNT, ARENA_COUNT + len(scene.walls)):
            yield ball, ~wall
