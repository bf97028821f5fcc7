"""Which balls a ball can touch, while the pairs i < j are gone through in order and pushed apart on the way.

The order is part of the rule: a pair is looked at on the positions that the pairs before it have left behind. So cells
are kept true all the way, and nothing is missed however far balls are pushed:

- In i's turn only i and those it has met are pushed. Those it has yet to meet are where they were when it looked.
- Those it has met are entered in the cell that they were pushed to at once, for the turns to come (`pushed`).
- i has seen all those within `reach` + `slack` of it. Once it is `slack` from where it looked, it looks again for those
  after the last one it met. Until then no other can have come within `reach`.

A ball is out of the cells when its turn comes, so what they hold is later. They are `reach` + `slack` wide at least:
all that is so near is in the 3 x 3 round a ball. Balls outside of the arena count to the cells at its edge, which puts
no two further apart. All distances are the larger of those along x and y.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sandbox.engines.compiled import kernel
from sandbox.state import Floats

FEW: Final = 20  # balls, below which looking at every pair takes less time
SLACK: Final = 0.1  # of the reach; less means looking again more often, more means meeting balls that are far away
ROUNDING: Final = 1e-9  # share by which a ball sees further, and cells are wider, than they must: far above rounding
CROWD: Final = 0.3  # balls a cell, on average, where the reach leaves the choice


class Neighbours(NamedTuple):
    """The cells, and what was seen last. Cell (column, row) has number (row + 1) * stride + column + 1.

    last_column, last_row: of the arena's cells; per_x, per_y: cells a px; sight: reach + slack, px; slack: px.
    first: a ball of each cell; next: (n,) another of the same cell (n where there is none); cell: (n,) that it is in.
    near: (n,) the balls that were seen, in order, from home: (1, 2) px.
    Where balls are few, near is empty, and stands for all later ones.
    """

    stride: int
    last_column: float
    last_row: float
    per_x: float
    per_y: float
    sight: float
    slack: float
    first: NDArray[np.int32]
    next: NDArray[np.int32]
    cell: NDArray[np.int32]
    near: NDArray[np.int32]
    home: Floats


@njit(cache=True)
def neighbours(position, reach, width, height):  # type: ignore[no-untyped-def]
    """Enter all balls in cells. position: (n, 2) px; reach: px between centres that may touch; width, height: px."""
    n = len(position)
    if n < FEW:
        none = np.empty(0, np.int32)
        return Neighbours(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, none, none, none, none, position)
    slack = reach * SLACK
    sight = (reach + slack) * (1 + ROUNDING)
    side, most = max(sight * (1 + ROUNDING), math.sqrt(width * height * CROWD / n)), n / CROWD
    columns, rows = max(1, int(min(width / side, most))), max(1, int(min(height / side, most)))
    first = np.full((columns + 2) * (rows + 2), n, np.int32)
    grid = (columns + 2, columns - 1.0, rows - 1.0, columns / width, rows / height, sight, slack, first)
    found = Neighbours(*grid, np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n, np.int32), np.empty((1, 2)))
    for i in range(n - 1, -1, -1):  # each cell then lists its balls in order, which leaves little to sort
        enter(found, i, cell_at(found, position[i, 0], position[i, 1]))
    return found


@kernel
def cell_at(found: Neighbours, x: float, y: float) -> int:
    """Return the number of the cell at a point, or of the one at the edge beyond which the point is."""
    column = min(max(0.0, x * found.per_x), found.last_column)  # in this order, which makes 0 of NaN
    row = min(max(0.0, y * found.per_y), found.last_row)
    return (int(row) + 1) * found.stride + int(column) + 1


@kernel
def enter(found: Neighbours, i: int, cell: int) -> None:
    """List ball i first in a cell."""
    found.cell[i] = cell
    found.next[i] = found.first[cell]
    found.first[cell] = i


@kernel
def leave(found: Neighbours, i: int) -> None:
    """Take ball i out of its cell's list."""
    j = found.first[found.cell[i]]
    if j == i:
        found.first[found.cell[i]] = found.next[i]
        return
    while found.next[j] != i:
        j = found.next[j]
    found.next[j] = found.next[i]


@kernel
def look_around(found: Neighbours, position: Floats, i: int, last: int) -> int:
    """List the balls after `last` that ball i can touch, in order, as `near`; return how many they are."""
    n, near = len(position), found.near
    x, y = position[i, 0], position[i, 1]
    found.home[0, 0], found.home[0, 1] = x, y
    cell, count = cell_at(found, x, y), 0
    for row in range(-1, 2):
        corner = cell + row * found.stride - 1
        for here in range(corner, corner + 3):
            j = np.int64(found.first[here])
            while j < n:
                near[count] = j  # stays only where it counts: a branch here would be guessed wrong too often
                apart = max(abs(position[j, 0] - x), abs(position[j, 1] - y))
                count += (j > last) & (apart <= found.sight)
                j = np.int64(found.next[j])
    for k in range(1, count):
        j, place = near[k], k
        while place > 0 and near[place - 1] > j:
            near[place] = near[place - 1]
            place -= 1
        near[place] = j
    return count


@kernel
def later(found: Neighbours, position: Floats, i: int) -> tuple[int, int]:
    """Begin ball i's turn: return the places, from and to, at which `nth` has those after i that it can touch."""
    if len(found.near) == 0:
        return i + 1, len(position)
    leave(found, i)
    return 0, look_around(found, position, i, i)


@kernel
def nth(found: Neighbours, place: int) -> int:
    """Return the ball at a place. An unsigned number spares the question whether it counts from the end."""
    return int(np.uint32(place if len(found.near) == 0 else found.near[place]))


@kernel
def pushed(found: Neighbours, position: Floats, i: int, j: int, place: int, end: int) -> tuple[int, int]:
    """Note that i and j have been pushed; return the places of those that i has yet to meet."""
    if len(found.near) == 0:
        return place, end
    cell = cell_at(found, position[j, 0], position[j, 1])
    if cell != found.cell[j]:
        leave(found, j)
        enter(found, j, cell)
    if max(abs(position[i, 0] - found.home[0, 0]), abs(position[i, 1] - found.home[0, 1])) < found.slack:
        return place, end
    return 0, look_around(found, position, i, j)
