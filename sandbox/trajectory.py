"""Engines stepped together under one hand; one engine -> a trajectory, and its files."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

import numpy as np

from sandbox.clock import Clock
from sandbox.edits import AddBall, DeleteBall, Edit, SetRate
from sandbox.engines import Engine, create
from sandbox.inputs import Hand, Input, clock_of
from sandbox.mistakes import Mistake
from sandbox.output import STANDARD_OUTPUT, whole_file
from sandbox.scene import Scene, Vector
from sandbox.spawn import spawn
from sandbox.state import Contacts, Floats, State

MAX_BYTES: Final = 3_000_000_000  # of a trajectory, which is held in memory whole


class Runner:
    """One engine of a lockstep, through all edits: an engine of its own, which each edit replaces by another."""

    def __init__(self, name: str, engine: Engine, clock: Clock, steps: int) -> None:
        self.name = name
        self.engine = engine
        self._clock = clock
        self._steps = steps
        self._since = clock.time(steps)  # s, when the engine was built
        self._earlier: list[Contacts] | None = None  # of the engines before; None while nobody has asked

    @property
    def together(self) -> bool:
        """Whether it resolves all contacts of a time together."""
        return getattr(self.engine, "together", False)

    def replace(self, engine: Engine) -> None:
        """Go on with another engine."""
        if self._earlier is not None:
            self._earlier.append(self._latest())
            engine.contacts()
        self.engine, self._since = engine, self._clock.time(self._steps)

    def step(self) -> None:
        """Advance by one step."""
        self.engine.step()
        self._steps += 1

    def state(self) -> State:
        """Return a snapshot."""
        state = self.engine.state()
        return State(self._clock.time(self._steps), state.position, state.velocity)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first begins their collecting."""
        found, self._earlier = [*(self._earlier or ()), self._latest()], []
        return np.concatenate(found) if len(found) > 1 else found[0]

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self.engine.kick(ball, dv)

    def _latest(self) -> Contacts:
        contacts = self.engine.contacts()
        contacts["time"] += self._since
        return contacts


class Lockstep:
    """Engines that run one scene from one state, a step at a time, with the same mouse and the same edits."""

    def __init__(self, scene: Scene, names: Iterable[str], inputs: Sequence[Input] = ()) -> None:
        self.scene = scene  # that runs: edits change it
        self.initial = spawn(scene)
        self.steps = 0
        self.clock = Clock(scene.rate)
        self.engines = {name: self.runner(name, self.initial) for name in names}
        self.along: list[Runner] = []  # engines that run along, and are not told of
        self.hand = Hand(scene)
        self.pulled: int | None = None  # the ball that the hand pulled in the last step
        self.pulls: dict[str, Vector] = {}  # px/s that it gave to it, by engine
        self.given: list[Input] = []  # all inputs obeyed so far
        self.balls = list(range(len(scene.bodies)))  # which each is of all that there ever were
        self.edited = False  # since the last step
        self._born = len(self.balls)
        self._to_come = list(reversed(inputs))

    def runner(self, name: str, state: State) -> Runner:
        """Build an engine that goes on from a state at this step."""
        return Runner(name, create(name, self.scene, state), self.clock, self.steps)

    @property
    def time(self) -> float:
        """How long it has run, s."""
        return self.clock.time(self.steps)

    def obey(self, given: Input) -> None:
        """Take an input, which is to belong to the next step.

        Raises Mistake, with nothing changed, for an edit that cannot be or that an engine refuses.
        """
        if isinstance(given, Edit):
            self._edit(given)
        self.given.append(given)
        self.hand.obey(given)

    def _edit(self, edit: Edit) -> None:
        scene = edit.change_scene(self.scene)
        runners = [*self.engines.values(), *self.along]
        built = [(runner, create(runner.name, scene, edit.change_state(runner.state()))) for runner in runners]
        for runner, engine in built:
            runner.replace(engine)
        self.scene = self.hand.scene = scene
        self.edited = True
        match edit:
            case AddBall():
                self.balls.append(self._born)
                self._born += 1
            case DeleteBall(ball=ball):
                del self.balls[ball]
            case SetRate(rate=rate):
                self.clock.change(self.steps, rate)

    def obey_due(self) -> None:
        """Obey the inputs that belong to the next step."""
        while self._to_come and self._to_come[-1].step <= self.steps:
            self.obey(self._to_come.pop())

    def step(self) -> None:
        """Obey the inputs that are due, let the hand pull, and advance every engine by one step."""
        self.obey_due()
        ball = self.hand.ball
        self.pulled, self.pulls, self.edited = ball, {}, False
        for runner in (*self.engines.values(), *self.along):
            if ball is not None:
                state = runner.state()
                pull = self.hand.pull(state.position[ball], state.velocity[ball])
                runner.kick(ball, pull)
                self.pulls.setdefault(runner.name, pull)
            runner.step()
        self.steps += 1

    def states(self) -> dict[str, State]:
        """Return a snapshot of every engine."""
        return {name: runner.state() for name, runner in self.engines.items()}


