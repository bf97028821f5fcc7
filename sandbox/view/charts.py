"""Charts of a run against the reference, each with the instrument that one chooses; above them what stands out.

New samples are added to the picture that is there. All of it is drawn again only if an axis changes or the window has
changed. The latest sample is left out: the next step can change how it compares with the reference.
"""

from collections.abc import Sequence

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.report.scales import Span, round_up
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.session.monitor import Marks
from sandbox.session.samples import Samples
from sandbox.state import Floats
from sandbox.view.chart_marks import Mark, draw_marks, mark_at, marks_of, placed_marks
from sandbox.view.chart_places import ChartPlaces, chart_places, small, spread
from sandbox.view.instruments import LAW, Instrument, TimeChart, default_instruments, time_charts
from sandbox.view.layout import ScreenPoint
from sandbox.view.palette import chart_background, palette
from sandbox.view.primitives import card, lettering, shortened, text_width
from sandbox.view.speed_chart import SPEED_TITLE, SpeedChart
from sandbox.view.time_axis import TimeAxis

NOTHING: tuple[float, float] = (np.inf, -np.inf)  # the least and the largest of no values


class Charts:
    """The strip of charts at the bottom of the window.

    chosen: what they show, None for the default; note: what is to be said of the reference; moment: the one shown.
    """

    def __init__(self, samples: Samples, background: str, seconds: float) -> None:
        self.samples = samples
        self.marks = Marks()
        self.note = ""
        self.moment: Moment | None = None
        self.axis = TimeAxis(seconds)
        self.palette = palette(chart_background(background))
        self._colours = self.palette.engines(samples.engines) | {LAW: self.palette.law}
        self._names = max(text_width(name, 100) for name in self._colours) / 100  # widest, in heights of its text
        self._speeds = SpeedChart(samples.reference, self._colours, self.palette)
        self._drawn: Surface | None = None
        self._drawn_as: object = None  # axes, places, drops and remarks of that picture
        self._remarked: Scene | None = None  # the scene of the remarks
        self.show(None)

    # What they show

    def show(self, chosen: tuple[Instrument, ...] | None) -> None:
        """Show these instruments, or the default."""
        self.chosen = chosen
        self.instruments = chosen or default_instruments(self.samples)
        self._over_time = time_charts(self.instruments, self.samples)
        self._columns = [chart.columns(self.samples) for chart in self._over_time]
        self._remarks = [""] * len(self._over_time)
        self._remarked = None
        self._samples = 0  # how many of the series are drawn
        self._seen = 0, 0.0, 0  # drops of the series, scale of energy, and how many samples the spans include
        self._has_scale = bool(self.samples.energy_scale)
        self._extents = [NOTHING] * len(self._over_time)  # of those samples
        self._spans = self._new_spans()
        self._drawn = None

    def choose(self, chart: int, instrument: Instrument) -> None:
        """Let a chart show an instrument; one that shows it already gets what this one showed."""
        chosen = list(self.instruments)
        if instrument in chosen:
            chosen[chosen.index(instrument)] = chosen[chart]
        chosen[chart] = instrument
        self.show(tuple(chosen))

    # Where things are

    def places(self, place: Rect, text_height: int) -> ChartPlaces:
        """Return where everything is within the strip."""
        names = round(self._names * small(text_height))
        return chart_places(place.size, text_height, names, self.instruments)

    def corner(self, place: Rect, text_height: int, chart: int) -> Rect | None:
        """Return the place of a chart's title in the window; None if there is no room for the chart."""
        corner = self.places(place, text_height).corners.get(chart) if place.height else None
        return corner.move(place.topleft) if corner else None

    def is_over_time(self, place: Rect, text_height: int, point: ScreenPoint) -> bool:
        """Return whether a point of the window is in the charts over time, or in their margins."""
        return bool(place.height) and self.places(place, text_height).timeline.move(place.topleft).collidepoint(point)

    def time_at(self, place: Rect, text_height: int, x: int) -> float:
        """Return the time (s) of a column of the window, clamped to the axis of charts at a place."""
        return self.axis.time_at(self.places(place, text_height).plots[0], x - place.x)

    def mark_at(self, place: Rect, text_height: int, point: ScreenPoint) -> Mark | None:
        """Return the mark whose label or tick a point of the window is on, in charts at a place."""
        where = self.places(place, text_height)
        x, y = point[0] - place.x, point[1] - place.y
        return mark_at(self._placed_marks(where, text_height), self.axis, where.plots[0], x, y)

    def _placed_marks(self, where: ChartPlaces, text_height: int) -> list[tuple[Mark, Rect]]:
        marks = marks_of(self.marks, self.note, self.samples.reference, self._colours, self.palette.ink)
        return placed_marks(marks, self.axis, where.plots[0], where.timeline.right, text_height)

    # Following the run

    def _extend_spans(self) -> None:
        """Make the axes include all samples but the latest. They grow in large steps, so that they seldom change."""
        series, settled = self.samples.series, self._settled
        scale = self.samples.energy_scale
        *drawn, seen = self._seen
        if drawn != [series.drops, scale]:
            seen, self._extents = 0, [NOTHING] * len(self._over_time)
        self._seen = series.drops, scale, settled
        if seen >= settled:
            return
        before = list(self._extents)
        for k, chart in enumerate(self._over_time):
            new = chart.values(self.samples, seen)[: settled - seen]
            new = new[np.isfinite(new)]
            if new.size:
                low, high = self._extents[k]
                self._extents[k] = min(low, float(new.min())), max(high, float(new.max()))
        if self._extents != before:
            self._spans = self._new_spans()

    def _new_spans(self) -> list[Span]:
        return [chart.scale.span(*extent) for chart, extent in zip(self._over_time, self._extents, strict=True)]

    def _update_remarks(self) -> None:
        scene = self.moment.scene if self.moment else None
        if scene is not None and scene is not self._remarked:
            self._remarked = scene
            self._remarks = [chart.remark(self.samples, scene) for chart in self._over_time]

    @property
    def _settled(self) -> int:
        return max(1, len(self.samples) - 1)

    # Drawing

    def draw(
        self, surface: Surface, place: Rect, text_height: int, time: float, point: ScreenPoint | None = None
    ) -> None:
        """Draw the charts with all samples, marks, and a cursor at a time (s); the values at a point of the window."""
        if not place.height:
            return
        if self._has_scale != bool(self.samples.energy_scale):  # then energy is in another unit
            self.show(self.chosen)
        self.axis.follow(time, float(self.samples.times[-1]))
        self._extend_spans()
        self._update_remarks()
        where = self.places(place, text_height)
        samples = self.samples
        scale = samples.energy_scale
        wanted = (self.axis.shown, self._spans, where, text_height, samples.series.drops, scale, self._remarks)
        if self._drawn is None or wanted != self._drawn_as:
            self._drawn, self._samples = Surface(place.size), 0
            self._drawn_as = (*wanted[:1], list(self._spans), *wanted[2:])
            self._draw_axes(self._drawn, where, text_height)
        self._draw_lines(self._drawn, where.plots, text_height)
        surface.blit(self._drawn, place)
        ground = surface.subsurface(place)
        if where.histogram and self.moment:
            side = Rect(where.timeline.right, 0, place.width - where.timeline.right, place.height)
            self._speeds.draw(ground, side, where.histogram, self.moment, small(text_height))
            corner = where.corners[self.instruments.index(Instrument.SPEEDS)]
            draw_title(ground, corner, SPEED_TITLE, self.palette.ink, small(text_height))
        self._draw_names(ground, where, text_height)
        self._draw_selection(ground, where.plots)
        draw_marks(
            ground,
            self._placed_marks(where, text_height),
            self.axis,
            where.plots,
            self.palette,
            text_height,
        )
        self._draw_cursor(ground, where.plots, text_height)
        if point and place.collidepoint(point):
            self._draw_card(surface, place, text_height, point)

    def _draw_axes(self, surface: Surface, where: ChartPlaces, text_height: int) -> None:
        surface.fill(self.palette.ground)
        plots, height = where.plots, small(text_height)
        start, seconds = self.axis.shown
        interval = round_up(seconds * 5 * text_height / plots[0].width)
        first, last = int(np.ceil(start / interval - 1e-9)), int((start + seconds) / interval * (1 + 1e-9))
        for k in range(first, last + 1):
            x = self.axis.column(plots[0], k * interval)
            pygame.draw.line(surface, self.palette.faint, (x, plots[0].y), (x, plots[-1].bottom))
            number = lettering(f"{k * interval:.6g} s", self.palette.ink, height)
            at = min(x - number.get_width() // 2, where.timeline.right - number.get_width())
            surface.blit(number, (at, plots[-1].bottom + (surface.get_height() - plots[-1].bottom - height) // 2 - 1))
        for chart, plot, span, remark in zip(self._over_time, plots, self._spans, self._remarks, strict=False):
            self._write_axis(surface, chart, plot, span, height)
            corner = where.corners[self.instruments.index(chart.instrument)]
            draw_title(surface, corner, chart.lines, self.palette.ink, height)
            if remark:
                line = lettering(remark, self.palette.ink, height)
                surface.blit(line, line.get_rect(right=plot.right - 2, top=plot.y + 2))

    def _write_axis(self, surface: Surface, chart: TimeChart, plot: Rect, span: Span, height: int) -> None:
        """Write as many of a chart's values as there is room for."""
        written = list[Rect]()
        for at, text in chart.scale.ticks(span):
            number = lettering(text, self.palette.ink, height)
            y = round(float(_y(plot, span, np.array(at))))
            pygame.draw.line(surface, self.palette.faint, (plot.x, y), (plot.right - 1, y))
            place = number.get_rect(right=plot.x - height // 2, centery=y)
            place.clamp_ip(place.x, plot.y - 2, place.width, plot.height + 4)
            if place.inflate(0, height // 3).collidelist(written) < 0:
                surface.blit(number, place)
                written.append(place)
        if chart.instrument is Instrument.ENERGY:
            zero = round(float(_y(plot, span, np.array(0.0))))
            pygame.draw.line(surface, self._colours[self.samples.reference], (plot.x, zero), (plot.right - 1, zero))

    def _draw_lines(self, surface: Surface, plots: Sequence[Rect], text_height: int) -> None:
        """Draw the samples that are not drawn yet."""
        settled = self._settled
        if self._samples == settled:
            return
        start, seconds = self.axis.shown
        since, width = max(0, self._samples - 1), max(1, round(text_height / 8))
        times = self.samples.times[since:settled]
        shown = slice(*np.searchsorted(times, [start, start + seconds]))
        shown = slice(max(0, shown.start - 1), shown.stop + 1)
        for chart, columns, plot, span in zip(self._over_time, self._columns, plots, self._spans, strict=False):
            position = chart.scale.position(chart.values(self.samples, since)[: settled - since][shown])
            x, y = self.axis.x(plot, times[shown]), _y(plot, span, position)
            surface.set_clip(plot.inflate(0, 2 * width))
            for name, column in columns.items():
                known = np.isfinite(y[:, column])
                if known.sum() > 1:
                    line = np.column_stack([x[known], y[known, column]]).tolist()
                    pygame.draw.lines(surface, self._colours[name], False, line, width)
        surface.set_clip(None)
        self._samples = settled

    def _draw_names(self, surface: Surface, where: ChartPlaces, text_height: int) -> None:
        """Write each line's engine at its end."""
        plots = where.plots
        height, times = small(text_height), self.samples.times[: self._settled]
        last = int(np.searchsorted(times, sum(self.axis.shown), side="right")) - 1
        if last < 0:
            return
        x = min(self.axis.column(plots[0], float(times[last])), plots[0].right) + height // 3
        for chart, columns, plot, span in zip(self._over_time, self._columns, plots, self._spans, strict=False):
            values = chart.values(self.samples, last)[0]
            ends = {name: values[column] for name, column in columns.items() if np.isfinite(values[column])}
            if chart.instrument is Instrument.ENERGY:
                ends |= {self.samples.reference: ends.get(self.samples.reference, 0.0)}
            wanted = _y(plot, span, chart.scale.position(np.array(list(ends.values())))) - height / 2
            tops = spread(wanted.tolist(), [height] * len(ends), plot.y - 1, plot.bottom + 1)
            for name, y in zip(ends, tops, strict=True):
                label, room = lettering(name, self._colours[name], height), where.timeline.right - x
                if label.get_width() > room:
                    label = lettering(shortened(name, room, height), self._colours[name], height)
                surface.fill(self.palette.ground, label.get_rect(topleft=(x, round(y))))
                surface.blit(label, (x, round(y)))

    def _draw_selection(self, surface: Surface, plots: Sequence[Rect]) -> None:
        if self.axis.selection:
            first, last = sorted(self.axis.column(plots[0], time) for time in self.axis.selection)
            veil = Surface((last - first + 1, plots[-1].bottom - plots[0].y))
            veil.fill(self.palette.ink)
            veil.set_alpha(40)
            surface.blit(veil, (first, plots[0].y))

    def _draw_cursor(self, surface: Surface, plots: Sequence[Rect], text_height: int) -> None:
        x, knob = self.axis.column(plots[0], self.axis.time), text_height // 3
        if plots[0].x <= x <= plots[0].right:
            bottom = plots[-1].bottom
            pygame.draw.line(surface, self.palette.ink, (x, plots[0].y), (x, bottom))
            pygame.draw.polygon(
                surface, self.palette.ink, [(x - knob, bottom + knob), (x + knob, bottom + knob), (x, bottom)]
            )

    # Values

    def _draw_card(self, surface: Surface, place: Rect, text_height: int, point: ScreenPoint) -> None:
        """Draw the values at a point, or what the mark there means."""
        where, at = self.places(place, text_height), (point[0] - place.x, point[1] - place.y)
        if where.corner_at(*at) is not None:
            return
        mark = self.mark_at(place, text_height, point)
        if where.histogram and at[0] >= where.timeline.right:
            if self.moment is None:
                return
            rows = self._speeds.rows_at(where.histogram, at[0], self.moment)
        elif mark:
            rows = [[f"{mark.time:.2f} s", mark.text], ["", mark.sentence]]
        else:
            rows = self._values_at(where.plots, *at)
            faint = self.palette.ground.lerp(self.palette.ink, 0.5)
            pygame.draw.line(surface, faint, (point[0], place.y), (point[0], place.bottom))
        card(surface, rows, point, text_height, surface.get_rect())

    def _values_at(self, plots: Sequence[Rect], x: int, y: int) -> list[list[str]]:
        number = min(range(len(plots)), key=lambda k: abs(plots[k].centery - y))
        chart, times = self._over_time[number], self.samples.times[: self._settled]
        row = int(np.abs(times - self.axis.time_at(plots[0], x)).argmin())
        values = chart.values(self.samples, row)[0]
        rows = [[f"{times[row]:.3f} s", " ".join(chart.lines)]]
        for name, column in self._columns[number].items():
            value = chart.digits.format(values[column]) if np.isfinite(values[column]) else "not known"
            rows.append([name, value])
        return rows


def draw_title(surface: Surface, corner: Rect, lines: Sequence[str], colour: Color, height: int) -> None:
    """Draw a chart's title, as many lines as there is room for, with the mark that another can be chosen."""
    for line, text in enumerate(lines):
        y = corner.y + 2 + round(1.3 * line * height)
        if not line or y + height <= corner.bottom:
            surface.blit(lettering(text, colour, height), (corner.x + height // 2, y))
    x, y, wing = corner.x + height + text_width(lines[0], height), corner.y + 2 + height // 3, max(2, height // 4)
    pygame.draw.polygon(surface, colour, [(x, y), (x + 2 * wing, y), (x + wing, y + wing)])


def _y(plot: Rect, span: Span, position: Floats) -> Floats:
    """Return the height at which a position on an axis is in a chart, px of the strip."""
    low, high = span
    return plot.bottom - 1 - (position - low) / (high - low) * (plot.height - 1)
