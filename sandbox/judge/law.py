"""How a step may be wrong: the exact law of contact and flight, with every parameter that an error model can change.

A law is a record of LAW. `EXACT` is right in everything; an error model changes one field, a rule of steps a few.
Throughout: n is the unit normal from a ball to what it touches, t = (-n_y, n_x) the tangent, J the impulse along n, J_t
that along t, 1/m the sum of the inverse masses, u the slip of the rims along t, as in `engines.exact.friction`.
"""

from enum import IntEnum
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Laws = NDArray[np.void]  # (k,) of dtype LAW


class When(IntEnum):
    """When contacts are found."""

    IN_TIME = 0  # at the time of impact
    AFTER_MOVE = 1  # where the balls are after the step's move
    BEFORE_MOVE = 2  # where they are before it
    ONE_BY_ONE = 3  # ball by ball: where each is after its move, and those after it before theirs
    SOFT = 4  # in substeps, on the geometry of before the step: see `soft_step`


class Place(IntEnum):
    """What becomes of an overlap that was found."""

    LEAVE = 0
    REFLECT = 1  # at a wall: to where a bounce in time would have led
    ON = 2  # at a wall: onto it
    HALVES = 3  # of a pair: half each
    BY_MASS = 4  # of a pair: by the inverse masses
    FALLEN = 5  # at a wall: as REFLECT, with what gravity did meanwhile taken back
    MIRROR = 6  # at a wall: as far off it as the overlap was deep, whatever the restitution
    BEGIN = 7  # to where the step began
    BEGIN_ACROSS = 8  # at a wall: likewise, but only across it


UNDONE: Final = Place.BEGIN, Place.BEGIN_ACROSS


class Parting(IntEnum):
    """What is done with an overlap of bodies that part already."""

    PLACE = 0  # they are put where the law puts bodies that overlap
    RESOLVE = 1  # and exchange momentum
    NONE = 2


class Order(IntEnum):
    """In which order the contacts of a step are resolved."""

    WALLS_FIRST = 0
    PAIRS_FIRST = 1
    REVERSED = 2  # walls first, pairs from the last to the first
    TOGETHER = 3  # all at once, until each is right


class Slows(IntEnum):
    """When a step changes velocities, whatever touches."""

    LAST = 0
    FIRST = 1
    BEFORE_MOVE = 2  # after gravity
    AFTER_MOVE = 3  # before gravity


class Grid(IntEnum):
    """What positions are kept in."""

    FREE = 0
    ROUNDED = 1  # to whole px
    CUT = 2  # to whole px, towards 0


class Scope(IntEnum):
    """Which contacts are wrong."""

    ALL = 0
    PAIRS = 1
    WALLS = 2
    ONE = 3  # that of `first` and `second`


class Masses(IntEnum):
    """Which masses an impulse is computed with, and applied to."""

    OWN = 0
    SWAPPED = 1  # right impulse, applied to the other's mass
    EQUAL = 2
    BY_RADIUS = 3
    BY_AREA = 4  # radius squared
    BY_VOLUME = 5  # radius cubed


class Mixing(IntEnum):
    """How two factors of friction make one."""

    PRODUCT = 0
    SUM = 1
    ROOT = 2
    LARGER = 3


class Exchange(IntEnum):
    """What is done to velocities instead of an impulse; the first two have one."""

    NONE = 0
    ALONG_VELOCITY = 1  # along the relative velocity
    WHOLE = 2  # the two swap velocities
    SPEEDS = 3  # each is reflected at the tangent, and the two swap speeds
    EACH = 4  # each velocity is reflected at the tangent
    TANGENTS = 5  # the two swap what their velocities have along the tangent
    REVERSED = 6  # velocities change sign
    ALONG_SIGNS = 7  # the component of each velocity along the normal's larger component changes sign
    STOP = 8  # velocities become 0
    MERGE = 9  # both get the velocity of their centre of mass


