"""What stands out in a run while it goes on: each engine's first difference from the reference, and the horizon."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from sandbox.analysis.difference import LOOKED, Account, differences
from sandbox.analysis.ledger import Ledger
from sandbox.analysis.reference import Twin, reference_of
from sandbox.run.lockstep import Lockstep
from sandbox.state import Contacts, State, no_contacts

EVERY: Final = 15  # steps between two looks for a difference, and half of how long contacts are news


@dataclass(frozen=True)
class Marks:
    """Times in a run that stand out, s. differences: of each engine that has one, its first from the reference."""

    horizon: float | None = None
    differences: Mapping[str, float] = field(default_factory=dict)


class Monitor:
    """Follows the engines of a lockstep, from where they are now, and marks what stands out.

    An engine is followed until it differs, or for LOOKED contacts.
    """

    def begin(self, lockstep: Lockstep) -> None:
        """Follow engines that are at their first step."""
        self._lockstep = lockstep
        self._yardstick = reference_of(list(lockstep.engines))
        self._twin = Twin(lockstep, self._yardstick)
        self._differences: dict[str, float] = {}
        self._begin_stretch()

    @property
    def marks(self) -> Marks:
        """What has been found so far."""
        return Marks(self._twin.apart, dict(self._differences))

    def look(self, states: Mapping[str, State], contacts: Mapping[str, Contacts]) -> None:
        """Look at the engines, with the contacts that they had in the last step. After an edit, begin anew."""
        self._twin.look(states[self._yardstick])
        if self._lockstep.edited:
            self._begin_stretch()
        elif self._open and self._lockstep.steps > self._begun + self._steps:
            self._steps += 1
            for name, book in self._open.items():
                book.add(states[name], contacts[name], self._lockstep)
                if len(contacts[name]):
                    self._latest = self._steps
            if self._steps % EVERY == 0 and self._steps - self._latest <= 2 * EVERY:
                self._find()

    def _begin_stretch(self) -> None:
        lockstep = self._lockstep
        names = [name for name in lockstep.engines if name != self._yardstick and name not in self._differences]
        followed = [*names, self._yardstick] if names else []
        self._scene, self._begun, self._since = lockstep.scene, lockstep.steps, lockstep.time
        self._steps = 0  # since then
        self._latest = 0  # of these, the last that had contacts
        self._open: dict[str, _Book] = {name: _Book(name, lockstep) for name in followed}

    def _find(self) -> None:
        """Look for first differences."""
        accounts = {name: book.account() for name, book in self._open.items()}
        right = accounts.pop(self._yardstick)
        end = self._steps / self._scene.rate
        for name, account in accounts.items():
            found = differences(self._scene, account, right, np.inf, end)
            if found:
                self._differences[name] = self._since + found[0].time
            if found or max(len(account.contacts), len(right.contacts)) > LOOKED:
                del self._open[name]
        if len(self._open) == 1:
            self._open.clear()


class _Book:
    """An engine's ledger, kept step by step."""

    def __init__(self, name: str, lockstep: Lockstep) -> None:
        runner = lockstep.engines[name]
        self._name, self._since = name, lockstep.time
        self._ledger = Ledger(lockstep.scene, together=runner.together)
        self._before = runner.state()
        self._contacts = [no_contacts()]

    def add(self, state: State, contacts: Contacts, lockstep: Lockstep) -> None:
        """Enter a step."""
        if len(contacts):
            contacts = contacts.copy()
            contacts["time"] -= self._since
            self._contacts.append(contacts)
        position = np.stack([self._before.position, state.position])
        velocity = np.stack([self._before.velocity, state.velocity])
        pulled = -1 if lockstep.pulled is None else lockstep.pulled
        pull = lockstep.pulls.get(self._name, (0.0, 0.0))
        self._ledger.add(position, velocity, contacts, np.array([-1, pulled]), np.array([(0.0, 0.0), pull]))
        self._before = state

    def account(self) -> Account:
        """Return all contacts so far with what the ledger says of them."""
        return Account(np.concatenate(self._contacts), self._ledger.rows, self._ledger.missed)
