"""The engines of a run are exchanged, moved, added, removed and tuned."""

from pathlib import Path
from typing import Any

import hypothesis
import pygame
import pymunk
import pytest
from conftest import scene_of
from hypothesis import strategies as st
from window_driver import given, mouse, point, press, pull, run, shown, step

from sandbox.engines import create
from sandbox.engines.pymunk import PymunkEngine
from sandbox.engines.specs import settings_in, with_settings
from sandbox.run.edits import DeleteBall, SetGravity, SetRate
from sandbox.run.trajectory import simulate
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn
from sandbox.view.engines_page import MAX_PANES, SCALES, in_force, meaning_of, normal, with_setting
from sandbox.view.instruments import GAP
from sandbox.view.notice import NoticeKind
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


def test_a_setting_changes_the_engine_of_its_pane_and_no_other(window: Window) -> None:
    run(window, 90)
    before = shown(window)
    window.line_up.add(next(iter(window.line_up.choices)))
    assert names(window) == ["pymunk", "impulse", "pymunk(substeps=4)"]
    window.line_up.tune(2, "substeps", 1)
    assert "pymunk runs already" in window.messages.text
    window.line_up.tune(2, "iterations", 1)
    window.line_up.tune(2, "substeps", 1)
    assert names(window) == ["pymunk", "impulse", "pymunk(iterations=1)"]
    assert shown(window)[:4] == before
    check_replay(window)


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


def test_the_selected_ball_and_the_chart_stay(window: Window) -> None:
    press(window, "p")
    window.editor.select(1)
    run(window, 120)
    window.view.charts.show(GAP)
    window.line_up.add("exact")
    assert window.editor.selected == 1
    assert window.view.charts.instrument is GAP


def test_a_drag_ends_where_the_engines_change(window: Window) -> None:
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 600, 100))
    run(window, 5)
    window.line_up.add("exact")
    assert [one.do for one in given(window)] == ["grab", "release"]
    assert window.view.session.held is None
    check_replay(window)


