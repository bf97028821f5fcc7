"""A button that opens a list to choose from."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.primitives import panel, text_width, write
from sandbox.view.theme import theme
from sandbox.view.widgets.widget import ENTER, Pressable, draw_ground

LINE: Final = 1.7  # height of an item, in heights of the text


@dataclass(frozen=True)
class Item:
    """Something to choose. does: a few words on it; is_on: whether it is chosen at present."""

    text: str
    do: Callable[[], None]
    does: str = ""
    is_on: Callable[[], bool] = bool


@dataclass(eq=False)
class Menu(Pressable):
    """Shows what is chosen; a press opens the list. at: the item that the mouse or the keyboard is on, while open."""

    said: Callable[[], str]
    does: str
    items: Callable[[], Sequence[Item]]
    is_on: Callable[[], bool] = bool
    widest: str = ""
    width: float = 5.0
    at: int | None = None

    @property
    def tip(self) -> str:
        """What it is for; nothing while it is open."""
        return "" if self.is_open else self.does

    @property
    def is_open(self) -> bool:
        """Whether the list is open."""
        return self.at is not None

    @property
    def look(self) -> object:
        """The text, and how it stands."""
        return self.said(), self.is_on(), self.is_open

    def natural_width(self, text_height: int) -> int:
        """Return the width of its text with room round it, px."""
        return text_width(self.widest or self.said(), text_height) + round(2.5 * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text, and a triangle that points down."""
        on = self.is_on()
        draw_ground(surface, place, theme.accent if on else theme.raised, text_height, hot=hot or self.is_open)
        ink = theme.on_accent if on else theme.ink
        line = Rect(place.x + round(0.7 * text_height), place.y, place.width - text_height, place.height)
        write(surface, self.said(), line, ink, text_height)
        x, y, wing = place.right - round(0.9 * text_height), place.centery, text_height / 4
        pygame.draw.polygon(surface, ink, [(x - wing, y - wing / 2), (x + wing, y - wing / 2), (x, y + wing / 2)])

    def act(self) -> None:
        """Open the list, or close it."""
        self.at = None if self.is_open else self._chosen

    @property
    def _chosen(self) -> int:
        return next((number for number, item in enumerate(self.items()) if item.is_on()), 0)

    # While the list is open

    def list_place(self, place: Rect, text_height: int, within: Rect) -> Rect:
        """Return where the list is: above or below the button, inside a place."""
        items = self.items()
        names = max(text_width(item.text, text_height) for item in items)
        does = max(text_width(item.does, text_height) for item in items)
        width = names + (does + text_height if does else 0) + 2 * text_height
        height = round(len(items) * LINE * text_height) + text_height // 2
        below = place.bottom + height <= within.bottom
        return Rect(place.x, place.bottom if below else place.y - height, max(width, place.width), height).clamp(within)

    def on_event(self, event: Event, place: Rect, text_height: int, within: Rect) -> bool:
        """Handle an event while the list is open. Return whether the list uses it."""
        items, where = self.items(), self.list_place(place, text_height, within)
        at = min(self.at or 0, len(items) - 1)
        if event.type == pygame.KEYDOWN:
            if event.key in (pygame.K_UP, pygame.K_DOWN):
                self.at = (at + (1 if event.key == pygame.K_DOWN else -1)) % len(items)
            else:
                self.at = None
                if event.key in ENTER:
                    items[at].do()
            return event.key in (pygame.K_UP, pygame.K_DOWN, pygame.K_ESCAPE, *ENTER)
        if event.type == pygame.MOUSEMOTION and where.collidepoint(event.pos):
            self.at = self._item_at(event.pos[1], where, text_height, len(items))
            return True
        if event.type == pygame.MOUSEBUTTONDOWN:
            self.at = None
            if where.collidepoint(event.pos):
                items[self._item_at(event.pos[1], where, text_height, len(items))].do()
                return True
            return bool(place.collidepoint(event.pos))
        return False

    @staticmethod
    def _item_at(y: int, where: Rect, text_height: int, count: int) -> int:
        return min(max(int((y - where.y - text_height / 4) / (LINE * text_height)), 0), count - 1)

    def draw_list(self, surface: Surface, place: Rect, text_height: int) -> None:
        """Draw the list."""
        items, where = self.items(), self.list_place(place, text_height, surface.get_rect())
        panel(surface, where)
        names = max(text_width(item.text, text_height) for item in items)
        for number, item in enumerate(items):
            line = Rect(
                where.x + 2, where.y + text_height // 4 + round(number * LINE * text_height), where.width - 4, 0
            )
            line.height = round(LINE * text_height)
            ink, dim = (theme.on_accent, theme.on_accent) if number == self.at else (theme.ink, theme.dim)
            if number == self.at:
                surface.fill(theme.accent, line)
            line.x += text_height - 2
            write(surface, item.text, line, ink, text_height, bold=item.is_on())
            line.x += names + text_height
            write(surface, item.does, line, dim, text_height)
