"""Base of the engines that advance all balls by steps of a compiled kernel."""

from abc import ABC, abstractmethod
from typing import Final

import numpy as np

from sandbox.compiled import kernel
from sandbox.engines.contact_log import ContactLog
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import CONTACT, Contacts, Floats, State

LOG_ROWS: Final = 64  # of a new engine's log


@kernel
def begin_step(step: int, start: tuple[Floats, Floats], position: Floats, velocity: Floats) -> tuple[Floats, Floats]:
    """Copy the state before a step into its row, to be advanced in place; return the row's positions and velocities.

    step: from 0; start: positions and velocities before step 0, (n, 2) each; position, velocity: (steps, n, 2).
    """
    before = start if step == 0 else (position[step - 1], velocity[step - 1])
    for i in range(position.shape[1]):
        for k in range(2):
            position[step, i, k], velocity[step, i, k] = before[0][i, k], before[1][i, k]
    return position[step], velocity[step]


@kernel
def log_contact(
    log: Contacts, count: int, time: float, first: int, second: int, nx: float, ny: float, impulse: float, depth: float
) -> int:
    """Write a contact into row `count` of a log if it has that row; return the number of contacts so far."""
    if count < len(log):
        row = log[count]
        row["time"], row["first"], row["second"], row["impulse"], row["depth"] = time, first, second, impulse, depth
        row["normal"][0], row["normal"][1] = nx, ny
    return count + 1


class SteppedEngine(ABC):
    """An engine whose steps are calls of a kernel.

    unit: the kernel's unit of velocity, px/s; impulse_unit: its unit of impulse, kg px/s.
    """

    def __init__(self, scene: Scene, initial: State, *, unit: float = 1.0, impulse_unit: float = 1.0) -> None:
        self._state = initial.position.copy(), initial.velocity / unit
        self._row = np.empty((1, *initial.position.shape)), np.empty((1, *initial.position.shape))  # for `step`
        self._unit = unit
        self._impulse_unit = impulse_unit
        self._rate = scene.rate
        self._steps = 0
        self._log = np.empty(LOG_ROWS, CONTACT)
        self._contacts = ContactLog()

    @abstractmethod
    def run(
        self, start: tuple[Floats, Floats], steps_before: int, position: Floats, velocity: Floats, log: Contacts
    ) -> tuple[int, int]:
        """Do as many steps as position and velocity have rows, and write the states there; stop if the log is full.

        start: positions and velocities before the first of them; steps_before: steps done so far; log: (capacity,)
        CONTACT. Returns the number of steps done, and of contacts logged in them.
        """

    def step(self) -> None:
        """Advance by one step of 1/rate seconds."""
        self.advance(1, *self._row)

    def advance(self, steps: int, position: Floats, velocity: Floats) -> None:
        """Do some steps, and write the state after each: (steps, n, 2) px, px/s."""
        rows, recording = (position, velocity), self._contacts.recording
        while steps:
            done, count = self.run(self._state, self._steps, *rows, self._log)
            self._steps += done
            if done:
                for state, states in zip(self._state, rows, strict=True):
                    state[:] = states[done - 1]
            if recording and count:
                contacts = self._log[:count].copy()
                contacts["impulse"] *= self._impulse_unit
                self._contacts.add(contacts)
            steps -= done
            if steps:
                rows = rows[0][done:], rows[1][done:]
                self._log = np.empty(2 * len(self._log), CONTACT)
        velocity *= self._unit

    def state(self) -> State:
        """Return a snapshot."""
        position, velocity = self._state
        return State(self._steps / self._rate, position.copy(), velocity * self._unit)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self._state[1][ball] += np.divide(dv, self._unit)
