"""Who is near whom: a grid of cells wider than any disc, so that a disc meets only those of the 3 x 3 cells round it.

Each cell lists its discs (linked, so that any number fits) and the pieces of wall that a disc centred in it can touch.
A ring of empty cells round the arena spares the neighbours of a border cell a question.
"""

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.engines.compiled import Record, kernel, prefetch
from sandbox.engines.exact.records import NONE
from sandbox.quantity import segment_distance
from sandbox.state import Floats

# Discs and wall pieces a cell, on average, where discs small enough leave the choice. Fewer means walking through
# empty cells, more means looking at discs that are far away.
CROWD: Final = 0.6
SLACK: Final = 1e-9  # share by which cells are wider, and walls reach further, than they must: far above rounding

CELL: Final = np.dtype(
    [
        ("first", "i4"),  # disc in it, or NONE; each disc names the next
        ("begin", "i4"),  # of its wall pieces; those of the next cell begin where they end
    ]
)


class Cells(NamedTuple):
    """The grid. Cell (column, row) has number row * stride + column; the arena's first is (1, 1).

    width, height: of a cell, px; cell: CELL; piece: numbers of wall pieces, cell by cell.
    """

    stride: int
    width: float
    height: float
    cell: NDArray[np.void]
    piece: NDArray[np.int64]


def empty_cells(count: int, widest: float, size: Sequence[float], pieces: NDArray[np.void]) -> Cells:
    """Make the grid for so many discs, the widest of them so many px across, in an arena of so many px."""
    width = max(widest * (1 + SLACK), math.sqrt(size[0] * size[1] * CROWD / (count + len(pieces))))
    columns, rows = (max(1, int(side / width)) for side in size)
    width, height = size[0] / columns, size[1] / rows
    cell = np.empty((columns + 2) * (rows + 2) + 1, CELL)
    x, y = (np.arange(columns) + 0.5) * width, (np.arange(rows) + 0.5) * height
    far = (widest + math.hypot(width, height)) / 2
    near = [_cells_near(piece, x, y, far) for piece in pieces]
    number = np.repeat(np.arange(len(pieces)), [len(cells) for cells in near])
    listed = np.concatenate(near)
    order = np.argsort(listed, kind="stable")
    cell["first"] = NONE
    cell["begin"] = np.searchsorted(listed[order], np.arange(len(cell)))
    return Cells(columns + 2, width, height, cell, number[order])


def _cells_near(piece: Record, x: NDArray[Any], y: NDArray[Any], far: float) -> NDArray[np.int64]:
    """Find the cells of which the centre, at x of a column and y of a row (px), is not too far from a piece."""
    start = np.array([piece["x"], piece["y"]])
    end = start + piece["length"] * np.array([piece["tx"], piece["ty"]])
    far = (far + piece["thick"]) * (1 + SLACK)
    low, high = np.minimum(start, end) - far, np.maximum(start, end) + far
    columns, rows = (np.flatnonzero((c >= low[k]) & (c <= high[k])) for k, c in enumerate((x, y)))
    centre = np.stack(np.meshgrid(x[columns], y[rows]), axis=-1)
    distance = (
        segment_distance(centre, start.tolist(), end.tolist())
        if piece["length"]
        else np.linalg.norm(centre - start, axis=-1)
    )
    row, column = np.nonzero(distance <= far)
    return (rows[row] + 1) * (len(x) + 2) + columns[column] + 1


def cell_at(cells: Cells, position: Floats) -> NDArray[np.int64]:
    """Find the cell that each position (n, 2) px is in: (n,)."""
    rows = len(cells.cell) // cells.stride - 2
    column = np.clip(position[:, 0] / cells.width, 0, cells.stride - 3).astype(int)
    row = np.clip(position[:, 1] / cells.height, 0, rows - 1).astype(int)
    return (row + 1) * cells.stride + column + 1


def along_a_curve(cells: Cells, number: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for each cell number its place on a curve on which near cells are near: Morton's, of interleaved bits."""
    row, column = np.divmod(number, cells.stride)
    place = np.zeros_like(number)
    for bit in range(31):
        place |= ((column >> bit & 1) | (row >> bit & 1) << 1) << 2 * bit
    return place


@kernel
def enter(cells: Cells, disc: NDArray[np.void], i: int, number: int) -> None:
    """List disc i first in a cell."""
    cell = cells.cell[number]
    disc[i].next = cell.first
    cell.first = i


@kernel
def leave(cells: Cells, disc: NDArray[np.void], i: int, number: int) -> None:
    """Take disc i out of a cell's list."""
    cell = cells.cell[number]
    if cell.first == i:
        cell.first = disc[i].next
        return
    j = cell.first
    while disc[j].next != i:
        j = disc[j].next
    disc[j].next = disc[i].next


@kernel
def fetch_discs(cells: Cells, disc: NDArray[np.void], number: int) -> None:
    """Ask for the first disc of each of the 3 x 3 cells round a cell, all at once, before they are looked at."""
    for row in range(-1, 2):
        for cell in range(number + row * cells.stride - 1, number + row * cells.stride + 2):
            if cells.cell[cell].first >= 0:
                prefetch(disc, np.int64(cells.cell[cell].first))
