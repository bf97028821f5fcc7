"""The window as a whole: events, drawing, closing."""

import gc
import json
import weakref
from pathlib import Path

import numpy as np
import pygame
import pytest
from pygame.event import Event
from window_driver import SMALL_SCENE, button, click, given, pixels, press

from sandbox.scene.files import load
from sandbox.view.controls import Action
from sandbox.view.layout import MIN_SIZE
from sandbox.view.window import Window, has_display

pytestmark = pytest.mark.usefixtures("memory_screen")


def test_escape_and_the_close_button_quit(window: Window) -> None:
    press(window, "Esc")
    assert not window.running
    window.running = True
    window.on_event(Event(pygame.QUIT))
    assert not window.running


def test_the_toolbar_keeps_its_clicks_and_keys_from_the_panes(window: Window) -> None:
    click(window, button(window, Action.PAUSE))
    assert window.playback.paused
    assert given(window) == []
    press(window, "Tab", "Esc")
    assert window.running  # it has left the toolbar
    press(window, "Esc")
    assert not window.running


def test_a_session_that_is_replaced_is_freed_and_the_next_one_left_alone_by_the_garbage_collector(
    window: Window, all_objects_to_collect: None
) -> None:
    window.view.session.cycle = window.view.session  # type: ignore[attr-defined]
    former = weakref.ref(window.view.session)
    window.begin(load("head-on"), None)
    assert former() is None
    assert not any(
        one is window.view.session for one in gc.get_objects()
    )  # which lists what the collector goes through


def test_nothing_is_drawn_while_nothing_changes(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[int] = []
    whole = window.draw

    def draw() -> None:
        drawn.append(window.view.session.lockstep.steps)
        whole()

    monkeypatch.setattr(window, "draw", draw)
    press(window, "p")
    for _ in range(5):
        window.frame(1 / 60)
    assert drawn == [0]
    window.notice.show("a notice")
    window.frame(1 / 60)
    press(window, "o")
    window.frame(1 / 60)
    window.frame(1 / 60)
    assert drawn == [0, 0, 1]
    press(window, "p")
    for _ in range(30):  # the notice is still shown, and time goes on
        window.frame(1 / 60)
    assert drawn[-1] == window.view.session.lockstep.steps > 20


@pytest.mark.parametrize("size", [(1, 1), (1400, 20), (20, 900), (479, 319)])
def test_a_window_too_small_for_its_content_shows_the_upper_left(size: tuple[int, int]) -> None:
    window = Window(load("article"), None)
    window.playback.paused = True
    window.screen = pygame.display.set_mode([max(sides) for sides in zip(size, MIN_SIZE, strict=True)])
    window.draw()
    whole = pixels(window.screen)
    window.screen = pygame.display.set_mode(size)
    for key in ("F1", "/"):
        window.draw()
        press(window, key)
        window.draw()
    press(window, "Esc")
    press(window, "F1")
    window.draw()
    assert np.array_equal(pixels(window.screen), whole[: size[0], : size[1]])


@pytest.mark.parametrize(
    "title",
    ["\u200d", "\ufe0f", "\U000e0f20", "\U0001f600\u0301", "wide " * 20],
    ids=["joiner", "variation", "selector", "odd", "long"],
)
def test_a_title_may_contain_any_characters(title: str, tmp_path: Path) -> None:
    """pygame refuses to draw characters without width."""
    file = tmp_path / "mine.toml"
    file.write_text(f"title = {json.dumps(title, ensure_ascii=False)}\n{SMALL_SCENE}", encoding="utf-8")
    window = Window(load(file), None)
    window.draw()
    assert pygame.display.get_caption()[0].endswith(" - sandbox")
    for key in ("/", *"mine.toml"):
        press(window, key)
        window.draw()
    assert window.scenes.picker
    assert len(window.scenes.picker.found) == 1


@pytest.mark.usefixtures("no_display")
def test_no_display_is_found_without_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not has_display()
    monkeypatch.setenv("DISPLAY", ":0")
    assert not has_display()  # SDL has the dummy driver
