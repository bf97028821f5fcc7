"""The page of a comparison: its bytes, and its behaviour in a real browser."""

import base64
import html
import json
import re
import shlex
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Browser
from conftest import Command
from hostile import PAGE_TEXTS, hostile_scene
from hypothesis import given
from hypothesis import strategies as st

from sandbox.analysis.comparison import Comparison, compare
from sandbox.report.charts import charts, thinned
from sandbox.report.comparison_page import MAX_PATHS_BYTES, fixed_point, page, thinning
from sandbox.report.scales import gap_scale
from sandbox.run.inputs import Grab, Input, Release
from sandbox.scene.fields import rgb
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene

ENGINES = ["pymunk", "article", "impulse", "exact"]


class Reader(HTMLParser):
    """Collects a page's elements, and the text of some."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._inside = tag
        self.texts.append((tag, ""))

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside:
            tag, text = self.texts.pop()
            self.texts.append((tag, text + data))

    def all(self, tag: str) -> list[str]:
        return [text for name, text in self.texts if name == tag]


@pytest.fixture(scope="module")
def article() -> Comparison:
    return compare(load("article"), ENGINES)


@pytest.fixture(scope="module")
def text(article: Comparison) -> str:
    return page(article)


@pytest.fixture(scope="module")
def harmless() -> Reader:
    return Reader(page(compare(hostile_scene("A scene", "A scene"), ["pymunk", "exact"])))


def data_of(text: str) -> dict[str, object]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text)
    assert found
    data: dict[str, object] = json.loads(found[1])
    return data


# Its bytes


def test_the_page_is_self_contained(text: str) -> None:
    read = Reader(text)
    for tag, attributes in read.elements:
        assert tag not in ("img", "iframe", "object", "embed", "base", "form")
        assert "src" not in attributes
        assert (attributes.get("href") or "data:,") == "data:,"
    assert "url(" not in "".join(read.all("style"))
    policies = [attributes["content"] for _, attributes in read.elements if "http-equiv" in attributes]
    assert len(policies) == 1
    assert re.fullmatch(
        r"default-src 'none'; script-src( 'sha256-[\w+/=]+'){3}; style-src 'unsafe-inline'; img-src data:",
        str(policies[0]),
    )


@pytest.mark.parametrize("words", PAGE_TEXTS)
def test_text_of_a_scene_stays_text(words: str, harmless: Reader) -> None:
    comparison = compare(hostile_scene(words, words), ["pymunk", "exact"])
    read = Reader(page(comparison))
    assert [(tag, set(attributes)) for tag, attributes in read.elements] == [
        (tag, set(attributes)) for tag, attributes in harmless.elements
    ]
    assert read.all("title") == read.all("h1") == [words]
    assert read.all("pre")[-1] == comparison.scene.source
    assert read.all("script")[-4:] == harmless.all("script")[-4:]


@pytest.mark.slow
def test_a_hundred_balls_for_twenty_seconds_are_less_than_6_mb_and_every_step_is_shown() -> None:
    comparison = compare(load("gas-100"), ENGINES)
    text = page(comparison)
    assert len(text.encode()) < 6_000_000
    assert thinning(comparison, MAX_PATHS_BYTES) == 1
    assert "Every step is shown: 1,201 of 1,201 states" in text


def test_a_long_run_is_thinned_and_the_page_says_so(article: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.report.comparison_page.MAX_PATHS_BYTES", 20_000)
    text = page(article)
    every = thinning(article, 20_000)
    assert every > 1
    shown = article.stride * every
    assert f"1 step in {shown} is shown: {1200 // shown + 1} of 1,201 states" in text
    data = data_of(text)
    assert data["frame"] == shown / 60
    engines = data["engines"]
    assert isinstance(engines, list)
    assert sum(len(engine["path"]) for engine in engines) < 20_000
    unit, margin = fixed_point(article.scene)
    for engine, run in zip(engines, article.runs.values(), strict=True):
        packed = np.frombuffer(base64.b64decode(engine["path"]), "<u2").reshape(-1, 3, 2)
        assert packed * unit - margin == pytest.approx(run.path[::every], abs=0.51 * unit)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=300), st.integers(8, 40))
def test_a_thinned_line_keeps_its_ends_and_extremes(values: list[float], most: int) -> None:
    series = np.array(values)
    kept = thinned(series, most)
    assert kept[0] == 0
    assert kept[-1] == len(series) - 1
    assert (np.diff(kept) > 0).all()
    assert series[kept].min() == series.min()
    assert series[kept].max() == series.max()
    assert len(kept) <= most + 4


def test_a_first_difference_is_marked_where_the_gap_begins(article: Comparison) -> None:
    scale = gap_scale(article.scene.units)
    begins = [scale.position(run.gap_max[run.gap_max > 1e-9][:1]) for run in article.others.values()]
    drawn: list[Any] = charts(article)[0].figure.renderers
    assert [mark.data_source.data["y"] for mark in drawn if getattr(mark.glyph, "size", 0) == 22] == begins


def test_the_same_comparison_gives_the_same_bytes(text: str) -> None:
    assert page(compare(load("article"), ENGINES)) == text


def test_the_command_on_the_page_reproduces_the_comparison(command: Command, working_folder: Path) -> None:
    inputs: list[Input] = [Grab(step=30, ball=0, at=(100, 100)), Release(step=60)]
    comparison = compare(load("article").changed(seed=5, seconds=2.0), ["pymunk", "impulse"], inputs=inputs)
    line, mouse, source = (html.unescape(text) for text in Reader(page(comparison)).all("pre"))
    (working_folder / "article.toml").write_text(source)
    (working_folder / "inputs.jsonl").write_text(mouse)
    _, out, _ = command(*shlex.split(line)[1:], "--json", "-")
    assert json.loads(out) == json.loads(json.dumps(comparison.as_json()))


def test_a_scene_changed_in_python_is_on_the_page_as_json() -> None:
    scene = load("article").changed(gravity=(0, 100), seconds=1.0)
    text = Reader(page(compare(scene, ["impulse"]))).all("pre")[-1]
    assert Scene.model_validate_json(text).model_dump() == scene.model_dump()


def test_one_engine_balls_at_rest_and_a_gas_have_a_page_too() -> None:
    rest = parse("seconds = 0.1\n[arena]\nsize = [90, 90]\n[[balls]]\nradius = 9\nposition = [45, 45]", "rest.toml")
    text = page(compare(rest, ["pymunk"]))
    assert data_of(text)["energy"] == "kg px²/s²"
    assert "Over time" not in text
    assert "Enskog" in page(compare(load("gas-100").changed(seconds=0.5), ["impulse"]))


def test_a_report_that_is_no_html_file_is_rejected_before_anything_runs(command: Command, working_folder: Path) -> None:
    result = command("compare", "article", "--report", "article.pdf", "--json", "figures.json")
    assert result == (2, "", "article.pdf: a report must end in .html\n")
    assert list(working_folder.iterdir()) == []


@pytest.mark.wide
def test_the_page_can_go_to_standard_output(command: Command) -> None:
    assert command("compare", "head-on", "--report", "-") == (0, page(compare(load("head-on"))), "")


# In a browser

RECORD = """
globalThis.circles = [];
const arc = CanvasRenderingContext2D.prototype.arc;
CanvasRenderingContext2D.prototype.arc = function (x, y, radius, ...rest) {
  const pane = [...document.querySelectorAll("#panes canvas")].indexOf(this.canvas);
  if (pane >= 0) circles.push([pane, x, y, radius]);
  arc.call(this, x, y, radius, ...rest);
};
"""
CURSORS = (
    "Bokeh.documents[0].roots().flatMap((f) => f.center).filter((s) => s.name === 'cursor').map((s) => s.location)"
)


@pytest.fixture(scope="module")
def browser(browser: Browser) -> Browser:
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=RECORD)
    return browser


@pytest.fixture(scope="module")
def file(text: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("report") / "article.html"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.fixture
def opened(browser: Browser, file: Path) -> Browser:
    browser.visit(file)
    return browser


def shown_time(browser: Browser) -> float:
    """Return the time that the page shows, after checking that the cursors of all charts are there."""
    time = float(browser.run("document.querySelector('#time').value").removesuffix(" s"))
    assert browser.run(CURSORS) == pytest.approx([time] * 2, abs=5e-4)
    return time


def drawn(browser: Browser, frame: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Go to a frame, and return the circles drawn: pane, x, y, radius."""
    browser.run(
        f"circles.length = 0; scrubber.value = {frame}; scrubber.dispatchEvent(new Event('input', {{bubbles: true}}))"
    )
    return np.array(browser.run("circles"))


