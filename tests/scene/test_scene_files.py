"""Written scenes load with the same state, and are readable."""

import json
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from conftest import bundled_scenes, scene_of
from hypothesis import given
from hypothesis import strategies as st

from sandbox.errors import SandboxError
from sandbox.scene.balls import BallGroup
from sandbox.scene.files import dump, load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.session.session import Session
from sandbox.state import State

EVERY_KEY = """
title = "Say \\"all\\""
about = "Ü, 1 %"
rate = 240
seconds = 2.5
seed = 7
gravity = [0.1, -900]
[arena]
size = [640, 480.5]
elasticity = 0.75
friction = 0.125
background = "#123456"
[pymunk]
iterations = 30
substeps = 4
collision_slop = 0.25
collision_persistence = 0
collision_bias = 1e-7
damping = 0.9
[[walls]]
from = [10, 20]
to = [30, 40.25]
thickness = 0
elasticity = 0.5
[[walls]]
from = [10, 400]
to = [30, 440]
[[balls]]
radius = 12.5
mass = 3
elasticity = 0.1
friction = 2
filter = { group = 1 }
position = [100, 100]
[[balls]]
count = 5
radius = 5
colors = ["red", "#00ff00"]
inside = [[200, 100], [600, 400]]
speed = 90
[[expect]]
at = 1
ball = 0
position = [1, 2]
velocity = [3, 4]
energy_ratio = 1
momentum = [5, 6]
centre_of_mass = [7, 8]
tolerance = 1
because = "of the start"
"""


def reloaded(scene: Scene, state: State, folder: Path) -> Scene:
    dump(scene, folder / "saved.toml", state)
    return load(folder / "saved.toml")


