"""Keys that are held: what they do is repeated."""

from typing import Final

import pygame
from pygame.event import Event

DELAY: Final = 0.4  # s, until a key that is held is pressed again
INTERVAL: Final = 1 / 30  # s, from then on; at most once a frame, so that a slow machine does not lag behind the key


class KeyRepeat:
    """The key that is held.

    pygame's own repeats are not distinguishable from presses, and would pile up while a frame takes long.
    """

    def __init__(self) -> None:
        self.held: Event | None = None  # how it was pressed
        self._wait = 0.0  # s, until it is repeated

    def press(self, event: Event, *, repeats: bool) -> None:
        """Note that a key goes down."""
        self.held, self._wait = (event, DELAY) if repeats else (None, 0.0)

    def track(self, event: Event) -> None:
        """Note that a key goes up, or may have."""
        if event.type in (pygame.KEYUP, pygame.WINDOWFOCUSLOST):
            self.held = None

    def due(self, seconds: float) -> Event | None:
        """Return the press to repeat after some seconds, if it is time."""
        if self.held is None:
            return None
        self._wait -= seconds
        if self._wait > 0:
            return None
        self._wait = INTERVAL
        return self.held
