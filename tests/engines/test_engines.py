"""What holds for every engine, on every bundled scene that it can run."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from conftest import do_steps, scene_of

from sandbox.engines import create, default_engines, refusal, registry
from sandbox.engines.engine import RunningEngine, traits_of
from sandbox.errors import SandboxError
from sandbox.report.trajectory import simulate
from sandbox.run.inputs import End, Grab, Input, Move, Release
from sandbox.scene.files import bundled, load
from sandbox.scene.spawn import spawn
from sandbox.state import CONTACT

SCENES = {name: load(name) for name in bundled()}
ONLY_PYMUNK = "only pymunk takes settings, as in pymunk(substeps=4, iterations=30)"
PAIRS = [(engine, name) for engine in registry() for name, scene in SCENES.items() if refusal(engine, scene) is None]


def test_every_scene_has_an_engine_and_every_engine_a_scene() -> None:
    assert {scene for _, scene in PAIRS} == set(bundled())
    assert {engine for engine, _ in PAIRS} == set(registry())
    assert len(PAIRS) >= 15


@pytest.fixture(params=list(registry()))
def engine(request: pytest.FixtureRequest) -> RunningEngine:
    scene = scene_of("radius = 20\nposition = [200, 300]\nvelocity = [60, -30]", "radius = 20\nposition = [500, 300]")
    return create(request.param, scene, spawn(scene))


def test_a_ball_flies_straight_until_it_meets_something(engine: RunningEngine) -> None:
    do_steps(engine, 60)
    assert engine.state().time == 1
    assert engine.state().position[0] == pytest.approx([260, 270], abs=1e-9)


def test_a_kick_adds_to_the_velocity_of_one_ball(engine: RunningEngine) -> None:
    engine.kick(1, (30.0, 90.0))
    engine.step()
    assert engine.state().velocity == pytest.approx(np.array([[60, -30], [30, 90]]), abs=1e-12)
    assert engine.state().position[1] == pytest.approx([500.5, 301.5], abs=1e-9)


def test_later_steps_do_not_change_a_snapshot(engine: RunningEngine) -> None:
    before = engine.state()
    position, velocity = before.position.copy(), before.velocity.copy()
    engine.kick(0, (50.0, 0.0))
    engine.step()
    assert np.array_equal(before.position, position)
    assert np.array_equal(before.velocity, velocity)


def test_contacts_are_recorded_when_asked_for_and_returned_once(engine: RunningEngine) -> None:
    engine.kick(1, (-2400.0, 0.0))  # 40 px a step
    engine.record_contacts()
    assert engine.contacts().dtype == CONTACT
    do_steps(engine, 8)
    contacts = engine.contacts()
    pairs = np.column_stack([contacts["first"], contacts["second"]]).tolist()
    assert ([0, 1] in pairs) == traits_of(engine).reports_contacts
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


def install(folder: Path, monkeypatch: pytest.MonkeyPatch, **engines: str) -> None:
    """Install a package whose engines are "module:class"."""
    info = folder / "mine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    entries = (f"{name} = {engine}\n" for name, engine in engines.items())
    (info / "entry_points.txt").write_text("[sandbox.engines]\n" + "".join(entries))
    monkeypatch.syspath_prepend(str(folder))


def test_an_installed_package_adds_an_engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, monkeypatch, mine="sandbox.engines.article:ArticleEngine")
    scene = load("article")
    ran = simulate(scene, "mine", steps=10)
    assert np.array_equal(ran.position, simulate(scene, "article", steps=10).position)


def test_an_installed_engine_with_the_name_of_a_built_in_one_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, monkeypatch, exact="mine:Mine")
    message = "mine:Mine: is installed under the name of a built-in engine, exact"
    with pytest.raises(SandboxError, match=f"^{message}$"):
        registry()


@pytest.mark.parametrize(
    ("engine", "error"),
    [
        ("raises_when_imported:Mine", "ZeroDivisionError: division by zero"),
        (f"{__name__}:Lost", f"AttributeError: module {__name__!r} has no attribute 'Lost'"),
    ],
)
def test_an_installed_package_that_cannot_be_loaded_is_one_message(
    engine: str, error: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, monkeypatch, mine=engine)
    (tmp_path / "raises_when_imported.py").write_text("1 / 0")
    with pytest.raises(SandboxError, match=f"^{re.escape(f'mine: {engine} cannot be loaded: {error}')}$"):
        simulate(load("article"), "mine", steps=1)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("(substeps=4)", ONLY_PYMUNK),
        ("pymunk(substeps=4, substeps=8)", "has substeps twice"),
        ("pymunk(iterations=1.5)", "pymunk.iterations must be a whole number, got 1.5"),
        ("pymunk(substeps=true)", "'substeps=true' must be a setting and its number, as in pymunk(substeps=4, itera"),
        ("pymunk(substeps)", "'substeps' must be a setting and its number, as in pymunk(substeps=4, iterations=30)"),
        ("pymunk (substeps=4", "lacks a closing bracket, as in pymunk(substeps=4, iterations=30)"),
        ("pymunk(substep=4)", "substep is not a setting of pymunk; did you mean substeps?"),
        ("exact(substeps=4)", ONLY_PYMUNK),
    ],
)
def test_a_mistake_in_an_engine_s_settings_is_named(name: str, message: str) -> None:
    scene = load("head-on")
    with pytest.raises(SandboxError, match=f"^{re.escape(f'{name}: {message}')}"):
        create(name, scene, spawn(scene))


def test_by_default_pymunk_runs_with_the_first_textbook_engine_that_can() -> None:
    article, heavy = load("article"), load("heavy-among-light")
    assert default_engines(article) == ["pymunk", "article"]
    assert default_engines(heavy) == ["pymunk", "impulse"]
    rough = scene_of("radius = 20\nposition = [100, 100]\nfriction = 0.5")
    assert default_engines(rough) == ["pymunk", "impulse"]


@pytest.mark.parametrize("seed", range(5))
def test_a_heap_does_not_push_balls_of_impulse_through_its_bowl(seed: int) -> None:
    scene = load("pile").changed(seed=seed)
    run = simulate(scene, "impulse")
    fall = math.sqrt(2 * scene.gravity[1] * scene.arena.size[1])  # px/s, of a ball that falls through the whole arena
    assert np.hypot(*np.moveaxis(run.velocity, -1, 0)).max() < fall
    for wall in scene.walls:
        start, along = np.array(wall.start), np.subtract(wall.to, wall.start)
        x, inside = run.position[-1] - start, np.subtract((400, 300), start)
        beside = x @ along > 0  # neither above the rim of the bowl nor on it
        side = along[0] * x[:, 1] - along[1] * x[:, 0]
        assert (side[beside] * (along[0] * inside[1] - along[1] * inside[0]) > 0).all()
