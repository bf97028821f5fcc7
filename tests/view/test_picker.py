"""The scene picker, by keys and by mouse."""

import os
from pathlib import Path

import pygame
import pytest
from pygame.event import Event
from window_driver import SMALL_SCENE, click, colours, drag, pixels, press

from sandbox.scene.fields import rgb
from sandbox.scene.files import bundled, load
from sandbox.view.layout import MIN_SIZE
from sandbox.view.scene_picker import NOTHING, TRUTHS_TOPIC, ScenePicker, Tile
from sandbox.view.theme import theme
from sandbox.view.widgets import Words
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


def test_the_scenes_of_the_folder_of_a_dropped_file_are_listed_first(window: Window, tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "own.toml").write_text(SMALL_SCENE)
    window.on_event(Event(pygame.DROPFILE, file=str(folder / "own.toml")))
    assert window.scene.name == "own"
    assert open_picker(window).found[0].name == "own.toml"


def test_what_the_chosen_scene_is_about_is_shown(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    picker = open_picker(window)
    written: list[str] = []

    def note(text: str, *_: int) -> list[str]:
        written.append(text)
        return []

    monkeypatch.setattr("sandbox.view.scene_picker.first_lines", note)
    for _ in range(2):
        window.draw()
        press(window, "Right")
    assert written == [load(entry.name).about for entry in picker.found[:2]]


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
            assert place.colliderect(picker.view)
        assert picker.view.contains(dict(places)[picker.chosen])
        press(window, "Right")
    assert len(seen) == len(everything)


def test_a_click_runs_a_scene_and_its_preview_shows_it(window: Window) -> None:
    picker = open_picker(window)
    press(window, *"break-shot")
    window.draw()
    [(_, place)] = picker.places()
    assert tuple(window.screen.get_at((place.x + 3, place.y + place.height // 3)))[:3] == rgb("#14532d")
    assert tuple(window.screen.get_at((place.x - 1, place.centery)))[:3] == tuple(theme.hover)[:3]
    drag(window, place.center, place.center)
    assert window.scene.name == "break-shot"


def test_scenes_are_listed_by_topic_under_its_name(window: Window, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(f'topic = "Gases"\n{SMALL_SCENE}')
    (tmp_path / "other.toml").write_text(SMALL_SCENE)
    picker = open_picker(window)
    placed = picker._placed
    texts = [widget.entry.name if isinstance(widget, Tile) else getattr(widget, "text", "") for widget, _ in placed]
    headings = {text: texts[k + 1] for k, text in enumerate(texts) if isinstance(placed[k][0], Words) and text}
    assert headings == {
        "Gases": "mine.toml",
        f"In {tmp_path.name}": "other.toml",
        "Collisions": "article",
        "Spin and friction": "billiards",
        "Gravity": "bouncing",
        "Chance": "galton-board",
        TRUTHS_TOPIC: next(iter(bundled("truths"))),
    }
    assert [entry.topic for entry in picker.found if entry.name in bundled()].count("Gases") == 3
    press(window, *"gas")  # of what is typed, the best first
    assert not any(isinstance(widget, Words) and widget.text for widget, _ in picker._placed)


def test_the_wheel_scrolls_no_further_than_the_scenes(window: Window) -> None:
    picker = open_picker(window)
    for notches, index in ((1, 0), (-1, len(picker.found) - 1)):
        for _ in range(99):
            window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=notches))
        assert index in dict(picker.places())
        window.draw()
    right = picker.view.right + 2
    bar = [
        tuple(theme.dim)[:3] == tuple(window.screen.get_at((right, y)))[:3]
        for y in (picker.view.y + 2, picker.view.bottom - 2)
    ]
    assert bar == [False, True]


@pytest.mark.parametrize(
    ("typed", "first"),
    [("1000", "gas-1000"), ("cradle", "newtons-cradle"), ("bouncing", "bouncing"), ("curl", "curling")],
)
def test_a_name_comes_before_a_title_and_a_title_before_other_text(window: Window, typed: str, first: str) -> None:
    picker = open_picker(window)
    press(window, *typed)
    assert picker.found[0].name == first


@pytest.mark.parametrize("size", [MIN_SIZE, (640, 90), (1024, 640)])
def test_a_click_where_nothing_is_found_closes_the_picker(window: Window, size: tuple[int, int]) -> None:
    window.screen = pygame.display.set_mode(size)
    picker = open_picker(window)
    press(window, *"zq")
    window.draw()
    assert [getattr(widget, "label", "") for widget, _ in picker._placed] == [NOTHING.format(typed="zq")]
    click(window, (size[0] // 2, size[1] - 5))
    assert window.scenes.picker is None


def test_pictures_are_drawn_one_a_frame_until_all_are_there(window: Window) -> None:
    press(window, "Space")
    press(window, "/")
    frames = 0
    while not window.scenes.picker or not window.scenes.picker.is_complete or not frames:
        window.frame(0.0)
        frames += 1
        assert frames < 99
    assert window.scenes.picker
    assert frames >= len(window.scenes.picker.places())
    _, place = window.scenes.picker.places()[0]
    assert rgb("red") in colours(window.screen.subsurface(place))


def test_other_things_in_the_folder_do_not_stop_the_picker(window: Window, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "bytes.toml").write_bytes(bytes(range(256)) + b"[[balls]]")
    (tmp_path / os.fsdecode(b"no-unicode-\xff.toml")).write_text("[[balls]]")
    (tmp_path / "huge.toml").write_bytes(b"#" * 3_000_000 + b"[[balls]]")
    picker = open_picker(window)
    own = [entry.name for entry in picker.found if entry.name.endswith(".toml")]
    assert own == ["bytes.toml", "no-unicode-\N{REPLACEMENT CHARACTER}.toml"]


def test_a_picture_is_drawn_anew_when_its_file_changes(window: Window, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(SMALL_SCENE)
    _, place = open_picker(window).places()[0]
    before = pixels(window.screen.subsurface(place))
    file.write_text(SMALL_SCENE.replace("[9, 9]", "[60, 60]"))
    os.utime(file, ns=(1, 1))
    window.draw()
    assert (pixels(window.screen.subsurface(place)) != before).any()


def test_scenes_of_the_folder_come_first_and_other_toml_files_are_left_out(window: Window, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(SMALL_SCENE)
    (tmp_path / "broken.toml").write_text("[[balls]]\n")
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    picker = open_picker(window)
    assert [entry.name for entry in picker.found][:3] == ["broken.toml", "mine.toml", next(iter(bundled()))]
    window.draw()
    press(window, *"mine.toml", "Enter")
    assert window.scene.arena.size == (90, 90)


def test_typed_text_may_be_unprintable_or_very_long(window: Window) -> None:
    press(window, "/", "\ufe0f")
    window.draw()
    press(window, "Back", *"long" * 300, "\u0301", "\U0001f600", "\ud83d")
    window.draw()
    assert window.scenes.picker
