"""A value to read, and to type."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.palette import FAINT, INK, RAISED
from sandbox.view.primitives import text_width, write
from sandbox.view.widgets.widget import ENTER, Widget, draw_ground

MAX_TYPED: Final = 200  # characters


@dataclass(eq=False)
class Field(Widget):
    """Shows a value by its name; once pressed, or with the keyboard on it, it is typed into.

    Enter or Tab chooses what was typed; Esc, or going elsewhere, leaves the value as it was. refusal: why it cannot be
    typed into, or nothing.
    """

    name: str
    value: Callable[[], str]
    choose: Callable[[str], None]
    does: str = ""
    unit: str = ""
    refusal: Callable[[], str] = str
    width: float = 5.0
    typed: str | None = None

    takes_text = True

    @property
    def tip(self) -> str:
        """What it sets, or why it cannot."""
        return self.refusal() or self.does

    @property
    def look(self) -> object:
        """The value, and what is typed."""
        return self.name, self.value(), self.typed, self.refusal()

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw name, value and unit; what is typed has a cursor behind it."""
        draw_ground(surface, place, RAISED, text_height, hot=hot)
        line = place.inflate(-text_height, 0)
        end = write(surface, self.name, line, FAINT, text_height)
        text = f"{self.value()} {self.unit}".rstrip() if self.typed is None else self.typed
        x = max(end + text_height // 2, line.right - text_width(text, text_height))
        ink = FAINT if self.refusal() else INK
        right = write(surface, text, Rect(x, line.y, line.right - x, line.height), ink, text_height)
        if self.typed is not None:
            surface.fill(INK, (min(right + 1, line.right), place.y + 4, max(1, text_height // 10), place.height - 8))

    def key(self, event: Event) -> bool:
        """Type a character, or choose what was typed."""
        if self.refusal() or event.mod & (pygame.KMOD_CTRL | pygame.KMOD_ALT | pygame.KMOD_META):
            return False
        if event.key in ENTER or event.key == pygame.K_TAB:
            typed, self.typed = self.typed, None
            if typed is not None:
                self.choose(typed)
            return event.key in ENTER
        if event.key == pygame.K_ESCAPE:
            was_typing, self.typed = self.typed is not None, None
            return was_typing
        if event.key == pygame.K_BACKSPACE:
            self.typed = self.value()[:-1] if self.typed is None else self.typed[:-1]
            return True
        if event.unicode and event.unicode.isprintable():
            self.typed = ((self.typed or "") + event.unicode)[:MAX_TYPED]
            return True
        return False

    def leave(self) -> None:
        """Forget what was typed."""
        self.typed = None
