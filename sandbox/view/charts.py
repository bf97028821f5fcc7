"""Charts of a run on one axis of time: energy, gap to the reference, momentum.

New samples are added to the picture that is there. All of it is drawn again only if an axis must become longer or the
window has changed.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import pygame
from pygame import Rect, Surface

from sandbox.session.monitor import Marks
from sandbox.state import Floats
from sandbox.view.chart_data import ChartData, Quantity
from sandbox.view.palette import Line, Palette, chart_background, palette
from sandbox.view.primitives import dashes, lettering, round_up

MIN_LOGARITHMIC: Final = 1e-14  # the lowest value on a logarithmic axis
MAX_FIRST_SECONDS: Final = 60.0  # on the axis of time at the start of a run
HEADROOM: Final = 1.1  # length of an axis, in units of its last number
ROUNDED_DOWN: Final = 1.08  # values up to so many times an axis' last number need no higher one


@dataclass(frozen=True)
class Axes:
    """The ranges of the axes: seconds from 0, and each quantity's lowest and highest value (or their log10)."""

    seconds: float
    spans: tuple[tuple[float, float], ...]


class Charts:
    """The strip of charts at the bottom of the window."""

    def __init__(self, data: ChartData) -> None:
        self.data = data
        self.marks = Marks()
        self.palette: Palette = palette(chart_background(data.scene.arena.background))
        self._drawn: Surface | None = None
        self._drawn_as: tuple[Axes, Rect, int, int] | None = None  # axes, place, text height, drops of that picture
        self._samples = 0  # how many of the series are drawn
        self._axes = Axes(min(data.scene.seconds, MAX_FIRST_SECONDS), ())
        self._seen = 0  # how many samples the axes include
        self._extent: list[tuple[float, float]] = []  # of each quantity in those samples

    def draw(self, surface: Surface, place: Rect, text_height: int, time: float) -> None:
        """Draw the charts with all samples, marks, and a cursor at a time (s)."""
        if not place.height:
            return
        self._extend_axes()
        plots = self.plots(place, text_height)
        wanted = (self._axes, place, text_height, self.data.series.drops)
        if self._drawn is None or wanted != self._drawn_as:
            self._drawn, self._drawn_as, self._samples = Surface(place.size), wanted, 0
            self._draw_axes(self._drawn, plots, text_height)
        self._draw_lines(self._drawn, plots, text_height)
        surface.blit(self._drawn, place)
        ground = surface.subsurface(place)
        self._draw_marks(ground, plots, text_height)
        self._draw_cursor(ground, plots, text_height, time)

    def plots(self, place: Rect, text_height: int) -> list[Rect]:
        """Return the place of each chart's lines, without its axes, within the strip."""
        left = round(8.2 * text_height)
        bottom = round(1.4 * text_height)
        count, gap = len(self.data.quantities), max(2, text_height // 4)
        height = (place.height - bottom) / count
        right = text_height
        return [
            Rect(left, round(k * height) + gap, max(1, place.width - left - right), round(height) - gap)
            for k in range(count)
        ]

    def time_at(self, place: Rect, text_height: int, point: tuple[int, int]) -> float | None:
        """Return the time (s) of a point of the window in charts at a place, or None if it is outside of them."""
        if not place.collidepoint(point):
            return None
        plot = self.plots(place, text_height)[0]
        share = (point[0] - place.x - plot.x) / plot.width
        return min(max(share, 0.0), 1.0) * self._axes.seconds

    def _extend_axes(self) -> None:
        """Make the axes include all samples. They grow in large steps, so that they seldom change."""
        data = self.data
        if self._seen > len(data.series) or self._drawn_as is None or self._drawn_as[3] != data.series.drops:
            self._seen, self._extent = 0, []
        if self._seen == len(data.series):
            return
        spans = []
        for k, quantity in enumerate(data.quantities):
            new = data.of(k)[self._seen :]
            if quantity.logarithmic:
                new = new[new > 0]
            low, high = (float(new.min()), float(new.max())) if new.size else (np.inf, -np.inf)
            if self._extent:
                low, high = min(low, self._extent[k][0]), max(high, self._extent[k][1])
            spans.append((low, high))
        self._extent, self._seen = spans, len(data.series)
        latest = float(data.times[-1])
        self._axes = Axes(
            _seconds(self._axes.seconds, latest),
            tuple(
                _decades(low, high) if quantity.logarithmic else _from_zero(low, high)
                for quantity, (low, high) in zip(data.quantities, spans, strict=True)
            ),
        )

    def _x(self, plot: Rect, time: Floats) -> Floats:
        return plot.x + time / self._axes.seconds * (plot.width - 1)

    def _column(self, plot: Rect, time: float) -> int:
        return round(self._x(plot, np.array([time])).item())

    def _draw_axes(self, surface: Surface, plots: list[Rect], text_height: int) -> None:
        colours = self.palette
        surface.fill(colours.ground)
        small = max(10, round(0.8 * text_height))
        interval = round_up(self._axes.seconds * 5 * text_height / plots[0].width)
        for k in range(int(self._axes.seconds / interval * (1 + 1e-9)) + 1):
            x = self._column(plots[0], k * interval)
            pygame.draw.line(surface, colours.faint, (x, 0), (x, plots[-1].bottom))
            number = lettering(f"{k * interval:g} s", colours.ink, small)
            at = min(x - number.get_width() // 2, surface.get_width() - number.get_width())
            surface.blit(number, (at, plots[-1].bottom + (surface.get_height() - plots[-1].bottom - small) // 2 - 1))
        for quantity, plot, span in zip(self.data.quantities, plots, self._axes.spans, strict=True):
            pygame.draw.line(surface, colours.ink, plot.bottomleft, (plot.right - 1, plot.bottom))
            self._write_span(surface, quantity, plot, span, small)

    def _write_span(
        self, surface: Surface, quantity: Quantity, plot: Rect, span: tuple[float, float], height: int
    ) -> None:
        """Write a chart's title, and both ends of its axis."""
        colours = self.palette
        ends = (f"{value:.6g}" for value in (10.0 ** np.array(span) if quantity.logarithmic else span))
        for text, value in zip(ends, span, strict=True):
            number = lettering(text, colours.ink, height)
            y = round(_y(plot, span, np.array([value])).item())
            pygame.draw.line(surface, colours.faint, (plot.x, y), (plot.right - 1, y))
            top = min(max(y - number.get_height() // 2, plot.y), plot.bottom - number.get_height() + 2)
            surface.blit(number, (plot.x - number.get_width() - height // 2, top))
        for line, text in enumerate((quantity.title, quantity.unit)):
            if (line + 1) * height * 1.3 <= plot.height:
                surface.blit(lettering(text, colours.ink, height), (height // 2, plot.y + round(line * 1.3 * height)))

    def _draw_lines(self, surface: Surface, plots: list[Rect], text_height: int) -> None:
        """Draw the samples that are not drawn yet."""
        data = self.data
        if self._samples == len(data.series):
            return
        since = max(0, self._samples - 1)
        times = data.times[since:]
        width = max(1, round(text_height / 8))
        for k, (quantity, plot, span) in enumerate(zip(data.quantities, plots, self._axes.spans, strict=True)):
            values = data.of(k)[since:]
            surface.set_clip(plot.inflate(0, 2))
            for engine in range(len(data.engines)):
                # A logarithmic axis has no place for 0, such as the reference's own gap.
                shown = values[:, engine] > 0 if quantity.logarithmic else np.ones(len(values), bool)
                y = _y(plot, span, np.log10(values[shown, engine]) if quantity.logarithmic else values[shown, engine])
                self._draw_line(surface, self.palette.line(engine), self._x(plot, times[shown]), y, width)
        surface.set_clip(None)
        self._samples = len(data.series)

    @staticmethod
    def _draw_line(surface: Surface, line: Line, x: Floats, y: Floats, width: int) -> None:
        if len(x) < 2:
            return
        for start, end in dashes(float(x[0]), float(x[-1]), line.dash, width):
            inside = (x > start) & (x < end)
            xs = [start, *x[inside].tolist(), end]
            ys = [float(np.interp(start, x, y)), *y[inside].tolist(), float(np.interp(end, x, y))]
            pygame.draw.lines(surface, line.colour, False, list(zip(xs, ys, strict=True)), width)

    def _draw_marks(self, surface: Surface, plots: list[Rect], text_height: int) -> None:
        """Draw the end of the reference's trust and first differences as labelled lines through all charts."""
        marks = [
            (time, f"{name}: first difference", self.palette.line(self.data.engines.index(name)))
            for name, time in self.marks.differences.items()
        ]
        trust = self.marks.trust
        if trust.until is not None:
            marks.append((trust.until, trust.ends_by, Line(self.palette.ink, (2, 2))))
        small = max(10, round(0.8 * text_height))
        for row, (time, text, line) in enumerate(marks):
            if time > self._axes.seconds:
                continue
            x = self._column(plots[0], time)
            for start, end in dashes(0, plots[-1].bottom, line.dash, 2):
                pygame.draw.line(surface, line.colour, (x, round(start)), (x, round(end)))
            top = row * round(1.3 * small)
            pygame.draw.polygon(surface, line.colour, [(x - 4, top), (x + 4, top), (x, top + 7)])
            label = lettering(text, self.palette.ink, small)
            left = x + 6 if x + 6 + label.get_width() <= surface.get_width() else x - 6 - label.get_width()
            surface.fill(self.palette.ground, label.get_rect(topleft=(left, top)))
            surface.blit(label, (left, top))

    def _draw_cursor(self, surface: Surface, plots: list[Rect], text_height: int, time: float) -> None:
        x = self._column(plots[0], min(time, self._axes.seconds))
        bottom = plots[-1].bottom
        pygame.draw.line(surface, self.palette.ink, (x, 0), (x, bottom))
        knob = text_height // 3
        pygame.draw.polygon(surface, self.palette.ink, [(x - knob, 0), (x + knob, 0), (x, knob)])


def _y(plot: Rect, span: tuple[float, float], value: Floats) -> Floats:
    """Return the height at which a value stands in a chart, px of the strip."""
    low, high = span
    return plot.bottom - 1 - (value - low) / ((high - low) * HEADROOM) * (plot.height - 1)


def _from_zero(low: float, high: float) -> tuple[float, float]:
    """Return a range of round numbers that includes 0 and all values; the headroom has room for those just above."""
    return (-round_up(-low) if low < 0 else 0.0), round_up(high / ROUNDED_DOWN) if high > 0 else 1.0


def _decades(low: float, high: float) -> tuple[float, float]:
    """Return the range of powers of ten that includes all values, as exponents."""
    if high < low:
        return -3.0, 3.0
    bottom = np.floor(np.log10(max(low, MIN_LOGARITHMIC)))
    return float(bottom), float(max(np.ceil(np.log10(max(high, MIN_LOGARITHMIC))), bottom + 1))


def _seconds(length: float, latest: float) -> float:
    """Return the length of the axis of time, s: doubled until it includes the latest sample."""
    while length < latest:
        length *= 2
    return length
