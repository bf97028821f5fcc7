"""The toolbar's widgets work by mouse alone and by keyboard alone."""

import math
from dataclasses import dataclass, field

import numpy as np
import pygame
import pytest
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.controls import CONTROLS, Action, Control, Group, Panel
from sandbox.view.icons import ICONS, icon
from sandbox.view.layers import Layer
from sandbox.view.palette import ACCENT
from sandbox.view.toolbar import Toolbar
from sandbox.view.widgets.button import Button
from sandbox.view.widgets.group import WidgetGroup
from sandbox.view.widgets.slider import Slider

STOPS = (0.0, 0.25, 0.5, 1.0)
PLACES = [Rect(10, 10, 30, 30), Rect(50, 10, 30, 30), Rect(100, 10, 150, 30)]


@dataclass
class Calls:
    """What a toolbar's widgets have called."""

    done: list[Action | Layer | Panel] = field(default_factory=list)
    on: bool = False
    value: float = 0.25

    def do(self, control: Control) -> None:
        self.done.append(control.action)

    def choose(self, value: float) -> None:
        self.value = value


@pytest.fixture
def calls() -> Calls:
    return Calls()


class Tools:
    """A toolbar of two buttons and a slider, at PLACES."""

    def __init__(self, calls: Calls) -> None:
        pause, grid = (
            Button(next(c for c in CONTROLS if c.icon == name), calls.do, lambda _: calls.on)
            for name in ("pause", "grid")
        )
        self.slider = Slider("bounce", "how bouncy", STOPS, lambda: calls.value, calls.choose, "!")
        self.group = WidgetGroup()
        self.bar = Toolbar({Group.TIME: [pause], Group.LAYERS: [grid, self.slider]}, self.group)

    def send(self, event: Event) -> bool:
        return self.group.on_event(event, self.bar.placed(PLACES))

    def mouse(self, what: int, x: int, y: int = 20) -> bool:
        return self.send(Event(what, pos=(x, y), button=1, buttons=(1, 0, 0)))

    def key(self, code: int, mod: int = 0) -> bool:
        return self.send(Event(pygame.KEYDOWN, key=code, mod=mod, unicode=""))

    @property
    def focus(self) -> int | None:
        return None if self.group.focus is None else self.bar.widgets.index(self.group.focus)

    def drawn(self) -> Surface:
        surface = Surface((600, 200))
        self.bar.draw(surface, PLACES, 17)
        return surface


@pytest.fixture
def tools(calls: Calls) -> Tools:
    return Tools(calls)


def test_a_click_on_a_button_does_its_action_once(tools: Tools, calls: Calls) -> None:
    assert tools.mouse(pygame.MOUSEBUTTONDOWN, 20)
    tools.mouse(pygame.MOUSEMOTION, 22)
    tools.mouse(pygame.MOUSEBUTTONUP, 22)
    assert calls.done == [Action.PAUSE]
    assert not tools.mouse(pygame.MOUSEBUTTONDOWN, 45)  # between two buttons
    assert not tools.mouse(pygame.MOUSEBUTTONDOWN, 20, y=300)
    assert calls.done == [Action.PAUSE]


def test_a_slider_follows_the_mouse_until_its_release(tools: Tools, calls: Calls) -> None:
    tools.mouse(pygame.MOUSEBUTTONDOWN, 175)
    assert calls.value in (0.25, 0.5)  # the middle of four
    for x, value in ((240, 1.0), (500, 1.0), (155, 0.25), (-50, 0.0)):
        assert tools.mouse(pygame.MOUSEMOTION, x)
        assert calls.value == value
    tools.mouse(pygame.MOUSEBUTTONUP, 0)
    assert not tools.mouse(pygame.MOUSEMOTION, 240)
    assert calls.value == 0.0


def test_losing_the_focus_releases_a_slider(tools: Tools, calls: Calls) -> None:
    tools.mouse(pygame.MOUSEBUTTONDOWN, 240)
    tools.send(Event(pygame.WINDOWFOCUSLOST))
    tools.mouse(pygame.MOUSEMOTION, 110)
    assert calls.value == 1.0


def test_the_keyboard_alone_reaches_everything(tools: Tools, calls: Calls) -> None:
    assert not tools.key(pygame.K_RETURN)  # nothing has the focus
    tools.key(pygame.K_TAB)
    tools.key(pygame.K_RETURN)
    tools.key(pygame.K_TAB)
    assert not tools.key(pygame.K_RIGHT)  # is the window's while a button has the focus
    tools.key(pygame.K_KP_ENTER)
    assert calls.done == [Action.PAUSE, Layer.GRID]
    tools.key(pygame.K_TAB)
    for code, value in ((pygame.K_RIGHT, 0.5), (pygame.K_UP, 1.0), (pygame.K_RIGHT, 1.0), (pygame.K_LEFT, 0.5)):
        assert tools.key(code)
        assert calls.value == value
    tools.key(pygame.K_TAB)
    assert tools.focus == 0
    tools.key(pygame.K_TAB, pygame.KMOD_LSHIFT)
    assert tools.focus == 2
    assert tools.key(pygame.K_ESCAPE)  # and not the window's, which it would close
    assert tools.focus is None
    assert not tools.key(pygame.K_ESCAPE)


