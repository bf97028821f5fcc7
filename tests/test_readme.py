"""What the README says is true: its commands run, its tables and figures are what the program prints."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from conftest import Command
from PIL import Image

from sandbox.analysis.comparison import Comparison
from sandbox.run.inputs import Start, write_inputs
from sandbox.scene.files import parse
from sandbox.view.controls import HELP

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
SET_UP = re.findall(r"^python3 -m venv .*$", README, re.MULTILINE)
COMMANDS = [line for block in re.findall(r"```sh\n(.*?)```", README, re.DOTALL) for line in block.splitlines()]
COMPARISON = "sandbox compare article"
[PICTURE] = [line for line in COMMANDS if line.endswith(" --out docs/window.png")]


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").mkdir()
    write_inputs([Start(scene="article", seed=0, rate=60)], tmp_path / "mouse.jsonl")
    return tmp_path


@pytest.mark.parametrize("line", [line for line in COMMANDS if line not in (*SET_UP, COMPARISON, PICTURE)])
def test_every_command_runs(line: str, folder: Path, command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.bench.figure.ROUNDS", 1)
    program, *arguments = line.split()
    code, _, err = command(*arguments)
    assert (program, code, err) == ("sandbox", 0, "")
    for written in re.findall(r"--(?:out|json|csv|report) (\S+)", line):
        assert (folder / written).stat().st_size > 0


def test_the_picture_is_what_its_command_draws(folder: Path, command: Command) -> None:
    assert command(*PICTURE.split()[1:]) == (0, "", "")
    with Image.open(folder / "docs" / "window.png") as drawn, Image.open(ROOT / "docs" / "window.png") as kept:
        assert drawn.size == kept.size
        different = (np.asarray(drawn.convert("RGB")) != np.asarray(kept.convert("RGB"))).any(axis=2)
    assert different.mean() < 0.02  # letters may differ where pygame has another version of its font


def test_the_set_up_lines_are_those_that_ci_runs() -> None:
    assert len(SET_UP) == 2
    script = (ROOT / ".ci" / "run").read_text().splitlines()
    assert set(SET_UP) <= set(script)


def test_the_comparison_is_what_the_command_prints(folder: Path, command: Command) -> None:
    assert COMPARISON in COMMANDS
    code, out, err = command(*COMPARISON.split()[1:])
    assert (code, err) == (0, "")
    assert [line.rstrip() for line in out.splitlines()] == blocks("text")[0].splitlines()


def test_the_figures_of_the_engines_are_what_the_tool_prints(folder: Path, command: Command) -> None:
    def left(scene: str) -> str:
        _, out, _ = command("compare", scene, "--engines", "article", "--json", "-")
        figures = json.loads(out)
        return f"{figures['engines']['article']['energy_ratio']:.1%}".replace("%", " %")

    assert f"{left('article')} left of `article` after 20 s, {left('newtons-cradle')} of `newtons-cradle`" in README


def test_the_example_scene_has_no_mistakes() -> None:
    scene = parse(blocks("toml")[0], "README.md")
    assert len(scene.bodies) == 11


def test_the_python_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, object] = {}
    exec(blocks("python")[0], names)
    comparison = names["comparison"]
    assert isinstance(comparison, Comparison)
    assert capsys.readouterr().out == f"{comparison.runs['article'].figures.energy_ratio}\n"


def test_the_keys_are_those_of_the_window() -> None:
    assert "".join(f"| {keys} | {does} |\n" for keys, does in HELP) in README
