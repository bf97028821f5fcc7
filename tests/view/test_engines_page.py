"""Engines are added to a run and removed from it, by the page of the engines."""

from pathlib import Path

import pygame
import pytest
from conftest import scene_of
from window_driver import click, colours, given, mouse, point, press, pull, run, shown, step, tool

from sandbox.report.trajectory import simulate
from sandbox.run.edits import DeleteBall, SetGravity, SetRate
from sandbox.scene.files import load
from sandbox.view.engines_page import FULL, MAX_PANES
from sandbox.view.instruments import GAP
from sandbox.view.notice import NoticeKind
from sandbox.view.theme import chart_palette
from sandbox.view.widgets import TextButton, Words
from sandbox.view.widgets.fields import Field
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")
MINE = """
from sandbox.errors import Refused
from sandbox.state import State

class Still:
    def __init__(self, scene, initial):
        if scene.gravity[1]:
            raise Refused("Still: gravity would move its balls; use impulse")
        self.initial, self.steps, self.rate = initial, 0, scene.rate

    def step(self):
        self.steps += 1

    def state(self):
        start = self.initial
        return State(self.steps / self.rate, start.position.copy(), start.velocity.copy(), start.angle.copy(),
                     start.spin.copy())

    def kick(self, ball, dv):
        pass
"""


def names(window: Window) -> list[str]:
    """Return the engines, after checking that panes and session agree."""
    assert [pane.name for pane in window.view.panes] == window.view.session.names
    return window.view.session.names


def check_replay(window: Window) -> None:
    """Check that every pane shows the bytes of a run of its own with the same inputs."""
    for pane in window.view.panes:
        replay = simulate(window.scene, pane.name, steps=step(window), inputs=given(window))
        balls = list(window.view.moment.balls)
        for what in ("position", "velocity", "angle", "spin"):
            assert getattr(replay, what)[-1, balls].tobytes() == getattr(pane.state, what).tobytes(), pane.name


def button(window: Window, text: str) -> TextButton:
    """Return the first button of the page with a text."""
    found = (widget for row in window.line_up.rows() for widget in row if isinstance(widget, TextButton))
    return next(widget for widget in found if widget.text == text)


def everything(window: Window) -> tuple[object, ...]:
    session = window.view.session
    return names(window), [*session.inputs], session.step, session.end, shown(window), window.scenes.engines


@pytest.fixture
def used(window: Window) -> Window:
    """Throw a ball, edit gravity and rate, delete a ball."""
    pull(window, (600, 100), (-9, 7), steps=10)
    window.editor.set_gravity(300.0)
    run(window, 10)
    window.playback.give(SetRate(step=step(window), rate=120))
    run(window, 30)
    window.playback.give(DeleteBall(step=step(window), ball=0))
    run(window, 10)
    return window


def test_engines_added_and_removed_run_as_if_they_had_from_the_start(used: Window) -> None:
    line_up, here = used.line_up, step(used)
    line_up.add("pymunk(substeps=4)")
    assert names(used) == ["pymunk", "impulse", "pymunk(substeps=4)"]
    check_replay(used)
    line_up.add("exact")
    line_up.remove(1)
    line_up.remove(0)
    assert names(used) == ["pymunk(substeps=4)", "exact"]
    assert step(used) == here == used.view.session.end
    check_replay(used)
    run(used, 20)
    check_replay(used)


def test_later_steps_inputs_to_come_and_redo_stay(used: Window) -> None:
    session = used.view.session
    used.playback.undo()  # the ball that was deleted
    used.playback.seek(25)
    inputs, end = [*session.inputs], session.end
    used.line_up.add("exact")
    session = used.view.session
    assert (session.inputs, session.step, session.end) == (inputs, 25, end)
    check_replay(used)
    assert used.view.charts.samples.times[-1] == pytest.approx(session.step_at(0) + used.view.session.lockstep.time)
    used.playback.redo()
    assert len(used.view.moment.balls) == 2
    check_replay(used)


def test_a_drag_ends_where_the_engines_change_and_the_selected_ball_and_the_chart_stay(window: Window) -> None:
    window.view.charts.show(GAP)
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 600, 100))
    run(window, 5)
    window.line_up.add("exact")
    assert [one.do for one in given(window)] == ["grab", "release"]
    assert (window.view.session.held, window.editor.selected, window.view.charts.instrument) == (None, 2, GAP)
    check_replay(window)


@pytest.mark.parametrize(
    ("spec", "reason"),
    [
        ("article", "article: a second radius and a second mass"),
        ("pymunk", "pymunk runs already, in another pane"),
        ("pymnk", "did you mean pymunk?"),
        ("pymunk(substep=2)", "did you mean substeps?"),
        ("exact(substeps=2)", "only pymunk takes settings"),
        ("", "no engine ''"),
        ("nothing.py:Mine", "nothing.py"),
        ("mine.py:Other", "has no class or function 'Other'"),
    ],
)
def test_an_engine_that_is_refused_changes_nothing(used: Window, spec: str, reason: str, working_folder: Path) -> None:
    (working_folder / "mine.py").write_text(MINE)
    before = everything(used)
    used.line_up.add(spec)
    assert reason in used.notice.text
    assert everything(used) == before
    check_replay(used)
    run(used, 5)
    check_replay(used)


