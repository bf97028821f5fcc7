"""Plots of a comparison: what they show of it, as SVG and as PNG."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from sandbox.analysis.comparison import Comparison, compare
from sandbox.errors import SandboxError
from sandbox.report import plot
from sandbox.scene.files import load

if TYPE_CHECKING:
    from matplotlib.axes import Axes

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def head_on() -> Comparison:
    """Return a comparison in which the article's rule keeps half of the energy from 1.3 s on."""
    return compare(load("head-on"), ["article", "exact"])


def lines_of(axes: "Axes") -> dict[str, tuple[list[float], list[float]]]:
    return {
        str(line.get_label()): (np.asarray(line.get_xdata()).tolist(), np.asarray(line.get_ydata()).tolist())
        for line in axes.get_lines()
        if not str(line.get_label()).startswith("_")
    }


def texts_of(path: Path) -> list[str]:
    return ["".join(text.itertext()) for text in ElementTree.parse(path).iter("{http://www.w3.org/2000/svg}text")]


def test_lines_are_the_energies_and_the_gaps(head_on: Comparison) -> None:
    energy, gap = plot.figure_of(head_on).axes
    lines = lines_of(energy)
    assert list(lines) == ["exact", "article"]  # the reference is drawn first, below the other
    assert set(lines["exact"][1]) == {100.0}
    assert lines["article"][1][-1] == pytest.approx(50, abs=0.2)
    [(time, article)] = lines_of(gap).values()
    assert (time[-1], article[-1]) == (3.0, head_on.runs["article"].gap_max[-1])
    assert gap.get_yscale() == "log"


def test_the_end_of_the_reference_s_trust_is_marked_and_named(head_on: Comparison, tmp_path: Path) -> None:
    marked = replace(head_on, trust=head_on.trust._replace(horizon=1.5))
    assert [[line.get_xdata() for line in axes.get_lines()][-1] for axes in plot.figure_of(marked).axes] == [
        [1.5] * 2
    ] * 2
    plot.save_plot(marked, str(tmp_path / "f.svg"))
    assert "horizon" in texts_of(tmp_path / "f.svg")


def test_an_engine_without_any_gap_is_named_with_0(head_on: Comparison) -> None:
    run = head_on.runs["article"]
    same = replace(head_on, runs=head_on.runs | {"article": replace(run, gap_max=0 * run.gap_max)})
    assert list(lines_of(plot.figure_of(same).axes[1])) == ["article (< 0.001)"]


def test_an_engine_alone_has_no_chart_of_gaps() -> None:
    assert len(plot.figure_of(compare(load("head-on").changed(seconds=0.1), ["exact"])).axes) == 1


def test_a_title_is_text_whatever_it_says(head_on: Comparison, tmp_path: Path) -> None:
    title = "<script>alert(1)</script> & $x_$ \uffff"
    plot.save_plot(replace(head_on, scene=head_on.scene.changed(title=title)), str(tmp_path / "f.svg"))
    replaced = title.replace("\uffff", "\N{REPLACEMENT CHARACTER}")
    texts = texts_of(tmp_path / "f.svg")
    assert any(text.startswith(replaced) for text in texts)
    assert {"0.001", "1", "100"} <= {*texts}  # of the axes, as numbers too


@pytest.mark.wide
def test_the_same_comparison_is_the_same_file(head_on: Comparison, tmp_path: Path) -> None:
    for ending in plot.ENDINGS:
        for name in ("a", "b"):
            plot.save_plot(head_on, str(tmp_path / f"{name}{ending}"))
        assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()
    with Image.open(tmp_path / "a.png") as picture:
        width, height = picture.size
    assert width > height > 1000


def test_without_matplotlib_one_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plot, "find_spec", lambda _: None)
    with pytest.raises(
        SandboxError, match=r"^--plot: needs matplotlib, which is not installed; pip install matplotlib$"
    ):
        plot.check_plot("f.png")
