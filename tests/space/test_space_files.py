"""A Space in a file: the same bytes after a round trip, and one clear message for each error."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pymunk
import pytest

import sandbox
from sandbox.errors import SandboxError
from sandbox.space.files import schema

VECTORS = {"anchor_a": [0, 0], "anchor_b": [0, 0]}


def level() -> pymunk.Space:
    space, ball = pymunk.Space(), pymunk.Body(1, 10)
    space.gravity = (0, 900)
    ball.position, ball.velocity = (0.1, 1e-300), (1 / 3, -0.0)
    space.add(ball, pymunk.Circle(ball, 5), pymunk.Segment(space.static_body, (0, 0), (9, 0), 1))
    space.add(pymunk.PinJoint(ball, space.static_body))
    space.step(1 / 60)
    return space


def test_a_space_is_the_same_to_the_byte_after_a_round_trip(tmp_path: Path) -> None:
    sandbox.save_space(level(), tmp_path / "level.json")
    loaded = sandbox.load_space(str(tmp_path / "level.json"))
    assert (tmp_path / "level.json").read_text().startswith('{\n  "format": "pymunk-sandbox space",\n  "version": 1,')
    assert loaded.current_time_step == 1 / 60
    sandbox.save_space(loaded, tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "level.json").read_bytes()


def test_negative_zero_and_infinity_are_kept(tmp_path: Path) -> None:
    space = pymunk.Space()
    space.gravity, space.sleep_time_threshold = (-0.0, 900), 0.5
    bodies = [pymunk.Body(1, math.inf), pymunk.Body(1, 2)]
    space.add(*bodies, pymunk.SlideJoint(bodies[0], bodies[1], (0, 0), (0, 0), 3, math.inf))
    sandbox.save_space(space, tmp_path / "level.json")
    document = json.loads((tmp_path / "level.json").read_text())
    assert document["bodies"][0] == {"body_type": "dynamic", "mass": 1.0}
    assert document["constraints"][0]["max"] == "Infinity"
    loaded = sandbox.load_space(tmp_path / "level.json")
    assert [body.moment for body in loaded.bodies] == [math.inf, 2]
    assert math.copysign(1, loaded.gravity.x) == -1


Change = Callable[[dict[str, Any]], object]
ERRORS: dict[str, Change] = {
    "bodies[0].position[1] must be a number": lambda level: level["bodies"][0].update(position=[0, "x"]),
    "bodies[0].position must be a list of two": lambda level: level["bodies"][0].update(position=[1]),
    "bodies[0].body_type must be 'dynamic', 'kinematic' or": lambda level: level["bodies"][0].update(body_type="x"),
    "bodies[0].mass must be finite: its body is dynamic": lambda level: level["bodies"][0].update(mass="Infinity"),
    "bodies[0].moment must be greater than 0: Pymunk does no": lambda level: level["bodies"][0].update(moment=0),
    "constraints[0].error_bias must be at least 0": lambda level: level["constraints"][0].update(error_bias=-1),
    "bodies[0].massa is not a key": lambda level: level["bodies"][0].update(massa=3),
    "bodies must be a list": lambda level: level.update(bodies={}),
    'static_body.mass must be "Infinity", unless': lambda level: level.update(
        static_body={"body_type": "static", "mass": 1}
    ),
    "static_body.body_type must be 'static'": lambda level: level.update(static_body={"body_type": "kinematic"}),
    "version must be 1, got 2": lambda level: level.update(version=2),
    "format is missing (What kind of file it is)": lambda level: level.pop("format"),
    "settings.iterations must be at least 1": lambda level: level.update(settings={"iterations": 0}),
    "shapes[0].raduis is not a key": lambda level: level["shapes"][0].update(raduis=3),
    "shapes[0] must have 'kind' as one of 'Circle',": lambda level: level["shapes"][0].update(kind="Cirle"),
    "shapes[0].body must be the index of a body, of which there are 1": lambda level: level["shapes"][0].update(body=1),
    "shapes[0].radius is missing (px)": lambda level: level["shapes"][0].pop("radius"),
    "shapes[0].friction must be at least 0": lambda level: level["shapes"][0].update(friction=-1),
    "shapes[0].vertices must be the corners of a convex": lambda level: level.update(
        shapes=[{"kind": "Poly", "vertices": [[0, 0], [0, 9], [9, 0]]}]
    ),
    "constraints[0].distance is missing (px)": lambda level: level["constraints"][0].pop("distance"),
    "constraints[0] must have two different bodies": lambda level: level["constraints"][0].update(b=0),
    "constraints[1] must have a dynamic body": lambda level: (
        level["bodies"].append({"body_type": "static"}),
        level["constraints"].append({"kind": "PivotJoint", "a": 1, **VECTORS}),
    ),
    "sleeping[0][1] must be the index of a dynamic body": lambda level: level.update(sleeping=[[0, 0]]),
}  # fmt: skip


@pytest.mark.parametrize("message", ERRORS)
def test_an_error_in_a_file_is_named_with_its_path(message: str, tmp_path: Path) -> None:
    file = tmp_path / "level.json"
    sandbox.save_space(level(), file)
    document = json.loads(file.read_text())
    ERRORS[message](document)
    file.write_text(json.dumps(document))
    with pytest.raises(SandboxError) as caught:
        sandbox.load_space(file)
    assert str(caught.value).startswith(f"{file}: {message}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[1]", "null", '"x"', "[" * 100_000])
def test_a_file_that_is_no_space_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "level.json").write_text(text)
    with pytest.raises(SandboxError, match=r"^[^\n]*level\.json: (is not JSON|must be a table|is nested)[^\n]*$"):
        sandbox.load_space(tmp_path / "level.json")


def test_the_schema_is_strict_json_and_has_every_kind() -> None:
    text = json.dumps(schema(), allow_nan=False)
    assert all(f'"{kind}"' in text for kind in ("Circle", "Segment", "Poly", "GrooveJoint", "SimpleMotor", "Infinity"))
