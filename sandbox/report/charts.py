"""The report's charts: each engine over time, under one cursor, and the ledger."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Any, Final

import numpy as np
from bokeh.document import Document
from bokeh.models import BasicTicker, FactorRange, Range1d
from bokeh.models.annotations import Label, Legend, LegendItem, Span
from bokeh.plotting import figure
from bokeh.themes import Theme
from bokeh.transform import dodge

from sandbox.analysis.causes import Cause
from sandbox.analysis.comparison import Comparison
from sandbox.analysis.series import contacts_by, energies, thinned
from sandbox.engines.colours import colours_of
from sandbox.quantity import length
from sandbox.state import Floats

MARKERS_PER_LINE: Final = 12  # they distinguish lines without colour
LABEL_LETTERS: Final = 20  # in a line of a bar's label: leaves room for the bars on a telephone
MIN_BAR: Final = 1e-3  # fraction of the longest bar; causes with shorter bars are in the table only
LINE_DASHES: Final = ("solid", "dashed", "dotdash", "dotted", "dashdot", "solid")
MARKERS: Final = ("circle", "square", "triangle", "diamond", "inverted_triangle", "star")
HATCHES: Final = ("blank", "right_diagonal_line", "dot", "horizontal_line", "cross", "left_diagonal_line")
BLACK: Final = "#222222"
FONT: Final = "system-ui, sans-serif"
THEME: Final = Theme(
    json={
        "attrs": {
            "Plot": {"outline_line_color": None, "sizing_mode": "stretch_width", "background_fill_alpha": 0},
            "Axis": {
                "axis_label_text_font": FONT,
                "axis_label_text_font_size": "16px",
                "axis_label_text_font_style": "normal",
                "axis_label_text_color": BLACK,
                "major_label_text_font": FONT,
                "major_label_text_font_size": "16px",
                "major_label_text_color": BLACK,
                "minor_tick_line_color": None,
            },
            "Grid": {"grid_line_color": "#e3e3e3"},
            "Legend": {
                "label_text_font": FONT,
                "label_text_font_size": "16px",
                "label_text_color": BLACK,
                "orientation": "horizontal",
                "border_line_color": None,
                "background_fill_alpha": 0,
                "padding": 0,
                "margin": 4,
                "spacing": 16,
                "glyph_width": 44,
            },
            "Label": {"text_font": FONT, "text_font_size": "16px", "text_color": BLACK},
        }
    }
)


@dataclass(frozen=True)
class Chart:
    """A figure with its title, caption and alternative text."""

    name: str
    title: str
    about: str
    alt: str
    figure: figure


@dataclass(frozen=True)
class Style:
    """How an engine's lines and bars are drawn. No two share a dash and a marker."""

    color: str
    dash: str
    marker: str
    hatch: str


def styles_of(names: Sequence[str], reference: str | None = None) -> dict[str, Style]:
    """Return each engine's style, distinct in dash, marker and hatch as well as in colour."""
    colours, others = colours_of(names), [name for name in names if name != reference]
    styles = {reference: Style(colours[reference], "solid", "x", "blank")} if reference else {}
    for index, name in enumerate(others):
        styles[name] = Style(colours[name], *(kind[index % len(kind)] for kind in (LINE_DASHES, MARKERS, HATCHES)))
    return {name: styles[name] for name in names}


def charts(comparison: Comparison) -> list[Chart]:
    """Draw gap, energy, momentum and contacts over time, and the ledger if it has entries."""
    over_time = [_energy(comparison), _momentum(comparison), _contacts(comparison)]
    gap = [_gap(comparison)] if len(comparison.runs) > 1 else []
    ledger = [_ledger(comparison)] if _bars(comparison)[1] else []
    return gap + over_time + ledger


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
    return styles_of([*comparison.runs], comparison.against)


# Over time


