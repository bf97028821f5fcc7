"""The toolbar: a row of widgets in groups, each usable by mouse alone and by keyboard alone."""

from collections.abc import Mapping, Sequence
from functools import cached_property

from pygame import Rect, Surface

from sandbox.view.controls import Group
from sandbox.view.palette import FRAME
from sandbox.view.widgets.group import Placed, WidgetGroup
from sandbox.view.widgets.widget import Widget


class Toolbar:
    """Draws its widgets at places that the layout chooses. group: knows which of them mouse and keyboard are on."""

    def __init__(self, groups: Mapping[Group, Sequence[Widget]], group: WidgetGroup) -> None:
        self._groups = groups
        self._group = group
        self._drawn = Surface((0, 0))
        self._drawn_as: object = None  # the places and looks in that picture

    @cached_property
    def widgets(self) -> tuple[Widget, ...]:
        """All widgets, from the left."""
        return tuple(widget for widgets in self._groups.values() for widget in widgets)

    @cached_property
    def widths(self) -> tuple[tuple[float, ...], ...]:
        """The widgets' widths, in heights of the toolbar, by group."""
        return tuple(tuple(widget.width for widget in widgets) for widgets in self._groups.values())

    def placed(self, places: Sequence[Rect]) -> list[Placed]:
        """Return the widgets with their places."""
        return list(zip(self.widgets, places, strict=True))

    def draw(self, surface: Surface, places: Sequence[Rect], text_height: int) -> None:
        """Draw all widgets; again only if one looks different."""
        hot = [self._group.is_hot(widget) for widget in self.widgets]
        wanted = places, hot, [widget.look for widget in self.widgets]
        if wanted != self._drawn_as:
            self._drawn, self._drawn_as = Surface((surface.get_width(), places[-1].bottom)), wanted
            self._drawn.fill(FRAME)
            for (widget, place), is_hot in zip(self.placed(places), hot, strict=True):
                widget.draw(self._drawn, place, text_height, hot=is_hot)
        surface.blit(self._drawn, (0, 0))
