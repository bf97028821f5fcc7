"""The ledger: every change that an engine makes to energy, momentum and places, entered under its cause.

What the exact step from the engine's own state changes is the scene's and the hand's; the rest of each step is entered
under its cause. So the lines add up to the whole change.
"""

from dataclasses import dataclass

from sandbox.judge.causes import Cause
from sandbox.state import Floats


@dataclass(frozen=True)
class Entry:
    """A line of the ledger: what a cause changed. That of SPIN is a part of the energy, and a part of no sum."""

    cause: Cause
    contacts: int  # or steps of a ball, for a cause that is not a contact's
    energy: float  # kg px²/s²; the lines add up to the whole change, without that of SPIN
    momentum: float  # kg px/s transferred wrongly, the sum of the lengths
    displacement: float  # px by which balls were displaced wrongly, the sum of the lengths


def entries_of(sums: Floats) -> tuple[Entry, ...]:
    """Return a line for each cause that occurred. sums: (4, causes), of energy, momentum, displacement, contacts."""
    return tuple(
        Entry(cause, int(contacts), float(energy), float(momentum), float(displacement))
        for cause, (energy, momentum, displacement, contacts) in zip(Cause, sums.T, strict=True)
        if energy or contacts
    )
