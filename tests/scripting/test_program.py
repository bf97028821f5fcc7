"""Programs on trial: they run as `python game.py` would, and every Space that they step has a diagnosis at the end."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pymunk.pygame_util
import pytest
from conftest import Command

from sandbox.scripting.program import CALLS, NAMES, Clock, hint

SPACE = """
import sys, pymunk
def make_space(moment=10, space=None):
    space = space or pymunk.Space()
    space.gravity = 0, 900
    body = pymunk.Body(1, moment)
    body.position = 100, 100
    disc = pymunk.Circle(body, 20)
    disc.friction = 0.5
    space.add(body, disc)
    return space
space = make_space()
"""
ADDED = 10  # the line of `space.add`
WALL = "wall = pymunk.Segment(space.static_body, (0, 300), (200, 300), 5)\nspace.add(wall)\n"
STEPS = "for _ in range(30):\n    space.step(1 / 60)\n"


def write(folder: Path, rest: str, name: str = "game.py") -> Path:
    file = folder / name
    file.write_text(SPACE + rest)
    return file


def diagnoses(command: Command, *arguments: object, code: int = 0) -> dict[str, Any]:
    """Return the JSON of a program on trial; what it prints goes to standard error."""
    ended, out, err = command("watch", "--json", "-", *arguments)
    assert ended == code, err
    document: dict[str, Any] = json.loads(out)
    return document


def rules(space: dict[str, Any]) -> list[str]:
    return [finding["rule"] for finding in space["findings"]]


def watch(folder: Path, *options: str) -> str:
    """Return what a process of its own prints of a program that it ends after 1 s; on standard error, it is nothing."""
    program = [sys.executable, "-m", "sandbox", "watch", "--seconds", "1", *options, "game.py"]
    ran = subprocess.run(program, cwd=folder, capture_output=True, text=True, timeout=60, check=True)
    assert ran.stderr == ""
    return ran.stdout


def test_a_program_has_its_arguments_its_folder_and_its_name(working_folder: Path, command: Command) -> None:
    (working_folder / "deep").mkdir()
    (working_folder / "deep" / "beside.py").write_text("word = 'imported'\n")
    write(
        working_folder,
        "import beside, os\nprint(sys.argv, __name__, beside.word, 'PYTHONSAFEPATH' in os.environ)\n" + STEPS,
        "deep/game.py",
    )
    code, out, err = command("watch", "deep/game.py", "--level", "3", "-m")
    assert (code, err) == (0, "")
    assert out.startswith("['deep/game.py', '--level', '3', '-m'] __main__ imported False\n")
    assert f"Space 1, stepped in {Path('deep/game.py')}:" in out
    assert f"added in {Path('deep/game.py')}:{ADDED}:" in out.replace("\n     ", " ")
    assert "moment 10, 20 times too small" in out.replace("\n     ", " ")


def test_the_patches_are_gone_afterwards(working_folder: Path, command: Command) -> None:
    before = pymunk.Space.step, pymunk.Space.add, os._exit, time.sleep, sys.argv[:], sys.path[:]
    write(working_folder, STEPS)
    assert command("watch", "--headless", "game.py")[0] == 0
    assert (pymunk.Space.step, pymunk.Space.add, os._exit, time.sleep) == before[:4]
    assert sys.path == before[5]


WAYS_TO_STEP = {
    "bound": "step = space.step\nfor _ in range(30):\n    step(dt=1 / 60)\n",
    "subclass": """
class Mine(pymunk.Space):
    def step(self, dt):
        super().step(dt / 2)
        super().step(dt / 2)
space = make_space(space=Mine())
mine = space
for _ in range(15):
    mine.step(1 / 30)
""",
    "replaced": f"old = pymunk.Space.step\npymunk.Space.step = lambda self, dt: old(self, dt)\n{STEPS}",
    "thread": "import threading\nthreading.Thread(target=lambda: [space.step(1 / 60) for _ in range(30)]).start()\n",
    "threaded": f"""
