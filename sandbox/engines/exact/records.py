"""Memory layout of the discs: one record for what others read of a disc, one for its events, one for its contacts.

At 100,000 discs the time goes into waiting for memory. So what others read of a disc is one cache line, and discs that
are near each other are near in memory too.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

CACHE_LINE: Final = 64  # bytes
NONE: Final = -1  # no disc, no wall
HELD: Final = -2  # instead of a wall: the disc is held where it is

DISC: Final = np.dtype(
    [
        ("x", "f8"),  # px
        ("y", "f8"),
        ("vx", "f8"),  # px/s
        ("vy", "f8"),
        ("t", "f8"),  # s, of x, y, vx and vy
        ("radius", "f8"),  # px
        ("hit", "f8"),  # s, time of its next contact
        ("serial", "i4"),  # number of changes of its course
        ("next", "i4"),  # disc in the same cell, or NONE
    ]
)

EVENT: Final = np.dtype(
    [
        ("cross", "f8"),  # s, time at which it leaves its cell
        ("way", "i4"),  # to the next cell: added to the cell's number
        ("cell", "i4"),
        ("partner", "i4"),  # of the next contact: a disc, or ~piece of wall
        ("seen", "i4"),  # the partner's serial at the prediction
        ("ball", "i4"),  # its number in the scene
        ("wall", "i4"),  # the face that carries it, or NONE, or HELD
    ]
)

BODY: Final = np.dtype(
    [
        ("ax", "f8"),  # px/s²: gravity, less what a wall supports
        ("ay", "f8"),
        ("mass", "f8"),  # kg
        ("elasticity", "f8"),
        ("last", "f8"),  # s, time of the last contact
        ("met", "f8"),  # s, time of the last contact with a disc
        ("leans", "f8"),  # s, until when it counts as leaning on others
        ("since", "f8"),  # s, start of the count of slow contacts
        ("slow", "i8"),  # slow contacts since then
        ("until", "f8"),  # s, time at which it is released if it is held
        ("streak", "i8"),  # contacts in a row, each within CONTACT_TIME of the one before
    ]
)


def aligned(count: int, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Return an array of zeros that begins on a cache line."""
    memory = np.zeros(count * dtype.itemsize + CACHE_LINE, np.uint8)
    start = -memory.ctypes.data % CACHE_LINE
    return memory[start : start + count * dtype.itemsize].view(dtype)
