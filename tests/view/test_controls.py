"""Keys, buttons and help agree."""

import numpy as np
import pygame
import pytest
from pygame import Rect
from pygame.event import Event
from window_driver import button, click, hover, key_event, pixels, press, run

from sandbox.view.controls import BY_KEY, HELP, Action, Panel, Topic, action_of
from sandbox.view.layout import MIN_SIZE
from sandbox.view.primitives import SMALLEST_TEXT
from sandbox.view.side_panel import LAYERS
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def test_the_help_has_every_action_and_ten_first() -> None:
    assert [row[0] for row in HELP].count(Topic.FIRST) == 10
    assert len(HELP) == len(Action) + len(Topic)


def test_every_action_can_be_done_and_twice(window: Window) -> None:
    for action in (*Action, *Action):
        window.do(action)
        window.draw()
    window.recorder.stop()


def test_each_key_finds_its_action() -> None:
    for action in Action:
        key = action.value.key
        assert action_of(key_event(key)) is action
        if len(key) == 1:  # whatever key types it, with Shift or without
            for mod in (0, pygame.KMOD_LSHIFT)[: 1 + (f"SHIFT {key}" not in BY_KEY)]:
                assert action_of(Event(pygame.KEYDOWN, key=0, unicode=key, mod=mod)) is action
    assert len(BY_KEY) == len(Action)  # none has two


def test_a_letter_typed_on_another_alphabet_s_keyboard_is_found_by_its_key() -> None:
    assert action_of(Event(pygame.KEYDOWN, key=pygame.K_r, unicode="\u043a", mod=0)) is Action.RESTART


@pytest.mark.parametrize("size", [MIN_SIZE, (1024, 640)])
def test_help_fits_is_drawn_over_everything_and_hidden_again(
    window: Window, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn, heights = list[Rect](), list[int]()
    tips: list[object] = []
    monkeypatch.setattr("sandbox.view.cards.panel", lambda _, place: drawn.append(place))
    monkeypatch.setattr("sandbox.view.cards.write", lambda *given, **_: heights.append(given[4]))
    monkeypatch.setattr("sandbox.view.widgets.group.card", lambda *given: tips.append(given))
    window.screen = pygame.display.set_mode(size)
    hover(window, button(window, Action.HELP))
    for _ in range(2):
        press(window, "F1")
        window.draw()
    [place] = drawn
    assert min(heights) >= SMALLEST_TEXT
    assert window.screen.get_rect().contains(place)
    assert place.width * place.height > 0.25 * size[0] * size[1]
    assert len(tips) == 1  # only while the help is hidden


@pytest.mark.parametrize("action", LAYERS, ids=lambda action: action.name)
def test_key_and_button_show_and_hide_the_same_layer(window: Window, action: Action) -> None:
    run(window, 30)
    window.view.session.lockstep.engines["pymunk"].engine.kick(0, (30.0, 90.0))
    window.playback.step()

    def shown() -> np.ndarray:
        window.draw()
        return pixels(window.screen)[: window.layout.pane_room].copy()

    window.mouse.point = None
    window.panel.show(Panel.SHOW)
    before = shown()
    press(window, action.value.key.lower())
    by_key = shown()
    assert (by_key != before).any()
    press(window, action.value.key.lower())
    assert np.array_equal(shown(), before)
    click(window, button(window, action))
    window.widgets.over = window.mouse.point = None
    assert np.array_equal(shown(), by_key)