space = make_space(space=pymunk.Space(threaded=True))
space.threads = 2
{STEPS}
""",
}


@pytest.mark.parametrize("rest", WAYS_TO_STEP.values(), ids=WAYS_TO_STEP)
def test_every_way_to_step_is_recorded(working_folder: Path, command: Command, rest: str) -> None:
    write(working_folder, rest)
    (space,) = diagnoses(command, "game.py")["spaces"]
    assert (space["steps"], space["seconds"]) == (30, pytest.approx(0.5))
    assert rules(space) == ["moment"]


@pytest.mark.parametrize(
    ("rest", "code", "how", "message"),
    [
        ("exit()", 0, "exit", ""),
        ("sys.exit(3)", 3, "exit", ""),
        ("sys.exit('no level')", 1, "exit", "no level\n"),
        ("raise KeyError('x')", 1, "exception", "KeyError: 'x'\n"),
        ("raise KeyboardInterrupt", 0, "interrupted", ""),
    ],
)
def test_the_end_of_a_program_is_kept(
    working_folder: Path, command: Command, rest: str, code: int, how: str, message: str
) -> None:
    write(working_folder, f"{STEPS}    {rest}\n")
    ended, out, err = command("watch", "--json", "-", "game.py")
    document = json.loads(out)
    assert (ended, document["ended_by"], document["exit_code"]) == (code, how, code)
    assert document["spaces"][0]["steps"] == 1
    assert err.endswith(message)


def test_a_space_that_is_no_number_from_the_start_is_a_json_document(working_folder: Path, command: Command) -> None:
    write(working_folder, f"next(iter(space.bodies)).velocity = float('nan'), 0\n{STEPS}")
    [space] = diagnoses(command, "game.py")["spaces"]
    assert "not-finite" in rules(space)
    assert space["energy"] is None or space["energy"]["start"] is None
    assert "Its energy is not a number." in command("watch", "game.py")[1]


def test_a_traceback_has_no_line_of_the_sandbox(working_folder: Path, command: Command) -> None:
    write(working_folder, "space.add(pymunk.Body())\nspace.step(1 / 60)\n")
    code, out, err = command("watch", "game.py")
    assert code == 1
    assert "Space 1, " in out
    files = [line.partition('"')[2].partition('"')[0] for line in err.splitlines() if line.startswith("  File")]
    assert [Path(file).name for file in files] == ["game.py", "space.py"]


def test_the_time_of_a_space_ends_a_program(working_folder: Path, command: Command) -> None:
    write(working_folder, "while True:\n    try:\n        space.step(1 / 60)\n    finally:\n        pass\n")
    document = diagnoses(command, "--seconds", "2", "game.py")
    assert document["ended_by"] == "time is up"
    assert document["spaces"][0]["steps"] == 120
    write(working_folder, "while True:\n    space.step(16)\n")  # ms
    assert diagnoses(command, "--seconds", "2", "game.py")["spaces"][0]["steps"] == 40


@pytest.mark.wide
def test_the_time_ends_a_space_in_a_thread(working_folder: Path) -> None:
    write(
        working_folder,
        "import threading\ndef run():\n    while True:\n        space.step(1 / 60)\n"
        "t = threading.Thread(target=run)\nt.start()\nt.join()\n",
    )
    document = json.loads(watch(working_folder, "--json", "-"))
    assert (document["ended_by"], document["spaces"][0]["steps"]) == ("time is up", 60)


@pytest.mark.wide
@pytest.mark.parametrize("waits", ["t.join()", "time.sleep(99)", "threading.Event().wait()"])
def test_a_program_that_steps_in_a_thread_ends_in_its_own_way(working_folder: Path, waits: str) -> None:
    write(
        working_folder,
        "import pathlib, threading, time\ndef run():\n    while True:\n        space.step(1 / 60)\n"
        "t = threading.Thread(target=run, daemon=True)\nt.start()\n"
        f"try:\n    {waits}\nfinally:\n    pathlib.Path('saved').touch()\n",
    )
    watch(working_folder)
    assert (working_folder / "saved").exists()


@pytest.mark.wide
def test_threads_that_never_end_are_ended_with_the_diagnosis(working_folder: Path) -> None:
    write(
        working_folder,
        "import threading\ndef run(own):\n    while True:\n        try:\n            own.step(1 / 60)\n"
        "        except BaseException:\n            pass\n"
        "for _ in range(3):\n    threading.Thread(target=run, args=(make_space(),)).start()\n",
    )
    assert "moment 10, 20 times" in watch(working_folder)


def test_without_a_window_nothing_waits_before_the_first_step(working_folder: Path, command: Command) -> None:
    write(working_folder, "import time\ntime.sleep(3)\nspace.step(1 / 60)\n")
    document = diagnoses(command, "--headless", "--no-tries", "--seconds", "2", "game.py")
    assert (document["ended_by"], document["spaces"]) == ("time is up", [])


def test_a_step_that_pymunk_refuses_is_refused(working_folder: Path, command: Command) -> None:
    write(working_folder, "space.step('0.016')\n")
    code, _, err = command("watch", "game.py")
    assert code == 1
    assert "TypeError: must be real number, not str" in err


@pytest.mark.parametrize(
    ("number", "code", "catches", "steps"),
    [
        (signal.SIGINT, 0, "KeyError", True),
        pytest.param(signal.SIGTERM, 143, "KeyError", True, marks=pytest.mark.wide),
        pytest.param(signal.SIGTERM, 0, "BaseException", True, marks=pytest.mark.wide),
        pytest.param(signal.SIGTERM, 0, "BaseException", False, marks=pytest.mark.wide),
    ],
    ids=["Ctrl-C", "kill", "kill what steps on", "kill what waits on"],
)
def test_a_signal_gives_the_diagnosis(working_folder: Path, number: int, code: int, catches: str, steps: bool) -> None:
    write(
        working_folder,
        "import time\nspace.step(1 / 60)\nprint('go', flush=True)\nwhile True:\n    try:\n"
        f"        {'space.step(1 / 60)' * steps}\n        time.sleep(0.01)\n    except {catches}:\n        pass\n",
    )
    program = [sys.executable, "-m", "sandbox", "watch", "game.py"]
    with subprocess.Popen(program, cwd=working_folder, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stdout.readline() == "go\n"
        time.sleep(0.2)
        process.send_signal(number)
        out = process.stdout.read()
    assert process.returncode == code
    assert "moment 10, 20 times" in out


def test_each_space_has_its_diagnosis(working_folder: Path, command: Command) -> None:
    many = "many = [make_space() for _ in range(20)]\nfor each in many:\n    each.step(1 / 60)\n    each.step(1 / 60)\n"
    write(working_folder, f"{STEPS}space = make_space(200)\n{STEPS}{many}")
    document = diagnoses(command, "game.py")
    assert [rules(space) for space in document["spaces"][:3]] == [["moment"], [], ["moment"]]
    assert len(document["spaces"]) == 10
    assert "Only the first 10 Spaces of a program have a diagnosis." in command("watch", "game.py")[1]


def test_no_space_is_one_clear_message(working_folder: Path, command: Command) -> None:
    write(working_folder, "")
    code, out, err = command("watch", "game.py")
    assert (code, out, err) == (0, "game.py stepped no pymunk.Space: there is nothing to diagnose.\n", "")


def test_headless_programs_neither_wait_nor_need_a_display(working_folder: Path, command: Command) -> None:
    write(
        working_folder,
        "import pygame, time\nscreen = pygame.display.set_mode((200, 200))\nclock = pygame.time.Clock()\n"
        "while True:\n    space.step(1 / 60)\n    pygame.display.flip()\n    clock.tick(60)\n    time.sleep(0.1)\n",
    )
    document = diagnoses(command, "--headless", "--seconds", "3", "game.py")
    assert document["spaces"][0]["steps"] == 180


def test_only_the_thread_that_steps_does_not_wait(working_folder: Path, command: Command) -> None:
    """Others, and Python's library, would count minutes in no time: no step would be done."""
    write(
        working_folder,
        "import subprocess, threading, time\nsubprocess.run(['sleep', '0.1'], timeout=9)\n"
        "def music():\n    while True:\n        time.sleep(0.1)\n"
        f"threading.Thread(target=music, daemon=True).start()\ntime.sleep(0.05)\n{STEPS}    time.sleep(0.1)\n",
    )
    document = diagnoses(command, "--headless", "--seconds", "1", "game.py")
    assert document["spaces"][0]["steps"] == 30


