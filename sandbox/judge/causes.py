"""Why an engine changed energy, momentum or a position, and the ledger of what each cause changed.

What the exact step from the engine's own state changes is the scene's and the hand's; the rest of each step is entered
under its cause. So the lines add up to the whole change.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Self


class Cause(IntEnum):
    """A cause, in the order of the ledger's lines. `key` names it in JSON and CSV, `label` in text."""

    label: str
    key: str

    def __new__(cls, number: int, *_: str) -> Self:
        """Make a member, whose value is its number alone."""
        member = int.__new__(cls, number)
        member._value_ = number
        return member

    def __init__(self, number: int, label: str = "", key: str = "") -> None:
        """Set the label, which `Cause(3)` does not need to look a member up, and the key, by default its name."""
        self.label, self.key = label, key or self.name.lower()

    ELASTICITY = 0, "the scene's elasticity"
    FRICTION = 1, "friction"
    SPIN = 2, "into spin, not in the sum"
    APPLIED = 3, "the mouse or your code", "hand"
    SMALL = 4, "impulse too small"
    LARGE = 5, "impulse too large"
    FRICTION_SMALL = 6, "friction too small"
    FRICTION_LARGE = 7, "friction too large"
    LATE = 8, "found late"
    EARLY = 9, "found early"
    NORMAL = 10, "normal turned"
    UNEXPLAINED_IMPULSE = 11, "velocities changed besides the impulse", "velocity"
    POSITION_CORRECTION = 12, "pushed out of an overlap", "pushed"
    TELEPORTED = 13, "put elsewhere without an overlap", "placed"
    OVERSHOOT = 14, "overshoot discarded"
    DOUBLE_BOUNCE = 15, "already parting, reversed again", "turned"
    WARM_START = 16, "stale cached impulse", "stale"
    UNCONVERGED = 17, "solver not converged"
    MISSED = 18, "contact missed"
    GRAVITY = 19, "inexact gravity"
    DAMPING = 20, "damping"
    UNREPORTED = 21, "velocity changed without a contact", "untold"
    ROUNDING = 22, "rounding"
    UNKNOWN = 23, "unknown"
    SOFT = 24, "contacts that last several steps"

    def __str__(self) -> str:
        """Return the key."""
        return self.key


@dataclass(frozen=True)
class Entry:
    """A line of the ledger: what a cause changed. That of SPIN is a part of the energy, and a part of no sum."""

    cause: Cause  # its key
    contacts: int  # or steps of a ball, for a cause that is not a contact's
    energy: float  # kg px²/s²; the lines add up to the whole change, without that of `spin`
    momentum: float  # kg px/s transferred wrongly, the sum of the lengths
    displacement: float  # px by which balls were displaced wrongly, the sum of the lengths
