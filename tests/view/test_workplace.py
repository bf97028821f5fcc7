"""The window as a place to work: going back, editing, choosing scenes, on a screen that is only in memory."""

import math
import os
from pathlib import Path

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame.event import Event

from sandbox.run.edits import AddBall, DeleteBall, SetElasticity, SetGravity, SetRate, SetVelocity
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.run.trajectory import simulate
from sandbox.scene.files import bundled, load
from sandbox.scene.model import Scene, rgb
from sandbox.scene.spawn import spawn
from sandbox.view.palette import RAISED
from sandbox.view.toolbar import Slider
from sandbox.view.watch import Watch
from sandbox.view.window import Window

CODES = {
    "Left": pygame.K_LEFT, "Right": pygame.K_RIGHT, "Up": pygame.K_UP, "Down": pygame.K_DOWN, "Home": pygame.K_HOME,
    "End": pygame.K_END, "PageUp": pygame.K_PAGEUP, "PageDown": pygame.K_PAGEDOWN, "Delete": pygame.K_DELETE,
    "Enter": pygame.K_RETURN, "Esc": pygame.K_ESCAPE, "Back": pygame.K_BACKSPACE, "Tab": pygame.K_TAB,
    "Shift": pygame.K_LSHIFT,
}  # fmt: skip
CONTROL = {"undo": "\x1a", "redo": "\x19", "save": "\x13", "open": "\x0f"}  # what Ctrl makes of Z, Y, S, O


@pytest.fixture(autouse=True)
def _memory_screen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def scene() -> Scene:
    return scene_of(
        "radius = 20\nposition = [200, 300]\nvelocity = [240, 0]",
        "radius = 20\nposition = [260, 310]\nmass = 3",
        "radius = 10\nposition = [600, 100]\nvelocity = [60, -30]",
    )


@pytest.fixture
def window(scene: Scene) -> Window:
    return Window(scene, None)


def press(window: Window, *keys: str, shift: bool = False) -> None:
    for key in keys:
        code, typed = (CODES[key], "") if key in CODES else (0, CONTROL.get(key, key))
        window.on_event(Event(pygame.KEYDOWN, key=code, unicode=typed, mod=pygame.KMOD_LSHIFT if shift else 0))


def mouse(window: Window, what: int, point: tuple[int, int], held: bool = True) -> None:
    window.on_event(Event(what, pos=point, button=1, buttons=(int(held), 0, 0)))


def hover(window: Window, point: tuple[int, int]) -> None:
    mouse(window, pygame.MOUSEMOTION, point, held=False)


def drag(window: Window, start: tuple[int, int], end: tuple[int, int]) -> None:
    hover(window, start)
    mouse(window, pygame.MOUSEBUTTONDOWN, start)
    mouse(window, pygame.MOUSEMOTION, end)
    mouse(window, pygame.MOUSEBUTTONUP, end)


def point(window: Window, x: float, y: float, pane: int = 0) -> tuple[int, int]:
    arena, scale = window.layout.arenas[pane], window.layout.scale
    return round(arena.x + x * scale), round(arena.y + y * scale)


def run(window: Window, steps: int) -> None:
    for _ in range(steps):
        window.player.one_step()


def step(window: Window) -> int:
    return window.stage.moment.step


def shown(window: Window) -> list[bytes]:
    return [state.tobytes() for pane in window.panes for state in (pane.state.position, pane.state.velocity)]


def given(window: Window) -> list[Input]:
    return window.stage.session.given()


def colour_at(window: Window, x: float, y: float, pane: int = 0) -> tuple[int, ...]:
    return tuple(window.screen.get_at(point(window, x, y, pane)))[:3]


# --- Time ------------------------------------------------------------------------------------------------------


