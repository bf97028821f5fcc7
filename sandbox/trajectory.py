"""Engines stepped together under one hand; one engine -> a trajectory, and its files."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

import numpy as np

from sandbox.engines import create
from sandbox.inputs import Hand, Input
from sandbox.mistakes import Mistake
from sandbox.output import whole_file
from sandbox.scene import Scene, Vector
from sandbox.spawn import spawn
from sandbox.state import Floats, State

MAX_BYTES: Final = 3_000_000_000  # of a trajectory, which is held in memory whole


class Lockstep:
    """Engines that run one scene from one state, a step at a time, with the same mouse."""

    def __init__(self, scene: Scene, names: Iterable[str], inputs: Sequence[Input] = ()) -> None:
        self.scene = scene
        self.initial = spawn(scene)
        self.engines = {name: create(name, scene, self.initial) for name in names}
        self.steps = 0
        self.hand = Hand(scene)
        self.pulls: dict[str, Vector] = {}  # px/s that the hand gave in the last step, where it held a ball
        self.given: list[Input] = []  # all inputs obeyed so far
        self._to_come = list(reversed(inputs))

    def obey(self, given: Input) -> None:
        """Take an input, which is to belong to the next step."""
        self.given.append(given)
        self.hand.obey(given)

    def step(self) -> None:
        """Obey the inputs that are due, let the hand pull, and advance every engine by one step."""
        while self._to_come and self._to_come[-1].step <= self.steps:
            self.obey(self._to_come.pop())
        ball = self.hand.ball
        self.pulls = {}
        if ball is not None:
            for name, engine in self.engines.items():
                state = engine.state()
                self.pulls[name] = self.hand.pull(state.position[ball], state.velocity[ball])
                engine.kick(ball, self.pulls[name])
        for engine in self.engines.values():
            engine.step()
        self.steps += 1

    def states(self) -> dict[str, State]:
        """Return a snapshot of every engine."""
        return {name: engine.state() for name, engine in self.engines.items()}


@dataclass(frozen=True)
class Trajectory:
    """What one engine made of a scene.

    time: (steps + 1,) s; position: (steps + 1, n, 2) px; velocity: (steps + 1, n, 2) px/s;
    radius: (n,) px; mass: (n,) kg; size: of the arena, px.
    """

    time: Floats
    position: Floats
    velocity: Floats
    radius: Floats
    mass: Floats
    size: tuple[float, float]


def simulate(
    scene: Scene,
    engine: str,
    *,
    seconds: float | None = None,
    steps: int | None = None,
    inputs: Sequence[Input] = (),
) -> Trajectory:
    """Run a scene in one engine: for a number of steps, or for some seconds (the scene's where left out).

    Raises Mistake for an engine that is none, Refused where the engine cannot honour the scene.
    """
    steps = round((scene.seconds if seconds is None else seconds) * scene.rate) if steps is None else steps
    size = (steps + 1) * len(scene.bodies) * 4 * 8
    if size > MAX_BYTES:
        raise Mistake(f"a trace of {steps:,} steps takes {size / 1e9:.3g} GB here; at most 3 are allowed")
    lockstep = Lockstep(scene, [engine], inputs)
    position = np.empty((steps + 1, *lockstep.initial.position.shape))
    velocity = np.empty_like(position)
    for step in range(steps + 1):
        if step:
            lockstep.step()
        state = lockstep.states()[engine]
        position[step], velocity[step] = state.position, state.velocity
    time = np.arange(steps + 1) / scene.rate
    return Trajectory(time, position, velocity, scene.bodies.radius, scene.bodies.mass, scene.arena.size)


def write_trace(trajectory: Trajectory, path: str | Path) -> None:
    """Write a trajectory as .npz, .csv or extended .xyz, by the path's ending; `-` is csv on standard output.

    Raises Mistake for another ending, and where the file cannot be written.
    """
    write = trace_writer(path)
    with whole_file(path) as file:
        write(trajectory, file)


def trace_writer(path: str | Path) -> Callable[[Trajectory, IO[bytes]], None]:
    """Choose how to write a trace by its path's ending. Raises Mistake where none fits."""
    ending = ".csv" if str(path) == "-" else Path(path).suffix
    if ending not in _WRITERS:
        raise Mistake(f"{path}: a trace must end in one of {', '.join(_WRITERS)}")
    return _WRITERS[ending]


def _write_npz(trajectory: Trajectory, file: IO[bytes]) -> None:
    arrays = ("time", "position", "velocity", "radius", "mass")
    np.savez_compressed(file, **{name: getattr(trajectory, name) for name in arrays})


def _write_csv(trajectory: Trajectory, file: IO[bytes]) -> None:
    file.write(b"time,ball,x,y,vx,vy,radius,mass\n")
    for time, balls in _frames(trajectory):
        file.writelines(
            f"{time!r},{ball},{x!r},{y!r},{vx!r},{vy!r},{radius!r},{mass!r}\n".encode()
            for ball, (x, y, vx, vy, radius, mass) in enumerate(balls)
        )


def _write_xyz(trajectory: Trajectory, file: IO[bytes]) -> None:
    """Write extended XYZ, as OVITO and ASE read it: the arena is the cell, z is 0."""
    width, height = trajectory.size
    head = (
        f'{len(trajectory.radius)}\nLattice="{width!r} 0 0 0 {height!r} 0 0 0 1" pbc="F F F" '
        "Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1:mass:R:1 Time="
    )
    for time, balls in _frames(trajectory):
        file.write(f"{head}{time!r}\n".encode())
        file.writelines(
            f"X {x!r} {y!r} 0 {vx!r} {vy!r} 0 {radius!r} {mass!r}\n".encode() for x, y, vx, vy, radius, mass in balls
        )


def _frames(trajectory: Trajectory) -> Iterator[tuple[float, list[list[float]]]]:
    """Yield each time with its balls' x, y, vx, vy, radius, mass."""
    constants = np.column_stack([trajectory.radius, trajectory.mass])
    for time, position, velocity in zip(trajectory.time, trajectory.position, trajectory.velocity, strict=True):
        yield float(time), np.hstack([position, velocity, constants]).tolist()


_WRITERS: Final = {".npz": _write_npz, ".csv": _write_csv, ".xyz": _write_xyz}
