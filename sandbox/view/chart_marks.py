"""Where everything is within the place of the chart, and what stands out in a run as marks above it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.report.run_so_far import Marks
from sandbox.view.palette import Palette
from sandbox.view.primitives import lettering, shortened, text_width
from sandbox.view.time_axis import TimeAxis

AXIS: Final = 4.4  # heights of text, for the numbers of the axis


@dataclass(frozen=True)
class ChartPlaces:
    """Places in px of the chart. plot: without its axes; timeline: where a press of the mouse chooses a time."""

    plot: Rect
    timeline: Rect


def small(text_height: int) -> int:
    """Return the height of the text in charts, px."""
    return max(10, round(0.93 * text_height))


def chart_places(size: tuple[int, int], text_height: int, names: int) -> ChartPlaces:
    """Place a chart. size: of all of it; names: width of the names at the ends of lines, px."""
    height = small(text_height)
    top, bottom = round(2.0 * height), size[1] - round(1.6 * height)
    left, right = round(AXIS * height), min(names + height, size[0] // 4)
    plot = Rect(left, top, max(1, size[0] - left - right), max(1, bottom - top))
    return ChartPlaces(plot, Rect(0, 0, *size))


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
    widths = [text_width(one.text, height) + height for one in shown]
    if sum(widths) > right - left:
        shown = [
            replace(one, text=shortened(one.text, max(1, (right - left) // len(shown) - height), height))
            for one in shown
        ]
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
    surface: Surface,
    placed: list[tuple[Mark, Rect]],
    axis: TimeAxis,
    plot: Rect,
    colours: Palette,
    text_height: int,
) -> None:
    """Draw each mark as a tick above the charts, with its label, and faintly through them."""
    half = max(4, text_height // 4)
    tall = 3 * half // 2
    for mark, label in placed:
        if mark.time is not None:
            x, top = axis.column(plot, mark.time), plot.y
            faint = colours.ground.lerp(mark.colour, 0.5)
            pygame.draw.line(surface, faint, (x, top), (x, plot.bottom))
            pygame.draw.line(surface, mark.colour, (x, top), (min(x, label.x), label.bottom))
            pygame.draw.polygon(surface, mark.colour, [(x - half, top - tall), (x + half, top - tall), (x, top)])
        surface.blit(lettering(mark.text, mark.colour, small(text_height)), label)
