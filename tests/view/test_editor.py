"""Balls are added, deleted and pushed; elasticity, gravity and rate change; edits are undone."""

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame.event import Event
from window_driver import (
    button,
    click,
    colour_at,
    colours,
    drag,
    given,
    hover,
    mouse,
    point,
    press,
    pull,
    run,
    shown,
    slider,
    step,
    unfold,
)

from sandbox.run.edits import AddBall, DeleteBall, SetElasticity, SetGravity, SetRate, SetVelocity
from sandbox.run.inputs import Grab, Release
from sandbox.run.trajectory import simulate
from sandbox.scene.fields import rgb
from sandbox.view.controls import Action
from sandbox.view.palette import ACCENT
from sandbox.view.widgets.slider import Slider
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def test_keys_select_balls_and_push_them(window: Window) -> None:
    press(window, "Up", shift=True)
    assert "no ball is selected" in window.status
    press(window, ".", ".", ".", ",")
    assert window.editor.selected == 1
    for key, velocity in (("Right", [30, 0]), ("Down", [30, 30]), ("Left", [0, 30]), ("Up", [0, 0])):
        press(window, key, shift=True)
        assert window.view.panes[1].state.velocity[1].tolist() == velocity
    assert len(given(window)) == 4
    assert step(window) == 0


def test_a_selected_ball_stays_selected_when_another_is_deleted(window: Window) -> None:
    press(window, ",")
    hover(window, point(window, 200, 300))
    press(window, "Delete")
    assert given(window) == [DeleteBall(step=0, ball=0)]
    assert window.editor.selected == 1
    window.on_event(Event(pygame.WINDOWLEAVE))
    press(window, "Delete")
    assert window.editor.selected is None
    press(window, "Delete")
    assert "no ball is selected" in window.status
    press(window, "undo")
    assert window.editor.selected == 1
    window.draw()


def test_the_last_ball_is_not_deleted() -> None:
    window = Window(scene_of("radius = 20\nposition = [200, 300]"), None)
    press(window, ".", "Delete")
    assert "balls must contain at least one ball" in window.status
    assert given(window) == []


def test_a_ball_is_added_at_the_mouse_as_a_copy_of_the_selected_one_and_inside_the_arena(window: Window) -> None:
    press(window, ".", ".")
    hover(window, point(window, 798, 400))
    press(window, "a")
    [edit] = given(window)
    assert isinstance(edit, AddBall)
    assert edit.position == pytest.approx((780, 400), abs=1 / window.layout.scale)
    assert (edit.radius, edit.mass, edit.velocity) == (20, 3, (0, 0))
    window.draw()
    for pane in (0, 1):
        assert colour_at(window, 780, 408, pane) == rgb(edit.color)


def test_a_ball_is_not_added_onto_another_or_onto_a_wall() -> None:
    scene = scene_of(
        "radius = 20\nposition = [200, 300]", more="walls = [{ from = [400, 300], to = [500, 300], thickness = 10 }]"
    )
    window = Window(scene, None)
    for x, y in ((235, 300), (450, 320)):
        hover(window, point(window, x, y))
        press(window, "a")
        assert "no room" in window.status
    assert given(window) == []


def test_the_add_button_waits_for_a_click_and_the_key_alone_finds_room(window: Window) -> None:
    place = button(window, Action.ADD_BALL)
    drag(window, place, place)
    assert window.mouse.adding
    hover(window, point(window, 300, 500))
    window.draw()
    assert (0, 0, 0) in {colour_at(window, x, 500) for x in range(306, 315)}  # its outline
    drag(window, point(window, 300, 500), point(window, 300, 500))
    assert [type(one) for one in given(window)] == [AddBall]
    assert not window.mouse.adding
    window.on_event(Event(pygame.WINDOWLEAVE))
    press(window, "a")
    assert window.view.panes[0].state.position[-1] == pytest.approx([400, 300], abs=10)
    press(window, "a")
    assert np.linalg.norm(window.view.panes[0].state.position[-1] - window.view.panes[0].state.position[-2]) >= 20
    assert len(window.view.moment.balls) == 6


def test_a_slider_s_drag_is_one_edit_at_its_release(window: Window) -> None:
    knob, place = slider(window, "elasticity")
    mouse(window, pygame.MOUSEBUTTONDOWN, place.center)
    for x in range(place.centerx, place.right, 3):
        mouse(window, pygame.MOUSEMOTION, (x, place.centery))
    track = place.height // 3
    mouse(window, pygame.MOUSEMOTION, (place.x + track + round(0.9 * (place.width - 2 * track)), place.centery))
    assert "0.9" in knob.tip
    assert given(window) == []
    mouse(window, pygame.MOUSEBUTTONUP, (0, 0))
    assert given(window) == [SetElasticity(step=0, elasticity=0.9)]
    assert knob.value() == 0.9


