"""A sweep, or a convergence -> one HTML page that needs no network: a verdict, figures, charts over the rates."""

import shlex
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from statistics import median
from typing import Final

import numpy as np
from bokeh.models import ColumnDataSource, FixedTicker, NumeralTickFormatter, Range1d
from bokeh.models.annotations import TeeHead, Whisker
from bokeh.plotting import figure

from sandbox.engines import REFERENCE
from sandbox.judge.thresholds import DOUBLE
from sandbox.report.charts import GROUND, Chart, Style, legend_of, scale_axis, styles_of
from sandbox.report.html import equals_its_text, render, scene_file, seconds_text
from sandbox.report.scales import Logarithmic, gap_scale
from sandbox.scene.units import Dimension
from sandbox.state import Floats
from sandbox.sweeps.convergence import Convergence
from sandbox.sweeps.jobs import OF_CONTACTS, OF_PYMUNK, Row, Sweep
from sandbox.sweeps.summary import Group, engine_of, grouped, known, lengths, summary, summary_rows
from sandbox.text import counted

HEIGHT: Final = 300  # px, of a chart
OFFSET: Final = 1.03  # factor on the rate between one engine and the next, so that they do not overlap
TICK_DISTANCE: Final = 0.15  # of the axis, between two rates that are written there


def page(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Return the page. Charts without data, or with too few to mean anything, are left out."""
    scene = sweep.scene
    return render(
        "sweep.html",
        list(_charts(sweep, rows)),
        [],
        dict.fromkeys(job.engine for job in sweep.jobs) | {sweep.against: None},
        units=scene.units,
        title=f"{scene.title or scene.name}: a sweep",
        scene=scene,
        summary=summary(sweep, rows),
        settings=_settings(sweep),
        table=list(summary_rows(sweep, rows)),
        command=_command(sweep) if equals_its_text(scene) else None,
        python=scene.model_dump_json(by_alias=True, exclude_defaults=True, indent=2),
    )


def convergence_page(convergence: Convergence) -> str:
    """Return the page of a convergence: what theory expects, the errors and orders, and a chart of them."""
    scene, rates, engines = convergence.scene, convergence.rates, list(convergence.errors)
    about = f"RMS distance from {REFERENCE} over balls and steps, in powers of ten."
    least = min(float(convergence.middle(engine).min()) for engine in engines)
    units = scene.units
    factor = units.factor(Dimension.LENGTH)
    scale = Logarithmic(10.0 ** np.floor(np.log10(factor * max(least, DOUBLE))), gap_scale(units).reach)
    errors = partial(lengths, units, figure="error")
    words = ["sandbox", "converge", scene_file(scene), "--engines", ",".join(engines)]
    words += ["--rates", ",".join(map(str, rates)), "--starts", str(convergence.starts)]
    words += ["--seed", str(scene.seed), "--seconds", seconds_text(scene.seconds), "--report", "converge.html"]
    return render(
        "sweep.html",
        [_by_rate("error", "Error", about, units.length, convergence.rows(), errors, scale=scale, over="starts")],
        [],
        dict.fromkeys([*engines, REFERENCE]),
        units=units,
        title=f"{scene.title or scene.name}: convergence",
        scene=scene,
        summary=" ".join(convergence.sentences()),
        settings=f"{counted(len(scene.bodies), 'ball')} for {scene.seconds:.4g} s, from "
        f"{counted(convergence.starts, 'start')} at each rate. The median over the starts; with the order, "
        "its standard error.",
        table=list(convergence.table()),
        command=shlex.join(words),
    )


def _settings(sweep: Sweep) -> str:
    seeds, rates = (sorted({job[field] for job in sweep.jobs}) for field in (0, 1))
    at = ", ".join(f"{rate:,}" for rate in rates)
    return (
        f"{counted(len(sweep.scene.bodies), 'ball')} for {seconds_text(sweep.scene.seconds)} s, with "
        f"{counted(len(seeds), 'seed')} and {at} steps per second, measured against {sweep.against}. "
        "The median over the seeds, and in brackets the range."
    )


def _command(sweep: Sweep) -> str | None:
    """Return the command that repeats the sweep; None if no command has such seeds."""
    jobs, scene = sweep.jobs, sweep.scene
    seeds = sorted({job.seed for job in jobs})
    if any(after != before + 1 for before, after in pairwise(seeds)):
        return None
    values: dict[str, dict[str, None]] = {}
    for job in jobs:
        for key, value in job.values((*OF_PYMUNK, *OF_CONTACTS)).items():
            values.setdefault(key, {})[str(value)] = None
    words = ["sandbox", "sweep", scene_file(scene), "--seeds", f"{seeds[0]}:{seeds[-1] + 1}"]
    words += ["--rates", ",".join(map(str, sorted({job.rate for job in jobs})))]
    words += ["--engines", ",".join(dict.fromkeys(job.engine for job in jobs))]
    for key, chosen in values.items():
        words += ["--set", f"{key}={','.join(chosen)}"]
    words += ["--against", sweep.against, "--seconds", seconds_text(scene.seconds)]
    return shlex.join([*words, "--out", "sweep.csv", "--report", "sweep.html"])


def _charts(sweep: Sweep, rows: Sequence[Row]) -> Iterator[Chart]:
    others = [row for row in rows if row["engine"] != sweep.against]
    if known(others, "gap_rms"):
        units, over = sweep.scene.units, f"RMS distance from {sweep.against} over the whole run, in powers of ten"
        scale = gap_scale(units)
        about = f"{over}; less than {scale.least:g} {units.length} is drawn there."
        gaps = partial(lengths, units, figure="gap_rms")
        yield _by_rate("gap", "Gap", about, units.length, others, gaps, scale=scale)
    if known(others, "first_difference.time"):
        about = f"When the first contact or flight is not as in {sweep.against}."
        yield _by_rate(
            "difference", "First difference", about, "s", others, partial(known, figure="first_difference.time")
        )
    if known(others, "energy_error"):
        scale = Logarithmic()

        def energy_errors(rows: Sequence[Row]) -> list[float]:
            return [100 * error for error in known(rows, "energy_error")]

        about = (
            f"The largest difference from the energy of {sweep.against} at one time, as a percentage of the scale of "
            f"energy, in powers of ten; less than {scale.least:g} % is drawn there."
        )
        yield _by_rate("energy", "Energy error", about, "%", others, energy_errors, scale=scale)


def _styles(rows: Sequence[Row]) -> dict[str, Style]:
    return styles_of(list(dict.fromkeys(map(engine_of, rows))))


def _by_rate(
    name: str,
    title: str,
    about: str,
    unit: str,
    rows: Sequence[Row],
    values_of: Callable[[Sequence[Row]], Sequence[float]],
    *,
    scale: Logarithmic | None = None,
    over: str = "seeds",
) -> Chart:
    """Draw each engine's median against the rate, with the range over the seeds. unit: of the values."""
    values = {group: np.array(data) for group, of_group in grouped(rows).items() if (data := values_of(of_group))}
    rates = sorted({group.rate for group in values})
    styles = {
        engine: style for engine, style in _styles(rows).items() if any(group.engine == engine for group in values)
    }
    ends = rates[0] / OFFSET**2, rates[-1] * OFFSET ** (len(styles) + 1)
    plot = figure(
        height=HEIGHT,
        x_axis_type="log",
        x_range=Range1d(start=ends[0], end=ends[1]),
        x_axis_label="steps per second",
        y_axis_label=unit,
        tools="",
        toolbar_location=None,
    )
    plot.xaxis.ticker = FixedTicker(ticks=_spaced(rates, ends))
    plot.axis.formatter = NumeralTickFormatter(format="0,0.[00000]")
    if scale:
        scale_axis(plot, scale, values.values())
        values = {group: scale.position(data) for group, data in values.items()}
    else:
        plot.y_range = Range1d(start=0, end=1.08 * max(float(data.max()) for data in values.values()) or 1.0)
    for index, (engine, style) in enumerate(styles.items()):
        _draw(plot, {group: data for group, data in values.items() if group.engine == engine}, style, OFFSET**index)
    what = f"{about} Median and range over the {over}."
    return Chart(name, title, what, f"{title} by rate, as in the table above.", legend_of(styles), plot)


def _draw(plot: figure, values: dict[Group, Floats], style: Style, offset: float) -> None:
    """Draw one engine: its medians with a line, and a whisker at each."""
    at = [group.rate * offset for group in values]
    middle = [median(data.tolist()) for data in values.values()]
    ends = {
        "at": at,
        "low": [data.min() for data in values.values()],
        "high": [data.max() for data in values.values()],
    }
    heads = [TeeHead(line_color=style.color, size=10) for _ in range(2)]
    plot.add_layout(
        Whisker(
            source=ColumnDataSource(ends),
            base="at",
            lower="low",
            upper="high",
            line_color=style.color,
            lower_head=heads[0],
            upper_head=heads[1],
        )
    )
    plot.line(at, middle, line_color=style.color, line_width=2.5)
    plot.scatter(at, middle, marker=style.marker, size=10, line_color=style.color, line_width=2, fill_color=GROUND)


def _spaced(rates: Sequence[int], ends: tuple[float, float]) -> list[int]:
    """Return the rates whose numbers do not overlap on an axis of powers, the first and as many others as fit."""
    low, high = np.log(ends)
    shown: list[int] = []
    for rate in rates:
        if not shown or np.log(rate / shown[-1]) >= TICK_DISTANCE * (high - low):
            shown.append(rate)
    return shown
