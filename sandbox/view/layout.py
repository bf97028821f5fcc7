"""The places of everything in a window: a header, panes over a palette, a column beside them, a timeline below."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
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
MIN_BAR: Final = 6  # heights of the text, of the track itself; else the buttons after it are left out, which have keys
MIN_CHART: Final = 6.5  # heights of the text, of a heading, three lines' names and an axis; else there is no chart
COLUMN_LETTERS: Final = 27  # the column's width, in heights of the text,
COLUMN_SHARE: Final = 0.45  # or in that of the window, if it is less
TIME_LETTERS: Final = 5  # width of the time, in heights of the text
TEXT_HEIGHT: Final = 14  # px, at first
TEXT_HEIGHTS: Final = (10, 32)  # px, the least and the largest
WIDE: Final = 68  # width from which on a window has its column without being asked, in heights of the text
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


class Layout:
    """Where everything is in a window with one pane per engine, each a title over an arena.

    window: width and height, px of the screen. arena: width and height, px of the scene. text: height of the text, px;
    0 lets the size of the window decide. lens: what the panes show of the arena. has_chart: whether there is a chart,
    if there is room for one. has_controls: whether there are header, palette and timeline, and the column if
    has_column; else a line of text is below. palette_widths, before_track, after_track: of the widgets there, px.
    timeline_share: of the window's height that the timeline has at least; it also has what the panes leave.

    line_height: of a line of text with room round it; side: height of a button; top: the upper edge of the panes;
    pane_room: their right edge; scale: px of the screen for one px of the scene; origin: where the scene's is in a
    pane; all in px. What is not shown has no height.
    """

    def __init__(
        self,
        window: tuple[int, int],
        arena: Vector,
        panes: int,
        text: int = 0,
        lens: Lens = Lens(),
        has_chart: bool = False,
        has_controls: bool = False,
        has_column: bool = False,
        palette_widths: tuple[int, ...] = (),
        before_track: int = 0,
        after_track: int = 0,
        timeline_share: float = TIMELINE_SHARE,
    ) -> None:
        width, height = self.window = window
        self.arena = arena
        letter = self.text_height = text or max(13, min(round(height / 40), round(width / 64), 48))
        self.line_height, side = round(LINE * letter), round(SIDE * letter)
        self.side, self._side = side, side if has_controls else 0  # of a button, and of one that is shown
        self.header = Rect(GAP, GAP, width - 2 * GAP, self._side)
        self.top = self.header.bottom + GAP // 2 if has_controls else 0
        column = round(min(COLUMN_LETTERS * letter, COLUMN_SHARE * width)) if has_column else 0
        self.pane_room = width - GAP - (column + GAP if has_column else 0)
        is_whole = self.pane_room - before_track - after_track >= MIN_TRACK * letter  # the column, beside the timeline

        self._tall_buttons = 2 * side + GAP + GAP // 2 * 2 if has_controls else 0  # with the room round them
        chart = round(timeline_share * height) - self._tall_buttons
        chart = chart if has_chart and chart >= MIN_CHART * letter else 0
        tall = self._tall_buttons + chart if chart else side + GAP if has_controls else 0
        wide = (self.pane_room if is_whole else width - GAP) - GAP
        bottom = height - (GAP if has_controls else self.line_height)
        timeline = Rect(GAP, bottom - tall, wide if has_controls else width - 2 * GAP, tall)
        self._place_panes(panes, lens, timeline.y, palette_widths if has_controls else ())
        if has_controls and chart and (is_whole or not has_column):  # the chart has what the panes leave
            timeline.y = min(timeline.y, self.palette.bottom + side + GAP)
            timeline.height = bottom - timeline.y
        self._place_timeline(timeline, before_track, after_track, bool(chart))
        text_place = Rect(GAP, timeline.y - GAP - side, max(1, self.pane_room - GAP), side)
        below = Rect(GAP, bottom, max(1, width - 2 * GAP), self.line_height)
        self.status = text_place if has_controls else below  # the place of messages
        top, end = self.top + GAP // 2, (height if is_whole else timeline.y) - GAP
        self.panel = Rect(width - GAP * has_column - column, top, column, end - top)  # the column

    def _place_panes(self, panes: int, lens: Lens, bottom: int, palette_widths: Sequence[int]) -> None:
        """Place panes and palette above a bottom, px: side by side in as many columns as make the panes largest."""
        rows = max((row + 1 for row, _ in in_rows(palette_widths, self.pane_room - GAP)), default=0)
        below, (width, height) = rows * (self.side + BETWEEN) + self._side + GAP, self.arena

        def scale(columns: int) -> float:
            across = self.pane_room / columns - GAP - 2 * EDGE
            down = (bottom - below - self.top) / math.ceil(panes / columns) - GAP // 2 - 2 * EDGE - self.line_height
            return min(max(across, 1.0) / width, max(down, 1.0) / height)

        columns = max(range(1, panes + 1), key=scale)
        whole = scale(columns)  # px of the screen for one px of the scene, if a pane shows all of the arena
        self.scale = whole * lens.zoom
        self.origin = (
            width * whole * (0.5 - lens.centre[0] * lens.zoom),
            height * whole * (0.5 - lens.centre[1] * lens.zoom),
        )
        size = max(1, round(width * whole)), max(1, round(height * whole))
        across, down = size[0] + GAP + 2 * EDGE, size[1] + GAP // 2 + 2 * EDGE + self.line_height
        left, top = GAP + EDGE + max(0, (self.pane_room - columns * across) // 2), self.top + EDGE + self.line_height
        self.arenas = [Rect(left + k % columns * across, top + k // columns * down, *size) for k in range(panes)]
        end = max(arena.bottom for arena in self.arenas) + EDGE + GAP // 2
        self.palette = Rect(GAP, end, self.pane_room - GAP, rows * (self.side + BETWEEN))

    def _place_timeline(self, place: Rect, before_track: int, after_track: int, has_chart: bool) -> None:
        """Place what is in the timeline; a picture, without controls, has only the chart there.

        splitter: by which the timeline's height can be dragged; transport: the buttons of time; bar: the track between
        them; after_bar: the buttons after it; tabs: of the chart; strip: the chart.
        """
        self.timeline, self.strip = place, place
        self.splitter = Rect(place.x, place.y - GAP, place.width, GAP if has_chart and self._side else 0)
        row = self.transport = Rect(place.x + GAP, place.y + GAP // 2, place.width - 2 * GAP, self._side)
        left = row.x + before_track + TIME_LETTERS * self.text_height + GAP
        right = row.right - TIME_LETTERS * self.text_height
        after = after_track if right - after_track - left >= MIN_BAR * self.text_height else 0
        self.bar = Rect(left, row.y, max(1, right - after - left), row.height)
        self.after_bar = Rect(row.right - after, row.y, after, row.height)
        self.tabs = Rect(row.x, row.bottom + GAP // 2, row.width, self._side if has_chart else 0)
        if self._side:
            tall = place.bottom - self.tabs.bottom - GAP // 2 if has_chart else 0
            self.strip = Rect(row.x, self.tabs.bottom, row.width, tall)

    def timeline_share_at(self, y: int) -> float:
        """Return the share of the window's height that the timeline has if its upper edge is dragged to y, px."""
        height = self.window[1]
        least = (MIN_CHART * self.text_height + self._tall_buttons + 1) / height
        return min(max((height - y - GAP - GAP // 2) / height, least), MAX_TIMELINE_SHARE)

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