@pytest.mark.parametrize("spec", ["article", "mine.py:Still"])
def test_an_engine_that_cannot_run_an_edit_stands_still_from_there_on(spec: str, working_folder: Path) -> None:
    (working_folder / "mine.py").write_text(MINE)
    window = Window(scene_of("radius = 20\nposition = [200, 300]\nvelocity = [60, 0]"), ["pymunk"])
    run(window, 20)
    window.playback.give(SetGravity(step=20, gravity=(0.0, 90.0)))
    run(window, 10)
    window.line_up.add(spec)
    pane = window.view.panes[1]
    assert (step(window), pane.is_suspended, len(given(window))) == (30, True, 1)
    assert "gravity" in pane.stands
    assert "--engines" not in pane.stands
    window.draw()
    window.playback.undo()
    run(window, 3)
    assert (window.view.panes[1].is_suspended, window.view.panes[1].stands) == (False, "")
    window.playback.redo()
    assert (window.view.panes[1].is_suspended, step(window)) == (True, 30)


def test_the_last_pane_stays_and_there_is_a_most(window: Window) -> None:
    for substeps in range(2, MAX_PANES + 1):
        window.line_up.add(f"pymunk(substeps={substeps})")
    assert len(names(window)) == MAX_PANES
    assert "panes are the most" in window.notice.text
    assert button(window, "exact").refusal() == FULL
    while len(names(window)) > 1:
        assert button(window, "Remove").refusal() == ""
        window.line_up.remove(0)
    assert "the last engine stays" in button(window, "Remove").refusal()


def test_an_engine_in_a_file_can_be_added_removed_and_added_again(window: Window, working_folder: Path) -> None:
    (working_folder / "mine.py").write_text(MINE)
    run(window, 12)
    window.line_up.add(" mine.py:Still ")
    assert names(window)[-1] == "mine.py:Still"
    check_replay(window)
    window.line_up.add("mine.py:Still")
    assert "mine.py:Still runs already" in window.notice.text
    window.line_up.remove(2)
    window.line_up.add("mine.py:Still")
    assert names(window)[-1] == "mine.py:Still"


def test_every_engine_can_be_chosen_or_says_why_not(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.engines.find_spec", lambda _: None)  # of the library that an extra needs
    choices = window.line_up.choices
    assert list(choices) == ["pymunk", "article", "impulse", "exact", "box2d"]
    assert "a second radius" in choices["article"]
    assert choices["impulse"] == "impulse runs already"
    assert "pyb2d3, which is not installed" in choices["box2d"]
    assert choices["exact"] == ""


def test_the_chosen_engines_run_after_a_restart_in_other_scenes_and_in_the_saved_command(window: Window) -> None:
    window.line_up.add("pymunk(iterations=30, substeps=4)")
    window.line_up.remove(0)
    press(window, "r")
    wanted = ["impulse", "pymunk(iterations=30, substeps=4)"]
    assert names(window) == wanted
    press(window, "j")
    assert "--engines 'impulse,pymunk(iterations=30, substeps=4)'" in window.notice.text
    window.scenes.try_to_run(load("oblique"))
    assert names(window) == wanted


def test_panes_are_added_and_removed_by_the_mouse_or_typed(window: Window) -> None:
    run(window, 20)
    press(window, "F4")
    click(window, tool(window, "exact"))
    assert names(window) == ["pymunk", "impulse", "exact"]
    click(window, tool(window, "article"))  # which is grey
    click(window, tool(window, "Remove"))
    assert names(window) == ["impulse", "exact"]
    click(window, next(place.center for widget, place in window._placed if isinstance(widget, Field)))
    press(window, *"pymnk", "Enter")
    assert window.notice.kind is NoticeKind.ERROR
    assert "did you mean pymunk?" in window.messages.text
    click(window, next(place.center for widget, place in window._placed if isinstance(widget, Field)))
    press(window, *"pymunk(damping=0.5)", "Enter")
    assert names(window) == ["impulse", "exact", "pymunk(damping=0.5)"]
    assert not window.notice.text
    assert step(window) == 20


def test_each_pane_has_the_colour_of_its_lines_in_the_charts(window: Window) -> None:
    run(window, 20)
    press(window, "F4")
    window.draw()
    lines = {name: tuple(colour)[:3] for name, colour in chart_palette().engines(names(window)).items()}
    assert len(set(lines.values())) == 2
    for pane, name in enumerate(names(window)):
        heading = next(place for widget, place in window._placed if isinstance(widget, Words) and widget.text == name)
        for place in (heading, window.layout.title(pane)):
            seen = colours(window.screen.subsurface(place))
            assert lines[name] in seen
            assert lines[names(window)[1 - pane]] not in seen
    assert lines["impulse"] in colours(window.screen.subsurface(window.layout.strip))
