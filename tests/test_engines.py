"""What holds of every engine, on every bundled scene that it takes."""

from pathlib import Path

import numpy as np
import pytest
from conftest import scene_of

from sandbox.engines import Engine, create, default_engines, registry, takes
from sandbox.inputs import End, Grab, Input, Move, Release
from sandbox.mistakes import Mistake
from sandbox.scene import bundled, load
from sandbox.spawn import spawn
from sandbox.state import CONTACT
from sandbox.trajectory import simulate

PAIRS = [
    (engine, name)
    for name, scene, initial in ((name, load(name), spawn(load(name))) for name in bundled())
    for engine in registry()
    if takes(engine, scene, initial)
]


def test_every_scene_has_an_engine_and_every_engine_a_scene() -> None:
    assert {scene for _, scene in PAIRS} == set(bundled())
    assert {engine for engine, _ in PAIRS} == set(registry())
    assert len(PAIRS) >= 15


@pytest.fixture(params=list(registry()))
def engine(request: pytest.FixtureRequest) -> Engine:
    scene = scene_of("radius = 20\nposition = [200, 300]\nvelocity = [60, -30]", "radius = 20\nposition = [500, 300]")
    return create(request.param, scene, spawn(scene))


def test_a_ball_flies_straight_until_it_meets_something(engine: Engine) -> None:
    for _ in range(60):
        engine.step()
    assert engine.state().time == 1
    assert engine.state().position[0] == pytest.approx([260, 270], abs=1e-9)


def test_a_kick_adds_to_the_velocity_of_one_ball(engine: Engine) -> None:
    engine.kick(1, (30.0, 90.0))
    engine.step()
    assert engine.state().velocity == pytest.approx(np.array([[60, -30], [30, 90]]), abs=1e-12)
    assert engine.state().position[1] == pytest.approx([500.5, 301.5], abs=1e-9)


def test_a_snapshot_is_left_alone_by_later_steps(engine: Engine) -> None:
    before = engine.state()
    position, velocity = before.position.copy(), before.velocity.copy()
    engine.kick(0, (50.0, 0.0))
    engine.step()
    assert np.array_equal(before.position, position)
    assert np.array_equal(before.velocity, velocity)


def test_contacts_are_collected_from_the_first_call_and_told_once(engine: Engine) -> None:
    engine.kick(1, (-2400.0, 0.0))  # 40 px a step
    assert engine.contacts().dtype == CONTACT
    for _ in range(8):
        engine.step()
    contacts = engine.contacts()
    assert [0, 1] in np.column_stack([contacts["first"], contacts["second"]]).tolist()
    assert len(engine.contacts()) == 0


@pytest.mark.parametrize("name", registry())
def test_a_drag_far_outside_leaves_the_ball_inside_and_a_throw_flies_on(name: str) -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]", "radius = 20\nposition = [200, 500]")
    inputs: list[Input] = [Grab(step=0, ball=0, at=(200, 300)), Move(step=1, at=(1e6, -1e6)), Release(step=300)]
    run = simulate(scene, name, steps=301, inputs=inputs)
    assert ((run.position[:, 0] >= 20 - 1) & (run.position[:, 0] <= [780 + 1, 580 + 1])).all()
    assert run.position[-1, 0] == pytest.approx([780, 20], abs=0.01)

    inputs = [Grab(step=0, ball=0, at=(200, 300)), *(Move(step=k, at=(200 + 3 * k, 300)) for k in range(1, 61))]
    thrown = simulate(scene, name, steps=90, inputs=[*inputs, Release(step=60), End(step=90)])
    assert thrown.velocity[60, 0] == pytest.approx([180, 0], rel=0.02)  # the pointer's 3 px a step
    assert np.array_equal(thrown.velocity[60, 0], thrown.velocity[90, 0])


@pytest.mark.parametrize("name", registry())
def test_a_dragged_ball_does_not_pass_through_another_or_a_wall(name: str) -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]", "radius = 20\nposition = [400, 300]")
    inputs: list[Input] = [Grab(step=0, ball=0, at=(760, 300))]
    run = simulate(scene, name, steps=240, inputs=inputs)
    assert (run.position[:, 0, 0] < run.position[:, 1, 0]).all()


def test_an_unknown_engine_is_a_mistake_that_names_the_nearest() -> None:
    scene = load("article")
    with pytest.raises(Mistake, match=r"^no engine 'pymnk'; did you mean pymunk\?$"):
        create("pymnk", scene, spawn(scene))


def test_an_installed_package_adds_an_engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = tmp_path / "mine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[sandbox.engines]\nmine = sandbox.engines.article:ArticleEngine\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    scene = load("article")
    ran = simulate(scene, "mine", steps=10)
    assert np.array_equal(ran.position, simulate(scene, "article", steps=10).position)


def test_where_none_are_named_pymunk_runs_beside_the_reference_that_can() -> None:
    article, heavy = load("article"), load("heavy-among-light")
    assert default_engines(article, spawn(article)) == ["pymunk", "article"]
    assert default_engines(heavy, spawn(heavy)) == ["pymunk", "impulse"]
    rough = scene_of("radius = 20\nposition = [100, 100]\nfriction = 0.5")
    assert default_engines(rough, spawn(rough)) == ["pymunk"]


def test_an_engine_of_our_own_is_built_without_looking_through_what_is_installed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """That takes longer than a step, and an edit builds every engine anew."""
    monkeypatch.delattr("sandbox.engines.entry_points")
    scene = load("article")
    for name in ("pymunk", "article", "impulse", "exact"):
        assert create(name, scene, spawn(scene)).state().time == 0
