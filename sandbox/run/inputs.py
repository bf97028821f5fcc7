"""Inputs of a running scene, from the mouse and the window's controls: their kinds and their file.

Inputs belong to steps, not to clock times, so that the same inputs give the same run. Their file is JSON lines:

    {"step": 0, "do": "start", "scene": "article", "seed": 0, "rate": 60}
    {"step": 12, "do": "grab", "ball": 1, "at": [400.0, 300.0]}
    {"step": 13, "do": "move", "at": [410.0, 300.0]}
    {"step": 40, "do": "release"}
    {"step": 66, "do": "change-wall", "wall": 0, "to": [500.0, 400.0], "elasticity": 0.5}
    {"step": 95, "do": "end"}
"""

from collections.abc import Callable, Iterable
from copy import copy
from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_args

from pydantic import Field, TypeAdapter, ValidationError

from sandbox.errors import MAX_REPORTED_ERRORS, SandboxError, first_errors, shown
from sandbox.files import read_text, whole_file
from sandbox.run.edits import AnyEdit, Edit, check_ball
from sandbox.run.edits import Input as Input  # noqa: PLC0414  (all others import it from here)
from sandbox.scene.clock import Clock
from sandbox.scene.fields import Count, Index, Line, Vector
from sandbox.scene.model import Scene
from sandbox.scene.validation import sandbox_error
from sandbox.text import printable

MAX_EDITS: Final = 1_000  # in a run: each takes time in proportion to the number of balls
MAX_INPUTS_BYTES: Final = 10_000_000  # in a file: enough for an hour of dragging


class Start(Input):
    """The scene that the inputs were recorded on."""

    step: Literal[0] = 0
    do: Literal["start"] = "start"
    scene: Line
    seed: Index
    rate: Count

    def change_scene(self, scene: Scene) -> Scene:
        """Return the scene with the recorded seed and rate. Raises SandboxError if they are not valid."""
        return scene.changed(seed=self.seed, rate=self.rate)


class Grab(Input):
    """The mouse grabs a ball, and pulls it to a point (px)."""

    do: Literal["grab"] = "grab"
    ball: Index
    at: Vector


class Move(Input):
    """The mouse pulls the grabbed ball to another point (px) from this step on."""

    do: Literal["move"] = "move"
    at: Vector


class Release(Input):
    """The mouse releases the ball."""

    do: Literal["release"] = "release"


class Kick(Input):
    """A program adds to a ball's velocity before this step, in every engine alike."""

    do: Literal["kick"] = "kick"
    ball: Index
    velocity: Vector
    """The added velocity, px/s."""


class End(Input):
    """The recording ended before this step."""

    do: Literal["end"] = "end"


_AnyInput = Start | Grab | Move | Release | Kick | AnyEdit | End
_READER: Final[TypeAdapter[_AnyInput]] = TypeAdapter(Annotated[_AnyInput, Field(discriminator="do")])
INPUT_KINDS: Final[dict[str, type[Input]]] = {kind.model_fields["do"].default: kind for kind in get_args(_AnyInput)}


def clock_of(start: Clock, inputs: Iterable[Input]) -> Clock:
    """Return the clock of a run that starts with another and has these inputs."""
    clock = copy(start)
    for given in inputs:
        if isinstance(given, Edit):
            given.change_clock(clock)
    return clock


def load_inputs(path: Path, scene: Scene) -> list[Input]:
    """Read a file of inputs to replay on a scene. Raises SandboxError with every error in it: `file:line: ...`."""
    name, lines = printable(str(path)), read_text(path, MAX_INPUTS_BYTES).split("\n")
    numbered = ((f"{name}:{number}", line) for number, line in enumerate(lines, 1) if line.strip())
    return _checked(numbered, _READER.validate_json, scene, name)


def check_inputs(given: Iterable[object], scene: Scene) -> list[Input]:
    """Return inputs to replay on a scene, models or objects as in a file. Raises SandboxError: `inputs[3]: ...`."""
    numbered = ((f"inputs[{k}]", entry) for k, entry in enumerate(given))
    return _checked(numbered, _READER.validate_python, scene, "inputs")


def _checked(entries: Iterable[tuple[str, Any]], parse: Callable[..., Input], scene: Scene, source: str) -> list[Input]:
    """Return the inputs in entries, each with its place in messages. Raises SandboxError with every error."""
    inputs: list[Input] = []
    errors: list[str] = []
    edits = 0
    for place, entry in entries:
        try:
            given = _read(parse, entry)
            if inputs and given.step < inputs[-1].step:
                raise SandboxError(f"step must be at least {inputs[-1].step}, got {given.step}")
            if isinstance(given, Start) and inputs:
                raise SandboxError("start must come before all other inputs")
            if isinstance(given, Grab | Kick):
                check_ball(given.ball, scene)
            edits += isinstance(given, Edit)
            if edits > MAX_EDITS:
                errors.append(f"{place}: is edit {edits:,}; at most {MAX_EDITS:,} are allowed")
                break
            if isinstance(given, Start | Edit):
                scene = given.change_scene(scene)
            inputs.append(given)
        except SandboxError as error:
            errors += [f"{place}: {what}" for what in str(error).split("\n")]
            if len(errors) > MAX_REPORTED_ERRORS:
                break
    if errors:
        raise first_errors(errors, source)
    return inputs


def _read(parse: Callable[..., Input], entry: object) -> Input:
    try:
        return parse(entry, by_alias=True, by_name=False)
    except ValidationError as error:
        detail = error.errors()[0]
        kind = detail["loc"][:1]  # the value of "do", if it is valid
        if detail["type"] == "json_invalid":
            raise SandboxError(detail["msg"]) from None
        if not kind:
            kinds = ", ".join(INPUT_KINDS)
            raise SandboxError(f'must be an object with "do" as one of {kinds}, got {shown(detail["input"])}') from None
        raise sandbox_error(error, INPUT_KINDS[str(kind[0])], within=kind) from None


def write_inputs(inputs: Iterable[Input], path: str | Path) -> None:
    """Write inputs as JSON lines, which `load_inputs` reads. Raises SandboxError if the file cannot be written."""
    with whole_file(path) as file:
        file.writelines(given.model_dump_json(by_alias=True, exclude_none=True).encode() + b"\n" for given in inputs)


def write_run(scene: Scene, given: Iterable[Input], steps: int, path: str | Path) -> None:
    """Write the inputs of a run that has made so many steps. Raises SandboxError if the file cannot be written."""
    start = Start(scene=scene.name, seed=scene.seed, rate=scene.rate)
    write_inputs([start, *(entry for entry in given if not isinstance(entry, Start | End)), End(step=steps)], path)