def test_a_headless_program_that_steps_nothing_ends(working_folder: Path, command: Command) -> None:
    write(working_folder, "import pygame\nclock = pygame.time.Clock()\nwhile True:\n    clock.tick(60)\n")
    code, out, _ = command("watch", "--headless", "game.py")
    assert (code, "stepped no pymunk.Space" in out) == (0, True)


def test_the_clock_without_waiting_keeps_time() -> None:
    waited: list[float] = []
    clock = Clock(waited.append)
    assert sum(clock.tick(60) for _ in range(60)) == pytest.approx(1000, abs=1)
    assert sum(waited) == pytest.approx(1)


OLD_CALLS = {
    "space.shapes[0], space.bodies.append(body)": ("space.shapes[0]", "space.bodies.append(body)", "body.shapes.pop()"),
    "for shape in space.shapes: space.remove(shape)": ("for shape in space.shapes: space.remove(shape)",),
    "pymunk.Body(), dynamic and without mass or moment": (
        "space.add(pymunk.Body()); space.step(1 / 60)",
        "body.mass = 0",
    ),
    "Vec2d(pair)": ("Vec2d((1, 2))",),
    "Vec2d()": ("Vec2d()",),
    "vector.x = 1, vector[0] = 1, box.left = 1": (
        "body.position.x += 3",
        "body.position[0] = 3",
        "body.velocity.length = 3",
        "shape.bb.left = 3",
    ),
    "vector * vector, vector + 1, vector ** 2, ~vector": (
        *("body.position * body.position", "body.position + 1", "body.position**2", "~body.position"),
        *("1 / body.position", "body.position % 2"),
    ),
    "space.add([body, shape])": ("space.add([pymunk.Body(1, 1)])", "space.remove((shape,))"),
    "space.add(shape), before its body": ("space.add(pymunk.Circle(pymunk.Body(1, 1), 5))",),
    "pymunk.Poly(body, vertices, offset=(x, y))": ("pymunk.Poly(body, [(0, 0), (1, 0), (0, 1)], offset=(1, 1))",),
}


