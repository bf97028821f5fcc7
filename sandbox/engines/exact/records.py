"""What is stored of each disc, by who reads it: others, its own events, its contacts.

At 100,000 discs the time goes into waiting for memory. So what others read of a disc is one line of the cache, and
discs that are near each other are near in memory too.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

LINE: Final = 64  # bytes of a line of the cache
NONE: Final = -1  # no disc, no wall
HELD: Final = -2  # instead of a wall: held where it is

DISC: Final = np.dtype(
    [
        ("x", "f8"),  # px, at time t
        ("y", "f8"),
        ("vx", "f8"),  # px/s, at time t
        ("vy", "f8"),
        ("t", "f8"),  # s, when it was last moved
        ("radius", "f8"),  # px
        ("hit", "f8"),  # s, when its next contact is
        ("serial", "i4"),  # how often its flight has changed
        ("next", "i4"),  # disc in the same cell, or NONE
    ]
)

EVENT: Final = np.dtype(
    [
        ("cross", "f8"),  # s, when it leaves its cell
        ("way", "i4"),  # to the next cell: what to add to the cell's number
        ("cell", "i4"),
        ("partner", "i4"),  # of the next contact: a disc, or ~piece of wall
        ("seen", "i4"),  # the partner's serial when that was foreseen
        ("ball", "i4"),  # its number in the scene
        ("wall", "i4"),  # the face that carries it, or NONE, or HELD
    ]
)

BODY: Final = np.dtype(
    [
        ("ax", "f8"),  # px/s²: gravity, less what a wall carries
        ("ay", "f8"),
        ("mass", "f8"),  # kg
        ("elasticity", "f8"),
        ("last", "f8"),  # s, time of the last contact
        ("met", "f8"),  # s, time of the last contact with a disc
        ("leans", "f8"),  # s, until when it counts as leaning on others
        ("since", "f8"),  # s, since when slow contacts are counted
        ("slow", "i8"),  # how many there were
        ("until", "f8"),  # s, when it is let go if it is held
        ("streak", "i8"),  # how many contacts in a row came hard upon one another
    ]
)


def aligned(count: int, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Make an array of zeros that begins on a line of the cache."""
    memory = np.zeros(count * dtype.itemsize + LINE, np.uint8)
    start = -memory.ctypes.data % LINE
    return memory[start : start + count * dtype.itemsize].view(dtype)
