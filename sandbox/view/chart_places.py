"""Where everything is within the strip of charts: charts over time below each other, a histogram at the right."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from pygame import Rect

from sandbox.view.instruments import Instrument

MIN_PLOT: Final = 2.7  # heights of text; where there is less room, the last charts are left out
AXIS: Final = 8.2  # heights of text, for the title and the numbers of a chart over time
HISTOGRAM_AXIS: Final = 6.5  # likewise of a histogram
HISTOGRAM: Final = 24  # width of a histogram with its axis, in heights of text,
HISTOGRAM_SHARE: Final = 0.42  # or of the strip, if that is less


@dataclass(frozen=True)
class ChartPlaces:
    """Places in px of the strip.

    plots: of the charts over time, without their axes; histogram: likewise, if it is shown; corners: the title of each
    chart, by its number among all that were chosen; timeline: where a press of the mouse chooses a time.
    """

    plots: tuple[Rect, ...]
    histogram: Rect | None
    corners: dict[int, Rect]
    timeline: Rect

    def corner_at(self, x: int, y: int) -> int | None:
        """Return the chart whose title is at a point of the strip."""
        return next((chart for chart, corner in self.corners.items() if corner.collidepoint(x, y)), None)


def small(text_height: int) -> int:
    """Return the height of the text in charts, px."""
    return max(10, round(0.75 * text_height))


@lru_cache(maxsize=16)
def chart_places(
    size: tuple[int, int], text_height: int, names: int, instruments: tuple[Instrument, ...]
) -> ChartPlaces:
    """Place the charts of some instruments. size: of the strip; names: width of the names at the ends of lines, px."""
    height, gap = small(text_height), max(4, text_height // 2)
    over_time = [k for k, instrument in enumerate(instruments) if instrument is not Instrument.SPEEDS]
    has_histogram = len(over_time) < len(instruments)
    side = round(min(HISTOGRAM * text_height, HISTOGRAM_SHARE * size[0])) if has_histogram else 0
    top, bottom = round(1.5 * height), size[1] - round(1.5 * height)
    left, right = round(AXIS * text_height), min(names + height, size[0] // 5)
    width = max(1, size[0] - side - left - right)
    count = max(1, min(len(over_time), int((bottom - top) / (MIN_PLOT * text_height))))
    ends = [top + round(k * (bottom - top) / count) for k in range(count + 1)]
    plots = [Rect(left, ends[k] + gap, width, ends[k + 1] - ends[k] - gap) for k in range(count)]
    corners = {k: _corner(plot, 0, height) for k, plot in zip(over_time, plots, strict=False)}
    histogram = None
    if has_histogram:
        axis = round(HISTOGRAM_AXIS * text_height)
        x = size[0] - side
        histogram = Rect(x + axis, top + gap, max(1, side - axis - 2 * height), bottom - top - gap)
        corners[instruments.index(Instrument.SPEEDS)] = _corner(histogram, x, height)
    return ChartPlaces(tuple(plots), histogram, corners, Rect(0, 0, size[0] - side, size[1]))


def _corner(plot: Rect, x: int, height: int) -> Rect:
    """Return the place of a title, left of a chart's numbers."""
    room = plot.x - x
    return Rect(x, plot.y - 2, min(room, round(7.2 * height)), min(plot.height, round(2.7 * height)) + 2)


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
