"""The command line: exit codes, what goes where, and tables that fit."""

import json
from pathlib import Path

import pygame
import pytest
from conftest import Command

from sandbox.run.inputs import End, Start, load_inputs, write_inputs
from sandbox.scene.files import bundled, load

COMMANDS = ("run", "record", "compare", "trace", "verify", "sweep", "check", "scenes", "engines", "schema", "bench")


pytestmark = pytest.mark.usefixtures("working_folder")


def test_without_a_display_it_says_so_compares_and_saves_a_picture(command: Command) -> None:
    """The picture shows the end of the run in the table."""
    code, out, err = command("run", "head-on", "--save-inputs", "inputs.jsonl")
    assert (code, err) == (0, "")
    first, title, *table, last = out.splitlines()
    assert first == "No display: comparing instead of opening the window."
    assert title.startswith("Head-on: 2 balls, 3 s at 60 steps a second, seed 0; reference: exact")
    assert ["energy", "change", "0", "%", "-50", "%", "0", "%"] in [line.split() for line in table]
    assert last == "Picture of the end: head-on-0-000180.png"
    assert pygame.image.load("head-on-0-000180.png").get_size() == (1280, 720)
    scene = load("head-on")
    assert load_inputs(Path("inputs.jsonl"), scene) == [Start(scene="head-on", seed=0, rate=60), End(step=180)]


def test_a_picture_that_cannot_be_written_does_not_lose_the_comparison(command: Command) -> None:
    Path("head-on-0-000180.png").mkdir()
    code, out, err = command("run", "head-on")
    assert (code, err) == (2, "head-on-0-000180.png: cannot be written: Is a directory\n")
    assert "energy change" in out


def test_every_command_has_help(command: Command) -> None:
    _, top, _ = command("--help")
    for name in COMMANDS:
        assert f"\n  {name} " in top
        _, out, _ = command(name, "--help")
        assert out.startswith(f"Usage: sandbox {name} ")
    assert "--install-completion" in top
    assert "--show-completion" in top


@pytest.mark.parametrize("width", [50, 80])
def test_help_fits_the_terminal(command: Command, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    for name in COMMANDS:
        _, out, _ = command(name, "--help")
        assert max(map(len, out.splitlines())) <= width


def test_json_on_standard_output_is_all_there_is(command: Command) -> None:
    _, out, _ = command("compare", "article", "--seconds", "1", "--seed", "2", "--rate", "120", "--json", "-")
    document = json.loads(out)
    assert (document["seed"], document["rate"], document["seconds"]) == (2, 120, 1.0)
    assert list(document["engines"]) == ["pymunk", "article", "exact"]


def test_an_exceeded_limit_is_exit_code_1(command: Command) -> None:
    code, _, err = command("compare", "article", "--seconds", "2", "--max-gap", "1")
    assert code == 1
    assert err.startswith("pymunk: gap ")
    code, _, _ = command("compare", "article", "--seconds", "2", "--max-gap", "1000", "--max-energy-error", "0.5")
    assert code == 0


def test_the_table_fits_a_narrow_terminal(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    _, out, _ = command("compare", "article", "--seconds", "1")
    assert max(map(len, out.splitlines())) <= 60
    assert ["energy", "change", "0", "%", "-4.31", "%", "0", "%"] in [line.split() for line in out.splitlines()]
    monkeypatch.setenv("COLUMNS", "30")
    _, folded, _ = command("compare", "article", "--seconds", "1")
    assert "…" not in folded
    assert max(map(len, folded.splitlines())) <= 30


def test_scenes_are_listed_with_what_to_watch_for(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "1000")
    _, listed, _ = command("scenes")
    for name in bundled():
        assert load(name).about in listed


def test_a_rate_that_the_scene_does_not_allow_is_an_error_in_the_inputs(command: Command) -> None:
    write_inputs([Start(scene="article", seed=0, rate=1_000_000)], Path("inputs.jsonl"))
    code, _, err = command("trace", "article", "--engine", "exact", "--inputs", "inputs.jsonl")
    assert code == 2
    assert err.splitlines()[0] == "inputs.jsonl:1: seconds must be at most 10 at this rate, got 20"
