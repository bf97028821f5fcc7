"""A reference beside the loop: nothing waits for it, and in the end every byte is that of a run that does wait."""

import threading
import time
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from conftest import scene_of
from moments import THREE_BALLS, THROW, flat, perform, run

from sandbox.compiled import compiled
from sandbox.engines.exact import engine as exact_engine
from sandbox.engines.exact.event_loop import UNFINISHED, Stop
from sandbox.run.edits import AddBall, AddWall, DeleteBall, SetGravity, SetRate
from sandbox.run.inputs import Grab, Input, Kick
from sandbox.scene.model import Scene
from sandbox.session.samples import Quantity
from sandbox.session.session import Session
from sandbox.state import Integers

HIDDEN, SHOWN = ("pymunk", "impulse"), ("exact", "pymunk")
EDITS: list[Input] = [
    *(SetGravity(step=4, gravity=(0, 500)), AddBall(step=9, position=(90, 90), radius=9)),
    *(Kick(step=12, ball=0, velocity=(30, -9)), DeleteBall(step=20, ball=1)),
    *(SetRate(step=22, rate=100), AddWall(step=25, start=(20, 580), to=(300, 590))),
]


@pytest.fixture
def scene() -> Scene:
    return scene_of(*THREE_BALLS)


def everything(session: Session) -> tuple[list[list[object]], bytes, list[int]]:
    """Return all moments and samples of a session."""
    session.collect(None)
    series = session.samples.series
    return [flat(moment) for moment in session.moments(0, session.end)], series.rows.tobytes(), series.steps.tolist()


def throw(session: Session) -> None:
    perform(session, THROW, 40)


def edit(session: Session) -> None:
    perform(session, EDITS, 40)


def replay(session: Session) -> None:
    session.inputs = [*EDITS]
    run(session, 40)


def undo_and_redo(session: Session) -> None:
    throw(session)
    session.undo()
    run(session, 20)
    session.redo()
    run(session, 9)


def go_back(session: Session) -> None:
    run(session, 40)
    session.seek(12)
    run(session, 9)
    session.seek(40)
    session.catch_up()
    session.seek(30)
    session.give(SetGravity(step=30, gravity=(0, 500)))
    run(session, 9)


@pytest.mark.parametrize("names", [HIDDEN, SHOWN], ids=["hidden", "shown"])
@pytest.mark.parametrize("act", [throw, edit, replay, undo_and_redo, go_back])
def test_whatever_is_done_every_moment_and_sample_has_the_bytes_of_a_run_without_lag(
    scene: Scene, act: Callable[[Session], None], names: Sequence[str]
) -> None:
    there, beside = (Session(scene, names, reference="exact", beside=lags) for lags in (False, True))
    for session in (there, beside):
        act(session)
    assert everything(beside) == everything(there)
    assert beside.inputs == there.inputs


@pytest.mark.parametrize("names", [HIDDEN, SHOWN], ids=["hidden", "shown"])
def test_steps_do_not_wait_and_are_completed_when_the_reference_arrives(
    scene: Scene, names: Sequence[str], gate: threading.Event
) -> None:
    there, session = (Session(scene, names, reference="exact", beside=lags) for lags in (False, True))
    run(there, 30)
    run(session, 30)
    assert session.lag == pytest.approx(0.5)
    assert set(session.shown.states) == {*names} - {"exact"}
    index = session.samples.engines.index("pymunk")
    assert np.isfinite(session.samples.of(Quantity.ENERGY)[:, index]).all()  # which does not wait either
    assert np.isnan(session.samples.of(Quantity.GAP)[1:, index]).all()
    assert (session.latest.step, len(session.samples.series)) == (0, 31)
    assert not session.collect()
    gate.set()
    assert session.collect(None)
    assert (session.lag, set(session.shown.states)) == (0, {*names, "exact"})
    assert everything(session) == everything(there)


def test_a_mouse_does_not_wait_and_an_edit_does(scene: Scene, gate: threading.Event) -> None:
    session = Session(scene, HIDDEN, reference="exact", beside=True)
    run(session, 20)
    session.give(Grab(step=20, ball=0, at=(9, 9)))
    assert session.lag == pytest.approx(20 / 60)
    session.inputs.append(AddBall(step=22, position=(90, 90), radius=9))  # as of a replay
    assert not session.waits
    run(session, 1)
    assert session.waits
    gate.set()
    run(session, 1)
    assert (session.latest.step, len(session.latest.states["exact"].position)) == (22, 4)


def test_steps_wait_for_a_reference_that_is_as_far_behind_as_the_history_goes_back(
    scene: Scene, gate: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandbox.session.session.MAX_RECENT", 10)
    session = Session(scene, HIDDEN, reference="exact", beside=True)
    run(session, 9)
    assert not session.waits
    run(session, 1)
    assert session.waits
    gate.set()
    run(session, 1)
    assert session.step == 11


def test_a_run_that_goes_elsewhere_keeps_no_moment_that_is_never_completed(scene: Scene, gate: threading.Event) -> None:
    session = Session(scene, SHOWN, beside=True)
    run(session, 20)
    session.seek(10)
    assert session.shown.step == 10
    assert not session.shown.is_complete
    gate.set()
    session.give(SetGravity(step=10, gravity=(0, 500)))
    session.collect(None)
    assert all(moment.is_complete for moment in session.moments(0, 20))
    assert session.shown.step == 10


@pytest.mark.parametrize("names", [HIDDEN, SHOWN], ids=["hidden", "shown"])
def test_a_limit_that_the_reference_reaches_is_in_the_same_moments(
    scene: Scene, names: Sequence[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exact_engine, "MAX_LOGGED_CONTACTS", 0)
    there, session = (Session(scene, names, reference="exact", beside=lags) for lags in (False, True))
    for each in (there, session):
        run(each, 60)
    assert everything(session) == everything(there)
    assert bool(session.dropped) == bool(there.dropped) == (names == HIDDEN)


def test_a_reference_that_computes_without_end_is_abandoned_at_once(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_step(*_: object) -> Stop:
        time.sleep(0.01)
        return Stop(UNFINISHED, -1, 0.0, 0, 300)

    before = set(threading.enumerate())
    session = Session(scene, HIDDEN, reference="exact", beside=True)
    monkeypatch.setattr(exact_engine, "simulate", no_step)
    [thread] = set(threading.enumerate()) - before
    run(session, 5)
    session.stop()
    begun = time.perf_counter()
    thread.join(5)
    assert time.perf_counter() - begun < 0.1
    assert session.lag == 0


def test_python_goes_on_while_a_kernel_runs_in_a_thread(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path))

    @compiled
    def spin(until: Integers, turns: Integers, most: int) -> None:
        while not until[0] and turns[0] < most:  # turns could be until, so both are read each time
            turns[0] += 1

    until, turns, most = np.zeros(1, np.int64), np.zeros(1, np.int64), 20_000_000_000
    spin(until, turns, 1)  # compiles it
    thread = threading.Thread(target=spin, args=(until, turns, most))
    thread.start()
    while turns[0] < 2:
        time.sleep(0.001)
    until[0] = 1
    thread.join()
    assert turns[0] < most