def show_ghosts(browser: Browser, shown: bool) -> None:
    """Check or clear the box of the ghosts."""
    browser.run(f"ghosts.checked = {str(shown).lower()}; ghosts.dispatchEvent(new Event('change'))")


@pytest.mark.parametrize("width", [1280, 1920])
def test_it_opens_without_network_errors_or_horizontal_scrolling(browser: Browser, file: Path, width: int) -> None:
    browser.visit(file, width)
    assert browser.errors == []
    assert browser.requests == [file.as_uri()]
    assert browser.run("document.documentElement.scrollWidth") <= width
    sizes = (
        "[...document.querySelectorAll('body *')].filter((e) => e.innerText).map((e) => getComputedStyle(e).fontSize)"
    )
    assert min(float(size.removesuffix("px")) for size in browser.run(sizes)) >= 16


def test_play_moves_the_balls_at_the_scene_s_pace_and_stops_at_the_end(opened: Browser) -> None:
    before = drawn(opened, 0)
    opened.click("#play")
    assert opened.run("play.textContent") == "Pause"
    opened.wait_for("Number(scrubber.value) > 12")
    opened.click("#play")
    moved = np.array(opened.run(f"circles.slice(-{len(before)})"))
    assert (moved[:, 0] == before[:, 0]).all()
    assert (np.hypot(*(moved - before)[:, 1:3].T) > 10).all()
    opened.run("speed.value = 4; speed.dispatchEvent(new Event('change'))")
    drawn(opened, 1190)
    opened.click("#play")
    opened.wait_for("play.textContent === 'Play'")
    assert shown_time(opened) == 20


