"""Where a scene's walls are."""

import numpy as np

from sandbox.quantity import outside, segment_distance
from sandbox.scene.model import Scene
from sandbox.state import Floats


def wall_distance(scene: Scene, position: Floats) -> Floats:
    """Return the distance of points (..., 2) px from the nearest wall's face, px: (...); negative in a wall.

    Infinite if no wall stands.
    """
    distance = -outside(position, scene.arena.size) if scene.arena.walls else np.full(position.shape[:-1], np.inf)
    for wall in scene.walls:
        distance = np.minimum(distance, segment_distance(position, wall.start, wall.to) - wall.thickness / 2)
    return distance
