"""What a person does to a running scene: the inputs, their file, and the hand that pulls a ball.

Inputs belong to steps, not to clocks, so that the same inputs give the same run. A file of them is JSON lines:

    {"step": 0, "do": "start", "scene": "article", "seed": 0, "rate": 60}
    {"step": 12, "do": "grab", "ball": 1, "at": [400.0, 300.0]}
    {"step": 13, "do": "move", "at": [410.0, 300.0]}
    {"step": 40, "do": "release"}
    {"step": 50, "do": "add", "position": [60.0, 60.0], "velocity": [120.0, 0.0], "radius": 20.0}
    {"step": 60, "do": "delete", "ball": 0}
    {"step": 70, "do": "velocity", "ball": 2, "velocity": [0.0, -60.0]}
    {"step": 70, "do": "elasticity", "elasticity": 0.9}
    {"step": 70, "do": "gravity", "gravity": [0.0, 900.0]}
    {"step": 80, "do": "rate", "rate": 120}
    {"step": 95, "do": "end"}
"""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Final, Literal

from pydantic import ValidationError

from sandbox.errors import MAX_REPORTED, SandboxError, first_errors, read_text, shown
from sandbox.files import whole_file
from sandbox.run.clock import Clock
from sandbox.run.edits import EDITS, Edit, SetRate
from sandbox.scene.model import Count, Index, Line, Model, Scene, Vector
from sandbox.scene.validation import error_of
from sandbox.text import printable

MAX_EDITS: Final = 1_000  # of a run: each takes time as the balls there are
MAX_BYTES: Final = 10_000_000  # of a file: room for an hour of dragging


class Start(Model):
    """What the inputs were recorded on."""

    step: Literal[0] = 0
    do: Literal["start"] = "start"
    scene: Line
    seed: Index
    rate: Count

    def change_scene(self, scene: Scene) -> Scene:
        """Return the scene as it was run. Raises SandboxError where there can be no such scene."""
        return scene.changed(seed=self.seed, rate=self.rate)


class Grab(Model):
    """The hand takes hold of a ball, and pulls it to a point (px)."""

    step: Index
    do: Literal["grab"] = "grab"
    ball: Index
    at: Vector


class Move(Model):
    """The point that the held ball is pulled to (px) is another one from this step on."""

    step: Index
    do: Literal["move"] = "move"
    at: Vector


class Release(Model):
    """The hand lets go."""

    step: Index
    do: Literal["release"] = "release"


class End(Model):
    """The recording ended before this step."""

    step: Index
    do: Literal["end"] = "end"


Input = Start | Grab | Move | Release | Edit | End
_ALL: Final[tuple[type[Input], ...]] = (Start, Grab, Move, Release, *EDITS, End)
_KINDS: Final = {kind.model_fields["do"].default: kind for kind in _ALL}


def clock_of(rate: int, inputs: Iterable[Input]) -> Clock:
    """Return when the steps are of a run that begins at a rate, and has these inputs."""
    clock = Clock(rate)
    for given in inputs:
        if isinstance(given, SetRate):
            clock.change(given.step, given.rate)
    return clock


def load_inputs(path: Path, scene: Scene) -> list[Input]:
    """Read a file of inputs to be replayed on a scene. Raises SandboxError with every mistake in it."""
    inputs: list[Input] = []
    found: list[str] = []
    edits, name = 0, printable(str(path))
    for number, line in enumerate(read_text(path, MAX_BYTES).split("\n"), 1):
        if not line.strip():
            continue
        try:
            given = _parse(line)
            if inputs and given.step < inputs[-1].step:
                raise SandboxError(f"step must be at least {inputs[-1].step}, got {given.step}")
            if isinstance(given, Start) and inputs:
                raise SandboxError("start must come before all other inputs")
            if isinstance(given, Grab) and given.ball >= len(scene.bodies):
                raise SandboxError(f"ball must be at most {len(scene.bodies) - 1}, got {given.ball}")
            edits += isinstance(given, Edit)
            if edits > MAX_EDITS:
                found.append(f"{name}:{number}: is edit {edits:,}; at most {MAX_EDITS:,} are allowed")
                break
            if isinstance(given, Start | Edit):
                scene = given.change_scene(scene)
            inputs.append(given)
        except SandboxError as mistake:
            found += [f"{name}:{number}: {what}" for what in str(mistake).split("\n")]
            if len(found) > MAX_REPORTED:
                break
    if found:
        raise first_errors(found, name)
    return inputs


def _parse(line: str) -> Input:
    try:
        document = json.loads(line)
    except json.JSONDecodeError as error:
        raise SandboxError(f"is not JSON: {error}") from None
    except RecursionError:
        raise SandboxError("is nested too deeply") from None
    except ValueError:  # of int(), which reads no more than 4,300 digits
        raise SandboxError("has a number of too many digits") from None
    do = document.get("do") if isinstance(document, dict) else None
    kind = _KINDS.get(do) if isinstance(do, str) else None
    if kind is None:
        raise SandboxError(f'must be an object with "do" as one of {", ".join(_KINDS)}, got {shown(document)}')
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise error_of(error, kind) from None


def write_inputs(inputs: Iterable[Input], path: str | Path) -> None:
    """Write inputs as the lines that `load_inputs` reads."""
    with whole_file(path) as file:
        file.writelines(given.model_dump_json().encode() + b"\n" for given in inputs)
