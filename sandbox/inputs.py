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
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final, Literal

from pydantic import ValidationError

from sandbox.clock import Clock
from sandbox.edits import EDITS, DeleteBall, Edit, SetRate
from sandbox.mistakes import MOST_TOLD, Mistake, first_mistakes, mistake_of, read_text, shown
from sandbox.output import whole_file
from sandbox.plaintext import printable
from sandbox.scene import Count, Index, Line, Model, Scene, Vector

PULL: Final = 25.0  # 1/s, of the critically damped pull: a ball is at the pointer within about a fifth of a second
MAX_EDITS: Final = 1_000  # of a run: each takes time as the balls there are
MAX_BYTES: Final = 10_000_000  # of a file: room for an hour of dragging
MOST_PULL: Final = 40_000.0  # px/s², the hand's greatest acceleration, whatever the scene's gravity
BRAKE: Final = MOST_PULL / PULL**2  # px from the target; a ball that comes from further must be able to brake


class Start(Model):
    """What the inputs were recorded on."""

    step: Literal[0] = 0
    do: Literal["start"] = "start"
    scene: Line
    seed: Index
    rate: Count

    def change_scene(self, scene: Scene) -> Scene:
        """Return the scene as it was run. Raises Mistake where there can be no such scene."""
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


class Hand:
    """The mouse in every engine: a critically damped pull of one ball to a point inside the arena.

    The pull is backward Euler's step of x'' = -w² (x - target) - 2 w x', which from rest does not overshoot, and
    blows up at no rate. Its acceleration is finite, so it goes no faster than it can brake; and it moves a ball by
    at most the ball's radius a step, so that walls and other balls stay solid to it.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene  # that runs: an edit replaces it
        self.ball: int | None = None
        self.target: Vector = (0.0, 0.0)

    def obey(self, given: Input) -> None:
        """Take, move or release as an input says."""
        match given:
            case Grab(ball=ball, at=at):
                self.ball = ball
                self._aim(at)
            case Move(at=at) if self.ball is not None:
                self._aim(at)
            case DeleteBall(ball=ball) if self.ball is not None and ball < self.ball:
                self.ball -= 1
            case Release() | End() | DeleteBall(ball=self.ball):
                self.ball = None

    def _aim(self, at: Vector) -> None:
        assert self.ball is not None
        radius = float(self.scene.bodies.radius[self.ball])
        x, y = (min(max(to, radius), size - radius) for to, size in zip(at, self.scene.arena.size, strict=True))
        self.target = x, y

    def pull(self, position: Sequence[float], velocity: Sequence[float]) -> Vector:
        """Return the change of the held ball's velocity for one step, px/s, from where it is and how it moves."""
        assert self.ball is not None
        h, w = 1 / self.scene.rate, PULL
        vx, vy = (
            (v - h * w * w * (x - to)) / (1 + h * w) ** 2
            for x, v, to in zip(position, velocity, self.target, strict=True)
        )
        vx, vy = _at_most(float(self.scene.bodies.radius[self.ball]) / h, vx, vy)
        dx, dy = (to - x for x, to in zip(position, self.target, strict=True))
        if vx * dx + vy * dy > 0 and math.hypot(dx, dy) > BRAKE:
            vx, vy = _at_most(math.sqrt(MOST_PULL * math.hypot(dx, dy)), vx, vy)
        return _at_most(MOST_PULL * h, vx - velocity[0], vy - velocity[1])


def _at_most(length: float, x: float, y: float) -> Vector:
    norm = math.hypot(x, y)
    return (x, y) if norm <= length else (x * length / norm, y * length / norm)


def clock_of(rate: int, inputs: Iterable[Input]) -> Clock:
    """Return when the steps are of a run that begins at a rate, and has these inputs."""
    clock = Clock(rate)
    for given in inputs:
        if isinstance(given, SetRate):
            clock.change(given.step, given.rate)
    return clock


def load_inputs(path: Path, scene: Scene) -> list[Input]:
    """Read a file of inputs to be replayed on a scene. Raises Mistake with every mistake in it."""
    inputs: list[Input] = []
    found: list[str] = []
    edits, name = 0, printable(str(path))
    for number, line in enumerate(read_text(path, MAX_BYTES).split("\n"), 1):
        if not line.strip():
            continue
        try:
            given = _parse(line)
            if inputs and given.step < inputs[-1].step:
                raise Mistake(f"step must be at least {inputs[-1].step}, got {given.step}")
            if isinstance(given, Start) and inputs:
                raise Mistake("start must come before all other inputs")
            if isinstance(given, Grab) and given.ball >= len(scene.bodies):
                raise Mistake(f"ball must be at most {len(scene.bodies) - 1}, got {given.ball}")
            edits += isinstance(given, Edit)
            if edits > MAX_EDITS:
                found.append(f"{name}:{number}: is edit {edits:,}; at most {MAX_EDITS:,} are allowed")
                break
            if isinstance(given, Start | Edit):
                scene = given.change_scene(scene)
            inputs.append(given)
        except Mistake as mistake:
            found += [f"{name}:{number}: {what}" for what in str(mistake).split("\n")]
            if len(found) > MOST_TOLD:
                break
    if found:
        raise first_mistakes(found, name)
    return inputs


def _parse(line: str) -> Input:
    try:
        document = json.loads(line)
    except json.JSONDecodeError as error:
        raise Mistake(f"is not JSON: {error}") from None
    except RecursionError:
        raise Mistake("is nested too deeply") from None
    except ValueError:  # of int(), which reads no more than 4,300 digits
        raise Mistake("has a number of too many digits") from None
    do = document.get("do") if isinstance(document, dict) else None
    kind = _KINDS.get(do) if isinstance(do, str) else None
    if kind is None:
        raise Mistake(f'must be an object with "do" as one of {", ".join(_KINDS)}, got {shown(document)}')
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise mistake_of(error, kind) from None


def write_inputs(inputs: Iterable[Input], path: str | Path) -> None:
    """Write inputs as the lines that `load_inputs` reads."""
    with whole_file(path) as file:
        file.writelines(given.model_dump_json().encode() + b"\n" for given in inputs)