def test_keys_go_back_and_on_and_the_panes_show_what_was(window: Window) -> None:
    run(window, 90)
    end = shown(window)
    press(window, *["Left"] * 10)
    assert (step(window), window.player.paused) == (80, True)
    window.draw()
    for pane, name in enumerate(("pymunk", "impulse")):
        x, y = simulate(window.scene, name, steps=80).position[80, 2]
        assert colour_at(window, x, y + 6, pane) == rgb(window.scene.colors[2])
    press(window, *["Right"] * 10)
    assert shown(window) == end
    press(window, "PageUp")
    assert step(window) == 30
    press(window, "PageUp")
    assert step(window) == 0
    press(window, "PageDown", "PageDown", "PageDown")
    assert (step(window), shown(window)) == (90, end)
    press(window, "Home")
    assert step(window) == 0
    press(window, "End")
    assert shown(window) == end


@pytest.mark.parametrize("charts", [True, False])
def test_a_drag_in_the_charts_or_in_the_bar_goes_to_that_time_and_pauses(window: Window, charts: bool) -> None:
    run(window, 120)
    window.player.paused = False
    if not charts:
        press(window, "h")
    window.draw()
    layout = window.layout
    assert bool(layout.strip.height) == charts
    assert bool(layout.bar.height) != charts
    if charts:
        plot = window.charts.plots(layout.strip, layout.text_height)[0]
        places = {at: (layout.strip.x + plot.x + round(at / 20 * plot.width), layout.strip.y + 9) for at in (0.5, 1, 9)}
    else:
        bar = layout.bar
        places = {at: (bar.x + round(min(at / 2, 1) * bar.width), bar.centery) for at in (0.5, 1, 9)}
    mouse(window, pygame.MOUSEBUTTONDOWN, places[1])
    assert step(window) == pytest.approx(60, abs=2)
    assert window.player.paused
    mouse(window, pygame.MOUSEMOTION, places[0.5])
    assert step(window) == pytest.approx(30, abs=2)
    mouse(window, pygame.MOUSEMOTION, (-50, places[1][1] + 900))  # out of the window
    assert step(window) == 0
    mouse(window, pygame.MOUSEMOTION, places[9])
    assert step(window) == 120
    mouse(window, pygame.MOUSEBUTTONUP, places[9])
    mouse(window, pygame.MOUSEMOTION, places[1], held=False)
    assert step(window) == 120


