"""The histogram of speeds at the step shown, beside the law of Maxwell and Boltzmann."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.analysis.gas import expected_counts, speed_law, why_lawless
from sandbox.quantity import length
from sandbox.report.scales import round_up
from sandbox.scene.units import PIXELS, Dimension, Units
from sandbox.session.history import Moment
from sandbox.state import Floats
from sandbox.view.chart_marks import draw_axis_below
from sandbox.view.instruments import LAW
from sandbox.view.primitives import lettering
from sandbox.view.theme import Palette

MIN_BALLS: Final = 50  # fewer make no histogram
MIN_BINS: Final = 8
MAX_BINS: Final = 24
REACH: Final = 3.0  # length of the axis in units of the root mean square speed; faster balls are in the last bin
MAX_PEAK: Final = 1.8  # of the axis of counts, in units of the law's peak
CURVE_POINTS: Final = 120


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
        speeds = np.arange(0.0, fastest, interval)
        places = plot.x + speeds / fastest * (plot.width - 1)
        for x in np.rint(places).astype(int).tolist():
            pygame.draw.line(surface, colours.faint, (x, plot.y), (x, plot.bottom))
        texts = [f"{speed:g} {unit}" if k == len(speeds) - 1 else f"{speed:g}" for k, speed in enumerate(speeds)]
        draw_axis_below(surface, plot, places, texts, colours.ink, height)

    def _write_names(self, surface: Surface, plot: Rect, found: Histogram, height: int) -> None:
        """Write the name of each line at the upper right, where the law leaves room."""
        names = {name: float(counts.max()) for name, counts in found.counts.items()}
        names |= {} if found.law is None else {LAW: 0.0}
        for line, (name, most) in enumerate(names.items()):
            text = name if most <= found.top else f"{name}, up to {most:,.0f}"
            label = lettering(text, self._colours[name], height)
            surface.blit(label, label.get_rect(right=plot.right - 2, top=plot.y + 2 + round(1.3 * line * height)))
