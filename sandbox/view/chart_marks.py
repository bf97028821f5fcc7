"""Where everything is within the place of the chart, and what stands out in a run as marks above it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeVar

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.state import Floats
from sandbox.view.primitives import lettering, shortened, text_width
from sandbox.view.run_so_far import Marks
from sandbox.view.theme import Palette

AXIS: Final = 4.4  # heights of text, for the numbers of the axis
MAX_FIRST_SECONDS: Final = 60.0  # on the axis at the start of a run
MIN_SECONDS: Final = 0.1  # on the axis, however far one zooms in
Time = TypeVar("Time", float, Floats)  # s


class TimeAxis:
    """Which times are shown. time: at the cursor, s."""

    def __init__(self, seconds: float) -> None:
        self.time = 0.0
        self._zoom: tuple[float, float] | None = None  # start and length, s; None shows all
        self._seconds = min(seconds, MAX_FIRST_SECONDS)  # of all

    @property
    def shown(self) -> tuple[float, float]:
        """The first time shown and how many seconds from there on, s."""
        return self._zoom or (0.0, self._seconds)

    def x(self, plot: Rect, time: Time) -> Time:
        """Return where a time (s) is in a chart, px."""
        start, seconds = self.shown
        return plot.x + (time - start) / seconds * (plot.width - 1)

    def column(self, plot: Rect, time: float) -> int:
        """Return the column of a chart in which a time (s) is."""
        return round(self.x(plot, time))

    def time_at(self, plot: Rect, x: int) -> float:
        """Return the time (s) of a column, clamped to what is shown."""
        start, seconds = self.shown
        return start + min(max((x - plot.x) / plot.width, 0.0), 1.0) * seconds

    def show_as(self, other: "TimeAxis") -> None:
        """Show the same part of the time as another axis."""
        self._zoom, self._seconds = other._zoom, other._seconds

    def zoom(self, time: float, factor: float) -> None:
        """Make the axis longer or shorter by a factor, with a time (s) in its place; at most all is shown."""
        start, seconds = self.shown
        self._show(time - (time - start) * factor, seconds * factor)

    def _show(self, start: float, seconds: float) -> None:
        if seconds >= self._seconds:
            self._zoom = None
        else:
            seconds = max(seconds, MIN_SECONDS)
            self._zoom = min(max(start, 0.0), self._seconds - seconds), seconds

    def follow(self, time: float, latest: float) -> None:
        """Let the axis include the latest sample, and a part that is shown follow the cursor out of it. Times: s."""
        while self._seconds < latest:
            self._seconds *= 2
        if self._zoom and self.time <= sum(self._zoom) < time:
            self._zoom = time - self._zoom[1] / 10, self._zoom[1]
        self.time = time


def small(text_height: int) -> int:
    """Return the height of the text in charts, px."""
    return max(10, round(0.93 * text_height))


def plot_of(size: tuple[int, int], text_height: int, names: int) -> Rect:
    """Return the place of a chart without its axes. size: of all of it; names: width of those at the ends of lines."""
    height = small(text_height)
    top, bottom = round(2.0 * height), size[1] - round(1.6 * height)
    left, right = round(AXIS * height), min(names + height, size[0] // 4)
    return Rect(left, top, max(1, size[0] - left - right), max(1, bottom - top))


def spread(wanted: Sequence[float], sizes: Sequence[float], low: float, high: float) -> list[float]:
    """Return where intervals of some sizes begin: near where they are wanted, one after another, within two ends."""
    order = sorted(range(len(wanted)), key=lambda k: wanted[k])
    begin, edge = list(wanted), low
    for k in order:
        begin[k] = max(wanted[k], edge)
        edge = begin[k] + sizes[k]
    edge = high
    for k in reversed(order):
        begin[k] = min(begin[k], edge - sizes[k])
        edge = begin[k]
    return begin


def draw_axis_below(
    surface: Surface, plot: Rect, places: Floats, texts: Sequence[str], ink: Color, height: int
) -> None:
    """Write texts below a chart at some columns, px, each under a tick. height: of the text."""
    right = surface.get_width()
    for x, text in zip(np.rint(places).astype(int).tolist(), texts, strict=True):
        pygame.draw.line(surface, ink, (x, plot.bottom), (x, plot.bottom + height // 3))
        number = lettering(text, ink, height)
        at = min(x - number.get_width() // 2, right - number.get_width())
        surface.blit(number, (at, plot.bottom + height // 3))


MARK_DISTANCE: Final = 4  # px between the pointer and a mark that it points at
NOT_COMPARABLE: Final = "no longer comparable"
SENTENCES: Final = {  # what the ends of the reference's trust mean
    "horizon": "from here on, rounding decides the paths",
    "undecided": "simultaneous contacts, and no law says which comes first",
    "unresolved": "from here on, the paths depend on how a heap is treated",
}


@dataclass(frozen=True)
class Mark:
    """Something that stands out at a time (s), or a note without one."""

    time: float | None
    text: str
    colour: Color
    sentence: str


def marks_of(marks: Marks, note: str, reference: str, colours: Mapping[str, Color], ink: Color) -> list[Mark]:
    """Return the note, first differences, the end of the reference's trust, and of the reference."""
    found = [Mark(None, note, ink, "")] if note else []
    for name, time in marks.differences.items():
        found.append(Mark(time, f"{name} differs", colours[name], f"first contact unlike {reference}'s"))
    if marks.trust.until is not None:
        found.append(Mark(marks.trust.until, NOT_COMPARABLE, ink, SENTENCES[marks.trust.ends_by]))
    if marks.stopped:
        found.append(Mark(marks.stopped[0], f"{reference} stops", ink, marks.stopped[1]))
    return found


