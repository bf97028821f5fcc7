"""Charts of a run on one axis of time: energy, gap to the reference, momentum.

A chart is drawn once and then gone on with: what is new is drawn to what is there, and all of it again only where an
axis has to reach further or the window has changed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pygame
from pygame import Rect, Surface

from sandbox.analysis.reference import reference_of
from sandbox.quantity import energy, length, momentum
from sandbox.scene.model import Scene
from sandbox.session.monitor import Marks
from sandbox.state import Floats, State
from sandbox.view.overlay import round_up
from sandbox.view.palette import Line, Palette, palette, paper
from sandbox.view.primitives import dashes, lettering

CAPACITY: Final = 4096  # samples kept of a run, however long; about as many as a screen has columns
LEAST_GAP: Final = 1e-14  # px, the least that the chart's axis reaches down to
LONGEST_START: Final = 60.0  # s that the axis of time has at first, where the scene does not say fewer
HEADROOM: Final = 1.1  # of an axis, over its last number
FITS: Final = 1.08  # of an axis, what is still shown over its last number


class Series:
    """Samples of some values over time in bounded memory: when it is full, every other sample is dropped.

    columns: how many values. Samples belong to steps. A step that has one keeps it, so that a run that is stepped
    back and gone on with is the same; where it is to take another course, `cut` forgets what is not to come.
    """

    def __init__(self, columns: int) -> None:
        self._rows = np.empty((CAPACITY, columns))
        self._steps = np.empty(CAPACITY, int)
        self._count = 0
        self._every = 1  # steps at least between two samples
        self.drops = 0  # how often samples have been dropped

    def __len__(self) -> int:
        return self._count

    def wants(self, step: int) -> bool:
        """Tell whether a sample at a step would be kept."""
        return not self._count or step >= self._steps[self._count - 1] + self._every

    def add(self, step: int, values: Sequence[float]) -> None:
        """Keep a sample, which is wanted."""
        if self._count == CAPACITY:
            half = CAPACITY // 2
            self._rows[:half], self._steps[:half] = self._rows[::2].copy(), self._steps[::2].copy()
            self._count, self._every = half, 2 * self._every
            self.drops += 1
        self._steps[self._count], self._rows[self._count] = step, values
        self._count += 1

    def cut(self, step: int) -> None:
        """Forget what came after a step."""
        count = int(np.searchsorted(self._steps[: self._count], step, side="right"))
        if count < self._count:
            self._count = count
            self.drops += 1

    @property
    def steps(self) -> np.ndarray[tuple[int], np.dtype[np.int_]]:
        """The step of each sample: (samples,)."""
        return self._steps[: self._count]

    @property
    def rows(self) -> Floats:
        """The values: (samples, columns)."""
        return self._rows[: self._count]


@dataclass(frozen=True)
class Quantity:
    """What a chart is of. logarithmic: over powers of ten."""

    title: str
    unit: str
    logarithmic: bool = False


class ChartData:
    """What the charts show of a run: each quantity in each engine, over time."""

    def __init__(self, scene: Scene, states: Mapping[str, State]) -> None:
        self.scene = scene
        self.engines = list(states)
        self.reference = reference_of(self.engines)
        first = states[self.reference]
        self.energy_at_start = _energy(scene, first)
        unit = "% of the start" if self.energy_at_start else "kg px²/s²"
        gap = [Quantity("gap, RMS", "px", logarithmic=True)] if len(states) > 1 else []
        self.quantities = (Quantity("energy", unit), *gap, Quantity("momentum", "kg px/s"))
        self.series = Series(1 + len(self.quantities) * len(states))  # time, and each quantity of each engine
        self.add(0, states)

    def add(self, step: int, states: Mapping[str, State]) -> None:
        """Take a sample of all engines, if one is due."""
        if self.series.wants(step):
            self.series.add(step, self._sample(states))

    def _sample(self, states: Mapping[str, State]) -> list[float]:
        scene, mass = self.scene, self.scene.bodies.mass
        unit = self.energy_at_start / 100 or 1.0
        values = [states[self.reference].time]
        values += [_energy(scene, state) / unit for state in states.values()]
        if len(states) > 1:
            right = states[self.reference].position
            values += [float(np.sqrt(np.mean(length(state.position - right) ** 2))) for state in states.values()]
        return values + [float(length(momentum(state.velocity, mass))) for state in states.values()]

    def of(self, quantity: int) -> Floats:
        """Return a quantity over time, a column an engine: (samples, engines)."""
        n = len(self.engines)
        return self.series.rows[:, 1 + quantity * n : 1 + (quantity + 1) * n]

    @property
    def times(self) -> Floats:
        """When the samples are of, s: (samples,)."""
        return self.series.rows[:, 0]


@dataclass(frozen=True)
class Axes:
    """What the axes of a drawn chart reach: seconds, and each quantity from a lowest to a highest (or their log10)."""

    seconds: float
    spans: tuple[tuple[float, float], ...]


class Charts:
    """The strip of charts, drawn at a place of the window."""

    def __init__(self, history: ChartData) -> None:
        self.history = history
        self.marks = Marks()
        self.palette: Palette = palette(paper(history.scene.arena.background))
        self._drawn: Surface | None = None
        self._as: tuple[Axes, Rect, int, int] | None = None  # what the drawing is of: axes, place, text, drops
        self._samples = 0  # of the series, how many are drawn
        self._axes = Axes(min(history.scene.seconds, LONGEST_START), ())
        self._seen = 0  # samples that the axes reach
        self._extent: list[tuple[float, float]] = []

    def draw(self, surface: Surface, place: Rect, text_height: int, time: float) -> None:
        """Draw the charts, up to date, with marks and a cursor at a time (s)."""
        if not place.height:
            return
        self._reach()
        plots = self.plots(place, text_height)
        wanted = (self._axes, place, text_height, self.history.series.drops)
        if self._drawn is None or wanted != self._as:
            self._drawn, self._as, self._samples = Surface(place.size), wanted, 0
            self._draw_axes(self._drawn, plots, text_height)
        self._draw_lines(self._drawn, plots, text_height)
        surface.blit(self._drawn, place)
        ground = surface.subsurface(place)
        self._draw_marks(ground, plots, text_height)
        self._draw_cursor(ground, plots, text_height, time)

    def plots(self, place: Rect, text_height: int) -> list[Rect]:
        """Return each chart's place within the strip, round its lines only."""
        left = round(8.2 * text_height)
        bottom = round(1.4 * text_height)
        count, gap = len(self.history.quantities), max(2, text_height // 4)
        height = (place.height - bottom) / count
        right = text_height
        return [
            Rect(left, round(k * height) + gap, max(1, place.width - left - right), round(height) - gap)
            for k in range(count)
        ]

    def time_at(self, place: Rect, text_height: int, point: tuple[int, int]) -> float | None:
        """Return the time that a point of the window stands for in the charts at a place, s; None outside of them."""
        if not place.collidepoint(point):
            return None
        plot = self.plots(place, text_height)[0]
        share = (point[0] - place.x - plot.x) / plot.width
        return min(max(share, 0.0), 1.0) * self._axes.seconds

    def _reach(self) -> None:
        """Let the axes reach all samples: further in steps, so that they seldom change."""
        history = self.history
        if self._seen > len(history.series) or self._as is None or self._as[3] != history.series.drops:
            self._seen, self._extent = 0, []
        if self._seen == len(history.series):
            return
        spans = []
        for k, quantity in enumerate(history.quantities):
            new = history.of(k)[self._seen :]
            if quantity.logarithmic:
                new = new[new > 0]
            low, high = (float(new.min()), float(new.max())) if new.size else (np.inf, -np.inf)
            if self._extent:
                low, high = min(low, self._extent[k][0]), max(high, self._extent[k][1])
            spans.append((low, high))
        self._extent, self._seen = spans, len(history.series)
        latest = float(history.times[-1])
        self._axes = Axes(
            _seconds(self._axes.seconds, latest),
            tuple(
                _decades(low, high) if quantity.logarithmic else _from_zero(low, high)
                for quantity, (low, high) in zip(history.quantities, spans, strict=True)
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
        every = round_up(self._axes.seconds * 5 * text_height / plots[0].width)
        for k in range(int(self._axes.seconds / every * (1 + 1e-9)) + 1):
            x = self._column(plots[0], k * every)
            pygame.draw.line(surface, colours.faint, (x, 0), (x, plots[-1].bottom))
            number = lettering(f"{k * every:g} s", colours.ink, small)
            at = min(x - number.get_width() // 2, surface.get_width() - number.get_width())
            surface.blit(number, (at, plots[-1].bottom + (surface.get_height() - plots[-1].bottom - small) // 2 - 1))
        for quantity, plot, span in zip(self.history.quantities, plots, self._axes.spans, strict=True):
            pygame.draw.line(surface, colours.ink, plot.bottomleft, (plot.right - 1, plot.bottom))
            self._write_span(surface, quantity, plot, span, small)

    def _write_span(
        self, surface: Surface, quantity: Quantity, plot: Rect, span: tuple[float, float], height: int
    ) -> None:
        """Write a chart's title, and what its axis reaches."""
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
        history = self.history
        if self._samples == len(history.series):
            return
        since = max(0, self._samples - 1)
        times = history.times[since:]
        width = max(1, round(text_height / 8))
        for k, (quantity, plot, span) in enumerate(zip(history.quantities, plots, self._axes.spans, strict=True)):
            values = history.of(k)[since:]
            surface.set_clip(plot.inflate(0, 2))
            for engine in range(len(history.engines)):
                # A logarithmic axis has no place for 0, such as the reference's own gap.
                shown = values[:, engine] > 0 if quantity.logarithmic else np.ones(len(values), bool)
                y = _y(plot, span, np.log10(values[shown, engine]) if quantity.logarithmic else values[shown, engine])
                self._draw_line(surface, self.palette.line(engine), self._x(plot, times[shown]), y, width)
        surface.set_clip(None)
        self._samples = len(history.series)

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
        """Draw the horizon, and each engine's first difference: a line through all charts, and what it is."""
        marks = [
            (time, f"{name}: first difference", self.palette.line(self.history.engines.index(name)))
            for name, time in self.marks.differences.items()
        ]
        if self.marks.horizon is not None:
            marks.append((self.marks.horizon, "horizon", Line(self.palette.ink, (2, 2))))
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


def _energy(scene: Scene, state: State) -> float:
    return float(energy(state.position, state.velocity, scene.bodies.mass, scene.gravity, scene.arena.size))


def _y(plot: Rect, span: tuple[float, float], value: Floats) -> Floats:
    """Return the height at which a value stands in a chart, px of the strip."""
    low, high = span
    return plot.bottom - 1 - (value - low) / ((high - low) * HEADROOM) * (plot.height - 1)


def _from_zero(low: float, high: float) -> tuple[float, float]:
    """Return round numbers that span from 0 to what is there. What is just above fits into the headroom."""
    return (-round_up(-low) if low < 0 else 0.0), round_up(high / FITS) if high > 0 else 1.0


def _decades(low: float, high: float) -> tuple[float, float]:
    """Return the powers of ten round a span."""
    if high < low:
        return -3.0, 3.0
    least = max(low, LEAST_GAP)
    bottom = np.floor(np.log10(least))
    return float(bottom), float(max(np.ceil(np.log10(max(high, LEAST_GAP))), bottom + 1))


def _seconds(now: float, latest: float) -> float:
    """Return how long an axis of time must be that is so long now."""
    while now < latest:
        now *= 2
    return now
