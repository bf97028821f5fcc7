"""Edits of one ball or one wall: what they change, what they refuse, and that they accuse no engine."""

from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import scene_of
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sandbox.analysis.comparison import compare
from sandbox.engines import registry
from sandbox.errors import SandboxError
from sandbox.run.edits import AddBall, AddWall, ChangeBall, ChangeWall, DeleteBall, DeleteWall, Edit
from sandbox.run.inputs import Input, load_inputs, write_inputs
from sandbox.run.lockstep import Lockstep
from sandbox.run.trajectory import simulate
from sandbox.scene.files import load, write
from sandbox.scene.model import Scene
from sandbox.session.session import Session

ENGINES = ("pymunk", "impulse", "exact")
EVERY = (*ENGINES, *({"box2d"} & set(registry())))  # if it is installed
WALL = "walls = [{ from = [500, 100], to = [500, 500], thickness = 20 }]"


def head_on(more: str = "") -> Scene:
    """A ball that flies at 120 px/s, and one at rest 100 px ahead: the edges meet after half a second."""
    return scene_of(
        "radius = 20\nposition = [200, 300]\nvelocity = [120, 0]", "radius = 20\nposition = [300, 300]", more=more
    )


# What changes


@pytest.mark.parametrize("engine", EVERY)
@pytest.mark.parametrize("e", [1.0, 0.5, 0.0])
def test_a_ball_of_another_mass_and_elasticity_collides_as_the_formula_says(engine: str, e: float) -> None:
    m = 2.0
    run = simulate(head_on(), engine, steps=50, inputs=[ChangeBall(step=5, ball=0, mass=m, elasticity=e)])
    together = m * 120 / (m + 1)
    assert run.velocity[-1, :, 0] == pytest.approx([together - e * 120 / (m + 1), together + e * m * 120 / (m + 1)])


def test_only_what_is_given_changes_in_every_engine() -> None:
    scene = head_on("gravity = [0, 90]")
    lockstep = Lockstep(scene, ENGINES)
    for _ in range(20):
        lockstep.step()
    before = lockstep.states()
    lockstep.apply(ChangeBall(step=20, ball=0, y=100, vx=7, spin=-3))
    for name, state in lockstep.states().items():
        position, velocity = before[name].position.copy(), before[name].velocity.copy()
        position[0, 1], velocity[0, 0] = 100, 7
        assert state.position.tobytes() == position.tobytes()
        assert state.velocity.tobytes() == velocity.tobytes()
        assert state.spin.tolist() == [-3, 0]


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
    scene = scene_of("radius = 20\nposition = [300, 300]\nvelocity = [120, 0]", more=WALL)
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


def test_contacts_keep_the_numbers_of_their_walls() -> None:
    """The ball flies to and fro between two walls; a wall that never counts is deleted before them, and one added."""
    scene = scene_of(
        "radius = 20\nposition = [300, 300]\nvelocity = [240, 0]",
        more="walls = [{ from = [9, 9], to = [99, 9] }, { from = [200, 100], to = [200, 500] },"
        " { from = [400, 100], to = [400, 500] }]",
    )
    deleted, added = DeleteWall(step=60, wall=0), AddWall(step=90, start=(300, 20), to=(300, 90))
    replaced: list[Input] = [
        *(deleted, added, DeleteWall(step=120, wall=1)), AddWall(step=120, start=(401, 100), to=(401, 500))
    ]  # fmt: skip
    for engine in ENGINES:
        run = simulate(scene, engine, steps=200, inputs=replaced)
        walls = [(round(one["time"] * 60), ~int(one["second"])) for one in run.contacts]
        assert [wall for _, wall in walls] == [6, 5, 6, 5, 8][: len(walls)]
        assert len(walls) == 5
        state = Lockstep(scene, [engine], replaced)
        while state.steps < 200:
            state.step()
        assert state.walls == [0, 1, 2, 3, 5, 7, 8]


# What is refused

