"""A live `pymunk.Space`, drawn by pymunk's own `pygame_util` debug-draw."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import pygame
import pymunk
from pygame import Surface
from pymunk.batch import BodyFields, Buffer, get_space_bodies
from pymunk.pygame_util import DrawOptions
from pymunk.space_debug_draw_options import SpaceDebugColor

from sandbox.view.primitives import blit_discs, capsule, disc

ANGLES: Final = 64  # directions that a disc's line can have, so at most 3 degrees off


class DebugDraw(DrawOptions):
    """Pymunk's drawing of a space, except for its shapes.

    Pymunk calls Python for each shape, which takes half a frame for a thousand discs. Here discs are cached pictures,
    placed by one read of all bodies, and show their angle as pymunk's do. Walls have their thickness at any slope; the
    arena's, which are very large, are left out.
    """

    def __init__(self, space: pymunk.Space, colours: Sequence[str]) -> None:
        super().__init__(Surface((1, 1)))
        self.flags = DrawOptions.DRAW_CONSTRAINTS | DrawOptions.DRAW_COLLISION_POINTS
        self._space = space
        self._walls = [shape for shape in space.shapes if isinstance(shape, pymunk.Segment)]
        self._radius = np.array([shape.radius for shape in space.shapes if isinstance(shape, pymunk.Circle)])
        self._colours = colours
        self._buffer = Buffer()

    def draw(self, surface: Surface, scale: float) -> None:
        """Draw the space on a surface. scale: px of the surface for one px of the space."""
        self.surface = surface
        self.transform = pymunk.Transform.scaling(scale)
        for wall in self._walls:
            colour = self.color_for_shape(wall)
            self.draw_fat_segment(scale * wall.a, scale * wall.b, scale * wall.radius, colour, colour)
        self._draw_discs(scale)
        self._space.debug_draw(self)

    def _draw_discs(self, scale: float) -> None:
        self._buffer.clear()
        get_space_bodies(self._space, BodyFields.POSITION | BodyFields.ANGLE, self._buffer)
        rows = np.frombuffer(self._buffer.float_buf()).reshape(-1, 3)[: len(self._radius)]
        turns = np.rint(rows[:, 2] / math.tau * ANGLES).astype(int) % ANGLES
        line = self.shape_outline_color.as_int()
        radius = scale * self._radius
        pictures = map(turned_disc, radius.tolist(), self._colours, turns.tolist(), [line] * len(radius))
        blit_discs(self.surface, pictures, scale * rows[:, :2], radius)

    def draw_fat_segment(
        self,
        a: tuple[float, float],
        b: tuple[float, float],
        radius: float,
        outline_color: SpaceDebugColor,
        fill_color: SpaceDebugColor,
    ) -> None:
        """Draw a wall, if more of it than its edge is on the surface."""
        size = self.surface.get_size()
        for axis in (0, 1):
            if max(a[axis], b[axis]) + radius <= 0 or min(a[axis], b[axis]) - radius >= size[axis]:
                return
        capsule(self.surface, fill_color.as_int(), a, b, radius)


@lru_cache(maxsize=4096)
def turned_disc(radius: float, colour: str, turn: int, line: tuple[int, int, int, int]) -> Surface:
    """Draw a disc with the line that shows its angle, as pymunk does. turn: one of ANGLES."""
    picture = disc(radius, colour).copy()
    half, angle = picture.get_width() // 2, turn * math.tau / ANGLES
    edge = half + round((radius - 1) * math.cos(angle)), half + round((radius - 1) * math.sin(angle))
    pygame.draw.line(picture, line, (half, half), edge, 2 if radius > 20 else 1)
    return picture
