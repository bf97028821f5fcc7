"""The toolbar: each widget by the mouse alone, and by the keyboard alone."""

import math
from dataclasses import dataclass, field

import numpy as np
import pygame
import pytest
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.controls import CONTROLS, Control
from sandbox.view.icons import ICONS, icon
from sandbox.view.toolbar import ON, Button, Slider, Toolbar

STOPS = (0.0, 0.25, 0.5, 1.0)
PLACES = [Rect(10, 10, 30, 30), Rect(50, 10, 30, 30), Rect(100, 10, 150, 30)]


@dataclass
class Told:
    """What a toolbar's widgets were told."""

    done: list[str] = field(default_factory=list)
    on: bool = False
    value: float = 0.25

    def do(self, control: Control) -> None:
        self.done.append(control.action)

    def choose(self, value: float) -> None:
        self.value = value


@pytest.fixture
def told() -> Told:
    return Told()


@pytest.fixture
def toolbar(told: Told) -> Toolbar:
    pause, grid = (next(c for c in CONTROLS if c.icon == name) for name in ("pause", "grid"))
    buttons = [Button(control, told.do, lambda _: told.on) for control in (pause, grid)]
    return Toolbar([*buttons, Slider("see", "bounce", "how bouncy", STOPS, lambda: told.value, told.choose, "!")])


def mouse(toolbar: Toolbar, what: int, x: int, y: int = 20) -> bool:
    return toolbar.on_event(Event(what, pos=(x, y), button=1, buttons=(1, 0, 0)), PLACES)


def key(toolbar: Toolbar, code: int, mod: int = 0) -> bool:
    return toolbar.on_event(Event(pygame.KEYDOWN, key=code, mod=mod, unicode=""), PLACES)


def test_a_click_on_a_button_does_it_once(toolbar: Toolbar, told: Told) -> None:
    assert mouse(toolbar, pygame.MOUSEBUTTONDOWN, 20)
    mouse(toolbar, pygame.MOUSEMOTION, 22)
    mouse(toolbar, pygame.MOUSEBUTTONUP, 22)
    assert told.done == ["pause"]
    assert not mouse(toolbar, pygame.MOUSEBUTTONDOWN, 45)  # between two
    assert not mouse(toolbar, pygame.MOUSEBUTTONDOWN, 20, y=300)
    assert told.done == ["pause"]


def test_a_slider_follows_the_mouse_until_it_is_let_go(toolbar: Toolbar, told: Told) -> None:
    mouse(toolbar, pygame.MOUSEBUTTONDOWN, 175)
    assert told.value in (0.25, 0.5)  # the middle of four
    for x, value in ((240, 1.0), (500, 1.0), (155, 0.25), (-50, 0.0)):
        assert mouse(toolbar, pygame.MOUSEMOTION, x)
        assert told.value == value
    mouse(toolbar, pygame.MOUSEBUTTONUP, 0)
    assert not mouse(toolbar, pygame.MOUSEMOTION, 240)
    assert told.value == 0.0


def test_losing_the_focus_lets_a_slider_go(toolbar: Toolbar, told: Told) -> None:
    mouse(toolbar, pygame.MOUSEBUTTONDOWN, 240)
    toolbar.on_event(Event(pygame.WINDOWFOCUSLOST), PLACES)
    mouse(toolbar, pygame.MOUSEMOTION, 110)
    assert told.value == 1.0


def test_the_keyboard_alone_reaches_everything(toolbar: Toolbar, told: Told) -> None:
    assert not key(toolbar, pygame.K_RETURN)  # nothing has the focus
    key(toolbar, pygame.K_TAB)
    key(toolbar, pygame.K_RETURN)
    key(toolbar, pygame.K_TAB)
    assert not key(toolbar, pygame.K_RIGHT)  # is the window's while a button has the focus
    key(toolbar, pygame.K_KP_ENTER)
    assert told.done == ["pause", "show"]
    key(toolbar, pygame.K_TAB)
    for code, value in ((pygame.K_RIGHT, 0.5), (pygame.K_UP, 1.0), (pygame.K_RIGHT, 1.0), (pygame.K_LEFT, 0.5)):
        assert key(toolbar, code)
        assert told.value == value
    key(toolbar, pygame.K_TAB)
    assert toolbar.focus == 0
    key(toolbar, pygame.K_TAB, pygame.KMOD_LSHIFT)
    assert toolbar.focus == 2
    assert key(toolbar, pygame.K_ESCAPE)  # and not the window's, which it would close
    assert toolbar.focus is None
    assert not key(toolbar, pygame.K_ESCAPE)


