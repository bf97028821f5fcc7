"""What everything in the window is drawn with: text, smooth discs, colours."""

import math
from collections.abc import Sequence
from functools import lru_cache

import pygame
from pygame import Color, Rect, Surface

from sandbox.scene import rgb

FRAME = Color("#22262b")  # round the panes
INK = Color("#e8eaed")
FAINT = Color("#9aa0a6")
SMOOTH = 4  # a disc is drawn this many times as large and scaled down, which smooths its edge


@lru_cache(maxsize=64)
def font(height: int) -> pygame.font.Font:
    """Return pygame's own font, the same on every machine, in a height in px."""
    pygame.font.init()
    return pygame.font.Font(None, round(1.4 * height))


def write(surface: Surface, text: str, place: Rect, colour: Color, height: int) -> int:
    """Write a line of text in the middle of a place's height, cut at its right edge; return where it ends."""
    line = font(height).render(text, True, colour)
    surface.blit(line, (place.x, place.centery - line.get_height() // 2), (0, 0, place.width, place.height))
    return place.x + min(line.get_width(), place.width)


@lru_cache(maxsize=1024)
def disc(radius: float, colour: str) -> Surface:
    """Draw a smooth disc on a clear surface of its size. radius: px of the screen."""
    side = 2 * max(1, round(radius)) + 2
    large = Surface((SMOOTH * side, SMOOTH * side), pygame.SRCALPHA)
    centre = SMOOTH * side / 2
    pygame.draw.circle(large, rgb(colour), (centre, centre), SMOOTH * max(radius, 1.0))
    return pygame.transform.smoothscale(large, (side, side))


def capsule(
    surface: Surface, colour: Color | tuple[int, ...], a: Sequence[float], b: Sequence[float], radius: float
) -> None:
    """Draw a segment with round ends. a, b, radius: px of the surface."""
    radius = max(radius, 0.5)
    distance = math.dist(a, b) or 1.0
    across_x, across_y = (a[1] - b[1]) / distance * radius, (b[0] - a[0]) / distance * radius
    sides = [(x + sign * across_x, y + sign * across_y) for (x, y), sign in ((a, 1), (b, 1), (b, -1), (a, -1))]
    pygame.draw.polygon(surface, colour, sides)
    for end in (a, b):
        pygame.draw.circle(surface, colour, end, radius)


def contrast(background: str) -> Color:
    """Choose black or white, whichever is seen on a background."""
    red, green, blue = rgb(background)
    return Color("black") if 0.299 * red + 0.587 * green + 0.114 * blue > 128 else Color("white")
