"""The scene picker, by keys and by mouse."""

import os
from pathlib import Path

import pygame
import pytest
from pygame.event import Event
from window_driver import SMALL_SCENE, drag, hover, pixels, press, run, step

from sandbox.scene.fields import rgb
from sandbox.scene.files import bundled, load
from sandbox.view.scene_picker import ScenePicker
from sandbox.view.theme import theme
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def open_picker(window: Window) -> ScenePicker:
    press(window, "/")
    window.draw()
    assert window.scenes.picker
    return window.scenes.picker


def test_typing_narrows_the_list_and_enter_runs_the_chosen_scene(window: Window) -> None:
    picker = open_picker(window)
    press(window, *"newton cradle", "Back")
    assert [entry.name for entry in picker.found] == [
        "newtons-cradle",
        "truths/cradle-gapped",
        "truths/cradle-touching",
    ]
    press(window, "Right", "Right", "Right", "Left", "Enter")
    assert window.scenes.picker is None
    assert window.scene.title == load("truths/cradle-gapped").title


def test_a_dropped_folder_s_scenes_are_listed_first(window: Window, tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "own.toml").write_text(SMALL_SCENE)
    window.on_event(Event(pygame.DROPFILE, file=str(folder)))
    window.draw()
    assert window.scenes.picker
    assert window.scenes.picker.found[0].name == "own.toml"
    press(window, "Enter")
    assert window.scene.name == "own"
    assert open_picker(window).found[0].name == "own.toml"


def test_what_the_chosen_scene_is_about_is_shown(window: Window) -> None:
    picker = open_picker(window)
    place = pygame.Rect(0, window.screen.get_height() - 40, window.screen.get_width(), 40)
    texts = []
    for _ in range(2):
        window.draw()
        texts.append(pixels(window.screen.subsurface(place)))
        press(window, "Right")
    assert picker.chosen == 2
    assert (texts[0] != texts[1]).any(axis=2).sum() > 500


def test_escape_closes_the_picker_and_the_run_continues(window: Window) -> None:
    run(window, 3)
    press(window, "open", *"xyzzy", "Enter", "Esc")
    assert window.scenes.picker is None
    assert (step(window), window.running, window.scene.name) == (3, True, "test")


@pytest.mark.parametrize("size", [(1024, 640), (1280, 800), (3840, 2160)])
def test_every_scene_can_be_reached_by_keys_and_no_previews_overlap(size: tuple[int, int], window: Window) -> None:
    window.screen = pygame.display.set_mode(size)
    picker = open_picker(window)
    everything = {*bundled(), *bundled("truths")}
    assert {entry.name for entry in picker.found} == everything
    seen = set()
    for _ in range(len(everything)):
        places = picker.places()
        for number, (index, place) in enumerate(places):
            seen.add(index)
            assert place.collidelist([other for _, other in places[number + 1 :]]) == -1
            assert window.screen.get_rect().contains(place)
        assert picker.chosen in dict(places)
        press(window, "Right")
    assert len(seen) == len(everything)


def test_a_click_runs_a_scene_and_its_preview_shows_it(window: Window) -> None:
    picker = open_picker(window)
    press(window, *"break-shot")
    window.draw()
    [(_, place)] = picker.places()
    assert tuple(window.screen.get_at((place.x + 3, place.y + place.height // 3)))[:3] == rgb("#14532d")
    assert tuple(window.screen.get_at((place.x - 4, place.bottom)))[:3] == tuple(theme.hover)[:3]
    drag(window, place.center, place.center)
    assert window.scene.name == "break-shot"


def test_the_wheel_scrolls_by_rows(window: Window) -> None:
    picker = open_picker(window)
    window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=-1))
    assert picker.chosen == picker.columns
    window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=9))
    assert picker.chosen == 0


def test_the_wheel_scrolls_while_the_mouse_is_on_a_preview(window: Window) -> None:
    picker = open_picker(window)
    _, place = picker.places()[0]
    hover(window, place.center)
    window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=-1))
    for what in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):  # pygame sends these for the wheel too
        window.on_event(Event(what, pos=place.center, button=5))
    assert picker.chosen == picker.columns
    press(window, "Shift")
    assert picker.chosen == picker.columns


def test_scenes_of_the_folder_come_first_and_other_toml_files_are_left_out(window: Window, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(SMALL_SCENE)
    (tmp_path / "broken.toml").write_text("[[balls]]\n")
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    picker = open_picker(window)
    assert [entry.name for entry in picker.found][:3] == ["broken.toml", "mine.toml", next(iter(bundled()))]
    window.draw()
    press(window, *"mine.toml", "Enter")
    assert window.scene.arena.size == (90, 90)


def test_other_things_in_the_folder_do_not_stop_the_picker(window: Window, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "bytes.toml").write_bytes(bytes(range(256)) + b"[[balls]]")
    (tmp_path / os.fsdecode(b"no-unicode-\xff.toml")).write_text("[[balls]]")
    (tmp_path / "huge.toml").write_bytes(b"#" * 3_000_000 + b"[[balls]]")
    picker = open_picker(window)
    own = [entry.name for entry in picker.found if entry.name.endswith(".toml")]
    assert own == ["bytes.toml", "no-unicode-\N{REPLACEMENT CHARACTER}.toml"]


def test_typed_text_may_be_unprintable_or_very_long(window: Window) -> None:
    press(window, "/", "\ufe0f")
    window.draw()
    press(window, "Back", *"long" * 300, "\u0301", "\U0001f600", "\ud83d")
    window.draw()
    assert window.scenes.picker