def _gap(comparison: Comparison) -> Chart:
    series = {name: run.gap_max for name, run in comparison.runs.items() if name != comparison.against}
    positive = np.concatenate([values[values > 0] for values in series.values()])
    low, high = (positive.min(), positive.max()) if len(positive) else (1e-15, 1.0)
    plot = _figure(comparison, "px", y_axis_type="log", y_range=Range1d(start=float(low) / 3, end=float(high) * 3))
    # A log axis has no 0, so a line begins at the first gap.
    _draw(plot, comparison, {name: np.where(values > 0, values, np.nan) for name, values in series.items()})
    _mark_first_differences(plot, comparison)
    trust = comparison.trust
    if trust.until is not None:
        late = trust.until > comparison.time[-1] / 2
        label = Label(x=trust.until, y=6, y_units="screen", text=trust.ends_by)
        label.text_align, label.x_offset = ("right", -6) if late else ("left", 6)
        plot.add_layout(label)
    return Chart(
        "gap",
        "Gap",
        f"The largest distance of a ball from its position in {comparison.against}, on a log scale. A line starts at "
        "the first gap; a large marker is the first contact that differs; after the dashed line only statistics are "
        "meaningful.",
        _ends("Largest gap at the end", series, "px"),
        plot,
    )


def _energy(comparison: Comparison) -> Chart:
    series, unit = energies(comparison)
    plot = _figure(comparison, "% of the start" if unit == "%" else unit, y_range=_from_zero(series))
    _draw(plot, comparison, series)
    about = "Kinetic and potential energy together. Elastic balls keep all of it."
    return Chart("energy", "Energy", about, _ends("Energy at the end", series, unit), plot)


def _momentum(comparison: Comparison) -> Chart:
    series = {name: length(run.momentum) for name, run in comparison.runs.items()}
    plot = _figure(comparison, "kg px/s", y_range=_from_zero(series))
    _draw(plot, comparison, series)
    about = (
        "The magnitude of the total momentum. Walls, gravity and the mouse change it; contacts between balls must not."
    )
    return Chart("momentum", "Momentum", about, _ends("Momentum at the end", series, "kg px/s"), plot)


def _contacts(comparison: Comparison) -> Chart:
    series = {name: contacts_by(comparison.time, run) for name, run in comparison.runs.items()}
    plot = _figure(comparison, "so far", y_range=_from_zero(series))
    _draw(plot, comparison, series)
    about = "Contacts of balls with each other and with walls, so far. Balls that stick count again in every step."
    return Chart("contacts", "Contacts", about, _ends("All contacts", series, ""), plot)


def _figure(comparison: Comparison, unit: str, **options: Any) -> figure:
    """Return an empty chart over time, with the end of the reference's trust and the cursor that the player moves."""
    end = float(comparison.time[-1]) or 1.0
    plot = figure(
        height=300,
        x_range=Range1d(start=0, end=end, bounds=(0, end)),
        x_axis_label="time, s",
        y_axis_label=unit,
        tools="xbox_zoom,reset",
        **options,
    )
    plot.toolbar.logo = None
    until = comparison.trusted_until
    if until is not None:
        plot.add_layout(Span(location=until, dimension="height", line_dash="dashed", line_color="#777777"))
    # On the overlay level, moving the cursor does not redraw the lines.
    plot.add_layout(
        Span(name="cursor", location=0, dimension="height", line_color=BLACK, line_width=2, level="overlay")
    )
    return plot


def _draw(plot: figure, comparison: Comparison, series: dict[str, Floats]) -> None:
    """Draw a line for each engine, the reference's below the others, and a legend above the chart."""
    items = {}
    styles = _styles(comparison)
    for name in sorted(series, key=lambda name: name != comparison.against):
        style, values = styles[name], series[name].astype(np.float32)
        kept = thinned(np.nan_to_num(values))
        marked = _marker_positions(len(values), list(styles).index(name), len(styles))
        time = comparison.time.astype(np.float32)
        line = plot.line(time[kept], values[kept], line_color=style.color, line_dash=style.dash, line_width=2.5)
        markers = plot.scatter(
            time[marked],
            values[marked],
            marker=style.marker,
            size=10,
            line_color=style.color,
            line_width=2,
            fill_color="white",
        )
        items[name] = _legend_item(name, line, markers)
    _add_legend(plot, [items[name] for name in series])


def _add_legend(plot: figure, items: list[LegendItem]) -> None:
    legend = Legend()
    legend.items = items
    plot.add_layout(legend, "above")