def test_time_that_passes_goes_on_from_the_past_once_the_engines_are_there(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(window, 60)
    end = shown(window)
    monkeypatch.setattr("sandbox.view.player.BUDGET", -1.0)  # every frame has time for one slice
    window.player.seek(25)
    window.player.paused = False
    window.frame(1 / 60)
    assert step(window) == 25
    assert "running again: 15 steps to go" in window.status
    while step(window) < 60:
        window.frame(1 / 60)
    assert shown(window) == end


def test_a_step_that_is_not_remembered_is_shown_as_soon_as_it_has_been_run_again(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.session.history.MAX_RECENT", 8)
    monkeypatch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 12 * window.stage.moment.size)
    run(window, 100)
    monkeypatch.setattr("sandbox.view.player.BUDGET", -1.0)
    window.player.seek(37)
    frames = 0
    while not window.player.exact:
        assert step(window) != 37
        window.frame(0.0)
        frames += 1
    assert frames > 2
    assert shown(window)[0] == simulate(window.scene, "pymunk", steps=37).position[37].tobytes()


def test_speeds_reach_from_a_hundredth_to_all_the_machine_can(window: Window) -> None:
    press(window, *["-"] * 20)
    for _ in range(101):
        window.advance(1.0)
    assert step(window) == pytest.approx(60, abs=1)
    press(window, *["+"] * 20)
    assert window.player.speed == math.inf
    before = step(window)
    window.advance(1e-9)
    assert step(window) > before + 2
    assert "fastest" in window.status


def test_the_charts_forget_what_is_not_to_come(window: Window) -> None:
    run(window, 60)
    steps = window.charts.history.series.steps
    window.player.seek(20)
    assert steps[-1] == 60
    press(window, ".", "Delete")
    assert window.charts.history.series.steps[-1] == 20
    run(window, 5)
    assert window.charts.history.times[-1] == pytest.approx(25 / 60)


def test_trails_reach_back_to_before_what_was_sought(window: Window) -> None:
    run(window, 100)
    window.player.seek(50)
    places = window.panes[0].trail.places()
    assert np.array_equal(places, simulate(window.scene, "pymunk", steps=50).position)
    press(window, ".", "Delete")
    assert window.panes[0].trail.places().shape[1:] == (2, 2)
    window.draw()


# --- Edits -----------------------------------------------------------------------------------------------------


def test_paused_a_drag_from_a_ball_sets_its_velocity_in_every_engine(window: Window) -> None:
    press(window, "p")
    x, y = point(window, 600, 100, pane=1)
    drag(window, (x, y), point(window, 660, 140, pane=1))
    [edit] = given(window)
    assert isinstance(edit, SetVelocity)
    assert edit.ball == 2
    assert edit.velocity == pytest.approx((300, 200), abs=5 / window.layout.scale)
    assert [pane.state.velocity[2].tolist() for pane in window.panes] == [list(edit.velocity)] * 2


def test_a_click_chooses_a_ball_and_moves_none(window: Window) -> None:
    press(window, "p")
    x, y = point(window, 600, 100)
    drag(window, (x, y), (x + 2, y))
    assert given(window) == []
    assert window.grasp.ball(window.stage.moment) == 2
    drag(window, point(window, 400, 500), point(window, 410, 500))
    assert window.grasp.ball(window.stage.moment) is None


def test_a_velocity_in_hand_is_drawn_and_left_as_it_was_when_the_focus_is_lost(window: Window) -> None:
    press(window, "p")
    start, end = point(window, 600, 100), point(window, 700, 100)
    mouse(window, pygame.MOUSEBUTTONDOWN, start)
    mouse(window, pygame.MOUSEMOTION, end)
    window.draw()
    for pane in (0, 1):
        assert colour_at(window, 660, 100, pane) == (0, 0, 0)
    window.on_event(Event(pygame.WINDOWFOCUSLOST))
    assert given(window) == []
    window.draw()
    assert colour_at(window, 660, 100) == (255, 255, 255)


def test_keys_choose_balls_and_push_them(window: Window) -> None:
    press(window, "Up", shift=True)
    assert "no ball is chosen" in window.status
    press(window, ".", ".", ".", ",")
    assert window.grasp.ball(window.stage.moment) == 1
    for key, velocity in (("Right", [30, 0]), ("Down", [30, 30]), ("Left", [0, 30]), ("Up", [0, 0])):
        press(window, key, shift=True)
        assert window.panes[1].state.velocity[1].tolist() == velocity
    assert len(given(window)) == 4
    assert step(window) == 0


def test_a_chosen_ball_stays_so_when_others_come_and_go(window: Window) -> None:
    press(window, ",")
    hover(window, point(window, 200, 300))
    press(window, "Delete")
    assert given(window) == [DeleteBall(step=0, ball=0)]
    assert window.grasp.ball(window.stage.moment) == 1
    window.on_event(Event(pygame.WINDOWLEAVE))
    press(window, "Delete")
    assert window.grasp.ball(window.stage.moment) is None
    press(window, "Delete")
    assert "no ball is chosen" in window.status
    press(window, "undo")
    assert window.grasp.ball(window.stage.moment) == 1
    window.draw()


def test_the_last_ball_is_not_deleted() -> None:
    window = Window(scene_of("radius = 20\nposition = [200, 300]"), None)
    press(window, ".", "Delete")
    assert "balls are none" in window.status
    assert given(window) == []


def test_a_ball_is_added_at_the_mouse_like_the_chosen_one_and_inside_the_arena(window: Window) -> None:
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


def test_a_ball_is_not_added_on_another_nor_on_a_wall() -> None:
    scene = scene_of(
        "radius = 20\nposition = [200, 300]", more="walls = [{ from = [400, 300], to = [500, 300], thickness = 10 }]"
    )
    window = Window(scene, None)
    for x, y in ((235, 300), (450, 320)):
        hover(window, point(window, x, y))
        press(window, "a")
        assert "no room" in window.status
    assert given(window) == []


def test_the_button_lets_the_next_click_place_a_ball_and_the_keyboard_alone_finds_room(window: Window) -> None:
    [place] = [
        place
        for widget, place in zip(window.toolbar.widgets, window.layout.toolbar, strict=True)
        if "add a ball" in widget.tip
    ]
    drag(window, place.center, place.center)
    assert window.grasp.adding
    hover(window, point(window, 300, 500))
    window.draw()
    assert (0, 0, 0) in {colour_at(window, x, 500) for x in range(306, 315)}  # its outline
    drag(window, point(window, 300, 500), point(window, 300, 500))
    assert [type(one) for one in given(window)] == [AddBall]
    assert not window.grasp.adding
    window.on_event(Event(pygame.WINDOWLEAVE))
    press(window, "a")
    assert window.panes[0].state.position[-1] == pytest.approx([400, 300], abs=10)
    press(window, "a")
    assert np.linalg.norm(window.panes[0].state.position[-1] - window.panes[0].state.position[-2]) >= 20
    assert len(window.stage.moment.balls) == 6


def slider(window: Window, name: str) -> tuple[Slider, pygame.Rect]:
    [found] = [
        (widget, place)
        for widget, place in zip(window.toolbar.widgets, window.layout.toolbar, strict=True)
        if isinstance(widget, Slider) and widget.name == name
    ]
    return found


def test_a_slider_s_drag_is_one_edit_when_it_is_let_go(window: Window) -> None:
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


def test_sliders_by_keyboard_set_gravity_and_rate_and_time_goes_on(window: Window) -> None:
    run(window, 30)
    names = [widget.name if isinstance(widget, Slider) else "" for widget in window.toolbar.widgets]
    press(window, *["Tab"] * (names.index("gravity") + 1), *["Right"] * 2)
    press(window, *["Tab"] * (names.index("rate") - names.index("gravity")), "Right", "Esc")
    assert given(window) == [
        SetGravity(step=30, gravity=(0, 100)),
        SetGravity(step=30, gravity=(0, 200)),
        SetRate(step=30, rate=120),
    ]
    run(window, 60)
    assert window.stage.moment.time == 1.0
    window.player.paused = False
    for _ in range(30):
        window.advance(1 / 60)
    assert window.stage.moment.time == pytest.approx(1.5, abs=0.02)


def test_a_refused_edit_is_told(scene: Scene) -> None:
    window = Window(scene_of("radius = 20\nposition = [200, 300]"), None)
    window.set_gravity(900.0)
    assert "article: gravity is not part of the article's rule" in window.status
    assert given(window) == []


def test_undo_and_redo_by_keys_and_a_throw_is_one_deed(window: Window) -> None:
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 600, 100))
    for k in range(20):
        mouse(window, pygame.MOUSEMOTION, point(window, 600 - 5 * k, 100 + 4 * k))
        run(window, 1)
    mouse(window, pygame.MOUSEBUTTONUP, point(window, 500, 180))
    thrown = shown(window)
    press(window, "undo")
    assert (step(window), given(window)) == (0, [])
    press(window, "u")
    assert "nothing to undo" in window.status
    press(window, "redo")
    assert shown(window) == thrown
    assert [type(one) for one in given(window) if one.do != "move"] == [Grab, Release]
    press(window, "y")
    assert "nothing to do again" in window.status


