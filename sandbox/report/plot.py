"""Plots as files: energy and gap of each engine over time, or its error over the rates."""

import io
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.series import energies, thinned
from sandbox.errors import MissingLibrary, SandboxError
from sandbox.files import whole_file
from sandbox.report.colours import colours_of
from sandbox.report.scales import gap_scale
from sandbox.scene.units import Dimension
from sandbox.state import Floats
from sandbox.sweeps.convergence import Convergence, order_text
from sandbox.text import xml_text

if TYPE_CHECKING:  # it takes half a second to import
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ENDINGS: Final = (".png", ".svg")
WIDTH: Final = 9.0  # inches, of the plot
HEIGHT: Final = 3.0  # inches, of each chart
RESOLUTION: Final = 200  # dots per inch of a PNG
LINE_WIDTH: Final = 1.5  # points
REFERENCE_WIDTH: Final = 3.0  # points; wider, so that lines equal to it do not hide it
# Text stays text, and the same comparison gives the same bytes.
STYLE: Final[dict[Any, Any]] = {"svg.fonttype": "none", "svg.hashsalt": "sandbox", "text.parse_math": False}


def check_plot(path: str) -> None:
    """Raise SandboxError if no plot can have the path's ending, or matplotlib is not installed."""
    if Path(path).suffix not in ENDINGS:
        raise SandboxError(f"{path}: a plot must end in {' or '.join(ENDINGS)}")
    if find_spec("matplotlib") is None:
        raise MissingLibrary("--plot", "matplotlib")


def save_plot(comparison: Comparison, path: str) -> None:
    """Write the plot of a comparison as PNG or SVG, by the path's ending.

    Raises SandboxError as `check_plot` does, or if the file cannot be written.
    """
    _save(partial(figure_of, comparison), path)


def save_convergence(convergence: Convergence, path: str) -> None:
    """Write the errors over the rates as PNG or SVG, as `save_plot` does."""
    _save(partial(figure_of_convergence, convergence), path)


def _save(draw: Callable[[], "Figure"], path: str) -> None:
    check_plot(path)
    from matplotlib import rc_context  # noqa: PLC0415

    kind, content = Path(path).suffix.removeprefix("."), io.BytesIO()
    with rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        figure = draw()
        metadata = {"Date": None} if kind == "svg" else None
        figure.savefig(content, format=kind, dpi=RESOLUTION, metadata=metadata)
    with whole_file(path) as file:
        file.write(content.getvalue())


def figure_of(comparison: Comparison) -> "Figure":
    """Return the charts of a comparison: energy and, if there is more than the reference, the largest gap to it."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    lines, unit = energies(comparison)
    scene = comparison.scene
    factor, scale = scene.units.factor(Dimension.LENGTH), gap_scale(scene.units)
    gaps = {name: factor * run.gap_max for name, run in comparison.runs.items() if name != comparison.against}
    figure = Figure(figsize=(WIDTH, HEIGHT * (1 + bool(gaps))), layout="constrained")
    figure.suptitle(xml_text(f"{scene.title or scene.name}, seed {scene.seed}, {scene.rate} steps per second"))
    energy, *others = np.ravel(figure.subplots(1 + bool(gaps), sharex=True, squeeze=False)).tolist()
    _draw(energy, comparison, lines)
    energy.set_title(f"Energy, {'%, 100 at the start' if unit == '%' else unit}", loc="left")
    energy.set_ylim(bottom=min(0.0, energy.get_ylim()[0]))
    for gap in others:
        _draw(gap, comparison, {name: np.where(line < scale.least, np.nan, line) for name, line in gaps.items()})
        gap.set_title(f"Largest gap to {comparison.against}, {scene.units.length}", loc="left")
        gap.set_yscale("log")
        gap.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        gap.minorticks_off()
        gap.set_ylim(scale.least, max(scale.reach, *(2 * line.max() for line in gaps.values())))
    figure.axes[-1].set_xlabel("time, s")
    return figure


def figure_of_convergence(convergence: Convergence) -> "Figure":
    """Return the chart of a convergence: median and range over the starts, and the slope that theory expects."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(WIDTH, 1.5 * HEIGHT), layout="constrained")
    scene, rates, axes = convergence.scene, np.array(convergence.rates), figure.subplots()
    factor = scene.units.factor(Dimension.LENGTH)
    figure.suptitle(xml_text(f"{scene.title or scene.name}, seed {scene.seed}, {scene.seconds:.4g} s"))
    for name, colour in colours_of(convergence.errors).items():
        errors, middle = factor * convergence.errors[name], factor * convergence.middle(name)
        law = convergence.laws[name]
        ends = np.stack([middle - errors.min(axis=1), errors.max(axis=1) - middle])
        by_theory = "" if law.order is None else f"\n(theory, dotted: {law.order})"
        label = f"{name}:\norder {order_text(convergence.fit(name))}{by_theory}"
        axes.errorbar(rates, middle, ends, color=colour, linewidth=LINE_WIDTH, capsize=3, marker="o", label=label)
        if law.order is not None:
            axes.plot(rates, middle[-1] * (rates[-1] / rates) ** law.order, color=colour, linestyle=":")
    axes.set_title(f"RMS error, {scene.units.length}", loc="left")
    axes.set_xlabel("steps per second")
    axes.loglog()
    axes.minorticks_off()
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_xticks(rates, [f"{rate:,}" for rate in rates.tolist()])
    axes.grid(visible=True, color="#dddddd")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def _draw(axes: "Axes", comparison: Comparison, lines: Mapping[str, Floats]) -> None:
    """Draw a line for each engine, the reference below the others, and the end of its trust."""
    colours = colours_of(comparison.runs)
    for name in sorted(lines, key=lambda name: name != comparison.against):
        line, kept = lines[name], thinned(np.nan_to_num(lines[name]))
        width = REFERENCE_WIDTH if name == comparison.against else LINE_WIDTH
        label = f"{name} (< {gap_scale(comparison.scene.units).least:g})" if np.isnan(line).all() else name
        axes.plot(comparison.time[kept], line[kept], color=colours[name], linewidth=width, label=label)
    if comparison.trusted_until is not None:
        axes.axvline(comparison.trusted_until, color="black", linewidth=0.8)
        axes.annotate(
            comparison.trust.ends_by, (comparison.trusted_until, 1), xycoords=("data", "axes fraction"), ha="center"
        )
    axes.margins(x=0)
    axes.grid(visible=True, color="#dddddd")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
