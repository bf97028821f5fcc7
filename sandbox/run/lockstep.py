"""Engines stepped together, with the same mouse and the same edits."""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from itertools import count, pairwise
from time import perf_counter
from typing import Final, cast

import numpy as np

from sandbox.engines import Engines, Source, create, named
from sandbox.engines.checked import CheckedEngine
from sandbox.engines.engine import RunningEngine, SubsteppingEngine, advance, traits_of
from sandbox.engines.stand_ins import StoppingEngine
from sandbox.errors import LimitReached, Refused, SandboxError
from sandbox.quantity import dot, energy
from sandbox.run.edits import AddBall, DeleteBall, Edit, check_ball, edited
from sandbox.run.inputs import Grab, Input, Kick
from sandbox.run.mouse import Applied, Mouse, Push
from sandbox.scene.clock import Clock
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, State, States

FIRST_STEPS: Final = 16  # that engines do in one call while it is not known how fast they are
AVERAGED_STEPS: Final = 30  # over which the time of a step is averaged, about
MAX_CALL_SECONDS: Final = 0.2  # s, about: between calls, a signal is handled and progress is shown

Build = Callable[[Scene, State], RunningEngine]


class Runner:
    """An engine of a lockstep; each edit replaces the engine, while time and contacts continue.

    build: builds the engine from a scene and a state.
    """

    def __init__(self, build: Build, scene: Scene, state: State, clock: Clock, steps: int) -> None:
        self.build = build
        self.engine = build(scene, state)
        self._clock = clock
        self._steps = steps
        self.start = clock.time(steps)  # s, when the engine was built
        self.step_seconds: float | None = None  # s that a step took lately, for information only
        self._earlier: list[Contacts] | None = None  # of the engines replaced; None until contacts are recorded

    def replace(self, engine: RunningEngine, steps: int) -> None:
        """Continue with another engine after some steps, the last of which may have been without one."""
        if self._earlier is not None:
            self._earlier.append(self._latest())
            engine.record_contacts()
        self.engine, self.start, self._steps = engine, self._clock.time(steps), steps

    def step(self) -> None:
        """Advance by one step."""
        begun = perf_counter()
        self.engine.step()
        seconds = perf_counter() - begun
        before = seconds if self.step_seconds is None else self.step_seconds
        self.step_seconds = before + (seconds - before) / AVERAGED_STEPS
        self._steps += 1

    def advance(self, states: States) -> None:
        """Advance by as many steps as there are rows, and write the state after each into them."""
        advance(self.engine, states)
        self._steps += len(states.position)

    def follow(self, states: States, applied: Mapping[int, Applied]) -> None:
        """Advance as `advance` does, with the pushes of a lockstep. applied: what pushes balls before some steps."""
        first, end = self._steps, self._steps + len(states.position)
        starts = [step for step in range(first, end) if step == first or step in applied]
        for step, until in pairwise([*starts, end]):
            if step in applied:
                self.push(applied[step])
            self.advance(states.rows(slice(step - first, until - first)))

    def state(self) -> State:
        """Return the engine's state, with the time since the start of the run."""
        state = self.engine.state()
        return replace(state, time=self._clock.time(self._steps))

    def record_contacts(self) -> None:
        """Start to record contacts."""
        self._earlier = []
        self.engine.record_contacts()

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        parts, self._earlier = [*(self._earlier or ()), self._latest()], []
        return np.concatenate(parts) if len(parts) > 1 else parts[0]

    def substates(self) -> States:
        """Return the states after each substep since the last call; the first call starts recording."""
        return cast("SubsteppingEngine", self.engine).substates()

    def push(self, applied: Applied) -> tuple[State, list[Push]]:
        """Push the balls before a step. Return the state before, and the pushes."""
        state = self.state()
        pushes = applied.pushes(state)
        for ball, dv in pushes:
            self.engine.kick(ball, dv)
        return state, pushes

    def _latest(self) -> Contacts:
        contacts = self.engine.contacts()
        contacts["time"] += self.start
        return contacts


def _build(name: str, source: Source, stops: bool, scene: Scene, state: State) -> RunningEngine:
    engine = create(source, scene, state, name)
    return StoppingEngine(engine, engine.state()) if stops and isinstance(engine, CheckedEngine) else engine


