"""A run that can be rewound: the past is shown from its history, and run again before it continues from there.

No engine can be copied bit for bit while it runs (a Pymunk space has state that a copy would lose). So a run is its
inputs: to continue from a step, the engines run again from the start with the same inputs, to the same bytes.
"""

from collections.abc import Sequence
from typing import Final

from sandbox.analysis.gas import wall_impulse
from sandbox.analysis.reference import reference_of
from sandbox.compiled import NotCompiledYet, between_frames
from sandbox.engines import Engines, Source, create, named
from sandbox.errors import SandboxError
from sandbox.run.edits import ChangeWall, Edit, edited
from sandbox.run.inputs import MAX_EDITS, Grab, Input, Move, Release, clock_of
from sandbox.run.lockstep import Lockstep
from sandbox.scene.balls import BallGroup
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scores.energy_scale import EnergyScale
from sandbox.session.history import History, Moment
from sandbox.session.samples import Samples
from sandbox.state import Contacts, State, States, no_contacts

CALLS_PER_TRY: Final = 30  # between two tries whether the reference is compiled by now


class Session:
    """Engines in lockstep, at any step that they have reached.

    An input given in the past replaces all that came after it. `undo` undoes one *action*: an edit with those that
    continue it, or a grab with everything up to its release. An engine that is not built in and fails stops there; the
    others go on.

    reference: the engine that the others are measured against, by default as `reference_of` chooses. If it is not among
    the names, it runs along, hidden, as long as it can; in a window, from when it is compiled.
    """

    def __init__(
        self,
        scene: Scene,
        engines: Engines,
        inputs: Sequence[Input] = (),
        reference: str | None = None,
    ) -> None:
        self.start = scene
        self._engines = named(engines)
        self.names = list(self._engines)
        self.reference = reference or reference_of(self.names)
        self.inputs = list(inputs)  # past and to come, by step
        self.step = 0  # the present one, which may lie in the past of the engines
        self.end = 0  # the latest reached with these inputs
        self._history = History()
        self._undone: list[list[Input]] = []
        self._calls = 0  # of `admit_reference`
        self._begin()
        at_start = self.lockstep.energies({"": self.lockstep.initial})[""]
        silent = [name for name, runner in self.lockstep.engines.items() if not runner.traits.reports_contacts]
        engines_sampled = list(dict.fromkeys([*self.names, self.reference]))
        self.samples = Samples(engines_sampled, self.reference, at_start, silent, self._history)
        self._arrive()

    # The present step

    @property
    def shown(self) -> Moment:
        """The moment at the present step, or the nearest that is kept while the engines are elsewhere."""
        return self._history.nearest(self.step)

    @property
    def steps_behind(self) -> int:
        """The number of steps that the engines must run before the session can continue from here."""
        return self.step if self._stale or self.lockstep.steps > self.step else self.step - self.lockstep.steps

    @property
    def is_live(self) -> bool:
        """Whether the engines are at the present step."""
        return not self._stale and self.lockstep.steps == self.step

    @property
    def held(self) -> int | None:
        """The ball that the mouse holds now; None during a replay of earlier inputs."""
        nothing_to_come = len(self.lockstep.given) == len(self.inputs)
        return self.lockstep.mouse.ball if self.is_live and nothing_to_come else None

    def moments(self, first: int, last: int) -> list[Moment]:
        """Return the moments kept between two steps, both included, in order."""
        return self._history.between(first, last)

    def given(self) -> list[Input]:
        """Return the inputs up to the present step."""
        return [given for given in self.inputs if given.step <= self.step]

    def seek(self, step: int) -> None:
        """Go to a step that was reached before; `catch_up` brings the engines there."""
        self.step = min(max(step, 0), self.end)

    def go_on_from(self, earlier: "Session") -> None:
        """Go to the latest step that another session has reached with the same inputs, with what can be redone there.

        `catch_up` brings the engines there.
        """
        self.step = self.end = earlier.end
        self._undone = [*earlier._undone]

    def step_at(self, time: float) -> int:
        """Return the step nearest to a time (s)."""
        return clock_of(self.start.clock, self.inputs).step(time)

    # Running

    def admit_reference(self) -> bool:
        """If the reference waits to be compiled, and now is, let `catch_up` run everything again with it.

        Called once a frame. Return whether the reference is there now and was not before.
        """
        self._calls += self.lacks_reference
        if not self.lacks_reference or self._calls % CALLS_PER_TRY or not self._can_run_along():
            return False
        self.samples.series.cut(-1)
        self._stale = True
        return True

    def advance(self) -> None:
        """Run one step from here, with the inputs that were given there if it was reached before.

        Raises SandboxError if edits to come are refused; they are dropped, and the step is done.
        """
        self.catch_up()
        self.lockstep.step()
        self.step = self.lockstep.steps
        self.end = max(self.end, self.step)
        self._arrive()

    def catch_up(self, max_steps: int | None = None) -> None:
        """Run the engines again to the present step, by default all the way.

        Raises SandboxError if edits are refused, by engines that were not there when they were given; they are dropped,
        and another call goes on.
        """
        if self._stale or self.lockstep.steps > self.step:
            self._begin()
            self._arrive()
        steps = self.steps_behind if max_steps is None else min(self.steps_behind, max_steps)
        for _ in range(steps):
            self.lockstep.step()
            self._arrive()

    def give(self, given: Input) -> None:
        """Add an input here. Inputs to come are dropped; a grab that is only replayed is released.

        Raises SandboxError, with nothing changed, if an edit is refused.
        """
        self.catch_up()
        if isinstance(given, Edit):
            if sum(isinstance(earlier, Edit) for earlier in self.lockstep.given) >= MAX_EDITS:
                raise SandboxError(f"there are {MAX_EDITS:,} edits, and a recording may have no more")
            edited(self.lockstep.scene, given, self.lockstep.states())  # also if only the hidden engine has no room
        before, mouse, is_held = self.lockstep.given, self.lockstep.mouse, self.held is not None
        if isinstance(given, Move) and before and isinstance(before[-1], Move) and before[-1].step == given.step:
            del before[-1]  # only the last move of a step pulls
        if isinstance(given, Grab) and mouse.ball is not None:
            self.lockstep.apply(Release(step=given.step))
        self.lockstep.apply(given)
        if isinstance(given, Edit) and mouse.ball is not None and not is_held:
            self.lockstep.apply(Release(step=given.step))
        self.inputs = list(before)
        self._undone.clear()
        self._branch()
        self._keep_moment()

    def undo(self) -> bool:
        """Undo the last action, and go to where it began. Return whether there was one."""
        here = len(self.given())
        first = self._start_of_last_action(here)
        if first is None:
            return False
        self._undone.append(self.inputs[first:])
        self.return_to(self.inputs[first].step, self.inputs[:first])
        return True

    @property
    def next_redo(self) -> Input | None:
        """The input with which what `redo` does begins."""
        return self._undone[-1][0] if self._undone else None

    def redo(self) -> bool:
        """Redo the action undone last, and go to where it ended. Return whether there was one."""
        if not self._undone:
            return False
        again = self._undone.pop()
        inputs = self.inputs + again
        last = len(inputs) - len(again)
        if isinstance(again[0], Grab):
            last = next((k for k in range(last, len(inputs)) if isinstance(inputs[k], Release)), len(inputs) - 1)
        while last + 1 < len(inputs) and _continues(inputs[last + 1]):
            last += 1
        self.return_to(again[0].step, inputs)
        self.step = self.end = inputs[last].step
        return True

    def return_to(self, step: int, inputs: list[Input]) -> None:
        """Go to a step, and replace the inputs from there on."""
        self.inputs = inputs
        self.step = step
        self._stale = True
        self._branch()
        if step == 0:
            self.catch_up()

    def _start_of_last_action(self, count: int) -> int | None:
        """Return the first input of the last action among the first inputs; edits during a grab belong to the grab."""
        action = None
        for k in reversed(range(count)):
            match self.inputs[k]:
                case Grab():
                    return k
                case Release() if action is not None:
                    return action
                case Edit() if action is None or (action == k + 1 and _continues(self.inputs[action])):
                    action = k
        return action

    def _branch(self) -> None:
        self.end = self.step
        self._history.drop_from(self.step)
        self.samples.series.cut(self.step)

    def _begin(self) -> None:
        is_hidden = self.reference not in self.names
        self.lacks_reference = is_hidden and not self._can_run_along()
        along: dict[str, Source] = {self.reference: self.reference} if is_hidden and not self.lacks_reference else {}
        names = [*self.names, *along]
        expendable = self.reference if is_hidden else None
        self.lockstep = Lockstep(self.start, self._engines | along, stops=True, expendable=expendable)
        self._stale = False
        self.stopped: tuple[float, str] | None = None  # s, when the reference could go on no longer, and its message
        self._counts = dict.fromkeys(names, 0)
        self._wall_impulse = dict.fromkeys(names, 0.0)
        self._scale = EnergyScale(self.lockstep.scene, self.lockstep.initial)
        self._before = self.lockstep.states()  # of the last moment that was kept
        for runner in self.lockstep.engines.values():
            runner.record_contacts()

    def _can_run_along(self) -> bool:
        """Return whether the reference is compiled, as far as two balls that meet show it."""
        balls = BallGroup(radius=1, positions=((1.0, 1.0), (3.5, 1.0)), velocity=(1.0, 0.0))
        scene = Scene(arena={"size": (9.0, 9.0)}, balls=[balls])
        try:
            with between_frames():
                engine = create(self.reference, scene, spawn(scene))
                engine.record_contacts()
                engine.step()
                engine.kick(0, (0.0, 0.0))
                engine.state()
        except NotCompiledYet:
            return False
        return True

    def _arrive(self) -> None:
        """Apply the inputs of the step that the engines have reached, and keep the moment even if edits are refused."""
        try:
            self._apply_due()
        finally:
            self._keep_moment()

    def _apply_due(self) -> None:
        lockstep, refused = self.lockstep, list[str]()
        while (k := len(lockstep.given)) < len(self.inputs) and self.inputs[k].step <= lockstep.steps:
            try:
                lockstep.apply(self.inputs[k])
            except SandboxError as error:
                del self.inputs[k]
                refused.append(str(error))
        if refused:
            raise SandboxError("\n".join(refused))

    def _keep_moment(self) -> None:
        lockstep = self.lockstep
        contacts = {name: runner.contacts() for name, runner in lockstep.engines.items()}
        for name, resolved in contacts.items():
            if len(resolved):
                self._counts[name] += len(resolved)
                self._wall_impulse[name] += wall_impulse(resolved, lockstep.scene.arena.size)
        states = lockstep.states()
        if why := lockstep.limits().get(self.reference) or lockstep.dropped:
            self.stopped = self.stopped or (lockstep.time, str(why))
        if lockstep.edited:  # the balls of these contacts may have other numbers now
            contacts = dict.fromkeys(contacts, no_contacts())
        self._follow_energy(states, contacts)
        moment = Moment(
            lockstep.steps,
            lockstep.time,
            lockstep.scene,
            states,
            contacts,
            dict(self._counts),
            lockstep.energies(states),
            dict(lockstep.work),
            tuple(lockstep.balls),
            lockstep.mouse.ball,
            lockstep.mouse.target,
            dict(self._wall_impulse),
            self._scale.value,
            frozenset(lockstep.limits()),
        )
        self.samples.add(moment, {name: runner.step_seconds for name, runner in lockstep.engines.items()})
        self._history.keep(moment)

    def _follow_energy(self, states: dict[str, State], contacts: dict[str, Contacts]) -> None:
        """Let the scale of energy follow the reference, or the last engine where that does not run."""
        lockstep = self.lockstep
        name = self.reference if self.reference in states else list(states)[-1]
        begins = lockstep.edited or states[name].time == self._before[name].time  # with no step before it
        reached = [states[name]] if begins else [self._before[name], states[name]]
        before = lockstep.steps + 1 - len(reached)
        self._scale.follow(lockstep.scene, States.stack(reached), contacts[name], before, lockstep.clock)
        self._scale.give(lockstep.work[name])
        self._before = states


def _continues(given: Input) -> bool:
    """Return whether an input belongs to the action of the input before it."""
    return isinstance(given, ChangeWall) and given.continued is True
