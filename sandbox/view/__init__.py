"""The window, pictures of what it shows, and the layers of both.

Beside this package, only `bench.window` and `scripting.program` import pygame.
"""

import math
import os
from enum import StrEnum
from typing import Final

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
os.environ.setdefault("SDL_VIDEO_X11_WMCLASS", "sandbox")  # the name by which a window manager knows the window
os.environ.setdefault("SDL_WINDOWS_DPI_AWARENESS", "permonitorv2")  # or Windows enlarges the window's pixels


class Layer(StrEnum):
    """Something that can be shown of a run in addition to its balls and walls."""

    VELOCITY = "velocity"
    TRAILS = "trails"
    CENTRE = "centre"
    NUMBERS = "numbers"
    GHOSTS = "ghosts"
    GRID = "grid"
    CHARTS = "charts"


MOST_BALLS: Final = {  # of a scene that opens with a layer; of more balls, outlines and numbers hide them
    Layer.CHARTS: math.inf,
    Layer.GHOSTS: 300,
    Layer.NUMBERS: 30,
}


def opens_with(balls: int) -> set[Layer]:
    """Return the layers that a scene of so many balls opens with."""
    return {layer for layer, most in MOST_BALLS.items() if balls <= most}
