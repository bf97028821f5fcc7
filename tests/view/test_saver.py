"""What the window saves: scenes, pictures, recordings and inputs."""

import os
from pathlib import Path

import numpy as np
import pygame
import pytest
from PIL import Image
from window_driver import SMALL_SCENE, hover, pixels, point, press, run, shown

from sandbox.report.trajectory import simulate
from sandbox.run.inputs import load_inputs
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn
from sandbox.view.controls import Action
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def test_a_saved_scene_loads_to_the_balls_shown(window: Window, tmp_path: Path) -> None:
    run(window, 33)
    press(window, "save", "save")
    hover(window, point(window, 10, 10, pane=1))
    press(window, "save")
    files = sorted(tmp_path.glob("*.toml"), key=os.path.getmtime)
    assert {file.name for file in files} == {"test-0-000033.toml", "test-0-000033-2.toml", "test-0-000033-3.toml"}
    assert f"saved test-0-000033-3.toml in {tmp_path}: the balls as in impulse" in window.messages.text
    for file, pane in (("test-0-000033.toml", 0), ("test-0-000033-3.toml", 1)):
        start = spawn(load(tmp_path / file))
        assert [start.position.tobytes(), start.velocity.tobytes()] == shown(window)[2 * pane : 2 * pane + 2]


def test_a_saved_picture_is_what_the_window_shows(window: Window, tmp_path: Path) -> None:
    window.playback.step()
    window.draw()
    press(window, "F12")
    [file] = tmp_path.glob("*.png")
    assert file.name == "test-0-000001.png"
    assert np.array_equal(pixels(pygame.image.load(file)), pixels(window.screen))
    assert window.messages.text.endswith(f"saved {file.name} in {tmp_path}")


def test_what_was_done_is_saved_at_any_time_and_its_command_shows_the_same(window: Window, tmp_path: Path) -> None:
    run(window, 5)
    window.editor.set_velocity(1, (90.0, -60.0))
    run(window, 10)
    press(window, "j")
    file = tmp_path / "test-0-000015.jsonl"
    command = f"sandbox run test.toml --engines pymunk,impulse --inputs {file.name}"
    assert window.messages.text.endswith(f": {command}")
    inputs = load_inputs(file, window.scene)
    assert [one.do for one in inputs] == ["start", "velocity", "end"]
    for pane in window.view.panes:
        replay = simulate(window.scene, pane.name, steps=15, inputs=inputs)
        assert np.array_equal(replay.position[-1], pane.state.position)
    press(window, "j")
    assert (tmp_path / "test-0-000015-2.jsonl").read_bytes() == file.read_bytes()
    window.scenes.try_to_run(load("truths/corner"))
    press(window, "j")
    assert "sandbox run truths/corner --engines " in window.messages.text


def test_a_file_name_that_is_too_long_is_reported(tmp_path: Path) -> None:
    file = tmp_path / ("x" * 245 + ".toml")
    file.write_text(SMALL_SCENE)
    window = Window(load(file), None)
    window.frame(1 / 60)
    press(window, "F12")
    assert "cannot be written: File name too long" in window.messages.text
    window.notice.clear()
    press(window, "save")
    assert "cannot be written: File name too long" in window.messages.text
    press(window, "F9")
    window.frame(1 / 20)
    press(window, "F9")
    assert "cannot be written: File name too long" in window.messages.text
    assert list(tmp_path.iterdir()) == [file]


def test_a_recording_is_what_the_window_shows_at_the_scene_s_pace(
    window: Window, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.view.video.MAX_WAITING", 30)  # here, frames come faster than time passes
    window.frame(1 / 60)
    press(window, "F9")
    assert window.is_on(Action.RECORD)
    for _ in range(30):
        window.frame(1 / 60)
    press(window, "Space")
    window.frame(1 / 60)  # is not recorded
    last = pixels(window.screen)
    press(window, "Space")
    press(window, "F9")
    [file] = tmp_path.iterdir()
    with Image.open(file) as video:
        lasts = []
        for number in range(getattr(video, "n_frames", 0)):
            video.seek(number)
            lasts.append(video.info["duration"])
        recorded = np.asarray(video.convert("RGB")).swapaxes(0, 1)
    assert sum(lasts) == pytest.approx(500, abs=20)  # ms
    assert min(lasts) >= 40
    panes = slice(window.layout.top, window.layout.strip.y)
    assert (recorded[:, panes] != last[:, panes]).any(axis=2).mean() < 0.015
    assert window.messages.text.endswith(f"saved {file.name} in {tmp_path}")


def test_a_recording_of_a_paused_window_leaves_no_file(window: Window, tmp_path: Path) -> None:
    press(window, "Space", "F9")
    window.frame(1 / 60)
    press(window, "F9")
    assert "nothing was recorded" in window.messages.text
    assert not list(tmp_path.iterdir())


def test_a_resized_window_ends_the_recording(window: Window, tmp_path: Path) -> None:
    press(window, "F9")
    window.frame(1 / 20)
    window.screen = pygame.display.set_mode((700, 500))
    window.frame(1 / 60)
    assert window.recorder.seconds is None
    [file] = tmp_path.iterdir()
    with Image.open(file) as video:
        assert video.size != (700, 500)
