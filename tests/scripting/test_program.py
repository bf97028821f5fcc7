"""Programs on trial: they run as `python game.py` would, and every Space that they step has a diagnosis at the end."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pymunk
import pytest
from conftest import Command

from sandbox.scripting.headless import Clock
from sandbox.scripting.hints import hint

SPACE = """
import sys, pymunk
def make_space(moment=10):
    space = pymunk.Space()
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
mine = Mine()
mine.add(pymunk.Body(1, 1))
for _ in range(15):
    mine.step(1 / 30)
""",
    "replaced": f"old = pymunk.Space.step\npymunk.Space.step = lambda self, dt: old(self, dt)\n{STEPS}",
    "thread": "import threading\nthreading.Thread(target=lambda: [space.step(1 / 60) for _ in range(30)]).start()\n",
    "threaded": f"""
space = pymunk.Space(threaded=True)
space.threads = 2
space.add(pymunk.Body(1, 1))
{STEPS}
""",
}


@pytest.mark.parametrize("rest", WAYS_TO_STEP.values(), ids=WAYS_TO_STEP)
def test_every_way_to_step_is_recorded(working_folder: Path, command: Command, rest: str) -> None:
    write(working_folder, rest)
    (space,) = diagnoses(command, "game.py")["spaces"]
    assert (space["steps"], space["seconds"]) == (30, pytest.approx(0.5))
    assert set(rules(space)) & {"moment", "no-shape"}


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
    if how == "exception":
        assert err.startswith("Traceback (most recent call last):\n")
        assert f'File "{working_folder / "game.py"}", line' in err or 'File "game.py", line' in err
        assert "runpy" not in err
        assert "sandbox" not in err


def test_a_traceback_has_no_line_of_the_sandbox(working_folder: Path, command: Command) -> None:
    write(working_folder, "space.add(pymunk.Body())\nspace.step(1 / 60)\n")
    code, out, err = command("watch", "game.py")
    assert code == 1
    assert "its mass is 0" in out.replace("\n     ", " ")
    files = [line.partition('"')[2].partition('"')[0] for line in err.splitlines() if line.startswith("  File")]
    assert [Path(file).name for file in files] == ["game.py", "space.py"]


def test_steps_of_no_length_are_named(working_folder: Path, command: Command) -> None:
    write(working_folder, "space.step(0)\n")
    space = diagnoses(command, "game.py")["spaces"][0]
    assert (space["steps"], space["not_compared_because"]) == (1, "no step had a dt above 0")


def test_a_diagnosis_comes_before_os_exit(working_folder: Path) -> None:
    write(working_folder, STEPS + "import os\nprint('last words', flush=True)\nos._exit(5)\n")
    program = [sys.executable, "-m", "sandbox", "watch", "game.py"]
    ran = subprocess.run(program, cwd=working_folder, capture_output=True, text=True, check=False)
    assert ran.returncode == 5
    assert ran.stdout.index("last words") < ran.stdout.index("moment 10, 20 times")


def test_the_time_of_a_space_ends_a_program(working_folder: Path, command: Command) -> None:
    write(working_folder, "while True:\n    try:\n        space.step(1 / 60)\n    finally:\n        pass\n")
    document = diagnoses(command, "--seconds", "2", "game.py")
    assert document["ended_by"] == "time is up"
    assert document["spaces"][0]["steps"] == 120


def test_the_time_ends_a_space_in_a_thread(working_folder: Path) -> None:
    write(
        working_folder,
        "import threading\ndef run():\n    while True:\n        space.step(1 / 60)\n"
        "t = threading.Thread(target=run)\nt.start()\nt.join()\n",
    )
    program = [sys.executable, "-m", "sandbox", "watch", "--seconds", "1", "--json", "-", "game.py"]
    ran = subprocess.run(program, cwd=working_folder, capture_output=True, text=True, check=True)
    document = json.loads(ran.stdout)
    assert (document["ended_by"], document["spaces"][0]["steps"], ran.stderr) == ("time is up", 60, "")


def test_ctrl_c_gives_the_diagnosis(working_folder: Path) -> None:
    write(
        working_folder,
        "import time\nprint('go', flush=True)\nwhile True:\n    space.step(1 / 60)\n    time.sleep(0.01)\n",
    )
    program = [sys.executable, "-m", "sandbox", "watch", "game.py"]
    with subprocess.Popen(program, cwd=working_folder, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stdout.readline() == "go\n"
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        out = process.stdout.read()
    assert process.returncode == 0
    assert "moment 10, 20 times" in out


def test_a_module_runs_from_the_working_directory(working_folder: Path, command: Command) -> None:
    (working_folder / "pack").mkdir()
    write(working_folder, "print(sys.argv[1:], __name__, __package__)\n" + STEPS, "pack/play.py")
    code, out, _ = command("watch", "-m", "pack.play", "a", "--b")
    assert code == 0
    assert out.startswith("['a', '--b'] __main__ pack\n")
    assert "Space 1, " in out


def test_each_space_has_its_diagnosis(working_folder: Path, command: Command) -> None:
    many = "many = [make_space() for _ in range(20)]\nfor each in many:\n    each.step(1 / 60)\n    each.step(1 / 60)\n"
    write(working_folder, f"{STEPS}space = make_space(200)\n{STEPS}{many}")
    document = diagnoses(command, "game.py")
    assert [rules(space) for space in document["spaces"][:3]] == [["moment"], [], ["moment"]]
    assert len(document["spaces"]) == 10
    assert document["other_spaces"] == 12


def test_a_space_of_discs_and_walls_is_compared_with_exact(working_folder: Path, command: Command) -> None:
    write(working_folder, "space = make_space(200)\n" + STEPS)
    document = diagnoses(command, "game.py")
    comparison = document["spaces"][0]["comparison"]
    assert comparison["engines"]["space"]["ledger"].keys() == {"gravity"}
    code, out, _ = command("watch", "game.py")
    assert (code, "each step ends 0.125 px short of the parabola" in out.replace("\n", " ")) == (0, True)
    code, _, err = command("watch", "--max-gap", "0.5", "game.py")
    assert code == 1
    assert "Space 1: space: gap" in err
    assert command("watch", "--max-gap", "50", "game.py")[0] == 0


def test_a_limit_that_cannot_be_checked_is_an_error(working_folder: Path, command: Command) -> None:
    write(working_folder, STEPS)
    code, _, err = command("watch", "--max-gap", "1", "game.py")
    assert code == 2
    assert "no limit can be checked" in err


def test_no_space_is_one_clear_message(working_folder: Path, command: Command) -> None:
    write(working_folder, "")
    code, out, err = command("watch", "game.py")
    assert (code, out, err) == (0, "game.py stepped no pymunk.Space: there is nothing to diagnose.\n", "")


WALL = "wall = pymunk.Segment(space.static_body, (0, 300), (200, 300), 5)\nspace.add(wall)\n"
SHOWN_BY_STEPS = {
    "dt-varies": "for dt in (0.016, 0.017, 0):\n    space.step(dt)\n",
    "dt-long": "for _ in range(3):\n    space.step(0.05)\n",
    "dt-invalid": "space.step(-0.01)\n",
    "not-finite": f"{STEPS}    for b in space.bodies:\n        b.velocity = float('nan'), 0\n",
    "mass": "space.add(pymunk.Body())\ntry:\n    space.step(0.01)\nexcept AssertionError:\n    pass\n",
    "tunnelling": f"{WALL}for b in space.bodies:\n    b.velocity = 0, 1800\n{STEPS}",
    "mass-ratio": f"""
