"""Edits of a running scene: their effect in every engine, and replays to the byte."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import bundled_scenes, scene_of

from sandbox.analysis.comparison import compare
from sandbox.errors import Refused, SandboxError
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
    edited,
)
from sandbox.run.inputs import Grab, Input, Move, Release, load_inputs, write_inputs
from sandbox.run.lockstep import Lockstep
from sandbox.run.trajectory import Trajectory, simulate
from sandbox.scene.files import dump, load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn

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
        "radius = 20\nposition = [200, 300]\nvelocity = [120, 0]",
        "radius = 20\nposition = [260, 310]\nmass = 3",
        'radius = 10\nposition = [500, 100]\nvelocity = [70, 210]\ncolors = ["green"]',
    )


def last(run: Trajectory) -> tuple[bytes, bytes]:
    return run.position[-1].tobytes(), run.velocity[-1].tobytes()


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_a_replay_of_an_edit_has_the_bytes_of_the_live_run_in_every_engine(scene: Scene, edit: Edit) -> None:
    lockstep = Lockstep(scene, ENGINES)
    for _ in range(7):
        lockstep.step()
    before = {name: state.position.copy() for name, state in lockstep.states().items()}
    lockstep.apply(edit)
    for name, state in lockstep.states().items():
        kept = np.delete(before[name], 1, axis=0) if isinstance(edit, DeleteBall) else before[name]
        assert state.position[: len(kept)].tobytes() == kept.tobytes()
    for _ in range(60):
        lockstep.step()
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
        "radius = 20\nposition = [200, 100]\nvelocity = [120, 0]\nelasticity = 0.3",
        "radius = 20\nposition = [300, 100]\nvelocity = [-120, 0]",
        "radius = 20\nposition = [700, 500]\nvelocity = [240, 0]",
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
    run = simulate(scene, "exact", seconds=1.55, inputs=lockstep.given)
    assert run.time.tolist() == times


def test_contacts_before_and_after_an_edit_have_their_times() -> None:
    scene = scene_of("radius = 20\nposition = [770, 300]\nvelocity = [600, 0]", more="rate = 100")
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
    scene = scene_of("radius = 20\nposition = [200, 300]\nvelocity = [120, 0]")
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
    impossible: list[tuple[Edit, str]] = [
        (DeleteBall(step=1, ball=0), "balls must contain at least one ball"),
        (DeleteBall(step=1, ball=1), "ball must be at most 0, got 1"),
        (SetRate(step=1, rate=900_000), "seconds must be at most"),
    ]
    for edit, message in impossible:
        with pytest.raises(SandboxError, match=message):
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
    for _ in range(1000):
        lockstep.step()
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


BALL_EDITS: dict[str, Callable[[int], Edit]] = {
    "mass": lambda ball: ChangeBall(step=0, ball=ball, mass=3),
    "color": lambda ball: ChangeBall(step=0, ball=ball, color="red"),
    "spin": lambda ball: ChangeBall(step=0, ball=ball, spin=1),
    "velocity": lambda ball: SetVelocity(step=0, ball=ball, velocity=(10, 20)),
    "delete": lambda ball: DeleteBall(step=0, ball=ball),
}


@pytest.mark.parametrize("edit", BALL_EDITS.values(), ids=BALL_EDITS)
@pytest.mark.parametrize("is_saved", [False, True], ids=["bundled", "saved"])
@pytest.mark.parametrize("name", bundled_scenes())
def test_any_ball_of_any_scene_can_be_edited(
    name: str, is_saved: bool, edit: Callable[[int], Edit], tmp_path: Path
) -> None:
    scene = load(name)
    if is_saved:  # a group of several balls then has a list of positions, and one of velocities
        dump(scene, tmp_path / "saved.toml", spawn(scene))
        scene = load(tmp_path / "saved.toml")
    state, bodies, count = spawn(scene), scene.bodies, len(scene.bodies)
    for ball in {0, count // 2, count - 1}:
        change = edit(ball)
        changed, after = edited(scene, change, {"exact": state}), change.change_state(state)
        kept = np.delete(np.arange(count), ball)
        if isinstance(change, DeleteBall):
            at = np.arange(count - 1)
        else:
            at = kept
            assert len(changed.bodies) == count
            assert changed.bodies.mass[ball] == (3 if change == BALL_EDITS["mass"](ball) else bodies.mass[ball])
            assert changed.colors[ball] == ("red" if change == BALL_EDITS["color"](ball) else scene.colors[ball])
        assert changed.bodies.radius[at].tolist() == bodies.radius[kept].tolist()
        assert changed.bodies.mass[at].tolist() == bodies.mass[kept].tolist()
        assert [changed.colors[k] for k in at] == [scene.colors[k] for k in kept]
        assert after.position[at].tobytes() == state.position[kept].tobytes()
