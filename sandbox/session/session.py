"""A run that can be rewound: the past is shown from its history, and run again before it continues from there.

No engine can be copied bit for bit while it runs (a Pymunk space has state that a copy would lose). So a run is its
inputs: to continue from a step, the engines run again from the start with the same inputs, to the same bytes.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import islice, takewhile
from time import perf_counter
from typing import Any, Final, NamedTuple, TypeVar

from sandbox.analysis.energy_scale import EnergyScale
from sandbox.analysis.reference import reference_of
from sandbox.engines import REFERENCE, Engines, Source, named
from sandbox.errors import SandboxError
from sandbox.run.edits import ChangeWall, Edit, edited
from sandbox.run.inputs import MAX_EDITS, Grab, Input, Move, Release, clock_of
from sandbox.run.lockstep import Lockstep, Runner
from sandbox.scene.model import Scene
from sandbox.session.beside import Beside, MomentReader, PartialMoment
from sandbox.session.history import MAX_BYTES_KEPT, MAX_RECENT, History, Moment
from sandbox.session.samples import Samples
from sandbox.state import States

T = TypeVar("T")
NOTHING: Final = PartialMoment({}, {}, {}, {}, {}, {}, frozenset())  # is missing


class Unfinished(NamedTuple):
    """A moment without the reference. edited: whether an edit led to it; part: waits some seconds for the rest."""

    moment: Moment
    edited: bool
    part: Callable[[float | None], PartialMoment]


class Session:
    """Engines in lockstep, at any step that they have reached.

    An input given in the past replaces all that came after it. `undo` undoes one *action*: an edit with those that
    continue it, or a grab with everything up to its release. An engine that is not built in and fails stops there; the
    others go on.

    reference: the engine that the others are measured against, by default as `reference_of` chooses. If it is not among
    the names, it runs along, hidden, as long as it can.

    beside: whether `exact`, if it is the reference, is computed beside the others, which then do not wait for it: a
    moment is shown without it, and completed and sampled when it arrives. Only an edit waits for it, as that is for the
    state of every engine, and so do steps if it is as far behind as the history goes back. All moments become the same.
    """

    def __init__(
        self,
        scene: Scene,
        engines: Engines,
        inputs: Sequence[Input] = (),
        reference: str | None = None,
        *,
        beside: bool = False,
    ) -> None:
        self.start = scene
        self.beside = beside
        self._engines = named(engines)
        self.names = list(self._engines)
        self.reference = reference or reference_of(self.names)
        self.inputs = list(inputs)  # past and to come, by step
        self.step = 0  # the present one, which may lie in the past of the engines
        self.end = 0  # the latest reached with these inputs
        self._history = History()
        self._undone: list[list[Input]] = []
        self._beside: Beside | None = None
        self._unfinished: deque[Unfinished] = deque()
        self._unfinished_bytes = 0
        self._begin()
        at_start = self.lockstep.energies({"": self.lockstep.initial})[""]
        silent = [name for name, runner in self.runners.items() if not runner.traits.reports_contacts]
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
        return self.step if self._must_begin else self.step - self.lockstep.steps

    @property
    def _must_begin(self) -> bool:
        """Whether the engines must run again from the start to be at the present step."""
        return self._stale or self.lockstep.steps > self.step

    @property
    def is_live(self) -> bool:
        """Whether the engines are at the present step."""
        return not self._stale and self.lockstep.steps == self.step

    @property
    def held(self) -> int | None:
        """The ball that the mouse holds now; None during a replay of earlier inputs."""
        nothing_to_come = len(self.lockstep.given) == len(self.inputs)
        return self.lockstep.mouse.ball if self.is_live and nothing_to_come else None

    @property
    def runners(self) -> dict[str, Runner]:
        """The engines that run, in order; one that is computed beside the others may be at an earlier step."""
        return self._in_order(self.lockstep.engines, self._beside.lockstep.engines if self._beside else {})

    @property
    def dropped(self) -> str:
        """Why the reference runs along no more; nothing if it does."""
        return (self._beside or self).lockstep.dropped

    @property
    def lag(self) -> float:
        """By how much the reference is behind the other engines, s."""
        return self.lockstep.time - self.latest.time if self._unfinished else 0.0

    @property
    def waits(self) -> bool:
        """Whether the next step would wait for the reference: it is too far behind, or an edit is to come."""
        if not self._unfinished or self._must_begin:
            return False
        return len(self._unfinished) >= MAX_RECENT or self._unfinished_bytes >= MAX_BYTES_KEPT or self._edit_is_due

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

    def advance(self) -> None:
        """Run one step from here, with the inputs that were given there if it was reached before.

        Raises SandboxError if edits to come are refused; they are dropped, and the step is done.
        """
        self.catch_up()
        self._step()
        self.step = self.lockstep.steps
        self.end = max(self.end, self.step)
        self._arrive()

    def catch_up(self, max_steps: int | None = None) -> None:
        """Run the engines again to the present step, by default all the way.

        Raises SandboxError if edits are refused, by engines that were not there when they were given; they are dropped,
        and another call goes on.
        """
        if self._must_begin:
            self._begin()
            self._arrive()
        steps = self.steps_behind if max_steps is None else min(self.steps_behind, max_steps)
        for _ in range(steps):
            self._step()
            self._arrive()

    def collect(self, seconds: float | None = 0.0) -> bool:
        """Complete the moments for which the reference has arrived. Return whether there were any.

        seconds: how long to wait until it has arrived for all; None: as long as that takes.
        """
        deadline, before = perf_counter() + (seconds or 0.0), len(self._unfinished)
        while self._unfinished:
            moment, edited, part = self._unfinished[0]
            try:
                rest = part(None if seconds is None else max(0.0, deadline - perf_counter()))
            except TimeoutError:
                break
            self._unfinished.popleft()
            self._unfinished_bytes -= moment.size
            self._history.complete(moment, self._complete(moment, rest, edited=edited))
        return len(self._unfinished) < before

    def stop(self) -> None:
        """Abandon what is computed beside, and the moments that lack it."""
        if self._beside:
            self._beside.stop()
        for unfinished in self._unfinished:
            self._history.drop(unfinished.moment)
        self._unfinished.clear()
        self._unfinished_bytes = 0

    def give(self, given: Input) -> None:
        """Add an input here. Inputs to come are dropped; a grab that is only replayed is released.

        Raises SandboxError, with nothing changed, if an edit is refused.
        """
        self.catch_up()
        if isinstance(given, Edit):
            if sum(isinstance(earlier, Edit) for earlier in self.lockstep.given) >= MAX_EDITS:
                raise SandboxError(f"there are {MAX_EDITS:,} edits, and a recording may have no more")
            self.collect(None)
            states = {name: runner.state() for name, runner in self.runners.items()}
            edited(self.lockstep.scene, given, states)  # also if only the hidden engine has no room
        before, mouse, is_held = self.lockstep.given, self.lockstep.mouse, self.held is not None
        if isinstance(given, Move) and before and isinstance(before[-1], Move) and before[-1].step == given.step:
            del before[-1]  # only the last move of a step pulls
        if isinstance(given, Grab) and mouse.ball is not None:
            self._apply(Release(step=given.step))
        self._apply(given)
        if isinstance(given, Edit) and mouse.ball is not None and not is_held:
            self._apply(Release(step=given.step))
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
        self.stop()
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
        along: dict[str, Source] = {self.reference: self.reference} if is_hidden else {}
        engines, expendable = self._engines | along, self.reference if is_hidden else None
        beside = {REFERENCE} if self.beside and self.reference == REFERENCE and len(engines) > 1 else set[str]()

        def lockstep(names: set[str]) -> Lockstep:
            sources = {name: source for name, source in engines.items() if name in names}
            return Lockstep(self.start, sources, stops=True, expendable=expendable)

        self.stop()
        self._order = list(engines)
        self.lockstep = lockstep(set(engines) - beside)
        self._reader = MomentReader(self.lockstep)
        self._beside = Beside(lockstep(beside)) if beside & set(engines) else None
        self._stale = False
        self.stopped: tuple[float, str] | None = None  # s, when the reference could go on no longer, and its message
        self._scale = EnergyScale(self.lockstep.scene, self.lockstep.initial)
        self._before = {name: runner.state() for name, runner in self.runners.items()}  # in the moment completed last

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
                self._apply(self.inputs[k])
            except SandboxError as error:
                del self.inputs[k]
                refused.append(str(error))
        if refused:
            raise SandboxError("\n".join(refused))

    @property
    def _edit_is_due(self) -> bool:
        """Whether an edit is to come after the next step."""
        to_come = islice(self.inputs, len(self.lockstep.given), None)
        due = takewhile(lambda given: given.step <= self.lockstep.steps + 1, to_come)
        return any(isinstance(given, Edit) for given in due)

    def _step(self) -> None:
        if self.waits:
            self.collect(None)
        self.lockstep.step()
        if self._beside:
            self._beside.step()

    def _apply(self, given: Input) -> None:
        """Apply an input in every engine. Raises SandboxError, with nothing changed, if one refuses it."""
        beside = self._beside
        if beside and isinstance(given, Edit):
            self.collect(None)
            beside.wait()
            if self.reference in self.names:
                edited(self.lockstep.scene, given, beside.lockstep.states())
        self.lockstep.apply(given)
        if beside:
            beside.apply(given)

    def _in_order(self, *of_engines: Mapping[str, T]) -> dict[str, T]:
        """Return what there is of each engine in the order of the engines."""
        joined: dict[str, T] = {}
        for each in of_engines:
            joined.update(each)  # in one go, as a thread can drop its engine
        return {name: joined[name] for name in self._order if name in joined}

    def _keep_moment(self) -> None:
        lockstep = self.lockstep
        part = self._reader.read()
        moment = Moment(
            lockstep.steps,
            lockstep.time,
            lockstep.scene,
            **part._asdict(),
            balls=tuple(lockstep.balls),
            held=lockstep.mouse.ball,
            target=lockstep.mouse.target,
            energy_scale=self._scale.value,
            is_complete=self._beside is None,
        )
        if self._beside:
            self._history.keep(moment)
            self._unfinished_bytes += moment.size
            self._unfinished.append(Unfinished(moment, lockstep.edited, self._beside.part()))
            self.collect(None if lockstep.edited or not lockstep.steps else 0.0)
        else:
            self._history.keep(self._complete(moment, NOTHING, edited=lockstep.edited))

    def _complete(self, moment: Moment, rest: PartialMoment, *, edited: bool) -> Moment:
        """Return a moment with the rest of its engines, and sample it. edited: whether an edit led to it."""
        joined: dict[str, Any] = {"standing": moment.standing | rest.standing}
        for key, of_engines in rest._asdict().items():
            if key not in joined:
                joined[key] = self._in_order(getattr(moment, key), of_engines)
        moment = replace(moment, **joined, is_complete=True)
        self._note_end_of_reference(moment)
        self._follow_energy(moment, edited=edited)
        self.latest = replace(moment, energy_scale=self._scale.value)
        self.samples.add(self.latest, {name: runner.step_seconds for name, runner in self.runners.items()})
        return self.latest

    def _note_end_of_reference(self, moment: Moment) -> None:
        is_gone = self.reference in moment.standing or self.reference not in moment.states
        if is_gone and not self.stopped:
            lockstep = (self._beside or self).lockstep
            self.stopped = moment.time, str(lockstep.limits().get(self.reference) or lockstep.dropped)

    def _follow_energy(self, moment: Moment, *, edited: bool) -> None:
        """Let the scale of energy follow the reference, or the last engine where that does not run."""
        states, clock = moment.states, self.lockstep.clock
        name = self.reference if self.reference in states else list(states)[-1]
        begins = edited or states[name].time == self._before[name].time  # with no step before it
        reached = [states[name]] if begins else [self._before[name], states[name]]
        before = moment.step + 1 - len(reached)
        self._scale.follow(moment.scene, States.stack(reached), moment.contacts[name], before, clock)
        self._scale.give(moment.work[name])
        self._before = states


def _continues(given: Input) -> bool:
    """Return whether an input belongs to the action of the input before it."""
    return isinstance(given, ChangeWall) and given.continued is True
