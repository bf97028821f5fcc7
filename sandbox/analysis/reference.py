"""The reference: the engine that others are measured against, and until when its own paths can be trusted."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from sandbox.quantity import length
from sandbox.run.lockstep import Lockstep
from sandbox.state import Floats, State

REFERENCE: Final = "exact"


def reference_of(engines: Sequence[str]) -> str:
    """Return the engine that others are measured against by default: the exact one, or else the last."""
    return REFERENCE if REFERENCE in engines else engines[-1]


class Trust(NamedTuple):
    """Until when the paths of the reference mean anything: three times, s, each None if that is to the end."""

    horizon: float | None = None
    undecided: float | None = None
    unresolved: float | None = None

    @property
    def until(self) -> float | None:
        """The earliest of the three."""
        return min((time for time in self if time is not None), default=None)


class Twin:
    """A second copy of an engine of a lockstep, with the first ball one unit in the last place further right.

    The difference grows by a factor at every contact. Once a ball is a radius from where the original has it, no
    solver that rounds can be right about paths: that is the horizon. apart: s, the horizon; None while it is to come.
    """

    def __init__(self, lockstep: Lockstep, engine: str) -> None:
        state = lockstep.engines[engine].state()
        position = state.position.copy()
        position[0, 0] = np.nextafter(position[0, 0], np.inf)
        self.runner = lockstep.new_runner(engine, replace(state, position=position))
        self.apart: float | None = None
        self._lockstep = lockstep
        lockstep.hidden[:] = [self.runner]

    def update(self, original: State) -> None:
        """Check whether a ball is a radius away from the original's after a step."""
        if self.apart is None:
            position = self.runner.engine.state().position
            self.compare(position[None], original.position[None], np.array([original.time]))

    def compare(self, position: Floats, original: Floats, time: Floats) -> None:
        """Find the first of some steps after which a ball is a radius away; the twin then no longer runs along.

        position, original: (steps, n, 2) px, of the twin and of the original; time: (steps,) s, after each step.
        """
        offset, radius = position - original, self._lockstep.scene.bodies.radius
        if 2 * np.abs(offset).max(initial=0.0) < radius.min():  # saves the lengths of almost all offsets
            return
        apart = (length(offset) > radius).any(axis=1)
        if apart.any():
            self.apart = float(time[apart.argmax()])
            self._lockstep.hidden.clear()
