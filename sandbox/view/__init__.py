"""The window, and pictures of what it shows. Only this package imports pygame."""

import os
from contextlib import suppress
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
