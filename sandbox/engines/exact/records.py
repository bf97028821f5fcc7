"""Memory layout of the discs: one record for what other discs' predictions read, one for events, one for contacts.

At 100,000 discs most of the time is spent waiting for memory. So the first record is one cache line, and discs that are
near each other are near in memory too.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

CACHE_LINE: Final = 64  # bytes, on x86 and most ARM processors
NONE: Final = -1  # no disc, no wall
STATIC: Final = -2  # instead of a carrier: the disc is part of a static island

DISC: Final = np.dtype(
    [
        ("x", "f8"),  # px
        ("y", "f8"),
        ("vx", "f8"),  # px/s
        ("vy", "f8"),
        ("t", "f8"),  # s, of x, y, vx and vy
        ("radius", "f8"),  # px
        ("hit", "f8"),  # s, time of its next contact
        ("serial", "i4"),  # counts the changes of its course
        ("next", "i4"),  # disc in the same cell, or NONE
    ]
)

EVENT: Final = np.dtype(
    [
        ("crossing", "f8"),  # s, time at which it leaves its cell
        ("cell_offset", "i4"),  # from its cell's number to the next cell's
        ("cell", "i4"),
        ("partner", "i4"),  # of the next contact: a disc, or ~piece of wall
        ("partner_serial", "i4"),  # at the prediction
        ("ball", "i4"),  # its number in the scene
        ("carrier", "i4"),  # piece of wall that carries it, or NONE, or STATIC
    ]
)

BODY: Final = np.dtype(
    [
        ("ax", "f8"),  # px/s²: gravity, less what a wall supports
        ("ay", "f8"),
        ("mass", "f8"),  # kg
        ("elasticity", "f8"),
        ("last_contact", "f8"),  # s, time of the last contact
        ("last_disc_contact", "f8"),  # s, time of the last contact with a disc
        ("leans_until", "f8"),  # s, until when it counts as leaning on others
        ("slow_since", "f8"),  # s, start of the count of slow contacts
        ("slow_contacts", "i4"),  # since then
        ("corner", "i4"),  # second piece of wall that carries it, where it lies in a corner, or NONE
        ("settled", "f8"),  # s, time of its last sequence of impacts that was resolved as one
        ("residual", "f8"),  # px/s, approaches that this may have left; infinite if its bodies had no room
        ("streak", "i4"),  # contacts in a row, each within CONTACT_TIME of the one before
        ("fastest", "f8"),  # px/s, the fastest approach of these
    ]
)

TURN: Final = np.dtype(
    [
        ("angle", "f8"),  # rad, at the disc's time
        ("spin", "f8"),  # rad/s
        ("spin_rate", "f8"),  # rad/s², while walls carry it
        ("friction", "f8"),  # its factor
        ("slips_until", "f8"),  # s, when it ceases to slip on the walls that carry it, or NEVER
        ("reported_until", "f8"),  # s, time of the last change from slipping to rolling
    ]
)

ABSORBED: Final = np.dtype(  # momentum that a disc of a static island has absorbed, kg px/s
    [
        ("x", "f8"),  # since it was last passed on to the walls
        ("y", "f8"),
        ("load_x", "f8"),  # since the island was last examined
        ("load_y", "f8"),
    ]
)

NODE: Final = np.dtype([("time", "f8"), ("disc", "i8")])  # of the event queue; time: s


def aligned(count: int, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Return a record array of zeros that begins on a cache line."""
    memory = np.zeros(count * dtype.itemsize + CACHE_LINE, np.uint8)
    start = -memory.ctypes.data % CACHE_LINE
    return memory[start : start + count * dtype.itemsize].view(dtype).view(np.recarray)
