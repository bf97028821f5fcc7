"""Charts of a run on one axis of time, against the reference: energy, gap, momentum; above them what stands out.

New samples are added to the picture that is there. All of it is drawn again only if an axis changes or the window has
changed. The latest sample is left out: the next step can change how it compares with the reference.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.analysis.scales import BothSigns, Linear, Logarithmic, Scale, Span, round_up
from sandbox.session.monitor import Marks
from sandbox.session.samples import Quantity, Samples
from sandbox.state import Floats
from sandbox.view.layout import ScreenPoint
from sandbox.view.palette import chart_background, palette
from sandbox.view.primitives import card, lettering, text_width

MAX_FIRST_SECONDS: Final = 60.0  # on the axis of time at the start of a run
MIN_SECONDS: Final = 0.1  # on the axis of time, however far one zooms in
MIN_PLOT: Final = 2.7  # heights of text; where there is less room, the last charts are left out
MARK_DISTANCE: Final = 4  # px between the pointer and a mark that it points at
Time = TypeVar("Time", float, Floats)  # s
SENTENCES: Final = {  # what the ends of the reference's trust mean
    "horizon": "from here on, rounding decides the paths",
    "undecided": "simultaneous contacts, and no law says which comes first",
    "unresolved": "from here on, the paths depend on how a heap is treated",
}


@dataclass(frozen=True)
class Panel:
    """One chart. lines: its title and unit; digits: how a value is written."""

    quantity: Quantity
    lines: tuple[str, str]
    scale: Scale
    digits: str


@dataclass(frozen=True)
class Axes:
    """The ranges of the axes: time from start, s; the positions that each panel shows."""

    start: float
    seconds: float
    spans: tuple[Span, ...]


@dataclass(frozen=True)
class Mark:
    """Something that stands out at a time (s), or a note without one."""

    time: float | None
    text: str
    colour: Color
    sentence: str


class Charts:
    """The strip of charts at the bottom of the window.

    note: what is to be said of the reference; point: of the window, where values are shown; selection: two times (s),
    marked.
    """

    def __init__(self, samples: Samples, background: str, seconds: float) -> None:
        self.samples = samples
        self.marks = Marks()
        self.note = ""
        self.selection: tuple[float, float] | None = None
        self.palette = palette(chart_background(background))
        self.panels = panels_of(samples)
        self._colours = self.palette.engines(samples.engines)
        self._zoom: tuple[float, float] | None = None  # start and length, s; None shows all
        self._seconds = min(seconds, MAX_FIRST_SECONDS)  # of all
        self._time = 0.0  # s, at the cursor
        self._drawn: Surface | None = None
        self._drawn_as: tuple[Axes, Rect, int, int] | None = None  # axes, place, text height, drops of that picture
        self._samples = 0  # how many of the series are drawn
        self._seen = 0, 0  # drops of the series, and how many samples the spans include
        self._extent = [(np.inf, -np.inf)] * len(self.panels)  # of those samples

    # Where things are

    def plots(self, place: Rect, text_height: int) -> list[Rect]:
        """Return the place of each chart's lines, without its axes, within the strip: of as many as there is room."""
        small, gap = _small(text_height), max(2, text_height // 4)
        names = max(text_width(name, small) for name in self.samples.engines)
        left, right = round(8.2 * text_height), min(names + small, place.width // 5)
        top, bottom = round(1.5 * small), round(1.5 * small)
        room = place.height - top - bottom
        count = max(1, min(len(self.panels), int(room / (MIN_PLOT * text_height))))
        ends = [top + round(k * room / count) for k in range(count + 1)]
        width = max(1, place.width - left - right)
        return [Rect(left, ends[k] + gap, width, ends[k + 1] - ends[k] - gap) for k in range(count)]

    def time_at(self, place: Rect, text_height: int, x: int) -> float:
        """Return the time (s) of a column of the window, clamped to the axis of charts at a place."""
        plot, axes = self.plots(place, text_height)[0], self._axes
        share = (x - place.x - plot.x) / plot.width
        return axes.start + min(max(share, 0.0), 1.0) * axes.seconds

    def mark_at(self, place: Rect, text_height: int, point: ScreenPoint) -> Mark | None:
        """Return the mark whose label or tick a point of the window is on, in charts at a place."""
        x, y = point[0] - place.x, point[1] - place.y
        plots = self.plots(place, text_height)
        placed = self._placed_marks(plots[0], text_height)
        on_label = (mark for mark, label in placed if label.collidepoint(x, y))
        near = (mark for mark, _ in placed if self._is_near(plots[0], mark, x, y))
        return next((mark for found in (on_label, near) for mark in found if mark.time is not None), None)

    def _is_near(self, plot: Rect, mark: Mark, x: int, y: int) -> bool:
        """Return whether a point is on a mark's tick, above the charts."""
        return mark.time is not None and y < plot.y and abs(x - self._column(plot, mark.time)) <= MARK_DISTANCE

    @property
    def _axes(self) -> Axes:
        start, seconds = self._zoom or (0.0, self._seconds)
        spans = (panel.scale.span(*extent) for panel, extent in zip(self.panels, self._extent, strict=True))
        return Axes(start, seconds, tuple(spans))

    def _x(self, plot: Rect, time: Time) -> Time:
        start, seconds = self._zoom or (0.0, self._seconds)
        return plot.x + (time - start) / seconds * (plot.width - 1)

    def _column(self, plot: Rect, time: float) -> int:
        return round(self._x(plot, time))

    # Zooming in time

    def zoom(self, time: float, factor: float) -> None:
        """Make the axis of time longer or shorter by a factor, with a time (s) in its place; at most all is shown."""
        start, seconds = self._zoom or (0.0, self._seconds)
        self._show(time - (time - start) * factor, seconds * factor)

    def zoom_to_selection(self) -> None:
        """Show what is selected; if that is a moment, show all."""
        if self.selection:
            first, last = sorted(self.selection)
            self.selection = None
            self._show(first, last - first if last - first >= MIN_SECONDS else np.inf)

    def _show(self, start: float, seconds: float) -> None:
        if seconds >= self._seconds:
            self._zoom = None
        else:
            seconds = max(seconds, MIN_SECONDS)
            self._zoom = min(max(start, 0.0), self._seconds - seconds), seconds

    def _follow(self, time: float) -> None:
        """Let the axis include all samples, and a part that is shown follow the cursor out of it."""
        while self._seconds < self.samples.times[-1]:
            self._seconds *= 2
        if self._zoom and self._time <= sum(self._zoom) < time:
            self._zoom = time - self._zoom[1] / 10, self._zoom[1]
        self._time = time

    def _extend_spans(self) -> None:
        """Make the axes include all samples but the latest. They grow in large steps, so that they seldom change."""
        series, settled = self.samples.series, self._settled
        drops, seen = self._seen
        if drops != series.drops:
            seen, self._extent = 0, [(np.inf, -np.inf)] * len(self.panels)
        self._seen = series.drops, settled
        if seen >= settled:
            return
        for k, panel in enumerate(self.panels):
            new = self.samples.of(panel.quantity, seen)[: settled - seen]
            new = new[np.isfinite(new)]
            low, high = self._extent[k]
            self._extent[k] = float(new.min(initial=low)), float(new.max(initial=high))

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
        self._follow(time)
        self._extend_spans()
        plots, axes = self.plots(place, text_height), self._axes
        wanted = (axes, place, text_height, self.samples.series.drops)
        if self._drawn is None or wanted != self._drawn_as:
            self._drawn, self._drawn_as, self._samples = Surface(place.size), wanted, 0
            self._draw_axes(self._drawn, plots, axes, text_height)
        self._draw_lines(self._drawn, plots, axes, text_height)
        surface.blit(self._drawn, place)
        ground = surface.subsurface(place)
        self._draw_names(ground, plots, axes, text_height)
        self._draw_selection(ground, plots)
        self._draw_marks(ground, plots, text_height)
        self._draw_cursor(ground, plots, text_height)
        if point and place.collidepoint(point):
            self._draw_card(surface, place, text_height, point)

    def _draw_axes(self, surface: Surface, plots: list[Rect], axes: Axes, text_height: int) -> None:
        surface.fill(self.palette.ground)
        small = _small(text_height)
        interval = round_up(axes.seconds * 5 * text_height / plots[0].width)
        for k in range(
            int(np.ceil(axes.start / interval - 1e-9)), int((axes.start + axes.seconds) / interval * (1 + 1e-9)) + 1
        ):
            x = self._column(plots[0], k * interval)
            pygame.draw.line(surface, self.palette.faint, (x, plots[0].y), (x, plots[-1].bottom))
            number = lettering(f"{k * interval:.6g} s", self.palette.ink, small)
            at = min(x - number.get_width() // 2, surface.get_width() - number.get_width())
            surface.blit(number, (at, plots[-1].bottom + (surface.get_height() - plots[-1].bottom - small) // 2 - 1))
        for panel, plot, span in zip(self.panels, plots, axes.spans, strict=False):
            self._write_axis(surface, panel, plot, span, small)

    def _write_axis(self, surface: Surface, panel: Panel, plot: Rect, span: Span, height: int) -> None:
        """Write a chart's title, and as many of its values as there is room for."""
        ink, written = self.palette.ink, list[Rect]()
        for at, text in panel.scale.ticks(span):
            number = lettering(text, ink, height)
            y = round(float(_y(plot, span, np.array(at))))
            pygame.draw.line(surface, self.palette.faint, (plot.x, y), (plot.right - 1, y))
            place = number.get_rect(right=plot.x - height // 2, centery=y)
            place.clamp_ip(place.x, plot.y - 2, place.width, plot.height + 4)
            if place.inflate(0, -2).collidelist(written) < 0:
                surface.blit(number, place)
                written.append(place)
        if panel.quantity is Quantity.ENERGY:
            zero = round(float(_y(plot, span, np.array(0.0))))
            pygame.draw.line(surface, self._reference_colour, (plot.x, zero), (plot.right - 1, zero))
        for line, text in enumerate(panel.lines):
            surface.blit(lettering(text, ink, height), (height // 2, plot.y + round(line * 1.3 * height)))

    @property
    def _reference_colour(self) -> Color:
        return self._colours[self.samples.reference]

    def _drawn_engines(self, panel: Panel) -> list[int]:
        """Return the engines that a panel has lines of: the reference's own gap is none."""
        samples = self.samples
        own = panel.quantity is Quantity.MOMENTUM or samples.is_alone
        return [k for k, name in enumerate(samples.engines) if own or name != samples.reference]

    def _draw_lines(self, surface: Surface, plots: list[Rect], axes: Axes, text_height: int) -> None:
        """Draw the samples that are not drawn yet."""
        settled = self._settled
        if self._samples == settled:
            return
        since, width = max(0, self._samples - 1), max(1, round(text_height / 8))
        times = self.samples.times[since:settled]
        shown = slice(*np.searchsorted(times, [axes.start, axes.start + axes.seconds]))
        shown = slice(max(0, shown.start - 1), shown.stop + 1)
        for panel, plot, span in zip(self.panels, plots, axes.spans, strict=False):
            position = panel.scale.position(self.samples.of(panel.quantity, since)[: settled - since][shown])
            x, y = self._x(plot, times[shown]), _y(plot, span, position)
            surface.set_clip(plot.inflate(0, 2 * width))
            for engine in self._drawn_engines(panel):
                known = np.isfinite(y[:, engine])
                if known.sum() > 1:
                    line = np.column_stack([x[known], y[known, engine]]).tolist()
                    pygame.draw.lines(surface, self._colours[self.samples.engines[engine]], False, line, width)
        surface.set_clip(None)
        self._samples = settled

    def _draw_names(self, surface: Surface, plots: list[Rect], axes: Axes, text_height: int) -> None:
        """Write each line's engine at its end."""
        small = _small(text_height)
        last = int(np.searchsorted(self.samples.times[: self._settled], axes.start + axes.seconds, side="right")) - 1
        if last < 0:
            return
        for panel, plot, span in zip(self.panels, plots, axes.spans, strict=False):
            values = self.samples.of(panel.quantity, last)[0]
            ends = {self.samples.engines[k]: values[k] for k in self._drawn_engines(panel) if np.isfinite(values[k])}
            if panel.quantity is Quantity.ENERGY:
                ends |= {self.samples.reference: ends.get(self.samples.reference, 0.0)}
            wanted = _y(plot, span, panel.scale.position(np.array(list(ends.values())))) - small / 2
            heights = spread(wanted.tolist(), [small] * len(ends), plot.y - 1, plot.bottom + 1)
            x = min(self._column(plot, float(self.samples.times[last])), plot.right) + small // 3
            for name, y in zip(ends, heights, strict=True):
                label = lettering(name, self._colours[name], small)
                surface.fill(self.palette.ground, label.get_rect(topleft=(x, round(y))))
                surface.blit(label, (x, round(y)))

    def _draw_selection(self, surface: Surface, plots: list[Rect]) -> None:
        if self.selection:
            first, last = sorted(self._column(plots[0], time) for time in self.selection)
            veil = Surface((last - first + 1, plots[-1].bottom - plots[0].y))
            veil.fill(self.palette.ink)
            veil.set_alpha(40)
            surface.blit(veil, (first, plots[0].y))

    def _draw_cursor(self, surface: Surface, plots: list[Rect], text_height: int) -> None:
        x, knob = self._column(plots[0], self._time), text_height // 3
        if plots[0].x <= x <= plots[0].right:
            bottom = plots[-1].bottom
            pygame.draw.line(surface, self.palette.ink, (x, plots[0].y), (x, bottom))
            pygame.draw.polygon(
                surface, self.palette.ink, [(x - knob, bottom + knob), (x + knob, bottom + knob), (x, bottom)]
            )

    # What stands out

    def _marks(self) -> list[Mark]:
        """Return the note, first differences, the end of the reference's trust, and of the reference."""
        marks, reference, ink = self.marks, self.samples.reference, self.palette.ink
        found = [Mark(None, self.note, ink, "")] if self.note else []
        for name, time in marks.differences.items():
            found.append(Mark(time, f"{name} differs", self._colours[name], f"first contact unlike {reference}'s"))
        if marks.trust.until is not None:
            found.append(Mark(marks.trust.until, marks.trust.ends_by, ink, SENTENCES[marks.trust.ends_by]))
        if marks.stopped:
            found.append(Mark(marks.stopped[0], f"{reference} stops", ink, marks.stopped[1]))
        return found

    def _placed_marks(self, plot: Rect, text_height: int) -> list[tuple[Mark, Rect]]:
        """Return the marks with the places of their labels above the charts, none over another."""
        small = _small(text_height)
        start, seconds = self._zoom or (0.0, self._seconds)
        shown = [one for one in self._marks() if one.time is None or start <= one.time <= start + seconds]
        wanted = [plot.x if one.time is None else self._column(plot, one.time) + small // 2 for one in shown]
        widths = [text_width(one.text, small) + small for one in shown]
        lefts = spread(wanted, widths, 0, plot.right + round(8.2 * text_height))
        return [(one, Rect(round(x), 1, width, small + 2)) for one, x, width in zip(shown, lefts, widths, strict=True)]

    def _draw_marks(self, surface: Surface, plots: list[Rect], text_height: int) -> None:
        """Draw each mark as a tick above the charts, with its label, and faintly through them."""
        small = _small(text_height)
        for mark, label in self._placed_marks(plots[0], text_height):
            if mark.time is not None:
                x, top = self._column(plots[0], mark.time), plots[0].y
                faint = self.palette.ground.lerp(mark.colour, 0.5)
                pygame.draw.line(surface, faint, (x, top), (x, plots[-1].bottom))
                pygame.draw.line(surface, mark.colour, (x, top), (min(x, label.x), label.bottom))
                pygame.draw.polygon(surface, mark.colour, [(x - 4, top - 6), (x + 4, top - 6), (x, top)])
            surface.blit(lettering(mark.text, mark.colour, small), label)

    def _draw_card(self, surface: Surface, place: Rect, text_height: int, point: ScreenPoint) -> None:
        """Draw the values at a point, or what the mark there means."""
        mark = self.mark_at(place, text_height, point)
        if mark:
            rows = [[f"{mark.time:.2f} s", mark.text], ["", mark.sentence]]
        else:
            rows = self._values_at(place, text_height, point)
            faint = self.palette.ground.lerp(self.palette.ink, 0.5)
            pygame.draw.line(surface, faint, (point[0], place.y), (point[0], place.bottom))
        card(surface, rows, point, text_height, surface.get_rect())

    def _values_at(self, place: Rect, text_height: int, point: ScreenPoint) -> list[list[str]]:
        plots = self.plots(place, text_height)
        number = min(range(len(plots)), key=lambda k: abs(plots[k].centery - (point[1] - place.y)))
        panel, times = self.panels[number], self.samples.times[: self._settled]
        row = int(np.abs(times - self.time_at(place, text_height, point[0])).argmin())
        values = self.samples.of(panel.quantity, row)[0]
        rows = [[f"{times[row]:.3f} s", " ".join(panel.lines)]]
        for k in self._drawn_engines(panel):
            value = panel.digits.format(values[k]) if np.isfinite(values[k]) else "not known"
            rows.append([self.samples.engines[k], value])
        return rows


def panels_of(samples: Samples) -> tuple[Panel, ...]:
    """Return the charts of a run; a single engine has no gap, and its energy is compared with the start."""
    against = "the start" if samples.is_alone else samples.reference
    unit = "%" if samples.energy_at_start else "kg px²/s²"
    energy = Panel(Quantity.ENERGY, (f"energy, {unit}", f"from {against}"), BothSigns(), f"{{:+.4g}} {unit}")
    gap = Panel(Quantity.GAP, ("gap, px", f"from {against}"), Logarithmic(), "{:.4g} px")
    momentum = Panel(Quantity.MOMENTUM, ("momentum", "kg px/s"), Linear(), "{:.6g} kg px/s")
    return (energy, momentum) if samples.is_alone else (energy, gap, momentum)


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


def _small(text_height: int) -> int:
    """Return the height of the text in charts, px."""
    return max(10, round(0.75 * text_height))


def _y(plot: Rect, span: Span, position: Floats) -> Floats:
    """Return the height at which a position on an axis is in a chart, px of the strip."""
    low, high = span
    return plot.bottom - 1 - (position - low) / (high - low) * (plot.height - 1)
