"""Broad phase of the time-stepped engines: the balls j > i that ball i can touch, in order, even as pushes move them.

The order is part of the rule: a pair collides at the positions that earlier pairs have left. So the grid is updated
after every push, and no pair is missed however far balls are pushed:

- In i's turn, only i and the balls it has met are pushed. Those it has yet to meet have not moved since it looked.
- A ball that was pushed is moved to its new cell at once, for the turns to come, and ball i, where it is then, looks
  again for balls after the last one it met (`note_push`).

Ball i leaves the grid when its turn begins, so the grid holds later balls only. Cells are at least as wide as balls
reach: the 3 x 3 cells around a ball hold every ball that near. All distances are the larger of those along x and y.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Records, kernel
from sandbox.engines.grid import NONE, Grid, enter, grid_for, leave
from sandbox.scene.walls import PIECE

MIN_BALLS: Final = 20  # for a grid; with fewer, testing every pair takes less time
REACH_MARGIN: Final = 1e-9  # relative: far above rounding


class NeighbourGrid(NamedTuple):
    """The grid, and the neighbours of the ball whose turn it is.

    reach: px between centres that may touch; near: (n,) the balls within it, in order; cursor: (2,) the place in near
    of the next ball to return, and of the last + 1.
    """

    grid: Grid
    reach: float
    near: NDArray[np.int32]
    cursor: NDArray[np.int64]


def new_grid(n: int, reach: float, size: Sequence[float]) -> NeighbourGrid | None:
    """Return a grid without balls, or None for so few that every pair is tested.

    n: the number of balls; reach: px between centres that may touch; size: width and height of the arena, px.
    """
    if n < MIN_BALLS:
        return None
    reach *= 1 + REACH_MARGIN
    grid = grid_for(n, reach, size, np.empty(0, PIECE))
    return NeighbourGrid(grid, reach, np.empty(n, np.int32), np.zeros(2, np.int64))


@kernel
def fill(around: NeighbourGrid | None, ball: Records) -> None:
    """Enter every ball in the grid. ball: (n,) BALL."""
    if around is None:
        return
    grid = around.grid
    for cell in range(len(grid.cell)):
        grid.cell[cell].first = NONE
    for i in range(len(ball) - 1, -1, -1):  # backwards, so that cells list balls in order, which leaves little to sort
        ball[i].cell = _cell_at(grid, ball[i].x, ball[i].y)
        enter(grid, ball, i, ball[i].cell)


@kernel
def _cell_at(grid: Grid, x: float, y: float) -> int:
    """Return the number of the cell at a point; for a point outside the arena, the nearest cell at its edge."""
    stride = grid.stride
    column = min(max(0.0, x / grid.width), stride - 3.0)  # in this order, which makes 0 of NaN
    row = min(max(0.0, y / grid.height), len(grid.cell) // stride - 3.0)
    return (int(row) + 1) * stride + int(column) + 1


@kernel
def _look_around(around: NeighbourGrid, ball: Records, i: int, cell: int, last: int) -> None:
    """List the balls after `last` that ball i, in a cell, can touch, in order, in `near`."""
    grid, near, reach, count = around.grid, around.near, around.reach, 0
    x, y = ball[i].x, ball[i].y
    for row in range(-1, 2):
        corner = cell + row * grid.stride - 1
        for here in range(corner, corner + 3):
            j = grid.cell[here].first
            while j >= 0:
                near[count] = j  # overwritten if j is not a neighbour: a branch would be mispredicted too often
                count += (j > last) & (abs(ball[j].x - x) <= reach) & (abs(ball[j].y - y) <= reach)
                j = ball[j].next
    for k in range(1, count):
        j, place = near[k], k
        while place > 0 and near[place - 1] > j:
            near[place] = near[place - 1]
            place -= 1
        near[place] = j
    around.cursor[0], around.cursor[1] = 0, count


@kernel
def begin_turn(around: NeighbourGrid | None, ball: Records, i: int) -> None:
    """Begin ball i's turn: find the balls after i that it can touch."""
    if around is None:
        return
    leave(around.grid, ball, i, ball[i].cell)
    _look_around(around, ball, i, ball[i].cell, i)


@kernel
def next_neighbour(around: NeighbourGrid | None, j: int, n: int) -> int:
    """Return the next ball after j that the ball whose turn it is can touch, or n if none is left."""
    if around is None:
        return j + 1
    place = around.cursor[0]
    if place == around.cursor[1]:
        return n
    around.cursor[0] = place + 1
    return around.near[place]


@kernel
def note_push(around: NeighbourGrid | None, ball: Records, i: int, j: int) -> None:
    """Update the grid after i and j were pushed apart, in i's turn, and look again."""
    if around is None:
        return
    cell = _cell_at(around.grid, ball[j].x, ball[j].y)
    if cell != ball[j].cell:
        leave(around.grid, ball, j, ball[j].cell)
        ball[j].cell = cell
        enter(around.grid, ball, j, cell)
    _look_around(around, ball, i, _cell_at(around.grid, ball[i].x, ball[i].y), j)
