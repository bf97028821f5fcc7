"""Base of the engines that advance all balls by one call of a compiled kernel."""

from abc import ABC, abstractmethod

import numpy as np
from numba import njit

from sandbox.engines.contact_log import ContactLog
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import CONTACT, Contacts, State


@njit(cache=True)
def log_contact(log, count, first, second, nx, ny, impulse, depth):  # type: ignore[no-untyped-def]
    """Append a contact, without its time, to a kernel's log: (capacity,) CONTACT, whose first `count` rows are filled.

    Returns the log, or a longer copy if it was full, and the new count.
    """
    if count == len(log):
        longer = np.empty(2 * count, log.dtype)
        longer[:count] = log
        log = longer
    log[count].first = first
    log[count].second = second
    log[count].normal[0] = nx
    log[count].normal[1] = ny
    log[count].impulse = impulse
    log[count].depth = depth
    return log, count + 1


class SteppedEngine(ABC):
    """An engine whose step is one call of a kernel.

    unit: the kernel's unit of velocity, px/s; impulse_unit: its unit of impulse, kg px/s.
    """

    def __init__(self, scene: Scene, initial: State, *, unit: float = 1.0, impulse_unit: float = 1.0) -> None:
        self.position = initial.position.copy()
        self.velocity = initial.velocity / unit
        self.log = np.empty(64, CONTACT)
        self._unit = unit
        self._impulse_unit = impulse_unit
        self._rate = scene.rate
        self._steps = 0
        self._contacts = ContactLog()

    @abstractmethod
    def advance(self) -> int:
        """Advance the arrays by one step, in place; return the number of contacts in the log."""

    def step(self) -> None:
        """Advance by one step of 1/rate seconds."""
        count = self.advance()
        self._steps += 1
        if self._contacts.recording and count:
            contacts = self.log[:count].copy()
            contacts["time"] = self._steps / self._rate
            contacts["impulse"] *= self._impulse_unit
            self._contacts.add(contacts)

    def state(self) -> State:
        """Return a snapshot."""
        return State(self._steps / self._rate, self.position.copy(), self.velocity * self._unit)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self.velocity[ball] += np.divide(dv, self._unit)
