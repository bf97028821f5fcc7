"""The places of everything in a window: a toolbar, panes as large as they can be, charts, a status line."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

from pygame import Rect

from sandbox.scene.fields import Vector

GAP: Final = 8  # px between panes and round them
CHROME_HEIGHT: Final = 110  # px, about, of toolbar, titles and status line
CHARTS_SHARE: Final = 0.27  # of the window's height, for the charts
MIN_SIZE: Final = (480, 320)  # px, the smallest window with room for all of this
ScreenPoint = tuple[int, int]


@dataclass(frozen=True)
class Layout:
    """A window with one pane per engine, each a title over an arena; the toolbar above, charts and status line below.

    window: width and height, px of the screen. arena: width and height, px of the scene. tools: the widgets' widths,
    in heights of the toolbar, in groups. charts: how many; they are left out if there is no room for them.
    """

    window: tuple[int, int]
    arena: Vector
    panes: int
    tools: tuple[tuple[float, ...], ...] = ()
    charts: int = 0

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
        """Each widget's place: rows from the left, with a gap between groups."""
        side, places = round(1.75 * self.text_height), []
        x, y = GAP, GAP // 2
        for group in self.tools:
            for share in group:
                width = round(share * side)
                if x + width > self.window[0] - GAP:
                    x, y = GAP, y + side + 2
                places.append(Rect(x, y, width, side))
                x += width + 2
            x += side // 3
        return places

    @cached_property
    def top(self) -> int:
        """The upper edge of the panes, px."""
        return self.toolbar[-1].bottom if self.toolbar else 0

    @cached_property
    def strip(self) -> Rect:
        """The place of the charts, above the status line; its height is 0 if none are shown or there is no room."""
        height = round(CHARTS_SHARE * self.window[1])
        if not self.charts or height < self.charts * 2.2 * self.text_height + self.line_height:
            height = 0
        return Rect(GAP, self.status.y - height, max(1, self.window[0] - 2 * GAP), height)

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
    def scale(self) -> float:
        """Px of the screen for one px of the scene."""
        return self._scale(self.columns)

    def _room(self, columns: int) -> Vector:
        """Return the width and height available to a pane's arena, px."""
        rows = math.ceil(self.panes / columns)
        width = (self.window[0] - GAP) / columns - GAP
        height = (self.bar.y - self.top - GAP) / rows - GAP - self.line_height
        return max(width, 1.0), max(height, 1.0)

    def _scale(self, columns: int) -> float:
        return min(room / size for room, size in zip(self._room(columns), self.arena, strict=True))

    @cached_property
    def arenas(self) -> list[Rect]:
        """Each pane's arena on the screen."""
        width, height = self._room(self.columns)
        size = [max(1, round(side * self.scale)) for side in self.arena]
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
        for covered in (*self.arenas, self.strip):
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
        return (point[0] - arena.x) / self.scale, (point[1] - arena.y) / self.scale

    def pane_at(self, point: ScreenPoint) -> int | None:
        """Return the pane whose arena contains a point of the screen."""
        return next((pane for pane, arena in enumerate(self.arenas) if arena.collidepoint(point)), None)


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