def test_the_balls_drawn_at_a_time_are_the_run_s(opened: Browser, article: Comparison) -> None:
    show_ghosts(opened, False)  # so that all circles are balls
    unit, _ = fixed_point(article.scene)
    for frame in (0, 333, 1200):
        circles = drawn(opened, frame)
        for index, run in enumerate(article.runs.values()):
            pane = circles[circles[:, 0] == index]
            assert pane[:, 1:3] == pytest.approx(run.path[frame], abs=0.51 * unit)
            assert pane[:, 3].tolist() == [20, 20, 20]
            for (_, x, y, _), color in zip(pane, article.scene.colors, strict=True):
                assert pixel(opened, index, x + 14, y) == rgb(color)  # beside the ball's number


def pixel(browser: Browser, pane: int, x: float, y: float) -> tuple[int, ...]:
    """Return the colour that a pane shows at a point of the scene."""
    return tuple(
        browser.run(
            f"(() => {{ const c = document.querySelectorAll('#panes canvas')[{pane}]; const s = c.width / 800;"
            f"return [...c.getContext('2d').getImageData(Math.floor({x} * s), Math.floor({y} * s), 1, 1).data] }})()"
        )[:3]
    )


def test_pegs_are_drawn_as_discs(browser: Browser, tmp_path: Path) -> None:
    pegs = [{"radius": 30, "positions": [(400, 300)]}]
    scene = Scene(arena={"size": (800, 600)}, balls=[{"radius": 9, "position": (100, 100)}], pegs=pegs, seconds=0.1)
    file = tmp_path / "pegs.html"
    file.write_text(page(compare(scene, ["pymunk", "exact"])), encoding="utf-8")
    browser.visit(file)
    assert {pixel(browser, 0, *at) for at in ((400, 300), (425, 300), (375, 300), (400, 325))} == {(0, 0, 0)}
    assert {pixel(browser, 0, *at) for at in ((435, 300), (425, 325))} == {(255, 255, 255)}


def test_ghosts_are_the_reference_s_balls(opened: Browser, article: Comparison) -> None:
    show_ghosts(opened, True)
    unit, _ = fixed_point(article.scene)
    circles = drawn(opened, 600)
    assert (circles[:, 0] == 3).sum() == 3  # the reference has none itself
    for pane in range(3):
        ghosts = circles[circles[:, 0] == pane][3:]
        assert ghosts[:, 1:3] == pytest.approx(article.runs["exact"].path[600], abs=0.51 * unit)


def test_a_click_on_the_first_difference_goes_there(opened: Browser, article: Comparison) -> None:
    first = article.runs["pymunk"].differences[0]
    opened.click(".differences button")
    assert first.time - 1e-3 <= shown_time(opened) < first.time + 1 / 60 + 1e-3
    assert opened.run("document.querySelector('[aria-current]').textContent") == f"{first.time:.3f} s"
    assert first.because in opened.run("chosen.textContent")
    assert opened.run("panes.getBoundingClientRect().bottom <= innerHeight && panes.getBoundingClientRect().top >= 0")
    rings = [circle for circle in opened.run("circles.slice(-40)") if circle[3] > 20]
    assert {circle[0] for circle in rings} == {0, 3}  # in the engine's pane and in the reference's


def test_a_click_in_a_chart_goes_to_that_time(opened: Browser) -> None:
    opened.click("#energy", 0.5, 0.6)
    opened.wait_for("Number(scrubber.value) > 0")
    assert 7 < shown_time(opened) < 13
