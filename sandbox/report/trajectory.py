"""The trajectory of a scene in one engine, and its files."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

import numpy as np

from sandbox.engines import Source
from sandbox.errors import SandboxError
from sandbox.files import STANDARD_OUTPUT, whole_file
from sandbox.quantity import energy
from sandbox.run.edits import AddBall, ChangeBall
from sandbox.run.inputs import Input, clock_of
from sandbox.run.lockstep import Lockstep
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, Integers, States, no_contacts
from sandbox.text import counted, csv_text

MAX_TRAJECTORY_BYTES: Final = 3_000_000_000  # in memory, where all of it is kept
MAX_BLOCK_STEPS: Final = 64  # that the engine does in one call
COLUMNS: Final = ("time", "ball", "x", "y", "vx", "vy", "radius", "mass", "angle", "spin", "energy")  # of a CSV


@dataclass(frozen=True, repr=False)
class Trajectory:
    """The run of a scene in one engine, at the start and after every step.

    time: (steps + 1,) s; position: (steps + 1, n, 2) px; velocity: (steps + 1, n, 2) px/s; radius: (n,) px;
    mass: (n,) kg; size: width and height of the arena, px; angle: (steps + 1, n) rad; spin: (steps + 1, n) rad/s;
    contacts: (k,) CONTACT, by time; energy: (steps + 1,) kg px²/s², of flight, spin and gravity. The n balls are the
    scene's and then the added ones, in order; the position, velocity, angle and spin of a ball are NaN before it is
    added and after it is deleted. Walls of contacts have the numbers that they have then. If edits change the radius or
    mass of a ball, radius and mass are (steps + 1, n).
    """

    time: Floats
    position: Floats
    velocity: Floats
    radius: Floats
    mass: Floats
    size: tuple[float, float]
    angle: Floats
    spin: Floats
    contacts: Contacts
    energy: Floats

    def __repr__(self) -> str:
        steps, balls = self.angle.shape
        ran = f"{counted(balls, 'ball')}, {counted(steps - 1, 'step')} to {self.time[-1]:g} s"
        return f"<Trajectory: {ran}, {counted(len(self.contacts), 'contact')}>"

    @property
    def momentum(self) -> Floats:
        """The momentum of all balls: (steps + 1, 2) kg px/s."""
        total: Floats = np.nansum(self.velocity * self.mass[..., None], axis=1)
        return total

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as .npz, an array for each field, or as .csv, by the path's ending; to standard output as CSV.

        Raises SandboxError for another ending, or if the file cannot be written.
        """
        file_name = str(path)
        write = trace_writer(file_name)
        with whole_file(file_name) as file:
            write(self, file)


def simulate(
    scene: Scene, engine: Source | Mapping[str, Source], *, steps: int | None = None, inputs: Sequence[Input] = ()
) -> Trajectory:
    """Run a scene in one engine, for a number of steps, by default for the scene's seconds.

    engine: its name, such as "pymunk", or a class or a function; or a mapping from another name to one of these;
    inputs: recorded inputs to replay. Each state includes the edits of its step.
    Raises SandboxError if the engine is unknown or the trajectory too large, Refused if the engine cannot run the
    scene.
    """
    clock = clock_of(scene.clock, inputs)
    steps = clock.step(scene.seconds) if steps is None else steps
    rows = _Rows(scene, steps, [given for given in inputs if given.step <= steps])
    lockstep = Lockstep(scene, engine, inputs)
    [runner] = lockstep.engines.values()
    runner.record_contacts()
    contacts = [no_contacts()]
    while True:
        lockstep.apply_due()
        step, present = lockstep.steps, np.array(lockstep.balls)
        block = States.empty(min(steps - step, MAX_BLOCK_STEPS) + 1, len(present))
        block.fill(0, runner.state())
        if step == steps:
            rows.fill(lockstep.scene, present, block, step)
            break
        done = lockstep.advance({runner: block.rows(slice(1, None))})
        rows.fill(lockstep.scene, present, block.rows(slice(done)), step)  # the last one may be edited first
        contacts.append(_among_all(runner.contacts(), present))
    resized = any(isinstance(given, ChangeBall) and (given.radius or given.mass) for given in lockstep.given)
    states, (radius, mass) = rows.states, rows.sizes if resized else np.fmax.reduce(rows.sizes, axis=1)
    return Trajectory(
        clock.times(np.arange(steps + 1)), states.position, states.velocity, radius, mass, scene.arena.size,
        states.angle, states.spin, np.concatenate(contacts), rows.energy,
    )  # fmt: skip


