"""A run that one can go back in: what was is shown from memory, and run again before one goes on from it.

No engine can be copied bit for bit while it runs (a Pymunk space keeps what a copy would lose). So the past is the
inputs: going on from a step means running again from the start, with the same inputs, to the same bytes.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from sandbox.errors import SandboxError
from sandbox.run.edits import Edit
from sandbox.run.inputs import MAX_EDITS, Grab, Input, Move, Release, clock_of
from sandbox.run.lockstep import Lockstep
from sandbox.scene.model import Scene
from sandbox.session.history import History, Moment
from sandbox.state import Contacts, State, no_contacts


class Observer(Protocol):
    """Follows the engines of a session."""

    def begin(self, lockstep: Lockstep) -> None:
        """Follow engines that are at their first step."""

    def look(self, states: Mapping[str, State], contacts: Mapping[str, Contacts]) -> None:
        """Look at the engines after a step, with the contacts that they had in it."""


class Session:
    """Engines in step, at any step that they have been at.

    What is done in the past replaces what was done after it. A *deed* is what is undone at once: an edit, or a grab
    with all up to its release.
    """

    def __init__(
        self,
        scene: Scene,
        names: Iterable[str],
        inputs: Sequence[Input] = (),
        observer: Observer | None = None,
    ) -> None:
        self.start = scene
        self.names = list(names)
        self.inputs = list(inputs)  # all that were given or are to come, by step
        self.step = 0  # where one is
        self.end = 0  # the furthest that was reached with these inputs
        self._history = History()
        self._observer = observer
        self._undone: list[list[Input]] = []
        self._begin()
        self._obey_due()
        self._remember()

    # Where one is

    @property
    def shown(self) -> Moment:
        """The moment that one is at, or the nearest that is remembered while the engines are not there."""
        return self._history.nearest(self.step)

    @property
    def behind(self) -> int:
        """How many steps the engines must do before one can go on from here."""
        return self.step if self._stale or self.lockstep.steps > self.step else self.step - self.lockstep.steps

    @property
    def live(self) -> bool:
        """Whether what is shown is what the engines are at."""
        return not self._stale and self.lockstep.steps == self.step

    @property
    def held(self) -> int | None:
        """The ball in a person's hand, which is none of what was done before and is only seen again."""
        nothing_to_come = len(self.lockstep.given) == len(self.inputs)
        return self.lockstep.hand.ball if self.live and nothing_to_come else None

    def recall(self, first: int, last: int) -> list[Moment]:
        """Return what is remembered of some steps, in order."""
        return self._history.between(first, last)

    def given(self) -> list[Input]:
        """Return the inputs of the run up to here."""
        return [one for one in self.inputs if one.step <= self.step]

    def seek(self, step: int) -> None:
        """Go to a step that was reached before; the engines follow when they are needed."""
        self.step = min(max(step, 0), self.end)

    def step_at(self, time: float) -> int:
        """Return the step that is nearest to a time (s)."""
        return clock_of(self.start.rate, self.inputs).step(time)

    # What goes on

    def advance(self) -> None:
        """Do one step from here, with the inputs that were given there if one has been there before.

        Raises SandboxError for edits to come that are refused; they are dropped, and the step is done.
        """
        self.catch_up()
        self.lockstep.step()
        self.step = self.lockstep.steps
        self.end = max(self.end, self.step)
        try:
            self._obey_due()
        finally:
            self._remember()

    def catch_up(self, most: int | None = None) -> None:
        """Run the engines again to where one is, by so many steps at most; by all where left out."""
        if self._stale or self.lockstep.steps > self.step:
            self._begin()
            self._obey_due()
            self._remember()
        steps = self.behind if most is None else min(self.behind, most)
        for _ in range(steps):
            self.lockstep.step()
            self._obey_due()
            self._remember()

    def give(self, given: Input) -> None:
        """Take an input here. What was to come after it is dropped, and a hand that is only seen again lets go.

        Raises SandboxError, with nothing changed, where an edit is refused.
        """
        self.catch_up()
        if isinstance(given, Edit) and sum(isinstance(one, Edit) for one in self.lockstep.given) >= MAX_EDITS:
            raise SandboxError(f"there are {MAX_EDITS:,} edits, and a recording may have no more")
        before, hand, led = self.lockstep.given, self.lockstep.hand, self.held is not None
        if isinstance(given, Move) and before and isinstance(before[-1], Move) and before[-1].step == given.step:
            del before[-1]  # the last of a step's moves is the one that pulls
        if isinstance(given, Grab) and hand.ball is not None:
            self.lockstep.apply(Release(step=given.step))
        self.lockstep.apply(given)
        if isinstance(given, Edit) and hand.ball is not None and not led:
            self.lockstep.apply(Release(step=given.step))
        self.inputs = list(before)
        self._undone.clear()
        self._branch()
        self._remember()

    def undo(self) -> bool:
        """Go back to before the last deed, as if it had not been; tell whether there was one."""
        here = len(self.given())
        first = self._last_deed(here)
        if first is None:
            return False
        self._undone.append(self.inputs[first:])
        self._return_to(self.inputs[first].step, self.inputs[:first])
        return True

    def redo(self) -> bool:
        """Do again what was undone last, and go to where it was done; tell whether there was anything."""
        if not self._undone:
            return False
        again = self._undone.pop()
        inputs = self.inputs + again
        last = len(inputs) - len(again)
        if isinstance(again[0], Grab):
            last = next((k for k in range(last, len(inputs)) if isinstance(inputs[k], Release)), len(inputs) - 1)
        self._return_to(again[0].step, inputs)
        self.step = self.end = inputs[last].step
        return True

    def _last_deed(self, count: int) -> int | None:
        """Find where the last deed among the first inputs begins; what was done with a ball in hand is part of that."""
        found = None
        for k in reversed(range(count)):
            match self.inputs[k]:
                case Grab():
                    return k
                case Release() if found is not None:
                    return found
                case Edit():
                    found = k if found is None else found
        return found

    def _return_to(self, step: int, inputs: list[Input]) -> None:
        """Go to a step, from which on the inputs are others."""
        self.inputs = inputs
        self.step = step
        self._stale = True
        self._branch()
        if step == 0:
            self.catch_up()

    def _branch(self) -> None:
        self.end = self.step
        self._history.forget_from(self.step)

    def _begin(self) -> None:
        self.lockstep = Lockstep(self.start, self.names)
        self._stale = False
        self._counts = dict.fromkeys(self.names, 0)
        for runner in self.lockstep.engines.values():
            runner.contacts()
        if self._observer:
            self._observer.begin(self.lockstep)

    def _obey_due(self) -> None:
        lockstep, refused = self.lockstep, list[str]()
        while (k := len(lockstep.given)) < len(self.inputs) and self.inputs[k].step <= lockstep.steps:
            try:
                lockstep.apply(self.inputs[k])
            except SandboxError as mistake:
                del self.inputs[k]
                refused.append(str(mistake))
        if refused:
            raise SandboxError("\n".join(refused))

    def _remember(self) -> None:
        lockstep = self.lockstep
        contacts = {name: runner.contacts() for name, runner in lockstep.engines.items()}
        for name, found in contacts.items():
            self._counts[name] += len(found)
        states = lockstep.states()
        if self._observer:
            self._observer.look(states, contacts)
        if lockstep.edited:  # they were between balls whose numbers may be others now
            contacts = dict.fromkeys(contacts, no_contacts())
        self._history.keep(
            Moment(
                lockstep.steps,
                lockstep.time,
                lockstep.scene,
                states,
                contacts,
                dict(self._counts),
                tuple(lockstep.balls),
                lockstep.hand.ball,
                lockstep.hand.target,
            )
        )
