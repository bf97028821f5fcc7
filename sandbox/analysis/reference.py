"""The reference: the engine that others are measured against, and until when its own paths can be trusted."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sandbox.quantity import length
from sandbox.run.lockstep import Lockstep
from sandbox.state import State

REFERENCE: Final = "exact"


def reference_of(engines: Sequence[str]) -> str:
    """Return the engine that others are measured against by default: the exact one, or else the last."""
    return REFERENCE if REFERENCE in engines else engines[-1]


class Twin:
    """A second copy of an engine of a lockstep, with the first ball one unit in the last place further right.

    The difference grows by a factor at every contact. Once a ball is a radius from where the original has it, no
    solver that rounds can be right about paths: that is the horizon. apart: s, the horizon; None while it is to come.
    """

    def __init__(self, lockstep: Lockstep, engine: str) -> None:
        state = lockstep.engines[engine].state()
        position = state.position.copy()
        position[0, 0] = np.nextafter(position[0, 0], np.inf)
        lockstep.hidden[:] = [lockstep.new_runner(engine, replace(state, position=position))]
        self.apart: float | None = None
        self._lockstep = lockstep

    def update(self, original: State) -> None:
        """Check whether a ball is a radius away from the original's after a step."""
        if self._lockstep.hidden:
            gap = length(self._lockstep.hidden[0].engine.state().position - original.position)
            if np.any(gap > self._lockstep.scene.bodies.radius):
                self.apart = original.time
                self._lockstep.hidden.clear()