def test_keys_that_a_widget_does_not_handle_are_left_to_the_window(tools: Tools, calls: Calls) -> None:
    for widget in tools.bar.widgets:
        tools.group.focus = widget
        assert not tools.key(pygame.K_SPACE)
    tools.group.focus = tools.slider
    assert not tools.key(pygame.K_RETURN)


def test_the_mouse_takes_the_focus_from_the_keyboard(tools: Tools) -> None:
    tools.group.focus = tools.slider
    tools.mouse(pygame.MOUSEBUTTONDOWN, 400, y=300)
    assert tools.focus is None


def test_a_slider_at_infinity_has_its_knob_at_the_end_and_steps_back_from_there() -> None:
    calls = Calls(value=math.inf)
    slider = Slider("speed", "how fast", (0.5, 1.0, 2.0, math.inf), lambda: calls.value, calls.choose)
    place, surface = Rect(0, 0, 140, 30), Surface((140, 30))
    slider.draw(surface, place, 17, hot=False)
    knob = [x for x in range(140) if surface.get_at((x, 21)) == ACCENT]
    assert min(knob) > 120
    slider.key(Event(pygame.KEYDOWN, key=pygame.K_LEFT))
    assert calls.value == 2.0


def test_a_slider_between_two_values_steps_from_the_nearest(tools: Tools, calls: Calls) -> None:
    calls.value = 0.9
    tools.group.focus = tools.slider
    tools.key(pygame.K_LEFT)
    assert calls.value == 0.5


def test_widths_are_grouped(tools: Tools) -> None:
    assert tools.bar.widths == ((1.0,), (1.0, 5.0))


def test_buttons_that_are_on_look_different(tools: Tools, calls: Calls) -> None:
    off = pygame.surfarray.array3d(tools.drawn())
    calls.on = True
    on = pygame.surfarray.array3d(tools.drawn())
    changed = (off != on).any(axis=2)
    for place in PLACES[:2]:
        assert changed[place.x : place.right, place.y : place.bottom].mean() > 0.8
    assert not changed[PLACES[2].x :].any()


def test_the_knob_is_drawn_at_the_value(tools: Tools, calls: Calls) -> None:
    knobs = []
    for value in STOPS:
        calls.value = value
        knob = np.nonzero((pygame.surfarray.array3d(tools.drawn()) == (0x56, 0xB4, 0xE9)).all(axis=2))[0]
        knobs.append(knob.mean())
    assert knobs == pytest.approx([110 + k * 130 / 3 for k in range(4)], abs=1)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_tooltip_is_drawn_below_its_widget_with_its_effect_and_its_key(tools: Tools, index: int) -> None:
    surface = tools.drawn()
    before = pygame.surfarray.array3d(surface)
    tools.mouse(pygame.MOUSEMOTION, PLACES[index].centerx)
    tools.group.draw_tip(surface, tools.bar.placed(PLACES), 14)
    x, y = np.nonzero((pygame.surfarray.array3d(surface) != before).any(axis=2))
    assert y.min() >= PLACES[index].bottom
    assert x.min() >= PLACES[index].x
    tips = ["pause or resume  (Space, P)", "grid lines  (L)", "how bouncy: 0.25!"]
    assert tools.bar.widgets[index].tip == tips[index]
    tools.send(Event(pygame.WINDOWLEAVE))
    again = tools.drawn()
    tools.group.draw_tip(again, tools.bar.placed(PLACES), 14)
    assert np.array_equal(pygame.surfarray.array3d(again), before)


def test_every_icon_is_drawn_and_no_two_are_alike() -> None:
    named = {name for control in CONTROLS for name in (control.icon, control.icon_on) if name}
    assert named == set(ICONS)
    pictures = {pygame.image.tobytes(icon(name, 24, (255, 255, 255)), "RGBA") for name in ICONS}
    assert len(pictures) == len(ICONS)
    for name in ICONS:
        covered = pygame.surfarray.array_alpha(icon(name, 48, (255, 255, 255))) > 128
        assert 0.05 < covered.mean() < 0.6, name


def test_each_key_belongs_to_one_control() -> None:
    keys = [(key, control.shift) for control in CONTROLS for key in control.keys]
    typed = [character for control in CONTROLS for character in control.typed]
    assert len(set(keys)) == len(keys)
    assert len(set(typed)) == len(typed)
