"""Balls are added, deleted and pushed; elasticity, gravity and rate change; edits are undone."""

import pygame
import pytest
from conftest import ball_at, scene_of
from pygame.event import Event
from window_driver import (
    THREE_BALLS,
    click,
    colour_at,
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
    tool,
    use,
)

from sandbox.run.edits import AddBall, DeleteBall, DeleteWall, SetElasticity, SetGravity, SetRate
from sandbox.run.inputs import Grab, Release
from sandbox.scene.fields import rgb
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def test_a_selected_ball_stays_selected_when_another_is_deleted(window: Window) -> None:
    window.editor.select(2)
    window.playback.give(DeleteBall(step=0, ball=0))
    assert window.editor.selected == 1
    press(window, "Delete")
    assert window.editor.selected is None
    press(window, "Delete")
    assert "no ball is selected" in window.messages.text
    press(window, "undo")
    assert window.editor.selected == 1
    window.draw()


def test_a_ball_is_added_where_one_clicks_as_a_copy_of_the_selected_one_and_inside_the_arena(window: Window) -> None:
    window.editor.select(1)
    use(window, "Ball")
    click(window, point(window, 798, 400))
    [edit] = given(window)
    assert isinstance(edit, AddBall)
    assert edit.position == pytest.approx((780, 400), abs=1 / window.layout.scale)
    assert (edit.radius, edit.mass, edit.velocity) == (20, 3, (0, 0))
    window.draw()
    for pane in (0, 1):
        assert colour_at(window, 780, 408, pane) == rgb(edit.color)


def test_a_ball_is_not_added_onto_another_or_onto_a_wall() -> None:
    scene = scene_of(ball_at(200, 300), more="walls = [{ from = [400, 300], to = [500, 300], thickness = 10 }]")
    window = Window(scene, None)
    for x, y, said in ((235, 300, "no room"), (450, 320, "would overlap wall 0")):
        window.editor.add((x, y))
        assert said in window.messages.text
    assert given(window) == []


def test_the_ball_tool_shows_the_ball_to_come_and_esc_leaves_it(window: Window) -> None:
    click(window, tool(window, "Ball"))
    hover(window, point(window, 300, 500))
    window.draw()
    assert (0, 0, 0) in {colour_at(window, x, 500) for x in range(306, 318)}  # its outline
    click(window, point(window, 300, 500))
    click(window, point(window, 300, 400))
    assert [type(one) for one in given(window)] == [AddBall] * 2
    press(window, "Esc")
    click(window, point(window, 500, 500))
    assert len(given(window)) == 2


def test_the_eraser_deletes_the_ball_or_the_wall_that_is_clicked() -> None:
    wall = "walls = [{ from = [400, 300], to = [500, 300], thickness = 10 }]"
    window = Window(scene_of(*THREE_BALLS, more=wall), ["pymunk", "impulse"])
    click(window, tool(window, "Erase"))
    click(window, point(window, 300, 500))
    assert given(window) == []
    click(window, point(window, 600, 100))
    click(window, point(window, 450, 300))
    assert given(window) == [DeleteBall(step=0, ball=2), DeleteWall(step=0, wall=0)]


def test_a_slider_s_drag_is_one_edit_at_its_release(window: Window) -> None:
    knob, place = slider(window, "elasticity")
    mouse(window, pygame.MOUSEBUTTONDOWN, place.center)
    for x in range(place.centerx, place.right, 3):
        mouse(window, pygame.MOUSEMOTION, (x, place.centery))
    track = place.height // 3
    mouse(window, pygame.MOUSEMOTION, (place.x + track + round(0.9 * (place.width - 2 * track)), place.centery))
    assert knob.dragged is not None
    assert knob.values[knob.dragged] == 0.9
    assert given(window) == []
    mouse(window, pygame.MOUSEBUTTONUP, (0, 0))
    assert given(window) == [SetElasticity(step=0, elasticity=0.9)]
    assert knob.value() == 0.9


