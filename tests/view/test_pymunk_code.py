"""A scene copied as a program for Pymunk moves its balls to the same bits as the engine `pymunk`."""

from pathlib import Path

import numpy as np
import pytest
from conftest import scene_of
from window_driver import press, run

from sandbox.run.trajectory import simulate
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn
from sandbox.view.pymunk_code import pymunk_code
from sandbox.view.window import Window

SCENES = ["article", "billiards", "bouncing", "funnel", "gas-100", "marble-run", "newtons-cradle", "pile"]


def positions_of(code: str, steps: int) -> np.ndarray:
    """Run a program for some steps; return where its balls are then: (n, 2) px."""
    names: dict[str, object] = {"__name__": "program"}
    exec(compile(code, "program.py", "exec"), names)
    for _ in range(steps):
        names["step"]()  # type: ignore[operator]
    bodies = names["space"].bodies  # type: ignore[attr-defined]
    return np.array([tuple(body.position) for body in bodies if body.body_type == body.DYNAMIC])


@pytest.mark.parametrize("name", SCENES)
def test_the_program_moves_the_balls_to_the_same_bits(name: str) -> None:
    scene = load(name)
    steps = 90
    expected = simulate(scene, "pymunk", steps=steps).position[-1]
    assert positions_of(pymunk_code(scene, spawn(scene)), steps).tobytes() == expected.tobytes()


def test_settings_substeps_joined_walls_and_spin_are_kept() -> None:
    joined = "\n".join(
        f"[[walls]]\nfrom = [{x}, {500 + x / 10}]\nto = [{x + 100}, {510 + x / 10}]\njoined = true" for x in (100, 200)
    )
    scene = scene_of(
        "radius = 20\nposition = [150, 450]\nvelocity = [90, 10]\nspin = 5\nfriction = 0.4",
        "radius = 15\nmass = 3\nposition = [200, 400]\nelasticity = 0.6",
        more=f'gravity = [30, 500]\ntitle = "A \\"title\\""\n{joined}\n[pymunk]\nsubsteps = 3\niterations = 4\n'
        "walls_first = 1\ncollision_slop = 0.2",
    )
    expected = simulate(scene, "pymunk", steps=60).position[-1]
    assert positions_of(pymunk_code(scene, spawn(scene)), 60).tobytes() == expected.tobytes()


def test_the_program_is_short() -> None:
    code = pymunk_code(load("article"), spawn(load("article")))
    assert len(code.splitlines()) < 65
    assert max(map(len, code.splitlines())) <= 160


def test_a_key_copies_it_from_the_step_shown(memory_screen: None, monkeypatch: pytest.MonkeyPatch) -> None:
    copied: list[str] = []

    def copy(text: str) -> bool:
        copied.append(text)
        return True

    monkeypatch.setattr("sandbox.view.saver._copy", copy)
    window = Window(load("article"), None)
    run(window, 30)
    press(window, "q")
    assert copied == [pymunk_code(window.view.moment.scene, window.view.panes[0].state)]
    assert "copied: the balls" in window.status


def test_without_a_clipboard_it_is_saved(
    memory_screen: None, working_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.view.saver._copy", lambda _: False)
    window = Window(load("article"), None)
    press(window, "q")
    [file] = working_folder.glob("*.py")
    assert file.read_text() == pymunk_code(window.scene, window.view.panes[0].state)
