"""The chart of a run against the reference; above it what stands out.

New samples are added to the picture that is there. All of it is drawn again only if an axis changes or the window has
changed. The latest sample is left out: the next step can change how it compares with the reference.
"""

import numpy as np
import pygame
from pygame import Rect, Surface

from sandbox.report.scales import Span, round_up
from sandbox.scene.model import Scene
from sandbox.scene.units import PIXELS, Units
from sandbox.session.history import Moment
from sandbox.session.samples import Quantity, Samples
from sandbox.state import Floats
from sandbox.view import chart_marks
from sandbox.view.chart_marks import Mark, TimeAxis, small, spread
from sandbox.view.instruments import LAW, LOGARITHMIC, Even, Instrument, TimeChart, time_chart
from sandbox.view.layout import ScreenPoint
from sandbox.view.primitives import card, draw_marker, lettering, shortened, text_width, write
from sandbox.view.run_so_far import Marks
from sandbox.view.speed_chart import SpeedChart
from sandbox.view.theme import chart_palette, theme

NOTHING: tuple[float, float] = (np.inf, -np.inf)  # the least and the largest of no values


class Charts:
    """The chart of a run: one instrument at a time, whose choice of scale it remembers.

    note: what is to be said of the reference; moment: the one shown.
    """

    def __init__(self, samples: Samples, seconds: float, units: Units = PIXELS) -> None:
        self.samples = samples
        self._units = units
        self.marks = Marks()
        self.note = ""
        self.moment: Moment | None = None
        self.axis = TimeAxis(seconds)
        self.instrument = Instrument.ENERGY
        self.of_ball = Quantity.X  # what the chart of a ball shows
        self._logarithmic: set[Instrument] = set()
        self._remarked: Scene | None  # the scene of the remark
        self.recolour()

    def recolour(self) -> None:
        """Draw in the colours of the theme."""
        samples = self.samples
        self.palette = chart_palette()
        self._colours = self.palette.engines(samples.engines) | {LAW: self.palette.law}
        self._names = max(text_width(name, 100) for name in self._colours) / 100 + 1.0  # in heights of its text
        self._speeds = SpeedChart(samples.reference, self._colours, self.palette)
        self._drawn: Surface | None = None
        self._drawn_as: object = None  # axes, places, drops and remark of that picture
        self.show(self.instrument)

    # What it shows

    def show(self, instrument: Instrument) -> None:
        """Show an instrument."""
        self.instrument = instrument
        self._chart = time_chart(
            instrument, self.samples, self._units, logarithmic=self.is_logarithmic, of_ball=self.of_ball
        )
        self._columns = self._chart.columns(self.samples) if self._chart else {}
        self._remark, self._remarked = "", None
        self._samples = 0  # how many of the series are drawn
        self._seen = 0, 0.0, 0  # drops of the series, scale of energy, and how many samples the span includes
        self._has_scale = bool(self.samples.energy_scale)
        self._extent = NOTHING  # of those samples
        self._span = self._new_span()
        self._drawn = None

    def show_as(self, other: "Charts") -> None:
        """Show what another run's chart shows."""
        self._logarithmic = set(other._logarithmic)
        self.of_ball = other.of_ball
        self.show(other.instrument)

    def show_next(self) -> None:
        """Show the next instrument."""
        instruments = [*Instrument, *Instrument]
        self.show(instruments[instruments.index(self.instrument) + 1])

    def show_of_ball(self, quantity: Quantity) -> None:
        """Show a quantity of the ball that is followed."""
        self.of_ball = quantity
        self.show(Instrument.BALL)

    def follow(self, ball: int) -> None:
        """Show the quantities of a ball by its number among all that ever were in the run."""
        if self.samples.follow(ball):
            self.show(self.instrument)

    @property
    def is_logarithmic(self) -> bool:
        """Whether the axis is logarithmic."""
        return self.instrument in self._logarithmic

    @property
    def why_one_scale(self) -> str:
        """Why the axis cannot be logarithmic, or nothing."""
        return "" if self.instrument in LOGARITHMIC else "only energy and gap have a logarithmic axis too"

    def toggle_scale(self) -> None:
        """Let the axis be logarithmic, or linear again."""
        if not self.why_one_scale:
            self._logarithmic ^= {self.instrument}
            self.show(self.instrument)

    # Where things are

    def plot(self, place: Rect, text_height: int) -> Rect:
        """Return where the chart is within its place, without its axes."""
        return chart_marks.plot_of(place.size, text_height, round(self._names * small(text_height)))

    def is_over_time(self, place: Rect, point: ScreenPoint) -> bool:
        """Return whether a point of the window is in a chart over time, or in its margins."""
        return self._chart is not None and bool(place.height) and bool(place.collidepoint(point))

    def time_at(self, place: Rect, text_height: int, x: int) -> float:
        """Return the time (s) of a column of the window, clamped to the axis of a chart at a place."""
        return self.axis.time_at(self.plot(place, text_height), x - place.x)

    def mark_at(self, place: Rect, text_height: int, point: ScreenPoint) -> Mark | None:
        """Return the mark whose label or tick a point of the window is on, in a chart at a place."""
        marks, x, y = self._placed_marks(place, text_height), point[0] - place.x, point[1] - place.y
        return chart_marks.mark_at(marks, self.axis, self.plot(place, text_height), x, y)

    def _placed_marks(self, place: Rect, text_height: int) -> list[tuple[Mark, Rect]]:
        marks = chart_marks.marks_of(self.marks, self.note, self.samples.reference, self._colours, self.palette.ink)
        unit = text_width(self._chart.unit, small(text_height)) + small(text_height) if self._chart else 0
        return chart_marks.placed_marks(marks, self.axis, self.plot(place, text_height), unit, place.width, text_height)

    # Following the run

    def _extend_span(self) -> None:
        """Make the axis include all samples but the latest. It grows in large steps, so that it seldom changes."""
        series, settled = self.samples.series, self._settled
        scale = self.samples.energy_scale
        *drawn, seen = self._seen
        if drawn != [series.drops, scale]:
            seen, self._extent = 0, NOTHING
        self._seen = series.drops, scale, settled
        if seen >= settled or self._chart is None:
            return
        before, shown = self._extent, list(self._columns.values())
        new = self._chart.values(self.samples, seen)[: settled - seen, shown]
        new = new[np.isfinite(new)]
        if new.size:
            low, high = self._extent
            self._extent = min(low, float(new.min())), max(high, float(new.max()))
        if self._extent != before:
            self._span = self._new_span()

    def _new_span(self) -> Span:
        return self._chart.scale.span(*self._extent) if self._chart else (0.0, 1.0)

    @property
    def _settled(self) -> int:
        return max(1, len(self.samples) - 1)

    # Drawing

    def draw(
        self, surface: Surface, place: Rect, text_height: int, time: float, point: ScreenPoint | None = None
    ) -> None:
        """Draw the chart with all samples, marks, and a cursor at a time (s); the values at a point of the window."""
        if not place.height:
            return
        if self._has_scale != bool(self.samples.energy_scale):  # then energy is in another unit
            self.show(self.instrument)
        axis = self.axis
        axis.follow(time, float(self.samples.times[-1]))
        if self._chart is None:
            self._draw_speeds(surface, place, text_height, point)
            return
        self._extend_span()
        scene = self.moment.scene if self.moment else None
        if scene is not None and scene is not self._remarked:
            self._remarked, self._remark = scene, self._chart.remark(self.samples, scene)
        plot, size, samples = self.plot(place, text_height), place.size, self.samples
        drops, scale = samples.series.drops, samples.energy_scale
        wanted = (self.axis.shown, self._span, tuple(plot), size, text_height, drops, scale, self._remark)
        if self._drawn is None or wanted != self._drawn_as:
            self._drawn, self._samples, self._drawn_as = Surface(size), 0, wanted
            self._draw_axes(self._drawn, self._chart, plot, text_height)
        self._draw_lines(self._drawn, self._chart, plot, text_height)
        surface.blit(self._drawn, place)
        ground = surface.subsurface(place)
        self._draw_names(ground, self._chart, plot, text_height)
        if axis.selection:
            first, last = sorted(axis.column(plot, time) for time in axis.selection)
            veil = Surface((last - first + 1, plot.height))
            veil.fill(self.palette.ink)
            veil.set_alpha(40)
            ground.blit(veil, (first, plot.y))
        chart_marks.draw_marks(ground, self._placed_marks(place, text_height), axis, plot, self.palette, text_height)
        x = axis.column(plot, axis.time)
        if plot.x <= x <= plot.right:
            pygame.draw.line(ground, theme.dim, (x, plot.y - text_height // 3), (x, plot.bottom))
        if point and place.collidepoint(point):
            self._draw_card(surface, place, text_height, point)

    def _draw_speeds(self, surface: Surface, place: Rect, text_height: int, point: ScreenPoint | None) -> None:
        """Draw the speeds of the moment shown, and its values at a point."""
        if self.moment is None:
            return
        plot = self.plot(place, text_height).move(place.topleft)
        self._speeds.draw(surface, place, plot, self.moment, small(text_height))
        if point and place.collidepoint(point):
            rows = self._speeds.rows_at(plot, point[0], self.moment)
            card(surface, rows, point, text_height, surface.get_rect())

    def _draw_axes(self, surface: Surface, chart: TimeChart, plot: Rect, text_height: int) -> None:
        surface.fill(self.palette.ground)
        height, right = small(text_height), surface.get_width()
        start, seconds = self.axis.shown
        interval = round_up(seconds * 6 * text_height / plot.width)
        first, last = int(np.ceil(start / interval - 1e-9)), int((start + seconds) / interval * (1 + 1e-9))
        for k in range(first, last + 1):
            x = self.axis.column(plot, k * interval)
            pygame.draw.line(surface, self.palette.faint, (x, plot.bottom), (x, plot.bottom + height // 3))
            text = f"{k * interval:.6g} s" if k == last else f"{k * interval:.6g}"
            number = lettering(text, theme.dim, height)
            at = min(x - number.get_width() // 2, right - number.get_width())
            surface.blit(number, (at, plot.bottom + height // 3))
        self._write_axis(surface, chart, plot, height)
        write(surface, chart.unit, Rect(0, 0, plot.right, round(1.5 * height)), theme.dim, height)
        if self._remark:
            line = lettering(self._remark, self.palette.ink, height)
            surface.blit(line, line.get_rect(right=plot.right - 2, top=plot.y + 2))

    def _write_axis(self, surface: Surface, chart: TimeChart, plot: Rect, height: int) -> None:
        """Write as many of the chart's values as there is room for; of evenly spaced ones all, or the ends and 0."""
        written, ticks = list[Rect](), chart.scale.ticks(self._span)
        tall = 4 / 3 * lettering("0", theme.dim, height).get_height()
        if isinstance(chart.scale, Even) and tall * (len(ticks) - 1) > plot.height:
            ticks = [(at, text) for at, text in ticks if at in (0.0, *self._span)]
        for at, text in ticks:
            number = lettering(text, theme.dim, height)
            y = round(float(_y(plot, self._span, np.array(at))))
            place = number.get_rect(right=plot.x - height // 2, centery=y)
            if place.inflate(0, height // 3).collidelist(written) < 0:
                pygame.draw.line(surface, self.palette.faint, (plot.x, y), (plot.right - 1, y))
                surface.blit(number, place)
                written.append(place)
        if chart.is_relative:
            zero = round(float(_y(plot, self._span, np.array(0.0))))
            pygame.draw.line(surface, self._colours[self.samples.reference], (plot.x, zero), (plot.right - 1, zero))

    def _draw_lines(self, surface: Surface, chart: TimeChart, plot: Rect, text_height: int) -> None:
        """Draw the samples that are not drawn yet, the reference's line below the others."""
        settled = self._settled
        if self._samples == settled:
            return
        start, seconds = self.axis.shown
        since, width = max(0, self._samples - 1), max(2, round(text_height / 6))
        times = self.samples.times[since:settled]
        shown = slice(*np.searchsorted(times, [start, start + seconds]))
        shown = slice(max(0, shown.start - 1), shown.stop + 1)
        position = chart.scale.position(chart.values(self.samples, since)[: settled - since][shown])
        x, y = self.axis.x(plot, times[shown]), _y(plot, self._span, position)
        surface.set_clip(plot.inflate(0, 3 * width))
        for name in sorted(self._columns, key=lambda name: name != self.samples.reference):
            column = self._columns[name]
            known = np.isfinite(y[:, column])
            if known.sum() > 1:
                line = np.column_stack([x[known], y[known, column]]).tolist()
                thinner = 1 if name == self.samples.reference else 0
                pygame.draw.lines(surface, self._colours[name], False, line, width - thinner)
        surface.set_clip(None)
        self._samples = settled

    def _draw_names(self, surface: Surface, chart: TimeChart, plot: Rect, text_height: int) -> None:
        """Write each line's engine at its end, after a marker of its own shape."""
        height, times = small(text_height), self.samples.times[: self._settled]
        last = int(np.searchsorted(times, sum(self.axis.shown), side="right")) - 1
        if last < 0:
            return
        x = min(self.axis.column(plot, float(times[last])), plot.right)
        values = chart.values(self.samples, last)[0]
        ends = {name: values[column] for name, column in self._columns.items() if np.isfinite(values[column])}
        heights = _y(plot, self._span, chart.scale.position(np.array(list(ends.values())))).tolist()
        line = round(1.15 * height)
        tops = spread([y - line / 2 for y in heights], [line] * len(ends), plot.y - height, plot.bottom)
        left, labels = x + height, []
        for name, y, top in zip(ends, heights, tops, strict=True):
            colour = self._colours[name]
            if name != LAW:
                shape = self.samples.engines.index(name)
                draw_marker(surface, colour, (x, min(max(round(y), plot.y), plot.bottom)), height // 3, shape)
            label = lettering(shortened(name, max(1, surface.get_width() - left), height), colour, height)
            at = label.get_rect(x=left, centery=round(top + line / 2))
            surface.fill(self.palette.ground, at.inflate(4, -height // 3))  # or lines of the axis would strike it out
            labels.append((label, at))
        surface.blits(labels)  # after the ground of all, which would hide parts of letters

    # Values

    def _draw_card(self, surface: Surface, place: Rect, text_height: int, point: ScreenPoint) -> None:
        """Draw the values at a point, or what the mark there means."""
        mark = self.mark_at(place, text_height, point)
        if mark:
            rows = [[f"{mark.time:.2f} s", mark.text], ["", mark.sentence]]
        else:
            rows = self._values_at(self.plot(place, text_height), point[0] - place.x)
            faint = self.palette.ground.lerp(self.palette.ink, 0.5)
            pygame.draw.line(surface, faint, (point[0], place.y), (point[0], place.bottom))
        card(surface, rows, point, text_height, surface.get_rect())

    def _values_at(self, plot: Rect, x: int) -> list[list[str]]:
        chart, times = self._chart, self.samples.times[: self._settled]
        if chart is None:
            return [[""]]
        row = int(np.abs(times - self.axis.time_at(plot, x)).argmin())
        values = chart.values(self.samples, row)[0]
        rows = [[f"{times[row]:.3f} s", f"{self.instrument.value}, {chart.unit}"]]
        for name, column in self._columns.items():
            rows.append([name, chart.text(values[column]) if np.isfinite(values[column]) else "not known"])
        return rows


def _y(plot: Rect, span: Span, position: Floats) -> Floats:
    """Return the height at which a position on an axis is in a chart, px of the strip."""
    low, high = span
    return plot.bottom - 1 - (position - low) / (high - low) * (plot.height - 1)
