"""Broad phase of the time-stepped engines: the balls j > i that ball i can touch, in order, even as pushes move them.

The order is part of the rule: a pair collides at the positions that earlier pairs have left. So each neighbour is
searched for from where ball i is by then, and a ball that was pushed is moved to its new cell at once: no pair is
missed, however far balls are pushed.

Cells are at least as wide as balls reach: the 3 x 3 cells around a ball hold every ball that near. All distances are
the larger of those along x and y.
"""

from typing import Final

from sandbox.compiled import Records, kernel
from sandbox.engines.grid import CELL_MARGIN, NONE, Grid, cell_at, enter, leave

REACH_MARGIN: Final = 1 + CELL_MARGIN  # of the px between centres that may touch: far above rounding


@kernel
def fill(grid: Grid, ball: Records) -> None:
    """Enter every ball in the grid. ball: (n,) BALL."""
    for cell in range(len(grid.cell)):
        grid.cell[cell].first = NONE
    for i in range(len(ball)):
        ball[i].cell = cell_at(grid, ball[i].x, ball[i].y)
        enter(grid, ball, i, ball[i].cell)


@kernel
def next_neighbour(grid: Grid, ball: Records, i: int, last: int, reach: float) -> int:
    """Return the next ball after `last`, by number, whose centre is within `reach` px of ball i's; else n."""
    x, y, reach, neighbour = ball[i].x, ball[i].y, reach * REACH_MARGIN, len(ball)
    cell = cell_at(grid, x, y)
    for corner in range(cell - grid.stride - 1, cell + grid.stride, grid.stride):
        for here in range(corner, corner + 3):
            j = grid.cell[here].first
            while j >= 0:
                if last < j < neighbour and abs(ball[j].x - x) <= reach and abs(ball[j].y - y) <= reach:
                    neighbour = j
                j = ball[j].next
    return neighbour


@kernel
def note_push(grid: Grid, ball: Records, j: int) -> None:
    """Move ball j to its new cell after a ball i < j pushed it. Ball i may stay: no later ball searches for it."""
    cell = cell_at(grid, ball[j].x, ball[j].y)
    if cell != ball[j].cell:
        leave(grid, ball, j, ball[j].cell)
        ball[j].cell = cell
        enter(grid, ball, j, cell)
