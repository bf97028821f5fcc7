"""A window whose reference lags: no frame waits for it, nothing is shown beside a ball of another time."""

import threading
import time
from collections.abc import Iterator

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame.event import Event
from window_driver import THREE_BALLS, given, press, step

from sandbox.run.edits import SetGravity
from sandbox.run.inputs import Input
from sandbox.run.trajectory import simulate
from sandbox.session.samples import Quantity
from sandbox.view import Layer
from sandbox.view.window import STOPPED, Window

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
    assert len(lagging.view.charts.samples) == 31
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


def test_time_stands_still_before_an_edit_of_a_replay_while_frames_go_on(gate: threading.Event) -> None:
    inputs: list[Input] = [SetGravity(step=10, gravity=(0, 500))]
    window = Window(scene_of(*THREE_BALLS), ["pymunk", "impulse"], inputs, beside=True)
    frames(window, 30)
    assert step(window) == 9
    gate.set()
    window.view.session.collect(None)
    frames(window, 1)
    assert window.view.moment.scene.gravity == (0, 500)
    window.view.session.stop()


@pytest.mark.parametrize("stop", [Event(pygame.KEYDOWN, key=pygame.K_ESCAPE), Event(pygame.QUIT)], ids=["Esc", "close"])
def test_an_edit_that_waits_for_the_reference_can_be_stopped(lagging: Window, stop: Event) -> None:
    frames(lagging, 20)
    pygame.event.clear()
    pygame.event.post(stop)
    begun = time.perf_counter()
    lagging.editor.select(0)
    press(lagging, "Delete")
    assert time.perf_counter() - begun < 1
    assert (given(lagging), lagging.notice.text) == ([], STOPPED)


def test_an_edit_comes_once_the_reference_is_there(lagging: Window, gate: threading.Event) -> None:
    frames(lagging, 20)
    pygame.event.clear()
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
