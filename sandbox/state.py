"""Snapshots of the balls, and the contacts that an engine resolved."""

from dataclasses import dataclass, field
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
        ("first", "i8"),  # a ball
        ("second", "i8"),  # a ball, or ~wall (negative): walls 0 to 3 are the arena's left, top, right and bottom
        ("normal", "f8", (2,)),  # unit vector from first to second
        ("impulse", "f8"),  # kg px/s along the normal, positive if it pushes the two apart
        ("depth", "f8"),  # px, overlap when the contact was found
        ("tangential", "f8"),  # kg px/s along (-normal_y, normal_x), which friction gives to the second
        ("slip", "f8"),  # px/s along the same, of the first's rim past the second's before the contact
    ]
)


_NOT_GIVEN: Final = np.empty(0)
MEETS_ALL: Final = (0, 0xFFFFFFFF, 0xFFFFFFFF)  # the filter of a ball that passes through no other


@dataclass(frozen=True, slots=True)
class State:
    """A snapshot of every ball, in scene order.

    time: s; position: (n, 2) px; velocity: (n, 2) px/s; angle, spin: (n,) rad, rad/s, zeros if they are not given. A
    positive angle turns x towards y, which points down.
    """

    time: float
    position: Floats
    velocity: Floats
    angle: Floats = field(default_factory=lambda: _NOT_GIVEN)
    spin: Floats = field(default_factory=lambda: _NOT_GIVEN)

    def __post_init__(self) -> None:
        for name in ("angle", "spin"):
            if getattr(self, name) is _NOT_GIVEN:
                object.__setattr__(self, name, np.zeros(np.shape(self.position)[:1]))

    def copy(self) -> "State":
        """Return a state that shares no array with this one."""
        return State(self.time, *(getattr(self, name).copy() for name in States._fields))


class States(NamedTuple):
    """Arrays for the states after many steps.

    position, velocity: (steps, n, 2) px, px/s; angle, spin: (steps, n) rad, rad/s.
    """

    position: Floats
    velocity: Floats
    angle: Floats
    spin: Floats

    @classmethod
    def empty(cls, steps: int, balls: int) -> Self:
        """Return arrays that are not filled yet; the angles and spins are zeros."""
        shape = (steps, balls)
        return cls(np.empty((*shape, 2)), np.empty((*shape, 2)), np.zeros(shape), np.zeros(shape))

    def rows(self, rows: slice) -> "States":
        """Return the part of some steps, which shares the arrays."""
        return States(*(each[rows] for each in self))

    def state(self, row: int, time: float) -> State:
        """Return the state of one row, which shares the arrays. time: s."""
        return State(time, *(each[row] for each in self))

    def fill(self, row: int, state: State) -> None:
        """Copy a state into a row."""
        for name, rows in zip(self._fields, self, strict=True):
            rows[row] = getattr(state, name)


@dataclass(frozen=True, slots=True, eq=False)  # arrays have no truth value
class Bodies:
    """The properties of the balls, which do not change while a scene runs: (n,) each.

    radius: px; mass: kg; elasticity and friction: the ball's factor of the pair's product; filters: (n, 3), the group,
    categories and mask of a `pymunk.ShapeFilter`, which says what balls pass through each other.
    """

    radius: Floats
    mass: Floats
    elasticity: Floats
    friction: Floats
    filters: Integers

    def __len__(self) -> int:
        return len(self.radius)

    @property
    def moment(self) -> Floats:
        """The moments of inertia of uniform discs, m r²/2: (n,) kg px²."""
        return self.mass * self.radius**2 / 2

    @property
    def are_filtered(self) -> bool:
        """Whether a ball has a filter."""
        return bool((self.filters != MEETS_ALL).any())


class Damping(NamedTuple):
    """How an engine slows balls down in flight: velocities and spins, at the end of each substep, before gravity pulls.

    per_second: the share of them that is left after a second; substeps: in each step.
    """

    per_second: float = 1.0
    substeps: int = 1


NO_DAMPING: Final = Damping()


def no_contacts() -> Contacts:
    """Return an empty array of contacts."""
    return np.empty(0, CONTACT)
