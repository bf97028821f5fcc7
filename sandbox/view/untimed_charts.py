"""Charts of which no axis is time: a quantity over another, momenta and energies of balls, and speeds."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.analysis.gas import expected_counts, speed_law, why_lawless
from sandbox.quantity import kinetic_energies, length
from sandbox.report.scales import Span, round_up
from sandbox.scene.fields import rgb
from sandbox.scene.units import PIXELS, Dimension, Units
from sandbox.session.history import Moment
from sandbox.session.samples import Samples
from sandbox.state import Bodies, Floats, State
from sandbox.view.instruments import LAW, ROUNDING, TimeChart
from sandbox.view.primitives import arrow, draw_marker, lettering, shortened, text_width, write
from sandbox.view.theme import Palette, readable, theme

MAX_POINTS: Final = 2_000  # of a curve; of more, one in so many
MAX_BALLS: Final = 30  # with more, arrows and bars are too small to distinguish
GAP: Final = 1.2  # between two engines, in heights of the text
MIN_BALLS: Final = 50  # fewer make no histogram
MIN_BINS: Final = 8
MAX_BINS: Final = 24
REACH: Final = 3.0  # length of the axis in units of the root mean square speed; faster balls are in the last bin
MAX_PEAK: Final = 1.8  # of the axis of counts, in units of the law's peak
CURVE_POINTS: Final = 120


@dataclass(frozen=True)
class PlaneChart:
    """Draws the values of one chart over those of another at the same times.

    up, across: the charts of the two quantities. Engines that one of them does not show have no curve.
    """

    _up: TimeChart
    _across: TimeChart
    _colours: Mapping[str, Color]
    _palette: Palette

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
        across, up = (
            (chart.scale.position(values[known]) - low) / (high - low)
            for chart, values, (low, high) in zip(self._charts, (x, y), spans, strict=True)
        )
        return np.column_stack([plot.x + across * (plot.width - 1), plot.bottom - 1 - up * (plot.height - 1)])

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


class BallChart:
    """Draws a section for each engine. Its scales only grow, so that arrows and bars of all steps can be compared."""

    _low, _high = np.zeros(2), np.zeros(2)  # what the arrows have reached so far, kg px/s
    _most = 0.0  # energy of all balls so far, kg px²/s²
    _refusal = ""

    def __init__(self, colours: Mapping[str, Color], palette: Palette) -> None:
        self._colours = colours
        self._palette = palette

    def rows_at(self, place: Rect, point: tuple[int, int], moment: Moment) -> list[list[str]]:
        """Return each ball's momentum and energy in the engine at a point of the chart, as rows of a table."""
        if self._refusal:
            return [[self._refusal]]
        names = list(moment.states)
        name = names[min(max((point[0] - place.x) * len(names) // place.width, 0), len(names) - 1)]
        state, bodies = moment.states[name], moment.scene.bodies
        units = moment.scene.units
        momenta = units.factor(Dimension.MOMENTUM) * state.velocity * bodies.mass[:, None]
        energies = units.factor(Dimension.ENERGY) * _energies(state, bodies)
        rows = [[name, units.name(Dimension.MOMENTUM), units.name(Dimension.ENERGY)]]
        names = [*(f"ball {ball}" for ball in range(len(bodies))), "all"]
        momenta, energies = np.vstack([momenta, momenta.sum(axis=0)]), np.append(energies, energies.sum())
        for name, (x, y), energy in zip(names, momenta.tolist(), energies.tolist(), strict=True):
            rows.append([name, f"{x:,.5g}, {y:,.5g}", f"{energy:,.6g}"])
        return rows

    def draw(self, surface: Surface, place: Rect, moment: Moment, height: int) -> None:
        """Draw every engine's section side by side. height: of the text, px."""
        surface.fill(self._palette.ground, place)
        count = len(moment.scene.bodies)
        self._refusal = f"{count:,} balls are too many: at most {MAX_BALLS} are drawn" if count > MAX_BALLS else ""
        if self._refusal:
            write(surface, self._refusal, place, self._palette.ink, height)
            return
        for state in moment.states.values():  # the scales include every engine
            path = _path(state, moment.scene.bodies)
            self._low, self._high = np.minimum(self._low, path.min(axis=0)), np.maximum(self._high, path.max(axis=0))
            self._most = max(self._most, float(_energies(state, moment.scene.bodies).sum()))
        gap, count = round(GAP * height), len(moment.states)
        width = (place.width + gap) // count
        for k, (name, state) in enumerate(moment.states.items()):
            section = Rect(place.x + k * width, place.y, width - gap, place.height)
            self._draw_section(surface, section, name, state, moment, height)

    def _draw_section(
        self, surface: Surface, place: Rect, name: str, state: State, moment: Moment, height: int
    ) -> None:
        line = round(1.5 * height)
        write(surface, name, Rect(place.x, place.y, place.width, line), self._colours[name], height, bold=True)
        left = Rect(place.x, place.y + line, place.width // 2 - height // 2, place.height - 2 * line)
        right = Rect(left.right + height, left.y, place.right - left.right - height, left.height)
        bodies, units = moment.scene.bodies, moment.scene.units
        colours = [readable(Color(*rgb(colour)), self._palette.ground) for colour in moment.scene.colors]
        path, energies = _path(state, bodies), _energies(state, bodies)
        self._draw_momenta(surface, left, path, colours, height)
        self._draw_energies(surface, right, energies, colours)
        momentum = float(length(path[-1]))
        total = momentum if momentum > ROUNDING else 0.0
        self._caption(surface, left, "momentum", units.text(Dimension.MOMENTUM, "{:,.5g}", total), height)
        energy = units.text(Dimension.ENERGY, "{:,.6g}", float(energies.sum()))
        self._caption(surface, right, "energy", energy, height)

    def _caption(self, surface: Surface, above: Rect, name: str, value: str, height: int) -> None:
        """Write a value below a drawing, after its name if there is room."""
        text = f"{name} {value}" if text_width(f"{name} {value}", height) <= above.width else value
        place = Rect(above.x, above.bottom, above.width, round(1.5 * height))
        write(surface, shortened(text, above.width, height), place, self._palette.ink, height)

    def _draw_momenta(self, surface: Surface, place: Rect, path: Floats, colours: list[Color], height: int) -> None:
        """Draw the momenta head to tail, from a dot, and below them their sum."""
        reach, room = self._high - self._low, place.inflate(-height, -height)
        scale = min(room.width / max(reach[0], ROUNDING), room.height / max(reach[1], ROUNDING))
        corner = np.array(room.center) - scale * (self._low + self._high) / 2
        points = (corner + scale * path).tolist()
        width = max(2, height // 6)
        arrow(surface, self._palette.law, points[0], points[-1], 2 * width)
        for tail, tip, colour in zip(points, points[1:], colours, strict=False):
            arrow(surface, colour, tail, tip, width)
        pygame.draw.circle(surface, self._palette.ink, points[0], max(2, height // 5))

    def _draw_energies(self, surface: Surface, place: Rect, energies: Floats, colours: list[Color]) -> None:
        """Draw a bar for each ball, and last one of all, in which they stand on one another."""
        top, floor = round_up(max(self._most, ROUNDING)), place.bottom - 2
        step = place.width / (len(energies) + 2)
        thick = max(2, min(round(0.7 * step), place.height // 3))
        heights = (energies / top * (place.height - 4)).tolist()
        pile = float(floor)
        for k, (tall, colour) in enumerate(zip(heights, colours, strict=True)):
            top_of_bar, above = round(floor - tall), pile - tall
            surface.fill(colour, (round(place.x + k * step), top_of_bar, thick, floor - top_of_bar))
            surface.fill(colour, (place.right - thick - 1, round(above), thick, round(pile) - round(above)))
            pile = above
        pygame.draw.line(surface, self._palette.law, (place.x, floor), (place.right - 1, floor))


def _path(state: State, bodies: Bodies) -> Floats:
    """Return the points between the momenta when each begins where the one before ends, kg px/s: (n + 1, 2)."""
    momenta = state.velocity * bodies.mass[:, None]
    return np.vstack([np.zeros(2), np.cumsum(momenta, axis=0)])


def _energies(state: State, bodies: Bodies) -> Floats:
    """Return the kinetic energies of the balls, kg px²/s²: (n,)."""
    return kinetic_energies(state.velocity, state.spin, bodies.mass, bodies.moment)


@dataclass(frozen=True)
class Histogram:
    """How many balls have each speed.

    balls: how many; edges: (bins + 1,) px/s; counts: of each engine, (bins,); law: how many the law expects, (bins,),
    None where no law applies; whole: the speed of a single ball with all of the energy, px/s; refusal: why there are no
    counts, or no law; units: in which speeds are shown.
    """

    balls: int
    edges: Floats
    counts: Mapping[str, Floats]
    law: Floats | None
    whole: float
    refusal: str
    units: Units = PIXELS

    @property
    def top(self) -> float:
        """The end of the axis of counts: an engine that leaves the law behind is cut off there."""
        highest = max(float(counts.max()) for counts in self.counts.values())
        return round_up(max(1.0, highest if self.law is None else min(highest, MAX_PEAK * float(self.law.max()))))


def histogram_of(moment: Moment, reference: str) -> Histogram:
    """Count the speeds of a moment's engines. The law's energy is the reference's, or the last engine's without it."""
    states, n = moment.states, len(moment.scene.bodies)
    speeds = {name: length(state.velocity) for name, state in states.items()}
    standard = speeds.get(reference, next(reversed(speeds.values())))
    whole = float(np.sqrt(np.sum(standard**2)))
    if n < MIN_BALLS:
        balls = "one ball is" if n == 1 else f"{n} balls are"
        return Histogram(n, np.empty(0), {}, None, whole, f"{balls} too few: {MIN_BALLS} make a histogram")
    if not 0 < whole < np.inf:
        return Histogram(n, np.empty(0), {}, None, whole, "nothing moves")
    bins = min(max(round(np.sqrt(n)), MIN_BINS), MAX_BINS)
    edges = np.linspace(0.0, REACH * whole / np.sqrt(n), bins + 1)
    counts = {name: np.histogram(np.minimum(each, edges[-1]), edges)[0].astype(float) for name, each in speeds.items()}
    lawless = why_lawless(moment.scene)
    law = None if lawless else expected_counts(edges, whole, n)
    return Histogram(n, edges, counts, law, whole, f"no law: {lawless}" if lawless else "", moment.scene.units)


@dataclass
class SpeedChart:
    """Draws the histogram of a moment."""

    _reference: str
    _colours: Mapping[str, Color]
    _palette: Palette
    _moment: Moment | None = None  # of the histogram
    _histogram = Histogram(0, np.empty(0), {}, None, 0.0, "")

    def histogram(self, moment: Moment) -> Histogram:
        """Return the histogram of a moment."""
        if moment is not self._moment:
            self._moment, self._histogram = moment, histogram_of(moment, self._reference)
        return self._histogram

    def rows_at(self, plot: Rect, x: int, moment: Moment) -> list[list[str]]:
        """Return what the bin at a column of the chart has, as rows of a table."""
        found = self.histogram(moment)
        if not len(found.edges):
            return [[found.refusal]]
        bins = len(found.edges) - 1
        k = min(max((x - plot.x) * bins // plot.width, 0), bins - 1)
        low, high = found.units.scaled(Dimension.VELOCITY, *found.edges[k : k + 2].tolist())
        end = f"to {high:.4g}" if k < bins - 1 else "and more"
        rows = [["balls", f"{low:.4g} {end} {found.units.name(Dimension.VELOCITY)}"]]
        rows += [[name, f"{counts[k]:.0f}"] for name, counts in found.counts.items()]
        return rows if found.law is None else [*rows, [LAW, f"{found.law[k]:.1f}"]]

    def draw(self, surface: Surface, place: Rect, plot: Rect, moment: Moment, height: int) -> None:
        """Draw the histogram. place: with its axes; plot: without; height: of the text, px."""
        found, surface, plot = self.histogram(moment), surface.subsurface(place), plot.move(-place.x, -place.y)
        surface.fill(self._palette.ground)
        if len(found.edges):
            self._draw_bins(surface, plot, found, height)
        pygame.draw.line(surface, self._palette.ink, plot.bottomleft, plot.bottomright)
        if found.refusal:
            remark = lettering(found.refusal, self._palette.ink, height)
            surface.blit(remark, remark.get_rect(right=plot.right, bottom=plot.y))

    def _draw_bins(self, surface: Surface, plot: Rect, found: Histogram, height: int) -> None:
        top, fastest = found.top, float(found.edges[-1])
        self._write_axes(surface, plot, found, height)

        def points(speed: Floats, count: Floats) -> list[tuple[float, float]]:
            x = plot.x + speed / fastest * (plot.width - 1)
            y = plot.bottom - 1 - np.minimum(count / top, 1.0) * (plot.height - 1)
            return list(zip(x.tolist(), y.tolist(), strict=True))

        if found.law is not None:  # in the middle of a bin, what it expects there
            half, n = found.edges[1] / 2, found.balls
            speed = np.linspace(half, fastest - half, CURVE_POINTS)
            count = n * (speed_law(speed + half, found.whole, n) - speed_law(speed - half, found.whole, n))
            pygame.draw.lines(surface, self._colours[LAW], False, points(speed, count), max(3, height // 4))
        for name, counts in found.counts.items():
            outline = points(np.repeat(found.edges, 2)[1:-1], np.repeat(counts, 2))
            pygame.draw.lines(surface, self._colours[name], False, outline, max(1, height // 8))
        self._write_names(surface, plot, found, height)

    def _write_axes(self, surface: Surface, plot: Rect, found: Histogram, height: int) -> None:
        colours, top, unit = self._palette, found.top, found.units.name(Dimension.VELOCITY)
        (fastest,) = found.units.scaled(Dimension.VELOCITY, float(found.edges[-1]))
        for count, y in ((0.0, plot.bottom - 1), (top, plot.y)):
            pygame.draw.line(surface, colours.faint, (plot.x, y), (plot.right, y))
            number = lettering(f"{count:g}", colours.ink, height)
            place = number.get_rect(right=plot.x - height // 2, centery=y)
            surface.blit(number, place.clamp(place.x, plot.y - 2, place.width, plot.height + 4))
        interval = round_up(fastest * 5 * height / plot.width)
        for k in range(int(fastest / interval) + 1):
            x = plot.x + round(k * interval / fastest * (plot.width - 1))
            pygame.draw.line(surface, colours.faint, (x, plot.y), (x, plot.bottom))
            last = (k + 1) * interval > fastest
            number = lettering(f"{k * interval:g} {unit}" if last else f"{k * interval:g}", colours.ink, height)
            at = number.get_rect(centerx=x, top=plot.bottom + height // 4).clamp(surface.get_rect())
            surface.blit(number, at)

    def _write_names(self, surface: Surface, plot: Rect, found: Histogram, height: int) -> None:
        """Write the name of each line at the upper right, where the law leaves room."""
        names = {name: float(counts.max()) for name, counts in found.counts.items()}
        names |= {} if found.law is None else {LAW: 0.0}
        for line, (name, most) in enumerate(names.items()):
            text = name if most <= found.top else f"{name}, up to {most:,.0f}"
            label = lettering(text, self._colours[name], height)
            surface.blit(label, label.get_rect(right=plot.right - 2, top=plot.y + 2 + round(1.3 * line * height)))
