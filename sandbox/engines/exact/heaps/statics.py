"""Statics: the forces with which touching discs and walls carry a load, and whether they can carry it.

By Gauss's principle, of all accelerations a that contacts allow, bodies have those with the least
(a - w/m)' m (a - w/m) / 2, where w is the load. With contacts as stiff springs that only push, this is the least of

    a' m a / 2 - w' a + sum over contacts c of max(0, f_c - k b_c' a)² / (2 k),

where b_c' a is the acceleration at which contact c opens and k the stiffness. Its forces are max(0, f_c - k b_c' a),
and with these as the new f, the next minimum is nearer to that of rigid contacts (method of multipliers: D. P.
Bertsekas, Constrained Optimization and Lagrange Multiplier Methods, 1982). Each is found by Newton's method: the
function is quadratic in pieces, so with an exact line search it ends after finitely many steps. The matrix is as sparse
as the contacts: with discs sorted along the longer side of a heap, its entries are near the diagonal.

Coordinates of a disc: x, y and, with friction, r times its angle, whose mass is m/2. A contact without friction has one
column, its normal n; with friction mu it has two, the edges n + mu t and n - mu t of the friction cone.
"""

from bisect import bisect_left
from typing import Final, NamedTuple

import numpy as np

from sandbox.engines.grid import NONE
from sandbox.state import Bools, Floats, Integers

STIFFNESS: Final = 1e8  # of the springs, mean mass / s²; stiffer ones would leave too few digits of the matrix
MAX_NEWTON: Final = 200  # steps of Newton's method, which ends after finitely many
SHARES: Final = 2**30  # in which a step is divided, to find where the function is least along it
MAX_UPDATES: Final = 100  # of the forces; an arch that is nearly flat needs some 50
CONVERGED: Final = 1e-13  # of the largest load: a change of the forces that is rounding
ROUNDING: Final = 3e-16  # of stiffness times acceleration, likewise
PRESSING: Final = 1e-9  # of the largest force: a smaller one is rounding
MOVES: Final = 1e-4  # of a random motion: what is left of it in a direction in which a disc can move
STANDS: Final = 1e-9  # relative: a change of the accelerations below which forces that change have no end
MIN_BLOCK: Final = 20  # discs of a block of the matrix: smaller ones take more time in Python


class Columns(NamedTuple):
    """Directions in which contacts push, sorted by contact. (k,) each.

    first, second: discs, or NONE for a wall as the second; x, y: direction of the force on the second; turn: the force
    on r times the angle of either disc, with the sign changed; contact: number of the contact.
    """

    first: Integers
    second: Integers
    x: Floats
    y: Floats
    turn: Floats
    contact: Integers


def columns_of(first: Integers, second: Integers, normal: Floats, friction: Floats) -> Columns:
    """Return the columns of contacts. first, second, friction: (c,); normal: (c, 2), from first to second."""
    contact = np.repeat(np.arange(len(first)), np.where(friction > 0, 2, 1))
    is_second_edge = np.append(False, contact[1:] == contact[:-1])
    slope = np.where(is_second_edge, -1, 1) * friction[contact]
    nx, ny = normal[contact].T
    x, y = nx - slope * ny, ny + slope * nx
    return Columns(first[contact], second[contact], x, y, slope, contact)


def equilibrium(
    columns: Columns,
    mass: Floats,
    load: Floats,
    bilateral: Bools | bool = False,
    stiffness: float | None = None,
    least: Floats | float = 0.0,
) -> tuple[Floats, Floats]:
    """Return the accelerations under a load, like `load`, and the forces of the columns, (k,).

    mass, load: (n, 2 or 3), by coordinate; bilateral: (k,), whether columns also pull; stiffness: kg/s², of the
    springs, STIFFNESS times the mean mass by default; least: (k,), the rates at which columns open at least. Fast if
    the discs are sorted along a line.
    """
    k = STIFFNESS * float(mass[:, 0].mean()) if stiffness is None else stiffness
    system = _System(columns, mass, load, least)
    a, f, tolerance = np.zeros(load.size), np.zeros(len(columns.x)), CONVERGED * _largest(load)
    for _ in range(MAX_UPDATES):
        last, a = a, _minimum(system, a, f, bilateral, k, tolerance)
        before, f = f, _forces(f, k * (system.openings(a) - least), bilateral)
        if _largest(f - before) <= tolerance + ROUNDING * k * _largest(a):
            break
        if _largest(a - last) <= STANDS * _largest(a):
            break
    return a.reshape(load.shape), f


def _forces(f: Floats, stretched: Floats, bilateral: Bools | bool) -> Floats:
    """Return the forces of the columns, (k,). stretched: (k,), what springs give up as the columns open."""
    push = f - stretched
    return np.where(bilateral | (push > 0), push, 0.0)


def _minimum(system: "_System", a: Floats, f: Floats, bilateral: Bools | bool, k: float, tolerance: float) -> Floats:
    """Return the a at which the function is least for the multipliers f. tolerance: kg px/s², of the sum of forces."""
    share, pushes = 0.0, np.empty(0, bool)
    for _ in range(MAX_NEWTON):
        opening = system.openings(a) - system.least
        force = _forces(f, k * opening, bilateral)
        rest = system.load - system.mass * a + system.pushed(force)
        before, pushes = pushes, (force > 0) | bilateral
        is_done = share == 1 and np.array_equal(pushes, before)
        if is_done or _largest(rest) <= tolerance + ROUNDING * k * _largest(a):
            break
        step = system.solve(k * pushes.astype(float), rest)
        rate = system.openings(step)

        pull, stretch = f - k * opening, k * rate / SHARES
        start, slope = -(step * (system.load - system.mass * a)).sum(), (step * system.mass * step).sum() / SHARES
        place = bisect_left(
            range(SHARES), True, key=lambda n: start + n * slope > (rate * _forces(pull, n * stretch, bilateral)).sum()
        )
        share = place / SHARES
        a = a + share * step
    return a


