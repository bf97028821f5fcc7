"""What the rows and the column are made of: what every widget can do; texts and buttons; a file for other kinds."""

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field
from typing import Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.view.primitives import dot, first_lines, fitting, text_width, wrapped, write
from sandbox.view.theme import readable, theme

ENTER: Final = (pygame.K_RETURN, pygame.K_KP_ENTER)


class Widget:
    """Something that shows a state and can be pressed. It is given its place at each call, since windows change.

    width: in a row of the side panel, relative to its neighbours. follows_mouse: it is pressed again at each move of
    the mouse that holds it. does: what it is for. refusal: why it cannot be used now, or nothing. seen_in: the part of
    the window outside of which it is scrolled out of sight; None if it never is.
    """

    width: float = 5.0
    follows_mouse = False
    does: str = ""
    refusal: Callable[[], str] = str
    seen_in: Rect | None = None

    @property
    def tip(self) -> str:
        """The text beside it while the mouse is on it."""
        return self.refusal() or self.does

    def natural_width(self, text_height: int) -> int:
        """Return the width that it has in a row of the window, px."""
        raise NotImplementedError

    def height(self, width: int, text_height: int) -> int:
        """Return the height that it needs in the side panel, px. width, text_height: px."""
        return round(1.85 * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw it. hot: the mouse is on it, or it is typed into."""
        raise NotImplementedError

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Handle the mouse going down on it, or moving since then, at a point of the window."""

    def release(self) -> None:
        """Handle the mouse button going up."""


@dataclass(eq=False)
class Label(Widget):
    """What shows a text. said: returns the text, if it changes.

    widest: the longest text that it will have in a row of the window, so that it does not move its neighbours.
    """

    text: str
    _: KW_ONLY
    colour: Color | None = None
    width: float = 5.0
    said: Callable[[], str] | None = None
    widest: str = ""

    @property
    def label(self) -> str:
        """The text at present."""
        return self.said() if self.said else self.text


def draw_ground(surface: Surface, place: Rect, colour: Color, text_height: int, *, hot: bool) -> None:
    """Draw what a widget stands on, with a stronger edge while it is hot."""
    radius = round(0.4 * text_height)
    pygame.draw.rect(surface, theme.hover if hot and colour == theme.raised else colour, place, border_radius=radius)
    edge = theme.accent if hot else theme.line
    pygame.draw.rect(surface, edge, place, max(1, text_height // 12), border_radius=radius)


@dataclass(eq=False)
class Words(Label):
    """A text: in the column of as many lines as it needs, in a row of the window one line.

    colour: by default, that of all text. scale: of the text. dots: colours of the balls or the engine that it is about.
    """

    _: KW_ONLY
    does: str = ""
    bold: bool = False
    scale: float = 1.0
    dots: tuple[Color, ...] = ()

    def natural_width(self, text_height: int) -> int:
        """Return the width of its text, px."""
        height = round(self.scale * text_height)
        return text_width(self.widest or self.label, height, bold=self.bold) + text_height + 2

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its lines, px."""
        room = width - (1 + len(self.dots)) * text_height
        lines = wrapped(self.label, room, round(self.scale * text_height), bold=self.bold)
        return len(lines) * self._step(text_height) + text_height // 3

    def _step(self, text_height: int) -> int:
        return round(1.35 * self.scale * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw those lines that have room, in the middle of its height."""
        height, step, gap = round(self.scale * text_height), self._step(text_height), text_height // 2
        line = Rect(place.x + gap, place.y, max(1, place.width - 2 * gap), step)
        lefts = [line.x + k * text_height for k in range(len(self.dots))]
        line.x, line.width = line.x + len(lefts) * text_height, max(1, line.width - len(lefts) * text_height)
        lines = first_lines(self.label, line.width, height, max(1, place.height // step), bold=self.bold)
        line.y += (place.height - step * len(lines)) // 2
        for left, colour in zip(lefts, self.dots, strict=True):
            dot(surface, colour, theme.dim, (left + text_height // 3, line.centery), text_height // 3)
        for text in lines:
            write(surface, text, line, self.colour or theme.ink, height, bold=self.bold)
            line.y += step


@dataclass(eq=False)
class TextButton(Label):
    """A button. is_on: whether what it turns on is on. colour: of a mark before the text, such as an engine's."""

    do: Callable[[], object]
    does: str = ""
    is_on: Callable[[], bool] = bool
    refusal: Callable[[], str] = field(default=str, kw_only=True)

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Do what it is for, unless that is refused."""
        if not self.refusal():
            self.do()

    def natural_width(self, text_height: int) -> int:
        """Return the width of its text with room round it, px."""
        text = text_width(self.widest or self.label, text_height)
        return max(text + round(1.5 * text_height), 2 * text_height) + (text_height if self.colour else 0)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text in the middle, smaller if need be; on the accent while on, grey if it is refused."""
        on, text = self.is_on(), self.label
        ink = readable(theme.line, theme.raised) if self.refusal() else theme.on_accent if on else theme.ink
        draw_ground(surface, place, theme.accent if on else theme.raised, text_height, hot=hot)
        mark = text_height if self.colour else 0
        width, room = text_width(text, text_height), place.width - text_height // 2 - mark
        height = fitting(width, room, text_height)
        pad = max(text_height // 4, (place.width - text_width(text, height) - mark) // 2)
        line = Rect(place.x + pad, place.y, place.width - pad, place.height)
        if self.colour:
            swatch = Rect(0, 0, 2 * text_height // 3, 2 * text_height // 3)
            swatch.center = (line.x + text_height // 3, line.centery) if text else place.center
            if on:
                pygame.draw.rect(surface, theme.on_accent, swatch.inflate(4, 4), border_radius=3)
            pygame.draw.rect(surface, self.colour, swatch, border_radius=2)
            line = Rect(line.x + mark, line.y, line.width - mark, line.height)
        write(surface, text, line, ink, height)


@dataclass(eq=False)
class Bar(Widget):
    """A name and a value over a bar from the middle: to the right for what is gained, to the left for what is lost.

    share: length and sign of the bar, -1 to 1 of half of the width.
    """

    name: str
    value: str
    share: float
    colour: Color

    def height(self, width: int, text_height: int) -> int:
        """Return the height of a line of text and a bar, px."""
        return round(1.3 * text_height) + max(4, text_height // 2)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text over the bar."""
        thick = max(3, text_height // 3)
        line = Rect(place.x + text_height // 2, place.y, place.width - text_height, place.height - thick - 1)
        name, value = line.copy(), line.copy()
        value.width = text_width(self.value, text_height)
        name.width, value.right = line.width - value.width, line.right
        write(surface, self.name, name, theme.ink, text_height)
        write(surface, self.value, value, theme.ink, text_height)
        length = round(self.share * line.width / 2)
        bar = Rect(line.centerx + min(length, 0), line.bottom, max(1, abs(length)), thick)
        surface.fill(theme.dim, (line.x, bar.centery, line.width, 1))
        surface.fill(self.colour, bar)
