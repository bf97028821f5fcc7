"""Scenes, file names and folders of strangers: what they say is shown, and nothing of it is obeyed."""

import csv
import io
import json
import os
import shlex
import subprocess
import sys
import unicodedata
from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest
from browser import Browser, chromium
from conftest import Command, said
from pygame.event import Event

from sandbox.analysis.comparison import compare
from sandbox.errors import SandboxError
from sandbox.report.comparison import page
from sandbox.report.sweep import page as sweep_page
from sandbox.run.inputs import Start, load_inputs
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.sweep import as_csv, in_order, plan
from sandbox.sweep.jobs import run
from sandbox.text import csv_text
from sandbox.view.window import Window

COMMANDS = {  # to a terminal, in a name or a text
    "colour": "\x1b[31mred",
    "bell": "a\x07b",
    "backspace": "a\b\bb",
    "over": "first\rsecond",
    "lines": "a\nmine.toml: 1 ball, no errors",
    "c1": "a\x9b31mb",
    "override": "a\u202eb",
    "isolate": "a\u2066b",
    "separator": "a\u2028b",
    "unseen": "a\u200bb",
}
NAMES = COMMANDS | {
    "no-utf-8": os.fsdecode(b"\xff"),
    "markup": "[red]a [link=file:b]c [[balls]]",
    "emoji": ":smile:",
    "sum": "=1+1",
    "plus": "+1",
    "minus": "-1",
    "at": "@SUM(1)",
    "option": "--out=x",
    "shell": "$(touch ran); touch `ran` ~ ! 'a' \"b\" && touch ran",
    "html": "<img src=x onerror='globalThis.ran = 1'>",
    "tex": r"$$\href{javascript:globalThis.ran=1}{a}$$",
}
TEXTS = (
    r"$$\href{javascript:globalThis.ran=1}{a}$$ \(b\) \[c\]",
    "</script></title></pre><script>globalThis.ran = 1</script><!--",
    "<img src=x onerror='globalThis.ran = 1'><style>*{background:url(http://a.example)}</style>",
    "\"><svg onload='globalThis.ran = 1'> {{ 7 * 7 }} &lt;b&gt;",
)
SCENE = """seconds = 0.1
[arena]
size = [200, 100]
[[balls]]
radius = 20
position = [50, 50]
velocity = [-300, 0]
[[expect]]
at = 0
momentum = [-300, 0]
tolerance = 1
because = "It flies."
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def obeyed(text: str) -> set[str]:
    """Return the letters of an output that a terminal would obey instead of showing them."""
    return {letter for letter in text if unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Zl", "Zp")} - {"\n"}


def files(text: str, ending: str = ".toml") -> list[str]:
    for name in NAMES.values():
        Path(f"{name}{ending}").write_text(text)
    return [f"{name}{ending}" for name in NAMES.values()]


def scene(title: str = "", about: str = "", because: str = "It flies.", name: str = "mine") -> Scene:
    title, about, because = (json.dumps(text, ensure_ascii=False) for text in (title, about, because))
    rest = SCENE.replace('"It flies."', because)
    return parse(f"title = {title}\nabout = {about}\n{rest}", f"{name}.toml")


# In the terminal


@pytest.mark.parametrize("key", ["title", "about", "because"])
@pytest.mark.parametrize("text", COMMANDS.values(), ids=list(COMMANDS))
def test_no_text_of_a_scene_commands_a_terminal(key: str, text: str) -> None:
    if key != "title" and "\n" in text:
        scene(**{key: text})
        return
    with pytest.raises(SandboxError) as caught:
        scene(**{key: text})
    assert str(caught.value).partition(": ")[2] in {
        f"{'expect[0].' if key == 'because' else ''}{key} must not have control characters, got U+{ord(letter):04X}"
        for letter in obeyed(text) | {"\n"}
    }


def test_words_of_every_language_may_be_said() -> None:
    """Joiners are invisible, but Persian, Hindi and families are spelt with them."""
    for text in (
        "Möbius' 漢字 שלום",
        "می\u200cخواهم",  # noqa: RUF001
        "क्\u200dष",
        "\U0001f468\u200d\U0001f469\u200d\U0001f467 é e\u0301",
    ):
        assert scene(text, f"{text}\n\t{text}").title == text


@pytest.mark.parametrize(("key", "most"), [("title", 100), ("about", 2_000), ("because", 2_000)])
def test_a_text_that_would_fill_the_window_is_a_mistake(key: str, most: int) -> None:
    scene(**{key: "a" * most})
    with pytest.raises(SandboxError, match=rf'{key} must have at most {most} characters, got "a{{36}}\.\.\.$'):
        scene(**{key: "a" * 3_000})


@pytest.mark.parametrize("wrong", ["", "rate = 1", "rate = 0", "a\x1b = 1", '"\\u001b[31m\\u202e" = 1'])
def test_no_file_s_name_commands_a_terminal(command: Command, wrong: str) -> None:
    """Nor do they write a line of their own: a file has one, and one more for a warning."""
    names = files(f"{wrong}\n{SCENE}".replace("seconds = 0.1", "seconds = 1"))
    code, out, err = command("check", "--", *names)
    assert code == (0 if wrong in ("", "rate = 1") else 2)
    assert not obeyed(out + err)
    assert (out + err).count("\n") == len(names) * (2 if wrong == "rate = 1" else 1)
    assert "\N{REPLACEMENT CHARACTER}[31mred.toml:" in out + err
    assert "[red]a [link=file:b]c [[balls]].toml:" in out + err
    none = [f"none-{name}" for name in names]
    code, out, err = command("check", *none)
    assert (code, out, len(err.splitlines())) == (2, "", len(none))
    assert not obeyed(err)


@pytest.mark.parametrize("option", ["--engines", "--against", "--csv", "--report", "--inputs", "--seconds"])
def test_no_argument_commands_a_terminal(command: Command, option: str) -> None:
    Path("mine.toml").write_text(SCENE)
    for text in COMMANDS.values():
        code, out, err = command("compare", "mine.toml", option, f"none/{text}")
        assert (code, out) == (2, "")
        assert not obeyed(err)


def test_names_stand_in_tables_as_they_are(command: Command) -> None:
    code, out, err = command("verify", "--engines", "exact", "--", *files(SCENE))
    assert code == 0
    assert not obeyed(out + err)
    for name in ("[red]a [link=file:b]c [[balls]]", ":smile:"):
        assert f"\n{name}  " in out
        code, out_of_one, err = command("compare", f"./{name}.toml", "--engines", "exact")
        assert (code, err) == (0, "")
        assert out_of_one.startswith(f"{name}: 1 ball, ")


def test_recorded_inputs_name_no_scene_that_commands_a_terminal() -> None:
    lines = [{"step": 0, "do": "start", "scene": name, "seed": 0, "rate": 60} for name in COMMANDS.values()]
    lines.append({"step": 0, "do": "start", "scene": "\ud800", "seed": 0, "rate": 60})
    Path("\x1b\n.jsonl").write_text("\n".join(map(json.dumps, lines)))
    with pytest.raises(SandboxError) as caught:
        load_inputs(Path("\x1b\n.jsonl"), scene())
    told = str(caught.value).splitlines()
    assert len(told) == len(lines)
    assert all(": scene must not have " in line for line in told)
    assert not obeyed(str(caught.value))


# In a spreadsheet


def cells(text: str) -> list[str]:
    return [cell for line in csv.reader(io.StringIO(text)) for cell in line]


def is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("name", NAMES.values(), ids=list(NAMES))
def test_a_spreadsheet_runs_nothing(name: str) -> None:
    comparison = compare(scene(name=name), ["article", "exact"])
    sweep = plan(comparison.scene, [0], [60], ["article"])
    rows = [run(sweep.scene, sweep.against, job) for job in sweep.jobs]
    hostile = {"against": f"{name}", "ledger.=1.contacts": -2.5, "python": "\t=1", "horizon": "+1"}  # of its journal
    for text in (comparison.as_csv(), as_csv(rows), as_csv(in_order(sweep, [rows[0] | hostile]))):
        text.encode()
        told = cells(text)
        assert any(comparison.scene.name in cell for cell in told)
        for cell in told:
            assert not cell.startswith(("=", "+", "-", "@", "\t", "\r")) or is_number(cell), cell


def test_numbers_below_0_are_numbers_in_a_spreadsheet() -> None:
    assert cells(csv_text([[-1, -2.5, "-1", None, -1e-300, ("-",)]])) == ["-1", "-2.5", "'-1", "", "-1e-300", "('-',)"]
    comparison = compare(load("article").changed(seconds=2.0), ["article", "exact"])
    [row, _] = csv.DictReader(io.StringIO(comparison.as_csv()))
    assert float(row["ledger.small.energy"]) < 0


# In the shell


def test_the_command_on_the_page_runs_nothing_else(command: Command) -> None:
    """Bash is asked what it makes of it, where `sandbox` tells its arguments."""
    wanted = {}
    for key in ("lines", "no-utf-8", "minus", "option", "shell"):
        comparison = compare(scene(name=NAMES[key]), ["exact"])
        [line] = [line for line in page(comparison).splitlines() if line.startswith("  <pre>sandbox compare ")]
        wanted[comparison.scene.name] = html_text(line)
    script = "sandbox() { printf '%s\\0' \"$@\"; }\n" + "\n".join(wanted.values())
    ran = subprocess.run(["bash"], input=script, capture_output=True, text=True, check=True)
    assert ran.stderr == ""
    assert list(Path().iterdir()) == []
    words = ran.stdout.split("\0")
    given = [words[index + 1] for index, word in enumerate(words) if word == "compare"]
    assert [Path(file).stem for file in given] == list(wanted)
    assert not any(file.startswith("-") for file in given)
    Path("--out=x.toml").write_text(SCENE)
    code, out, err = command(*shlex.split(wanted["--out=x"])[1:])
    assert (code, err) == (0, "")
    assert out.startswith("--out=x: 1 ball, ")


def html_text(line: str) -> str:
    from html import unescape

    return unescape(line.strip().removeprefix("<pre>").removesuffix("</pre>"))


# On a page

# The page's own elements, and the kinds of those that Bokeh's have within them, of which there are more or fewer.
ELEMENTS = """(() => {
  const all = (root) => [...root.querySelectorAll("*")].flatMap((e) => [e, ...(e.shadowRoot ? all(e.shadowRoot) : [])]);
  const kinds = (elements) => elements.map((e) => e.localName);
  return [kinds([...document.body.querySelectorAll("*")]), [...new Set(kinds(all(document.body)))].sort()];
})()"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with chromium(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.mark.parametrize("of", ["comparison", "sweep"])
def test_a_page_of_a_hostile_scene_is_as_any_runs_nothing_and_asks_for_nothing(browser: Browser, of: str) -> None:
    found = []
    for title, name in [("A scene", "mine"), (TEXTS[0], NAMES["html"]), (TEXTS[1], NAMES["tex"]), ("W" * 100, "mine")]:
        told = scene(title, " ".join(TEXTS), " ".join(TEXTS), name)
        if of == "comparison":
            text = page(compare(told, ["exact"]))
        else:
            sweep = plan(told, [0], [60], ["article"])
            text = sweep_page(sweep, [run(sweep.scene, sweep.against, job) for job in sweep.jobs])
        file = Path("page.html").resolve()
        file.write_text(text)
        browser.visit(file)
        found.append(browser.run(ELEMENTS))
        assert browser.run("typeof ran") == "undefined"
        assert browser.run("document.documentElement.scrollWidth") <= 1280
        assert browser.complaints == []
        assert browser.requests == [file.as_uri()]
    for elements in found:
        assert elements == found[0]
    assert {"a", "img", "svg"}.isdisjoint(found[0][1])


