"""Recorded inputs: the file has what was recorded, and errors in it name their lines."""

import json
from pathlib import Path

import pytest
from conftest import NO_KEY, scene_of

from sandbox.errors import SandboxError
from sandbox.run.inputs import End, Grab, Input, Kick, Move, Release, Start, load_inputs, write_inputs
from sandbox.scene.model import Scene

RECORDED: list[Input] = [
    Start(scene="article", seed=3, rate=240),
    Grab(step=12, ball=1, at=(0.1, 1 / 3)),
    Move(step=12, at=(-5, 1e8)),
    Release(step=40),
    Kick(step=45, ball=1, velocity=(0, -200)),
    End(step=95),
]
LINES = """\
{"step":0,"do":"start","scene":"article","seed":3,"rate":240}
{"step":12,"do":"grab","ball":1,"at":[0.1,0.3333333333333333]}
{"step":12,"do":"move","at":[-5.0,1e8]}
{"step":40,"do":"release"}
{"step":45,"do":"kick","ball":1,"velocity":[0.0,-200.0]}
{"step":95,"do":"end"}
"""


def two_balls() -> Scene:
    return scene_of("radius = 20\ngrid = [2, 1]\nspacing = 100")


def test_inputs_are_read_as_they_were_written(tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    write_inputs(RECORDED, path)
    assert load_inputs(path, two_balls()) == RECORDED
    assert [json.loads(line) for line in path.read_text().splitlines()] == [
        json.loads(line) for line in LINES.splitlines()
    ]


KINDS = (
    "start, grab, move, release, kick, add, change, delete, velocity, add-wall, change-wall, delete-wall, "
    "elasticity, gravity, rate, end"
)
BAD_INPUTS = {
    "Invalid JSON: EOF while parsing an object at line 1 column 10": '{"step": 0',
    f'must be an object with "do" as one of {KINDS}, got [1]': "[1]",
    f'must be an object with "do" as one of {KINDS}, got {{"do": "grabb"}}': '{"do": "grabb"}',
    "step must be at least 0, got -1": '{"step": -1, "do": "release"}',
    "step is missing": '{"do": "release"}',
    "ball must be at most 1, got 2": '{"step": 9, "do": "grab", "ball": 2, "at": [1, 2]}',
    "at[0] must be a finite number, got nan": '{"step": 9, "do": "move", "at": [NaN, 2]}',
    'at must be a list in brackets, got "x"': '{"step": 9, "do": "move", "at": "x"}',
    f"bal {NO_KEY}; known are do, step": '{"step": 9, "do": "release", "bal": 3}',
    "start must come before all other inputs": '{"step": 0, "do": "start", "scene": "x", "seed": 0, "rate": 1}',
    "Invalid JSON: recursion limit exceeded at line 1 column 202": "[" * 100_000,
    f'must be an object with "do" as one of {KINDS}, got {{"do": {"[" * 30}...': f'{{"do": {"[" * 100}{"]" * 100}}}',
    "wall must be the number of one of the scene's 0 own walls, got 0": '{"step": 9, "do": "delete-wall", "wall": 0}',
    "thickness must be greater than 0 where to is the same point as from": (
        '{"step": 9, "do": "add-wall", "from": [9, 9], "to": [9, 9], "thickness": 0}'
    ),
    f"start {NO_KEY}; known are do, elasticity, friction, from, joined, step, thickness, to": (
        '{"step": 9, "do": "add-wall", "from": [9, 9], "start": [9, 9], "to": [9, 99]}'
    ),
    "Invalid JSON: number out of range at line 1 column 4311": '{"step": ' + "9" * 5000 + "}",
    "step must be 0, got 3": '{"step": 3, "do": "start", "scene": "x", "seed": 0, "rate": 60}',
}


@pytest.mark.parametrize(("message", "line"), BAD_INPUTS.items(), ids=BAD_INPUTS)
def test_an_error_in_inputs_names_its_line(tmp_path: Path, line: str, message: str) -> None:
    path = tmp_path / "inputs.jsonl"
    path.write_text('{"step": 0, "do": "release"}\n' + line + "\n")
    with pytest.raises(SandboxError) as caught:
        load_inputs(path, two_balls())
    assert str(caught.value) == f"{path}:2: {message}"


def test_all_errors_in_inputs_are_reported_at_once(tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    path.write_text(
        '{"step": 5, "do": "release"}\n{"step": 4, "do": "release"}\n{"step": 6, "do": "end", "at": 1, "ball": 2}\n'
        '{"step": 5, "do": "grab", "ball": 2, "at": [0, 0]}\n'
    )
    with pytest.raises(SandboxError) as caught:
        load_inputs(path, two_balls())
    assert str(caught.value).splitlines() == [
        f"{path}:2: step must be at least 5, got 4",
        f"{path}:3: at {NO_KEY}; known are do, step",
        f"{path}:3: ball {NO_KEY}; known are do, step",
        f"{path}:4: ball must be at most 1, got 2",
    ]


def test_the_first_hundred_errors_in_inputs_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    path.write_text("[1]\n" * 1000)
    with pytest.raises(SandboxError) as caught:
        load_inputs(path, two_balls())
    messages = str(caught.value).splitlines()
    assert messages[99].startswith(f"{path}:100: must be an object")
    assert messages[100:] == [f"{path}: has more than these 100 errors"]
