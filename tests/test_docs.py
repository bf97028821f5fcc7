"""The documents are true: their commands print the output below them, their examples run, their links resolve.

    SANDBOX_WRITE_DOCS=1 .venv/bin/pytest -q -m "" tests/test_docs.py

writes into the documents what their commands print, the keys of the window, the tables of formats, and the pictures.

A ```text block directly after a ```sh block of one command is its output, and after a ```python block what that prints;
a last line `...` stands for the rest.
A block whose first line is a comment such as `# mine.toml` is a file for all commands and examples of its page.
A comment `# exit code 1` after a command is the exit code that it must have; without one it is 0.
"""

import itertools
import json
import os
import re
import runpy
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import numpy as np
import pygame
import pytest
from browser import chromium
from conftest import LIBRARIES_REQUIRED, Command, sample
from format_tables import tables
from PIL import Image, ImageSequence
from typer.main import get_command

from sandbox.bench.window import finer_gas
from sandbox.cli.commands import app
from sandbox.run import inputs
from sandbox.scene.files import parse
from sandbox.scene.model import Scene
from sandbox.view.controls import HELP

ROOT = Path(__file__).parent.parent
WRITE = os.environ.get("SANDBOX_WRITE_DOCS") == "1"
README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```\n(?:\n?^```text\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w-]+\.(?:toml|py))\n")
NOT_RUN = ("python3 -m venv", ".venv/bin/", "pip ", ".ci/", "SANDBOX_WRITE_DOCS")  # sets up, or runs the tests
MISTAKEN = "broken.toml"  # its errors are what a page shows
SOURCES = (".py", ".js", ".html", ".css", ".toml")
FRAGMENT = {"arena": {"size": [800, 600]}, "balls": [{"radius": 20, "position": [100 + 50 * k, 100]} for k in range(2)]}
ROUNDING = re.compile(r"\d\.\d+e-1[3-9]|0\.00e\+00|cost [\d.]+ times")  # figures that differ on another processor
HOSTS = {"box2d.org", "distributed.dask.org", "github.com", "www.pymunk.org"}  # that the documents link to
NEEDS = {"box2d": "pyb2d3", ".mp4": "av"}  # what a command names, and the library that it needs


class Block(NamedTuple):
    """A fenced block, and the output that stands directly after it."""

    page: Path
    language: str
    text: str
    output: str | None

    def __str__(self) -> str:
        """Name it in a test's id."""
        return f"{self.page.name}: {self.text.splitlines()[0]}"

    def check_output(self, printed: str) -> None:
        """Compare what is printed with the document, or write it there."""
        lines = "".join(f"{line.rstrip()}\n" for line in printed.strip("\n").splitlines())
        if self.output and self.output.endswith("...\n"):
            lines = "\n".join([*lines.split("\n")[: self.output.count("\n") - 1], "...\n"])
        if WRITE and self.output is not None and lines != self.output:
            rewrite(self.page, self.text + "```", f"```text\n{self.output}```", f"```text\n{lines}```")
        elif self.output is not None:
            assert ROUNDING.sub("rounding", lines) == ROUNDING.sub("rounding", self.output)


@cache
def blocks(language: str) -> list[Block]:
    """Return all blocks of a language in all pages."""
    return [
        Block(page, found[1], found[2], found[3])
        for page in PAGES
        for found in BLOCK.finditer(page.read_text())
        if found[1] == language
    ]


def rewrite(page: Path, after: str, old: str, new: str) -> None:
    """Replace the first text that follows another in a page."""
    before, found, rest = page.read_text().partition(after)
    assert found
    assert old in rest
    page.write_text(before + found + rest.replace(old, new, 1))


def commands() -> Iterator[Block]:
    """Yield each command of each page, with the output that stands below it."""
    for block in blocks("sh"):
        lines = block.text.splitlines(keepends=True)
        assert len(lines) == 1 or block.output is None, f"{block}: which command printed that?"
        yield from (block._replace(text=line) for line in lines if not line.startswith(NOT_RUN))


def files(page: Path) -> dict[str, str]:
    """Return the files that a page shows."""
    return {found[1]: one.text for one in BLOCKS if one.page == page and (found := FILE.match(one.text))}


COMMANDS = list(dict.fromkeys(commands()))
OF_README, OF_PAGES = ([block for block in COMMANDS if (block.page == README) is wanted] for wanted in (True, False))
EXAMPLES = [block for block in blocks("python") if not FILE.match(block.text)]
BLOCKS = [*blocks("toml"), *blocks("python")]
SET_UP = re.findall(r"^python3 -m venv .*$", README.read_text(), re.MULTILINE)


def put_files(page: Path, folder: Path) -> None:
    """Put into a folder what a page's commands and examples read."""
    shutil.copytree(ROOT / "docs" / "examples", folder / "docs" / "examples")
    inputs.write_inputs([inputs.Start(scene="article", seed=0, rate=60)], folder / "mouse.jsonl")
    for name, text in files(page).items():
        (folder / name).write_text(text)


