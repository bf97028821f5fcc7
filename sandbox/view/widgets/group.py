"""Widgets together: they share the mouse and the keyboard, and stand in rows."""

from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.layout import BETWEEN, in_rows
from sandbox.view.primitives import card
from sandbox.view.theme import theme
from sandbox.view.widgets import Widget
from sandbox.view.widgets.fields import Field

TIP_SECONDS: Final = 4.0  # that a tip is shown
Placed = tuple[Widget, Rect]


class WidgetGroup:
    """Which widget the mouse is over, which one it holds down, and which field is typed into."""

    def __init__(self) -> None:
        self.over: Widget | None = None
        self.held: Widget | None = None
        self.field: Field | None = None
        self._tip_seconds = 0.0  # that the tip is still shown

    def on_event(self, event: Event, placed: Sequence[Placed]) -> bool:
        """Handle an event. Return whether a widget uses it. placed: all widgets that are shown, with their places."""
        places = dict(placed)
        if self.field not in places:
            self._type_into(None)
        self.over = self.over if self.over in places else None
        self.held = self.held if self.held in places else None
        if event.type == pygame.KEYDOWN:
            return self._on_key(event)
        if event.type == pygame.MOUSEMOTION:
            over = widget_at(event.pos, placed)
            if over is not self.over:
                self.over, self._tip_seconds = over, 0.0 if any(event.buttons) else TIP_SECONDS
            if self.held is not None and self.held.follows_mouse:
                self.held.press(places[self.held], event.pos)
            return self.held is not None
        if event.type == pygame.MOUSEBUTTONDOWN:
            self._tip_seconds = 0.0
            return event.button == 1 and self._on_press(event.pos, placed)
        if event.type == pygame.WINDOWLEAVE:
            self.over = None
        if event.type == pygame.WINDOWFOCUSLOST or (event.type == pygame.MOUSEBUTTONUP and event.button == 1):
            held, self.held = self.held, None
            if held:
                held.release()
        return False

    def _on_press(self, point: tuple[int, int], placed: Sequence[Placed]) -> bool:
        self.held = pressed = widget_at(point, placed)
        self._type_into(pressed if isinstance(pressed, Field) else None)
        if pressed:
            pressed.press(dict(placed)[pressed], point)
        return pressed is not None

    def _type_into(self, field: Field | None) -> None:
        if self.field:
            self.field.typed = None
        self.field = field

    def _on_key(self, event: Event) -> bool:
        if self.field is None or event.mod & (pygame.KMOD_CTRL | pygame.KMOD_ALT | pygame.KMOD_META):
            return False
        self.field.key(event)
        if self.field.typed is None:
            self.field = None
        return True

    def wait(self, seconds: float) -> bool:
        """Let some seconds pass. Return whether a tip has left in them."""
        was_shown = self._tip_seconds > 0
        self._tip_seconds -= seconds
        return was_shown and self._tip_seconds <= 0

    # Drawing

    def draw(self, surface: Surface, placed: Sequence[Placed], text_height: int) -> None:
        """Draw widgets at their places."""
        for widget, place in placed:
            if widget.seen_in is None or widget.seen_in.colliderect(place):
                surface.set_clip(widget.seen_in)
                widget.draw(surface, place, text_height, hot=widget in (self.over, self.field))
        surface.set_clip(None)

    def draw_tip(self, surface: Surface, placed: Sequence[Placed], kept_free: Sequence[Rect], text_height: int) -> None:
        """Draw the tip of the widget that the mouse is on, unless something is typed. kept_free: see `card`."""
        hot = None if self.field else self.over
        place = next((place for widget, place in placed if widget is hot), None)
        if hot and hot.tip and place and self._tip_seconds > 0:
            lines = [[line] for line in hot.tip.splitlines()]
            card(surface, lines, place, text_height, surface.get_rect(), [*kept_free, place])


def widget_at(point: tuple[int, int], placed: Sequence[Placed]) -> Widget | None:
    """Return the widget at a point of the screen."""
    under = (widget for widget, place in placed if place.collidepoint(point))
    return next((widget for widget in under if widget.seen_in is None or widget.seen_in.collidepoint(point)), None)


class WidgetRow:
    """Places widgets in a row: some at its left, and others at its right. filler: a widget that has what they leave."""

    def __init__(self, left: Sequence[Widget], right: Sequence[Widget] = (), filler: Widget | None = None) -> None:
        self._widgets, self._left, self._filler = [*left, *right], len(left), filler

    def widths(self, text_height: int) -> tuple[int, ...]:
        """Return the width of each widget, px."""
        return tuple(0 if each is self._filler else each.natural_width(text_height) for each in self._widgets)

    def width(self, text_height: int) -> int:
        """Return the width of all widgets side by side, px."""
        return sum(width + BETWEEN for width in self.widths(text_height))

    def placed(self, place: Rect, text_height: int, side: int) -> list[Placed]:
        """Return the widgets with their places. Those that have no room are left out. side: height of a row, px."""
        widths, line = self.widths(text_height), side + BETWEEN
        spare, placed = max(0, place.width - sum(widths) - BETWEEN * (len(widths) - 1)), list[Placed]()
        for k, (row, x) in enumerate(in_rows(widths, place.width)):
            widget, shift = self._widgets[k], spare if k >= self._left else 0
            width = spare if widget is self._filler else widths[k]
            placed.append((widget, Rect(place.x + x + shift, place.y + row * line, width, side)))
        return [(widget, where) for widget, where in placed if where.width > text_height and place.contains(where)]


def rows_of(widgets: Sequence[Widget], per_row: int = 2) -> list[Sequence[Widget]]:
    """Return widgets in rows of the column."""
    return [widgets[k : k + per_row] for k in range(0, len(widgets), per_row)]


def stacked(rows: Sequence[Sequence[Widget]], width: int, text_height: int, gap: int = 0) -> tuple[list[Placed], int]:
    """Return widgets with their places, row by row from the point 0, 0, and the height of all rows, px."""
    gap = gap or max(4, text_height // 3)
    placed: list[Placed] = []
    y = 0
    for row in rows:
        room, whole = width - gap * (len(row) - 1), sum(widget.width for widget in row)
        ends = [round(room * end / whole) for end in accumulate((widget.width for widget in row), initial=0.0)]
        widths = [end - start for start, end in pairwise(ends)]
        height = max(widget.height(w, text_height) for widget, w in zip(row, widths, strict=True))
        lefts = accumulate((w + gap for w in widths), initial=0)
        placed += [(widget, Rect(x, y, w, height)) for widget, w, x in zip(row, widths, lefts, strict=False)]
        y += height + gap
    return placed, y


def draw_scroll_bar(surface: Surface, body: Rect, height: int, scrolled: float, text_height: int) -> None:
    """Draw at the right of a place which part of its content is seen. height: of the content; scrolled: px of it."""
    if height > body.height:
        top, share = body.y + scrolled / height * body.height, body.height / height
        surface.fill(theme.dim, Rect(body.right + 2, top, max(2, text_height // 5), share * body.height))
