"""Rewinding a run: the past is shown at once, repeated bit for bit, and replaced by new inputs."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import ball_at, scene_of
from moments import THREE_BALLS, THROW, flat, perform, run

from sandbox.errors import Refused, SandboxError
from sandbox.report.trajectory import simulate
from sandbox.run.edits import (
    AddBall,
    AddWall,
    ChangeBall,
    DeleteBall,
    Edit,
    SetElasticity,
    SetGravity,
    SetRate,
    SetVelocity,
)
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.model import Scene
from sandbox.session.history import History
from sandbox.session.samples import Quantity
from sandbox.session.session import Session

ENGINES = ("pymunk", "impulse")


@pytest.fixture
def session() -> Session:
    return Session(scene_of(*THREE_BALLS), ENGINES)


def is_replay(session: Session) -> bool:
    """Return whether the moment shown has the bytes of a new run with the inputs up to here."""
    moment = session.shown
    for name, state in moment.states.items():
        replay = simulate(session.start, name, steps=session.step, inputs=session.given())
        if replay.position[-1, list(moment.balls)].tobytes() != state.position.tobytes():
            return False
        if replay.velocity[-1, list(moment.balls)].tobytes() != state.velocity.tobytes():
            return False
    return moment.step == session.step


def test_kept_moments_are_shown_without_running_engines_and_the_end_stays(session: Session) -> None:
    run(session, 60)
    lockstep, end = session.lockstep, flat(session.shown)
    for step in (0, 59, 17, 33):
        session.seek(step)
        assert is_replay(session)
    assert (session.lockstep, lockstep.steps) == (lockstep, 60)
    session.seek(1000)
    assert (session.step, session.is_live, flat(session.shown)) == (60, True, end)


def test_engines_that_run_again_repeat_the_same_moments(session: Session) -> None:
    perform(session, [*THROW, SetGravity(step=20, gravity=(0, 500)), AddBall(step=20, position=(90, 90), radius=9)], 60)
    passed = []
    for step in range(61):
        session.seek(step)
        passed.append(flat(session.shown))
    session.seek(0)
    session.catch_up()
    for step in range(61):
        assert flat(session.shown) == passed[step]
        session.advance()


def test_a_run_continued_from_the_past_repeats_its_inputs_until_a_new_one(session: Session) -> None:
    perform(session, THROW, 40)
    thrown = flat(session.shown)
    session.seek(8)
    run(session, 32)
    assert flat(session.shown) == thrown
    session.seek(8)
    kick = SetVelocity(step=8, ball=0, velocity=(-60, 30))
    session.give(kick)
    assert (session.inputs, session.end) == ([THROW[0], kick, Release(step=8)], 8)
    run(session, 32)
    assert is_replay(session)
    assert flat(session.shown) != thrown


def test_a_replayed_drag_is_not_held_and_a_new_input_releases_it(session: Session) -> None:
    perform(session, THROW[:2], 12)
    assert session.held == 2
    perform(session, THROW[2:], 40)
    session.seek(8)
    session.catch_up()
    assert session.shown.held == 2
    assert session.held is None
    with pytest.raises(SandboxError):
        session.give(DeleteBall(step=8, ball=7))
    assert (session.inputs, session.shown.held) == (THROW, 2)
    session.give(Grab(step=8, ball=0, at=(300, 300)))
    assert session.inputs == [THROW[0], Release(step=8), Grab(step=8, ball=0, at=(300, 300))]
    assert session.held == 0
    session.give(SetVelocity(step=8, ball=1, velocity=(0, 0)))
    assert session.held == 0
    assert session.undo()
    session.catch_up()
    assert (session.shown.held, session.inputs) == (2, THROW)
    run(session, 20)
    assert is_replay(session)


def test_a_step_s_other_edits_are_applied_when_one_is_refused() -> None:
    gravity, kick = SetGravity(step=3, gravity=(0, 900)), SetVelocity(step=3, ball=0, velocity=(0, 60))
    session = Session(scene_of(ball_at(200, 300)), ["article"], [gravity, kick, gravity])
    run(session, 2)
    with pytest.raises(SandboxError, match=r"left out: .* is not part .*\nan edit is left out: "):
        session.advance()
    assert (session.step, session.inputs) == (3, [kick])
    assert session.shown.states["article"].velocity.tolist() == [[0, 60]]
    run(session, 10)
    assert is_replay(session)


ACTIONS: dict[str, list[Input]] = {
    "throw": THROW,
    "edit": [SetElasticity(step=10, elasticity=0.5)],
    "delete": [DeleteBall(step=10, ball=1)],
    "edit-while-holding": [THROW[0], SetGravity(step=8, gravity=(0, 900)), *THROW[1:]],
}


@pytest.mark.parametrize("action", ACTIONS.values(), ids=ACTIONS)
def test_undo_goes_to_before_the_last_action_and_redo_to_where_it_was_undone(
    session: Session, action: list[Input]
) -> None:
    earlier = SetVelocity(step=2, ball=0, velocity=(200, 40))
    perform(session, [earlier], action[0].step)
    before = flat(session.shown)
    perform(session, action, action[-1].step + 10)
    after = flat(session.shown)
    assert session.undo()
    assert session.shown.step < action[0].step  # and not what is undone
    session.catch_up()
    assert flat(session.shown) == before
    assert (session.inputs, session.end) == ([earlier], action[0].step)
    assert session.redo()
    session.catch_up()
    assert flat(session.shown) == after
    assert session.inputs == [earlier, *action]
    assert session.end == session.step
    assert is_replay(session)
    assert not session.redo()


def test_several_actions_are_undone_one_by_one_down_to_the_start(session: Session) -> None:
    first: list[Edit] = [AddBall(step=0, position=(400, 100), radius=5), SetRate(step=0, rate=120)]
    perform(session, [*first, *THROW, SetGravity(step=14, gravity=(0, 100))], 30)
    end = flat(session.shown)
    for kept in ([*first, *THROW], first, first[:1], []):
        assert session.undo()
        assert session.inputs == kept
    session.catch_up()
    assert not session.undo()
    assert is_replay(session)
    assert len(session.shown.scene.bodies) == 3
    for _ in range(4):
        assert session.redo()
    session.catch_up()
    assert flat(session.shown) == end


def test_undo_of_an_edit_in_the_past_brings_back_what_came_after_it(session: Session) -> None:
    perform(session, [SetVelocity(step=3, ball=0, velocity=(9, 9)), *THROW], 40)
    end, inputs = flat(session.shown), list(session.inputs)
    session.seek(4)
    session.give(SetGravity(step=4, gravity=(0, 500)))
    run(session, 9)
    assert session.undo()
    assert (session.step, session.inputs) == (4, inputs)
    run(session, 36)
    assert flat(session.shown) == end
    session.give(SetGravity(step=40, gravity=(0, 50)))
    assert not session.redo()


def test_a_refused_edit_changes_nothing_and_drops_nothing_to_come(session: Session) -> None:
    perform(session, [SetVelocity(step=6, ball=0, velocity=(0, 60))], 20)
    end, inputs = flat(session.shown), list(session.inputs)
    session.seek(3)
    with pytest.raises(SandboxError, match="ball must be at most 2"):
        session.give(DeleteBall(step=3, ball=7))
    assert session.inputs == inputs
    run(session, 17)
    assert flat(session.shown) == end


GRAVITY: list[Input] = [SetGravity(step=10, gravity=(0, 900)), SetGravity(step=30, gravity=(0, 0))]


def test_an_engine_that_cannot_run_an_edited_scene_returns_from_the_state_of_the_reference() -> None:
    scene = scene_of("radius = 20\npositions = [[200, 300], [260, 310]]\nvelocities = [[240, 0], [0, 60]]")
    session = Session(scene, ["article", "pymunk"], reference="exact")
    perform(session, GRAVITY, 30)
    article, samples = session.shown.engines["article"], session.samples
    assert article.state.position.tobytes() == session.shown.states["exact"].position.tobytes()
    assert article.energy - article.work == pytest.approx(session.samples.of(Quantity.OWN)[0, 0])
    session.seek(20)
    assert session.shown.suspended == {
        "article": "article: gravity is not part of the article's rule; use --engines impulse"
    }
    assert set(session.shown.states) == {"pymunk", "exact"}
    session.seek(30)
    run(session, 3)
    for known in (samples.of(Quantity.ENERGY)[:, 0], samples.of(Quantity.GAP)[:, 0], samples.errors()[:, 0]):
        assert np.flatnonzero(np.isnan(known)).tolist() == list(range(10, 30))
    assert samples.of(Quantity.GAP)[30, 0] == 0
    shown = flat(session.shown)
    for replay in (Session(scene, ["article", "pymunk"], GRAVITY, "exact"), session):
        replay.seek(0)
        assert flat(run(replay, 33).shown) == shown
    for _ in range(2):
        assert session.undo()
    run(session, 5)
    assert not session.shown.suspended
    with pytest.raises(Refused, match="article: gravity is not part"):  # as it is the reference itself
        Session(scene, ["article"]).give(SetGravity(step=0, gravity=(0, 900)))


def test_a_restart_keeps_edits_or_discards_them_and_either_can_be_undone(session: Session) -> None:
    perform(session, [SetGravity(step=4, gravity=(0, 900)), *THROW, SetElasticity(step=20, elasticity=0.5)], 30)
    before, inputs = flat(session.shown), session.inputs
    kept: list[Input] = [SetGravity(step=0, gravity=(0, 900)), SetElasticity(step=0, elasticity=0.5)]
    for keep, after in ((True, kept), (False, [])):
        session.restart(keep=keep)
        assert (session.step, session.end, session.inputs) == (0, 0, after)
        assert session.shown.scene.gravity == ((0, 900) if keep else (0, 0))
        run(session, 10)
        assert is_replay(session)
        assert session.undo()
        session.catch_up()
        assert (flat(session.shown), session.inputs) == (before, inputs)
        assert session.redo()
        assert (session.step, session.inputs) == (10, after)
        assert session.undo()
        session.catch_up()
    assert session.undo()
    assert session.inputs == inputs[:-1]


def test_times_map_to_steps_after_a_change_of_rate(session: Session) -> None:
    perform(session, [SetRate(step=30, rate=120)], 60)
    assert (session.shown.time, session.step_at(0.75), session.step_at(0.25)) == (0.75, 60, 15)


def test_steps_run_repeatedly_are_kept_once(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 10 * session.shown.size)
    for _ in range(20):
        session.seek(0)
        run(session, 15)
    for step in range(16):  # there is room for twenty
        session.seek(step)
        assert session.shown.step == step


@pytest.fixture
def late() -> Scene:
    """A ball that meets a wall: after it, Pymunk and exact have the ball elsewhere."""
    return scene_of(ball_at(700, 300, vx=330, elasticity=0.5), ball_at(100, 100, radius=5))


def without_room_in_exact(late: Scene) -> AddWall:
    """Return an edit after 60 steps that puts a wall into ball 0 in exact, and beside it in Pymunk."""
    exact, pymunk = (simulate(late, name, steps=60).position[-1, 0, 0] for name in ("exact", "pymunk"))
    away = pymunk - exact
    assert abs(away) > 1
    x = exact - 22 * np.sign(away) + away / 2
    return AddWall(step=60, start=(x, 200), to=(x, 400), thickness=4)


def test_an_edit_for_which_only_the_hidden_reference_has_no_room_is_refused(late: Scene) -> None:
    session = Session(late, ["pymunk"], reference="exact")
    run(session, 60)
    before = flat(session.shown)
    with pytest.raises(SandboxError, match="exact: ball 0 would overlap wall 0 by"):
        session.give(without_room_in_exact(late))
    assert flat(session.shown) == before
    assert session.inputs == []
    assert not session.lockstep.dropped


def test_an_edit_without_room_in_engines_that_run_in_place_of_others_is_dropped_and_reported(late: Scene) -> None:
    possible = ChangeBall(step=70, ball=1, x=100, y=200)
    inputs: list[Input] = [without_room_in_exact(late), possible]
    there, in_place = Session(late, ["pymunk"], inputs), Session(late, ["exact"], inputs)
    run(there, 80)
    assert there.inputs == inputs
    in_place.go_on_from(there)
    with pytest.raises(SandboxError, match="exact: ball 0 would overlap wall 0 by"):
        in_place.catch_up()
    in_place.catch_up()
    assert in_place.inputs == [possible]
    assert is_replay(in_place)
    assert [moment.step for moment in in_place.moments(0, 80)] == list(range(81))


def test_a_reference_that_comes_late_and_has_no_room_for_an_edit_is_dropped_and_the_edit_stays(late: Scene) -> None:
    edit = without_room_in_exact(late)
    session = Session(late, ["pymunk"], [edit], reference="exact")
    run(session, 70)
    assert session.inputs == [edit]
    assert list(session.shown.states) == ["pymunk"]
    assert session.lockstep.dropped.startswith("exact: ball 0 would overlap wall 0 by")
    assert is_replay(session)


def test_only_the_last_move_of_a_step_counts(session: Session) -> None:
    session.give(Grab(step=0, ball=2, at=(600, 200)))
    for x in range(100):
        session.give(Move(step=0, at=(500.0 + x, 300)))
    assert [given.do for given in session.inputs] == ["grab", "move"]
    run(session, 10)
    assert session.shown.target == (599, 300)
    assert is_replay(session)


def test_large_moments_are_few(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 3.5 * session.shown.size)
    memory = History()
    for step in range(100):
        session.seek(0)
        moment = session.shown
        memory.keep(replace(moment, step=step))
    assert [step for step in range(100) if memory.nearest(step).step == step] == [0, 64, 97, 98, 99]
