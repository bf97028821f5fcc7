"""Markers that tell engines apart without their colours."""

import pygame
from pygame import Color, Surface


def draw_marker(surface: Surface, colour: Color, at: tuple[int, int], size: int, shape: int) -> None:
    """Draw a marker: a disc, a diamond, a square or a triangle, which is distinguishable without its colour.

    size: half its width, px; shape: the number of the engine.
    """
    x, y = at
    corners = (
        (),
        ((0, -1.2), (1.2, 0), (0, 1.2), (-1.2, 0)),
        ((-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)),
        ((0, -1.2), (1.1, 0.8), (-1.1, 0.8)),
    )[shape % 4]
    if corners:
        pygame.draw.polygon(surface, colour, [(x + size * across, y + size * down) for across, down in corners])
    else:
        pygame.draw.circle(surface, colour, at, size)
