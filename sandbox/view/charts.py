"""The chart of a run against the reference; above it what stands out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.report.scales import Scale, Span, round_up
from sandbox.scene.units import PIXELS, Dimension, Units
from sandbox.session.history import Moment
from sandbox.session.samples import Samples
from sandbox.state import Floats
from sandbox.view.instruments import ENERGY, LAW, Even, Instrument, histogram_of
from sandbox.view.layout import ScreenPoint
from sandbox.view.primitives import card, lettering, shortened, text_width, write
from sandbox.view.run_so_far import Marks
from sandbox.view.theme import Palette, chart_palette, theme

AXIS: Final = 4.4  # heights of text, for the numbers of the axis
MAX_FIRST_SECONDS: Final = 60.0  # on the axis at the start of a run
NOT_COMPARABLE: Final = "no longer comparable"


def small(text_height: int) -> int:
    """Return the height of the text in charts, px."""
    return max(10, round(0.93 * text_height))


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


@dataclass(frozen=True)
class Axes:
    """A chart on a surface: from 0 to an end across, and a scale upwards.

    plot: the place of the lines, px of the surface; height: of the text, px; span: the ends of the scale.
    """

    surface: Surface
    plot: Rect
    height: int
    palette: Palette
    end: float
    scale: Scale
    span: Span

    def x(self, at: Floats) -> Floats:
        """Return the places of values across, px."""
        return self.plot.x + at / self.end * (self.plot.width - 1)

    def y(self, values: Floats) -> Floats:
        """Return the places of values upwards, px."""
        low, high = self.span
        return self.plot.bottom - 1 - (self.scale.position(values) - low) / (high - low) * (self.plot.height - 1)

    def draw(self, heading: str, unit: str) -> None:
        """Draw the ground, round numbers below with a unit, the scale, and a heading."""
        surface, plot, height = self.surface, self.plot, self.height
        surface.fill(self.palette.ground)
        numbers = np.arange(0.0, self.end * (1 + 1e-9), round_up(self.end * 6.5 * height / plot.width))
        for at, x in zip(numbers.tolist(), np.rint(self.x(numbers)).astype(int).tolist(), strict=True):
            pygame.draw.line(surface, theme.dim, (x, plot.bottom), (x, plot.bottom + height // 3))
            number = lettering(f"{at:.6g} {unit if at == numbers[-1] else ''}".rstrip(), theme.dim, height)
            left = min(x - number.get_width() // 2, surface.get_width() - number.get_width())
            surface.blit(number, (left, plot.bottom + height // 3))
        self._draw_scale()
        write(surface, heading, Rect(0, 0, plot.right, round(1.5 * height)), theme.dim, height)

    def _draw_scale(self) -> None:
        """Write as many of the scale's values as there is room for; of evenly spaced ones all, or the ends and 0."""
        written, ticks, (low, high) = list[Rect](), self.scale.ticks(self.span), self.span
        tall = 4 / 3 * lettering("0", theme.dim, self.height).get_height()
        if isinstance(self.scale, Even) and tall * (len(ticks) - 1) > self.plot.height:
            ticks = [(at, text) for at, text in ticks if at in (0.0, *self.span)]
        for at, text in ticks:
            number = lettering(text, theme.dim, self.height)
            y = round(self.plot.bottom - 1 - (at - low) / (high - low) * (self.plot.height - 1))
            place = number.get_rect(right=self.plot.x - self.height // 2, centery=y)
            if place.inflate(0, self.height // 3).collidelist(written) < 0:
                pygame.draw.line(self.surface, self.palette.faint, (self.plot.x, y), (self.plot.right - 1, y))
                self.surface.blit(number, place)
                written.append(place)

    def draw_line(self, colour: Color, at: Floats, values: Floats, width: int) -> None:
        """Draw a line through values, with a gap where they are not known."""
        points, known = np.column_stack([self.x(at), self.y(values)]), np.isfinite(values)
        ends = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]))).reshape(-1, 2)
        self.surface.set_clip(self.plot.inflate(0, 3 * width))
        for first, end in ends.tolist():
            if end - first > 1:
                pygame.draw.lines(self.surface, colour, False, points[first:end].tolist(), width)
        self.surface.set_clip(None)

    def write_names(self, ends: Mapping[str, tuple[float, float]], colours: Mapping[str, Color]) -> None:
        """Write the name of each line beside the end of the lines. ends: across and upwards."""
        if not ends:
            return
        height, line, plot = self.height, round(1.15 * self.height), self.plot
        x, y = (
            axis(np.array(values))
            for axis, values in zip((self.x, self.y), zip(*ends.values(), strict=True), strict=True)
        )
        tops = spread((y - line / 2).tolist(), [line] * len(ends), plot.y - height, plot.bottom)
        left = round(min(float(x.max()), plot.right)) + height
        room, labels = max(1, self.surface.get_width() - left), []
        for name, top in zip(ends, tops, strict=True):
            label = lettering(shortened(name, room, height), colours[name], height)
            at = label.get_rect(x=left, centery=round(top + line / 2))
            self.surface.fill(self.palette.ground, at.inflate(4, -height // 3))  # or lines would strike it out
            labels.append((label, at))
        self.surface.blits(labels)  # after the ground of all, which would hide parts of letters


@dataclass(frozen=True)
class Mark:
    """Something that stands out at a time (s), or a note without one."""

    time: float | None
    text: str
    colour: Color


class Charts:
    """The chart of a run: one instrument at a time.

    note: what is to be said of the reference; moment: the one shown.
    """

    def __init__(self, samples: Samples, seconds: float, units: Units = PIXELS) -> None:
        self.samples = samples
        self._seconds = min(seconds, MAX_FIRST_SECONDS)
        self._units = units
        self.marks = Marks()
        self.note = ""
        self.moment: Moment | None = None
        self.instrument = ENERGY

    # What it shows

    def show(self, instrument: Instrument) -> None:
        """Show an instrument."""
        self.instrument = instrument

    @property
    def _end(self) -> float:
        """The last time on the axis, s: that of the scene, doubled until it includes the latest sample."""
        end, latest = self._seconds, float(self.samples.times[-1])
        while end < latest:
            end *= 2
        return end

    @property
    def colours(self) -> dict[str, Color]:
        """The colour of each engine in charts and titles, the reference's too."""
        return chart_palette().engines(self.samples.engines)

    @property
    def _heading(self) -> str:
        return self.instrument.heading(self.samples, self._units)

    # Where things are

    def plot(self, place: Rect, text_height: int) -> Rect:
        """Return where the chart is within its place, without its axes."""
        height = small(text_height)
        names = max(text_width(name, 100) for name in (*self.samples.engines, LAW)) / 100 + 1.0  # in heights of text
        top, bottom, left = round(2.0 * height), place.height - round(1.6 * height), round(AXIS * height)
        right = min(round(names * height) + height, place.width // 4)
        return Rect(left, top, max(1, place.width - left - right), max(1, bottom - top))

    def _column(self, plot: Rect, time: float) -> int:
        return round(plot.x + time / self._end * (plot.width - 1))

    def is_over_time(self, place: Rect, point: ScreenPoint) -> bool:
        """Return whether a point of the window is in a chart over time, or in its margins."""
        return self.instrument.values is not None and bool(place.height) and bool(place.collidepoint(point))

    def time_at(self, place: Rect, text_height: int, x: int) -> float:
        """Return the time (s) of a column of the window, clamped to the axis of a chart at a place."""
        plot = self.plot(place, text_height)
        return min(max((x - place.x - plot.x) / plot.width, 0.0), 1.0) * self._end

    # Marks

    def _marks(self) -> list[Mark]:
        """Return the note, first differences, the end of the reference's trust, and of the reference."""
        ink, colours, marks = chart_palette().ink, self.colours, self.marks
        found = [Mark(None, self.note, ink)] if self.note else []
        for name, time in marks.differences.items():
            found.append(Mark(time, f"{name} differs", colours[name]))
        if marks.trust.until is not None:
            found.append(Mark(marks.trust.until, NOT_COMPARABLE, ink))
        if marks.stopped:
            found.append(Mark(marks.stopped[0], f"{self.samples.reference} stops", ink))
        return found

    def placed_marks(self, place: Rect, text_height: int) -> list[tuple[Mark, Rect]]:
        """Return the marks with the places of their labels above a chart, px of its place, none over another."""
        height, plot, marks = small(text_height), self.plot(place, text_height), self._marks()
        left = text_width(self._heading, height) + height
        if sum(text_width(mark.text, height) + height for mark in marks) > place.width - left:
            room = max(1, (place.width - left) // len(marks) - height)
            marks = [replace(mark, text=shortened(mark.text, room, height)) for mark in marks]
        wanted = [left if mark.time is None else self._column(plot, mark.time) + height // 2 for mark in marks]
        widths = [text_width(mark.text, height) + height for mark in marks]
        lefts = spread(wanted, widths, left, place.width)
        return [
            (mark, Rect(round(x), 1, width, height + 2)) for mark, x, width in zip(marks, lefts, widths, strict=True)
        ]

    def _draw_marks(self, surface: Surface, place: Rect, text_height: int) -> None:
        """Draw each mark as a triangle above the chart, with its label, and faintly through the chart."""
        half, palette, plot = max(4, text_height // 4), chart_palette(), self.plot(place, text_height)
        for mark, label in self.placed_marks(place, text_height):
            if mark.time is not None:
                x, top = self._column(plot, mark.time), plot.y
                pygame.draw.line(surface, palette.ground.lerp(mark.colour, 0.5), (x, top), (x, plot.bottom))
                corners = (x - half, top - 3 * half // 2), (x + half, top - 3 * half // 2), (x, top)
                pygame.draw.polygon(surface, mark.colour, corners)
            surface.blit(lettering(mark.text, mark.colour, small(text_height)), label)

    # Drawing

    def draw(
        self, surface: Surface, place: Rect, text_height: int, time: float, point: ScreenPoint | None = None
    ) -> None:
        """Draw the chart with all samples, marks, and a cursor at a time (s); the values at a point of the window."""
        if not place.height:
            return
        ground, plot, height = surface.subsurface(place), self.plot(place, text_height), small(text_height)
        width, colours, samples = max(2, round(text_height / 6)), self.colours, self.samples
        if self.instrument.values is None:
            if self.moment:
                self._draw_speeds(ground, plot, height, self.moment)
            return
        values, columns = self.instrument.scaled(samples, self._units), self.instrument.columns(samples)
        known = values[:, list(columns.values())]
        known = known[np.isfinite(known)]
        scale = self.instrument.scale(self._units)
        span = scale.span(float(known.min(initial=np.inf)), float(known.max(initial=-np.inf)))
        axes = Axes(ground, plot, height, chart_palette(), self._end, scale, span)
        axes.draw(self._heading, "s")
        for name in sorted(columns, key=lambda name: name != samples.reference):  # whose line is below the others
            thinner = int(name == samples.reference)
            axes.draw_line(colours[name], samples.times, values[:, columns[name]], width - thinner)
        last = {name: np.flatnonzero(np.isfinite(values[:, k]))[-1:].tolist() for name, k in columns.items()}
        axes.write_names(
            {name: (samples.times[k], values[k, columns[name]]) for name, rows in last.items() for k in rows}, colours
        )
        self._draw_marks(ground, place, text_height)
        x = self._column(plot, time)
        pygame.draw.line(ground, theme.dim, (x, plot.y - text_height // 3), (x, plot.bottom))
        if point and place.collidepoint(point):
            self._draw_card(surface, place, text_height, point)

    def _draw_speeds(self, surface: Surface, plot: Rect, height: int, moment: Moment) -> None:
        """Draw the histogram of a moment's speeds, beside the law of Maxwell and Boltzmann."""
        histogram, units = histogram_of(moment, self.samples.reference), self._units
        colours, factor = self.colours | {LAW: chart_palette().law}, units.factor(Dimension.VELOCITY)
        axes = Axes(surface, plot, height, chart_palette(), factor * histogram.end, Even(), (0.0, histogram.top))
        axes.draw(f"{self._heading}    {histogram.refusal}", units.name(Dimension.VELOCITY))
        for name, (speed, count) in histogram.lines.items():
            axes.draw_line(colours[name], factor * speed, count, max(3, height // 4) if name == LAW else 2)
        ends = {name: (factor * histogram.end, float(count[-1])) for name, (_, count) in histogram.lines.items()}
        axes.write_names(ends, colours)

    def _draw_card(self, surface: Surface, place: Rect, text_height: int, point: ScreenPoint) -> None:
        """Draw the values in the sample nearest to a point, and a line at its time."""
        time, palette = self.time_at(place, text_height, point[0]), chart_palette()
        x = place.x + self._column(self.plot(place, text_height), float(self.samples.times[self._row(time)]))
        pygame.draw.line(surface, palette.ground.lerp(palette.ink, 0.5), (x, place.y), (x, place.bottom))
        card(surface, self.values_at(time), point, text_height, surface.get_rect())

    def _row(self, time: float) -> int:
        """Return the number of the sample nearest to a time (s)."""
        return int(np.abs(self.samples.times - time).argmin())

    def values_at(self, time: float) -> list[list[str]]:
        """Return the rows of a table of each engine's value in the sample nearest to a time (s)."""
        row = self._row(time)
        values = self.instrument.scaled(self.samples, self._units)[row]
        texts = [
            [name, self.instrument.text(values[k], self._units)]
            for name, k in self.instrument.columns(self.samples).items()
        ]
        return [[f"{self.samples.times[row]:.3f} s", self._heading], *texts]
