"""A run that can be rewound: the past is shown from its history, and run again before it continues from there.

No engine can be copied bit for bit while it runs (a Pymunk space has state that a copy would lose). So a run is its
inputs: to continue from a step, the engines run again from the start with the same inputs, to the same bytes.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice, takewhile, zip_longest
from time import perf_counter
from typing import NamedTuple, TypeVar

from sandbox.analysis.reference import reference_of
from sandbox.engines import REFERENCE, Engines, Source, named
from sandbox.errors import SandboxError
from sandbox.run.edits import Edit, edited
from sandbox.run.inputs import Grab, Input, Move, Release, clock_of
from sandbox.run.lockstep import Lockstep, Runner
from sandbox.scene.model import Scene
from sandbox.session.beside import Beside, Readings, read
from sandbox.session.history import MAX_BYTES_KEPT, MAX_RECENT, History, Moment
from sandbox.session.samples import Samples

T = TypeVar("T")


class Unfinished(NamedTuple):
    """A moment without the reference. rest: waits some seconds for it, or as long as it takes if None."""

    moment: Moment
    rest: Callable[[float | None], Readings]


class Version(NamedTuple):
    """The inputs of a run, past and to come, and the step at which something else replaced them."""

    inputs: list[Input]
    step: int


class Session:
    """Engines in lockstep, at any step that they have reached.

    An input given in the past replaces all that came after it. `undo` undoes the latest *action*: an edit, a grab with
    everything up to its release, or a restart. An engine that is not built in and fails stops
    there; the others go on. One that cannot run an edited scene is suspended, and continues from the reference's state
    as soon as the scene allows it.

    reference: the engine that the others are measured against, by default as `reference_of` chooses. If it is not among
    the names, it runs along, hidden, as long as it can.

    beside: whether `exact`, if it is the reference, is computed beside the others, which then do not wait for it: a
    moment is shown without it, and completed when it arrives. Only an edit waits for it, as that is for the state of
    every engine, and so do steps if it is as far behind as the history goes back. All moments become the same.
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
        self._done: list[Version] = []  # before each action
        self._undone: list[Version] = []
        self._beside: Beside | None = None
        self._unfinished: deque[Unfinished] = deque()
        self._begin()
        self.samples = Samples(list(dict.fromkeys([*self.names, self.reference])), self.reference)
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
        count = len(self._unfinished)
        return count >= MAX_RECENT or count * self.latest.size >= MAX_BYTES_KEPT or self._edit_is_due

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
        """Go to the latest step of another session with the same inputs, and take over what can be undone."""
        self.step = self.end = earlier.end
        self._done, self._undone = [*earlier._done], [*earlier._undone]

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
            moment, rest = self._unfinished[0]
            try:
                readings = rest(None if seconds is None else max(0.0, deadline - perf_counter()))
            except TimeoutError:
                break
            self._unfinished.popleft()
            self._history.complete(moment, self._complete(moment, readings))
        return len(self._unfinished) < before

    def stop(self) -> None:
        """Abandon what is computed beside, and the moments that lack it."""
        if self._beside:
            self._beside.stop()
        for unfinished in self._unfinished:
            self._history.drop(unfinished.moment)
        self._unfinished.clear()

    def give(self, given: Input) -> None:
        """Add an input here. Inputs to come are dropped; a grab that is only replayed is released.

        Raises SandboxError, with nothing changed, if an edit is refused.
        """
        self.catch_up()
        if isinstance(given, Edit):
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
        if not is_held and not isinstance(given, Move | Release):
            self._done.append(Version(self.inputs, self.step))
        self.inputs = list(before)
        self._undone.clear()
        self._branch()
        self._keep_moment()

    def restart(self, *, keep: bool) -> None:
        """Go to the start. keep: whether the edits up to here stay, all made at the start; throws do not."""
        edits = [given for given in self.given() if isinstance(given, Edit)] if keep else []
        inputs: list[Input] = [edit.model_copy(update={"step": 0}) for edit in edits]
        self._done += [Version(self.inputs, self.step)] if inputs != self.inputs else []
        self._undone.clear()
        self._become(Version(inputs, 0))

    @property
    def can_undo(self) -> bool:
        """Whether there is an action to undo."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is something to redo."""
        return bool(self._undone)

    def undo(self) -> bool:
        """Undo the latest action, and go to where it began. Return whether there was one."""
        return self._swap(self._done, self._undone)

    def redo(self) -> bool:
        """Redo what was undone last, and go to where that was done. Return whether there was something."""
        return self._swap(self._undone, self._done)

    def _swap(self, versions: list[Version], others: list[Version]) -> bool:
        if not versions:
            return False
        others.append(Version(self.inputs, self.step))
        self._become(versions.pop())
        return True

    def _become(self, version: Version) -> None:
        """Go to another version of the run. What was the same until then is kept."""
        differ = (pair for pair in zip_longest(self.inputs, version.inputs) if pair[0] != pair[1])
        self.step = min((given.step for given in next(differ, ()) if given), default=0)
        self.inputs = list(version.inputs)
        self._stale = True
        self.stop()
        self._branch()
        if self.step == 0:
            self.catch_up()
        self.step = self.end = version.step

    def _branch(self) -> None:
        self.end = self.step
        self._history.drop_from(self.step)
        self.samples.series.cut(self.step - 1)  # an edit changes the moment here too

    def _begin(self) -> None:
        is_hidden = self.reference not in self.names
        along: dict[str, Source] = {self.reference: self.reference} if is_hidden else {}
        engines, expendable = self._engines | along, self.reference if is_hidden else None
        beside = {REFERENCE} if self.beside and self.reference == REFERENCE and len(engines) > 1 else set[str]()

        def lockstep(names: set[str]) -> Lockstep:
            sources = {name: source for name, source in engines.items() if name in names}
            created = Lockstep(self.start, sources, stops=True, expendable=expendable, reference=self.reference)
            for runner in created.engines.values():
                runner.record_contacts()  # or a step of `exact` that has contacts without end would not be stopped
            return created

        self.stop()
        self._order = list(engines)
        self.lockstep = lockstep(set(engines) - beside)
        self._beside = Beside(lockstep(beside)) if beside & set(engines) else None
        self.lockstep.home = self._beside.lockstep if self._beside else self.lockstep
        self._stale = False
        self.stopped: tuple[float, str] | None = None  # s, when the reference could go on no longer, and its message

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
                refused.append(f"an edit is left out: {error}")
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
            beside.read()(None)  # waits for the step that it is doing
            if self.reference in self.names:
                edited(self.lockstep.scene, given, beside.lockstep.states())
        self.lockstep.apply(given)
        if beside:
            beside.apply(given)

    def _in_order(self, those: dict[str, T], beside: dict[str, T]) -> dict[str, T]:
        """Return what there is of each engine in the order of the engines."""
        joined = those | beside  # in one go, as a thread can drop its engine
        return {name: joined[name] for name in self._order if name in joined}

    def _keep_moment(self) -> None:
        lockstep = self.lockstep
        moment = Moment(
            lockstep.steps,
            lockstep.time,
            lockstep.scene,
            read(lockstep),
            tuple(lockstep.balls),
            lockstep.mouse.ball,
            lockstep.mouse.target,
            dict(lockstep.suspended),
            is_complete=self._beside is None,
        )
        self.samples.add(moment)
        if self._beside:
            self._history.keep(moment)
            self._unfinished.append(Unfinished(moment, self._beside.read()))
            self.collect(None if lockstep.edited or not lockstep.steps else 0.0)
        else:
            self._history.keep(self._complete(moment, {}))

    def _complete(self, moment: Moment, rest: Readings) -> Moment:
        """Return a moment with the rest of its engines, and sample it."""
        self.latest = replace(moment, engines=self._in_order(moment.engines, rest), is_complete=True)
        if self.reference not in self.latest.running and not self.stopped:
            reading = self.latest.engines.get(self.reference)
            self.stopped = moment.time, reading.stands if reading else self.dropped
        self.samples.complete(self.latest)
        return self.latest