@dataclass(frozen=True)
class Trajectory:
    """What one engine made of a scene.

    time: (steps + 1,) s; position: (steps + 1, n, 2) px; velocity: (steps + 1, n, 2) px/s;
    radius: (n,) px; mass: (n,) kg; size: of the arena, px. n counts all balls that there ever were, in the order
    in which they came; positions and velocities are NaN while a ball is not there.
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

    A state is that after the edits at its step. Raises Mistake for an engine that is none, Refused where the engine
    cannot honour the scene.
    """
    clock = clock_of(scene.rate, inputs)
    steps = clock.step(scene.seconds if seconds is None else seconds) if steps is None else steps
    added = [given for given in inputs if isinstance(given, AddBall) and given.step <= steps]
    balls = len(scene.bodies) + len(added)
    size = (steps + 1) * balls * 4 * 8
    if size > MAX_BYTES:
        raise Mistake(f"a trace of {steps:,} steps takes {size / 1e9:.3g} GB here; at most 3 are allowed")
    lockstep = Lockstep(scene, [engine], inputs)
    position = np.full((steps + 1, balls, 2), np.nan)
    velocity = np.full_like(position, np.nan)
    for step in range(steps + 1):
        if step:
            lockstep.step()
        lockstep.obey_due()
        state = lockstep.states()[engine]
        position[step, lockstep.balls], velocity[step, lockstep.balls] = state.position, state.velocity
    time = np.array([clock.time(step) for step in range(steps + 1)])
    radius = np.append(scene.bodies.radius, [given.radius for given in added])
    mass = np.append(scene.bodies.mass, [given.mass for given in added])
    return Trajectory(time, position, velocity, radius, mass, scene.arena.size)


def write_trace(trajectory: Trajectory, path: str | Path) -> None:
    """Write a trajectory as .npz, .csv or extended .xyz, by the path's ending; on standard output, as csv.

    Raises Mistake for another ending, and where the file cannot be written.
    """
    write = trace_writer(path)
    with whole_file(path) as file:
        write(trajectory, file)


def trace_writer(path: str | Path) -> Callable[[Trajectory, IO[bytes]], None]:
    """Choose how to write a trace by its path's ending. Raises Mistake where none fits."""
    ending = ".csv" if str(path) in STANDARD_OUTPUT else Path(path).suffix
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
            for ball, (x, y, vx, vy, radius, mass) in balls
        )


def _write_xyz(trajectory: Trajectory, file: IO[bytes]) -> None:
    """Write extended XYZ, as OVITO and ASE read it: the arena is the cell, z is 0."""
    width, height = trajectory.size
    head = (
        f'Lattice="{width!r} 0 0 0 {height!r} 0 0 0 1" pbc="F F F" '
        "Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1:mass:R:1 Time="
    )
    for time, balls in _frames(trajectory):
        file.write(f"{len(balls)}\n{head}{time!r}\n".encode())
        file.writelines(
            f"X {x!r} {y!r} 0 {vx!r} {vy!r} 0 {radius!r} {mass!r}\n".encode()
            for _, (x, y, vx, vy, radius, mass) in balls
        )


def _frames(trajectory: Trajectory) -> Iterator[tuple[float, list[tuple[int, list[float]]]]]:
    """Yield each time with the balls that are there: number, and x, y, vx, vy, radius, mass."""
    constants = np.column_stack([trajectory.radius, trajectory.mass])
    for time, position, velocity in zip(trajectory.time, trajectory.position, trajectory.velocity, strict=True):
        there = np.flatnonzero(~np.isnan(position[:, 0]))
        rows = np.hstack([position, velocity, constants])[there].tolist()
        yield float(time), list(zip(there.tolist(), rows, strict=True))


_WRITERS: Final = {".npz": _write_npz, ".csv": _write_csv, ".xyz": _write_xyz}
