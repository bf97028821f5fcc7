"""A sweep's rows -> one HTML page that needs no network: each engine's figures, and their spread over the seeds."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from html import escape
from statistics import median
from typing import Any, Final

import numpy as np
from bokeh.embed import file_html
from bokeh.layouts import column
from bokeh.models import ColumnDataSource, FactorRange, FixedTicker, Range1d
from bokeh.models.annotations import Whisker
from bokeh.models.ui import UIElement
from bokeh.models.widgets import Div
from bokeh.plotting import figure
from bokeh.resources import INLINE

from sandbox.report.charts import Style, styles_of
from sandbox.scene.fields import PALETTE
from sandbox.sweeps.jobs import SPEED_CLASSES, Row, Sweep

WIDTH: Final = 1150  # px
CHART_OPTIONS: Final[dict[str, Any]] = {"width": WIDTH, "height": 420, "toolbar_location": None}
RATE_OFFSET: Final = 1.03  # factor on the rate axis between one engine and the next, so that they do not overlap

Groups = dict[str, list[float]]  # engine and rate -> a value for each seed


def page(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Return the page. Charts without data are left out."""
    style: dict[str, str | None] = {"overflow-wrap": "anywhere", "font-size": "16px"}
    # TeX in a title could link to a script.
    heading = Div(text=_heading(sweep, rows), disable_math=True, width=WIDTH, styles=style)
    return file_html(column(heading, *_charts(rows)), INLINE, title=f"{sweep.scene.name}: a sweep")


def _heading(sweep: Sweep, rows: Sequence[Row]) -> str:
    seeds, rates = {job.seed for job in sweep.jobs}, {job.rate for job in sweep.jobs}
    title = escape(sweep.scene.title or sweep.scene.name)
    return (
        f"<h1>{title}</h1><p>{len(rows):,} of {len(sweep.jobs):,} runs of {sweep.scene.seconds:g} s: "
        f"{len(seeds):,} seeds, {escape(', '.join(map(str, sorted(rates))))} steps per second, "
        f"against {escape(sweep.against)}.</p>"
    )


def _charts(rows: Sequence[Row]) -> Iterator[UIElement]:
    if any(row.get("gap_rms") for row in rows):
        yield _error_by_rate(rows)
    for title, name, log in (
        ("First difference, s", "first_difference.time", False),
        ("Horizon, s", "horizon", False),
        ("Largest change of energy, as a fraction", "energy_drift", True),
    ):
        groups = _grouped(rows, name, positive=log)
        if groups:
            yield _spread(title, groups, log=log)
    if any(row["speeds"] for row in rows):
        yield _speeds(rows)


def _name(row: Row) -> str:
    return f"{row['engine']} {row['settings']}".rstrip()


def _grouped(rows: Sequence[Row], value: str, *, positive: bool) -> Groups:
    """Collect the seeds' values for each engine and rate. positive: only positive ones, for a logarithmic axis."""
    groups: Groups = defaultdict(list)
    names = list(dict.fromkeys(map(_name, rows)))
    for row in sorted(rows, key=lambda row: (names.index(_name(row)), row["rate"])):
        if row.get(value) is not None and (row[value] > 0 or not positive):
            groups[f"{_name(row)} at {row['rate']}"].append(row[value])
    return groups


def _styles(rows: Sequence[Row]) -> dict[str, Style]:
    return styles_of(list(dict.fromkeys(map(_name, rows))))


def _error_by_rate(rows: Sequence[Row]) -> Any:
    """Draw each engine's median gap against the rate, with its range over the seeds."""
    gaps = [row["gap_rms"] for row in rows if row["gap_rms"] > 0]
    chart = figure(
        title="Gap to the reference, RMS: median and range over the seeds",
        x_axis_label="steps per second",
        y_axis_label="px",
        x_axis_type="log",
        y_axis_type="log",
        y_range=Range1d(min(gaps) / 2, max(gaps) * 2),
        **CHART_OPTIONS,
    )
    for index, (name, style) in enumerate(_styles(rows).items()):
        of_engine = [row for row in rows if _name(row) == name and row["gap_rms"] > 0]
        by_rate = {rate: [row["gap_rms"] for row in of_engine if row["rate"] == rate] for rate in _rates(of_engine)}
        if by_rate:
            at = [rate * RATE_OFFSET**index for rate in by_rate]
            middle = [median(values) for values in by_rate.values()]
            chart.line(at, middle, color=style.color, line_dash=style.dash, legend_label=name, line_width=2.5)
            chart.scatter(at, middle, color=style.color, marker=style.marker, legend_label=name, size=10)
            _add_range(chart, at, list(by_rate.values()), style.color)
    chart.xaxis.ticker = FixedTicker(ticks=_rates(rows))
    return _legible(chart)


def _rates(rows: Sequence[Row]) -> list[int]:
    return sorted({row["rate"] for row in rows})


def _spread(title: str, groups: Groups, *, log: bool) -> Any:
    """Draw a point for each seed, and each group's median and range."""
    chart = figure(
        title=title, x_range=FactorRange(factors=list(groups)), y_axis_type="log" if log else "linear", **CHART_OPTIONS
    )
    for name, values in groups.items():
        chart.scatter([name] * len(values), values, color=PALETTE[0], alpha=0.3, size=5)
        chart.scatter([name], [median(values)], color=PALETTE[3], marker="dash", size=40, line_width=3)
        _add_range(chart, [name], [values], PALETTE[3])
    chart.xaxis.major_label_orientation = 0.6
    return _legible(chart)


def _add_range(chart: Any, at: Sequence[object], values: Sequence[Sequence[float]], colour: str) -> None:
    ends = {"at": at, "low": list(map(min, values)), "high": list(map(max, values))}
    source = ColumnDataSource(ends)
    chart.add_layout(Whisker(source=source, base="at", lower="low", upper="high", line_color=colour))


def _speeds(rows: Sequence[Row]) -> Any:
    """Draw the number of final speeds in each class, relative to the number that their law expects: 1 if it holds."""
    chart = figure(
        title="Speeds at the end, compared with the law for as many balls of the same energy",
        x_axis_label="fraction of balls that are slower, by the law",
        y_axis_label="balls found / expected",
        **CHART_OPTIONS,
    )
    middles = (np.arange(SPEED_CLASSES) + 0.5) / SPEED_CLASSES
    for name, style in _styles(rows).items():
        counts = np.sum([row["speeds"] for row in rows if _name(row) == name and row["speeds"]], axis=0)
        if np.sum(counts):
            shares = counts * SPEED_CLASSES / np.sum(counts)
            chart.step(
                middles,
                shares,
                mode="center",
                color=style.color,
                line_dash=style.dash,
                line_width=2.5,
                legend_label=name,
            )
    chart.line([0, 1], [1, 1], color="black")
    return _legible(chart)


def _legible(chart: Any) -> Any:
    """Set a chart's text large enough for a projector."""
    chart.title.text_font_size = "18px"
    chart.axis.axis_label_text_font_size = chart.axis.major_label_text_font_size = "15px"
    if chart.legend:
        chart.legend.label_text_font_size = "15px"
        chart.add_layout(chart.legend[0], "right")
    return chart
