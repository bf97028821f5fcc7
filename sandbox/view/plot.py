"""A plot of a comparison as a file: the energy and the gap of each engine over time."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from pygame import Rect

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.scales import MIN_GAP, round_up
from sandbox.analysis.series import energies, thinned
from sandbox.errors import SandboxError
from sandbox.files import whole_file
from sandbox.state import Floats
from sandbox.view.canvas import TEXT_HEIGHT, Canvas, PngCanvas, SvgCanvas
from sandbox.view.palette import palette
from sandbox.view.primitives import text_width

CANVASES: Final[Mapping[str, Callable[[tuple[int, int]], Canvas]]] = {".png": PngCanvas, ".svg": SvgCanvas}
CHART: Final = (720, 220)  # width and height of a chart without its axes
LEFT: Final = 80  # of the charts, for the numbers of their axes
LINE_HEIGHT: Final = round(1.4 * TEXT_HEIGHT)
HEADROOM: Final = 1.06  # length of an axis from 0, in units of the largest value
TICKS: Final = 6  # of an axis, about
BELOW: Final = f" (< {MIN_GAP:g})"  # after the name of an engine whose gap is never shown
LINE_WIDTH: Final = 2.0
REFERENCE_WIDTH: Final = 4.0  # wider, so that lines equal to it do not hide it
TIME: Final = "time, s"
WIDER_FONTS: Final = 1.2  # width of a text in the font that shows an SVG, in units of pygame's font, at most
INK: Final = palette("white").ink
FAINT: Final = palette("white").faint


@dataclass(frozen=True)
class Quantity:
    """What a chart shows: a line for each engine. logarithmic: values below MIN_GAP are left out."""

    title: str
    lines: Mapping[str, Floats]
    logarithmic: bool = False


@dataclass(frozen=True)
class Axis:
    """The range of an axis, and its numbers. Of a logarithmic one, values are their log10."""

    low: float
    high: float
    ticks: Mapping[float, str]

    def share(self, values: Floats) -> Floats:
        """Return where values are between the ends, 0 to 1."""
        return (values - self.low) / (self.high - self.low)


def check_plot(path: str) -> None:
    """Raise SandboxError if no plot can have the path's ending."""
    if Path(path).suffix not in CANVASES:
        raise SandboxError(f"{path}: a plot must end in {' or '.join(CANVASES)}")


def save_plot(comparison: Comparison, path: str) -> None:
    """Write the plot of a comparison as PNG or SVG, by the path's ending.

    Raises SandboxError for another ending, or if the file cannot be written.
    """
    check_plot(path)
    quantities = _quantities(comparison)
    labels = max(text_width(text, TEXT_HEIGHT) for text in (TIME, *(f"{name}{BELOW}" for name in comparison.runs)))
    row = CHART[1] + 3 * LINE_HEIGHT
    size = LEFT + CHART[0] + round(WIDER_FONTS * labels) + 2 * TEXT_HEIGHT, len(quantities) * row + 3 * LINE_HEIGHT
    canvas = CANVASES[Path(path).suffix](size)
    canvas.text(_caption(comparison), (TEXT_HEIGHT, LINE_HEIGHT), INK)
    for number, quantity in enumerate(quantities):
        _draw(canvas, Rect((LEFT, number * row + 4 * LINE_HEIGHT), CHART), comparison, quantity)
    with whole_file(path) as file:
        file.write(canvas.content())


def _caption(comparison: Comparison) -> str:
    scene = comparison.scene
    return f"{scene.title or scene.name}, seed {scene.seed}, {scene.rate} steps per second"


def _quantities(comparison: Comparison) -> list[Quantity]:
    lines, unit = energies(comparison)
    energy = Quantity(f"Energy, {'%, 100 at the start' if unit == '%' else unit}", lines)
    gaps = {name: run.gap_max for name, run in comparison.runs.items() if name != comparison.against}
    return [energy, Quantity(f"Largest gap to {comparison.against}, px", gaps, logarithmic=True)] if gaps else [energy]


