"""The pages on a telephone and on paper, in a real browser."""

from base64 import b64decode
from itertools import combinations
from pathlib import Path

import pytest
from browser import Browser
from conftest import sample

from sandbox.analysis.comparison import compare
from sandbox.report.comparison_page import page
from sandbox.scene.files import load

TELEPHONE = 390  # px
PAPER = 718  # px, of A4 between margins of 1 cm

# Where each chart writes a text: the chart, the text, and its left, top, right and bottom.
RECORD_TEXTS = """
globalThis.written = new Map();
const fillText = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...rest) {
  const measured = this.measureText(text);
  const ends = [[-measured.actualBoundingBoxLeft, -measured.actualBoundingBoxAscent],
                [measured.actualBoundingBoxRight, measured.actualBoundingBoxDescent]];
  const [a, b] = ends.map(([dx, dy]) => this.getTransform().transformPoint({ x: x + dx, y: y + dy }));
  const box = [Math.min(a.x, b.x), Math.min(a.y, b.y), Math.max(a.x, b.x), Math.max(a.y, b.y)];
  if (!written.has(this.canvas)) written.set(this.canvas, new Map());
  written.get(this.canvas).set(text + box.map(Math.round), [text, ...box]);
  fillText.call(this, text, x, y, ...rest);
};
"""
TEXTS = """[...written].filter(([canvas]) => !canvas.closest("#panes"))
  .map(([canvas, texts]) => [canvas.width, canvas.height, [...texts.values()]])"""
# What reaches beyond the page, or beyond an element that hides it.
CLIPPED = """[...document.querySelectorAll("body *")].filter((element) => {
  const box = element.getBoundingClientRect();
  const hides = getComputedStyle(element).overflowX !== "visible" && element.scrollWidth > element.clientWidth + 1;
  return box.width && (box.right > document.documentElement.clientWidth + 1 || box.left < -1 || hides);
}).map((element) => element.outerHTML.slice(0, 80))"""
CONTRASTS = """(() => {
  const shine = (channel) => (channel /= 255) <= 0.03928 ? channel / 12.92 : ((channel + 0.055) / 1.055) ** 2.4;
  const numbers = (color) => color.match(/[\\d.]+/g).map(Number);
  const luminance = ([r, g, b]) => 0.2126 * shine(r) + 0.7152 * shine(g) + 0.0722 * shine(b);
  const ground = (element) => {
    const color = numbers(getComputedStyle(element).backgroundColor);
    return color[3] === 0 ? (element.parentElement ? ground(element.parentElement) : [255, 255, 255]) : color;
  };
  const writes = (node) => [...node.childNodes].some((child) => child.nodeType === 3 && child.data.trim());
  return [...document.querySelectorAll("body *:not(script, option)")].filter(writes).map((element) => {
    const both = [luminance(numbers(getComputedStyle(element).color)), luminance(ground(element))];
    return [(Math.max(...both) + 0.05) / (Math.min(...both) + 0.05), element.outerHTML.slice(0, 80)];
  });
})()"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("pages")
    mine = folder / "programs_of_a_tutorial_on_bouncing_balls.py"
    mine.write_text("def step(position, velocity, dt, scene):\n    return position + dt * velocity, velocity\n")
    names = ["pymunk", "pymunk(substeps=4)", "impulse", "exact", f"{mine}:step"]
    file = folder / "page.html"
    file.write_text(page(compare(load("bouncing").changed(seconds=3.0), names)), encoding="utf-8")
    return file


@pytest.mark.parametrize("width", sample([TELEPHONE, 1280, 1920], 3))
def test_nothing_is_clipped(browser: Browser, file: Path, width: int) -> None:
    browser.visit(file, width)
    assert browser.errors == []
    for ratio, element in browser.run(CONTRASTS):
        assert ratio >= (3 if element.startswith("<b ") else 4.5), element  # a symbol, or text
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.run(CLIPPED) == []


@pytest.mark.wide
@pytest.mark.parametrize("width", [TELEPHONE, 1280])
def test_no_labels_of_a_chart_overlap_or_are_cut(browser: Browser, file: Path, width: int) -> None:
    script = browser.call("Page.addScriptToEvaluateOnNewDocument", source=RECORD_TEXTS)["identifier"]
    browser.visit(file, width)
    canvases = browser.run(TEXTS)
    browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
    assert len(canvases) == 2
    for across, down, texts in canvases:
        for text, left, top, right, bottom in texts:
            assert left >= -1, text
            assert top >= -1, text
            assert right <= across + 1, text
            assert bottom <= down + 1, text
        for one, other in combinations(texts, 2):
            assert not overlap(one[1:], other[1:]), (one, other)


def overlap(one: list[float], other: list[float]) -> bool:
    """Return whether two boxes (left, top, right, bottom) overlap by more than a px."""
    return all(min(one[k + 2], other[k + 2]) - max(one[k], other[k]) > 1 for k in range(2))


@pytest.mark.wide
def test_on_paper_nothing_is_cut_and_each_chart_is_a_picture(browser: Browser, file: Path) -> None:
    browser.visit(file, PAPER)
    number = browser.run("Object.keys(JSON.parse(document.querySelector('#document').textContent).roots).length")
    browser.run("dispatchEvent(new Event('beforeprint'))")
    browser.show_on("print")
    browser.wait_for("[...document.querySelectorAll('.chart img')].every((picture) => picture.complete)")
    assert browser.run(CLIPPED) == []
    assert browser.run("document.querySelectorAll('.chart img').length") == number
    assert browser.run("[...document.querySelectorAll('.chart img')].every((one) => one.naturalWidth > 300)")
    assert browser.run("[...document.querySelectorAll('details')].every((details) => details.open)")
    browser.run("dispatchEvent(new Event('afterprint'))")
    browser.show_on("screen")
    assert browser.run("document.querySelectorAll('.chart img').length") == 0


@pytest.mark.wide
def test_the_pdf_has_every_chart(browser: Browser, file: Path) -> None:
    browser.visit(file)
    charts = browser.run("document.querySelectorAll('.chart').length")
    panes = browser.run("document.querySelectorAll('#panes canvas').length")
    pdf = b64decode(browser.call("Page.printToPDF")["data"])
    assert pdf.count(b"/Subtype /Image") >= charts + panes