def test_what_is_no_scene_file_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    scene = scene_of("radius = 20\nposition = [100, 100]")
    for name in ("a.json", "a", "a.toml.txt"):
        with pytest.raises(SandboxError, match=rf"{name}: a scene file must end in \.toml$"):
            dump(scene, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def check_same(saved: Scene, scene: Scene, state: State) -> None:
    """Compare a loaded scene with the one that was written, and its initial state with a state, bit for bit."""
    start = spawn(saved)
    assert start.position.tobytes() == state.position.tobytes()
    assert start.velocity.tobytes() == state.velocity.tobytes()
    for key in ("radius", "mass", "elasticity", "friction"):
        assert getattr(saved.bodies, key).tobytes() == getattr(scene.bodies, key).tobytes()
    assert saved.colors == scene.colors
    kept = set(Scene.model_fields) - {"balls", "arena", "expect"}
    for key in kept:
        assert getattr(saved, key) == getattr(scene, key)
    assert saved.arena.model_copy(update={"overlap": 0}) == scene.arena.model_copy(update={"overlap": 0})


def test_every_key_is_read_and_all_except_expectations_are_written(tmp_path: Path) -> None:
    scene = parse(EVERY_KEY, "every.toml")
    assert json.loads(scene.model_dump_json(by_alias=True, exclude_unset=True)) == tomllib.loads(EVERY_KEY)
    assert (scene.name, scene.steps) == ("every", 600)
    state = spawn(scene)
    saved = reloaded(scene, state, tmp_path)
    check_same(saved, scene, state)
    assert saved.expect == ()


@pytest.mark.parametrize("name", bundled_scenes())
def test_a_bundled_scene_in_flight_loads_to_the_state_of_each_engine(name: str, tmp_path: Path) -> None:
    scene = load(name)
    session = Session(scene, ["pymunk", "impulse", "exact"])
    for _ in range(37):
        session.advance()
    for state in session.shown.states.values():
        check_same(reloaded(scene, state, tmp_path), scene, state)


@given(
    st.lists(st.tuples(*[st.floats(20, 580)] * 2, *[st.floats(-1e9, 1e9)] * 2, st.sampled_from([1.0, 0.1])), min_size=1)
)
def test_any_numbers_are_written_to_the_bit(rows: list[tuple[float, float, float, float, float]]) -> None:
    groups = tuple(BallGroup(radius=20, mass=mass, position=(x, y), velocity=(vx, vy)) for x, y, vx, vy, mass in rows)
    scene = scene_of("radius = 20\nposition = [100, 100]").changed(balls=groups)
    state = State(0.0, *np.array(rows)[:, :4].reshape(-1, 2, 2).transpose(1, 0, 2).copy())
    with TemporaryDirectory() as folder:
        check_same(reloaded(scene, state, Path(folder)), scene, state)


def test_balls_of_one_kind_are_one_group_and_the_file_is_readable(tmp_path: Path) -> None:
    scene = scene_of(
        'radius = 20\ngrid = [4, 1]\nspacing = 50\ncolors = ["red", "blue"]\nvelocity = [-0.0, 1e-7]',
        "radius = 20\nmass = 2\nposition = [99.5, 30]",
    )
    dump(scene, tmp_path / "saved.toml", spawn(scene))
    assert (tmp_path / "saved.toml").read_text() == (
        "[arena]\nsize = [800, 600]\n\n"
        '[[balls]]\nradius = 20\ncolors = ["red", "blue", "red", "blue"]\n'
        "positions = [\n    [325, 300],\n    [375, 300],\n    [425, 300],\n    [475, 300],\n]\n"
        "velocities = [\n    [-0.0, 1e-07],\n    [-0.0, 1e-07],\n    [-0.0, 1e-07],\n    [-0.0, 1e-07],\n]\n\n"
        '[[balls]]\nradius = 20\nmass = 2\ncolors = ["#e69f00"]\nposition = [99.5, 30]\nvelocity = [0, 0]\n'
    )


def test_a_ball_in_a_wall_is_written_with_the_overlap_allowed(tmp_path: Path) -> None:
    scene = scene_of("radius = 20\nposition = [100, 100]")
    state = State(0.0, np.array([[14.7501, 100.0]]), np.zeros((1, 2)))
    saved = reloaded(scene, state, tmp_path)
    check_same(saved, scene, state)
    assert saved.arena.overlap == 5.25
    with pytest.raises(SandboxError, match="position puts a ball outside the arena"):
        saved.changed(arena=saved.arena.model_copy(update={"overlap": 5.2}))
    again = reloaded(saved, State(0.0, np.array([[20.0, 100.0]]), np.zeros((1, 2))), tmp_path)
    assert again.arena.overlap == 0
    walled = again.changed(walls=[{"start": (100, 200), "to": (300, 200), "thickness": 4}])
    state = State(0.0, np.array([[200.0, 180.5]]), np.zeros((1, 2)))
    assert reloaded(walled, state, tmp_path).arena.overlap == 2.5


@pytest.mark.parametrize("most", [60, 150])
def test_too_many_balls_for_a_file_are_not_written(most: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of("radius = 20\ngrid = [4, 1]\nspacing = 50.125")
    monkeypatch.setattr("sandbox.scene.files.MAX_TEXT_FILE_BYTES", most)
    with pytest.raises(SandboxError, match=f"saved.toml: 4 balls do not fit in the {most} bytes of a scene file"):
        dump(scene, tmp_path / "saved.toml", spawn(scene))
    assert list(tmp_path.iterdir()) == []


def test_a_scene_that_would_not_load_is_not_written(tmp_path: Path) -> None:
    scene = scene_of("radius = 20\nposition = [100, 100]")
    with pytest.raises(SandboxError, match=r"saved.toml:\d+: balls\[0\].velocity\[0\] must be at most 1e\+09"):
        dump(scene, tmp_path / "saved.toml", State(0.0, np.array([[50.0, 50.0]]), np.array([[2e9, 0.0]])))
    with pytest.raises(SandboxError, match="cannot be written"):
        dump(scene, tmp_path / "no-such-folder" / "saved.toml")
    assert list(tmp_path.iterdir()) == []


def test_a_scene_without_walls_is_written_with_balls_outside_the_arena(tmp_path: Path) -> None:
    scene = Scene(
        arena={"size": (100, 100), "walls": False},
        balls=[{"radius": 5, "position": (-5000, 98)}],
        pymunk={"damping": 0.75},
    )
    saved = reloaded(scene, spawn(scene), tmp_path)
    check_same(saved, scene, spawn(scene))
    assert (saved.arena, saved.pymunk) == (scene.arena, scene.pymunk)
    assert saved.arena.overlap == 0
