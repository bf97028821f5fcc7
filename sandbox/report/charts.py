"""The report's charts: each engine over time, under one cursor."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from bokeh.document import Document
from bokeh.models import FixedTicker, NumeralTickFormatter, Range1d
from bokeh.models.annotations import Span
from bokeh.models.text import BaseText
from bokeh.plotting import figure
from bokeh.themes import Theme

from sandbox.analysis.comparison import Comparison
from sandbox.report.colours import colours_of
from sandbox.report.numbers import minus
from sandbox.report.scales import BothSigns, Logarithmic, Scale, gap_scale
from sandbox.scene.units import Dimension
from sandbox.state import Floats

MAX_POINTS: Final = 2_000  # of a line, about; screens have fewer columns
MARKERS_PER_LINE: Final = 12  # they distinguish lines without colour
MARKERS: Final = {  # Bokeh's markers, and the letters that stand for them in a legend
    "circle": "○", "square": "□", "triangle": "△", "diamond": "◇", "inverted_triangle": "▽", "star": "☆"
}  # fmt: skip
OF_REFERENCE: Final = ("x", "\N{MULTIPLICATION SIGN}")
MAX_TICKS: Final = 9  # on an axis of powers of ten
INK: Final = "#222222"
GRID: Final = "#e3e3e3"
GROUND: Final = "#fefefe"  # inside markers
TRUST: Final = "#777777"  # where the reference's paths stop meaning anything
FONT: Final = "system-ui, sans-serif"
THEME: Final = Theme(
    json={
        "attrs": {
            "Plot": {
                "outline_line_color": None,
                "sizing_mode": "stretch_width",
                "background_fill_alpha": 0,
                "border_fill_alpha": 0,
            },
            "Axis": {
                "axis_label_text_font": FONT,
                "axis_label_text_font_size": "16px",
                "axis_label_text_font_style": "normal",
                "axis_label_text_color": INK,
                "axis_line_color": INK,
                "major_label_text_font": FONT,
                "major_label_text_font_size": "16px",
                "major_label_text_color": INK,
                "major_tick_line_color": INK,
                "minor_tick_line_color": None,
            },
            "Grid": {"grid_line_color": GRID},
        }
    }
)


class Style(NamedTuple):
    """How an engine's lines are drawn. The marker distinguishes engines even without colours."""

    color: str
    marker: str
    symbol: str


@dataclass(frozen=True)
class Chart:
    """A figure with its title, caption, alternative text, and the style of each engine in it."""

    name: str
    title: str
    about: str
    alt: str
    legend: Mapping[str, Style]
    figure: figure


def charts(comparison: Comparison) -> list[Chart]:
    """Draw gap and energy over time: the gap from a reference, and energy where there is a scale of it."""
    gap = [_gap(comparison)] if len(comparison.runs) > 1 else []
    return gap + ([_energy(comparison)] if comparison.energy_scale else [])