def _legend_item(name: str, *renderers: Any) -> LegendItem:
    return LegendItem(label=name, renderers=list(renderers))


def _marker_positions(steps: int, index: int, count: int) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return the steps of one of `count` lines that have markers: evenly spaced, and none that another line marks."""
    return np.unique(
        ((np.arange(MARKERS_PER_LINE) + (index + 0.5) / count) / MARKERS_PER_LINE * (steps - 1)).astype(np.intp)
    )


def _mark_first_differences(plot: figure, comparison: Comparison) -> None:
    for name, style in _styles(comparison).items():
        run = comparison.runs[name]
        if not run.differences:
            continue
        time = run.differences[0].time
        step = min(math.ceil(comparison.scene.clock.steps(time) - 1e-9), len(run.gap_max) - 1)
        if run.gap_max[step] > 0:
            plot.scatter(
                [time],
                [run.gap_max[step]],
                marker=style.marker,
                size=22,
                line_color=style.color,
                line_width=3,
                fill_alpha=0,
            )


def _from_zero(series: dict[str, Floats]) -> Range1d:
    low = min(0.0, *(float(values.min()) for values in series.values()))
    high = max(float(values.max()) for values in series.values())
    return Range1d(start=low, end=high + 0.08 * (high - low) or 1.0)


def _ends(what: str, series: dict[str, Floats], unit: str) -> str:
    ends = ", ".join(f"{name} {values[-1]:.4g} {unit}".rstrip() for name, values in series.items())
    return f"{what}: {ends}."


# The ledger


def _ledger(comparison: Comparison) -> Chart:
    """Draw a bar for each cause and engine."""
    energy, causes = _bars(comparison)
    styles = {name: style for name, style in _styles(comparison).items() if energy[name]}
    _, unit = energies(comparison)
    axis = "energy, % of start" if unit == "%" else unit
    labels = [fill(cause.label, LABEL_LETTERS) for cause in causes]
    rows = FactorRange(factors=labels[::-1])
    height = 90 + len(causes) * max(40, 22 * len(styles))
    plot = figure(height=height, y_range=rows, x_axis_label=axis, tools="", toolbar_location=None)
    plot.xaxis[0].ticker = BasicTicker(desired_num_ticks=3)  # more would overlap on a telephone
    thickness = 0.8 / len(styles)
    items = []
    for index, (name, style) in enumerate(styles.items()):
        bars = plot.hbar(
            y=dodge("cause", (len(styles) - 1 - 2 * index) / 2 * thickness, range=rows),
            right="energy",
            height=0.85 * thickness,
            source={"cause": labels, "energy": [energy[name].get(cause, 0.0) for cause in causes]},
            fill_color=style.color,
            fill_alpha=0.75,
            line_color=BLACK,
            hatch_pattern=style.hatch,
            hatch_color=BLACK,
            hatch_alpha=0.6,
        )
        items.append(_legend_item(name, bars))
    plot.add_layout(Span(location=0, dimension="height", line_color=BLACK))
    _add_legend(plot, items)
    alt = "Change of energy by cause, as in the table below."
    about = (
        "How much each cause changed an engine's energy; an engine's bars add up to its whole gain or loss. Causes "
        "below a thousandth of the longest bar are in the table only."
    )
    return Chart("ledger", "Energy by cause", about, alt, plot)


def _bars(comparison: Comparison) -> tuple[dict[str, dict[Cause, float]], list[Cause]]:
    """Return each engine's change of energy by cause, in the unit of `energies`, and the causes that get a bar."""
    _, unit = energies(comparison)
    energy: dict[str, dict[Cause, float]] = {
        name: {
            entry.cause: entry.energy / (run.energy[0] / 100 if unit == "%" else 1.0)
            for entry in run.figures.ledger
            if entry.cause != Cause.SPIN
        }
        for name, run in comparison.runs.items()
    }
    largest = {cause: max(abs(changes.get(cause, 0.0)) for changes in energy.values()) for cause in Cause}
    longest = max(largest.values())
    return energy, [cause for cause, change in largest.items() if change > MIN_BAR * longest]
