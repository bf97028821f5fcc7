"""A sweep's rows -> one HTML page that needs no network: what the seeds agree on, and how far they are spread."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from html import escape
from statistics import median
from typing import Any, Final

import numpy as np
from bokeh.embed import file_html
from bokeh.layouts import column
from bokeh.models import ColumnDataSource, FactorRange
from bokeh.models.annotations import Whisker
from bokeh.models.ui import UIElement
from bokeh.models.widgets import Div
from bokeh.plotting import figure
from bokeh.resources import INLINE

from sandbox.scene import PALETTE
from sandbox.sweep.jobs import SHARES, Row, Sweep

SIZE: Final[dict[str, Any]] = {"width": 900, "height": 380}  # px of a chart

Groups = dict[str, list[float]]  # what is told apart -> a value for each seed


def page(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Make the page. A chart that no row has anything for is left out."""
    heading = Div(text=_heading(sweep, rows))
    return file_html(column(heading, *_charts(rows)), INLINE, title=f"{sweep.scene.name}: a sweep")


def _heading(sweep: Sweep, rows: Sequence[Row]) -> str:
    seeds, rates = ({getattr(job, key) for job in sweep.jobs} for key in ("seed", "rate"))
    title = escape(sweep.scene.title or sweep.scene.name)
    return (
        f"<h1>{title}</h1><p>{len(rows):,} of {len(sweep.jobs):,} runs of {sweep.scene.seconds:g} s: "
        f"{len(seeds):,} seeds, {escape(', '.join(map(str, sorted(rates))))} steps a second, "
        f"against {escape(sweep.against)}.</p>"
    )


def _charts(rows: Sequence[Row]) -> Iterator[UIElement]:
    if any(row.get("gap_rms") for row in rows):
        yield _error_by_rate(rows)
    for title, name, log in (
        ("First difference, s", "first_difference.time", False),
        ("Horizon, s", "horizon", False),
        ("Largest change of energy, as a share", "energy_drift", True),
    ):
        groups = _grouped(rows, name, positive=log)
        if groups:
            yield _spread(title, groups, log=log)
    if any(row["speeds"] for row in rows):
        yield _speeds(rows)


def _name(row: Row) -> str:
    return f"{row['engine']} {row['settings']}".rstrip()


def _grouped(rows: Sequence[Row], value: str, *, positive: bool) -> Groups:
    """Collect what the seeds say, for each engine and rate; on a logarithmic axis only what is positive has a place."""
    groups: Groups = defaultdict(list)
    for row in rows:
        if row.get(value) is not None and (row[value] > 0 or not positive):
            groups[f"{_name(row)} at {row['rate']}"].append(row[value])
    return groups


def _colours(rows: Sequence[Row]) -> dict[str, str]:
    names = dict.fromkeys(map(_name, rows))
    return {name: PALETTE[index % len(PALETTE)] for index, name in enumerate(names)}


def _error_by_rate(rows: Sequence[Row]) -> Any:
    """Draw each engine's median gap against the rate, and its range over the seeds."""
    chart = figure(
        title="Gap to the yardstick, RMS: median and range over the seeds",
        x_axis_label="steps a second",
        y_axis_label="px",
        x_axis_type="log",
        y_axis_type="log",
        **SIZE,
    )
    for name, colour in _colours(rows).items():
        of_engine = [row for row in rows if _name(row) == name and row["gap_rms"] > 0]
        by_rate = {rate: [row["gap_rms"] for row in of_engine if row["rate"] == rate] for rate in _rates(of_engine)}
        if by_rate:
            middle = [median(values) for values in by_rate.values()]
            chart.line(list(by_rate), middle, color=colour, legend_label=name, line_width=2)
            chart.scatter(list(by_rate), middle, color=colour, size=7)
            _add_range(chart, list(by_rate), list(by_rate.values()), colour)
    return chart


def _rates(rows: Sequence[Row]) -> list[int]:
    return sorted({row["rate"] for row in rows})


def _spread(title: str, groups: Groups, *, log: bool) -> Any:
    """Draw a point for each seed, and the median and range of each group."""
    chart = figure(
        title=title, x_range=FactorRange(factors=list(groups)), y_axis_type="log" if log else "linear", **SIZE
    )
    for name, values in groups.items():
        chart.scatter([name] * len(values), values, color=PALETTE[0], alpha=0.3, size=5)
        chart.scatter([name], [median(values)], color=PALETTE[3], marker="dash", size=40, line_width=3)
        _add_range(chart, [name], [values], PALETTE[3])
    chart.xaxis.major_label_orientation = 0.6
    return chart


def _add_range(chart: Any, where: Sequence[object], values: Sequence[Sequence[float]], colour: str) -> None:
    ends = {"where": where, "low": [min(one) for one in values], "high": [max(one) for one in values]}
    source = ColumnDataSource(ends)
    chart.add_layout(Whisker(source=source, base="where", lower="low", upper="high", line_color=colour))


def _speeds(rows: Sequence[Row]) -> Any:
    """Draw how many speeds at the end are in each twentieth of their law: 1 where the law holds."""
    chart = figure(
        title="Speeds at the end, beside the law of as many balls with their energy",
        x_axis_label="share of balls that are slower, by the law",
        y_axis_label="balls found / expected",
        **SIZE,
    )
    middles = (np.arange(SHARES) + 0.5) / SHARES
    for name, colour in _colours(rows).items():
        counts = np.sum([row["speeds"] for row in rows if _name(row) == name and row["speeds"]], axis=0)
        if np.sum(counts):
            shares = counts * SHARES / np.sum(counts)
            chart.step(middles, shares, mode="center", color=colour, legend_label=name, line_width=2)
    chart.line([0, 1], [1, 1], color="black", line_dash="dashed")
    return chart
