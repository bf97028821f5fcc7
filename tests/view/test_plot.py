"""Plots of a comparison: what is drawn where, in SVG, and the same in PNG."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pygame
import pytest

from sandbox.analysis.comparison import Comparison, compare
from sandbox.scene.files import load
from sandbox.view.canvas import PNG_SCALE
from sandbox.view.palette import palette
from sandbox.view.plot import CHART, LINE_WIDTH, save_plot

SVG = "{http://www.w3.org/2000/svg}"
COLOURS = palette("white").engines(["article", "exact"])
ARTICLE, EXACT = COLOURS["article"], COLOURS["exact"]


@pytest.fixture(scope="module")
def head_on() -> Comparison:
    """Return a comparison in which the article's rule keeps half of the energy from 1.3 s on."""
    return compare(load("head-on"), ["article", "exact"])


def drawn(comparison: Comparison, path: Path) -> ElementTree.Element:
    save_plot(comparison, str(path / "f.svg"))
    return ElementTree.parse(path / "f.svg").getroot()


def lines_of(root: ElementTree.Element, colour: pygame.Color) -> list[list[tuple[float, float]]]:
    stroke = f"#{colour.r:02x}{colour.g:02x}{colour.b:02x}"
    return [
        [(float(point.split(",")[0]), float(point.split(",")[1])) for point in line.get("points", "").split()]
        for line in root.iter(f"{SVG}polyline")
        if line.get("stroke") == stroke and float(line.get("stroke-width", "")) >= LINE_WIDTH
    ]


def texts_of(root: ElementTree.Element) -> dict[str, tuple[float, float]]:
    return {text.text or "": (float(text.get("x", "")), float(text.get("y", ""))) for text in root.iter(f"{SVG}text")}


def test_lines_are_at_the_values_and_names_at_their_ends(head_on: Comparison, tmp_path: Path) -> None:
    root = drawn(head_on, tmp_path)
    texts = texts_of(root)
    assert {"Energy, %, 100 at the start", "Largest gap to exact, px", "time, s", "0", "100"} <= set(texts)
    energy, gap = lines_of(root, ARTICLE)
    [full] = lines_of(root, EXACT)  # the reference has no gap to itself
    whole = min(float(text.get("y", "")) for text in root.iter(f"{SVG}text") if text.text == "100")  # px has one too
    assert {y for _, y in full} == {whole}
    assert energy[0][1] == whole
    assert energy[-1][1] == pytest.approx((texts["40"][1] + texts["60"][1]) / 2, abs=0.11)
    assert energy[-1][0] - energy[0][0] == CHART[0]
    assert [text for text, (x, y) in texts.items() if x > energy[-1][0] and abs(y - full[-1][1]) < 1] == ["exact"]
    assert texts["article"][1] == pytest.approx(gap[-1][1], abs=0.11)  # the last of that name is the gap's


def test_the_end_of_the_reference_s_trust_is_marked_and_named(head_on: Comparison, tmp_path: Path) -> None:
    assert "horizon" not in texts_of(drawn(head_on, tmp_path))
    marked = replace(head_on, trust=head_on.trust._replace(horizon=1.5))
    root = drawn(marked, tmp_path)
    x, _ = texts_of(root)["horizon"]
    left, right = (lines_of(root, EXACT)[0][end][0] for end in (0, -1))
    assert x == pytest.approx((left + right) / 2)  # 1.5 of 3 s


def test_equal_lines_have_names_below_each_other(tmp_path: Path) -> None:
    comparison = compare(load("head-on").changed(seconds=1), ["pymunk", "impulse", "exact"])
    root = drawn(comparison, tmp_path)
    heights = sorted(float(text.get("y", "")) for text in root.iter(f"{SVG}text") if text.text in comparison.runs)[:3]
    assert all(later - sooner >= 14 for sooner, later in pairwise(heights))


def test_an_engine_without_any_gap_is_named_with_0(head_on: Comparison, tmp_path: Path) -> None:
    run = head_on.runs["article"]
    same = replace(head_on, runs=head_on.runs | {"article": replace(run, gap_max=0 * run.gap_max)})
    root = drawn(same, tmp_path)
    assert "article (< 0.001)" in texts_of(root)
    assert len(lines_of(root, ARTICLE)) == 1


def test_an_engine_alone_has_no_chart_of_gaps(tmp_path: Path) -> None:
    root = drawn(compare(load("head-on").changed(seconds=0.1), ["exact"]), tmp_path)
    assert [text for text in texts_of(root) if "gap" in text] == []


def test_a_title_is_text_whatever_it_says(head_on: Comparison, tmp_path: Path) -> None:
    title = "<script>alert(1)</script> & \uffff"
    root = drawn(replace(head_on, scene=head_on.scene.changed(title=title)), tmp_path)
    assert [element.tag for element in root.iter() if "script" in element.tag] == []
    assert any(text.startswith("<script>alert(1)</script> & \N{REPLACEMENT CHARACTER}") for text in texts_of(root))


def test_the_png_has_the_lines_of_the_svg(head_on: Comparison, tmp_path: Path) -> None:
    root = drawn(head_on, tmp_path)
    save_plot(head_on, str(tmp_path / "f.png"))
    picture = pygame.image.load(tmp_path / "f.png")
    assert picture.get_size() == tuple(PNG_SCALE * int(root.get(side, "")) for side in ("width", "height"))
    [full] = lines_of(root, EXACT)
    for x, y in full[20:-20:30]:
        colours = {tuple(picture.get_at((round(PNG_SCALE * x), round(PNG_SCALE * y) + k))) for k in range(-4, 5)}
        assert tuple(EXACT) in colours  # it is dashed