def _draw(canvas: Canvas, place: Rect, comparison: Comparison, quantity: Quantity) -> None:
    """Draw a chart: its title, axes, lines, the end of the reference's trust, and names at the ends of the lines."""
    time = comparison.time
    across, up = _linear(0.0, float(time[-1])), _axis(quantity)
    canvas.text(quantity.title, (place.x, place.y - LINE_HEIGHT), INK)
    _draw_axes(canvas, place, across, up)
    if comparison.trusted_until is not None:
        x = place.x + float(across.share(np.array(comparison.trusted_until))) * place.width
        canvas.line(np.array([(x, place.y), (x, place.bottom)]), INK, 1.0)
        canvas.text(comparison.trust.ends_by, (x, place.y - LINE_HEIGHT / 2.5), INK, 0.5)
    ends: dict[str, float] = {}
    colours = palette("white").engines(comparison.runs)
    for name in sorted(quantity.lines, key=lambda name: name != comparison.against):  # the reference below the others
        values = quantity.lines[name]
        kept = thinned(values)
        if quantity.logarithmic:
            kept = kept[values[kept] >= MIN_GAP]
        shown = np.log10(values[kept]) if quantity.logarithmic else values[kept]
        points = np.column_stack([place.x + across.share(time[kept]) * place.width, _heights(place, up, shown)])
        if len(points) > 1:
            canvas.line(points, colours[name], REFERENCE_WIDTH if name == comparison.against else LINE_WIDTH)
        ends[name] = float(points[-1, 1]) if len(points) else float(place.bottom)
    for name, y in _spread(ends, place):
        absent = quantity.logarithmic and (quantity.lines[name] < MIN_GAP).all()
        label = f"{name}{BELOW}" if absent else name
        canvas.text(label, (place.right + TEXT_HEIGHT / 2, y), colours[name])


def _draw_axes(canvas: Canvas, place: Rect, across: Axis, up: Axis) -> None:
    for value, y in zip(up.ticks, _heights(place, up, np.array(list(up.ticks))).tolist(), strict=True):
        canvas.line(np.array([(place.x, y), (place.right, y)]), FAINT, 1.0)
        canvas.text(up.ticks[value], (place.x - TEXT_HEIGHT / 2, y), INK, 1.0)
    for value, share in zip(across.ticks, across.share(np.array(list(across.ticks))).tolist(), strict=True):
        x = place.x + share * place.width
        canvas.line(np.array([(x, place.y), (x, place.bottom)]), FAINT, 1.0)
        canvas.text(across.ticks[value], (x, place.bottom + LINE_HEIGHT / 2), INK, 0.5)
    canvas.line(np.array([place.topleft, place.bottomleft, place.bottomright], float), INK, 1.0)
    canvas.text(TIME, (place.right + 2 * TEXT_HEIGHT, place.bottom + LINE_HEIGHT / 2), INK)


def _heights(place: Rect, up: Axis, values: Floats) -> Floats:
    return place.bottom - up.share(values) * place.height


def _axis(quantity: Quantity) -> Axis:
    """Return the axis of a quantity: from 0, or over powers of ten."""
    values = np.concatenate(list(quantity.lines.values()))
    if not quantity.logarithmic:
        low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
        return _linear(HEADROOM * low, HEADROOM * high or 1.0)
    low = round(math.log10(MIN_GAP))
    high = max(math.ceil(math.log10(max(values.max(), MIN_GAP))), 0)
    step = max(1, round((high - low) / TICKS))
    return Axis(low, high, {float(k): f"{10.0**k:g}" for k in range(low, high + 1, step)})


def _linear(low: float, high: float) -> Axis:
    step = round_up((high - low) / TICKS)
    ticks = step * np.arange(np.ceil(low / step), np.floor(high / step * (1 + 1e-9)) + 1)
    return Axis(low, high, {tick: f"{tick:g}" for tick in ticks.tolist()})


def _spread(heights: Mapping[str, float], place: Rect) -> Iterator[tuple[str, float]]:
    """Yield each name with a height near its own: no two are less than a line apart, and none is below the chart."""
    names: Sequence[str] = sorted(heights, key=lambda name: heights[name])
    lowest = [place.bottom - k * LINE_HEIGHT for k in range(len(names))][::-1]
    y = -np.inf
    for name, limit in zip(names, lowest, strict=True):
        y = max(y + LINE_HEIGHT, min(heights[name], limit))
        yield name, y
