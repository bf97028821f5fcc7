"""The window, pictures of what it shows, and the layers of both.

Beside this package, only `bench.window` and `scripting.program` import pygame.
"""

import os
from enum import StrEnum

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
os.environ.setdefault("SDL_VIDEO_X11_WMCLASS", "sandbox")  # the name by which a window manager knows the window
os.environ.setdefault("SDL_WINDOWS_DPI_AWARENESS", "permonitorv2")  # or Windows enlarges the window's pixels


class Layer(StrEnum):
    """Something that can be shown of a run in addition to its balls and walls."""

    VELOCITY = "velocity"
    TRAILS = "trails"
    NUMBERS = "numbers"
    GHOSTS = "ghosts"
    CHARTS = "charts"