def test_a_ball_in_hand_is_let_go_when_one_leaves_the_time(window: Window) -> None:
    run(window, 10)
    window.player.paused = False
    x, y = window.panes[0].state.position[2]
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, x, y))
    run(window, 3)
    press(window, "Left")
    window.player.paused = False
    press(window, "End")
    assert window.stage.moment.held is None
    assert [one.do for one in given(window)] == ["grab", "release"]


def thrown(window: Window) -> list[Input]:
    """Drag a ball for twenty steps, let it go, and go back to the midst of that; return what was given."""
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 600, 100))
    for k in range(20):
        mouse(window, pygame.MOUSEMOTION, point(window, 600 - 5 * k, 100 + 4 * k))
        run(window, 1)
    mouse(window, pygame.MOUSEBUTTONUP, point(window, 500, 180))
    run(window, 10)
    done = given(window)
    window.player.seek(10)
    assert window.stage.moment.held == 2
    return done


def test_who_only_looks_at_an_earlier_drag_drops_nothing_of_it(window: Window) -> None:
    done = thrown(window)
    window.draw()
    strip = window.layout.strip
    hover(window, point(window, 300, 500))
    drag(window, strip.center, (strip.x + strip.width // 3, strip.centery))
    drag(window, window.layout.toolbar[0].center, (5, 5))
    window.on_event(Event(pygame.WINDOWFOCUSLOST))
    window.player.seek(10)
    run(window, 2)
    press(window, "Left", "Home", "Right", "End")
    assert given(window) == done
    window.player.seek(10)
    while step(window) < 30:
        hover(window, point(window, 300, 500))
        window.player.one_step()
    assert window.stage.session.inputs == done


def test_an_edit_in_the_midst_of_an_earlier_drag_leaves_no_ball_in_nobody_s_hand(window: Window) -> None:
    thrown(window)
    window.set_gravity(300.0)
    run(window, 5)
    assert window.stage.moment.held is None


@pytest.mark.parametrize("lost", [Event(pygame.MOUSEBUTTONUP, button=1, pos=(5, 5)), Event(pygame.WINDOWFOCUSLOST)])
def test_what_the_mouse_holds_is_let_go_under_the_picker_too(window: Window, lost: Event) -> None:
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 600, 100))
    assert window.stage.session.held == 2
    press(window, "/")
    window.on_event(lost)
    assert window.stage.session.held is None
    press(window, "Esc")
    knob, place = slider(window, "speed")
    mouse(window, pygame.MOUSEBUTTONDOWN, place.midleft)
    press(window, "/")
    window.on_event(lost)
    press(window, "Esc")
    hover(window, place.midright)
    assert knob.value() == 0.01


