"""Engines stepped together, with the same mouse and the same edits."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Final

import numpy as np

from sandbox.engines import Engine, advance, create
from sandbox.run.clock import Clock
from sandbox.run.edits import AddBall, DeleteBall, Edit, SetRate
from sandbox.run.inputs import Input
from sandbox.run.mouse import Mouse
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, State, States

FIRST_STEPS: Final = 16  # that engines do in one call while it is not known how fast they are
MAX_CALL_SECONDS: Final = 0.2  # s, about: between calls, a signal is handled and progress is shown


Build = Callable[[Scene, State], Engine]


class Runner:
    """A named engine of a lockstep; each edit replaces the engine, while time and contacts continue.

    build: builds the engine from a scene and a state.
    """

    def __init__(self, name: str, build: Build, scene: Scene, state: State, clock: Clock, steps: int) -> None:
        self.name = name
        self.build = build
        self.engine = build(scene, state)
        self._clock = clock
        self._steps = steps
        self._start = clock.time(steps)  # s, when the engine was built
        self._earlier: list[Contacts] | None = None  # of the engines replaced; None until contacts are recorded

    @property
    def together(self) -> bool:
        """Whether the engine resolves all contacts of one time together."""
        return getattr(self.engine, "together", False)

    @property
    def infers_impulses(self) -> bool:
        """Whether the impulses of the engine's contacts are inferred from the changes of velocity."""
        return getattr(self.engine, "infers_impulses", False)

    @property
    def clamps_friction_early(self) -> bool:
        """Whether the engine is known to limit friction by the impulse without restitution."""
        return getattr(self.engine, "clamps_friction_early", False)

    def replace(self, engine: Engine) -> None:
        """Continue with another engine."""
        if self._earlier is not None:
            self._earlier.append(self._latest())
            engine.contacts()
        self.engine, self._start = engine, self._clock.time(self._steps)

    def step(self) -> None:
        """Advance by one step."""
        self.engine.step()
        self._steps += 1

    def advance(self, states: States) -> None:
        """Advance by as many steps as there are rows, and write the state after each into them."""
        advance(self.engine, states)
        self._steps += len(states.position)

    def state(self) -> State:
        """Return the engine's state, with the time since the start of the run."""
        state = self.engine.state()
        return replace(state, time=self._clock.time(self._steps))

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts recording."""
        found, self._earlier = [*(self._earlier or ()), self._latest()], []
        return np.concatenate(found) if len(found) > 1 else found[0]

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self.engine.kick(ball, dv)

    def _latest(self) -> Contacts:
        contacts = self.engine.contacts()
        contacts["time"] += self._start
        return contacts


class Lockstep:
    """Engines that run one scene from one state, step by step, with the same mouse and the same edits.

    Raises SandboxError if an engine's name is unknown, Refused if an engine cannot run the scene.
    """

    def __init__(self, scene: Scene, names: Iterable[str], inputs: Sequence[Input] = ()) -> None:
        self.scene = scene  # with the edits so far
        self.initial = spawn(scene)
        self.steps = 0
        self.clock = Clock(scene.rate)
        self.engines = {name: self.new_runner(name, self.initial) for name in names}
        self.hidden: list[Runner] = []  # run along, but excluded from results
        self.mouse = Mouse(scene)
        self.pulled: int | None = None  # the ball that the mouse pulled in the last step
        self.pulls: dict[str, Vector] = {}  # px/s that the pull added to the ball's velocity, by engine
        self.given: list[Input] = []  # all inputs applied so far
        self.balls = list(range(len(scene.bodies)))  # the number of each ball among all balls that ever existed
        self.edited = False  # since the last step
        self._balls_ever = len(self.balls)
        self._pending = list(reversed(inputs))
        self._steps_per_call = FIRST_STEPS

    def new_runner(self, name: str, state: State, build: Build | None = None) -> Runner:
        """Build an engine that continues from a state at this step; by default the named one."""
        return Runner(name, build or partial(create, name), self.scene, state, self.clock, self.steps)

    @property
    def time(self) -> float:
        """The time since the start, s."""
        return self.clock.time(self.steps)

    def apply(self, given: Input) -> None:
        """Apply an input of the next step.

        Raises SandboxError, with nothing changed, for an edit that is impossible or that an engine refuses.
        """
        if isinstance(given, Edit):
            self._edit(given)
        self.given.append(given)
        self.mouse.apply(given)

    def _edit(self, edit: Edit) -> None:
        scene = edit.change_scene(self.scene)
        built = [(one, one.build(scene, edit.change_state(one.state()))) for one in self._runners]
        for runner, engine in built:
            runner.replace(engine)
        self.scene = self.mouse.scene = scene
        self.edited = True
        match edit:
            case AddBall():
                self.balls.append(self._balls_ever)
                self._balls_ever += 1
            case DeleteBall(ball=ball):
                del self.balls[ball]
            case SetRate(rate=rate):
                self.clock.change(self.steps, rate)

    def apply_due(self) -> None:
        """Apply the inputs of the next step."""
        while self._pending and self._pending[-1].step <= self.steps:
            self.apply(self._pending.pop())

    def step(self) -> None:
        """Apply the inputs of this step, pull the grabbed ball, and advance every engine by one step."""
        self._begin_step()
        for runner in self._runners:
            runner.step()
        self.steps += 1

    def advance(self, arrays: Mapping[Runner, States]) -> int:
        """Do one step or more as `step` does, write the states after each, and return the number of steps done.

        arrays: where the states of each engine go, hidden ones too, all with the same number of rows, which is the
        largest number of steps. Fewer are done if inputs are due or they would take long, and only one while the mouse
        pulls a ball.
        """
        self._begin_step()
        most = self._steps_per_call if self.pulled is None else 1
        steps = min(most, *(len(states.position) for states in arrays.values()))
        if self._pending:
            steps = min(steps, self._pending[-1].step - self.steps)
        begun = perf_counter()
        for runner in self._runners:
            runner.advance(arrays[runner].rows(slice(steps)))
        self._steps_per_call = max(1, int(steps * MAX_CALL_SECONDS / (perf_counter() - begun)))
        self.steps += steps
        return steps

    def _begin_step(self) -> None:
        """Apply the inputs of this step, and pull the grabbed ball."""
        self.apply_due()
        ball = self.mouse.ball
        self.pulled, self.pulls, self.edited = ball, {}, False
        if ball is None:
            return
        for runner in self._runners:
            pull = self.mouse.pull(runner.state())
            runner.kick(ball, pull)
            self.pulls.setdefault(runner.name, pull)  # a hidden engine may have the same name

    @property
    def _runners(self) -> list[Runner]:
        return [*self.engines.values(), *self.hidden]

    def states(self) -> dict[str, State]:
        """Return the state of every engine that is not hidden."""
        return {name: runner.state() for name, runner in self.engines.items()}