# In the window, and on the disk


def test_the_window_shows_any_name_and_saves_beside_itself(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    inside = tmp_path / "inside"
    inside.mkdir()
    monkeypatch.chdir(inside)
    Path("[[balls]].toml").mkdir()
    names = files(SCENE)
    window = Window(load(Path(names[0])), ["article"])
    before = {*tmp_path.rglob("*")}
    opened = [f"{NAMES[key]}.toml" for key in ("colour", "lines", "override", "no-utf-8", "option", "html")]
    for file in opened:
        window.on_event(Event(pygame.DROPFILE, file=f"none-{file}"))
        assert window.shelf.mistake.startswith("none-")
        window.frame(0)
        window.escape()
        window.on_event(Event(pygame.DROPFILE, file=file))
        assert window.scene.file == Path(file)
        assert Start(scene=window.scene.name, seed=0, rate=60).model_dump_json()
        window.frame(0)
        for act in (window.save_scene, window.save_picture, window.record, window.record):
            act()
            assert window.notice[0].startswith("saved ") or act == window.record
            window.frame(0)
    window.shelf.pick()
    window.frame(0)
    assert window.shelf.picker
    picked = {entry.file.name: entry.name for entry in window.shelf.picker.found}
    assert set(names) <= set(picked)
    assert "[[balls]].toml" not in picked
    assert not obeyed("".join(picked.values()))
    new = {*tmp_path.rglob("*")} - before
    assert {file.parent for file in new} == {inside}
    assert {file.suffix for file in new} == {".toml", ".png", ".gif"}
    assert len(new) == 3 * len(opened)


@pytest.mark.parametrize(
    "colour",
    ["url(http://a.example)", "red;}</style>", "rgb(1,2,3)", "hsl(0,0%,0%)", "#12", "#1234", "#ffffff\n", "a\x1b"],
)
def test_a_colour_is_a_name_or_a_number(colour: str) -> None:
    for line in ("background = ", "\n[[balls]]\nradius = 1\nposition = [9, 9]\ncolors = "):
        value = json.dumps(colour) if "back" in line else json.dumps([colour])
        with pytest.raises(SandboxError, match="is no colour"):
            parse(
                SCENE.replace("[[expect]]", "").split("at = 0")[0].replace("[[balls]]", f"{line}{value}\n[[balls]]", 1),
                "mine.toml",
            )


# In the folder that one is in


def test_no_module_of_the_folder_one_is_in_is_run(tmp_path: Path) -> None:
    """Python's own processes would look there first for what they import."""
    program = tmp_path / "elsewhere" / "program.py"
    program.parent.mkdir()
    program.write_text("if __name__ == '__main__':\n    from sandbox.cli import main\n    main()")
    Path("mine.toml").write_text(SCENE)
    for module in ("multiprocessing", "pickle", "numpy", "sandbox"):
        Path(f"{module}.py").write_text("open('ran', 'w')")
    arguments = ["sweep", "mine.toml", "--engines", "article", "--workers", "1"]
    run = subprocess.run([sys.executable, program, *arguments], capture_output=True, text=True, check=False)
    assert (run.returncode, said(run.stderr)) == (0, "")
    assert len(run.stdout.splitlines()) == 2
    assert not Path("ran").exists()


def test_settings_of_numba_in_the_folder_one_is_in_are_not_obeyed(command: Command) -> None:
    """They can name a folder of compiled code, which is pickled: to read it is to run it."""
    Path(".numba_config.yaml").write_text("cache_dir: cache")
    Path("mine.toml").write_text(SCENE)
    message = ".numba_config.yaml: numba would obey it; move it away, or go to another folder\n"
    assert command("check", "mine.toml") == (2, "", message)
    assert not Path("cache").exists()