heavy = pymunk.Body(500, 1e5)
heavy.position, heavy.velocity, space.gravity = (100, 50), (0, 60), (0, 0)
space.add(heavy, pymunk.Circle(heavy, 20))
{STEPS}""",
    "static-moved": f"{WALL}{STEPS}    space.static_body.position += 0, 1\n",
}


@pytest.mark.parametrize("rule", SHOWN_BY_STEPS)
def test_what_steps_show_is_found(working_folder: Path, command: Command, rule: str) -> None:
    write(working_folder, SHOWN_BY_STEPS[rule])
    assert rule in rules(diagnoses(command, "game.py")["spaces"][0])
    write(working_folder, WALL + STEPS)
    assert rule not in rules(diagnoses(command, "game.py")["spaces"][0])


def test_a_friction_that_is_set_later_is_no_fault(working_folder: Path, command: Command) -> None:
    write(working_folder, WALL + STEPS)
    assert "friction-unused" in rules(diagnoses(command, "game.py")["spaces"][0])
    write(working_folder, f"{WALL}{STEPS}    wall.friction = 1\n")
    assert "friction-unused" not in rules(diagnoses(command, "game.py")["spaces"][0])


def test_headless_programs_neither_wait_nor_need_a_display(working_folder: Path, command: Command) -> None:
    write(
        working_folder,
        "import pygame, time\nscreen = pygame.display.set_mode((200, 200))\nclock = pygame.time.Clock()\n"
        "while True:\n    space.step(1 / 60)\n    pygame.display.flip()\n    clock.tick(60)\n    time.sleep(0.1)\n",
    )
    document = diagnoses(command, "--headless", "--seconds", "3", "game.py")
    assert document["spaces"][0]["steps"] == 180


def test_a_headless_program_that_steps_nothing_ends(working_folder: Path, command: Command) -> None:
    write(working_folder, "import pygame\nclock = pygame.time.Clock()\nwhile True:\n    clock.tick(60)\n")
    code, out, _ = command("watch", "--headless", "game.py")
    assert (code, "stepped no pymunk.Space" in out) == (0, True)


def test_the_clock_without_waiting_keeps_time() -> None:
    waited: list[float] = []
    clock = Clock(waited.append)
    assert sum(clock.tick(60) for _ in range(60)) == pytest.approx(1000, abs=1)
    assert sum(waited) == pytest.approx(1)


@pytest.mark.parametrize(
    ("line", "replacement"),
    [
        ("space.add_collision_handler(0, 1).begin = None", "space.on_collision("),
        ("space.add_default_collision_handler()", "space.on_collision("),
        ("pymunk.Vec2d(1, 2).rotate(1)", "v.rotated(angle)"),
        ("pymunk.Vec2d(1, 2).get_length()", "v.length"),
        ("pymunk.Vec2d((1, 2))", "Vec2d(*pair)"),
        ("pymunk.Body(pymunk.inf, 1)", "float('inf')"),
        ("from pymunk import inf", "float('inf')"),
        ("import pymunk.constraint", "pymunk.constraints"),
        ("space.shapes[0]", "list(space.shapes)"),
        ("[space.remove(s) for s in space.shapes]", "list(space.shapes)"),
        ("space.add([pymunk.Body(1, 1)])", "space.add(*objects)"),
        ("import pymunk.pygame_util as u; u.draw(None, space)", "space.debug_draw("),
        ("next(iter(space.bodies)).apply_impulse((1, 0))", "apply_impulse_at_local_point"),
        ("next(iter(space.bodies)).position.x = 3", "body.velocity = (x, y)"),
    ],
)
def test_calls_of_older_versions_are_named_with_what_replaces_them(line: str, replacement: str) -> None:
    names: dict[str, Any] = {}
    exec(SPACE, names)
    with pytest.raises(Exception) as raised:  # noqa: PT011  (whatever Pymunk raises)
        exec(line, names)
    assert replacement in hint(raised.value)


def test_other_errors_have_no_hint() -> None:
    for error in (AttributeError("x"), KeyError(3), ImportError("no"), TypeError("1 + None")):
        assert hint(error) == ""


def test_the_hint_comes_after_the_traceback(working_folder: Path, command: Command) -> None:
    write(working_folder, "space.add_collision_handler(0, 1)\n")
    code, out, err = command("watch", "game.py")
    assert code == 1
    assert "stepped no pymunk.Space" in out
    assert err.index("AttributeError: ") < err.index("has no Space.add_collision_handler, which older versions had.")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no.py"], "no.py: does not exist; for a module, write -m no"),
        (["scene.toml"], "scene.toml: is a scene, not a program; sandbox compare scene.toml compares engines"),
        (["."], ".: is a folder without __main__.py"),
    ],
)
def test_what_is_no_program_is_refused(
    working_folder: Path, command: Command, arguments: list[str], message: str
) -> None:
    assert command("watch", *arguments) == (2, "", f"{message}\n")


def test_options_after_the_program_are_its_own(working_folder: Path, command: Command) -> None:
    write(working_folder, "")
    _, _, err = command("watch", "game.py", "--headless")
    assert err == "--headless goes to game.py; options of watch come before the program\n"
