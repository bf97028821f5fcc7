"""Base of the engines that advance all balls by steps of a compiled kernel."""
# ruff: noqa: D102 (the interface of an engine documents the methods)

from abc import ABC, abstractmethod
from typing import Final

import numpy as np

from sandbox.compiled import kernel
from sandbox.engines.contact_log import ContactLog, Log, empty_log
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, State, States

LOG_ROWS: Final = 64  # of a new engine's log
Snapshot = tuple[Floats, Floats, Floats, Floats]  # positions and velocities (n, 2), angles and spins (n,)


@kernel
def begin_step(step: int, start: Snapshot, states: States) -> Snapshot:
    """Copy the state before a step into its row, to be advanced in place; return that row.

    step: from 0; start: the state before step 0.
    """
    position, velocity, angle, spin = states
    before = start if step == 0 else (position[step - 1], velocity[step - 1], angle[step - 1], spin[step - 1])
    for i in range(position.shape[1]):
        for k in range(2):
            position[step, i, k], velocity[step, i, k] = before[0][i, k], before[1][i, k]
        angle[step, i], spin[step, i] = before[2][i], before[3][i]
    return position[step], velocity[step], angle[step], spin[step]


class SteppedEngine(ABC):
    """An engine whose steps are calls of a kernel.

    unit: the kernel's unit of velocity, px/s; impulse_unit: its unit of impulse, kg px/s.
    """

    def __init__(self, scene: Scene, initial: State, *, unit: float = 1.0, impulse_unit: float = 1.0) -> None:
        position, velocity, angle, spin = initial.position, initial.velocity / unit, initial.angle, initial.spin
        self._state = position.copy(), velocity, angle.copy(), spin.copy()
        self._row = States.empty(1, len(position))  # for `step`
        self._unit = unit
        self._impulse_unit = impulse_unit
        self._rate = scene.rate
        self._steps = 0
        self._log = empty_log(LOG_ROWS)
        self._contacts = ContactLog()

    @abstractmethod
    def run(self, start: Snapshot, steps_before: int, states: States, log: Log) -> tuple[int, int]:
        """Do as many steps as the states have rows, and write them there; stop if the log is full.

        start: the state before the first of them; steps_before: steps done so far. Returns the number of steps done,
        and of contacts logged in them.
        """

    def step(self) -> None:
        self.advance(1, *self._row)

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        rows, recording = States(position, velocity, angle, spin), self._contacts.recording
        while steps:
            log = self._log._replace(collects=recording)
            log.filled[0] = 0
            done, count = self.run(self._state, self._steps, rows, log)
            self._steps += done
            if done:
                for ours, rows_of_part in zip(self._state, rows, strict=True):
                    ours[:] = rows_of_part[done - 1]
            if count:
                contacts = log.row[:count].copy()
                contacts["impulse"] *= self._impulse_unit  # engines with a unit of their own have no friction
                self._contacts.add(contacts)
            steps -= done
            if steps:
                rows = rows.rows(slice(done, None))
                self._log = empty_log(2 * len(log.row))
        velocity *= self._unit

    def state(self) -> State:
        position, velocity, angle, spin = self._state
        return State(self._steps / self._rate, position.copy(), velocity * self._unit, angle.copy(), spin.copy())

    def record_contacts(self) -> None:
        self._contacts.recording = True

    def contacts(self) -> Contacts:
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        self._state[1][ball] += np.divide(dv, self._unit)