def as_document(drawn: Sequence[Chart]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return Bokeh's JSON of charts, and the chart's name for each root's id."""
    document = Document(theme=THEME)
    for chart in drawn:
        document.add_root(chart.figure)
    numbers: dict[str, str] = {}
    rendered = _renumbered(document.to_json(deferred=False), numbers)
    return rendered, {numbers[chart.figure.id]: chart.name for chart in drawn}


def _renumbered(node: Any, numbers: dict[str, str]) -> Any:
    """Replace the ids of Bokeh's models, which it counts on from page to page, so that equal pages have equal ids."""
    if isinstance(node, list):
        return [_renumbered(value, numbers) for value in node]
    if not isinstance(node, dict):
        return node
    return {
        key: numbers.setdefault(value, f"model-{len(numbers)}") if key == "id" else _renumbered(value, numbers)
        for key, value in node.items()
    }


def _styles(comparison: Comparison) -> dict[str, Style]:
    """Return each engine's style, distinct in marker as well as in colour."""
    markers = [*MARKERS.items()]
    marks = {comparison.against: OF_REFERENCE}
    marks |= {name: markers[index % len(markers)] for index, name in enumerate(comparison.others)}
    return {name: Style(color, *marks[name]) for name, color in colours_of(comparison.runs).items()}


# Over time


def thinned(values: Floats, most: int = MAX_POINTS) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return about `most` indices of a series: its ends, and the lowest and the highest value of each interval."""
    if len(values) <= most:
        return np.arange(len(values))
    size = -(-2 * len(values) // most)
    intervals = np.pad(values, (0, -len(values) % size), mode="edge").reshape(-1, size)
    starts = np.arange(len(intervals)) * size
    chosen = np.concatenate([[0], starts + intervals.argmin(axis=1), starts + intervals.argmax(axis=1)])
    return np.unique(np.append(np.minimum(chosen, len(values) - 1), len(values) - 1))


def _gap(comparison: Comparison) -> Chart:
    units = comparison.scene.units
    factor, scale = units.factor(Dimension.LENGTH), gap_scale(units)
    series = {name: factor * run.gap_max for name, run in comparison.others.items()}
    plot = _figure(comparison, units.length)
    scale_axis(plot, scale, series.values())
    styles = _draw(plot, comparison, {name: scale.position(values) for name, values in series.items()})
    _mark_first_differences(plot, comparison, series, scale)
    about = (
        f"The largest distance of a ball from its position in {comparison.against}, in powers of ten; less than "
        f"{scale.least:g} {units.length} is drawn there. A large marker is the first contact that differs."
        f"{_trust(comparison)}"
    )
    alt = _ends("Largest gap at the end", series, units.length)
    return Chart("gap", "Gap", about, alt, styles, plot)


def _energy(comparison: Comparison) -> Chart:
    """Draw how each engine's energy differs from the reference's; if there is no other, from that at the start."""
    runs, against = comparison.runs, comparison.against
    others = {name: 100 * run.energy_gap for name, run in comparison.others.items()}
    series = others or {against: 100 * runs[against].energy_change}
    compared = against if others else "the start"
    plot = _figure(comparison, "% of the energy")
    scale_axis(plot, BothSigns(), series.values())
    styles = _draw(plot, comparison, {name: BothSigns().position(values) for name, values in series.items()})
    about = (
        f"How much more energy than {compared}, or less, there is, as a percentage of the scale of energy, in "
        "powers of ten both ways. A line ends where contacts that lose energy can no longer be compared."
    )
    known = {name: values[np.isfinite(values)] for name, values in series.items()}
    alt = _ends(f"Difference from {compared} at the end", known, "%")
    return Chart("energy", "Energy", about, alt, styles, plot)


def _trust(comparison: Comparison) -> str:
    until = comparison.trusted_until
    ends_by = comparison.trust.ends_by
    return "" if until is None else f" After the dashed line ({ends_by}, {until:.2f} s) only statistics are meaningful."


def _figure(comparison: Comparison, unit: str, **options: Any) -> figure:
    """Return an empty chart over time, with the end of the reference's trust and the cursor that the player moves."""
    end = float(comparison.time[-1]) or 1.0
    plot = figure(
        height=270,
        x_range=Range1d(start=0, end=end, bounds=(0, end)),
        x_axis_label="time, s",
        y_axis_label=unit,
        tools="xbox_zoom",
        toolbar_location=None,
        **options,
    )
    plot.axis.formatter = NumeralTickFormatter(format="0,0.[00000]")
    until = comparison.trusted_until
    if until is not None:
        plot.add_layout(Span(location=until, dimension="height", line_dash="dashed", line_color=TRUST))
    # On the overlay level, moving the cursor does not redraw the lines.
    plot.add_layout(Span(name="cursor", location=0, dimension="height", line_color=INK, line_width=2, level="overlay"))
    return plot


def scale_axis(plot: figure, scale: Scale, values: Iterable[Floats]) -> None:
    """Let a chart's vertical axis show positions on a scale, with numbers at the most important of its ticks."""
    known = np.concatenate([line[np.isfinite(line)] for line in values])
    low, high = scale.span(float(known.min(initial=np.inf)), float(known.max(initial=-np.inf)))
    ticks: dict[float | str, str | BaseText] = {}
    shown: list[float] = []
    for at, text in scale.ticks((low, high)):
        if all(abs(at - place) >= (high - low) / MAX_TICKS for place in shown):
            shown.append(at)
            ticks[at] = minus(text)
    plot.y_range = Range1d(start=low, end=high + 0.03 * (high - low))
    plot.yaxis[0].ticker = plot.ygrid[0].ticker = FixedTicker(ticks=shown)
    plot.yaxis[0].major_label_overrides = ticks


def _draw(plot: figure, comparison: Comparison, series: dict[str, Floats]) -> dict[str, Style]:
    """Draw a line for each engine, the reference's below the others; return their styles."""
    styles = _styles(comparison)
    for name in sorted(series, key=lambda name: name != comparison.against):
        style, values = styles[name], series[name].astype(np.float32)
        kept = thinned(np.nan_to_num(values))
        marked = _marker_positions(len(values), list(styles).index(name), len(styles))
        time = comparison.time.astype(np.float32)
        plot.line(time[kept], values[kept], line_color=style.color, line_width=2.5)
        plot.scatter(
            time[marked],
            values[marked],
            marker=style.marker,
            size=10,
            line_color=style.color,
            line_width=2,
            fill_color=GROUND,
        )
    return {name: styles[name] for name in series}


def _marker_positions(steps: int, index: int, count: int) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return the steps of one of `count` lines that have markers: evenly spaced, and none that another line marks."""
    return np.unique(
        ((np.arange(MARKERS_PER_LINE) + (index + 0.5) / count) / MARKERS_PER_LINE * (steps - 1)).astype(np.intp)
    )


def _mark_first_differences(
    plot: figure, comparison: Comparison, gaps: Mapping[str, Floats], scale: Logarithmic
) -> None:
    for name, style in _styles(comparison).items():
        run = comparison.runs[name]
        if not (first := run.figures.first_difference):
            continue
        time = first.time
        step = min(math.ceil(comparison.scene.clock.steps(time) - 1e-9), len(run.gap_max) - 1)
        gap = float(scale.position(gaps[name][step]))
        plot.scatter([time], [gap], marker=style.marker, size=22, line_color=style.color, line_width=3, fill_alpha=0)


def _ends(what: str, series: dict[str, Floats], unit: str) -> str:
    ends = ", ".join(f"{name} {minus(f'{values[-1]:.4g}')} {unit}".rstrip() for name, values in series.items())
    return f"{what}: {ends}."