def raised_by(line: str) -> BaseException:
    """Return what a line of a program raises."""
    names: dict[str, Any] = {"np": np, "Vec2d": pymunk.Vec2d}
    exec(f"{SPACE}import pymunk.autogeometry\n[body], [shape] = space.bodies, space.shapes\n", names)
    with pytest.raises(Exception) as raised:  # noqa: PT011  (whatever Pymunk raises)
        exec(line, names)
    return raised.value


def test_every_old_call_is_named_with_what_replaces_it() -> None:
    assert OLD_CALLS.keys() == CALLS.keys()
    for call, lines in OLD_CALLS.items():
        for line in lines:
            assert f": {call}. Instead: {CALLS[call]['instead']}." in hint(raised_by(line)), line


OBJECTS = {"Space": "space", "Body": "body", "Vec2d": "body.position", "Shape": "shape"}


@pytest.mark.parametrize("name", NAMES)
def test_every_name_that_pymunk_dropped_is_missing_and_has_its_replacement(name: str) -> None:
    owner, _, missing = name.rpartition(".")
    lines = (
        [f"{OBJECTS[owner]}.{missing}"] if owner in OBJECTS else [f"from {owner} import {missing}", f"import {name}"]
    )
    if not owner:
        lines = [f"import {name}"]
    for line in lines:
        error = raised_by(line)
        if "is not a package" not in str(error):
            assert hint(error).startswith(f"Pymunk has had no {name} since version {NAMES[name]['since']}. Instead: ")


