"""Contacts that an engine in which dt changes gives an impulse by nothing but that change.

Pymunk starts from the impulse P that a contact had in total in the step before. It applies P dt / dt_before, but counts
P, and its solver can take back no more than it counts. If dt grows, P (dt / dt_before - 1) stays where it takes back
all; an impulse of just this size is the evidence. If dt shrinks, the solver can take back more than was applied; the
evidence is an impulse that pulls, by at most that.
"""

from typing import Final

import numpy as np

from sandbox.judge.causes import NEGLIGIBLE
from sandbox.scene.clock import Clock
from sandbox.state import Bools, Contacts, Integers

PERSISTENCE: Final = 3  # steps for which Pymunk keeps a contact's impulse, unless a scene sets it


class RescaledImpulses:
    """Finds these contacts, block by block of steps. persistence: steps for which an impulse is kept."""

    def __init__(self, clock: Clock, persistence: int | None) -> None:
        self._clock, self._persistence = clock, PERSISTENCE if persistence is None else persistence
        self._totals: dict[tuple[int, int], tuple[int, float]] = {}  # of each pair: the last step, and P then, kg px/s

    def find(self, contacts: Contacts, steps: Integers) -> Bools:
        """Return which contacts have an impulse by a change of dt: (k,). steps: (k,) of the run, from 1."""
        found = np.zeros(len(contacts), bool)
        if not self._clock.varies:
            return found
        ratios = self._clock.rates(np.maximum(steps - 1, 1)) / self._clock.rates(steps)
        pairs = zip(contacts["first"].tolist(), contacts["second"].tolist(), strict=True)
        rows = zip(pairs, steps.tolist(), ratios.tolist(), contacts["impulse"].tolist(), strict=True)
        for k, (pair, step, ratio, impulse) in enumerate(rows):
            last, total = self._totals.get(pair, (-self._persistence, 0.0))
            kept = total if step - last <= self._persistence else 0.0
            not_applied = kept * (1 - ratio) if step - last == 1 else kept
            self._totals[pair] = step, impulse + not_applied
            counted, slight = impulse + not_applied, NEGLIGIBLE * abs(not_applied)
            pulls = impulse < 0 and counted >= -slight
            found[k] = step - last == 1 and ratio != 1 and impulse != 0 and (pulls or abs(counted) <= slight)
        return found
