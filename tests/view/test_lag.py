"""A window whose reference lags: no frame waits for it, nothing is shown beside a ball of another time."""

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from conftest import scene_of
from window_driver import THREE_BALLS, given, press, step

from sandbox.report.trajectory import simulate
from sandbox.session.samples import Quantity
from sandbox.view import Layer
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


@pytest.fixture
def lagging(gate: threading.Event) -> Iterator[Window]:
    window = Window(scene_of(*THREE_BALLS), ["pymunk", "exact"], beside=True)
    window.showing |= {Layer.GHOSTS}
    yield window
    gate.set()
    window.view.session.stop()


def frames(window: Window, count: int) -> None:
    for _ in range(count):
        window.frame(1 / 60)


def until_there(window: Window) -> None:
    """Let frames pass until the reference is at the step shown."""
    for _ in range(1_000):
        time.sleep(0.001)
        window.frame(0.0)
        if not window.view.session.lag:
            return


def test_panes_move_on_while_the_reference_stands_and_the_status_says_how_far_behind_it_is(
    lagging: Window, gate: threading.Event
) -> None:
    frames(lagging, 30)
    pymunk, exact = lagging.view.panes
    assert (step(lagging), pymunk.step, exact.step) == (30, 30, 0)
    assert "exact 0.5 s behind" in lagging.view.charts.note
    assert np.isnan(lagging.view.charts.samples.of(Quantity.GAP)[1:]).all()
    press(lagging, "Space")
    gate.set()
    until_there(lagging)
    assert (pymunk.step, exact.step, lagging._is_drawn) == (30, 30, True)
    assert "behind" not in lagging.view.charts.note
    assert len(lagging.view.charts.samples.series) == 31
    expected = simulate(lagging.scene, "exact", steps=30)
    assert exact.state.position.tobytes() == expected.position[-1].tobytes()


def test_no_outlines_of_another_time_are_drawn(lagging: Window, gate: threading.Event) -> None:
    frames(lagging, 3)
    assert lagging.view._outlined is not None  # from shortly before
    frames(lagging, 10)
    assert lagging.view._outlined is None
    gate.set()
    press(lagging, "Space")
    until_there(lagging)
    assert lagging.view._outlined is lagging.view.moment.states["exact"]


def test_an_edit_or_a_step_does_not_wait_for_a_reference_that_is_far_behind(
    lagging: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.view.playback.MAX_WAIT", 0.0)
    monkeypatch.setattr("sandbox.session.session.MAX_RECENT", 20)
    frames(lagging, 20)
    press(lagging, "Right")
    assert lagging.notice.text == "exact is 0.3 s behind: wait until it is there"
    lagging.editor.select(0)
    for paused, what in ((False, "pause"), (True, "wait")):
        lagging.playback.paused = paused
        press(lagging, "Delete")
        assert (given(lagging), lagging.notice.text) == ([], f"exact is 0.3 s behind: {what} until it is there")


def test_an_edit_comes_once_the_reference_is_there(lagging: Window, gate: threading.Event) -> None:
    frames(lagging, 20)
    threading.Timer(0.1, gate.set).start()
    lagging.editor.select(0)
    press(lagging, "Delete")
    assert [len(pane.state.position) for pane in lagging.view.panes] == [2, 2]
    assert [pane.step for pane in lagging.view.panes] == [20, 20]


def test_another_scene_or_other_engines_abandon_what_is_computed(lagging: Window, gate: threading.Event) -> None:
    frames(lagging, 30)
    former = lagging.view.session
    lagging.begin(scene_of(*THREE_BALLS), ["pymunk"])
    assert former.lag == 0
    assert lagging.view.session.beside
    frames(lagging, 5)
    former = lagging.view.session
    gate.set()
    lagging.use_engines(["pymunk", "impulse"])
    assert former.lag == 0
    assert lagging.view.session.beside
