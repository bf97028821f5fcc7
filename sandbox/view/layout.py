"""The places of everything in a window: a toolbar, panes as large as they can be, charts, a status line."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

from pygame import Rect

from sandbox.scene.fields import Vector

GAP: Final = 8  # px between panes and round them
CHROME_HEIGHT: Final = 110  # px, about, of toolbar, titles and status line
CHARTS_SHARE: Final = 0.27  # of the window's height, for the charts
PANEL_LETTERS: Final = 22  # the side panel's width, in heights of the text,
PANEL_SHARE: Final = 0.42  # or in that of the window, if it is less
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

    The toolbar is above them, charts and status line below, and a panel may be at the right.

    window: width and height, px of the screen. arena: width and height, px of the scene. tools: the widgets' widths,
    in heights of the toolbar, in groups. charts: how many; they are left out if there is no room for them.
    lens: what the panes show of the arena. has_panel: whether the side panel is open.
    """

    window: tuple[int, int]
    arena: Vector
    panes: int
    tools: tuple[tuple[float, ...], ...] = ()
    charts: int = 0
    lens: Lens = Lens()
    has_panel: bool = False

    @cached_property
    def text_height(self) -> int:
        """Size of the text, px."""
        return max(13, min(round(self.window[1] / 40), round(self.window[0] / 64), 48))

    @cached_property
    def line_height(self) -> int:
        """Height of a line of text with room round it, px."""
        return round(1.6 * self.text_height)

    @cached_property
    def toolbar(self) -> list[Rect]:
        """Each widget's place: rows of whole groups from the left, where wide widgets fill what the others leave."""
        side, room = round(1.75 * self.text_height), self.window[0] - 2 * GAP
        rows: list[list[Rect]] = [[]]
        for group in self.tools:
            widths = [round(share * side) for share in group]
            x = rows[-1][-1].right - GAP + 2 + side // 3 if rows[-1] else 0
            if x and x + sum(widths) + 2 * (len(widths) - 1) > room:
                rows.append([])
                x = 0
            for width in widths:
                if x + width > room:
                    rows.append([])
                    x = 0
                rows[-1].append(Rect(GAP + x, GAP // 2 + (len(rows) - 1) * (side + 2), width, side))
                x += width + 2
        return [place for row in rows if row for place in _filled(row, GAP + room)]

    @cached_property
    def top(self) -> int:
        """The upper edge of the panes, px."""
        return self.toolbar[-1].bottom if self.toolbar else 0

    @cached_property
    def panel(self) -> Rect:
        """The place of the side panel, beside panes and charts; its width is 0 if it is closed."""
        width = round(min(PANEL_LETTERS * self.text_height, PANEL_SHARE * self.window[0])) if self.has_panel else 0
        return Rect(self.window[0] - width, self.top, width, self.status.y - self.top)

    @cached_property
    def strip(self) -> Rect:
        """The place of the charts, above the status line; its height is 0 if none are shown or there is no room."""
        height = round(CHARTS_SHARE * self.window[1])
        if not self.charts or height < self.charts * 2.2 * self.text_height + self.line_height:
            height = 0
        return Rect(GAP, self.status.y - height, max(1, self.panel.x - 2 * GAP), height)

    @cached_property
    def bar(self) -> Rect:
        """The place of the time bar, above the status line; its height is 0 if charts are shown."""
        height = 0 if self.strip.height or not self.tools else round(0.7 * self.text_height)
        return Rect(GAP, self.strip.y - height, self.strip.width, height)

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
        width = (self.panel.x - GAP) / columns - GAP
        height = (self.bar.y - self.top - GAP) / rows - GAP - self.line_height
        return max(width, 1.0), max(height, 1.0)

    def _scale(self, columns: int) -> float:
        return min(room / size for room, size in zip(self._room(columns), self.arena, strict=True))

    @cached_property
    def arenas(self) -> list[Rect]:
        """Each pane's arena on the screen."""
        width, height = self._room(self.columns)
        size = [max(1, round(side * self._whole)) for side in self.arena]
        rects = []
        for pane in range(self.panes):
            row, column = divmod(pane, self.columns)
            x = GAP + column * (width + GAP) + (width - size[0]) / 2
            y = self.top + GAP + row * (height + GAP + self.line_height) + self.line_height + (height - size[1]) / 2
            rects.append(Rect(round(x), round(y), *size))
        return rects

    @cached_property
    def frame(self) -> list[Rect]:
        """What the toolbar's rows, the arenas and the charts leave of the window."""
        left = [Rect(0, self.top, self.window[0], self.window[1] - self.top)]
        for covered in (*self.arenas, self.strip, self.panel):
            left = [part for rect in left for part in _without(rect, covered)]
        return left

    def title(self, pane: int) -> Rect:
        """Return the place of a pane's title, right above its arena."""
        arena = self.arenas[pane]
        return Rect(arena.x, arena.y - self.line_height, arena.width, self.line_height)

    @cached_property
    def status(self) -> Rect:
        """The place of the status line."""
        return Rect(GAP, self.window[1] - self.line_height, max(1, self.window[0] - 2 * GAP), self.line_height)

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


def _filled(row: list[Rect], right: int) -> list[Rect]:
    """Widen the wide widgets of a row, to three times their width at most, so that it ends at the right."""
    wide = sum(place.width > place.height for place in row)
    spare, shift, filled = max(right - row[-1].right, 0), 0, []
    for place in row:
        more = min(spare // wide, 2 * place.width) if place.width > place.height else 0
        filled.append(Rect(place.x + shift, place.y, place.width + more, place.height))
        shift += more
    return filled


def _without(rect: Rect, covered: Rect) -> list[Rect]:
    """Cut what another covers off a rectangle: return the rest, in up to four parts."""
    inner = rect.clip(covered)
    if not inner:
        return [rect]
    parts = [
        Rect(rect.x, rect.y, rect.width, inner.y - rect.y),
        Rect(rect.x, inner.y, inner.x - rect.x, inner.height),
        Rect(inner.right, inner.y, rect.right - inner.right, inner.height),
        Rect(rect.x, inner.bottom, rect.width, rect.bottom - inner.bottom),
    ]
    return [part for part in parts if part]


layout_of = lru_cache(maxsize=16)(Layout)  # a window asks for its layout at every event, and it seldom changes


def natural_size(arena: Vector, panes: int, desktop: tuple[int, int]) -> tuple[int, int]:
    """Choose the size of a new window: every arena at its own size, or as large as fits on the desktop."""

    def size(columns: int) -> Vector:
        return arena[0] * columns, arena[1] * math.ceil(panes / columns)

    def shrink(columns: int) -> float:
        width, height = size(columns)
        return min(1.0, 0.9 * desktop[0] / width, (0.9 * (1 - CHARTS_SHARE) * desktop[1] - CHROME_HEIGHT) / height)

    columns = max(range(min(panes, 2), panes + 1), key=shrink)  # two side by side, whatever their shape
    width, height = (side * shrink(columns) for side in size(columns))
    return max(640, round(width)), max(480, round((height + CHROME_HEIGHT) / (1 - CHARTS_SHARE)))
