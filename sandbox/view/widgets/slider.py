"""A slider that chooses one of some values."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.primitives import lettering
from sandbox.view.theme import theme
from sandbox.view.widgets.widget import ARROWS, ENTER, Widget, draw_ground

SLIDER_WIDTH: Final = 5.0  # in heights of the toolbar


@dataclass(eq=False)
class Slider(Widget):
    """Chooses one of some values in ascending order. value: the current one, which may be between two of them.

    at_once: a drag of the mouse chooses all the time; else at its end. refusal: why no other value can be chosen, or
    nothing. remedy: what a click does about that; remedy_tip: the same in words.
    """

    name: str
    does: str
    values: Sequence[float]
    value: Callable[[], float]
    choose: Callable[[float], None]
    unit: str = ""
    at_once: bool = True
    width: float = SLIDER_WIDTH
    refusal: Callable[[], str] = str
    remedy: Callable[[], None] | None = None
    remedy_tip: str = ""
    dragged: int | None = None  # the value that the mouse has dragged it to and has not chosen yet

    follows_mouse = True

    @property
    def tip(self) -> str:
        """What it sets, and its value; or why it cannot, and what a click does about that."""
        refusal = self.refusal()
        return f"{refusal}\n{self.remedy_tip}".rstrip() if refusal else f"{self.does}: {self._value_text()}"

    def _value_text(self) -> str:
        value = self.value() if self.dragged is None else self.values[self.dragged]
        return "fastest" if value == math.inf else f"{value:g}{self.unit}"

    @property
    def look(self) -> object:
        """The value shown."""
        return self.value(), self.dragged, self.refusal()

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw its name and value over a track with a knob, grey if no other value can be chosen."""
        ink, knob = (theme.dim, theme.dim) if self.refusal() else (theme.ink, theme.accent)
        draw_ground(surface, place, theme.raised, text_height, hot=hot)
        height = round(0.38 * place.height)
        track = self._track(place)
        name, value = lettering(self.name, theme.dim, height), lettering(self._value_text(), ink, height)
        surface.blit(name, (track.x, place.y + height // 6))
        surface.blit(value, (track.right - value.get_width(), place.y + height // 6))
        pygame.draw.line(surface, theme.dim, track.midleft, track.midright, max(1, place.height // 14))
        x = track.x + track.width * self._nearest() / max(1, len(self.values) - 1)
        pygame.draw.circle(surface, knob, (round(x), track.centery), round(0.16 * place.height))

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Choose the value at a point of the track."""
        if self.refusal():
            return
        track = self._track(place)
        share = min(max((point[0] - track.x) / track.width, 0.0), 1.0)
        index = round(share * (len(self.values) - 1))
        if self.at_once:
            self._choose(index)
        else:
            self.dragged = index

    def release(self) -> None:
        """Choose the value that the mouse dragged it to."""
        if self.remedy and self.refusal():
            self.remedy()
        elif self.dragged is not None:
            index, self.dragged = self.dragged, None
            self._choose(index)

    def key(self, event: Event) -> bool:
        """Choose the previous or next value if the key is an arrow."""
        if self.refusal():
            if event.key in ENTER:
                self.release()
            return event.key in ARROWS or event.key in ENTER
        if event.key in ARROWS:
            self._choose(min(max(self._nearest() + ARROWS[event.key], 0), len(self.values) - 1))
        return event.key in ARROWS

    def _choose(self, index: int) -> None:
        if self.values[index] != self.value():
            self.choose(self.values[index])

    def _nearest(self) -> int:
        """Return the index of the value nearest to the current one."""
        if self.dragged is not None:
            return self.dragged
        now = self.value()
        if now in self.values:  # infinity has no distance to itself
            return self.values.index(now)
        return min(range(len(self.values)), key=lambda index: abs(self.values[index] - now))

    @staticmethod
    def _track(place: Rect) -> Rect:
        pad = place.height // 3
        return Rect(place.x + pad, place.y + round(0.55 * place.height), place.width - 2 * pad, place.height // 3)