@pytest.mark.parametrize(
    ("spec", "reason"),
    [
        ("article", "article: a second radius and a second mass"),
        ("pymunk", "pymunk runs already, in another pane"),
        ("pymunk(iterations=10)", "pymunk runs already, in another pane"),
        ("pymnk", "did you mean pymunk?"),
        ("pymunk(substep=2)", "did you mean substeps?"),
        ("exact(substeps=2)", "exact takes no settings"),
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
    for _ in range(MAX_PANES):
        window.line_up.add(next(iter(window.line_up.choices)))
    assert len(names(window)) == MAX_PANES
    assert "panes are the most" in window.notice.text
    while len(names(window)) > 1:
        window.line_up.remove(0)
    window.line_up.remove(0)
    assert "the last engine stays" in window.notice.text
    assert len(names(window)) == 1


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
    assert list(choices) == ["pymunk(substeps=4)", "article", "impulse", "exact", "box2d"]
    assert "a second radius" in choices["article"]
    assert choices["impulse"] == "impulse runs already"
    assert "pyb2d3, which is not installed" in choices["box2d"]
    assert choices["exact"] == choices["pymunk(substeps=4)"] == ""


def test_the_chosen_engines_run_after_a_restart_in_other_scenes_and_in_the_saved_command(window: Window) -> None:
    window.line_up.tune(0, "iterations", 30)
    window.line_up.tune(0, "substeps", 4)
    press(window, "r")
    wanted = ["pymunk(iterations=30, substeps=4)", "impulse"]
    assert names(window) == wanted
    press(window, "j")
    assert "--engines 'pymunk(iterations=30, substeps=4),impulse'" in window.notice.text
    window.scenes.try_to_run(load("oblique"))
    assert names(window) == wanted


PLAIN = scene_of("radius = 20\nposition = [200, 300]")
OWN = scene_of("radius = 20\nposition = [200, 300]", more="[pymunk]\nsubsteps = 4\ndamping = 0.9")
VALUES: dict[str, st.SearchStrategy[Any]] = {
    "iterations": st.integers(1, 1_000),
    "substeps": st.integers(1, 1_000),
    "collision_slop": st.floats(0, 1e6),
    "collision_bias": st.floats(0, 1),
    "collision_persistence": st.integers(0, 1_000_000),
    "damping": st.floats(0, 1, exclude_min=True),
    "walls_first": st.integers(0, 1),
}
specs = st.lists(st.sampled_from(list(VALUES)), unique=True, max_size=7).flatmap(
    lambda keys: st.fixed_dictionaries({key: VALUES[key] for key in keys}).map(
        lambda settings: with_settings("pymunk", settings)
    )
)
scenes = st.sampled_from([PLAIN, OWN])


@hypothesis.given(spec=specs, scene=scenes)
def test_the_shortest_spec_is_of_the_same_engine(spec: str, scene: Any) -> None:
    short = normal(spec, scene)
    assert in_force(short, scene) == in_force(spec, scene)
    assert normal(short, scene) == short
    own = in_force("pymunk", scene)
    assert all(value != own[key] for key, value in settings_in(short)[1].items())


@hypothesis.given(spec=specs, scene=scenes, key=st.sampled_from(list(VALUES)), data=st.data())
def test_a_setting_changed_and_changed_back_leaves_the_engine_as_it_was(
    spec: str, scene: Any, key: str, data: st.DataObject
) -> None:
    short, value = normal(spec, scene), data.draw(VALUES[key])
    changed = with_setting(short, scene, key, value)
    assert in_force(changed, scene) == in_force(short, scene) | {key: value}
    assert settings_in(with_setting(changed, scene, key, in_force(short, scene)[key])) == settings_in(short)


def test_the_values_in_force_are_those_of_the_space() -> None:
    for spec, scene in (("pymunk", PLAIN), ("pymunk(collision_slop=0.5, iterations=30)", OWN)):
        engine = create(spec, scene, spawn(scene))
        assert isinstance(engine, PymunkEngine)
        space = engine.space
        shown = in_force(spec, scene)
        assert {key: getattr(space, key) for key in shown if hasattr(pymunk.Space, key)} == {
            key: shown[key]
            for key in (
                *("iterations", "collision_slop", "collision_bias", "collision_persistence", "damping"),
                *("sleep_time_threshold", "idle_speed_threshold"),
            )
        }
    assert in_force("pymunk", OWN)["substeps"] == 4
    assert in_force("pymunk(substeps=2)", OWN)["substeps"] == 2


def test_the_scene_s_own_value_is_left_out_of_the_spec() -> None:
    assert with_setting("pymunk(substeps=4)", PLAIN, "substeps", 1) == "pymunk"
    assert with_setting("pymunk", OWN, "substeps", 1) == "pymunk(substeps=1)"
    assert with_setting("pymunk(substeps=1)", OWN, "substeps", 4) == "pymunk"
    assert normal("pymunk(substeps=2, iterations=30.0)", PLAIN) == "pymunk(substeps=2, iterations=30)"
    assert normal("mine(1).py:Mine", PLAIN) == "mine(1).py:Mine"


@pytest.mark.parametrize("key", SCALES)
def test_a_slider_has_only_valid_values_and_says_what_they_are(key: str) -> None:
    assert list(SCALES[key]) == sorted(set(SCALES[key]))
    for value in SCALES[key]:
        in_force(with_setting("pymunk", PLAIN, key, value), PLAIN)
    assert len(meaning_of(key)) > 10


def test_the_error_of_a_name_typed_wrongly_goes_when_the_right_one_runs(window: Window) -> None:
    window.line_up.add("exakt")
    assert window.notice.kind is NoticeKind.ERROR
    assert window.notice.text
    window.line_up.add("exact")
    assert not window.notice.text