class _Rows:
    """The parts of a trajectory of balls that may be added and deleted; NaN where a ball is not there.

    states: (steps + 1, balls); sizes: (2, steps + 1, balls), radius and mass; energy: (steps + 1,). Raises SandboxError
    if they need too much memory.
    """

    def __init__(self, scene: Scene, steps: int, due: Sequence[Input]) -> None:
        balls = len(scene.bodies) + sum(isinstance(given, AddBall) for given in due)
        needed_bytes = (steps + 1) * balls * 8 * 8
        if needed_bytes > MAX_TRAJECTORY_BYTES:
            needed, most = f"{needed_bytes / 1e9:.3g} GB", f"{MAX_TRAJECTORY_BYTES / 1e9:g} GB"
            raise SandboxError(f"a trace of {steps:,} steps needs {needed} of memory; at most {most} are allowed")
        self.states, self.energy = States.empty(steps + 1, balls), np.empty(steps + 1)
        self.sizes = np.empty((2, steps + 1, balls))
        for part in (*self.states, self.sizes):
            part[:] = np.nan

    def fill(self, scene: Scene, present: Integers, states: States, first: int) -> None:
        """Enter the states of a scene's balls after some steps, from one on. present: their numbers among all."""
        rows = slice(first, first + len(states.position))
        for part, more in zip(self.states, states, strict=True):
            part[rows, present] = more
        self.sizes[:, rows, present] = np.stack([scene.bodies.radius, scene.bodies.mass])[:, None]
        self.energy[rows] = energy(states, scene.bodies, scene.gravity, scene.arena.size)


def _among_all(contacts: Contacts, balls: Integers) -> Contacts:
    """Renumber the balls of contacts. balls: (n,), their numbers among all that ever were."""
    first, second = contacts["first"], contacts["second"]
    contacts["first"] = balls[first]
    contacts["second"] = np.where(second < 0, second, balls[np.maximum(second, 0)])
    return contacts


def trace_writer(path: str) -> Callable[[Trajectory, IO[bytes]], None]:
    """Return the function that writes a trace with the path's ending. Raises SandboxError for another ending."""
    ending = ".csv" if path in STANDARD_OUTPUT else Path(path).suffix
    if ending not in _WRITERS:
        raise SandboxError(f"{path}: a trace must end in one of {', '.join(_WRITERS)}")
    return _WRITERS[ending]


def _write_npz(trajectory: Trajectory, file: IO[bytes]) -> None:
    np.savez_compressed(file, **vars(trajectory))


def _write_csv(trajectory: Trajectory, file: IO[bytes]) -> None:
    file.write(csv_text([COLUMNS]).encode())
    sizes = [np.broadcast_to(each, trajectory.angle.shape) for each in (trajectory.radius, trajectory.mass)]
    for step, (time, total) in enumerate(zip(trajectory.time.tolist(), trajectory.energy.tolist(), strict=True)):
        position, velocity = trajectory.position[step], trajectory.velocity[step]
        of_balls = *sizes, trajectory.angle, trajectory.spin
        columns = np.column_stack([position, velocity, *(part[step] for part in of_balls)])
        balls = np.flatnonzero(~np.isnan(position[:, 0]))
        rows = zip(balls.tolist(), columns[balls].tolist(), strict=True)
        file.write(csv_text([time, ball, *row, total] for ball, row in rows).encode())


_WRITERS: Final = {".npz": _write_npz, ".csv": _write_csv}
