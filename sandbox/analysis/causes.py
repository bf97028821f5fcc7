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
    HAND = 1, "the mouse"
    SMALL = 2, "impulse too small"
    LARGE = 3, "impulse too large"
    LATE = 4, "found late"
    EARLY = 5, "found early"
    NORMAL = 6, "normal turned"
    VELOCITY = 7, "velocities changed besides the impulse"
    PUSHED = 8, "pushed apart"
    PLACED = 9, "put elsewhere without an overlap"
    OVERSHOOT = 10, "overshoot discarded"
    TURNED = 11, "already leaving the wall, reversed again"
    STALE = 12, "stale cached impulse"
    UNCONVERGED = 13, "solver not converged"
    MISSED = 14, "contact missed"
    GRAVITY = 15, "inexact gravity"
    FRICTION = 16, "friction"
    UNTOLD = 17, "velocity changed without a reported contact"
    ROUNDING = 18, "rounding"
    UNKNOWN = 19, "unknown"

    @property
    def key(self) -> str:
        """The name in JSON and CSV."""
        return self.name.lower()

    def __str__(self) -> str:
        """Return the key."""
        return self.key
