"""The pages on a telephone, on paper and in the dark, and their table of before and after, in a real browser."""

from base64 import b64decode
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import pytest
from browser import Browser
from conftest import sample

from sandbox.analysis.comparison import compare
from sandbox.report.comparison import page
from sandbox.report.sweep import page as sweep_page
from sandbox.scene.files import load, parse
from sandbox.sweeps import plan
from sandbox.sweeps.jobs import run_job

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


@pytest.fixture(scope="module", params=["comparison", "sweep"])
def file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    if request.param == "comparison":
        mine = tmp_path_factory.mktemp("engines") / "programs_of_a_tutorial_on_bouncing_balls.py"
        mine.write_text("def step(position, velocity, dt, scene):\n    return position + dt * velocity, velocity\n")
        names = ["pymunk", "pymunk(substeps=4)", "impulse", "exact", f"{mine}:step"]
        text = page(compare(load("bouncing").changed(seconds=3.0), names))
    else:
        sweep = plan(
            load("article").changed(seconds=1.0), range(2), [60, 240], ["pymunk", "article"], {"substeps": [1, 4]}
        )
        text = sweep_page(sweep, [run_job(sweep.scene, sweep.against, job) for job in sweep.jobs])
    file: Path = tmp_path_factory.mktemp("pages") / f"{request.param}.html"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.fixture
def reader(browser: Browser) -> Iterator[Browser]:
    """Yield a browser that goes back to light pages on a screen."""
    yield browser
    browser.prefer("light")


@pytest.mark.parametrize("width", sample([TELEPHONE, 1280, 1920], 3))
def test_nothing_is_clipped(reader: Browser, file: Path, width: int) -> None:
    reader.visit(file, width)
    assert reader.errors == []
    assert reader.run("document.documentElement.scrollWidth") <= width
    assert reader.run(CLIPPED) == []


@pytest.mark.wide
@pytest.mark.parametrize("width", [TELEPHONE, 1280])
def test_no_labels_of_a_chart_overlap_or_are_cut(browser: Browser, file: Path, width: int) -> None:
    script = browser.call("Page.addScriptToEvaluateOnNewDocument", source=RECORD_TEXTS)["identifier"]
    browser.visit(file, width)
    canvases = browser.run(TEXTS)
    browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
    assert len(canvases) >= 3
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


def test_a_dark_preference_is_followed_and_all_text_stays_legible(reader: Browser, file: Path) -> None:
    ground = "getComputedStyle(document.body).backgroundColor"
    axis = "Bokeh.documents[0].roots()[0].below[0].axis_label_text_color"
    reader.visit(file)
    light = reader.run(f"[{ground}, {axis}]")
    reader.prefer("dark")
    reader.wait_for(f"globalThis.Bokeh.documents[0]?.is_idle && {axis} === '#e8eaed'")
    assert light == ["rgb(255, 255, 255)", "#222222"]
    assert reader.run(ground) == "rgb(11, 14, 17)"
    for scheme in ("dark", "light"):
        reader.prefer(scheme)
        for ratio, element in reader.run(CONTRASTS):
            assert ratio >= (3 if element.startswith("<b ") else 4.5), (scheme, element)  # a symbol, or text
    assert reader.errors == []


@pytest.mark.wide
def test_on_paper_nothing_is_cut_and_each_chart_is_a_picture(reader: Browser, file: Path) -> None:
    reader.visit(file, PAPER)
    number = reader.run("Object.keys(JSON.parse(document.querySelector('#document').textContent).roots).length")
    reader.run("dispatchEvent(new Event('beforeprint'))")
    reader.prefer("light", "print")
    reader.wait_for("[...document.querySelectorAll('.chart img')].every((picture) => picture.complete)")
    assert reader.run(CLIPPED) == []
    assert reader.run("document.querySelectorAll('.chart img').length") == number
    assert reader.run("[...document.querySelectorAll('.chart img')].every((one) => one.naturalWidth > 300)")
    assert reader.run("[...document.querySelectorAll('details')].every((details) => details.open)")
    reader.run("dispatchEvent(new Event('afterprint'))")
    reader.prefer("light")
    assert reader.run("document.querySelectorAll('.chart img').length") == 0