def test_every_name_in_a_replacement_exists() -> None:
    names: dict[str, Any] = {}
    exec(f"{SPACE}import pymunk.constraints, pymunk.pygame_util\n[body], [shape] = space.bodies, space.shapes\n", names)
    for change in (*NAMES.values(), *CALLS.values()):
        for owner, name in re.findall(r"\b(space|body|shape|pymunk)\.(?!pyglet)(\w+)", change["instead"]):
            assert hasattr(names[owner], name), change
    for vector in re.findall(r"\bv\.(\w+)", " ".join(change["instead"] for change in NAMES.values())):
        assert hasattr(pymunk.Vec2d, vector)


@pytest.mark.wide
def test_a_program_that_pymunk_aborts_is_shown_with_its_line(working_folder: Path) -> None:
    write(working_folder, "body = pymunk.Body(float('inf'), 1)\n")
    command = [sys.executable, "-m", "sandbox", "watch", "game.py"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode < 0
    assert "Mass must be positive and finite." in ended.stderr
    assert f'game.py", line {ADDED + 3} in <module>' in ended.stderr


def test_other_errors_have_no_hint() -> None:
    for error in (AttributeError("x"), KeyError(3), ImportError("no"), TypeError("1 + None")):
        assert hint(error) == ""


def test_the_hint_comes_after_the_traceback(working_folder: Path, command: Command) -> None:
    write(working_folder, "space.add_collision_handler(0, 1)\n")
    code, out, err = command("watch", "game.py")
    assert code == 1
    assert "stepped no pymunk.Space" in out
    assert err.index("AttributeError: ") < err.index("Pymunk has had no Space.add_collision_handler since version 7.")


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("no.py", "no.py: does not exist"),
        ("scene.toml", "scene.toml: is a scene, not a program; sandbox compare scene.toml compares engines"),
        (".", ".: cannot be run: can't find '__main__' module in '.'"),
        ("syntax.py", "syntax.py: cannot be run: '(' was never closed (syntax.py, line 2)"),
        ("binary.py", "binary.py: cannot be run: source code string cannot contain null bytes"),
    ],
)
def test_what_is_no_program_is_refused(working_folder: Path, command: Command, program: str, message: str) -> None:
    (working_folder / "syntax.py").write_text("import pymunk\nspace = pymunk.Space(\n")
    (working_folder / "binary.py").write_bytes(b"\0ELF")
    assert command("watch", program) == (2, "", f"{message}\n")


@pytest.mark.parametrize("line", ["import syntax", "import nosuchmodule", "compile('(', 'text', 'exec')"])
def test_a_program_that_imports_what_is_none_has_its_traceback(
    working_folder: Path, command: Command, line: str
) -> None:
    (working_folder / "syntax.py").write_text("import pymunk\nspace = pymunk.Space(\n")
    write(working_folder, f"{line}\n")
    code, _, err = command("watch", "game.py")
    assert (code, f'game.py", line {ADDED + 3}, in <module>' in err, "runpy" in err) == (1, True, False)


def test_options_after_the_program_are_its_own(working_folder: Path, command: Command) -> None:
    write(working_folder, "")
    _, _, err = command("watch", "game.py", "--headless")
    assert err == "--headless goes to game.py; options of watch come before the program\n"
