"""The grid: cells wider than any disc, so that a disc can meet only the discs of the 3 x 3 cells around it.

Each cell lists its discs (a linked list, so that any number fits) and the pieces of wall that a disc centred in it can
touch. A ring of empty cells around the arena spares a test at the border. A disc outside the arena belongs to the cell
at its edge that is nearest: this puts no two discs further apart, so that none is overlooked.
"""

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, Records, kernel
from sandbox.scene.walls import PIECE, segment_distance

# Discs and wall pieces per cell, on average, if the discs are small enough to leave the choice. Fewer means crossing
# empty cells, more means testing discs that are far away.
ITEMS_PER_CELL: Final = 0.6
MAX_CELLS: Final = 4  # along a side, for each disc and piece: most of a channel's are empty
CELL_MARGIN: Final = 1e-9  # relative, of the cells' width and the walls' reach: far above rounding
NO_PIECES: Final = np.empty(0, PIECE)
NONE: Final = -1  # instead of a disc, at the end of a cell's list
FAR: Final = 1e30  # px, where the cells at the arena's edge end: no disc gets there, and its square does not overflow

CELL: Final = np.dtype(
    [
        ("first", "i4"),  # disc of its list, or NONE; each disc has the number of the next
        ("begin", "i4"),  # of its wall pieces; they end where those of the next cell begin
    ]
)


class Grid(NamedTuple):
    """The grid. Cell (column, row) has number row * stride + column; the arena's first is (1, 1).

    width, height: of a cell, px; cell: CELL; piece: numbers of the wall pieces near each cell, cell by cell.
    """

    stride: int
    width: float
    height: float
    cell: Records
    piece: Any


def grid_for(count: int, widest: float, size: Sequence[float], pieces: NDArray[np.void] = NO_PIECES) -> Grid:
    """Return a grid without discs. count: of discs; widest: diameter of the largest, px; size: of the arena, px."""
    width = max(widest * (1 + CELL_MARGIN), math.sqrt(size[0] * size[1] * ITEMS_PER_CELL / (count + len(pieces))))
    most = MAX_CELLS * (count + len(pieces))
    columns, rows = (max(1, int(min(side / width, most))) for side in size)
    width, height = size[0] / columns, size[1] / rows
    cell = np.empty((columns + 2) * (rows + 2) + 1, CELL).view(np.recarray)
    x, y = (np.arange(columns) + 0.5) * width, (np.arange(rows) + 0.5) * height
    far = (widest + math.hypot(width, height)) / 2
    near = [_cells_near(piece, x, y, far) for piece in pieces]
    number = np.repeat(np.arange(len(pieces)), [len(cells) for cells in near])
    listed = np.concatenate([np.empty(0, np.int64), *near])
    order = np.argsort(listed, kind="stable")
    cell["first"] = NONE
    cell["begin"] = np.searchsorted(listed[order], np.arange(len(cell)))
    return Grid(columns + 2, width, height, cell, number[order])


def _cells_near(piece: Record, x: NDArray[Any], y: NDArray[Any], far: float) -> NDArray[np.int64]:
    """Return the numbers of the cells whose centres are at most `far` (px) from a piece.

    x, y: px, the centres' coordinates, by column and by row. Of a piece that leaves the arena, also the cells at the
    edge whose discs outside may be that near, by the piece's bounding box.
    """
    start = np.array([piece["x"], piece["y"]])
    end = start + piece["length"] * np.array([piece["tx"], piece["ty"]])
    far = (far + piece["half_thickness"]) * (1 + CELL_MARGIN)
    low, high = np.minimum(start, end), np.maximum(start, end)
    leaves = (low < 0).any() or (high > (x[0] + x[-1], y[0] + y[-1])).any()
    low, high = np.minimum(low - far, (x[-1], y[-1])), np.maximum(high + far, (x[0], y[0]))
    columns, rows = (np.flatnonzero((c >= low[k]) & (c <= high[k])) for k, c in enumerate((x, y)))
    centre = np.stack(np.meshgrid(x[columns], y[rows]), axis=-1)
    distance = (
        segment_distance(centre, start.tolist(), end.tolist())
        if piece["length"]
        else np.linalg.norm(centre - start, axis=-1)
    )
    at_edge = np.isin(rows, (0, len(y) - 1))[:, None] | np.isin(columns, (0, len(x) - 1))
    row, column = np.nonzero((distance <= far) | (leaves & at_edge))
    return (rows[row] + 1) * (len(x) + 2) + columns[column] + 1


@kernel
def cell_at(grid: Grid, x: float, y: float) -> int:
    """Return the number of the cell at a point; for a point outside the arena, the nearest cell at its edge."""
    stride = grid.stride
    column = min(max(0.0, x / grid.width), stride - 3.0)  # in this order, which makes 0 of NaN
    row = min(max(0.0, y / grid.height), len(grid.cell) // stride - 3.0)
    return (int(row) + 1) * stride + int(column) + 1


@kernel
def extent(index: int, last: int, width: float) -> tuple[float, float]:
    """Return where a column or row of cells begins and ends (px), given its number from 1 and the last one's."""
    return -FAR if index == 1 else (index - 1) * width, FAR if index == last else index * width


@kernel
def enter(grid: Grid, disc: Records, i: int, number: int) -> None:
    """List disc i first in a cell."""
    cell = grid.cell[number]
    disc[i].next = cell.first
    cell.first = i


@kernel
def leave(grid: Grid, disc: Records, i: int, number: int) -> None:
    """Remove disc i from a cell's list."""
    cell = grid.cell[number]
    if cell.first == i:
        cell.first = disc[i].next
        return
    j = cell.first
    while disc[j].next != i:
        j = disc[j].next
    disc[j].next = disc[i].next