def placed_marks(
    marks: list[Mark], axis: TimeAxis, plot: Rect, left: int, right: int, text_height: int
) -> list[tuple[Mark, Rect]]:
    """Return the marks that are shown, with the places of their labels above the charts, none over another.

    plot: of the chart; left, right: between which there is room, px.
    """
    height = small(text_height)
    start, seconds = axis.shown
    shown = [one for one in marks if one.time is None or start <= one.time <= start + seconds]
    wanted = [left if one.time is None else axis.column(plot, one.time) + height // 2 for one in shown]
    if sum(text_width(one.text, height) + height for one in shown) > right - left:
        room = max(1, (right - left) // len(shown) - height)
        shown = [replace(one, text=shortened(one.text, room, height)) for one in shown]
    widths = [text_width(one.text, height) + height for one in shown]
    lefts = spread(wanted, widths, left, right)
    return [(one, Rect(round(x), 1, width, height + 2)) for one, x, width in zip(shown, lefts, widths, strict=True)]


def mark_at(placed: list[tuple[Mark, Rect]], axis: TimeAxis, plot: Rect, x: int, y: int) -> Mark | None:
    """Return the mark whose label a point of the strip is on, or else whose tick above the charts it is near."""
    in_time = [(mark, label, mark.time) for mark, label in placed if mark.time is not None]
    on_label = [mark for mark, label, _ in in_time if label.collidepoint(x, y)]
    near = [mark for mark, _, time in in_time if y < plot.y and abs(x - axis.column(plot, time)) <= MARK_DISTANCE]
    return next(iter([*on_label, *near]), None)


def draw_marks(
    surface: Surface, placed: list[tuple[Mark, Rect]], axis: TimeAxis, plot: Rect, colours: Palette, text_height: int
) -> None:
    """Draw each mark as a triangle above the charts, with its label, and faintly through them."""
    half = max(4, text_height // 4)
    tall = 3 * half // 2
    for mark, label in placed:
        if mark.time is not None:
            x, top = axis.column(plot, mark.time), plot.y
            faint = colours.ground.lerp(mark.colour, 0.5)
            pygame.draw.line(surface, faint, (x, top), (x, plot.bottom))
            pygame.draw.polygon(surface, mark.colour, [(x - half, top - tall), (x + half, top - tall), (x, top)])
        surface.blit(lettering(mark.text, mark.colour, small(text_height)), label)
