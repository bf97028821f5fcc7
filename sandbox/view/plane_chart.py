"""One quantity over another: a curve for each engine, with a marker at the step shown."""

from collections.abc import Mapping
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.report.scales import Span
from sandbox.session.samples import Samples
from sandbox.state import Floats
from sandbox.view.instruments import LAW, TimeChart
from sandbox.view.markers import draw_marker
from sandbox.view.palette import Palette
from sandbox.view.primitives import lettering, write
from sandbox.view.theme import theme

MAX_POINTS: Final = 2_000  # of a curve; of more, one in so many


class PlaneChart:
    """Draws the values of one chart over those of another at the same times.

    up, across: the charts of the two quantities. Engines that one of them does not show have no curve.
    """

    def __init__(self, up: TimeChart, across: TimeChart, colours: Mapping[str, Color], palette: Palette) -> None:
        self._up, self._across = up, across
        self._colours = colours
        self._palette = palette

    def rows_at(self, samples: Samples, time: float) -> list[list[str]]:
        """Return both values of each engine at a time (s), as rows of a table."""
        rows = [[f"{time:.3f} s", self._across.instrument.value, self._up.instrument.value]]
        row = self._row_at(samples, time)
        for name, (x, y) in self._curves(samples, row, row + 1).items():
            if np.isfinite(x + y).all():
                rows.append([name, self._across.text(float(x[0])), self._up.text(float(y[0]))])
        return rows

    @staticmethod
    def _row_at(samples: Samples, time: float) -> int:
        return max(0, min(int(np.abs(samples.times - time).argmin()), len(samples) - 2))

    def _curves(self, samples: Samples, first: int, end: int, every: int = 1) -> dict[str, tuple[Floats, Floats]]:
        """Return the values across and up of each engine that both charts show, in some of the samples."""
        count = end - first
        x, y = (chart.values(samples, first)[:count:every] for chart in (self._across, self._up))
        both = self._across.columns(samples).keys() & self._up.columns(samples).keys() - {LAW}
        columns = [(name, k) for k, name in enumerate(samples.engines) if name in both]
        return {name: (x[:, k], y[:, k]) for name, k in columns}

    def draw(self, surface: Surface, plot: Rect, samples: Samples, time: float, height: int) -> None:
        """Draw axes and curves. plot: without the axes; time: at the markers, s; height: of the text, px."""
        settled = max(1, len(samples) - 1)
        curves = self._curves(samples, 0, settled, -(-settled // MAX_POINTS))
        now = self._curves(samples, row := self._row_at(samples, time), row + 1)
        spans = [_span(chart, [curve[k] for curve in curves.values()]) for k, chart in enumerate(self._charts)]
        self._draw_axes(surface, plot, spans, height)
        surface.set_clip(plot.inflate(8, 8))
        for name in sorted(curves, key=lambda name: name != samples.reference):
            points = self._points(plot, spans, *curves[name])
            if len(points) > 1:
                pygame.draw.lines(surface, self._colours[name], False, points.tolist(), max(1, height // 8))
        for name, values in now.items():
            for x, y in self._points(plot, spans, *values).round().astype(int).tolist():
                draw_marker(surface, self._colours[name], (x, y), height // 2, samples.engines.index(name))
        surface.set_clip(None)
        self._write_names(surface, plot, list(curves), samples, height)

    @property
    def _charts(self) -> tuple[TimeChart, TimeChart]:
        return self._across, self._up

    def _points(self, plot: Rect, spans: list[Span], x: Floats, y: Floats) -> Floats:
        """Return where values are in the chart, px, without those that are not known: (values, 2)."""
        known = np.isfinite(x + y)
        places = [
            (chart.scale.position(values[known]) - low) / (high - low)
            for chart, values, (low, high) in zip(self._charts, (x, y), spans, strict=True)
        ]
        return np.column_stack([plot.x + places[0] * (plot.width - 1), plot.bottom - 1 - places[1] * (plot.height - 1)])

    def _draw_axes(self, surface: Surface, plot: Rect, spans: list[Span], height: int) -> None:
        """Draw a grid with as many numbers as there is room for, and the names of both axes."""
        for k, (chart, (low, high)) in enumerate(zip(self._charts, spans, strict=True)):
            written = list[Rect]()
            for at, text in chart.scale.ticks((low, high)):
                share, number = (at - low) / (high - low), lettering(text, theme.dim, height)
                x, y = round(plot.x + share * (plot.width - 1)), round(plot.bottom - 1 - share * (plot.height - 1))
                start, end = ((x, plot.y), (x, plot.bottom)) if k == 0 else ((plot.x, y), (plot.right - 1, y))
                place = number.get_rect(midtop=(x, plot.bottom + height // 4))
                if k == 1:
                    place = number.get_rect(right=plot.x - height // 2, centery=y)
                if place.inflate(height // 2, height // 3).collidelist(written) < 0:
                    pygame.draw.line(surface, self._palette.faint, start, end)
                    surface.blit(number, place)
                    written.append(place)
        up, across = (f"{chart.instrument.value}, {chart.unit}" for chart in (self._up, self._across))
        line = Rect(plot.x, plot.y - round(1.7 * height), plot.width, round(1.5 * height))
        write(surface, f"{up}, over {across}", line, theme.dim, height)

    def _write_names(self, surface: Surface, plot: Rect, names: list[str], samples: Samples, height: int) -> None:
        """Write the engines in the right margin, each after its marker."""
        line = Rect(plot.right + height // 2, plot.y, surface.get_width() - plot.right, round(1.4 * height))
        for name in names:
            shape = samples.engines.index(name)
            draw_marker(surface, self._colours[name], (line.x + height // 2, line.centery), height // 3, shape)
            text = Rect(line.x + round(1.3 * height), line.y, surface.get_clip().right - line.x, line.height)
            write(surface, name, text, self._colours[name], height)
            line.y += line.height


def _span(chart: TimeChart, curves: list[Floats]) -> Span:
    """Return the ends of an axis that includes all values."""
    values = np.concatenate([curve[np.isfinite(curve)] for curve in curves]) if curves else np.empty(0)
    return chart.scale.span(float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
