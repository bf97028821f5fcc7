"""What engines are measured against, and until when its own paths mean anything."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sandbox.quantity import length
from sandbox.run.lockstep import Lockstep
from sandbox.state import State

REFERENCE: Final = "exact"  # what the others are measured against, wherever it takes part


def reference_of(engines: Sequence[str]) -> str:
    """Name the engine that the others are measured against where none is named: the exact one, or else the last."""
    return REFERENCE if REFERENCE in engines else engines[-1]


class Twin:
    """An engine of a lockstep once more, with the first ball one unit in the last place to the right.

    What that does grows by a factor at every contact. Once a ball is a radius from where it should be, no solver that
    rounds can be right about paths: that is the horizon. apart: s, when it was; None where it is still to come.
    """

    def __init__(self, lockstep: Lockstep, engine: str) -> None:
        state = lockstep.engines[engine].state()
        position = state.position.copy()
        position[0, 0] = np.nextafter(position[0, 0], np.inf)
        lockstep.hidden[:] = [lockstep.runner(engine, replace(state, position=position))]
        self.apart: float | None = None
        self._lockstep = lockstep

    def look(self, right: State) -> None:
        """Look at where it is, while it runs. right: the engine that it is the twin of."""
        if self._lockstep.hidden:
            gap = length(self._lockstep.hidden[0].engine.state().position - right.position)
            if np.any(gap > self._lockstep.scene.bodies.radius):
                self.apart = right.time
                self._lockstep.hidden.clear()
