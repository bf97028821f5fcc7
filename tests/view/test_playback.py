"""Time passes, is paused, and goes back and forward."""

import math
import re
from pathlib import Path

import numpy as np
import pygame
import pytest
from conftest import ball_at, scene_of
from pygame.event import Event
from window_driver import WorkerHere, colour_at, given, mouse, press, run, shown, step

from sandbox.report.trajectory import simulate
from sandbox.scene.fields import rgb
from sandbox.session.samples import Quantity
from sandbox.view.case_so_far import CaseSoFar
from sandbox.view.display import new_events
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def test_pause_stops_time_and_step_keys_do_one_step(window: Window) -> None:
    press(window, "Space")
    assert window.playback.paused
    press(window, "Right")
    press(window, "Right")
    assert window.view.session.lockstep.steps == 2
    assert window.view.panes[0].state.position[0].tolist() == [208, 300]
    press(window, "Space")
    assert not window.playback.paused


def test_time_passes_at_the_scene_s_rate_times_the_speed(window: Window) -> None:
    for _ in range(30):
        window.playback.advance(1 / 60)
    assert window.view.session.lockstep.steps == pytest.approx(30, abs=1)
    press(window, "+")
    before = window.view.session.lockstep.steps
    for _ in range(30):
        window.playback.advance(1 / 60)
    assert window.view.session.lockstep.steps - before == pytest.approx(60, abs=1)
    for _ in range(20):
        press(window, "-")
    assert window.playback.speed == 0.01


