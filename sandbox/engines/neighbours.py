"""Broad phase of the time-stepped engines: the balls j > i that ball i can touch, in order, even as pushes move them.

The order is part of the rule: a pair collides at the positions that earlier pairs have left. So the grid is updated
after every push, and no pair is missed however far balls are pushed:

- In i's turn, only i and the balls it has met are pushed. Those it has yet to meet have not moved since it looked.
- A ball that was pushed is moved to its new cell at once, for the turns to come (`note_push`).
- Ball i has seen all balls within `reach` + `slack`. Once it is `slack` from where it looked, it looks again, for balls
  after the last one it met. Until then, no other ball can have come within `reach`.

Ball i leaves the grid when its turn begins, so the grid holds later balls only. Cells are at least `reach` + `slack`
wide: the 3 x 3 cells around a ball hold every ball that near. Balls outside the arena belong to the cells at its edge,
which puts no two of them further apart. All distances are the larger of those along x and y.
"""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Records, kernel
from sandbox.state import Floats

MIN_BALLS: Final = 20  # for a grid; with fewer, testing every pair takes less time
SLACK: Final = 0.1  # as a fraction of the reach; less means looking more often, more means testing balls further away
SIGHT_MARGIN: Final = 1e-9  # relative, of `sight` and of the cells' width: far above rounding
BALLS_PER_CELL: Final = 0.3  # on average, if the reach is small enough to leave the choice


class NeighbourGrid(NamedTuple):
    """The grid, and the neighbours of the ball whose turn it is. Cell (column, row) is (row + 1) * stride + column + 1.

    last_column, last_row: of the arena's cells; per_x, per_y: cells per px; sight: reach + slack, px; slack: px.
    first: a ball of each cell; next: (n,) another of the same cell, or n; cell: (n,) the cell of each ball.
    near: (n,) the balls in sight, in order, seen from home: (2,) px. cursor: (2,) the place in near of the next ball
    to return, and of the last + 1.
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


def new_grid(n: int, reach: float, size: Sequence[float]) -> NeighbourGrid | None:
    """Return a grid without balls, or None for so few that every pair is tested.

    n: the number of balls; reach: px between centres that may touch; size: width and height of the arena, px.
    """
    if n < MIN_BALLS:
        return None
    width, height = size
    slack = reach * SLACK
    sight = (reach + slack) * (1 + SIGHT_MARGIN)
    side, most = max(sight * (1 + SIGHT_MARGIN), math.sqrt(width * height * BALLS_PER_CELL / n)), n / BALLS_PER_CELL
    columns, rows = max(1, int(min(width / side, most))), max(1, int(min(height / side, most)))
    shape = (columns + 2, columns - 1.0, rows - 1.0, columns / width, rows / height, sight, slack)
    first = np.empty((columns + 2) * (rows + 2), np.int32)
    lists = (first, np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n, np.int32))
    return NeighbourGrid(*shape, *lists, np.empty(2), np.zeros(2, np.int64))


@kernel
def fill(grid: NeighbourGrid | None, ball: Records) -> None:
    """Enter every ball in the grid. ball: (n,) with x and y, px."""
    if grid is None:
        return
    n = len(ball)
    for cell in range(len(grid.first)):
        grid.first[cell] = n
    for i in range(n - 1, -1, -1):  # backwards, so that each cell lists its balls in order, which leaves little to sort
        _enter(grid, i, _cell_at(grid, ball[i].x, ball[i].y))


@kernel
def _cell_at(grid: NeighbourGrid, x: float, y: float) -> int:
    """Return the number of the cell at a point; for a point outside the arena, the nearest cell at its edge."""
    column = min(max(0.0, x * grid.per_x), grid.last_column)  # in this order, which makes 0 of NaN
    row = min(max(0.0, y * grid.per_y), grid.last_row)
    return (int(row) + 1) * grid.stride + int(column) + 1


@kernel
def _enter(grid: NeighbourGrid, i: int, cell: int) -> None:
    """List ball i first in a cell."""
    grid.cell[i] = cell
    grid.next[i] = grid.first[cell]
    grid.first[cell] = i


@kernel
def _leave(grid: NeighbourGrid, i: int) -> None:
    """Remove ball i from its cell's list."""
    j = grid.first[grid.cell[i]]
    if j == i:
        grid.first[grid.cell[i]] = grid.next[i]
        return
    while grid.next[j] != i:
        j = grid.next[j]
    grid.next[j] = grid.next[i]


@kernel
def _look_around(grid: NeighbourGrid, ball: Records, i: int, cell: int, last: int) -> None:
    """List the balls after `last` that ball i, in a cell, can touch, in order, in `near`."""
    n, near, sight, count = len(ball), grid.near, grid.sight, 0
    x, y = ball[i].x, ball[i].y
    grid.home[0], grid.home[1] = x, y
    for row in range(-1, 2):
        corner = cell + row * grid.stride - 1
        for here in range(corner, corner + 3):
            j = grid.first[here]
            while j < n:
                near[count] = j  # overwritten if j is not a neighbour: a branch would be mispredicted too often
                count += (j > last) & (abs(ball[j].x - x) <= sight) & (abs(ball[j].y - y) <= sight)
                j = grid.next[j]
    for k in range(1, count):
        j, place = near[k], k
        while place > 0 and near[place - 1] > j:
            near[place] = near[place - 1]
            place -= 1
        near[place] = j
    grid.cursor[0], grid.cursor[1] = 0, count


@kernel
def begin_turn(grid: NeighbourGrid | None, ball: Records, i: int) -> None:
    """Begin ball i's turn: find the balls after i that it can touch."""
    if grid is None:
        return
    _leave(grid, i)
    _look_around(grid, ball, i, grid.cell[i], i)


@kernel
def next_neighbour(grid: NeighbourGrid | None, j: int, n: int) -> int:
    """Return the next ball after j that the ball whose turn it is can touch, or n if none is left."""
    if grid is None:
        return j + 1
    place = grid.cursor[0]
    if place == grid.cursor[1]:
        return n
    grid.cursor[0] = place + 1
    return grid.near[place]


@kernel
def note_push(grid: NeighbourGrid | None, ball: Records, i: int, j: int) -> None:
    """Update the grid after i and j were pushed apart, in i's turn; look again if i has gone far."""
    if grid is None:
        return
    cell = _cell_at(grid, ball[j].x, ball[j].y)
    if cell != grid.cell[j]:
        _leave(grid, j)
        _enter(grid, j, cell)
    if max(abs(ball[i].x - grid.home[0]), abs(ball[i].y - grid.home[1])) >= grid.slack:
        _look_around(grid, ball, i, _cell_at(grid, ball[i].x, ball[i].y), j)
