"""What the README says is true: its commands run, its tables and figures are what the program prints."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import said

from sandbox.comparison import Comparison
from sandbox.inputs import Start, write_inputs
from sandbox.scene import parse
from sandbox.view.controls import CONTROLS, DRAG

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
SET_UP = re.findall(r"^python3 -m venv .*$", README, re.MULTILINE)
COMMANDS = [line for block in re.findall(r"```sh\n(.*?)```", README, re.DOTALL) for line in block.splitlines()]


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    write_inputs([Start(scene="article", seed=0, rate=60)], tmp_path / "mouse.jsonl")
    return tmp_path


@pytest.mark.parametrize("command", [command for command in COMMANDS if command not in SET_UP])
def test_every_command_runs(command: str, folder: Path) -> None:
    assert command.startswith("sandbox ")
    run = subprocess.run([sys.executable, "-m", *command.split()], capture_output=True, text=True, check=False)
    assert (run.returncode, said(run.stderr)) == (0, "")
    for written in re.findall(r"--(?:out|json|csv|report) (\S+)", command):
        assert (folder / written).stat().st_size > 0


def test_the_set_up_lines_are_those_that_ci_runs() -> None:
    assert len(SET_UP) == 2
    script = (ROOT / ".ci" / "run").read_text().splitlines()
    assert set(SET_UP) <= set(script)


def test_the_comparison_is_what_the_command_prints(folder: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "sandbox", "compare", "article"], capture_output=True, text=True, check=True
    )
    assert [line.rstrip() for line in run.stdout.splitlines()] == blocks("text")[0].splitlines()


def test_the_figures_of_the_engines_are_what_the_tool_prints(folder: Path) -> None:
    def left(scene: str) -> str:
        program = [sys.executable, "-m", "sandbox", "compare", scene, "--engines", "article", "--json", "-"]
        figures = json.loads(subprocess.run(program, capture_output=True, check=True).stdout)
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
    rows = [DRAG, *((control.shown, control.does) for control in CONTROLS)]
    assert "".join(f"| {keys} | {does} |\n" for keys, does in rows) in README


def test_the_layout_names_every_module() -> None:
    named = set(re.findall(r"^  (\w+)(?:\.py|/) ", blocks("text")[1], re.MULTILINE))
    there = {path.stem for path in (ROOT / "sandbox").iterdir() if not path.name.startswith("__")}
    assert named == there - {"scenes"}
