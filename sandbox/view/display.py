"""The screen that a window is on: whether there is one, and windows that are opened there."""

import os
import sys

import pygame
from pygame import Surface

from sandbox.scene.model import Scene
from sandbox.signals import signals_deferred
from sandbox.view.layout import natural_size


def has_display() -> bool:
    """Return whether a window can be seen here. Without a screen SDL picks a driver that shows nothing."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    try:
        pygame.display.init()
    except pygame.error:
        return False
    return pygame.display.get_driver() not in ("offscreen", "dummy")


def open_window(title: str) -> Surface:
    """Open a window in its natural size."""
    pygame.display.init()
    pygame.display.set_caption(title)  # before the window is there, or it would open as "pygame window"
    return set_mode(natural_size(pygame.display.get_desktop_sizes()[0]))


def set_mode(size: tuple[int, int], flags: int = pygame.RESIZABLE) -> Surface:
    """Open a window in some size (px), or change the one that is open."""
    with signals_deferred():  # set_mode discards exceptions
        return pygame.display.set_mode(size, flags)


def caption(scene: Scene) -> str:
    """Return the title of a scene's window."""
    return f"{scene.title or scene.name} - sandbox"
