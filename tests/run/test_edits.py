"""Edits of a running scene: what they change in every engine, what they refuse, and replays to the byte."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import ball_at, bundled_scenes, do_steps, scene_of
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sandbox.analysis.comparison import compare
from sandbox.engines import registry
from sandbox.errors import Refused, SandboxError
from sandbox.report.trajectory import Trajectory, simulate
from sandbox.run.edits import (
    AddBall,
    AddWall,
    ChangeBall,
    ChangeWall,
    DeleteBall,
    DeleteWall,
    Edit,
    SetElasticity,
    SetGravity,
    SetRate,
    SetVelocity,
    edited,
)
from sandbox.run.inputs import Grab, Input, Move, Release, load_inputs, write_inputs
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import dump, load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.session.session import Session

ENGINES = ("pymunk", "impulse", "exact")
EDITS: dict[str, Edit] = {
    "add": AddBall(step=7, position=(600, 500), velocity=(-90, 30), radius=12.5, mass=2, elasticity=0.5, color="red"),
    "change": ChangeBall(step=7, ball=0, vx=90, radius=15, mass=2, elasticity=0.5, color="red"),
    "delete": DeleteBall(step=7, ball=1),
    "add-wall": AddWall(step=7, start=(400, 200), to=(600, 210), thickness=6, elasticity=0.9),
    "velocity": SetVelocity(step=7, ball=2, velocity=(0.1, -300)),
    "elasticity": SetElasticity(step=7, elasticity=0.9),
    "gravity": SetGravity(step=7, gravity=(0, 900)),
    "rate": SetRate(step=7, rate=240),
}


@pytest.fixture
def scene() -> Scene:
    """Three balls, two of which meet soon."""
    return scene_of(
        ball_at(200, 300, vx=120),
        ball_at(260, 310, mass=3),
        ball_at(500, 100, vx=70, vy=210, radius=10, colors=["green"]),
    )


def last(run: Trajectory) -> tuple[bytes, bytes]:
    return run.position[-1].tobytes(), run.velocity[-1].tobytes()


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_a_replay_of_an_edit_has_the_bytes_of_the_live_run_in_every_engine(scene: Scene, edit: Edit) -> None:
    lockstep = Lockstep(scene, ENGINES)
    do_steps(lockstep, 7)
    before = {name: state.position.copy() for name, state in lockstep.states().items()}
    lockstep.apply(edit)
    for name, state in lockstep.states().items():
        kept = np.delete(before[name], 1, axis=0) if isinstance(edit, DeleteBall) else before[name]
        assert state.position[: len(kept)].tobytes() == kept.tobytes()
    do_steps(lockstep, 60)
    for name, state in lockstep.states().items():
        replay = simulate(scene, name, steps=67, inputs=lockstep.given)
        assert replay.position[-1, lockstep.balls].tobytes() == state.position.tobytes()
        assert replay.velocity[-1, lockstep.balls].tobytes() == state.velocity.tobytes()
        assert replay.time[-1] == state.time == lockstep.time
        if not isinstance(edit, AddBall | DeleteBall):
            assert last(replay) != last(simulate(scene, name, steps=67))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("e", [0.0, 0.5, 0.9, 1.0])
def test_an_edit_of_elasticity_applies_to_balls_and_walls(engine: str, e: float) -> None:
    scene = scene_of(
        ball_at(200, 100, vx=120, elasticity=0.3),
        ball_at(300, 100, vx=-120),
        ball_at(700, 500, vx=240),
        more="walls = [{ from = [100, 300], to = [200, 300], elasticity = 0.2 }]",
    )
    run = simulate(scene, engine, steps=40, inputs=[SetElasticity(step=3, elasticity=e)])
    assert run.velocity[-1, 1, 0] - run.velocity[-1, 0, 0] == pytest.approx(240 * e, abs=1e-9)
    assert run.velocity[-1, 2, 0] == pytest.approx(-240 * e, abs=1e-9)
    edited = SetElasticity(step=3, elasticity=e).change_scene(scene)
    assert edited.walls[0].elasticity * edited.bodies.elasticity[0] == pytest.approx(e, rel=1e-15)


def test_time_continues_at_a_new_rate(scene: Scene) -> None:
    lockstep = Lockstep(scene, ENGINES, [SetRate(step=30, rate=120), SetRate(step=60, rate=50)])
    times = [lockstep.time]
    for _ in range(100):
        lockstep.step()
        times.append(lockstep.time)
    assert times[30::10] == pytest.approx([0.5, 0.5 + 1 / 12, 0.5 + 2 / 12, 0.75, 0.95, 1.15, 1.35, 1.55], rel=1e-15)
    for state in lockstep.states().values():
        assert state.time == times[-1]
        assert state.position[2] == pytest.approx([500 + 70 * times[-1], 100 + 210 * times[-1]], rel=1e-12)
    run = simulate(scene, "exact", steps=100, inputs=lockstep.given)
    assert run.time.tolist() == times


def test_contacts_before_and_after_an_edit_have_their_times() -> None:
    scene = scene_of(ball_at(770, 300, vx=600), more="rate = 100")
    times = [10 / 600, 10 / 600 + 760 / 600, 10 / 600 + 1520 / 600]  # of the wall contacts
    for engine, late in (("pymunk", 0.02), ("impulse", 0.01), ("exact", 1e-12)):
        inputs: list[Input] = [SetGravity(step=50, gravity=(0, 0)), SetRate(step=150, rate=200)]
        lockstep = Lockstep(scene, [engine], inputs)
        runner = lockstep.engines[engine]
        runner.record_contacts()
        while lockstep.time < 2.6:
            lockstep.step()
        found = runner.contacts()["time"]
        assert found == pytest.approx(times, abs=late)
        assert len(runner.contacts()) == 0


def test_a_refused_edit_changes_nothing(scene: Scene) -> None:
    scene = scene_of(ball_at(200, 300, vx=120))
    lockstep = Lockstep(scene, ["pymunk", "article"])
    lockstep.step()
    engines = {name: runner.engine for name, runner in lockstep.engines.items()}
    refused: list[tuple[Edit, str]] = [
        (SetGravity(step=1, gravity=(0, 900)), "article: gravity is not part of the article's rule"),
        (SetElasticity(step=1, elasticity=0.9), "article: elasticity below 1 is not part"),
        (AddBall(step=1, position=(400, 100), radius=10), "article: a second radius is not part"),
        (AddWall(step=1, start=(9, 9), to=(9, 99)), "article: an inner wall is not part"),
    ]
    for edit, message in refused:
        with pytest.raises(Refused, match=message):
            lockstep.apply(edit)
    assert {name: runner.engine for name, runner in lockstep.engines.items()} == engines
    assert (lockstep.scene, lockstep.given, lockstep.balls) == (scene, [], [0])


def test_the_mouse_keeps_its_ball_if_another_is_deleted_and_releases_it_if_it_is(scene: Scene) -> None:
    lockstep = Lockstep(scene, ["pymunk"])
    lockstep.apply(Grab(step=0, ball=2, at=(700, 500)))
    lockstep.apply(DeleteBall(step=0, ball=2 - 2))
    assert lockstep.mouse.ball == 1
    lockstep.apply(SetRate(step=0, rate=1000))
    lockstep.apply(Move(step=0, at=(1e6, 500)))
    assert lockstep.mouse.target == (790, 500)
    do_steps(lockstep, 1000)
    assert lockstep.states()["pymunk"].position[1] == pytest.approx([790, 500], abs=0.5)
    lockstep.apply(DeleteBall(step=1000, ball=1))
    assert lockstep.mouse.ball is None
    lockstep.step()


def test_a_trace_numbers_balls_in_the_order_of_their_addition(scene: Scene, tmp_path: Path) -> None:
    inputs: list[Input] = [
        AddBall(step=2, position=(600, 500), radius=5, mass=7),
        DeleteBall(step=4, ball=1),
        SetVelocity(step=4, ball=2, velocity=(60, 0)),
    ]
    run = simulate(scene, "pymunk", steps=6, inputs=inputs)
    present = ~np.isnan(run.position[..., 0])
    assert [np.flatnonzero(row).tolist() for row in present] == [
        *[[0, 1, 2]] * 2, *[[0, 1, 2, 3]] * 2, *[[0, 2, 3]] * 3
    ]  # fmt: skip
    assert run.position[6, 3] == pytest.approx([602, 500])
    assert (run.radius.tolist(), run.mass.tolist()) == ([20, 20, 10, 5], [1, 3, 1, 7])
    run.save(tmp_path / "run.csv")
    rows = [line.split(",") for line in (tmp_path / "run.csv").read_text().splitlines()[1:]]
    assert [row[1] for row in rows] == [str(ball) for row in present for ball in np.flatnonzero(row)]


def test_recorded_edits_are_checked_against_the_balls_at_their_step(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "inputs.jsonl").write_text(
        '{"step": 1, "do": "grab", "ball": 3, "at": [1, 2]}\n'
        '{"step": 2, "do": "add", "position": [50, 50], "radius": 5}\n'
        '{"step": 2, "do": "grab", "ball": 3, "at": [1, 2]}\n'
        '{"step": 3, "do": "delete", "ball": 0}\n'
        '{"step": 3, "do": "velocity", "ball": 3, "velocity": [1, 2]}\n'
        '{"step": 3, "do": "add", "position": [1, 50], "radius": 5}\n'
        '{"step": 3, "do": "elasticity", "elasticity": 2}\n'
    )
    with pytest.raises(SandboxError) as caught:
        load_inputs(tmp_path / "inputs.jsonl", scene)
    assert [line.split("inputs.jsonl:")[1] for line in str(caught.value).splitlines()] == [
        "1: ball must be at most 2, got 3",
        "5: ball must be at most 2, got 3",
        "6: balls[3].position puts a ball outside the arena: x must be from 5 to 795, got 1",
        "7: elasticity must be at most 1, got 2",
    ]


def test_more_than_a_thousand_edits_are_an_error(scene: Scene, tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    write_inputs([SetGravity(step=0, gravity=(0, 1))] * 1000, path)
    assert len(load_inputs(path, scene)) == 1000
    write_inputs([SetGravity(step=0, gravity=(0, 1))] * 2000, path)
    with pytest.raises(SandboxError, match=r"inputs\.jsonl:1001: is edit 1,001; at most 1,000 are allowed$"):
        load_inputs(path, scene)


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_a_comparison_replays_edits_and_covers_what_follows_the_last(scene: Scene, edit: Edit) -> None:
    first = SetVelocity(step=3, ball=0, velocity=(150, 0))
    inputs: list[Input] = [first, edit, Grab(step=9, ball=0, at=(300, 400)), Release(step=20)]
    short = scene.changed(seconds=1.0)
    comparison = compare(short, ENGINES, inputs=inputs)
    assert comparison.since == 7 / 60
    assert comparison.time[-1] == pytest.approx(1 - 7 / 60)
    for name, run in comparison.runs.items():
        replay = simulate(short, name, inputs=inputs)
        there = ~np.isnan(replay.position[-1, :, 0])
        assert run.final.position.tobytes() == replay.position[-1, there].tobytes()
        assert run.path[0].tobytes() == replay.position[7, ~np.isnan(replay.position[7, :, 0])].astype("f4").tobytes()
        assert run.gap_max[0] < 1  # there was no contact yet; gravity's first step differs
        booked = {entry.cause.key: entry.energy for entry in run.figures.ledger}
        assert "untold" not in booked
        assert "hand" in booked
        assert sum(booked.values()) == pytest.approx(run.energy[-1] - run.energy[0], abs=1e-9 * run.energy.max())


@pytest.mark.parametrize("name", bundled_scenes())
def test_any_ball_of_any_scene_can_be_edited(name: str, tmp_path: Path) -> None:
    """In a saved scene, a group of several balls has a list of positions, and one of velocities."""
    dump(load(name), tmp_path / "saved.toml", spawn(load(name)))
    for scene in (load(name), load(tmp_path / "saved.toml")):
        state, bodies, count = spawn(scene), scene.bodies, len(scene.bodies)
        for ball in {0, count // 2, count - 1}:
            kept = np.delete(np.arange(count), ball)
            changes = ChangeBall(step=0, ball=ball, mass=3, color="red"), DeleteBall(step=0, ball=ball)
            for change, at in zip(changes, (kept, np.arange(count - 1)), strict=True):
                changed, after = edited(scene, change, {"exact": state}), change.change_state(state)
                if change is changes[0]:
                    assert (len(changed.bodies), changed.bodies.mass[ball], changed.colors[ball]) == (count, 3, "red")
                assert changed.bodies.radius[at].tolist() == bodies.radius[kept].tolist()
                assert changed.bodies.mass[at].tolist() == bodies.mass[kept].tolist()
                assert [changed.colors[k] for k in at] == [scene.colors[k] for k in kept]
                assert after.position[at].tobytes() == state.position[kept].tobytes()


EVERY = (*ENGINES, *({"box2d"} & set(registry())))  # if it is installed
WALL = "walls = [{ from = [500, 100], to = [500, 500], thickness = 20 }]"


def head_on(more: str = "") -> Scene:
    """A ball that flies at 120 px/s, and one at rest 100 px ahead: the edges meet after half a second."""
    return scene_of(ball_at(200, 300, vx=120), ball_at(300, 300), more=more)


# What changes


@pytest.mark.parametrize("engine", EVERY)
@pytest.mark.parametrize("e", [1.0, 0.5, 0.0])
def test_a_ball_of_another_mass_and_elasticity_collides_as_the_formula_says(engine: str, e: float) -> None:
    m = 2.0
    run = simulate(head_on(), engine, steps=50, inputs=[ChangeBall(step=5, ball=0, mass=m, elasticity=e)])
    together = m * 120 / (m + 1)
    assert run.velocity[-1, :, 0] == pytest.approx([together - e * 120 / (m + 1), together + e * m * 120 / (m + 1)])


def test_a_trace_has_the_mass_and_radius_of_each_step(tmp_path: Path) -> None:
    edits: list[Input] = [ChangeBall(step=3, ball=0, mass=4, radius=30), AddBall(step=4, position=(600, 100), radius=5)]
    run = simulate(head_on(), "exact", steps=6, inputs=edits)
    assert run.mass[:, 0].tolist() == [1, 1, 1, 4, 4, 4, 4]
    assert run.radius[:, 0].tolist() == [20, 20, 20, 30, 30, 30, 30]
    assert run.momentum[:, 0].tolist() == [120, 120, 120, 480, 480, 480, 480]
    run.save(tmp_path / "run.csv")
    rows = [line.split(",") for line in (tmp_path / "run.csv").read_text().splitlines()[1:]]
    assert [row[6:8] for row in rows if row[1] == "0"] == [["20.0", "1.0"]] * 3 + [["30.0", "4.0"]] * 4
    assert [row[6:8] for row in rows if row[1] == "2"] == [["5.0", "1.0"]] * 3
    plain = simulate(head_on(), "exact", steps=6, inputs=[ChangeBall(step=3, ball=0, vx=9)])
    assert (plain.mass.tolist(), plain.radius.tolist()) == ([1, 1], [20, 20])


@pytest.mark.parametrize("engine", EVERY)
def test_a_ball_bounces_off_the_walls_that_are_there(engine: str) -> None:
    """At 120 px/s a ball flies 2 px a step. The walls: at x = 500 from the start, moved to 400, and away."""
    scene = scene_of(ball_at(300, 300, vx=120), more=WALL)
    added = AddWall(step=1, start=(600, 0), to=(600, 600), thickness=20)
    again = AddWall(step=4, start=(500, 100), to=(500, 500), thickness=20)
    moved = ChangeWall(step=2, wall=0, start=(400, 100), to=(400, 500), elasticity=0.5)
    runs: dict[str, tuple[float, list[Input]]] = {
        "there": (470.0, []),
        "moved": (370.0, [moved]),
        "away": (780.0, [DeleteWall(step=2, wall=0)]),
        "another": (570.0, [added, DeleteWall(step=2, wall=0)]),
        "back": (470.0, [moved, DeleteWall(step=3, wall=0), again]),
    }
    for turn, edits in runs.values():
        run = simulate(scene, engine, steps=260, inputs=edits)
        assert run.position[:, 0, 0].max() == pytest.approx(turn, abs=2.01)
        expected = -60 if edits == [moved] else -120
        assert run.velocity[-1, 0, 0] == pytest.approx(expected)


# What is refused

REFUSED: list[tuple[Edit, str]] = [
    (ChangeBall(step=0, ball=1, x=475), "pymunk: ball 1 would overlap wall 0 by 5 px"),
    (ChangeBall(step=0, ball=1, radius=210, x=150, y=300), r"outside the arena: x must be from 210 to 590"),
    (ChangeBall(step=0, ball=1, x=790), r"balls\[1\].position puts a ball outside the arena: x must be from 20 to 780"),
    (ChangeBall(step=0, ball=2, radius=60), "pymunk: ball 2 would overlap the bottom wall by 10 px"),
    (ChangeBall(step=0, ball=3, mass=2), "ball must be at most 2, got 3"),
    (DeleteBall(step=0, ball=3), "ball must be at most 2, got 3"),
    (SetRate(step=0, rate=900_000), "seconds must be at most"),
    (AddBall(step=0, position=(500, 290), radius=50), "pymunk: ball 3 would overlap wall 0 by"),
    (AddWall(step=0, start=(100, 315), to=(400, 315)), "pymunk: ball 0 would overlap wall 1 by 7 px"),
    (ChangeWall(step=0, wall=0, start=(200, 200)), "pymunk: ball 1 would overlap wall 0 by 30 px"),
    (ChangeWall(step=0, wall=0, start=(500, 500.0000001)), "to is nearly the same point as from"),
    (DeleteWall(step=0, wall=1), "wall must be the number of one of the scene's 1 own walls, got 1"),
]


@pytest.mark.parametrize(("edit", "message"), REFUSED, ids=[message.split(":")[-1] for _, message in REFUSED])
def test_an_edit_without_room_is_refused_and_changes_nothing(edit: Edit, message: str) -> None:
    scene = scene_of(ball_at(200, 300, vx=120), ball_at(300, 300), ball_at(700, 550), more=WALL)
    lockstep = Lockstep(scene, ENGINES)
    engines = [runner.engine for runner in lockstep.engines.values()]
    with pytest.raises(SandboxError, match=message):
        lockstep.apply(edit)
    assert (lockstep.scene, lockstep.given, lockstep.edited) == (scene, [], False)
    assert [runner.engine for runner in lockstep.engines.values()] == engines


def test_balls_may_overlap_and_an_engine_with_a_ball_in_a_wall_is_named() -> None:
    scene = scene_of(ball_at(200, 300, vx=120, elasticity=0.5), ball_at(300, 310), ball_at(700, 500))
    lockstep = Lockstep(scene, ["exact", "impulse"])
    do_steps(lockstep, 90)
    x, y = lockstep.states()["exact"].position[1].tolist()
    lockstep.apply(ChangeBall(step=90, ball=2, x=x, y=y))
    away = lockstep.states()["impulse"].position[1, 0] - x
    assert abs(away) > 1e-3
    wall = x - 22 * np.sign(away) + away / 2
    with pytest.raises(SandboxError, match="exact: ball 1 would overlap wall 0 by"):
        lockstep.apply(AddWall(step=90, start=(wall, y - 50), to=(wall, y + 50), thickness=4))


def test_a_ball_may_touch_and_stay_as_deep_as_it_was() -> None:
    """A ball that rests on a wall and on the floor in Pymunk lies up to 0.1 px in them."""
    scene = scene_of(
        ball_at(200, 580, elasticity=0), ball_at(400, 270, elasticity=0),
        more="gravity = [0, 900]\nwalls = [{ from = [300, 300], to = [700, 300], thickness = 20 }]",
    )  # fmt: skip
    lockstep = Lockstep(scene, ENGINES)
    do_steps(lockstep, 60)
    assert (lockstep.states()["pymunk"].position[:, 1] > [580.001, 270.001]).all()
    lockstep.apply(ChangeBall(step=60, ball=0, x=300.3))
    lockstep.apply(ChangeBall(step=60, ball=1, x=600.7))
    lockstep.apply(ChangeWall(step=60, wall=0, start=(200, 300)))
    lockstep.apply(ChangeBall(step=60, ball=1, x=780, y=100))
    assert lockstep.states()["exact"].position.tolist() == [[300.3, 580], [780, 100]]


# Energy and judgement


def test_the_energy_that_a_change_gives_is_the_hand_s() -> None:
    scene = head_on("gravity = [0, 900]")
    lockstep = Lockstep(scene, ENGINES)
    do_steps(lockstep, 10)
    edits: list[tuple[Edit, Callable[[float, float], float]]] = [
        (ChangeBall(step=10, ball=0, mass=3), lambda y, vy: 2 * ((120**2 + vy**2) / 2 + 900 * (600 - y))),
        (ChangeBall(step=10, ball=0, y=100), lambda y, _: 3 * 900 * (y - 100)),
        (ChangeBall(step=10, ball=0, spin=10), lambda *_: 3 * 20**2 / 2 * 10**2 / 2),
        (AddWall(step=10, start=(600, 100), to=(700, 100)), lambda *_: 0.0),
    ]
    for edit, work in edits:
        before, given = lockstep.states(), dict(lockstep.work)
        lockstep.apply(edit)
        for name, state in before.items():
            expected = work(float(state.position[0, 1]), float(state.velocity[0, 1]))
            assert lockstep.work[name] - given[name] == pytest.approx(expected, rel=1e-12)


ALL_AT_ONCE: list[Input] = [
    ChangeBall(step=25, ball=0, x=200, y=150, vx=100, vy=-20, mass=2),
    ChangeBall(step=25, ball=1, x=420, y=160, vx=0, vy=0, radius=30, elasticity=0.8),
    AddWall(step=25, start=(150, 400), to=(700, 420), thickness=8, elasticity=0.9),
    DeleteWall(step=25, wall=0),
]


def test_a_comparison_after_changes_finds_what_it_finds_in_the_scene_saved_there(tmp_path: Path) -> None:
    scene = head_on(f"gravity = [0, 500]\nseconds = 2\n{WALL}")
    lockstep = Lockstep(scene, ENGINES, ALL_AT_ONCE)
    do_steps(lockstep, 25)
    lockstep.apply_due()
    states = lockstep.states()
    assert all(state.position.tobytes() == states["exact"].position.tobytes() for state in states.values())
    dump(lockstep.scene, tmp_path / "saved.toml", states["exact"])
    saved = load(tmp_path / "saved.toml").changed(seconds=2 - 25 / 60)
    edited, fresh = compare(scene, ENGINES, inputs=ALL_AT_ONCE), compare(saved, ENGINES)
    for name, run in edited.runs.items():
        assert repr(run.figures) == repr(fresh.runs[name].figures)
        assert run.final.position.tobytes() == fresh.runs[name].final.position.tobytes()
    assert edited.runs["exact"].differences == ()


# Undone, recorded, replayed, saved

NUMBER = st.floats(0.0, 1.0)
OPERATIONS = st.lists(
    st.tuples(st.sampled_from(["place", "size", "kind", "add", "delete", "wall", "move", "fell"]), NUMBER, NUMBER),
    min_size=1,
    max_size=6,
)


def edit_of(kind: str, a: float, b: float, step: int) -> Edit:
    """Return an edit of some ball or wall. a, b: from 0 to 1."""
    x, y, ball, wall = 20 + 760 * a, 20 + 560 * b, int(2.99 * a), int(2.99 * b)
    edits: dict[str, Edit] = {
        "place": ChangeBall(step=step, ball=ball, x=x, y=y if a > 0.5 else None),
        "size": ChangeBall(step=step, ball=ball, radius=5 + 60 * b, mass=1 + 4 * a),
        "kind": ChangeBall(step=step, ball=ball, elasticity=a, friction=b, color="red", vy=300 * b, spin=20 * a),
        "add": AddBall(step=step, position=(x, y), radius=5 + 10 * b),
        "delete": DeleteBall(step=step, ball=ball),
        "wall": AddWall(step=step, start=(x, y), to=(801 - x, 600 - y / 2), thickness=10 * a),
        "move": ChangeWall(step=step, wall=wall, to=(x, y), elasticity=b),
        "fell": DeleteWall(step=step, wall=wall),
    }
    return edits[kind]


@pytest.mark.wide
@settings(deadline=None, max_examples=20, suppress_health_check=list(HealthCheck))
@given(operations=OPERATIONS)
def test_edits_are_undone_replayed_and_saved_to_the_byte(
    operations: list[tuple[str, float, float]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("run")
    scene = head_on(f"gravity = [0, 300]\n{WALL}")
    session = Session(scene, ["impulse", "exact"])

    def bytes_now() -> list[bytes]:
        session.catch_up()
        states = session.shown.states.values()
        return [part.tobytes() for one in states for part in (one.position, one.velocity, one.angle, one.spin)]

    before = [(session.step, bytes_now())]
    for kind, a, b in operations:
        for _ in range(3):
            session.advance()
        now = session.step, bytes_now()
        try:
            session.give(edit_of(kind, a, b, session.step))
        except SandboxError:
            assert (session.step, bytes_now()) == now
        else:
            before.append(now)
    for _ in range(20):
        session.advance()
    end, lockstep = bytes_now(), session.lockstep
    write_inputs(session.given(), folder / "inputs.jsonl")
    inputs = load_inputs(folder / "inputs.jsonl", scene)
    assert inputs == session.given()
    for name, state in session.shown.states.items():
        replay = simulate(scene, name, steps=session.step, inputs=inputs)
        assert replay.position[-1, lockstep.balls].tobytes() == state.position.tobytes()
        dump(lockstep.scene, folder / "saved.toml", state)
        saved = load(folder / "saved.toml")
        assert saved.walls == lockstep.scene.walls
        [start] = Lockstep(saved, [name]).states().values()
        assert start.position.tobytes() == state.position.tobytes()
        assert saved.bodies.mass.tolist() == lockstep.scene.bodies.mass.tolist()
        assert saved.colors == lockstep.scene.colors
    while session.undo():
        assert (session.step, bytes_now()) == before.pop()
    assert len(before) == 1
    while session.redo():
        pass
    while session.step < 3 * len(operations) + 20:
        session.advance()
    assert bytes_now() == end
