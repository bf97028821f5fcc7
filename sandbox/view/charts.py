"""The chart of a run against the reference; above it what stands out.

Samples that no later step changes are added to the picture that is there; the others are drawn over it in every frame.
All of it is drawn again only if an axis changes or the window has changed.
"""

import numpy as np
import pygame
from pygame import Rect, Surface

from sandbox.report.scales import Span, round_up
from sandbox.scene.units import PIXELS, Units
from sandbox.session.history import Moment
from sandbox.session.samples import Samples
from sandbox.state import Floats
from sandbox.view import chart_marks
from sandbox.view.chart_marks import Mark, TimeAxis, small, spread
from sandbox.view.instruments import ENERGY, INSTRUMENTS, LAW, Even, Instrument
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
        self.instrument = ENERGY
        self._logarithmic: set[str] = set()  # names of instruments
        self.recolour()

    def recolour(self) -> None:
        """Draw in the colours of the theme."""
        self.palette = chart_palette()
        self._colours = self.palette.engines(self.samples.engines) | {LAW: self.palette.law}
        self._names = max(text_width(name, 100) for name in self._colours) / 100 + 1.0  # in heights of its text
        self._speeds = SpeedChart(self.samples.reference, self._colours, self.palette)
        self.show(self.instrument)

    # What it shows

    def show(self, instrument: Instrument) -> None:
        """Show an instrument."""
        self.instrument = instrument
        self._columns = instrument.columns(self.samples)
        logarithmic = instrument.logarithmic if self.is_logarithmic else None
        self._scale = logarithmic(self._units) if logarithmic else Even()
        self._drawn: Surface | None = None
        self._drawn_as: object = None  # axes, places and drops of that picture
        self._count = 0  # of the samples in it
        self._seen = 0, 0  # drops of the series, and how many samples the span includes
        self._extent = NOTHING  # of those samples
        self._span = self._scale.span(*self._extent)

    def show_as(self, other: "Charts") -> None:
        """Show what another run's chart shows."""
        self._logarithmic = set(other._logarithmic)
        self.show(other.instrument)

    def show_next(self) -> None:
        """Show the next instrument."""
        self.show(INSTRUMENTS[(INSTRUMENTS.index(self.instrument) + 1) % len(INSTRUMENTS)])

    def follow(self, ball: int) -> None:
        """Show the quantities of a ball by its number among all that ever were in the run."""
        if self.samples.follow(ball):
            self.show(self.instrument)

    @property
    def is_logarithmic(self) -> bool:
        """Whether the axis is logarithmic."""
        return self.instrument.name in self._logarithmic

    @property
    def why_one_scale(self) -> str:
        """Why the axis cannot be logarithmic, or nothing."""
        return "" if self.instrument.logarithmic else "only error and gap have a logarithmic axis too"

    def toggle_scale(self) -> None:
        """Let the axis be logarithmic, or linear again."""
        if not self.why_one_scale:
            self._logarithmic ^= {self.instrument.name}
            self.show(self.instrument)

    # Where things are

    def plot(self, place: Rect, text_height: int) -> Rect:
        """Return where the chart is within its place, without its axes."""
        return chart_marks.plot_of(place.size, text_height, round(self._names * small(text_height)))

    def is_over_time(self, place: Rect, point: ScreenPoint) -> bool:
        """Return whether a point of the window is in a chart over time, or in its margins."""
        return self.instrument.values is not None and bool(place.height) and bool(place.collidepoint(point))

    def time_at(self, place: Rect, text_height: int, x: int) -> float:
        """Return the time (s) of a column of the window, clamped to the axis of a chart at a place."""
        return self.axis.time_at(self.plot(place, text_height), x - place.x)

    def mark_at(self, place: Rect, text_height: int, point: ScreenPoint) -> Mark | None:
        """Return the mark whose label or tick a point of the window is on, in a chart at a place."""
        marks, x, y = self._placed_marks(place, text_height), point[0] - place.x, point[1] - place.y
        return chart_marks.mark_at(marks, self.axis, self.plot(place, text_height), x, y)

    def _placed_marks(self, place: Rect, text_height: int) -> list[tuple[Mark, Rect]]:
        marks = chart_marks.marks_of(self.marks, self.note, self.samples.reference, self._colours, self.palette.ink)
        left = text_width(self._heading, small(text_height)) + small(text_height)
        return chart_marks.placed_marks(marks, self.axis, self.plot(place, text_height), left, place.width, text_height)

    @property
    def _heading(self) -> str:
        return self.instrument.heading(self.samples, self._units)

    def _values(self, since: int) -> Floats:
        """Return the values in the samples from one on: (samples, columns)."""
        return self.instrument.scaled(self.samples, self._units, since)

    def _extend_span(self) -> None:
        """Make the axis include all samples. It grows in large steps, so that it seldom changes."""
        drops, seen = self._seen
        if drops != self.samples.series.drops:
            seen, self._extent = 0, NOTHING
        new = self._values(seen)[:, list(self._columns.values())]
        new = new[np.isfinite(new)]
        self._seen, before = (self.samples.series.drops, self.samples.final), self._extent
        if new.size:
            self._extent = min(before[0], float(new.min())), max(before[1], float(new.max()))
        if self._extent != before:
            self._span = self._scale.span(*self._extent)

    # Drawing

    def draw(
        self, surface: Surface, place: Rect, text_height: int, time: float, point: ScreenPoint | None = None
    ) -> None:
        """Draw the chart with all samples, marks, and a cursor at a time (s); the values at a point of the window."""
        if not place.height:
            return
        axis, plot = self.axis, self.plot(place, text_height)
        axis.follow(time, float(self.samples.times[-1]))
        if self.instrument.values is None:
            if self.moment:
                self._speeds.draw(surface, place, plot.move(place.topleft), self.moment, small(text_height))
            return
        self._extend_span()
        drops, size, final = self.samples.series.drops, place.size, self.samples.final
        wanted = (axis.shown, self._span, tuple(plot), size, text_height, drops)
        if self._drawn is None or wanted != self._drawn_as:
            self._drawn, self._count, self._drawn_as = Surface(size), 0, wanted
            self._draw_axes(self._drawn, plot, text_height)
        if final > self._count:
            self._draw_lines(self._drawn, plot, text_height, slice(max(0, self._count - 1), final))
            self._count = final
        surface.blit(self._drawn, place)
        ground = surface.subsurface(place)
        self._draw_lines(ground, plot, text_height, slice(max(0, final - 1), len(self.samples)))
        self._draw_names(ground, plot, text_height)
        chart_marks.draw_marks(ground, self._placed_marks(place, text_height), axis, plot, self.palette, text_height)
        x = axis.column(plot, axis.time)
        if plot.x <= x <= plot.right:
            pygame.draw.line(ground, theme.dim, (x, plot.y - text_height // 3), (x, plot.bottom))
        if point and place.collidepoint(point):
            self._draw_card(surface, place, text_height, point)

    def _draw_axes(self, surface: Surface, plot: Rect, text_height: int) -> None:
        surface.fill(self.palette.ground)
        height, (start, seconds) = small(text_height), self.axis.shown
        interval = round_up(seconds * 6 * text_height / plot.width)
        first, last = int(np.ceil(start / interval - 1e-9)), int((start + seconds) / interval * (1 + 1e-9))
        times: Floats = interval * np.arange(first, last + 1, dtype=float)
        texts = [f"{time:.6g} s" if k == len(times) - 1 else f"{time:.6g}" for k, time in enumerate(times)]
        chart_marks.draw_axis_below(surface, plot, self.axis.x(plot, times), texts, theme.dim, height)
        self._write_axis(surface, plot, height)
        write(surface, self._heading, Rect(0, 0, plot.right, round(1.5 * height)), theme.dim, height)

    def _write_axis(self, surface: Surface, plot: Rect, height: int) -> None:
        """Write as many of the chart's values as there is room for; of evenly spaced ones all, or the ends and 0."""
        written, ticks = list[Rect](), self._scale.ticks(self._span)
        tall = 4 / 3 * lettering("0", theme.dim, height).get_height()
        if isinstance(self._scale, Even) and tall * (len(ticks) - 1) > plot.height:
            ticks = [(at, text) for at, text in ticks if at in (0.0, *self._span)]
        for at, text in ticks:
            number = lettering(text, theme.dim, height)
            y = round(float(_y(plot, self._span, np.array(at))))
            place = number.get_rect(right=plot.x - height // 2, centery=y)
            if place.inflate(0, height // 3).collidelist(written) < 0:
                pygame.draw.line(surface, self.palette.faint, (plot.x, y), (plot.right - 1, y))
                surface.blit(number, place)
                written.append(place)

    def _draw_lines(self, surface: Surface, plot: Rect, text_height: int, rows: slice) -> None:
        """Draw some samples, the reference's line below the others; a line has a gap where its value is not known."""
        start, seconds = self.axis.shown
        times, width = self.samples.times[rows], max(2, round(text_height / 6))
        first, last = np.searchsorted(times, [start, start + seconds])
        shown = slice(max(0, first - 1), last + 1)
        values = self._values(rows.start)[: len(times)][shown]
        x, y = self.axis.x(plot, times[shown]), _y(plot, self._span, self._scale.position(values))
        surface.set_clip(plot.inflate(0, 3 * width))
        for name in sorted(self._columns, key=lambda name: name != self.samples.reference):
            of_name = y[:, self._columns[name]]
            for part in np.split(np.arange(len(y)), np.flatnonzero(~np.isfinite(of_name))):
                known = part[np.isfinite(of_name[part])]
                if len(known) > 1:
                    line = np.column_stack([x[known], of_name[known]]).tolist()
                    thinner = 1 if name == self.samples.reference else 0
                    pygame.draw.lines(surface, self._colours[name], False, line, width - thinner)
        surface.set_clip(None)

    def _draw_names(self, surface: Surface, plot: Rect, text_height: int) -> None:
        """Write each line's engine beside the end of the lines, and a marker of its own shape at its own end."""
        height, times, values = small(text_height), self.samples.times, self._values(0)
        values = values[: int(np.searchsorted(times, sum(self.axis.shown), side="right"))]
        known = {name: np.flatnonzero(np.isfinite(values[:, column])) for name, column in self._columns.items()}
        ends = {name: int(rows[-1]) for name, rows in known.items() if len(rows)}
        if not ends:
            return
        x = {name: min(self.axis.column(plot, float(times[row])), plot.right) for name, row in ends.items()}
        last = np.array([values[row, self._columns[name]] for name, row in ends.items()])
        heights = _y(plot, self._span, self._scale.position(last)).tolist()
        line = round(1.15 * height)
        tops = spread([y - line / 2 for y in heights], [line] * len(ends), plot.y - height, plot.bottom)
        left, labels = max(x.values()) + height, []
        for name, y, top in zip(ends, heights, tops, strict=True):
            colour = self._colours[name]
            shape = self._columns[name]
            draw_marker(surface, colour, (x[name], min(max(round(y), plot.y), plot.bottom)), height // 3, shape)
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
        times = self.samples.times
        row = int(np.abs(times - self.axis.time_at(plot, x)).argmin())
        values = self._values(row)[0]
        texts = [[name, self.instrument.text(values[k], self._units)] for name, k in self._columns.items()]
        return [[f"{times[row]:.3f} s", self._heading], *texts]


def _y(plot: Rect, span: Span, position: Floats) -> Floats:
    """Return the height at which a position on an axis is in a chart, px of the strip."""
    low, high = span
    return plot.bottom - 1 - (position - low) / (high - low) * (plot.height - 1)