def test_what_is_done_at_a_step_that_is_not_remembered_is_done_to_the_balls_as_they_are_there(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.session.history.MAX_RECENT", 8)
    monkeypatch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 12 * window.stage.moment.size)
    monkeypatch.setattr("sandbox.view.player.BUDGET", -1.0)
    run(window, 100)
    press(window, ".")
    for there, key, kind in ((37, "a", AddBall), (21, "Right", SetVelocity), (11, "Delete", DeleteBall)):
        window.player.seek(there)
        assert step(window) != there
        press(window, key, shift=key == "Right")
        [edit] = given(window)
        assert (type(edit), edit.step, step(window)) == (kind, there, there)
        if isinstance(edit, SetVelocity):
            at_that_step = simulate(window.scene, "pymunk", steps=there).velocity[there, 0]
            assert edit.velocity == (at_that_step[0] + 30, at_that_step[1])
        press(window, "undo")
        run(window, 100 - step(window))


def test_a_velocity_that_may_not_be_is_told(window: Window) -> None:
    fast = Window(scene_of("radius = 20\nposition = [200, 300]\nvelocity = [999999999, 0]"), ["exact"])
    press(fast, "p", ".")
    press(fast, "Right", shift=True)
    assert "velocity[0] must be at most 1e+09, got 1000000029" in fast.status
    assert given(fast) == []


def test_a_drag_far_outside_of_a_very_large_arena_pulls_to_its_edge() -> None:
    window = Window(scene_of("radius = 1e8\nposition = [5e8, 5e8]", size="[1e9, 1e9]"), ["exact"])
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 5e8, 5e8))
    mouse(window, pygame.MOUSEMOTION, (30_000, -30_000))
    assert given(window)[-1] == Move(step=0, at=(1e9, 0))


# --- Scenes ----------------------------------------------------------------------------------------------------


