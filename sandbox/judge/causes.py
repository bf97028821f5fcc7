"""Why an engine changed energy, momentum or a position."""

from enum import IntEnum
from typing import Final, Self

NEGLIGIBLE: Final = 1e-6  # fraction of an impulse, a speed or a radius; smaller errors count as rounding


class Cause(IntEnum):
    """A cause, in the order of the ledger's lines. `key` names it in JSON and CSV, `label` in text."""

    label: str

    def __new__(cls, number: int, label: str = "") -> Self:
        """Make a member with its label, which has a default only because `Cause(3)` looks a member up."""
        member = int.__new__(cls, number)
        member._value_ = number
        member.label = label
        return member

    ELASTICITY = 0, "the scene's elasticity"
    FRICTION = 1, "friction"
    SPIN = 2, "into spin, not in the sum"
    HAND = 3, "the mouse or your code"
    SMALL = 4, "impulse too small"
    LARGE = 5, "impulse too large"
    FRICTION_SMALL = 6, "friction too small"
    FRICTION_LARGE = 7, "friction too large"
    LATE = 8, "found late"
    EARLY = 9, "found early"
    NORMAL = 10, "normal turned"
    VELOCITY = 11, "velocities changed besides the impulse"
    PUSHED = 12, "pushed out of an overlap"
    PLACED = 13, "put elsewhere without an overlap"
    OVERSHOOT = 14, "overshoot discarded"
    TURNED = 15, "already leaving the wall, reversed again"
    STALE = 16, "stale cached impulse"
    UNCONVERGED = 17, "solver not converged"
    MISSED = 18, "contact missed"
    GRAVITY = 19, "inexact gravity"
    DAMPING = 20, "damping"
    UNTOLD = 21, "velocity changed without a contact"
    ROUNDING = 22, "rounding"
    UNKNOWN = 23, "unknown"
    SOFT = 24, "contacts that last several steps"
    START = 25, "apart at the start"
    OVERLAPPED = 26, "overlapping at the start"

    @property
    def key(self) -> str:
        """The name in JSON and CSV."""
        return self.name.lower()

    def __str__(self) -> str:
        """Return the key."""
        return self.key
