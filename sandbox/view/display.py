"""The screen of a window, and its events."""

import os
import sys

import pygame
from pygame import Surface
from pygame.event import Event

from sandbox.scene.model import Scene
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
    return pygame.display.set_mode(natural_size(pygame.display.get_desktop_sizes()[0]), pygame.RESIZABLE)


def caption(scene: Scene) -> str:
    """Return the title of a scene's window."""
    return f"{scene.title or scene.name} - sandbox"


def new_events() -> list[Event]:
    """Return the events since the last call; of moves of the mouse in a row, only the last."""
    events = list[Event]()
    for event in pygame.event.get():
        before = events[-1] if events else event
        if event.type == before.type == pygame.MOUSEMOTION and event.buttons == before.buttons:
            events = events[:-1]
        events.append(event)
    return events