@pytest.mark.wide
def test_the_pdf_has_every_chart(reader: Browser, file: Path) -> None:
    reader.visit(file)
    charts = reader.run("document.querySelectorAll('.chart').length")
    panes = reader.run("document.querySelectorAll('#panes canvas').length")
    pdf = b64decode(reader.call("Page.printToPDF")["data"])
    assert pdf.count(b"/Subtype /Image") >= charts + panes


HEAD_ON = """seconds = 1
[arena]
size = [800, 200]
[[balls]]
radius = 10
mass = 3
position = [100, 100]
velocity = [100, 0]
[[balls]]
radius = 20
mass = 1
position = [230, 100]
velocity = [-100, 0]
"""


def tables(browser: Browser, engine: str) -> dict[str, dict[str, list[float]]]:
    """Return the table of before and after: its values by caption and label."""
    script = f"""[...document.querySelectorAll('[data-impacts="{engine}"] table')].map((table) => [
      table.caption.textContent,
      [...table.tBodies[0].rows].map((row) => [...row.cells].map((cell) => cell.textContent))])"""
    return {caption: {label: [*map(plain, values)] for label, *values in rows} for caption, rows in browser.run(script)}


def plain(number: str) -> float:
    return float(number.replace(",", "").replace("\N{MINUS SIGN}", "-"))


def test_before_and_after_of_a_head_on_hit_are_those_of_the_closed_form(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "head-on.html"
    file.write_text(page(compare(parse(HEAD_ON, "head-on"), ["pymunk", "exact"])), encoding="utf-8")
    browser.visit(file)
    # v1' = ((m1 - m2) v1 + 2 m2 v2) / (m1 + m2), v2' = ((m2 - m1) v2 + 2 m1 v1) / (m1 + m2)
    after = ((3 - 1) * 100 + 2 * 1 * -100) / 4, ((1 - 3) * -100 + 2 * 3 * 100) / 4
    assert after == (0, 200)
    for engine in ("pymunk", "exact"):
        found = tables(browser, engine)
        assert found["Ball 0"]["mass kg"] == [3, 3]
        assert found["Ball 0"]["velocity x px/s"] == [100, 0]
        assert found["Ball 0"]["momentum x kg px/s"] == [300, 0]
        assert found["Ball 0"]["energy kg px²/s²"] == [15_000, 0]
        assert found["Ball 1"]["velocity x px/s"] == [-100, 200]
        assert found["Ball 1"]["speed px/s"] == [100, 200]
        assert found["Ball 1"]["energy kg px²/s²"] == [5_000, 20_000]
        assert found["Ball 1"]["spin rad/s"] == [0, 0]
        assert found["Sum of both"] == {
            "momentum x kg px/s": [200, 200],
            "momentum y kg px/s": [0, 0],
            "energy kg px²/s²": [20_000, 20_000],
        }


@pytest.mark.wide
def test_choosing_a_contact_shows_that_of_the_same_bodies_in_the_other_engines(
    browser: Browser, tmp_path: Path
) -> None:
    comparison = compare(load("article"), ["pymunk", "exact"])
    file = tmp_path / "article.html"
    file.write_text(page(comparison), encoding="utf-8")
    browser.visit(file)
    contacts = {name: run.contacts for name, run in comparison.runs.items()}
    number = int((contacts["pymunk"]["second"] < 0).nonzero()[0][4])
    chosen = contacts["pymunk"][number]
    browser.run(
        "(() => { const it = document.querySelector('[data-impacts=pymunk] select');"
        f"it.value = {number}; it.dispatchEvent(new Event('change')) }})()"
    )
    same = [
        (abs(one["time"] - chosen["time"]), index)
        for index, one in enumerate(contacts["exact"])
        if (one["first"], one["second"]) == (chosen["first"], chosen["second"])
    ]
    shown = browser.run("document.querySelector('[data-impacts=exact] select').value")
    assert shown == (str(min(same)[1]) if same else "")
    assert [*tables(browser, "pymunk")] == [f"Ball {chosen['first']}"]
