"""The screen of a window, events that wait while engines run again, and what stops that run."""

import os
import sys
from collections.abc import Callable
from typing import Final

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
    """Open a window in its natural size, in which keys that are held are pressed again and again."""
    pygame.display.init()
    pygame.key.set_repeat(*REPEAT)
    pygame.display.set_caption(title)  # before the window is there, or it would open as "pygame window"
    return pygame.display.set_mode(natural_size(pygame.display.get_desktop_sizes()[0]), pygame.RESIZABLE)


def caption(scene: Scene) -> str:
    """Return the title of a scene's window."""
    return f"{scene.title or scene.name} - sandbox"


REPEAT: Final = 400, 33  # ms, until a key that is held is pressed again, and from then on
PRESSES: Final = (pygame.KEYDOWN, pygame.TEXTINPUT, pygame.MOUSEBUTTONDOWN, pygame.MOUSEWHEEL)


class Stopped(Exception):
    """The user stopped engines that ran again, so what was asked for is not done."""


class PendingEvents:
    """Events in the order of their arrival; of moves of the mouse in a row, the last, and of a held key's presses.

    get: returns the new events.
    """

    def __init__(self, get: Callable[[], list[Event]] = pygame.event.get) -> None:
        self._get = get
        self._waiting: list[Event] = []

    def take(self) -> list[Event]:
        """Return all events, to be handled now."""
        self._collect()
        events, self._waiting = self._waiting, []
        return events

    def check(self) -> None:
        """Raise Stopped if the window is being closed, or at Esc, which also discards the presses before it."""
        self._collect()
        events, escape = self._waiting, (pygame.KEYDOWN, pygame.K_ESCAPE)
        after = max((k + 1 for k, e in enumerate(events) if (e.type, getattr(e, "key", None)) == escape), default=0)
        self._waiting = [event for k, event in enumerate(events) if k >= after or event.type not in PRESSES]
        if after or any(event.type == pygame.QUIT for event in self._waiting):
            raise Stopped

    def _collect(self) -> None:
        for event in self._get():
            if self._waiting and _replaces(event, self._waiting[-1]):
                self._waiting[-1] = event
            else:
                self._waiting.append(event)


def _replaces(event: Event, before: Event) -> bool:
    """Return whether an event goes on with the one before it: the mouse moves, or a key is still held."""
    if event.type != before.type or event.type not in (pygame.MOUSEMOTION, pygame.KEYDOWN):
        return False
    is_move = event.type == pygame.MOUSEMOTION
    return bool(event.buttons == before.buttons if is_move else event.key == before.key)
