"""Other scenes are opened: by key, from files, and again when their file is edited."""

import os
from pathlib import Path

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame.event import Event
from window_driver import SMALL_SCENE, press, run, step

from sandbox.errors import SandboxError
from sandbox.report.trajectory import simulate
from sandbox.scene.files import bundled, load
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def test_restart_and_next_seed() -> None:
    window = Window(load("article"), None)
    run(window, 10)
    press(window, "r")
    assert window.view.session.lockstep.steps == 0
    assert np.array_equal(
        window.view.panes[0].state.position, simulate(load("article"), "article", steps=0).position[0]
    )
    press(window, "n")
    assert window.scene.seed == 1
    second = load("article").changed(seed=1)
    assert np.array_equal(window.view.panes[0].state.position, simulate(second, "article", steps=0).position[0])


def test_a_next_seed_beyond_the_largest_is_reported() -> None:
    window = Window(scene_of("radius = 20\nposition = [200, 300]", more="seed = 9223372036854775807"), None)
    press(window, "n")
    assert "seed must be less than" in window.messages.text


@pytest.mark.wide
def test_brackets_open_the_next_and_the_previous_bundled_scene() -> None:
    names = list(bundled())
    window = Window(load(names[0]), None)
    seen = []
    for _ in names:
        press(window, "]")
        seen.append(window.scene.name)
        window.draw()
    assert seen == [*names[1:], names[0]]
    press(window, "[")
    assert window.scene.name == names[-1]


def test_default_engines_run_a_scene_that_the_named_engine_refuses() -> None:
    names = list(bundled())
    window = Window(load("article"), ["article"])
    while window.scene.name != "bouncing":
        press(window, "]")
    assert window.view.session.names == ["pymunk", "impulse"]
    assert "article: gravity and elasticity below 1" in window.messages.text
    press(window, "]")
    assert window.scene.name == names[names.index("bouncing") + 1]
    assert window.view.session.names == ["article"]


def test_a_scene_that_cannot_start_is_reported_and_the_current_one_keeps_running(window: Window) -> None:
    tight = "radius = 99\ncount = 4\ninside = [[0, 0], [400, 400]]"  # a lattice at best, and that is too wide
    with pytest.raises(SandboxError, match="there is no room for"):
        Window(scene_of(tight), None)
    window.playback.step()
    window.scenes.try_to_run(scene_of(tight))
    assert window.view.session.lockstep.steps == 1
    assert "there is no room for" in window.messages.text


def test_a_dropped_file_is_opened_and_errors_of_a_broken_one_are_shown(
    window: Window, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(SMALL_SCENE)
    window.on_event(Event(pygame.DROPFILE, file=str(file)))
    assert window.scene.arena.size == (90, 90)
    run(window, 4)
    broken = tmp_path / "broken.toml"
    broken.write_text(SMALL_SCENE.replace("5", "-5"))
    cards: list[object] = []
    monkeypatch.setattr("sandbox.view.cards.draw_error_card", lambda *given: cards.append(given[-1]))
    window.on_event(Event(pygame.DROPFILE, file=str(broken)))
    assert (step(window), window.scene.arena.size) == (4, (90, 90))
    for _ in range(2):
        window.draw()
        press(window, "Esc")
    assert cards == [f"{broken}:4: balls[0].radius must be greater than 0, got -5"]
    assert window.running


def test_of_many_errors_the_first_are_shown_and_the_number_of_others(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    monkeypatch.setattr("sandbox.view.cards.card", lambda _, lines, *__: shown.extend(line for [line] in lines))
    window.scenes.error = "\n".join(f"mine.toml:{k}: {'k' * 500_000 if k == 3 else 'is wrong'}" for k in range(100))
    window.draw()
    assert len(shown) == 9
    assert shown[1:4] == [f"mine.toml:{k}: is wrong" for k in range(3)]
    assert 92 < int(shown[-1].removeprefix("and ").removesuffix(" more lines")) < 110


def test_edits_of_the_open_file_are_run_and_broken_ones_leave_the_current_scene(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    text = 'title = "{}"\n[arena]\nsize = [800, 600]\n[[balls]]\nradius = {}\nposition = [100, 100]\n'
    file.write_text(text.format("first", 5))
    window = Window(load(file), None)
    running = "first"
    for k in range(8):
        broken = k % 4 == 2
        file.write_text(text.format(f"edit {k}", -5 if broken else 6 + k))
        window.scenes._next_check = 0.0
        assert window.scenes.reload_if_edited()
        running = running if broken else f"edit {k}"
        assert window.scene.title == running
        assert bool(window.scenes.error) == broken
        run(window, 2)
        assert step(window) >= 2
        assert not window.scenes.reload_if_edited()


def test_touching_or_briefly_removing_an_open_file_is_no_edit(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(SMALL_SCENE)
    window = Window(load(file), None)

    def is_edited() -> bool:
        window.scenes._next_check = 0.0
        return window.scenes.reload_if_edited()

    os.utime(file, ns=(1, 1))
    assert not is_edited()
    file.unlink()
    assert not is_edited()
    file.write_text(SMALL_SCENE)
    assert not is_edited()
    file.write_text(SMALL_SCENE.replace("[9, 9]", "[60, 60]"))
    assert is_edited()
    assert not is_edited()