def test_there_are_documents() -> None:
    assert {page.stem for page in PAGES} == {
        *("README", "comparing", "developing", "engines", "faq", "formats", "method", "python", "scenes", "sweeps"),
        *("installing", "teaching", "window", "your-program"),
    }
    assert len(COMMANDS) > 40
    assert len(EXAMPLES) > 5


@pytest.mark.parametrize("block", [*OF_README, *sample(OF_PAGES, 5)], ids=str)
def test_every_command_prints_what_stands_there(
    block: Block, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, library in NEEDS.items():
        if name in f"{block.text}{block.output}" and find_spec(library) is None:
            assert not LIBRARIES_REQUIRED, f"{library} is not installed"
            pytest.skip(f"needs {library}")
    monkeypatch.setattr("sandbox.bench.parts.ROUNDS", 1)
    monkeypatch.setattr("sandbox.bench.window.finer_gas", lambda n: finer_gas(n // 50))
    monkeypatch.setattr("sandbox.bench.figure.SECONDS_PER_ROUND", 0.0)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    put_files(block.page, tmp_path)
    line, _, expected = block.text.strip().partition("  # exit code ")
    program, *arguments = line.partition(" | ")[0].split()
    code, out, err = command(*arguments)
    assert (program, code) == ("sandbox", int(expected or 0)), err
    if block.output is None:
        assert err == "" or code != 0
    printed = out + err if code else err + out  # warnings come first, and a limit exceeded at the end
    if pipe := line.partition(" | ")[2]:
        printed = subprocess.run(pipe, shell=True, input=printed, text=True, capture_output=True, check=True).stdout
    block.check_output(printed)
    for written in re.findall(r"--(?:out|json|csv|series|report|save-inputs) ([\w./-]*\w)", line):
        assert (tmp_path / written).stat().st_size > 0
        if written.startswith("docs/"):
            check_picture(tmp_path / written, ROOT / written)


def check_picture(drawn: Path, kept: Path) -> None:
    """Compare a picture, or the last frame of a video, with the one in the repository, or write it there."""
    if WRITE:
        shutil.copy(drawn, kept)
    with Image.open(drawn) as one, Image.open(kept) as other:
        last, last_kept = (list(ImageSequence.Iterator(image))[-1].convert("RGB") for image in (one, other))
    assert last.size == last_kept.size
    different = (np.asarray(last) != np.asarray(last_kept)).any(axis=2)
    assert different.mean() < 0.02  # letters may differ where pygame has another version of its font


if WRITE:

    def test_the_picture_of_the_report_is_written(tmp_path: Path, command: Command) -> None:
        page, picture = tmp_path / "article.html", tmp_path / "report.png"
        command("compare", "article", "--engines", "pymunk,article,exact", "--report", page)
        with chromium(tmp_path) as browser:
            browser.visit(page, width=1200, height=1000)
            browser.click("#scrubber", x=0.09)
            browser.picture(picture)
        with Image.open(picture) as whole:
            top = whole.convert("RGB").crop((0, 0, 1200, 1000)).quantize(64)
            top.save(ROOT / "docs" / "report.png", optimize=True)


@pytest.mark.parametrize("page", sorted({block.page for block in EXAMPLES}), ids=lambda page: page.name)
def test_the_python_examples_run(
    page: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    put_files(page, tmp_path)
    names: dict[str, object] = {}
    for block in EXAMPLES:
        if block.page == page:
            exec(compile(block.text, str(block), "exec"), names)
            block.check_output(capfd.readouterr().out)
    for file in tmp_path.glob("test_*.py"):
        tests = runpy.run_path(str(file))
        [test() for name, test in tests.items() if name.startswith("test_")]


def test_a_loop_draws_what_it_simulates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For 90 frames, in which a mouse drags the first ball of the game to a point; then the window is closed."""
    program = tmp_path / "game.py"
    program.write_text(files(ROOT / "docs" / "python.md")["game.py"])
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(pygame.time, "Clock", lambda: SimpleNamespace(tick=lambda rate: None))
    frames, start, end = itertools.count(1), (150, 175), (500, 100)
    happening: dict[int, Any] = {
        1: pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=1, pos=start),
        2: pygame.event.Event(pygame.MOUSEMOTION, pos=end, rel=(0, 0), buttons=(1, 0, 0)),
        90: pygame.event.Event(pygame.QUIT),
    }

    def flip() -> None:
        if event := happening.get(next(frames)):
            pygame.event.post(event)

    monkeypatch.setattr(pygame.display, "flip", flip)
    try:
        ran = runpy.run_path(str(program))
        [centre, *_] = ran["simulation"].state.position
        assert np.hypot(*(centre - end)) < 5
        assert ran["screen"].get_at([round(x) for x in end])[:3] == pygame.Color(ran["scene"].colors[0])[:3]
        assert pygame.display.get_caption()[0] == f"{ran['hits']} hits"
        assert ran["hits"] > 0
    finally:
        pygame.display.quit()


@pytest.mark.parametrize("block", blocks("toml"), ids=str)
def test_every_scene_is_valid(block: Block) -> None:
    found = FILE.match(block.text)
    if found and found[1] != MISTAKEN:
        parse(block.text, found[1])
    elif not found:
        Scene.model_validate(FRAGMENT | tomllib.loads(block.text))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_resolves(page: Path) -> None:
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    assert links
    for link in links:
        place, _, anchor = link.partition("#")
        if place.startswith("https://"):
            assert urlsplit(place).hostname in HOSTS
        else:
            target = page.parent / place if place else page
            assert target.exists(), link
            assert not anchor or anchor in anchors(target), link


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_every_page_is_in_the_contents() -> None:
    for page in PAGES[1:]:
        assert f"(docs/{page.name})" in README.read_text()


def test_every_command_answers_a_question() -> None:
    answers = set(re.findall(r"^\| .*`sandbox (\w+)", (ROOT / "docs" / "faq.md").read_text(), re.MULTILINE))
    assert answers == set(get_command(app).commands)  # type: ignore[attr-defined]


def test_the_documents_are_short() -> None:
    words = {page.stem: len(page.read_text().split()) for page in PAGES}
    assert words["README"] <= 700
    assert sum(words.values()) <= 16_000, words


def test_the_set_up_lines_are_those_that_ci_runs() -> None:
    assert len(SET_UP) == 2
    assert set(SET_UP) <= set((ROOT / ".ci" / "run").read_text().splitlines())


def test_the_keys_are_those_of_the_window() -> None:
    grouped = itertools.groupby(HELP, key=lambda row: row[0])
    rows = "".join(
        f"**{topic}** |\n" + "".join(f"`{keys}` | {does}\n" for _, keys, does in of) for topic, of in grouped
    )
    check_text(ROOT / "docs" / "window.md", "key | does\n---|---\n", "\n", rows)


@pytest.mark.parametrize("title", tables())
def test_the_tables_of_formats_are_those_of_the_models(title: str) -> None:
    check_text(ROOT / "docs" / "formats.md", f"# {title}\n\n", "\n", "".join(f"{row}\n" for row in tables()[title]))


def check_text(page: Path, start: str, end: str, text: str) -> None:
    """Compare what stands between two texts of a page, the second alone on its line, or write it there."""
    written, found, rest = page.read_text().partition(start)
    assert found
    old, found, rest = f"\n{rest}".partition(f"\n{end}")
    if WRITE:
        page.write_text(f"{written}{start}{text}{end}{rest}")
    else:
        assert f"{old}\n".removeprefix("\n") == text


def test_every_line_of_a_comparison_is_explained() -> None:
    shown = next(block for block in COMMANDS if block.page.name == "comparing.md")
    assert shown.output
    table = shown.output.split("\n\n")[2].splitlines()[1:]
    labels = {re.split("  | until ", line.strip())[0] for line in table}
    assert len(labels) >= 8
    explained = re.findall(r"^\| ([^|]*) \|", shown.page.read_text(), re.MULTILINE)
    assert labels - {label for cell in explained for label in cell.split(", ")} == set()


def test_the_layout_has_the_lines_of_each_folder() -> None:
    """To a tenth: it shows what is large, and need not change with each commit."""
    page, root = ROOT / "docs" / "developing.md", ROOT / "sandbox"
    text = page.read_text()
    for name, shown in re.findall(r"^  (\w+/|\*\.py) +([\d,]+)  ", text, re.MULTILINE):
        files_in = root.glob(name) if name == "*.py" else (root / name).rglob("*.*")
        sources = [file for file in files_in if file.suffix in SOURCES]
        lines = sum(len(file.read_text().splitlines()) for file in sources)
        if WRITE:
            text = re.sub(rf"^  {re.escape(name)} +[\d,]+  ", f"  {name:10}{lines:8,}  ", text, flags=re.MULTILINE)
        else:
            assert lines == pytest.approx(int(shown.replace(",", "")), rel=0.1), name
    if WRITE:
        page.write_text(text)


def keys_of(document: object) -> Iterator[str]:
    """Yield every key of a document, but for names of engines, causes and laws."""
    if isinstance(document, dict):
        for key, value in document.items():
            yield key
            named = key in ("engines", "ledger", "theory")
            yield from (each for one in value.values() for each in keys_of(one)) if named else keys_of(value)


def test_every_key_of_a_comparison_is_documented(command: Command) -> None:
    code, out, _ = command("compare", "gas-100", "--seconds", 0.5, "--json", "-")
    assert code == 0
    formats = (ROOT / "docs" / "formats.md").read_text()
    assert {key for key in keys_of(json.loads(out)) if f"`{key}`" not in formats} == set()
