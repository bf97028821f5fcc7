"""Where things stand in a window: a toolbar, panes side by side as large as they can be, charts, a status line."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from pygame import Rect

from sandbox.scene.model import Vector

GAP = 8  # px between panes and round them
AROUND = 110  # px, about, of toolbar, titles and status line
STRIP = 0.27  # of the window's height, for the charts
LEAST: Final = (480, 320)  # px of a window that has room for all of this


@dataclass(frozen=True)
class Layout:
    """A window of some size with a pane per engine, each a title over an arena.

    Above the panes stand the toolbar's widgets, below them the charts and a status line. window and arena: width and
    height, px of the screen and of the scene. tools: the widgets' widths, in heights of the toolbar, in groups.
    charts: how many; they are left out where there is no room for them.
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
        """Each widget's place: in rows from the left, with a gap between groups."""
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
        """Where the panes begin, px."""
        return self.toolbar[-1].bottom if self.toolbar else 0

    @cached_property
    def strip(self) -> Rect:
        """Where the charts go, above the status line; of no height where there are none, or no room for them."""
        height = round(STRIP * self.window[1])
        if not self.charts or height < self.charts * 2.2 * self.text_height + self.line_height:
            height = 0
        return Rect(GAP, self.status.y - height, max(1, self.window[0] - 2 * GAP), height)

    @cached_property
    def bar(self) -> Rect:
        """Where the bar of time goes: above the status line of a window that has no charts; else of no height."""
        height = 0 if self.strip.height or not self.tools else round(0.7 * self.text_height)
        return Rect(GAP, self.strip.y - height, self.strip.width, height)

    @cached_property
    def columns(self) -> int:
        """How many panes stand side by side: as many as make them largest."""
        return max(range(1, self.panes + 1), key=self._scale)

    @cached_property
    def scale(self) -> float:
        """Px of the screen for one px of the scene."""
        return self._scale(self.columns)

    def _room(self, columns: int) -> Vector:
        """Width and height that a pane's arena may take."""
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

    def title(self, pane: int) -> Rect:
        """Where a pane's title goes: right above its arena."""
        arena = self.arenas[pane]
        return Rect(arena.x, arena.y - self.line_height, arena.width, self.line_height)

    @cached_property
    def status(self) -> Rect:
        """Where the status line goes."""
        return Rect(GAP, self.window[1] - self.line_height, max(1, self.window[0] - 2 * GAP), self.line_height)

    def to_scene(self, pane: int, point: tuple[int, int]) -> Vector:
        """Turn a point of the screen into one of a pane's scene, px."""
        arena = self.arenas[pane]
        return (point[0] - arena.x) / self.scale, (point[1] - arena.y) / self.scale

    def pane_at(self, point: tuple[int, int]) -> int | None:
        """Return the pane whose arena has a point of the screen in it."""
        return next((pane for pane, arena in enumerate(self.arenas) if arena.collidepoint(point)), None)


def natural_size(arena: Vector, panes: int, desktop: tuple[int, int]) -> tuple[int, int]:
    """Choose the size of a new window: every arena at its own size, or as large as the desktop has room for."""

    def size(columns: int) -> Vector:
        return arena[0] * columns, arena[1] * math.ceil(panes / columns)

    def shrink(columns: int) -> float:
        width, height = size(columns)
        return min(1.0, 0.9 * desktop[0] / width, (0.9 * (1 - STRIP) * desktop[1] - AROUND) / height)

    columns = max(range(min(panes, 2), panes + 1), key=shrink)  # two side by side, whatever their shape
    width, height = (side * shrink(columns) for side in size(columns))
    return max(640, round(width)), max(480, round((height + AROUND) / (1 - STRIP)))
