"""The screen of a window, and its events."""

import os
import sys
from typing import Final

import pygame
from pygame import Surface
from pygame.event import Event

from sandbox.scene.model import Scene
from sandbox.view.layout import natural_size

REPEAT: Final = 400, 33  # ms, until a key that is held is pressed again, and from then on


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
    """Open a window in its natural size, in which keys that are held are pressed again and again."""
    pygame.display.init()
    pygame.key.set_repeat(*REPEAT)
    pygame.display.set_caption(title)  # before the window is there, or it would open as "pygame window"
    return pygame.display.set_mode(natural_size(pygame.display.get_desktop_sizes()[0]), pygame.RESIZABLE)


def caption(scene: Scene) -> str:
    """Return the title of a scene's window."""
    return f"{scene.title or scene.name} - sandbox"


def new_events() -> list[Event]:
    """Return the events since the last call; of moves of the mouse in a row, and of a held key's presses, the last."""
    events = list[Event]()
    for event in pygame.event.get():
        if events and _replaces(event, events[-1]):
            events.pop()
        events.append(event)
    return events


def _replaces(event: Event, before: Event) -> bool:
    """Return whether an event goes on with the one before it: the mouse moves, or a key is still held."""
    if event.type != before.type or event.type not in (pygame.MOUSEMOTION, pygame.KEYDOWN):
        return False
    is_move = event.type == pygame.MOUSEMOTION
    return bool(event.buttons == before.buttons if is_move else event.key == before.key)
