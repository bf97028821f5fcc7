"""The window, pictures of what it shows, and the layers of both. Only this package imports pygame."""

import math
import os
from contextlib import suppress
from enum import StrEnum
from importlib.metadata import PackageNotFoundError, version
from typing import Final

from sandbox.errors import SandboxError

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
os.environ.setdefault("SDL_VIDEO_X11_WMCLASS", "sandbox")  # the name by which a window manager knows the window
os.environ.setdefault("SDL_WINDOWS_DPI_AWARENESS", "permonitorv2")  # or Windows enlarges the window's pixels

REPAIR: Final = "to repair that: pip uninstall -y pygame pygame-ce, and then pip install one of the two"


def check_pygame() -> str | None:
    """Return a warning if both pygame and pygame-ce are installed: they share a folder, and the later overwrites.

    Raises SandboxError if neither can be imported, as after one of two was removed.
    """
    installed = []
    for name in ("pygame", "pygame-ce"):
        with suppress(PackageNotFoundError):
            installed.append(f"{name} {version(name)}")
    try:
        from pygame import display, ver  # noqa: F401, PLC0415 (a window is not always opened)
    except ImportError as error:
        raise SandboxError(f"pygame cannot be used: {error}; {REPAIR}") from None
    if len(installed) < 2:
        return None
    return f"warning: {' and '.join(installed)} are both installed, in one folder, where {ver} is complete; {REPAIR}"


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