def test_what_is_saved_loads_to_what_was_shown(window: Window, tmp_path: Path) -> None:
    run(window, 33)
    press(window, "s", "save")
    hover(window, point(window, 10, 10, pane=1))
    press(window, "s")
    files = sorted(tmp_path.glob("*.toml"), key=os.path.getmtime)
    assert {file.name for file in files} == {"test-0-000033.toml", "test-0-000033-2.toml", "test-0-000033-3.toml"}
    assert "saved test-0-000033-3.toml: the balls as impulse has them" in window.status
    for file, pane in (("test-0-000033.toml", 0), ("test-0-000033-3.toml", 1)):
        start = spawn(load(tmp_path / file))
        assert [start.position.tobytes(), start.velocity.tobytes()] == shown(window)[2 * pane : 2 * pane + 2]


def test_a_name_too_long_to_be_saved_under_is_told(tmp_path: Path) -> None:
    file = tmp_path / ("x" * 245 + ".toml")
    file.write_text("[arena]\nsize = [90, 90]\n[[balls]]\nradius = 5\nposition = [9, 9]\n")
    window = Window(load(file), None)
    window.frame(1 / 60)
    window.save_picture()
    assert "cannot be written: File name too long" in window.status
    window.notice = ("", 0.0)
    press(window, "s")
    assert "cannot be written: File name too long" in window.status
    window.record()
    window.frame(1 / 60)
    window.record()
    assert "cannot be written: File name too long" in window.status
    assert list(tmp_path.iterdir()) == [file]


def test_the_picker_finds_by_typing_and_runs_what_is_chosen(window: Window) -> None:
    press(window, "/")
    window.draw()
    press(window, *"newton cradle", "Back")
    picker = window.shelf.picker
    assert picker
    assert [entry.name for entry in picker.found] == [
        "newtons-cradle",
        "truths/cradle-gapped",
        "truths/cradle-touching",
    ]
    press(window, "Right", "Right", "Right", "Left", "Enter")
    assert window.shelf.picker is None
    assert window.scene.title == load("truths/cradle-gapped").title


def test_the_picker_is_closed_by_escape_and_the_run_goes_on(window: Window) -> None:
    run(window, 3)
    press(window, "open", *"xyzzy", "Enter", "Esc")
    assert window.shelf.picker is None
    assert (step(window), window.running, window.scene.name) == (3, True, "test")


@pytest.mark.parametrize("size", [(1024, 640), (1280, 800), (3840, 2160)])
def test_every_scene_can_be_reached_by_keys_and_each_preview_shows_its_balls(
    size: tuple[int, int], window: Window
) -> None:
    window.screen = pygame.display.set_mode(size)
    press(window, "/")
    window.draw()
    picker = window.shelf.picker
    assert picker
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


def test_a_click_in_the_picker_runs_a_scene_and_its_picture_is_of_it(window: Window) -> None:
    press(window, "/", *"break-shot")
    window.draw()
    picker = window.shelf.picker
    assert picker
    [(_, place)] = picker.places()
    assert tuple(window.screen.get_at((place.x + 3, place.y + place.height // 3)))[:3] == rgb("#14532d")
    assert tuple(window.screen.get_at((place.x - 4, place.bottom)))[:3] == tuple(RAISED)[:3]
    drag(window, place.center, place.center)
    assert window.scene.name == "break-shot"


def test_the_wheel_turns_the_rows_of_the_picker(window: Window) -> None:
    press(window, "/")
    window.draw()
    picker = window.shelf.picker
    assert picker
    window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=-1))
    assert picker.chosen == picker.columns
    window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=9))
    assert picker.chosen == 0


def test_the_wheel_turns_the_rows_though_the_mouse_is_on_one(window: Window) -> None:
    press(window, "/")
    window.draw()
    picker = window.shelf.picker
    assert picker
    _, place = picker.places()[0]
    hover(window, place.center)
    window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=-1))
    for what in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):  # which pygame has of the wheel as well
        window.on_event(Event(what, pos=place.center, button=5))
    assert picker.chosen == picker.columns
    press(window, "Shift")
    assert picker.chosen == picker.columns


