"""The toolbar: buttons and sliders, each usable by mouse alone and by keyboard alone."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Protocol

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.controls import Control, Group
from sandbox.view.icons import icon
from sandbox.view.palette import ACCENT, FAINT, FRAME, INK, RAISED
from sandbox.view.primitives import card, lettering

SLIDER_WIDTH: Final = 5.0  # in heights of the toolbar
ICON_OFF: Final = (INK.r, INK.g, INK.b)
ICON_ON: Final = (FRAME.r, FRAME.g, FRAME.b)
ENTER: Final = (pygame.K_RETURN, pygame.K_KP_ENTER)
ARROWS: Final = {pygame.K_LEFT: -1, pygame.K_DOWN: -1, pygame.K_RIGHT: 1, pygame.K_UP: 1}


class Widget(Protocol):
    """Something on the toolbar. It is given its place at each call, since the window's size changes."""

    @property
    def group(self) -> Group:
        """The group that it stands in."""

    @property
    def width(self) -> float:
        """Its width, in heights of the toolbar."""

    @property
    def tip(self) -> str:
        """The text below it while the mouse or the keyboard is on it."""

    @property
    def look(self) -> object:
        """What is drawn; something else if the widget must be drawn again."""

    def draw(self, surface: Surface, place: Rect, *, hot: bool) -> None:
        """Draw it. hot: the mouse or the keyboard is on it."""

    def press(self, place: Rect, x: int) -> None:
        """Handle the mouse going down on it, or moving since then, at x (px of the window)."""

    def release(self) -> None:
        """Handle the mouse button going up."""

    def key(self, key: int) -> bool:
        """Handle a key. Return whether the widget uses it."""


