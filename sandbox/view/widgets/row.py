"""Widgets side by side: some from the left, others from the right, in as many rows as they need."""

from collections.abc import Callable, Sequence

from pygame import Color, Rect, Surface

from sandbox.view.layout import BETWEEN, in_rows
from sandbox.view.theme import theme
from sandbox.view.widgets.group import Placed, WidgetGroup
from sandbox.view.widgets.widget import Widget


class WidgetRow:
    """Places widgets in a row, and draws it again only if one looks different. group: knows where the mouse is.

    ground: returns what they stand on.
    """

    def __init__(
        self, group: WidgetGroup, left: Sequence[Widget], right: Sequence[Widget], ground: Callable[[], Color]
    ) -> None:
        self._group = group
        self.left, self.right = list(left), list(right)
        self._ground = ground
        self._drawn: Surface | None = None
        self._drawn_as: object = None  # the places and looks in that picture

    def widths(self, text_height: int) -> tuple[int, ...]:
        """Return the width of each widget, px."""
        return tuple(widget.natural_width(text_height) for widget in (*self.left, *self.right))

    def width(self, text_height: int) -> int:
        """Return the width of all widgets side by side, px."""
        return sum(width + BETWEEN for width in self.widths(text_height))

    def placed(self, place: Rect, text_height: int, side: int) -> list[Placed]:
        """Return the widgets with their places. Those that have no room are left out. side: height of a row, px."""
        if not place.height:
            return []
        widths = self.widths(text_height)
        rows, line = in_rows(widths, place.width), side + BETWEEN
        spare = place.width - sum(widths) - BETWEEN * (len(widths) - 1)
        placed = []
        for k, (widget, width, (row, x)) in enumerate(zip((*self.left, *self.right), widths, rows, strict=True)):
            shift = spare if k >= len(self.left) and spare > 0 else 0
            placed.append((widget, Rect(place.x + x + shift, place.y + row * line, width, side)))
        return [(widget, where) for widget, where in placed if place.contains(where)]

    def draw(self, surface: Surface, placed: Sequence[Placed], text_height: int) -> None:
        """Draw the widgets at their places."""
        if not placed:
            return
        area = placed[0][1].unionall([where for _, where in placed])
        looks = [(widget.look, tuple(where), self._group.is_hot(widget)) for widget, where in placed]
        wanted = looks, theme.is_dark, text_height
        if wanted != self._drawn_as or self._drawn is None:
            self._drawn, self._drawn_as = Surface(area.size), wanted
            self._drawn.fill(self._ground())
            for widget, where in placed:
                at = where.move(-area.x, -area.y)
                widget.draw(self._drawn, at, text_height, hot=self._group.is_hot(widget))
        surface.blit(self._drawn, area)