def test_what_is_in_the_folder_beside_scenes_does_not_stop_the_picker(window: Window, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "bytes.toml").write_bytes(bytes(range(256)) + b"[[balls]]")
    (tmp_path / os.fsdecode(b"no-unicode-\xff.toml")).write_text("[[balls]]")
    (tmp_path / "huge.toml").write_bytes(b"#" * 3_000_000 + b"[[balls]]")
    press(window, "/")
    window.draw()
    picker = window.shelf.picker
    assert picker
    own = [entry.name for entry in picker.found if entry.name.endswith(".toml")]
    assert own == ["bytes.toml", "no-unicode-\N{REPLACEMENT CHARACTER}.toml"]


def test_what_is_typed_in_the_picker_may_have_no_picture_or_be_very_long(window: Window) -> None:
    press(window, "/", "\ufe0f")
    window.draw()
    press(window, "Back", *"long" * 300, "\u0301", "\U0001f600", "\ud83d")
    window.draw()
    assert window.shelf.picker


def test_after_the_largest_seed_there_is_none(window: Window) -> None:
    window = Window(scene_of("radius = 20\nposition = [200, 300]", more="seed = 9223372036854775807"), None)
    press(window, "n")
    assert "seed must be less than" in window.status


def test_own_scenes_come_first_and_other_toml_is_left_out(window: Window, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("[arena]\nsize = [90, 90]\n[[balls]]\nradius = 5\nposition = [9, 9]\n")
    (tmp_path / "broken.toml").write_text("[[balls]]\n")
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    press(window, "/")
    picker = window.shelf.picker
    assert picker
    assert [entry.name for entry in picker.found][:3] == ["broken.toml", "mine.toml", next(iter(bundled()))]
    window.draw()
    press(window, *"mine.toml", "Enter")
    assert window.scene.arena.size == (90, 90)


def test_a_dropped_file_opens_and_a_broken_one_is_told_with_its_line(window: Window, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("[arena]\nsize = [90, 90]\n[[balls]]\nradius = 5\nposition = [9, 9]\n")
    window.on_event(Event(pygame.DROPFILE, file=str(file)))
    assert window.scene.arena.size == (90, 90)
    run(window, 4)
    broken = tmp_path / "broken.toml"
    broken.write_text("[arena]\nsize = [90, 90]\n[[balls]]\nradius = -5\nposition = [9, 9]\n")
    window.draw()
    before = pygame.surfarray.array3d(window.screen)
    window.on_event(Event(pygame.DROPFILE, file=str(broken)))
    assert (step(window), window.scene.arena.size) == (4, (90, 90))
    assert window.shelf.mistake == f"{broken}:4: balls[0].radius must be greater than 0, got -5"
    window.draw()
    assert (pygame.surfarray.array3d(window.screen) != before).any(axis=2).sum() > 5000
    press(window, "Esc")
    assert window.running
    window.draw()
    assert np.array_equal(pygame.surfarray.array3d(window.screen), before)


def test_of_twenty_edits_of_the_open_file_five_broken_none_loses_the_running_scene(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    text = 'title = "{}"\n[arena]\nsize = [800, 600]\n[[balls]]\nradius = {}\nposition = [100, 100]\n'
    file.write_text(text.format("first", 5))
    window = Window(load(file), None)
    running = "first"
    for k in range(20):
        broken = k % 4 == 2
        file.write_text(text.format(f"edit {k}", -5 if broken else 6 + k))
        window.shelf._looks_at = 0.0
        assert window.shelf.look_at_file()
        running = running if broken else f"edit {k}"
        assert window.scene.title == running
        assert bool(window.shelf.mistake) == broken
        run(window, 2)
        assert step(window) >= 2
        assert not window.shelf.look_at_file()


def test_a_watched_file_that_is_touched_or_away_for_a_moment_has_not_changed(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("one")
    watch = Watch(file)
    os.utime(file, ns=(1, 1))
    assert not watch.changed()
    file.unlink()
    assert not watch.changed()
    file.write_text("one")
    assert not watch.changed()
    file.write_text("two")
    assert watch.changed()
    assert not watch.changed()
