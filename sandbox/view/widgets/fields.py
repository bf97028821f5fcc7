"""Values that are typed, or dragged along a track."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.primitives import dot, fitting, text_width, write
from sandbox.view.theme import theme
from sandbox.view.widgets import ENTER, Widget, draw_ground

MAX_TYPED: Final = 200  # characters
THICKNESS: Final = 4  # px, of the track


@dataclass(eq=False)
class Field(Widget):
    """Shows a value by its name. A press begins typing, and `begin` is called; then keys are the field's.

    Enter or Tab chooses what was typed; Esc, or a press elsewhere, leaves the value as it was. typed: so far; None
    while nothing is being typed.
    """

    name: str
    value: Callable[[], str]
    choose: Callable[[str], None]
    does: str = ""
    unit: str = ""
    typed: str | None = None
    begin: Callable[[], None] | None = None

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw name, value and unit, smaller if need be; what is typed has a cursor behind it."""
        draw_ground(surface, place, theme.raised, text_height, hot=hot)
        line = place.inflate(-text_height, 0)
        text = self.typed or f"{self.value()} {self.unit}".rstrip()
        gap = text_height // 2
        width = text_width(self.name, text_height) + gap + text_width(text, text_height)
        height = fitting(width, line.width, text_height)
        end = write(surface, self.name, line, theme.dim, height)
        x = max(end + gap, line.right - text_width(text, height))
        ink = theme.dim if self.typed == "" else theme.ink
        right = write(surface, text, Rect(x, line.y, line.right - x, line.height), ink, height)
        if self.typed is not None:
            left = min(right + 1, line.right)
            surface.fill(theme.ink, (left, place.y + 4, max(1, text_height // 10), place.height - 8))

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Begin to type."""
        self.typed = ""
        if self.begin:
            self.begin()

    def key(self, event: Event) -> None:
        """Type a character or delete one, choose what was typed, or leave the value as it was."""
        typed = self.typed or ""
        if event.key in (*ENTER, pygame.K_TAB):
            self.typed = None
            if typed:
                self.choose(typed)
        elif event.key == pygame.K_ESCAPE:
            self.typed = None
        elif event.key == pygame.K_BACKSPACE:
            self.typed = (typed or self.value())[:-1]
        elif event.unicode and event.unicode.isprintable():
            self.typed = (typed + event.unicode)[:MAX_TYPED]


@dataclass(eq=False)
class Slider(Widget):
    """Chooses one of some values in ascending order. value: the current one, which may be between two of them.

    A drag of the mouse chooses at its end. dragged: the value that it has got to and has not chosen yet.
    """

    name: str
    values: Sequence[float]
    value: Callable[[], float]
    choose: Callable[[float], None]
    does: str = ""
    unit: str = ""
    dragged: int | None = None

    follows_mouse = True

    def _value_text(self) -> str:
        value = self.value() if self.dragged is None else self.values[self.dragged]
        return f"{value:g}{self.unit}"

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its text and its track, px."""
        return round(2.5 * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw its name and value over a track with a knob."""
        track = self._track(place)
        line = Rect(track.x, place.y, track.width, round(1.4 * text_height))
        value_width = text_width(self._value_text(), text_height)
        write(surface, self.name, line, theme.dim, text_height)
        write(surface, self._value_text(), line.move(line.width - value_width, 0), theme.ink, text_height)
        x = track.x + round(track.width * self._nearest() / max(1, len(self.values) - 1))
        bar = Rect(track.x, track.centery - THICKNESS // 2, track.width, THICKNESS)
        pygame.draw.rect(surface, theme.line, bar, border_radius=THICKNESS // 2)
        pygame.draw.rect(surface, theme.accent, (bar.x, bar.y, x - bar.x, THICKNESS), border_radius=THICKNESS // 2)
        dot(surface, theme.accent, theme.accent, (x, track.centery), text_height * (0.55 if hot else 0.45))

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Drag the knob to a point of the track."""
        track = self._track(place)
        share = min(max((point[0] - track.x) / track.width, 0.0), 1.0)
        self.dragged = round(share * (len(self.values) - 1))

    def release(self) -> None:
        """Choose the value that the mouse dragged it to."""
        if self.dragged is not None:
            value, self.dragged = self.values[self.dragged], None
            if value != self.value():
                self.choose(value)

    def _nearest(self) -> int:
        if self.dragged is not None:
            return self.dragged
        return min(range(len(self.values)), key=lambda index: abs(self.values[index] - self.value()))

    @staticmethod
    def _track(place: Rect) -> Rect:
        pad, top, height = place.height // 3, round(0.55 * place.height), round(0.35 * place.height)
        return Rect(place.x + pad, place.y + top, place.width - 2 * pad, height)
