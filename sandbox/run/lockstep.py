"""Engines stepped together, with the same mouse and the same edits."""

from collections.abc import Iterable, Sequence

import numpy as np

from sandbox.engines import Engine, create
from sandbox.run.clock import Clock
from sandbox.run.edits import AddBall, DeleteBall, Edit, SetRate
from sandbox.run.inputs import Input
from sandbox.run.mouse import Hand
from sandbox.scene.model import Scene, Vector
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, State


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

        Raises SandboxError, with nothing changed, for an edit that cannot be or that an engine refuses.
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
