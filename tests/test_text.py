"""Hostile names and texts are shown as text: in a terminal, in messages, in a spreadsheet."""

import csv
import io
import json
from pathlib import Path

import pytest
from conftest import Command
from hostile import NAMES, SCENE, TERMINAL_TEXTS, controls_in, hostile_scene, scene_files

from sandbox.analysis.comparison import compare
from sandbox.errors import SandboxError
from sandbox.run.inputs import load_inputs
from sandbox.scene.files import load
from sandbox.sweeps import as_csv, in_order, plan
from sandbox.sweeps.workers import run_here
from sandbox.text import csv_text

pytestmark = pytest.mark.usefixtures("working_folder")

# In a terminal


@pytest.mark.parametrize("key", ["title", "about", "because"])
@pytest.mark.parametrize("text", TERMINAL_TEXTS.values(), ids=list(TERMINAL_TEXTS))
def test_no_text_of_a_scene_controls_a_terminal(key: str, text: str) -> None:
    if key != "title" and "\n" in text:
        hostile_scene(**{key: text})
        return
    with pytest.raises(SandboxError) as caught:
        hostile_scene(**{key: text})
    assert str(caught.value).partition(": ")[2] in {
        f"{'expect[0].' if key == 'because' else ''}{key} must not have control characters, got U+{ord(letter):04X}"
        for letter in controls_in(text) | {"\n"}
    }


def test_text_in_any_language_is_accepted() -> None:
    """Joiners are invisible, but Persian, Hindi and emoji of families are spelt with them."""
    for text in (
        "Möbius' 漢字 שלום",
        "می\u200cخواهم",  # noqa: RUF001
        "क्\u200dष",
        "\U0001f468\u200d\U0001f469\u200d\U0001f467 é e\u0301",
    ):
        assert hostile_scene(text, f"{text}\n\t{text}").title == text


@pytest.mark.parametrize(("key", "most"), [("title", 100), ("about", 2_000), ("because", 2_000)])
def test_a_text_that_would_fill_the_window_is_rejected(key: str, most: int) -> None:
    hostile_scene(**{key: "a" * most})
    with pytest.raises(SandboxError, match=rf'{key} must have at most {most} characters, got "a{{36}}\.\.\.$'):
        hostile_scene(**{key: "a" * 3_000})


@pytest.mark.parametrize("wrong", ["", "rate = 1", "rate = 0", "a\x1b = 1", '"\\u001b[31m\\u202e" = 1'])
def test_no_name_of_a_file_controls_a_terminal(command: Command, wrong: str) -> None:
    """Nor does it add a line: each file has one, and another for a warning."""
    names = scene_files(f"{wrong}\n{SCENE}".replace("seconds = 0.1", "seconds = 1"))
    code, out, err = command("check", "--", *names)
    assert code == (0 if wrong in ("", "rate = 1") else 2)
    assert not controls_in(out + err)
    assert (out + err).count("\n") == len(names) * (2 if wrong == "rate = 1" else 1)
    assert "\N{REPLACEMENT CHARACTER}[31mred.toml:" in out + err
    assert "[red]a [link=file:b]c [[balls]].toml:" in out + err
    missing = [f"none-{name}" for name in names]
    code, out, err = command("check", *missing)
    assert (code, out, len(err.splitlines())) == (2, "", len(missing))
    assert not controls_in(err)


@pytest.mark.parametrize("option", ["--engines", "--against", "--csv", "--report", "--inputs", "--seconds"])
def test_no_argument_controls_a_terminal(command: Command, option: str) -> None:
    Path("mine.toml").write_text(SCENE)
    for text in TERMINAL_TEXTS.values():
        code, out, err = command("compare", "mine.toml", option, f"none/{text}")
        assert (code, out) == (2, "")
        assert not controls_in(err)


def test_names_are_printed_in_tables_without_markup(command: Command) -> None:
    code, out, err = command("verify", "--engines", "exact", "--", *scene_files())
    assert code == 0
    assert not controls_in(out + err)
    for name in ("[red]a [link=file:b]c [[balls]]", ":smile:"):
        assert f"\n{name}  " in out
        code, out_of_one, err = command("compare", f"./{name}.toml", "--engines", "exact")
        assert (code, err) == (0, "")
        assert out_of_one.startswith(f"{name}: 1 ball, ")


def test_no_scene_name_in_recorded_inputs_controls_a_terminal() -> None:
    lines = [{"step": 0, "do": "start", "scene": name, "seed": 0, "rate": 60} for name in TERMINAL_TEXTS.values()]
    lines.append({"step": 0, "do": "start", "scene": "\ud800", "seed": 0, "rate": 60})
    Path("\x1b\n.jsonl").write_text("\n".join(map(json.dumps, lines)))
    with pytest.raises(SandboxError) as caught:
        load_inputs(Path("\x1b\n.jsonl"), hostile_scene())
    *messages, of_surrogate = str(caught.value).splitlines()
    assert len(messages) == len(TERMINAL_TEXTS)
    assert all(": scene must not have " in line for line in messages)
    assert ": Invalid JSON: " in of_surrogate
    assert not controls_in(str(caught.value))


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
def test_a_spreadsheet_runs_no_cell_as_a_formula(name: str) -> None:
    comparison = compare(hostile_scene(name=name), ["article", "exact"])
    sweep = plan(comparison.scene, [0], [60], ["article"])
    rows = [result.row for result in run_here(sweep, sweep.jobs) if result.row]
    journal = {"against": f"{name}", "ledger.=1.contacts": -2.5, "python": "\t=1", "horizon": "+1"}
    for text in (comparison.as_csv(), as_csv(rows), as_csv(in_order(sweep, [rows[0] | journal]))):
        text.encode()
        assert any(comparison.scene.name in cell for cell in cells(text))
        for cell in cells(text):
            assert not cell.startswith(("=", "+", "-", "@", "\t", "\r")) or is_number(cell), cell


def test_negative_numbers_are_numbers_in_a_spreadsheet() -> None:
    assert cells(csv_text([[-1, -2.5, "-1", None, -1e-300, ("-",)]])) == ["-1", "-2.5", "'-1", "", "-1e-300", '["-"]']
    comparison = compare(load("article").changed(seconds=2.0), ["article", "exact"])
    [row, _] = csv.DictReader(io.StringIO(comparison.as_csv()))
    assert float(row["ledger.small.energy"]) < 0
