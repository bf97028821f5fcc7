"""A live `pymunk.Space`, drawn by pymunk's own `pygame_util` debug-draw."""

import pygame
import pymunk
from pymunk.pygame_util import DrawOptions
from pymunk.space_debug_draw_options import SpaceDebugColor

from sandbox.scene import rgb
from sandbox.view.draw import capsule


class _TrueWalls(DrawOptions):
    """Pymunk's drawing, but for walls: the arena's, very large, are left out, and others as thick at any slope."""

    def draw_fat_segment(
        self,
        a: tuple[float, float],
        b: tuple[float, float],
        radius: float,
        outline_color: SpaceDebugColor,
        fill_color: SpaceDebugColor,
    ) -> None:
        size = self.surface.get_size()
        for axis in (0, 1):
            if max(a[axis], b[axis]) + radius <= 0 or min(a[axis], b[axis]) - radius >= size[axis]:
                return
        capsule(self.surface, fill_color.as_int(), a, b, radius)


def draw_space(surface: pygame.Surface, space: pymunk.Space, scale: float) -> None:
    """Draw a space on a surface. scale: px of the surface for one px of the space."""
    options = _TrueWalls(surface)
    options.transform = pymunk.Transform.scaling(scale)
    space.debug_draw(options)


def paint(space: pymunk.Space, colours: tuple[str, ...]) -> None:
    """Give the circles of a space, in order, colours that debug-draw shows them in."""
    circles = (shape for shape in space.shapes if isinstance(shape, pymunk.Circle))
    for circle, colour in zip(circles, colours, strict=True):
        circle.color = (*rgb(colour), 255)