class Lockstep:
    """Engines that run one scene from one state, step by step, with the same mouse and the same edits.

    stops: whether an engine that fails or reaches a limit stops there, and does not raise EngineError or LimitReached;
    expendable: the engine without which the others go on if it raises SandboxError in a step. reference: if named, any
    other engine that refuses an edited scene is suspended; as soon as the scene allows it again, it continues from the
    reference's state then. Otherwise the edit is refused.
    Raises SandboxError if an engine's name is unknown, Refused if an engine cannot run the scene or be dragged as the
    inputs ask.
    """

    def __init__(
        self,
        scene: Scene,
        engines: Engines,
        inputs: Sequence[Input] = (),
        *,
        stops: bool = False,
        expendable: str | None = None,
        reference: str | None = None,
    ) -> None:
        self.scene = scene  # with the edits so far
        self.initial = spawn(scene)
        self.steps = 0
        self.clock = copy(scene.clock)
        self.engines = {
            name: self.new_runner(partial(_build, name, source, stops), self.initial)
            for name, source in named(engines).items()
        }
        self.mouse = Mouse(scene)
        self.applied: dict[int, Applied] = {}  # what pushed balls before some of the steps so far
        self.pushes: dict[str, list[Push]] = {}  # before the last step, by engine
        self._kicks: list[Push] = []  # before the next step
        self.work = dict.fromkeys(self.engines, 0.0)  # kg px²/s², what mouse, kicks and edits have added to each energy
        self.dropped = ""  # why the expendable engine runs no more
        self._stops, self._expendable, self._reference = stops, expendable, reference
        self.home = self  # the lockstep in which the reference runs
        self.suspended: dict[str, str] = {}  # why each of these engines cannot run the scene as it is
        self._runners = dict(self.engines)  # the suspended ones too
        self._states: dict[str, State] | None = None  # of the engines now, once they are read
        self.given: list[Input] = []  # all inputs applied so far
        self.balls = list(range(len(scene.bodies)))  # the number of each ball among all balls that ever existed
        self.edited = False  # since the last step
        self._new_balls = count(len(self.balls))
        self._steps_per_call = FIRST_STEPS
        self.replace_pending(inputs)

    def new_runner(self, build: Build, state: State) -> Runner:
        """Build an engine that continues from a state at this step."""
        return Runner(build, self.scene, state, self.clock, self.steps)

    @property
    def time(self) -> float:
        """The time since the start, s."""
        return self.clock.time(self.steps)

    def apply(self, given: Input) -> None:
        """Apply an input of the next step.

        Raises SandboxError, with nothing changed, for an edit or a drag that is impossible or that an engine refuses.
        If only the expendable engine has no room for an edit, that engine is dropped.
        """
        self._check_drag(given)
        if isinstance(given, Edit):
            self._edit(given)
        elif isinstance(given, Grab | Kick):
            check_ball(given.ball, self.scene)
        if isinstance(given, Kick):
            self._kicks.append((given.ball, given.velocity))
        self.given.append(given)
        self.mouse.apply(given)

    def _edit(self, edit: Edit) -> None:
        states, works = self.states(), dict(self.work)
        scene = edited(self.scene, edit, {name: state for name, state in states.items() if name != self._expendable})
        try:
            edited(self.scene, edit, {name: state for name, state in states.items() if name == self._expendable})
        except SandboxError as error:
            self._drop(str(error))
        present = self._present() if self.suspended else None
        if present:
            states |= dict.fromkeys(self.suspended, present[0])
            works |= dict.fromkeys(self.suspended, present[1])
        engines, suspended = dict[str, RunningEngine](), {} if present else dict(self.suspended)
        for name, runner in self._runners.items():
            try:
                if name in states:
                    engines[name] = runner.build(scene, edit.change_state(states[name]))
            except Refused as refused:
                if self._reference in (None, name):
                    raise
                suspended[name] = str(refused)
        before = self.energies({name: states[name] for name in engines})
        for name, engine in engines.items():
            self._runners[name].replace(engine, self.steps)
        self.engines = {name: self._runners[name] for name in engines}
        self.suspended, self._states = suspended, None
        edit.change_clock(self.clock)
        self.scene = self.mouse.scene = scene
        for name, after in self.energies(self.states()).items():
            self.work[name] = works[name] + (after - before[name])
        self.edited = True
        if isinstance(edit, AddBall):
            self.balls.append(next(self._new_balls))
        elif isinstance(edit, DeleteBall):
            del self.balls[edit.ball]

    def _present(self) -> tuple[State, float] | None:
        """Return the state from which a suspended engine continues, and what mouse and edits added to its energy.

        It is that of the reference or, if that runs no more, of the first engine.
        """
        of_reference = self._reference in self.home.engines
        home, name = (self.home, self._reference) if of_reference else (self, next(iter(self.engines), None))
        return (home.engines[name].state(), home.work[name]) if name else None

    def _check_drag(self, given: Input) -> None:
        if isinstance(given, Grab | Kick):
            for name, runner in self.engines.items():
                if not traits_of(runner.engine).can_be_dragged:
                    raise Refused(f"{name}: has no method kick, so its balls cannot be dragged")

    def replace_pending(self, inputs: Sequence[Input]) -> None:
        """Replace the inputs to come by those among all inputs of the run that are not applied yet."""
        self._pending = list(reversed(inputs[len(self.given) :]))
        for given in self._pending:
            self._check_drag(given)

    def apply_due(self) -> None:
        """Apply the inputs of the next step."""
        while self._pending and self._pending[-1].step <= self.steps:
            self.apply(self._pending.pop())

    def step(self) -> None:
        """Apply the inputs of this step, pull the grabbed ball, and advance every engine by one step."""
        self._begin_step()
        before = self.states() if self._stops else {}
        for name, runner in list(self.engines.items()):
            try:
                runner.step()
            except SandboxError as error:
                if name == self._expendable:
                    self._drop(str(error))
                elif isinstance(error, LimitReached) and self._stops:
                    runner.engine = StoppingEngine(runner.engine, before[name], error)  # within the limit
                else:
                    raise
        self.steps += 1
        self._states = None

    def advance(self, arrays: Mapping[Runner, States]) -> int:
        """Do one step or more as `step` does, write the states after each, and return the number of steps done.

        arrays: where the states of each engine go, all with the same number of rows, which is the largest number of
        steps. Fewer are done if inputs are due or they would take long, and only one while the mouse pulls a ball.
        """
        self._begin_step()
        most = self._steps_per_call if self.mouse.ball is None else 1
        steps = min(most, *(len(states.position) for states in arrays.values()))
        if self._pending:
            steps = min(steps, self._pending[-1].step - self.steps)
        begun = perf_counter()
        for runner in self.engines.values():
            runner.advance(arrays[runner].rows(slice(steps)))
        self._steps_per_call = max(1, int(steps * MAX_CALL_SECONDS / (perf_counter() - begun)))
        self.steps += steps
        self._states = None
        return steps

    def _begin_step(self) -> None:
        """Apply the inputs of this step, kick the balls that they kick, and pull the grabbed ball."""
        self.apply_due()
        self.pushes, self.edited = {}, False
        if self.mouse.ball is None and not self._kicks:
            return
        self.applied[self.steps] = applied = Applied(self._kicks, copy(self.mouse))
        self._kicks, self._states = [], None
        for name, runner in self.engines.items():
            state, self.pushes[name] = runner.push(applied)
            self.work[name] += self._work_of(self.pushes[name], state)

    def _work_of(self, pushes: Sequence[Push], state: State) -> float:
        """Return what pushes add to a state's energy, kg px²/s²."""
        velocity, work = state.velocity.copy(), 0.0
        for ball, dv in pushes:
            work += float(self.scene.bodies.mass[ball] * dot(velocity[ball] + np.divide(dv, 2), np.asarray(dv)))
            velocity[ball] += dv
        return work

    def _drop(self, why: str) -> None:
        """Go on without the expendable engine."""
        self.dropped, self._states = why, None
        del self.engines[str(self._expendable)], self._runners[str(self._expendable)]

    def standing(self) -> dict[str, SandboxError]:
        """Return why engines stand still: they have failed, or reached a limit."""
        engines = {name: runner.engine for name, runner in self.engines.items()}
        errors = {name: engine.error for name, engine in engines.items() if isinstance(engine, StoppingEngine)}
        return {name: error for name, error in errors.items() if error}

    def states(self) -> dict[str, State]:
        """Return the state of every engine."""
        if self._states is None:
            self._states = {name: runner.state() for name, runner in self.engines.items()}
        return dict(self._states)

    def energies(self, states: Mapping[str, State]) -> dict[str, float]:
        """Return the energy of each of some states, kg px²/s²."""
        scene = self.scene
        return {
            name: float(energy(state, scene.bodies, scene.gravity, scene.arena.size)) for name, state in states.items()
        }