LAW: Final = np.dtype(
    [
        ("when", "i8"),
        ("order", "i8"),
        ("wall_place", "i8"),
        ("pair_place", "i8"),
        ("wall_parting", "i8"),
        ("pair_parting", "i8"),
        ("rebound", "i8"),  # 1: of contacts solved together, the velocity before gravity bounces
        ("substeps", "i8"),  # of a step whose contacts are soft
        ("margin", "f8"),  # px, up to which apart such contacts are found
        ("stops", "i8"),  # ball of the group that a wall stops without a contact, or -1
        ("stop", "f8"),  # px, after which way it does
        ("scope", "i8"),  # of what follows, up to `missed`
        ("first", "i8"),
        ("second", "i8"),  # ball, or ~wall
        ("offset", "f8"),  # px, by which bodies touch sooner
        ("impulse", "f8"),  # times J
        ("restitution", "f8"),  # times e
        ("constant", "f8"),  # e whatever the scene says, or -1
        ("turn", "f8"),  # rad, of n
        ("tangential", "f8"),  # J along t, besides friction
        ("first_share", "f8"),  # of J that the first gets
        ("second_share", "f8"),
        ("masses", "i8"),
        ("exchange", "i8"),
        ("friction", "f8"),  # times J_t
        ("coefficient", "f8"),  # times the coefficient of friction
        ("added", "f8"),  # to the coefficient
        ("brake", "f8"),  # J along t, against the velocity of a ball at a wall
        ("mixing", "i8"),
        ("unlimited", "i8"),  # 1: friction stops every slip
        ("clamped", "i8"),  # 1: friction is limited by the impulse without restitution
        ("without_spin", "i8"),  # 1: slip is that of the centres
        ("moment", "f8"),  # times the moment of inertia
        ("first_turns", "f8"),  # times the change of the first's spin
        ("second_turns", "f8"),
        ("slope", "f8"),  # times the velocity along t after the contact
        ("scaled", "f8"),  # times velocities after the contact
        ("twice", "i8"),  # 1: resolved again at once
        ("missed", "i8"),  # 1: not resolved
        ("apart", "f8"),  # px, by which each is put further from the other
        ("cap", "f8"),  # px/s, the largest speed
        ("gx", "f8"),  # px/s², gravity
        ("gy", "f8"),
        ("theta", "f8"),  # of the velocity after gravity in the step's move: 0.5 is the parabola, 0 explicit
        ("after", "i8"),  # 1: gravity changes velocities after the contacts
        ("left", "f8"),  # of velocities and spins, after a second
        ("kept", "f8"),  # of velocities, in a step
        ("kept_y", "f8"),  # of their y, besides
        (
            "drag",
            "f8",
        ),  # times powers of px/s, px and kg: the share of its velocity that a ball loses in 1 s
        ("by_speed", "i8"),
        ("by_radius", "i8"),
        ("by_mass", "i8"),
        ("kept_spin", "f8"),  # of spins
        ("slows_first", "i8"),  # when they are changed so: see Slows
        ("veer", "f8"),  # rad, by which velocities turn in a step
        ("clock", "f8"),  # times the length of the step
        ("grid", "i8"),  # what a step's move does to positions: see Grid
        ("dx", "f8"),  # px, by which balls are put elsewhere after a step
        ("dy", "f8"),
    ]
)
_RIGHT: Final[dict[str, Any]] = {
    "impulse": 1.0,
    "restitution": 1.0,
    "first_share": 1.0,
    "second_share": 1.0,
    "friction": 1.0,
    "coefficient": 1.0,
    "moment": 1.0,
    "first_turns": 1.0,
    "second_turns": 1.0,
    "slope": 1.0,
    "scaled": 1.0,
    "cap": np.inf,
    "theta": 0.5,
    "constant": -1.0,
    "stops": -1,
    "left": 1.0,
    "kept": 1.0,
    "kept_y": 1.0,
    "kept_spin": 1.0,
    "clock": 1.0,
}


@cache
def _exact() -> Laws:
    record = np.zeros((), LAW)
    for name, value in _RIGHT.items():
        record[name] = value
    return record


def law(gravity: tuple[float, float], **fields: float) -> Laws:
    """Return the exact law under some gravity (px/s²), with other values in some fields: () LAW."""
    record = _exact().copy()
    record["gx"], record["gy"] = gravity
    for name, value in fields.items():
        record[name] = value
    return record