def test_the_page_says_if_only_balls_have_the_elasticity_that_it_shows() -> None:
    window = Window(scene_of(*THREE_BALLS, size="[800, 600]\nelasticity = 0.8"), ["pymunk"])
    assert slider(window, "elasticity")[0].unit == " between balls"
    window.editor.set_elasticity(0.8)
    assert slider(window, "elasticity")[0].unit == ""


def test_gravity_and_rate_are_set_and_time_goes_on(window: Window) -> None:
    run(window, 30)
    slider(window, "gravity")[0].choose(200)
    slider(window, "steps")[0].choose(120)
    assert given(window) == [SetGravity(step=30, gravity=(0, 200)), SetRate(step=30, rate=120)]
    run(window, 60)
    assert window.view.moment.time == 1.0
    window.playback.paused = False
    for _ in range(30):
        window.playback.advance(1 / 60)
    assert window.view.moment.time == pytest.approx(1.5, abs=0.02)


@pytest.mark.parametrize("name", ["gravity", "elasticity", "mass", "radius", "friction"])
def test_an_engine_that_cannot_run_a_change_keeps_its_pane_and_returns(name: str) -> None:
    balls = (f"radius = 20\nposition = [{x}, 300]\nvelocity = [60, 30]" for x in (200, 400))
    window = Window(scene_of(*balls), None)
    run(window, 30)
    before = shown(window)
    for value in (0.5, {"gravity": 0, "friction": 0, "radius": 20}.get(name, 1)):
        if name in ("gravity", "elasticity"):
            getattr(window.editor, f"set_{name}")(value)
        else:
            window.editor.select(0)
            window.editor.change(**{name: value})
        assert [pane.name for pane in window.view.panes] == ["pymunk", "article"]
        assert window.view.panes[1].is_suspended == (value == 0.5)
        window.draw()
    article, exact = (window.view.moment.states[engine] for engine in ("article", "exact"))
    assert article.position.tobytes() == exact.position.tobytes()
    press(window, "undo")
    assert window.view.panes[1].is_suspended
    press(window, "undo")
    assert (step(window), shown(window), given(window)) == (30, before, [])


@pytest.mark.parametrize(("shift", "gravity"), [(False, 900), (True, 0)])
def test_a_restart_keeps_edits_or_discards_them_and_undo_comes_back(shift: bool, gravity: int) -> None:
    window = Window(scene_of(ball_at(200, 300)), ["pymunk"])
    run(window, 20)
    window.editor.set_gravity(900)
    run(window, 10)
    before = shown(window)
    window.on_event(Event(pygame.KEYDOWN, key=pygame.K_r, unicode="rR"[shift], mod=pygame.KMOD_LSHIFT * shift))
    assert (step(window), window.playback.scene.gravity[1], len(given(window))) == (0, gravity, 1 - shift)
    run(window, 5)
    press(window, "undo")
    assert (step(window), shown(window)) == (30, before)


def test_undo_and_redo_treat_a_throw_as_one_edit(window: Window) -> None:
    pull(window, (600, 100), (-5, 4), steps=20)
    thrown = shown(window)
    press(window, "undo")
    assert (step(window), given(window)) == (0, [])
    press(window, "undo")
    assert "nothing to undo" in window.messages.text
    press(window, "redo")
    assert shown(window) == thrown
    assert [type(one) for one in given(window) if one.do != "move"] == [Grab, Release]
    press(window, "redo")
    assert "nothing to redo" in window.messages.text


def test_edits_at_a_step_not_in_the_history_apply_to_the_balls_of_that_step(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.session.history.MAX_RECENT", 8)
    monkeypatch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 12 * window.view.moment.size)
    monkeypatch.setattr("sandbox.view.playback.FRAME_BUDGET", -1.0)
    run(window, 100)
    window.editor.select(0)
    use(window, "Ball")
    for there, kind in ((37, AddBall), (11, DeleteBall)):
        window.playback.seek(there)
        assert step(window) != there
        if kind is AddBall:
            click(window, point(window, 400, 500))
        else:
            press(window, "Delete")
        [edit] = given(window)
        assert (type(edit), edit.step, step(window)) == (kind, there, there)
        press(window, "undo")
        run(window, 100 - step(window))