@dataclass(frozen=True)
class Button:
    """Does what a control's key does. is_on: whether what the control turns on is on."""

    control: Control
    do: Callable[[Control], None]
    is_on: Callable[[Control], bool]
    width: float = 1.0

    @property
    def group(self) -> Group:
        """The control's group."""
        return self.control.group

    @property
    def tip(self) -> str:
        """The text below it while the mouse or the keyboard is on it."""
        return f"{self.control.does}  ({self.control.key_names})"

    @property
    def look(self) -> object:
        """Whether it is on."""
        return self.is_on(self.control)

    def draw(self, surface: Surface, place: Rect, *, hot: bool) -> None:
        """Draw the icon; while it is on, dark on a light ground."""
        on = self.is_on(self.control)
        pygame.draw.rect(surface, ACCENT if on else RAISED, place, border_radius=place.height // 6)
        if hot:
            pygame.draw.rect(surface, INK, place, max(1, place.height // 16), border_radius=place.height // 6)
        name = self.control.icon_on if on and self.control.icon_on else self.control.icon
        picture = icon(name, round(0.68 * place.height), ICON_ON if on else ICON_OFF)
        surface.blit(picture, picture.get_rect(center=place.center))

    def press(self, place: Rect, x: int) -> None:
        """Do it."""
        self.do(self.control)

    def release(self) -> None:
        """Do nothing: it was done when the button was pressed."""

    def key(self, key: int) -> bool:
        """Do it if the key is Enter."""
        if key in ENTER:
            self.do(self.control)
        return key in ENTER


@dataclass
class Slider:
    """Chooses one of some values in ascending order. value: the current one, which may be between two of them.

    at_once: a drag of the mouse chooses all the time; else at its end. refusal: why no other value can be chosen, or
    nothing. remedy: what a click does about that; remedy_tip: the same in words.
    """

    group: Group
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

    @property
    def tip(self) -> str:
        """What it sets, and its value; or why it cannot, and what a click does about that."""
        refusal = self.refusal()
        return f"{refusal}\n{self.remedy_tip}" if refusal else f"{self.does}: {self._value_text()}"

    def _value_text(self) -> str:
        value = self.value() if self.dragged is None else self.values[self.dragged]
        return "fastest" if value == math.inf else f"{value:g}{self.unit}"

    @property
    def look(self) -> object:
        """The value shown."""
        return self.value(), self.dragged, self.refusal()

    def draw(self, surface: Surface, place: Rect, *, hot: bool) -> None:
        """Draw its name and value over a track with a knob, grey if no other value can be chosen."""
        ink, knob = (FAINT, FAINT) if self.refusal() else (INK, ACCENT)
        pygame.draw.rect(surface, RAISED, place, border_radius=place.height // 6)
        if hot:
            pygame.draw.rect(surface, INK, place, max(1, place.height // 16), border_radius=place.height // 6)
        height = round(0.38 * place.height)
        track = self._track(place)
        name, value = lettering(self.name, FAINT, height), lettering(self._value_text(), ink, height)
        surface.blit(name, (track.x, place.y + height // 6))
        surface.blit(value, (track.right - value.get_width(), place.y + height // 6))
        pygame.draw.line(surface, FAINT, track.midleft, track.midright, max(1, place.height // 14))
        x = track.x + track.width * self._nearest() / max(1, len(self.values) - 1)
        pygame.draw.circle(surface, knob, (round(x), track.centery), round(0.16 * place.height))

    def press(self, place: Rect, x: int) -> None:
        """Choose the value at x of the track."""
        if self.refusal():
            return
        track = self._track(place)
        share = min(max((x - track.x) / track.width, 0.0), 1.0)
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

    def key(self, key: int) -> bool:
        """Choose the previous or next value if the key is an arrow."""
        if self.refusal():
            if key in ENTER:
                self.release()
            return key in ARROWS or key in ENTER
        if key in ARROWS:
            self._choose(min(max(self._nearest() + ARROWS[key], 0), len(self.values) - 1))
        return key in ARROWS

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


class Toolbar:
    """A row of widgets; the mouse is over one of them, and the keyboard on one."""

    def __init__(self, widgets: Sequence[Widget]) -> None:
        self.widgets = tuple(widgets)
        self.over: int | None = None  # the widget under the mouse
        self.held: int | None = None  # the widget that the mouse holds down
        self.focus: int | None = None  # the widget that the keyboard is on
        self._drawn = Surface((0, 0))
        self._drawn_as: object = None  # the places and looks in that picture

    @cached_property
    def widths(self) -> tuple[tuple[float, ...], ...]:
        """The widgets' widths, in heights of the toolbar, by group."""
        groups: list[tuple[Group, list[float]]] = []
        for widget in self.widgets:
            if not groups or groups[-1][0] != widget.group:
                groups.append((widget.group, []))
            groups[-1][1].append(widget.width)
        return tuple(tuple(widths) for _, widths in groups)

    def on_event(self, event: Event, places: Sequence[Rect]) -> bool:
        """Handle an event. Return whether the toolbar uses it."""
        if event.type == pygame.KEYDOWN:
            return self._on_key(event)
        if event.type == pygame.MOUSEMOTION:
            self.over = _index(places, event.pos)
            if self.held is not None and isinstance(self.widgets[self.held], Slider):
                self.widgets[self.held].press(places[self.held], event.pos[0])
            return self.held is not None
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self.focus, self.held = None, _index(places, event.pos)
            if self.held is not None:
                self.widgets[self.held].press(places[self.held], event.pos[0])
            return self.held is not None
        if event.type == pygame.WINDOWLEAVE:
            self.over = None
        if event.type == pygame.WINDOWFOCUSLOST or (event.type == pygame.MOUSEBUTTONUP and event.button == 1):
            if self.held is not None:
                self.widgets[self.held].release()
            self.held = None
        return False

    def _on_key(self, event: Event) -> bool:
        if event.key == pygame.K_TAB:
            back = event.mod & pygame.KMOD_SHIFT
            if self.focus is None:
                self.focus = len(self.widgets) - 1 if back else 0
            else:
                self.focus = (self.focus + (-1 if back else 1)) % len(self.widgets)
            return True
        if self.focus is None:
            return False
        if event.key == pygame.K_ESCAPE:
            self.focus = None
            return True
        return self.widgets[self.focus].key(event.key)

    def draw(self, surface: Surface, places: Sequence[Rect]) -> None:
        """Draw all widgets; again only if one looks different."""
        wanted = places, self.over, self.focus, [widget.look for widget in self.widgets]
        if wanted != self._drawn_as:
            self._drawn, self._drawn_as = Surface((surface.get_width(), places[-1].bottom)), wanted
            self._drawn.fill(FRAME)
            for index, (widget, place) in enumerate(zip(self.widgets, places, strict=True)):
                widget.draw(self._drawn, place, hot=index in (self.over, self.focus))
        surface.blit(self._drawn, (0, 0))

    def draw_tip(self, surface: Surface, places: Sequence[Rect], text_height: int) -> None:
        """Draw the tip of the widget that the mouse or the keyboard is on."""
        index = self.over if self.over is not None else self.focus
        if index is not None:
            lines = [[line] for line in self.widgets[index].tip.splitlines()]
            card(surface, lines, places[index].bottomleft, text_height, surface.get_rect())


def _index(places: Sequence[Rect], point: tuple[int, int]) -> int | None:
    found = Rect(point, (1, 1)).collidelist(list(places))
    return None if found < 0 else found
