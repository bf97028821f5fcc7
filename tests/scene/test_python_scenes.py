"""Scenes built in Python: as convenient as a file, and with the same words for errors."""

import pickle
import tomllib
from typing import Any

import pytest
from conftest import NO_KEY, bundled_scenes

import sandbox
from sandbox.errors import SandboxError
from sandbox.run.inputs import Grab
from sandbox.scene.balls import BallGroup
from sandbox.scene.files import load, parse
from sandbox.scene.model import Arena, Expect, PymunkSettings, Scene, Wall
from sandbox.scene.spawn import spawn

BROKEN = """
title = 3
sedd = 1
gravity = [0]
[arena]
size = [800, nan]
backgruond = "white"
[[balls]]
radius = -5
position = [nan, 100]
colors = ["rde", ""]
[[balls]]
radius = 4
velocty = [1, 2]
x = { from = 9, to = 8, step = 1 }
mass = 0
count = 1.5
[[balls]]
radius = 4
count = 3
position = [100, 100]
inside = [[0, 0], [5, 5]]
velocities = [[1, 2]]
[[walls]]
from = [1, 1]
to = [1, 1.0000001]
[[walls]]
start = [1, 1]
thickness = true
[pymunk]
substeps = 0
[[expect]]
at = 1
position = [1, 1]
tolerance = 0
"""
ARENA = Arena(size=(800, 600))
BALL = BallGroup(radius=5, position=(100, 100))


def errors_in_python(make: Any, **values: Any) -> list[str]:
    with pytest.raises(SandboxError) as caught:
        make(**values)
    assert type(caught.value) is SandboxError
    return str(caught.value).splitlines()


def test_python_reports_the_errors_of_a_file_in_the_same_words() -> None:
    with pytest.raises(SandboxError) as caught:
        parse(BROKEN, "mine.toml")
    in_file = [line.removeprefix("mine.toml:").partition(": ")[2] for line in str(caught.value).splitlines()]
    assert len(in_file) == 25
    document = tomllib.loads(BROKEN)
    start = in_file.index(f"walls[1].start {NO_KEY}; known are elasticity, friction, from, joined, thickness, to")
    del in_file[start], document["walls"][1]["start"]  # the name of `from` in Python
    assert sorted(errors_in_python(Scene, **document)) == sorted(in_file)


@pytest.mark.parametrize("name", bundled_scenes())
def test_a_scene_of_dictionaries_is_the_scene_of_the_file(name: str) -> None:
    scene = load(name)
    built = Scene(**tomllib.loads(scene.source))
    assert {key: getattr(built, key) for key in Scene.model_fields} == dict(scene)
    assert spawn(built).position.tobytes() == spawn(scene).position.tobytes()
    assert (built.name, built.source) == ("scene", "")


def test_tables_may_be_dictionaries_or_models_and_lists_or_tuples() -> None:
    built = sandbox.Scene(arena=ARENA, balls=(BALL,), walls=(Wall(start=(1, 2), to=(3, 4)),), pymunk=PymunkSettings())
    values: dict[str, Any] = {
        "arena": {"size": [800, 600]},
        "balls": [BALL, {"radius": 5, "grid": [2, 2], "spacing": 20, "position": None}],
        "walls": [{"from": [1, 2], "to": [3, 4]}, {"start": (1, 2), "to": (3, 4)}],
    }
    mixed = sandbox.Scene(**values)
    assert mixed.arena == built.arena
    assert mixed.balls[0] is BALL
    assert mixed.walls == built.walls * 2
    assert len(mixed.bodies) == 5


ALONE = {
    "group": (BallGroup, {"radius": -1, "position": (9, 9)}, "radius must be greater than 0, got -1"),
    "group-typo": (BallGroup, {"radios": 1, "radius": 1, "position": (9, 9)}, f"radios {NO_KEY}; did you mean radius?"),
    "nested": (BallGroup, {"radius": 1, "x": {"from": 2, "to": 1}, "y": {"from": 1, "to": 1}}, "x is empty: from 2"),
    "wall-without-start": (Wall, {"to": (1, 1)}, "from is missing (One end, px)"),
    "expect": (Expect, {"at": 1, "tolerance": 1, "because": ""}, "must contain position, velocity, spin,"),
    "input": (Grab, {"step": -1, "ball": 0, "at": (1, 2)}, "step must be at least 0, got -1"),
    "scene-typo": (
        Scene,
        {"arena": ARENA, "balls": [BALL], "grvity": (0, 9)},
        f"grvity {NO_KEY}; did you mean gravity?",
    ),
    "outside": (
        Scene,
        {"arena": ARENA, "balls": [BALL, BallGroup(radius=5, position=(1, 9))]},
        "balls[1].position puts a ball outside the arena: x must be from 5 to 795, got 1",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("make", "values", "message"), ALONE.values(), ids=ALONE)
def test_every_table_raises_a_sandbox_error(make: Any, values: dict[str, Any], message: str) -> None:
    (found,) = errors_in_python(make, **values)
    assert found.startswith(message)


def test_a_change_keeps_the_source_and_reports_errors_in_the_same_words() -> None:
    scene = load("article")
    assert scene.changed(seed=3).source == scene.source
    assert scene.changed(seed=3).file == scene.file
    assert errors_in_python(scene.changed, sede=3, walls=[{"start": (1, 1), "to": (1, 1.0000001)}]) == [
        "walls[0].to is nearly the same point as from; only at the same point, the wall is a peg",
        f"sede {NO_KEY}; did you mean seed?",
    ]


def test_a_copy_of_a_group_is_checked_again() -> None:
    with pytest.raises(SandboxError, match=r"balls\[0\]\.count must be 1, the number of places in position, got 2"):
        load("oblique").changed(balls=[BALL.model_copy(update={"count": 2})])


def test_a_scene_survives_pickling_with_its_source() -> None:
    scene = load("funnel")
    again: Scene = pickle.loads(pickle.dumps(scene))
    assert again == scene
    assert (again.source, again.name) == (scene.source, scene.name)
    assert again.at_key(("balls", 0, "radius"), "is 10") == scene.at_key(("balls", 0, "radius"), "is 10")