def test_keys_that_a_widget_does_not_know_are_the_window_s(toolbar: Toolbar, told: Told) -> None:
    for toolbar.focus in range(3):
        assert not key(toolbar, pygame.K_SPACE)
    toolbar.focus = 2
    assert not key(toolbar, pygame.K_RETURN)


def test_the_mouse_takes_the_focus_from_the_keyboard(toolbar: Toolbar) -> None:
    toolbar.focus = 2
    mouse(toolbar, pygame.MOUSEBUTTONDOWN, 400, y=300)
    assert toolbar.focus is None


def test_a_slider_at_the_fastest_has_its_knob_there_and_goes_on_from_there() -> None:
    """It stood at the slowest, and the arrow to the left went there."""
    told = Told(value=math.inf)
    slider = Slider("time", "speed", "how fast", (0.5, 1.0, 2.0, math.inf), lambda: told.value, told.choose)
    place, surface = Rect(0, 0, 140, 30), Surface((140, 30))
    slider.draw(surface, place, hot=False)
    knob = [x for x in range(140) if surface.get_at((x, 21)) == ON]
    assert min(knob) > 120
    slider.key(pygame.K_LEFT)
    assert told.value == 2.0


def test_a_slider_at_a_value_of_none_of_its_stops_goes_on_from_the_nearest(toolbar: Toolbar, told: Told) -> None:
    told.value = 0.9
    toolbar.focus = 2
    key(toolbar, pygame.K_LEFT)
    assert told.value == 0.5


def test_widths_are_grouped(toolbar: Toolbar) -> None:
    assert toolbar.widths == ((1.0,), (1.0, 5.0))


def drawn(toolbar: Toolbar) -> Surface:
    surface = Surface((600, 200))
    toolbar.draw(surface, PLACES)
    return surface


def test_what_is_on_looks_otherwise(toolbar: Toolbar, told: Told) -> None:
    off = pygame.surfarray.array3d(drawn(toolbar))
    told.on = True
    on = pygame.surfarray.array3d(drawn(toolbar))
    changed = (off != on).any(axis=2)
    for place in PLACES[:2]:
        assert changed[place.x : place.right, place.y : place.bottom].mean() > 0.8
    assert not changed[PLACES[2].x :].any()


def test_the_knob_stands_at_the_value(toolbar: Toolbar, told: Told) -> None:
    knobs = []
    for value in STOPS:
        told.value = value
        knob = np.nonzero((pygame.surfarray.array3d(drawn(toolbar)) == (0x56, 0xB4, 0xE9)).all(axis=2))[0]
        knobs.append(knob.mean())
    assert knobs == pytest.approx([110 + k * 130 / 3 for k in range(4)], abs=1)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_tooltip_stands_below_its_widget_with_what_it_does_and_its_key(toolbar: Toolbar, index: int) -> None:
    surface = drawn(toolbar)
    before = pygame.surfarray.array3d(surface)
    mouse(toolbar, pygame.MOUSEMOTION, PLACES[index].centerx)
    toolbar.draw_tip(surface, PLACES, 14)
    x, y = np.nonzero((pygame.surfarray.array3d(surface) != before).any(axis=2))
    assert y.min() >= PLACES[index].bottom
    assert x.min() >= PLACES[index].x
    tips = ["pause, and go on  (Space, P)", "lines of a grid  (L)", "how bouncy: 0.25!"]
    assert toolbar.widgets[index].tip == tips[index]
    toolbar.on_event(Event(pygame.WINDOWLEAVE), PLACES)
    again = drawn(toolbar)
    toolbar.draw_tip(again, PLACES, 14)
    assert np.array_equal(pygame.surfarray.array3d(again), before)


def test_every_icon_is_drawn_and_no_two_are_alike() -> None:
    named = {name for control in CONTROLS for name in (control.icon, control.icon_on) if name}
    assert named == set(ICONS)
    pictures = {pygame.image.tobytes(icon(name, 24, (255, 255, 255)), "RGBA") for name in ICONS}
    assert len(pictures) == len(ICONS)
    for name in ICONS:
        covered = pygame.surfarray.array_alpha(icon(name, 48, (255, 255, 255))) > 128
        assert 0.05 < covered.mean() < 0.6, name


def test_keys_are_of_one_control_each() -> None:
    keys = [(key, control.shift) for control in CONTROLS for key in control.keys]
    typed = [character for control in CONTROLS for character in control.typed]
    assert len(set(keys)) == len(keys)
    assert len(set(typed)) == len(typed)