def test_slow_frames_slow_time_down_and_never_enlarge_a_step(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.view.playback.FRAME_BUDGET", -1.0)  # every frame is too slow
    window.playback.advance(10.0)
    assert window.view.session.lockstep.steps == 1
    window.playback.advance(0.0)
    assert window.view.session.lockstep.steps == 2
    window.playback.advance(0.0)
    assert window.view.session.lockstep.steps == 2
    expected = simulate(window.scene, "pymunk", steps=2)
    assert np.array_equal(window.view.panes[0].state.position, expected.position[2])


def test_keys_go_back_and_forward_and_the_panes_show_those_steps(window: Window) -> None:
    run(window, 90)
    end = shown(window)
    press(window, *["Left"] * 10)
    assert (step(window), window.playback.paused) == (80, True)
    window.draw()
    for pane, name in enumerate(("pymunk", "impulse")):
        x, y = simulate(window.scene, name, steps=80).position[80, 2]
        assert colour_at(window, x, y + 6, pane) == rgb(window.scene.colors[2])
    press(window, *["Right"] * 10)
    assert shown(window) == end
    press(window, "Home")
    assert step(window) == 0
    press(window, "End")
    assert shown(window) == end


@pytest.mark.parametrize("charts", [True, False])
def test_a_drag_in_the_charts_or_in_the_time_bar_goes_to_that_time_and_pauses(window: Window, charts: bool) -> None:
    run(window, 120)
    window.playback.paused = False
    if not charts:
        press(window, "h")
    window.draw()
    layout = window.layout
    assert bool(layout.strip.height) == charts
    if charts:
        plot = window.view.charts.plot(layout.strip, layout.text_height)
        places = {
            at: (layout.strip.x + plot.x + round(at / 20 * plot.width), layout.strip.centery) for at in (0.5, 1, 9)
        }
    else:
        bar = layout.bar
        places = {at: (bar.x + round(at / 20 * bar.width), bar.centery) for at in (0.5, 1, 9)}
    mouse(window, pygame.MOUSEBUTTONDOWN, places[1])
    assert step(window) == pytest.approx(60, abs=2)
    assert window.playback.paused
    mouse(window, pygame.MOUSEMOTION, places[0.5])
    assert step(window) == pytest.approx(30, abs=2)
    mouse(window, pygame.MOUSEMOTION, (-50, places[1][1] + 900))  # out of the window
    assert step(window) == 0
    mouse(window, pygame.MOUSEMOTION, places[9])
    assert step(window) == 120
    mouse(window, pygame.MOUSEBUTTONUP, places[9])
    mouse(window, pygame.MOUSEMOTION, places[1], held=False)
    assert step(window) == 120


def test_playing_from_an_earlier_step_waits_until_the_engines_have_caught_up(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(window, 60)
    end = shown(window)
    monkeypatch.setattr("sandbox.view.playback.FRAME_BUDGET", -1.0)  # every frame has time for one step
    window.playback.seek(25)
    window.playback.paused = False
    window.frame(1 / 60)
    assert step(window) == 25
    assert "catching up: 24 steps to go" in window.messages.text
    while step(window) < 60:
        window.frame(1 / 60)
    assert shown(window) == end


def test_a_step_not_in_the_history_is_shown_once_it_has_been_run_again(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.session.history.MAX_RECENT", 8)
    monkeypatch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 12 * window.view.moment.size)
    run(window, 100)
    monkeypatch.setattr("sandbox.view.playback.FRAME_BUDGET", -1.0)
    window.playback.seek(37)
    frames = 0
    while not window.playback.shows_current_step:
        assert step(window) != 37
        window.frame(0.0)
        frames += 1
    assert frames > 2
    assert shown(window)[0] == simulate(window.scene, "pymunk", steps=37).position[37].tobytes()


def test_an_edit_in_the_past_removes_later_samples_from_the_charts(window: Window) -> None:
    run(window, 60)
    steps = window.view.session.samples.series.steps
    window.playback.seek(20)
    assert steps[-1] == 60
    window.editor.select(0)
    press(window, "Delete")
    assert window.view.session.samples.series.steps[-1] == 20
    run(window, 5)
    assert window.view.session.samples.times[-1] == pytest.approx(25 / 60)


def test_a_window_marks_what_the_last_steps_show(memory_screen: None) -> None:
    """A ball hits two others at once in step 50."""
    window = Window(scene_of(ball_at(100, 300, vx=200), ball_at(300, 279), ball_at(300, 321)), ["pymunk", "exact"])
    window.why.case = CaseSoFar(WorkerHere())
    run(window, 50)
    window.playback.paused = True
    for _ in range(3):
        window.frame(1 / 60)
    assert window.view.charts.marks.trust.undecided == pytest.approx(50 / 60)


# While engines run again before something can be done


@pytest.fixture
def behind(window: Window, monkeypatch: pytest.MonkeyPatch) -> Window:
    """Return a window whose engines must run 59 steps again before it can go on from where it is."""
    run(window, 60)
    press(window, "Left")
    monkeypatch.setattr("sandbox.view.playback.FRAME_BUDGET", -1.0)  # a step in each frame
    monkeypatch.setattr("sandbox.view.playback.MAX_WAIT", -1.0)
    return window


@pytest.mark.parametrize("asked", ["Delete", "Right", "save"])
def test_what_must_wait_too_long_for_engines_is_not_done_while_frames_go_on_with_them(
    behind: Window, asked: str
) -> None:
    before = step(behind), shown(behind)
    press(behind, asked)
    assert (step(behind), shown(behind)) == before
    assert (given(behind), list(Path().iterdir())) == ([], [])
    assert "try again" in behind.notice.text
    assert behind.view.session.lockstep.steps == 1  # an engine may be slow
    assert behind.messages.text == "catching up: 58 steps to go"
    for _ in range(58):
        behind.frame(1 / 60)
    assert behind.playback.rests
    press(behind, "Right")
    assert step(behind) == 60


def test_an_undo_that_takes_long_is_finished_in_the_next_frames(behind: Window) -> None:
    behind.playback.catch_up(9.0)
    behind.editor.set_gravity(500)
    run(behind, 30)
    press(behind, "undo")
    assert given(behind) == []
    for _ in range(59):
        behind.frame(1 / 60)
    assert (step(behind), behind.playback.rests) == (59, True)


def test_of_moves_of_the_mouse_in_a_row_the_last_counts(memory_screen: None) -> None:
    pygame.display.set_mode((100, 100))
    pygame.event.clear()
    move = [Event(pygame.MOUSEMOTION, pos=(x, 0), rel=(1, 0), buttons=(x // 4, 0, 0)) for x in range(8)]
    press_between = Event(pygame.KEYDOWN, key=pygame.K_v, unicode="v", mod=0)
    for event in (*move[:2], press_between, *move[2:]):
        pygame.event.post(event)
    assert new_events() == [move[1], press_between, move[3], move[7]]


@pytest.mark.parametrize("names", [["pymunk"], ["pymunk", "exact"]], ids=["hidden", "in a pane"])
def test_a_reference_that_reaches_its_limit_says_why_and_the_run_goes_on(
    window: Window, monkeypatch: pytest.MonkeyPatch, names: list[str]
) -> None:
    """Each step of a twin or of the original that has a contact is beyond the limit."""
    monkeypatch.setattr("sandbox.engines.exact.engine.MAX_LOGGED_CONTACTS", 0)
    window.begin(scene_of("radius = 20\nelasticity = 1\nposition = [400, 300]\nvelocity = [3600, 0]"), names)
    for _ in range(10):  # it touches the wall at 380/3600 s, in step 7
        window.playback.advance(1 / 60)
    assert window.view.session.step >= 9
    assert window.view.session.stopped is not None
    time, why = window.view.session.stopped
    assert time == pytest.approx(7 / 60)
    assert "limit of 0 contacts" in why
    pymunk, *shown = window.view.panes
    assert not pymunk.stands
    if shown:
        assert shown[0].state.position[0].tolist() == pytest.approx([400 + 3600 * 6 / 60, 300])
        assert shown[0].stands.endswith(why)
        assert np.isnan(window.view.session.samples.of(Quantity.GAP)[:, 0]).tolist() == [False] * 7 + [True] * 4
    else:
        assert window.notice.text.startswith(why)


def test_a_step_key_does_one_step_at_the_fastest_speed_too(window: Window) -> None:
    press(window, "Space")
    window.playback.speed = math.inf
    press(window, "Right")
    window.playback.advance(0.0)
    assert window.view.session.lockstep.steps == 1
    window.playback.advance(1 / 60)
    assert window.view.session.lockstep.steps > 1


def test_the_window_says_how_fast_the_run_its_frames_and_each_engine_are(window: Window) -> None:
    run(window, 60)
    window.playback.seek(0)  # which is no speed
    window.messages.measure(60, 1.2)
    run_of, frames, *engines = window.messages.speeds.split("    ")
    assert (run_of, frames) == ("0.83\N{MULTIPLICATION SIGN} real time", "50 frames a second")
    assert [re.sub(r" \d\S* ms$", "", each) for each in engines] == ["pymunk", "impulse", "exact"]


def test_after_a_jump_in_time_trails_include_the_steps_before(window: Window) -> None:
    run(window, 100)
    window.playback.seek(50)
    places = window.view.trail(window.view.panes[0])
    assert np.array_equal(places, simulate(window.scene, "pymunk", steps=50).position)
    window.editor.select(0)
    press(window, "Delete")
    assert window.view.trail(window.view.panes[0]).shape[1:] == (2, 2)
    window.draw()
