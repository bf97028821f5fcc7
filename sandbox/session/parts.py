"""What a moment has of the engines of one lockstep."""

from typing import NamedTuple

from sandbox.analysis.gas import wall_impulse
from sandbox.run.lockstep import Lockstep
from sandbox.state import Contacts, State, no_contacts


class Part(NamedTuple):
    """The engines of one lockstep at a step, see `Moment`."""

    states: dict[str, State]
    contacts: dict[str, Contacts]
    counts: dict[str, int]
    energy: dict[str, float]
    work: dict[str, float]
    wall_impulse: dict[str, float]
    standing: frozenset[str]


class PartReader:
    """Reads the engines of a lockstep step by step, and counts their contacts from its start."""

    def __init__(self, lockstep: Lockstep) -> None:
        self._lockstep = lockstep
        self._counts = dict.fromkeys(lockstep.engines, 0)
        self._wall_impulse = dict.fromkeys(lockstep.engines, 0.0)
        for runner in lockstep.engines.values():
            runner.record_contacts()

    def read(self) -> Part:
        """Return what a moment has of the engines now, with the contacts since the last call."""
        lockstep = self._lockstep
        contacts = {name: runner.contacts() for name, runner in lockstep.engines.items()}
        for name, resolved in contacts.items():
            if len(resolved):
                self._counts[name] += len(resolved)
                self._wall_impulse[name] += wall_impulse(resolved, lockstep.scene.arena.size)
        states = lockstep.states()
        return Part(
            states,
            # after an edit, the balls of these contacts may have other numbers
            dict.fromkeys(contacts, no_contacts()) if lockstep.edited else contacts,
            dict(self._counts),
            lockstep.energies(states),
            dict(lockstep.work),
            dict(self._wall_impulse),
            frozenset(lockstep.limits()),
        )
