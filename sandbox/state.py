"""What an engine returns: snapshots of the balls, and the contacts it resolved."""

from dataclasses import dataclass
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bools = NDArray[np.bool_]
Contacts = NDArray[np.void]  # (k,) of dtype CONTACT

CONTACT: Final = np.dtype(
    [
        ("time", "f8"),  # s
        ("first", "i8"),  # ball
        ("second", "i8"),  # ball, or ~wall (negative): walls 0 to 3 are the arena's left, top, right and bottom
        ("normal", "f8", (2,)),  # unit vector from first to second
        ("impulse", "f8"),  # kg px/s along the normal, positive if it pushes the two apart
        ("depth", "f8"),  # px, overlap when the contact was found
    ]
)


@dataclass(frozen=True, slots=True)
class State:
    """A snapshot of every ball, in scene order.

    time: s; position: (n, 2) px; velocity: (n, 2) px/s.
    """

    time: float
    position: Floats
    velocity: Floats


class States(NamedTuple):
    """Arrays for the states after many steps. position: (steps, n, 2) px; velocity: (steps, n, 2) px/s."""

    position: Floats
    velocity: Floats

    @classmethod
    def empty(cls, steps: int, balls: int) -> Self:
        """Return arrays that are not filled yet."""
        return cls(np.empty((steps, balls, 2)), np.empty((steps, balls, 2)))

    def rows(self, rows: slice) -> "States":
        """Return the part of some steps, which shares the arrays."""
        return States(self.position[rows], self.velocity[rows])


@dataclass(frozen=True, slots=True)
class Bodies:
    """The properties of the balls, which do not change while a scene runs: (n,) each.

    radius: px; mass: kg; elasticity and friction: the ball's factor of the pair's product.
    """

    radius: Floats
    mass: Floats
    elasticity: Floats
    friction: Floats

    def __len__(self) -> int:
        return len(self.radius)


def no_contacts() -> Contacts:
    """Return an empty array of contacts."""
    return np.empty(0, CONTACT)
