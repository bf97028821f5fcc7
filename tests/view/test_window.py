"""The window as a whole: events, drawing, closing."""

import gc
import json
import weakref
from pathlib import Path

import pygame
import pytest
from pygame import Color
from pygame.event import Event
from window_driver import SMALL_SCENE, button, click, colours, given, press, step, tool

from sandbox.scene.files import load
from sandbox.view.controls import Action
from sandbox.view.display import has_display
from sandbox.view.layout import MIN_SIZE
from sandbox.view.notice import Notice, NoticeKind
from sandbox.view.theme import DARK, GREEN, LIGHT, VERMILLION, readable
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def test_the_toolbar_keeps_its_clicks_and_keys_from_the_panes(window: Window) -> None:
    click(window, button(window, Action.PAUSE))
    assert window.playback.paused
    assert given(window) == []
    press(window, "Esc", "Esc")
    assert not window.running


def test_one_escape_too_many_does_not_quit(window: Window) -> None:
    press(window, "/", "Esc", "Esc")
    assert window.running
    assert window.messages.text.endswith("Esc again quits")
    window.draw()
    press(window, "Right", "Esc")
    assert window.running
    press(window, "Esc")
    assert not window.running
    window.running = True
    window.on_event(Event(pygame.QUIT))
    assert not window.running


def test_a_notice_goes_when_something_else_is_done_once_it_was_drawn(window: Window) -> None:
    press(window, "Delete")
    press(window, "Right")  # in the same frame
    assert "no ball is selected" in window.messages.text
    window.draw()
    press(window, "Right")
    assert "no ball is selected" not in window.messages.text
    press(window, "F12")
    assert "saved " in window.messages.text
    window.draw()
    press(window, "Right")
    assert "saved " not in window.messages.text


def test_notices_of_success_and_error_look_different(window: Window) -> None:
    seen = []
    for kind in NoticeKind:
        window.notice.show("the same", kind)
        window.draw()
        seen.append(colours(window.screen.subsurface(window.layout.status)))
    done, failed = (tuple(readable(Color(colour), Color("white")))[:3] for colour in (GREEN, VERMILLION))
    assert [done in found for found in seen] == [False, True, False]
    assert [failed in found for found in seen] == [False, False, True]


def test_the_length_of_a_recording_is_on_its_button(window: Window) -> None:
    press(window, "F9")
    for _ in range(5):
        window.frame(0.1)
    assert tool(window, "Stop 0.5 s")
    window.recorder.stop()


def test_what_fails_is_reported_once_and_the_run_goes_on(
    window: Window, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(Notice, "strict", False)

    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError("in a part")

    monkeypatch.setattr(type(window.view.charts), "draw", fail)
    window.playback.paused = False
    for _ in range(5):
        window.frame(1 / 30)
    assert step(window) > 5
    assert window.notice.text == "That failed, and the run goes on: in a part"
    assert "ZeroDivisionError: in a part" in caplog.text
    assert len(caplog.records) == 1
    monkeypatch.undo()
    monkeypatch.setattr(Notice, "strict", False)
    window.notice.clear()
    monkeypatch.setattr(window, "restart", fail)
    press(window, "r")
    assert window.notice.text == "That failed, and the run goes on: in a part"
    assert len(caplog.records) == 2


@pytest.mark.usefixtures("memory_screen")
def test_a_window_opens_dark_by_the_environment_and_a_key_changes_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_THEME", "dark")
    window = Window(load("article"), ["pymunk"])
    for ground in (DARK.ground, LIGHT.ground):
        window.draw()
        assert window.screen.get_at((1, 1)) == ground
        press(window, "F7")


def test_a_session_that_is_replaced_is_freed_and_the_next_one_left_alone_until_the_window_is_closed(
    window: Window, all_objects_to_collect: None
) -> None:
    window.view.session.cycle = window.view.session  # type: ignore[attr-defined]
    former = weakref.ref(window.view.session)
    window.begin(load("head-on"), None)
    assert former() is None
    assert not any(
        one is window.view.session for one in gc.get_objects()
    )  # which lists what the collector goes through
    window.running = False
    window.run()
    assert not gc.get_freeze_count()


def test_nothing_is_drawn_while_nothing_changes(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[int] = []
    whole = window.draw

    def draw() -> None:
        drawn.append(window.view.session.lockstep.steps)
        whole()

    monkeypatch.setattr(window, "draw", draw)
    press(window, "Space")
    for _ in range(5):
        window.frame(1 / 60)
    assert drawn == [0]
    window.notice.show("a notice")
    window.frame(1 / 60)
    press(window, "Right")
    window.frame(1 / 60)
    window.frame(1 / 60)
    assert drawn == [0, 0, 1]
    press(window, "Space")
    for _ in range(30):  # the notice is still shown, and time goes on
        window.frame(1 / 60)
    assert drawn[-1] == window.view.session.lockstep.steps > 20


@pytest.mark.parametrize("size", [(1, 1), (1400, 20), (20, 900), (479, 319)])
def test_a_window_too_small_for_its_content_shows_the_upper_left(size: tuple[int, int]) -> None:
    window = Window(load("article"), None)
    window.screen = pygame.display.set_mode(size)
    for key in ("F1", "/"):
        press(window, key)
        window.draw()
    assert window.layout.window == tuple(map(max, size, MIN_SIZE))
    press(window, "Esc", "F1")
    window.draw()
    assert window.screen.get_at((0, 0)) == LIGHT.ground


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


def test_the_size_of_the_text_changes(window: Window) -> None:
    window.on_event(Event(pygame.KEYDOWN, key=pygame.K_PLUS, unicode="+", mod=pygame.KMOD_LCTRL))
    assert (window.layout.text_height, window.playback.speed) == (15, 1.0)
    window.on_event(Event(pygame.KEYDOWN, key=pygame.K_MINUS, unicode="-", mod=pygame.KMOD_LCTRL))
    assert window.layout.text_height == 14