def test_the_keyboard_sets_gravity_and_rate_and_time_goes_on(window: Window) -> None:
    run(window, 30)
    unfold(window)
    names = [widget.name if isinstance(widget, Slider) else "" for widget in window.toolbar.widgets]
    press(window, *["Tab"] * (names.index("gravity") + 1), *["Right"] * 2)
    press(window, *["Tab"] * (names.index("rate") - names.index("gravity")), "Right", "Esc")
    assert given(window) == [
        SetGravity(step=30, gravity=(0, 100)),
        SetGravity(step=30, gravity=(0, 200)),
        SetRate(step=30, rate=120),
    ]
    run(window, 60)
    assert window.view.moment.time == 1.0
    window.playback.paused = False
    for _ in range(30):
        window.playback.advance(1 / 60)
    assert window.view.moment.time == pytest.approx(1.5, abs=0.02)


def test_a_refused_edit_is_reported() -> None:
    window = Window(scene_of("radius = 20\nposition = [200, 300]"), None)
    window.editor.set_gravity(900.0)
    assert "article: gravity is not part of the article's rule" in window.status
    assert given(window) == []


def test_a_slider_whose_every_value_is_refused_is_grey_says_why_and_offers_impulse() -> None:
    window = Window(scene_of("radius = 20\nposition = [200, 300]\nvelocity = [60, 30]"), None)
    run(window, 30)
    press(window, "p")
    before = shown(window)
    assert [pane.name for pane in window.view.panes] == ["pymunk", "article"]
    for name, why in (("gravity", "gravity is not part"), ("elasticity", "elasticity below 1 is not part")):
        knob, place = slider(window, name)
        assert knob.tip.startswith(f"article: {why}")
        assert "press I" in knob.tip
        window.widgets.focus = knob
        press(window, "Right")
    assert not slider(window, "rate")[0].refusal()
    assert given(window) == []
    hover(window, place.center)
    window.draw()
    assert ACCENT[:3] not in colours(window.screen.subsurface(place))
    click(window, place.center)
    assert [pane.name for pane in window.view.panes] == ["pymunk", "impulse"]
    assert (step(window), shown(window)[:2]) == (30, before[:2])
    assert "elasticity of every pair: 1" in knob.tip
    window.editor.set_gravity(900.0)
    assert given(window) == [SetGravity(step=30, gravity=(0, 900))]


def test_impulse_replaces_article_with_all_that_was_done(window: Window) -> None:
    window.begin(scene_of("radius = 20\nposition = [200, 300]\nvelocity = [60, 30]"), ["article", "impulse", "exact"])
    run(window, 5)
    window.editor.set_velocity(0, (0.0, 90.0))
    run(window, 5)
    window.playback.seek(8)
    press(window, "i", "i")
    assert [pane.name for pane in window.view.panes] == ["impulse", "exact"]
    assert "cannot replace" in window.status
    assert (step(window), len(given(window))) == (8, 1)
    replay = simulate(window.scene, "impulse", steps=8, inputs=given(window))
    assert np.array_equal(replay.position[-1], window.view.panes[0].state.position)


def test_an_invalid_velocity_is_reported() -> None:
    fast = Window(scene_of("radius = 20\nposition = [200, 300]\nvelocity = [999999999, 0]"), ["exact"])
    press(fast, "p", ".")
    press(fast, "Right", shift=True)
    assert "velocity[0] must be at most 1e+09, got 1000000029" in fast.status
    assert given(fast) == []


def test_undo_and_redo_treat_a_throw_as_one_edit(window: Window) -> None:
    pull(window, (600, 100), (-5, 4), steps=20)
    thrown = shown(window)
    press(window, "undo")
    assert (step(window), given(window)) == (0, [])
    press(window, "u")
    assert "nothing to undo" in window.status
    press(window, "redo")
    assert shown(window) == thrown
    assert [type(one) for one in given(window) if one.do != "move"] == [Grab, Release]
    press(window, "y")
    assert "nothing to redo" in window.status


def test_edits_at_a_step_not_in_the_history_apply_to_the_balls_of_that_step(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.session.history.MAX_RECENT", 8)
    monkeypatch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 12 * window.view.moment.size)
    monkeypatch.setattr("sandbox.view.playback.FRAME_BUDGET", -1.0)
    run(window, 100)
    press(window, ".")
    for there, key, kind in ((37, "a", AddBall), (21, "Right", SetVelocity), (11, "Delete", DeleteBall)):
        window.playback.seek(there)
        assert step(window) != there
        press(window, key, shift=key == "Right")
        [edit] = given(window)
        assert (type(edit), edit.step, step(window)) == (kind, there, there)
        if isinstance(edit, SetVelocity):
            at_that_step = simulate(window.scene, "pymunk", steps=there).velocity[there, 0]
            assert edit.velocity == (at_that_step[0] + 30, at_that_step[1])
        press(window, "undo")
        run(window, 100 - step(window))
