"""The places of everything in a window: a header, panes over a palette, a column beside them, a timeline below."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

from pygame import Rect

from sandbox.scene.fields import Vector

GAP: Final = 10  # px between the parts of a window
BETWEEN: Final = 6  # px between two buttons
EDGE: Final = 3  # px, of the frame round an arena
SIDE: Final = 1.85  # height of a button, in heights of the text
LINE: Final = 1.6  # height of a line of text with room round it, in heights of the text
TIMELINE_SHARE: Final = 0.34  # of the window's height, for the timeline with its chart, until it is dragged
MAX_TIMELINE_SHARE: Final = 0.75
MIN_TRACK: Final = 20  # heights of the text, of the track with both times; else the timeline is as wide as the window
MIN_CHART: Final = 4.5  # heights of the text; where there is less room, the chart is left out
COLUMN_LETTERS: Final = 27  # the column's width, in heights of the text,
COLUMN_SHARE: Final = 0.45  # or in that of the window, if it is less
TIME_LETTERS: Final = 5  # width of the time, in heights of the text
TEXT_HEIGHT: Final = 14  # px, at first
TEXT_HEIGHTS: Final = (10, 32)  # px, the least and the largest
WIDE: Final = 68  # width of a window that opens with its column, in heights of the text
OPENS_AT: Final = (1600, 1000)  # px, the largest window that opens by itself
DESKTOP_SHARE: Final = 0.9  # of the desktop that a new window has at most
MIN_SIZE: Final = (480, 320)  # px, the smallest window with room for all of this
MAX_ZOOM: Final = 50.0
ScreenPoint = tuple[int, int]


@dataclass(frozen=True)
class Lens:
    """Which part of the arena the panes show. zoom: 1 shows all of it; centre: as shares of its width and height."""

    zoom: float = 1.0
    centre: Vector = (0.5, 0.5)

    def zoomed(self, factor: float, about: Vector) -> "Lens":
        """Return the lens zoomed in by a factor, or out; the shares of the arena that stay where they are: about."""
        zoom = min(max(self.zoom * factor, 1.0), MAX_ZOOM)
        x, y = (at + (c - at) * self.zoom / zoom for c, at in zip(self.centre, about, strict=True))
        return Lens(zoom, _inside((x, y), zoom))

    def moved(self, by: Vector) -> "Lens":
        """Return the lens moved by shares of the arena, as far as there is arena."""
        return Lens(self.zoom, _inside((self.centre[0] + by[0], self.centre[1] + by[1]), self.zoom))


def _inside(centre: Vector, zoom: float) -> Vector:
    """Return the nearest centre from which only the arena is seen."""
    x, y = (min(max(c, 0.5 / zoom), 1 - 0.5 / zoom) for c in centre)
    return x, y


@dataclass(frozen=True)
class Layout:
    """A window with one pane per engine, each a title over an arena.

    window: width and height, px of the screen. arena: width and height, px of the scene. text: height of the text, px;
    0 lets the size of the window decide. lens: what the panes show of the arena. has_chart: whether there is a chart,
    if there is room for one. has_controls: whether there are header, palette and timeline, and the column if
    has_column; else a line of text is below. palette_width, before_track, after_track: of the widgets there, px.
    timeline_share: of the window's height that the timeline has at least; it also has what the panes leave.
    """

    window: tuple[int, int]
    arena: Vector
    panes: int
    text: int = 0
    lens: Lens = Lens()
    has_chart: bool = False
    has_controls: bool = False
    has_column: bool = False
    palette_widths: tuple[int, ...] = ()
    before_track: int = 0
    after_track: int = 0
    timeline_share: float = TIMELINE_SHARE

    @cached_property
    def text_height(self) -> int:
        """Size of the text, px."""
        return self.text or max(13, min(round(self.window[1] / 40), round(self.window[0] / 64), 48))

    @cached_property
    def line_height(self) -> int:
        """Height of a line of text with room round it, px."""
        return round(LINE * self.text_height)

    @cached_property
    def side(self) -> int:
        """Height of a button, px."""
        return round(SIDE * self.text_height)

    @cached_property
    def header(self) -> Rect:
        """The place of the header; its height is 0 if there are no controls."""
        return Rect(GAP, GAP, self.window[0] - 2 * GAP, self.side if self.has_controls else 0)

    @cached_property
    def top(self) -> int:
        """The upper edge of panes and column, px."""
        return self.header.bottom + GAP // 2 if self.has_controls else 0

    # The timeline

    @cached_property
    def timeline(self) -> Rect:
        """The place of the timeline, of which a picture has only the chart.

        The chart has what the panes leave, unless a column above it needs that.
        """
        place, is_free = self._least_timeline, self._column_is_whole or not self.has_column
        if self.has_controls and is_free and place.height > 2 * self.side:
            top = min(place.y, self.palette.bottom + self.side + GAP)
            return Rect(place.x, top, place.width, place.bottom - top)
        return place

    @cached_property
    def _least_timeline(self) -> Rect:
        """The place of the timeline if the panes need all that it can leave."""
        if not self.has_controls:
            height = self._chart_height(0)
            return Rect(GAP, self.status.y - height, self.window[0] - 2 * GAP, height)
        rows = self.side + GAP
        chart = self._chart_height(self._tall_buttons)
        height = rows + (self._tall_buttons - rows + chart if chart else 0)
        width = (self.pane_room if self._column_is_whole else self.window[0] - GAP) - GAP
        return Rect(GAP, self.window[1] - GAP - height, width, height)

    @property
    def _tall_buttons(self) -> int:
        """Height of the rows of buttons in a timeline with a chart, and of the room round them, px."""
        return 2 * self.side + GAP + GAP // 2 * 2

    @property
    def _column_is_whole(self) -> bool:
        """Whether the column is beside the timeline too, and not only beside the panes."""
        return self.pane_room - self.before_track - self.after_track >= MIN_TRACK * self.text_height

    def _chart_height(self, others: int) -> int:
        """Return the height of the chart, px; 0 if no chart is shown. others: height of what is beside it."""
        height = round(self.timeline_share * self.window[1]) - others
        return height if self.has_chart and height >= MIN_CHART * self.text_height else 0

    @cached_property
    def splitter(self) -> Rect:
        """The place above a timeline with a chart, by which its height can be dragged; else its height is 0."""
        return Rect(self.timeline.x, self.timeline.y - GAP, self.timeline.width, GAP if self.tabs.height else 0)

    def timeline_share_at(self, y: int) -> float:
        """Return the share of the window's height that the timeline has if its upper edge is dragged to y, px."""
        least = (MIN_CHART * self.text_height + self._tall_buttons + 1) / self.window[1]
        return min(max((self.window[1] - y - GAP - GAP // 2) / self.window[1], least), MAX_TIMELINE_SHARE)

    @cached_property
    def transport(self) -> Rect:
        """The place of the buttons of time, and of the track between them."""
        place = self.timeline
        return Rect(place.x + GAP, place.y + GAP // 2, place.width - 2 * GAP, self.side if self.has_controls else 0)

    @cached_property
    def bar(self) -> Rect:
        """The place of the track, on which a time can be chosen."""
        row, time = self.transport, TIME_LETTERS * self.text_height
        left, right = row.x + self.before_track + time + GAP, row.right - self.after_track - time
        return Rect(left, row.y, max(1, right - left), row.height)

    @cached_property
    def tabs(self) -> Rect:
        """The place of the chart's tabs; its height is 0 if no chart is shown."""
        row = self.transport
        height = self.side if self.has_controls and self.timeline.height > 2 * self.side else 0
        return Rect(row.x, row.bottom + GAP // 2, row.width, height)

    @cached_property
    def strip(self) -> Rect:
        """The place of the chart; its height is 0 if no chart is shown."""
        place = self.timeline
        if not self.has_controls:
            return place
        if not self.tabs.height:
            return Rect(place.x, place.bottom, place.width, 0)
        return Rect(place.x + GAP, self.tabs.bottom, place.width - 2 * GAP, place.bottom - self.tabs.bottom - GAP // 2)

    @cached_property
    def status(self) -> Rect:
        """The place of messages, between palette and timeline; without controls, below everything."""
        if not self.has_controls:
            return Rect(GAP, self.window[1] - self.line_height, max(1, self.window[0] - 2 * GAP), self.line_height)
        return Rect(GAP, self.timeline.y - GAP - self.side, max(1, self.pane_room - GAP), self.side)

    # The column, and the panes with their palette

    @cached_property
    def panel(self) -> Rect:
        """The place of the column, beside the panes; its width is 0 if it is closed."""
        width, right, top = self._column_width, self.window[0] - GAP * self.has_column, self.top + GAP // 2
        bottom = self.window[1] if self._column_is_whole else self.timeline.y
        return Rect(right - width, top, width, bottom - GAP - top)

    @property
    def _column_width(self) -> int:
        return round(min(COLUMN_LETTERS * self.text_height, COLUMN_SHARE * self.window[0])) if self.has_column else 0

    @property
    def pane_room(self) -> int:
        """The right edge of the panes, px."""
        return self.window[0] - GAP - (self._column_width + GAP if self.has_column else 0)

    @cached_property
    def palette_rows(self) -> int:
        """How many rows the palette has."""
        if not self.has_controls:
            return 0
        return max((row for row, _ in in_rows(self.palette_widths, self.pane_room - GAP)), default=0) + 1

    @cached_property
    def palette(self) -> Rect:
        """The place of the palette, below the panes."""
        height = self.palette_rows * (self.side + BETWEEN)
        bottom = max(arena.bottom for arena in self.arenas) + EDGE
        return Rect(GAP, bottom + GAP // 2, self.pane_room - GAP, height)

    @cached_property
    def columns(self) -> int:
        """How many panes stand side by side: the number that makes them largest."""
        return max(range(1, self.panes + 1), key=self._scale)

    @cached_property
    def _whole(self) -> float:
        """Px of the screen for one px of the scene, if a pane shows all of the arena."""
        return self._scale(self.columns)

    @cached_property
    def scale(self) -> float:
        """Px of the screen for one px of the scene."""
        return self._whole * self.lens.zoom

    @cached_property
    def origin(self) -> Vector:
        """Where the scene's origin is in a pane, px from its upper left."""
        x, y = (
            side * self._whole * (0.5 - c * self.lens.zoom)
            for side, c in zip(self.arena, self.lens.centre, strict=True)
        )
        return x, y

    def _room(self, columns: int) -> Vector:
        """Return the width and height available to a pane's arena, px."""
        rows = math.ceil(self.panes / columns)
        width = self.pane_room / columns - GAP - 2 * EDGE
        below = self.palette_rows * (self.side + BETWEEN) + (self.side if self.has_controls else 0)
        bottom = self._least_timeline.y - GAP - below
        height = (bottom - self.top) / rows - GAP // 2 - 2 * EDGE - self.line_height
        return max(width, 1.0), max(height, 1.0)

    def _scale(self, columns: int) -> float:
        return min(room / size for room, size in zip(self._room(columns), self.arena, strict=True))

    @cached_property
    def arenas(self) -> list[Rect]:
        """Each pane's arena on the screen. They are at the top of their room, and together in its middle."""
        size = [max(1, round(side * self._whole)) for side in self.arena]
        across = size[0] + GAP + 2 * EDGE
        left = GAP + EDGE + max(0, (self.pane_room - self.columns * across) // 2)
        rects = []
        for pane in range(self.panes):
            row, column = divmod(pane, self.columns)
            down = size[1] + GAP // 2 + 2 * EDGE + self.line_height
            rects.append(Rect(left + column * across, self.top + EDGE + self.line_height + row * down, *size))
        return rects

    def title(self, pane: int) -> Rect:
        """Return the place of a pane's title, right above its arena."""
        arena = self.arenas[pane]
        return Rect(arena.x - EDGE, arena.y - EDGE - self.line_height, arena.width + 2 * EDGE, self.line_height)

    def to_scene(self, pane: int, point: ScreenPoint) -> Vector:
        """Turn a point of the screen into a position in the scene of a pane, px."""
        arena = self.arenas[pane]
        x, y = self.origin
        return (point[0] - arena.x - x) / self.scale, (point[1] - arena.y - y) / self.scale

    def to_screen(self, pane: int, position: Sequence[float]) -> tuple[float, float]:
        """Turn a position in the scene of a pane, px, into a point of the screen."""
        arena, (x, y) = self.arenas[pane], self.origin
        return arena.x + x + position[0] * self.scale, arena.y + y + position[1] * self.scale

    def pane_at(self, point: ScreenPoint) -> int | None:
        """Return the pane whose arena contains a point of the screen."""
        return next((pane for pane, arena in enumerate(self.arenas) if arena.collidepoint(point)), None)


def in_rows(widths: Sequence[int], room: int) -> list[tuple[int, int]]:
    """Return the row of each of some widgets, and where in it they begin, px. room: width of a row, px."""
    places, row, x = list[tuple[int, int]](), 0, 0
    for width in widths:
        if x and x + width > room:
            row, x = row + 1, 0
        places.append((row, x))
        x += width + BETWEEN
    return places


layout_of = lru_cache(maxsize=16)(Layout)  # a window asks for its layout at every event, and it seldom changes


def natural_size(desktop: tuple[int, int]) -> tuple[int, int]:
    """Choose the size of a new window, px."""
    width, height = (min(round(DESKTOP_SHARE * side), most) for side, most in zip(desktop, OPENS_AT, strict=True))
    return max(640, width), max(480, height)
