"""The toolbar: a row of widgets in named groups that fold, each usable by mouse alone and by keyboard alone."""

from collections.abc import Mapping, Sequence
from functools import cached_property, partial

from pygame import Rect, Surface

from sandbox.view.controls import Group
from sandbox.view.palette import FRAME
from sandbox.view.widgets.group import Placed, WidgetGroup
from sandbox.view.widgets.group_header import GroupHeader
from sandbox.view.widgets.widget import Widget


class Toolbar:
    """Draws its widgets at places that the layout chooses. group: knows which of them mouse and keyboard are on.

    by_hand: for each group, whether it was unfolded or folded by hand; None leaves that to the layout.
    """

    def __init__(self, groups: Mapping[Group, Sequence[Widget]], group: WidgetGroup) -> None:
        self._headers = {each: GroupHeader(each.name.lower(), partial(self.toggle, each)) for each in groups}
        self._groups: dict[Group, list[Widget]] = {each: [self._headers[each], *groups[each]] for each in groups}
        self.by_hand: dict[Group, bool | None] = dict.fromkeys(groups)
        self._group = group
        self._drawn = Surface((0, 0))
        self._drawn_as: object = None  # the places and looks in that picture

    def toggle(self, group: Group) -> None:
        """Fold a group, or unfold it."""
        self.by_hand[group] = not self._headers[group].is_open

    @cached_property
    def widgets(self) -> tuple[Widget, ...]:
        """All widgets, from the left; each group begins with its header."""
        return tuple(widget for widgets in self._groups.values() for widget in widgets)

    @cached_property
    def widths(self) -> tuple[tuple[float, ...], ...]:
        """The widgets' widths, in heights of the toolbar, by group."""
        return tuple(tuple(widget.width for widget in widgets) for widgets in self._groups.values())

    def placed(self, places: Sequence[Rect]) -> list[Placed]:
        """Return the widgets that are not folded away, with their places."""
        return [(widget, place) for widget, place in zip(self.widgets, places, strict=True) if place.width]

    def draw(self, surface: Surface, places: Sequence[Rect], text_height: int) -> None:
        """Draw all widgets; again only if one looks different."""
        self._look_at(places)
        placed = self.placed(places)
        hot = [self._group.is_hot(widget) for widget, _ in placed]
        wanted = places, hot, [widget.look for widget, _ in placed]
        if wanted != self._drawn_as:
            bottom = max(place.bottom for place in places)
            self._drawn, self._drawn_as = Surface((surface.get_width(), bottom)), wanted
            self._drawn.fill(FRAME)
            for (widget, place), is_hot in zip(placed, hot, strict=True):
                widget.draw(self._drawn, place, text_height, hot=is_hot)
        surface.blit(self._drawn, (0, 0))

    def _look_at(self, places: Sequence[Rect]) -> None:
        """Let each header know whether its group is unfolded: then the widget after it has a place."""
        for number, widget in enumerate(self.widgets[:-1]):
            if isinstance(widget, GroupHeader):
                widget.is_open = bool(places[number + 1].width)
