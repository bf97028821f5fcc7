"""A comparison in a notebook: its page in a frame, and Bokeh's script once for all outputs."""

import html
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from browser import READY, Browser

import sandbox
from sandbox.report import notebook
from sandbox.report.comparison_page import page
from sandbox.report.html import bokeh_script

MAX_OUTPUT_BYTES = 1_000_000


@pytest.fixture(autouse=True)
def _new_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "_provider", None)


@pytest.fixture(scope="module")
def article() -> sandbox.Comparison:
    return sandbox.compare("article", ["pymunk", "article", "exact"])


@pytest.fixture(scope="module")
def outputs(article: sandbox.Comparison) -> list[str]:
    """Show the same comparison three times in a new notebook."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(notebook, "_provider", None)
        return [article._repr_html_() for _ in range(3)]


def has_bokeh(output: str) -> bool:
    return notebook.PROVIDER.partition("%s")[0] in output


def test_the_page_is_in_a_frame_of_its_own(article: sandbox.Comparison, outputs: list[str]) -> None:
    found = re.fullmatch(r"(?s)<script>.*</script><iframe ([^']*) srcdoc='([^']*)' .*></iframe>", outputs[0])
    assert found
    assert 'sandbox="allow-scripts"' in found[1]
    assert html.unescape(found[2]) == page(article, in_notebook=True)


def test_only_the_first_of_three_outputs_has_bokeh(outputs: list[str]) -> None:
    assert [has_bokeh(output) for output in outputs] == [True, False, False]
    assert not any(bokeh_script()[:200] in output for output in outputs)
    assert len(outputs[0]) < MAX_OUTPUT_BYTES
    assert len(outputs[1]) < MAX_OUTPUT_BYTES / 2


@pytest.mark.wide
def test_the_output_of_many_balls_is_below_a_megabyte() -> None:
    output = sandbox.compare("gas-100", ["pymunk", "impulse", "exact"], seconds=5)._repr_html_()
    assert has_bokeh(output)
    assert len(output) < MAX_OUTPUT_BYTES


@pytest.mark.wide
def test_a_page_that_is_too_large_is_shown_as_text(
    article: sandbox.Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(notebook, "MAX_FRAME_BYTES", 1_000)
    output = article._repr_html_()
    assert output.startswith("<pre>The article&#x27;s three balls: 3 balls, 20 s at 60 steps a second, seed 0;")
    assert len(output) < 10_000
    assert "<iframe" not in output


@pytest.mark.wide
def test_a_cell_that_runs_again_has_bokeh_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """The notebook discards the earlier output of the cell."""
    short = sandbox.compare("article", ["article"], seconds=0.1)
    cell = {"cellId": "first"}
    shell = SimpleNamespace(execution_count=1, get_parent=lambda: {"metadata": dict(cell)})
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    found = [has_bokeh(short._repr_html_()), has_bokeh(short._repr_html_())]
    for cell["cellId"], shell.execution_count in (("second", 2), ("first", 3), ("second", 4)):
        found.append(has_bokeh(short._repr_html_()))
    assert found == [True, False, False, True, False]


@pytest.mark.wide
def test_every_output_of_a_notebook_has_charts_and_balls(browser: Browser, outputs: list[str], tmp_path: Path) -> None:
    file = tmp_path / "notebook.html"
    cells = "".join(f"<div>{output}</div>" for output in outputs)
    file.write_text(f"<!doctype html><meta charset=utf-8>{cells}", encoding="utf-8")
    with browser.frames_of(file, len(outputs)) as frames:
        for _ in frames:
            browser.wait_for(READY)
            assert browser.run("document.querySelectorAll('.charts canvas, .charts .bk-Figure').length") > 0
            assert browser.run("document.getElementById('waiting')") is None
            browser.run("document.getElementById('on').click()")
            assert browser.run("scrubber.value") == "1"
            assert browser.errors == []
            assert browser.requests == []


def test_without_the_output_that_has_bokeh_the_page_plays_and_says_what_is_missing(
    browser: Browser, outputs: list[str], tmp_path: Path
) -> None:
    file = tmp_path / "notebook.html"
    file.write_text(f"<!doctype html><meta charset=utf-8>{outputs[1]}", encoding="utf-8")
    with browser.frames_of(file, 1) as frames:
        next(frames)
        browser.wait_for("document.readyState === 'complete'")
        assert "restart the kernel" in browser.run("document.getElementById('waiting').innerText")
        browser.run("play.click()")
        browser.wait_for("Number(scrubber.value) > 0")
        assert browser.errors == []
