"""Buttons, and those that open a list to choose from."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import pygame
from pygame import Color, Rect, Surface
from pygame.event import Event

from sandbox.view.primitives import fitting, panel, text_width, write
from sandbox.view.theme import readable, theme
from sandbox.view.widgets import ENTER, Pressable, draw_ground

ITEM_HEIGHT: Final = 1.7  # in a list, in heights of the text


@dataclass(eq=False)
class TextButton(Pressable):
    """Does something. is_on: whether what it turns on is on; refusal: why it cannot be pressed, or nothing.

    colour: of a mark before the text, such as an engine's in the charts, or in place of one. flat: it has no ground,
    and a line below it while it is on, as a page's name.
    """

    text: str
    do: Callable[[], object]
    does: str = ""
    is_on: Callable[[], bool] = bool
    refusal: Callable[[], str] = str
    colour: Color | None = None
    width: float = 5.0
    said: Callable[[], str] | None = None
    widest: str = ""
    flat: bool = False

    def natural_width(self, text_height: int) -> int:
        """Return the width of its text with room round it, px."""
        text = text_width(self.widest or self.label, text_height)
        return max(text + round(1.5 * text_height), 2 * text_height) + (text_height if self.colour else 0)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text in the middle, smaller if need be; on the accent while on, grey if it is refused."""
        on, text = self.is_on(), self.label
        ink = theme.on_accent if on else theme.ink
        if self.flat:
            ink = theme.ink if on or hot else theme.dim
            if on or hot:
                surface.fill(theme.accent if on else theme.line, (place.x + 3, place.bottom - 2, place.width - 6, 2))
        else:
            draw_ground(surface, place, theme.accent if on else theme.raised, text_height, hot=hot)
        bold = self.flat and on
        mark = text_height if self.colour else 0
        width, room = text_width(text, text_height, bold=bold), place.width - text_height // 2 - mark
        height = fitting(width, room, text_height)
        pad = max(text_height // 4, (place.width - text_width(text, height, bold=bold) - mark) // 2)
        line = Rect(place.x + pad, place.y, place.width - pad, place.height)
        if self.colour:
            swatch = Rect(0, 0, 2 * text_height // 3, 2 * text_height // 3)
            swatch.center = (line.x + text_height // 3, line.centery) if text else place.center
            if on:
                pygame.draw.rect(surface, theme.on_accent, swatch.inflate(4, 4), border_radius=3)
            pygame.draw.rect(surface, self.colour, swatch, border_radius=2)
            line = Rect(line.x + mark, line.y, line.width - mark, line.height)
        refused = readable(theme.line, theme.raised)
        write(surface, text, line, refused if self.refusal() else ink, height, bold=bold)


@dataclass(eq=False)
class Menu(Pressable):
    """Shows what is chosen; a press opens the list. at: the item that the mouse or the keyboard is on, while open."""

    said: Callable[[], str]
    items: Callable[[], Sequence[TextButton]]
    does: str = ""
    is_on: Callable[[], bool] = bool
    widest: str = ""
    at: int | None = None

    text = ""

    @property
    def tip(self) -> str:
        """What it is for; nothing while it is open."""
        return "" if self.is_open else self.does

    @property
    def is_open(self) -> bool:
        """Whether the list is open."""
        return self.at is not None

    def natural_width(self, text_height: int) -> int:
        """Return the width of its text with room round it, px."""
        return text_width(self.widest or self.said(), text_height) + round(2.5 * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text, smaller if need be, and a triangle that points down."""
        on = self.is_on()
        draw_ground(surface, place, theme.accent if on else theme.raised, text_height, hot=hot or self.is_open)
        ink = theme.on_accent if on else theme.ink
        line = Rect(place.x + round(0.7 * text_height), place.y, place.width - round(2.1 * text_height), place.height)
        height = fitting(text_width(self.said(), text_height), line.width, text_height)
        write(surface, self.said(), line, ink, height)
        x, y, wing = place.right - round(0.9 * text_height), place.centery, text_height / 4
        pygame.draw.polygon(surface, ink, [(x - wing, y - wing / 2), (x + wing, y - wing / 2), (x, y + wing / 2)])

    def act(self) -> None:
        """Open the list, or close it."""
        chosen = (number for number, item in enumerate(self.items()) if item.is_on())
        self.at = None if self.is_open else next(chosen, 0)

    # While the list is open

    def list_place(self, place: Rect, text_height: int, within: Rect) -> Rect:
        """Return where the list is: above or below the button, inside a place."""
        items = self.items()
        names = max(text_width(item.text, text_height) for item in items)
        does = max(text_width(item.does, text_height) for item in items)
        width = names + (does + text_height if does else 0) + 2 * text_height
        height = round(len(items) * ITEM_HEIGHT * text_height) + text_height // 2
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
        return min(max(int((y - where.y - text_height / 4) / (ITEM_HEIGHT * text_height)), 0), count - 1)

    def draw_list(self, surface: Surface, place: Rect, text_height: int) -> None:
        """Draw the list."""
        items, where = self.items(), self.list_place(place, text_height, surface.get_rect())
        panel(surface, where)
        names = max(text_width(item.text, text_height) for item in items)
        for number, item in enumerate(items):
            top = where.y + text_height // 4 + round(number * ITEM_HEIGHT * text_height)
            line = Rect(where.x + 2, top, where.width - 4, round(ITEM_HEIGHT * text_height))
            ink, dim = theme.ink, theme.dim
            if number == self.at:
                ink = dim = theme.on_accent
                surface.fill(theme.accent, line)
            line.x += text_height - 2
            write(surface, item.text, line, ink, text_height, bold=item.is_on())
            line.x += names + text_height
            write(surface, item.does, line, dim, text_height)
