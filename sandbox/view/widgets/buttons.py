"""Buttons."""

from collections.abc import Callable
from dataclasses import dataclass

import pygame
from pygame import Color, Rect, Surface

from sandbox.view.primitives import fitting, text_width, write
from sandbox.view.theme import readable, theme
from sandbox.view.widgets import Pressable, draw_ground


@dataclass(eq=False)
class TextButton(Pressable):
    """Does something. is_on: whether what it turns on is on; refusal: why it cannot be pressed, or nothing.

    colour: of a mark before the text, such as an engine's in the charts, or in place of one.
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

    def natural_width(self, text_height: int) -> int:
        """Return the width of its text with room round it, px."""
        text = text_width(self.widest or self.label, text_height)
        return max(text + round(1.5 * text_height), 2 * text_height) + (text_height if self.colour else 0)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text in the middle, smaller if need be; on the accent while on, grey if it is refused."""
        on, text = self.is_on(), self.label
        ink = theme.on_accent if on else theme.ink
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
        refused = readable(theme.line, theme.raised)
        write(surface, text, line, refused if self.refusal() else ink, height)
