"""Who is near whom: a grid of cells wider than any disc, so that a disc meets only those of the 3 x 3 cells round it.

Each cell lists its discs (linked, so that any number fits) and the pieces of wall that a disc centred in it can touch.
A ring of empty cells round the arena spares the neighbours of a border cell a question.
"""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sandbox.quantity import segment_distance
from sandbox.state import Floats

# Discs and wall pieces a cell, on average, where discs small enough leave the choice. Fewer means walking through
# empty cells, more means looking at discs that are far away.
CROWD: Final = 0.6
SLACK: Final = 1e-9  # share by which cells are wider, and walls reach further, than they must: far above rounding

LINK: Final = np.dtype([("next", "i4"), ("previous", "i4"), ("column", "i4"), ("row", "i4")])


class Cells(NamedTuple):
    """The grid. Cell (column, row) has number row * stride + column; the arena's first is (1, 1).

    width, height: of a cell, px; first: (cells,) the first disc of each, -1 for none; link: (n,) LINK, of each disc;
    piece: the wall pieces of cell c are piece[begin[c]:begin[c + 1]].
    """

    stride: int
    width: float
    height: float
    first: NDArray[np.int32]
    link: NDArray[np.void]
    begin: NDArray[np.int64]
    piece: NDArray[np.int64]


def cells_of(position: Floats, radius: Floats, size: Sequence[float], pieces: NDArray[np.void]) -> Cells:
    """Make the grid, its discs not yet entered.

    position: (n, 2) px; radius: (n,) px; size: of the arena, px; pieces: (m,) PIECE.
    """
    things = len(position) + len(pieces)
    width = max(2 * float(radius.max()) * (1 + SLACK), math.sqrt(size[0] * size[1] * CROWD / things))
    columns, rows = (max(1, int(side / width)) for side in size)
    width, height = size[0] / columns, size[1] / rows
    link = np.empty(len(position), LINK)
    link["column"] = np.clip(position[:, 0] / width, 0, columns - 1).astype(int) + 1
    link["row"] = np.clip(position[:, 1] / height, 0, rows - 1).astype(int) + 1
    stride = columns + 2
    begin, piece = _pieces_of_cells(pieces, float(radius.max()), columns, rows, width, height)
    return Cells(stride, width, height, np.full(stride * (rows + 2), -1, np.int32), link, begin, piece)


def _pieces_of_cells(
    pieces: NDArray[np.void], radius: float, columns: int, rows: int, width: float, height: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """List for each cell the pieces that a disc of this radius, centred anywhere in the cell, can touch."""
    x, y = (np.arange(columns) + 0.5) * width, (np.arange(rows) + 0.5) * height
    cells, numbers = [], []
    for number, piece in enumerate(pieces):
        start = np.array([piece["x"], piece["y"]])
        end = start + piece["length"] * np.array([piece["tx"], piece["ty"]])
        far = (radius + piece["thick"] + math.hypot(width, height) / 2) * (1 + SLACK)
        low, high = np.minimum(start, end) - far, np.maximum(start, end) + far
        column, row = np.flatnonzero((x >= low[0]) & (x <= high[0])), np.flatnonzero((y >= low[1]) & (y <= high[1]))
        centre = np.stack(np.meshgrid(x[column], y[row]), axis=-1)
        near = (segment_distance(centre, start, end) if piece["length"] else np.hypot(*(centre - start).T).T) <= far
        at = np.argwhere(near)
        cells.append((row[at[:, 0]] + 1) * (columns + 2) + column[at[:, 1]] + 1)
        numbers.append(np.full(len(at), number))
    cell, number_of = np.concatenate(cells), np.concatenate(numbers)
    order = np.argsort(cell, kind="stable")
    begin = np.searchsorted(cell[order], np.arange((columns + 2) * (rows + 2) + 1))
    return begin, number_of[order]


@njit
def enter(cells, i):  # type: ignore[no-untyped-def]
    """Put disc i at the head of the list of the cell that its link names."""
    link = cells.link[i]
    cell = link.row * cells.stride + link.column
    link.next, link.previous = cells.first[cell], -1
    if link.next >= 0:
        cells.link[link.next].previous = i
    cells.first[cell] = i


@njit
def leave(cells, i):  # type: ignore[no-untyped-def]
    """Take disc i out of the list of its cell."""
    link = cells.link[i]
    if link.previous >= 0:
        cells.link[link.previous].next = link.next
    else:
        cells.first[link.row * cells.stride + link.column] = link.next
    if link.next >= 0:
        cells.link[link.next].previous = link.previous