class _System:
    """Columns as a sparse matrix, and systems of equations with it. mass, load: (rows,), by coordinate; least: (k,)."""

    def __init__(self, columns: Columns, mass: Floats, load: Floats, least: Floats | float) -> None:
        self.mass, self.load, self.least, d = mass.ravel(), load.ravel(), least, load.shape[1]
        has_second = columns.second != NONE
        ends = columns.first, np.where(has_second, columns.second, columns.first)
        self._row = np.concatenate([end[:, None] * d + np.arange(d) for end in ends], axis=1)  # (k, 2 d), coordinates
        push = np.stack([columns.x, columns.y, columns.turn], axis=1)
        signs = np.array([1, 1, -1]) * has_second[:, None]
        self._push = np.concatenate([-push[:, :d], (signs * push)[:, :d]], axis=1)  # on each of these, per force
        widest = int(np.abs(ends[0] - ends[1]).max(initial=0))  # discs, between two that touch
        self._size = d * max(widest, min(len(load), MIN_BLOCK))  # rows of a block

    def openings(self, v: Floats) -> Floats:
        """Return the rates at which columns open as the coordinates change at the rates v: (k,)."""
        return (self._push * v[self._row]).sum(axis=1)

    def pushed(self, force: Floats) -> Floats:
        """Return what forces of the columns do to the coordinates: (rows,)."""
        given = (force[:, None] * self._push).ravel()
        return np.bincount(self._row.ravel(), given, len(self.mass)).astype(np.float64)

    def solve(self, stiffness: Floats, right: Floats) -> Floats:
        """Return the solution for the matrix of the masses and the columns' springs, kg/s². right: (rows,).

        Discs that touch are in one block or in two that follow each other, so the blocks are eliminated in order.
        """
        size, rows = self._size, len(self.mass)
        blocks = -(-rows // size)
        row, column = np.broadcast_arrays(self._row[:, :, None], self._row[:, None, :])
        entry = stiffness[:, None, None] * self._push[:, :, None] * self._push[:, None, :]
        beside = column // size - row // size  # blocks to the right of the diagonal
        at = ((2 * (row // size) + beside) * size + row % size) * size + column % size
        upper = beside >= 0
        matrix = np.bincount(at[upper], entry[upper], 2 * blocks * size**2).reshape(blocks, 2, size, size) + 0.0
        own, next_ = matrix[:, 0], matrix[:, 1]
        padding = np.ones(blocks * size)
        padding[:rows] = self.mass
        own[:, np.arange(size), np.arange(size)] += padding.reshape(blocks, size)
        x: Floats = np.append(right, np.zeros(blocks * size - rows)).reshape(blocks, size)
        reduced = np.empty_like(next_)
        for k in range(blocks):
            if k > 0:
                own[k] -= next_[k - 1].T @ reduced[k - 1]
                x[k] -= next_[k - 1].T @ x[k - 1]
            solved = np.linalg.solve(own[k], np.concatenate([next_[k], x[k, :, None]], axis=1))
            reduced[k], x[k] = solved[:, :-1], solved[:, -1]
        for k in range(blocks - 2, -1, -1):
            x[k] -= reduced[k] @ x[k + 1]
        solution: Floats = x.ravel()[:rows]
        return solution


def _largest(values: Floats) -> float:
    return float(np.abs(values).max(initial=0.0))


def loose(columns: Columns, mass: Floats, force: Floats) -> Bools:
    """Return which discs can give way: (n,). force: (k,), with which the columns carry the load.

    A disc can give way if it can move with no contact that presses changing, and no other contact closing. With
    friction, discs can always roll on a floor together, and nothing drives them to; so there, with spins held, it must
    not move, and with spins free, no two discs that press may roll off each other: to second order that always sets
    potential energy free, by force / distance times the square of the motion across the normal.
    """
    presses = force > PRESSING * force.max(initial=0.0)
    moving = [np.abs(motion).max(axis=1) > MOVES for motion in _free_motions(columns, mass[:, :2], presses)]
    gives: Bools = moving[0] | moving[1]
    if mass.shape[1] == 2:
        return gives
    pairs = np.flatnonzero(presses & (columns.second != NONE))
    first, second, slope = columns.first[pairs], columns.second[pairs], columns.turn[pairs]
    nx, ny = columns.x[pairs] + slope * columns.y[pairs], columns.y[pairs] - slope * columns.x[pairs]
    for motion in _free_motions(columns, mass, presses):
        x, y = (motion[second] - motion[first])[:, :2].T
        rolls = np.abs(nx * y - ny * x) > MOVES
        gives[first[rolls]] = gives[second[rolls]] = True
    return gives


def _free_motions(columns: Columns, mass: Floats, presses: Bools) -> list[Floats]:
    """Return two motions that the contacts allow, those next to a random one and to its opposite: (n, dimensions).

    If there is any motion that they allow, one of the two is not zero, because only motions at right angles to it, or
    turned away from it, have none next to them.
    """
    anywhere = mass * np.random.default_rng(0).standard_normal(mass.shape)
    return [equilibrium(columns, mass, load, presses)[0] for load in (anywhere, -anywhere)]