REFUSED: list[tuple[Edit, str]] = [
    (ChangeBall(step=0, ball=0, x=270), "pymunk: ball 0 would overlap ball 1 by 10 px"),
    (ChangeBall(step=0, ball=1, radius=85), "pymunk: ball 1 would overlap ball 0 by 5 px"),
    (ChangeBall(step=0, ball=1, x=475), "pymunk: ball 1 would overlap wall 0 by 5 px"),
    (ChangeBall(step=0, ball=1, radius=210, x=150, y=300), r"outside the arena: x must be from 210 to 590"),
    (ChangeBall(step=0, ball=1, x=790), r"balls\[1\].position puts a ball outside the arena: x must be from 20 to 780"),
    (ChangeBall(step=0, ball=2, radius=60), "pymunk: ball 2 would overlap the bottom wall by 10 px"),
    (ChangeBall(step=0, ball=3, mass=2), "ball must be at most 2, got 3"),
    (AddBall(step=0, position=(500, 290), radius=50), "pymunk: ball 3 would overlap wall 0 by"),
    (AddWall(step=0, start=(100, 315), to=(400, 315)), "pymunk: wall 1 would overlap ball 0 by 7 px"),
    (ChangeWall(step=0, wall=0, start=(200, 200)), "pymunk: wall 0 would overlap ball 1 by 30 px"),
    (ChangeWall(step=0, wall=0, start=(500, 500.0000001)), "to is nearly the same point as from"),
    (DeleteWall(step=0, wall=1), "wall must be at most 0, got 1"),
]


@pytest.mark.parametrize(("edit", "message"), REFUSED, ids=[message.split(":")[-1] for _, message in REFUSED])
def test_an_edit_without_room_is_refused_and_changes_nothing(edit: Edit, message: str) -> None:
    scene = scene_of(
        "radius = 20\nposition = [200, 300]\nvelocity = [120, 0]",
        "radius = 20\nposition = [300, 300]",
        "radius = 20\nposition = [700, 550]",
        more=WALL,
    )
    lockstep = Lockstep(scene, ENGINES)
    engines = [runner.engine for runner in lockstep.engines.values()]
    with pytest.raises(SandboxError, match=message):
        lockstep.apply(edit)
    assert (lockstep.scene, lockstep.given, lockstep.edited) == (scene, [], False)
    assert [runner.engine for runner in lockstep.engines.values()] == engines


def test_an_engine_that_has_another_ball_there_is_named() -> None:
    scene = scene_of(
        "radius = 20\nposition = [200, 300]\nvelocity = [120, 0]\nelasticity = 0.5",
        "radius = 20\nposition = [300, 310]",
        "radius = 20\nposition = [700, 500]",
    )
    lockstep = Lockstep(scene, ["exact", "impulse"])
    while lockstep.steps < 90:
        lockstep.step()
    lockstep.apply(ChangeBall(step=90, ball=2, x=100, y=100))
    x, y = lockstep.states()["exact"].position[1].tolist()
    with pytest.raises(SandboxError, match="exact: ball 2 would overlap ball 1 by 40 px"):
        lockstep.apply(ChangeBall(step=90, ball=2, x=x, y=y))


def test_a_ball_may_touch_and_stay_as_deep_as_it_was() -> None:
    """A ball that rests on a wall and on the floor in Pymunk lies up to 0.1 px in them."""
    scene = scene_of(
        "radius = 20\nposition = [200, 580]\nelasticity = 0", "radius = 20\nposition = [400, 270]\nelasticity = 0",
        more="gravity = [0, 900]\nwalls = [{ from = [300, 300], to = [700, 300], thickness = 20 }]",
    )  # fmt: skip
    lockstep = Lockstep(scene, ENGINES)
    for _ in range(60):
        lockstep.step()
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
    for _ in range(10):
        lockstep.step()
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
    while lockstep.steps < 25:
        lockstep.step()
    lockstep.apply_due()
    states = lockstep.states()
    assert all(state.position.tobytes() == states["exact"].position.tobytes() for state in states.values())
    write(lockstep.scene, tmp_path / "saved.toml", states["exact"])
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
        write(lockstep.scene, folder / "saved.toml", state)
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
