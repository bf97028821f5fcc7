"""Broad phase of the time-stepped engines: the balls j > i that ball i can touch, in order, though pushes move them.

The order is part of the rule: a pair collides on the positions that the pairs before it have left. So the grid is kept
up to date after every push, and no pair is missed however far balls are pushed:

- In i's turn, only i and the balls it has met are pushed. Those it has yet to meet have not moved since it looked.
- A ball that was pushed is moved to its new cell at once, for the turns to come (`note_push`).
- Ball i has seen all balls within `reach` + `slack`. Once it is `slack` from where it looked, it looks again, for balls
  after the last one it met. Until then, no other ball can have come within `reach`.

Ball i leaves the grid when its turn begins, so the grid holds later balls only. Cells are at least `reach` + `slack`
wide: the 3 x 3 cells around a ball hold every ball that near. Balls outside the arena belong to the cells at its edge,
which puts no two of them further apart. All distances are the larger of those along x and y.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sandbox.engines.compiled import kernel
from sandbox.state import Floats

MIN_BALLS: Final = 20  # for a grid; with fewer, testing every pair takes less time
SLACK: Final = 0.1  # of the reach; less means looking again more often, more means testing balls that are far away
SIGHT_MARGIN: Final = 1e-9  # relative, of sight and of cells: far above rounding
BALLS_PER_CELL: Final = 0.3  # on average, if the reach leaves the choice
NONE_LEFT: Final = -1  # instead of a ball


class Neighbours(NamedTuple):
    """The grid, and the neighbours of the ball whose turn it is. Cell (column, row) is (row + 1) * stride + column + 1.

    last_column, last_row: of the arena's cells; per_x, per_y: cells per px; sight: reach + slack, px; slack: px.
    first: a ball of each cell; next: (n,) another of the same cell, or n; cell: (n,) the cell of each ball.
    near: (n,) the balls in sight, in order, seen from home: (1, 2) px. cursor: (2,) the place in near of the next ball
    to return, and of the last + 1.
    Without a grid, first is empty, and near is all balls.
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
    cursor: NDArray[np.int64]


@njit(cache=True)
def neighbours(position, reach, width, height):  # type: ignore[no-untyped-def]
    """Enter all balls in a grid. position: (n, 2) px; reach: px between centres that may touch; width, height: px."""
    n = len(position)
    cursor = np.zeros(2, np.int64)
    if n < MIN_BALLS:
        none, every = np.empty(0, np.int32), np.arange(n).astype(np.int32)
        return Neighbours(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, none, none, none, every, position, cursor)
    slack = reach * SLACK
    sight = (reach + slack) * (1 + SIGHT_MARGIN)
    side, most = max(sight * (1 + SIGHT_MARGIN), math.sqrt(width * height * BALLS_PER_CELL / n)), n / BALLS_PER_CELL
    columns, rows = max(1, int(min(width / side, most))), max(1, int(min(height / side, most)))
    first = np.full((columns + 2) * (rows + 2), n, np.int32)
    grid = (columns + 2, columns - 1.0, rows - 1.0, columns / width, rows / height, sight, slack, first)
    lists = (np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n, np.int32))
    found = Neighbours(*grid, *lists, np.empty((1, 2)), cursor)
    for i in range(n - 1, -1, -1):  # so that each cell lists its balls in order, which leaves little to sort
        enter(found, i, cell_at(found, position[i, 0], position[i, 1]))
    return found


@kernel
def cell_at(found: Neighbours, x: float, y: float) -> int:
    """Return the number of the cell at a point; for a point outside the arena, the nearest cell at its edge."""
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
    """Remove ball i from its cell's list."""
    j = found.first[found.cell[i]]
    if j == i:
        found.first[found.cell[i]] = found.next[i]
        return
    while found.next[j] != i:
        j = found.next[j]
    found.next[j] = found.next[i]


@kernel
def look_around(found: Neighbours, position: Floats, i: int, last: int) -> None:
    """List the balls after `last` that ball i can touch, in order, as `near`."""
    n, near = len(position), found.near
    x, y = position[i, 0], position[i, 1]
    found.home[0, 0], found.home[0, 1] = x, y
    cell, count = cell_at(found, x, y), 0
    for row in range(-1, 2):
        corner = cell + row * found.stride - 1
        for here in range(corner, corner + 3):
            j = np.int64(found.first[here])
            while j < n:
                near[count] = j  # overwritten unless it counts: a branch would be mispredicted too often
                apart = max(abs(position[j, 0] - x), abs(position[j, 1] - y))
                count += (j > last) & (apart <= found.sight)
                j = np.int64(found.next[j])
    for k in range(1, count):
        j, place = near[k], k
        while place > 0 and near[place - 1] > j:
            near[place] = near[place - 1]
            place -= 1
        near[place] = j
    found.cursor[0], found.cursor[1] = 0, count


@kernel
def begin_turn(found: Neighbours, position: Floats, i: int) -> None:
    """Begin ball i's turn: find the balls after i that it can touch."""
    if len(found.first) == 0:
        found.cursor[0], found.cursor[1] = i + 1, len(position)
    else:
        leave(found, i)
        look_around(found, position, i, i)


@kernel
def next_neighbour(found: Neighbours) -> int:
    """Return the next ball that the ball whose turn it is can touch, or NONE_LEFT."""
    place = found.cursor[0]
    if place == found.cursor[1]:
        return NONE_LEFT
    found.cursor[0] = place + 1
    return int(found.near[np.uint32(place)])  # an unsigned index needs no test for counting from the end


@kernel
def note_push(found: Neighbours, position: Floats, i: int, j: int) -> None:
    """Update the grid after i and j were pushed apart, in i's turn; look again if i has gone far."""
    if len(found.first) == 0:
        return
    cell = cell_at(found, position[j, 0], position[j, 1])
    if cell != found.cell[j]:
        leave(found, j)
        enter(found, j, cell)
    if max(abs(position[i, 0] - found.home[0, 0]), abs(position[i, 1] - found.home[0, 1])) >= found.slack:
        look_around(found, position, i, j)
