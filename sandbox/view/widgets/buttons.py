"""Buttons, and those that open a list to choose from."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import pygame
from pygame import Color, Rect, Surface
from pygame.event import Event

from sandbox.view.primitives import fitting, panel, text_width, wrapped, write
from sandbox.view.theme import readable, theme
from sandbox.view.widgets import ENTER, Pressable, draw_ground

ITEM_HEIGHT: Final = 1.7  # in a list, in heights of the text


@dataclass(eq=False)
class TextButton(Pressable):
    """Does something. is_on: whether what it turns on is on; refusal: why it cannot be pressed, or nothing.

    text: may change, then it is a function. colour: of a mark before the text, such as an engine's in the charts.
    widest: the longest text that it will have, so that a button whose text changes does not move the others.
    """

    text: str
    do: Callable[[], None]
    does: str = ""
    is_on: Callable[[], bool] = bool
    refusal: Callable[[], str] = str
    colour: Color | None = None
    width: float = 5.0
    said: Callable[[], str] | None = None
    widest: str = ""

    @property
    def label(self) -> str:
        """The text at present."""
        return self.said() if self.said else self.text

    @property
    def look(self) -> object:
        """The text, and how it stands."""
        return self.label, self.is_on(), self.refusal()

    def natural_width(self, text_height: int) -> int:
        """Return the width of its text with room round it, px."""
        text = text_width(self.widest or self.label, text_height)
        return max(text + round(1.5 * text_height), 2 * text_height) + (text_height if self.colour else 0)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text in the middle, smaller if need be; on the accent while on, grey if it is refused."""
        on = self.is_on()
        draw_ground(surface, place, theme.accent if on else theme.raised, text_height, hot=hot)
        mark = text_height if self.colour else 0
        room = place.width - text_height // 2 - mark
        height = fitting(text_width(self.label, text_height), room, text_height)
        pad = max(text_height // 4, (place.width - text_width(self.label, height) - mark) // 2)
        line = Rect(place.x + pad, place.y, place.width - pad, place.height)
        if self.colour:
            swatch = Rect(line.x, line.centery - text_height // 3, 2 * text_height // 3, 2 * text_height // 3)
            if on:
                pygame.draw.rect(surface, theme.on_accent, swatch.inflate(4, 4), border_radius=3)
            pygame.draw.rect(surface, self.colour, swatch, border_radius=2)
            line = Rect(line.x + mark, line.y, line.width - mark, line.height)
        ink = theme.on_accent if on else theme.ink
        write(surface, self.label, line, readable(theme.line, theme.raised) if self.refusal() else ink, height)


@dataclass(eq=False)
class Tab(Pressable):
    """A name over a line if its page is open."""

    text: str
    do: Callable[[], None]
    is_on: Callable[[], bool]
    does: str = ""

    @property
    def look(self) -> object:
        """The name, and whether its page is open."""
        return self.text, self.is_on()

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the name, with the accent below it while its page is open."""
        on = self.is_on()
        width = text_width(self.text, text_height, bold=on)
        height = fitting(width, place.width - 2, text_height)
        line = place.copy()
        line.x += max(0, (place.width - text_width(self.text, height, bold=on)) // 2)
        write(surface, self.text, line, theme.ink if on or hot else theme.dim, height, bold=on)
        if on or hot:
            surface.fill(theme.accent if on else theme.line, (place.x + 3, place.bottom - 2, place.width - 6, 2))


@dataclass(eq=False)
class Swatch(Pressable):
    """Shows a colour; a press chooses it. is_on: whether it is the chosen one."""

    colour: str
    do: Callable[[], None]
    is_on: Callable[[], bool]
    refusal: Callable[[], str] = str

    @property
    def tip(self) -> str:
        """The colour's name, or why it cannot be chosen."""
        return self.refusal() or self.colour

    @property
    def look(self) -> object:
        """The colour, and whether it is chosen."""
        return self.colour, self.is_on()

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the colour; with a frame if it is chosen."""
        draw_ground(surface, place, theme.ink if self.is_on() else theme.raised, text_height, hot=hot)
        edge = max(2, text_height // 5)
        surface.fill(Color(self.colour), place.inflate(-2 * edge, -2 * edge))


@dataclass(eq=False)
class Heading(Pressable):
    """A text of as many lines as it needs; a press folds or unfolds what is below it. colour, ground: of the sample."""

    text: str
    colour: Color
    ground: Color
    do: Callable[[], None]
    does: str = ""
    is_open: bool = False

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its lines, px."""
        return round(0.45 * text_height) + len(self._lines(width, text_height)) * round(1.3 * text_height)

    def _lines(self, width: int, text_height: int) -> tuple[str, ...]:
        return wrapped(self.text, width - 5 * text_height, text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the sample, the text, and a triangle that points down if it is unfolded."""
        draw_ground(surface, place, theme.raised, text_height, hot=hot)
        step, pad = round(1.3 * text_height), text_height // 2
        line = Rect(place.x + pad, place.y + (place.height % step) // 2, place.width - 3 * pad, step)
        sample = Rect(line.x, line.centery - text_height // 2, 2 * text_height, text_height)
        surface.fill(self.ground, sample)
        thick = max(3, text_height // 4)
        surface.fill(self.colour, (sample.x, sample.centery - thick // 2, sample.width, thick))
        line.x += 2 * text_height + pad
        line.width = place.right - 3 * pad - line.x
        for text in self._lines(place.width, text_height):
            write(surface, text, line, theme.ink, text_height)
            line.y += step
        tips = [(-1, -0.5), (1, -0.5), (0, 0.7)] if self.is_open else [(-0.5, -1), (-0.5, 1), (0.7, 0)]
        x, y, half = place.right - 2 * pad, place.centery, text_height // 4
        pygame.draw.polygon(surface, theme.dim, [(x + half * across, y + half * down) for across, down in tips])


@dataclass(eq=False)
class Menu(Pressable):
    """Shows what is chosen; a press opens the list. at: the item that the mouse or the keyboard is on, while open."""

    said: Callable[[], str]
    items: Callable[[], Sequence[TextButton]]
    does: str = ""
    is_on: Callable[[], bool] = bool
    widest: str = ""
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
