"""An engine that repeats what was recorded of a run."""

import numpy as np

from sandbox.engines.engine import Traits
from sandbox.scene.clock import Clock
from sandbox.scene.fields import Vector
from sandbox.state import Contacts, Damping, Floats, State, States


class RecordedEngine:
    """Repeats a run that was recorded with the same kicks.

    states: of steps + 1 rows; contacts: in order of time; clock: of the steps; damping: in flight. The contacts of a
    step are all solved together.
    """

    def __init__(self, states: States, contacts: Contacts, clock: Clock, damping: Damping) -> None:
        self._states, self._contacts, self._clock = states, contacts, clock
        self.traits = Traits(together=True, damping=damping)
        ends = clock.times(np.arange(len(states.position)))
        self._until = np.searchsorted(contacts["time"], ends, side="right")  # contacts, after each step
        self._steps = 0
        self._returned = 0

    def step(self) -> None:
        """Go to the state after the next step."""
        self._steps += 1

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        """Do some steps, and write the state after each: (steps, n, 2) px, px/s; (steps, n) rad, rad/s."""
        rows = slice(self._steps + 1, self._steps + 1 + steps)
        for ours, recorded in zip((position, velocity, angle, spin), self._states.rows(rows), strict=True):
            ours[:] = recorded
        self._steps += steps

    def state(self) -> State:
        """Return a snapshot."""
        return self._states.state(self._steps, self._clock.time(self._steps)).copy()

    def record_contacts(self) -> None:
        """Start to return contacts, from this step on."""
        self._returned = int(self._until[self._steps])

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        since, self._returned = self._returned, int(self._until[self._steps])
        return self._contacts[since : self._returned].copy()

    def kick(self, ball: int, dv: Vector) -> None:
        """Do nothing: what the kick did is recorded."""
