"""The page of a hostile scene runs no script, requests nothing, and shows a command that runs nothing else."""

import json
import shlex
import subprocess
from html import unescape
from pathlib import Path

import pytest
from browser import Browser
from conftest import Command
from hostile import NAMES, PAGE_TEXTS, SCENE, hostile_scene

from sandbox.analysis.comparison import compare
from sandbox.errors import SandboxError
from sandbox.report.comparison_page import page
from sandbox.report.sweep import page as sweep_page
from sandbox.scene.files import parse
from sandbox.sweeps import plan
from sandbox.sweeps.workers import run_here

pytestmark = pytest.mark.usefixtures("working_folder")

# The page's own elements, and the kinds of element inside Bokeh's, whose number varies.
ELEMENTS = """(() => {
  const all = (root) => [...root.querySelectorAll("*")].flatMap((e) => [e, ...(e.shadowRoot ? all(e.shadowRoot) : [])]);
  const kinds = (elements) => elements.map((e) => e.localName);
  return [kinds([...document.body.querySelectorAll("*")]), [...new Set(kinds(all(document.body)))].sort()];
})()"""


@pytest.mark.wide
@pytest.mark.parametrize("kind", ["comparison", "sweep"])
def test_the_page_of_a_hostile_scene_has_the_usual_elements_and_runs_nothing(browser: Browser, kind: str) -> None:
    found = []
    for title, name in [
        ("A scene", "mine"),
        (PAGE_TEXTS[0], NAMES["html"]),
        (PAGE_TEXTS[1], NAMES["tex"]),
        ("W" * 100, "mine"),
    ]:
        scene = hostile_scene(title, " ".join(PAGE_TEXTS), " ".join(PAGE_TEXTS), name)
        if kind == "comparison":
            text = page(compare(scene, ["exact"]))
        else:
            sweep = plan(scene, [0], [60], ["article"])
            text = sweep_page(sweep, [result.row for result in run_here(sweep, sweep.jobs) if result.row])
        file = Path("page.html").resolve()
        file.write_text(text)
        browser.visit(file)
        found.append(browser.run(ELEMENTS))
        assert browser.run("typeof ran") == "undefined"
        assert browser.run("document.documentElement.scrollWidth") <= 1280
        assert browser.errors == []
        assert browser.requests == [file.as_uri()]
    for elements in found:
        assert elements == found[0]
    assert {"a", "img", "svg"}.isdisjoint(found[0][1])


@pytest.mark.parametrize(
    "colour",
    ["url(http://a.example)", "red;}</style>", "rgb(1,2,3)", "hsl(0,0%,0%)", "#12", "#1234", "#ffffff\n", "a\x1b"],
)
def test_a_colour_that_could_carry_css_is_rejected(colour: str) -> None:
    group, _, _ = SCENE.partition("[[expect]]")
    for key, value in (("background", json.dumps(colour)), ("colors", json.dumps([colour]))):
        at = "[[balls]]" if key == "background" else "radius"
        with pytest.raises(SandboxError, match=rf"{key}\S* .*colour"):
            parse(group.replace(at, f"{key} = {value}\n{at}"), "mine.toml")


@pytest.mark.wide
def test_the_command_on_the_page_runs_nothing_else(command: Command) -> None:
    """Bash splits the command into arguments, which a function `sandbox` prints."""
    shown = {}
    for key in ("lines", "no-utf-8", "minus", "option", "shell"):
        comparison = compare(hostile_scene(name=NAMES[key]), ["exact"])
        [line] = [line for line in page(comparison).splitlines() if line.startswith("  <pre>sandbox compare ")]
        shown[comparison.scene.name] = unescape(line.strip().removeprefix("<pre>").removesuffix("</pre>"))
    script = "sandbox() { printf '%s\\0' \"$@\"; }\n" + "\n".join(shown.values())
    ran = subprocess.run(["bash"], input=script, capture_output=True, text=True, check=True)
    assert ran.stderr == ""
    assert list(Path().iterdir()) == []
    words = ran.stdout.split("\0")
    given = [words[index + 1] for index, word in enumerate(words) if word == "compare"]
    assert [Path(file).stem for file in given] == list(shown)
    assert not any(file.startswith("-") for file in given)
    Path("--out=x.toml").write_text(SCENE)
    code, out, err = command(*shlex.split(shown["--out=x"])[1:])
    assert (code, err) == (0, "")
    assert out.startswith("--out=x: 1 ball, ")
