"""What engines share that step all balls at once through a compiled kernel: the arrays, and the log of contacts."""

from abc import ABC, abstractmethod

import numpy as np
from numba import njit

from sandbox.scene.model import Scene, Vector
from sandbox.state import CONTACT, Contacts, State, no_contacts


@njit(cache=True)
def note(log, count, first, second, nx, ny, impulse, depth):  # type: ignore[no-untyped-def]
    """Write a contact into a kernel's log: (capacity,) CONTACT, of which count rows are filled, all but their time.

    Returns the log, made longer where it was full, and the new count. A kernel in another file that calls this is
    not compiled again when this file changes: delete `__pycache__` then.
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

    unit: px/s in one of the kernel's units of velocity; impulse_unit: kg px/s in one of its units of impulse.
    """

    def __init__(self, scene: Scene, initial: State, *, unit: float = 1.0, impulse_unit: float = 1.0) -> None:
        self.position = initial.position.copy()
        self.velocity = initial.velocity / unit
        self.log = np.empty(64, CONTACT)
        self._unit = unit
        self._impulse_unit = impulse_unit
        self._rate = scene.rate
        self._steps = 0
        self._found: list[Contacts] | None = None

    @abstractmethod
    def advance(self) -> int:
        """Do one step on the arrays, in place; return how many contacts are now in the log."""

    def step(self) -> None:
        """Advance by one step of 1/rate seconds."""
        count = self.advance()
        self._steps += 1
        if self._found is not None and count:
            found = self.log[:count].copy()
            found["time"] = self._steps / self._rate
            found["impulse"] *= self._impulse_unit
            self._found.append(found)

    def state(self) -> State:
        """Return a snapshot."""
        return State(self._steps / self._rate, self.position.copy(), self.velocity * self._unit)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        found, self._found = self._found, []
        return np.concatenate(found) if found else no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self.velocity[ball] += np.divide(dv, self._unit)
