"""Statics: the forces with which touching discs and walls carry a load, and whether they can carry it.

By Gauss's principle, of all accelerations a that contacts allow, bodies have those with the least
(a - w/m)' m (a - w/m) / 2, where w is the load. With contacts as stiff springs that only push, this is the least of

    a' m a / 2 - w' a + sum over contacts c of max(0, f_c - k b_c' a)² / (2 k),

where b_c' a is the acceleration at which contact c opens and k the stiffness. Its forces are max(0, f_c - k b_c' a),
and with these as the new f, the next minimum is nearer to that of rigid contacts (method of multipliers: D. P.
Bertsekas, Constrained Optimization and Lagrange Multiplier Methods, 1982). Each is found by Newton's method: the
function is quadratic in pieces, so with an exact line search it ends after finitely many steps. The matrix is as sparse
as the contacts. Its Cholesky factor is stored by rows, each from its first entry on (an envelope: A. George and J. W.
Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981), with discs sorted along the longer side of a
heap.

Coordinates of a disc: x, y and, with friction, r times its angle, whose mass is m/2. A contact without friction has one
column, its normal n; with friction mu it has two, the edges n + mu t and n - mu t of the friction cone.
"""

from typing import Final, NamedTuple

import numpy as np

from sandbox.compiled import entry, kernel
from sandbox.engines.exact.records import NONE
from sandbox.state import Bools, Floats, Integers

STIFFNESS: Final = 1e8  # of the springs, mean mass / s²; stiffer ones would leave too few digits of the matrix
MAX_NEWTON: Final = 200  # steps of Newton's method, which ends after finitely many
MAX_UPDATES: Final = 100  # of the forces; an arch that is nearly flat needs some 50
CONVERGED: Final = 1e-13  # of the largest load: a change of the forces that is rounding
ROUNDING: Final = 3e-16  # of stiffness times acceleration, likewise
PRESSING: Final = 1e-9  # of the largest force: a smaller one is rounding
MOVES: Final = 1e-4  # of a random motion: what is left of it in a direction in which a disc can move
LINE_STEPS: Final = 60  # of the line search


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


class Envelope(NamedTuple):
    """A symmetric matrix, of which each row is stored from its first entry to the diagonal.

    low: (rows,) column of the first entry; start: (rows + 1,) where in `value` the row begins.
    """

    low: Integers
    start: Integers
    value: Floats


def _envelope(columns: Columns, count: int, dimensions: int) -> Envelope:
    """Return a matrix that has an entry for any two discs that touch."""
    lowest = np.arange(count)
    pairs = columns.second != NONE
    first, second = columns.first[pairs], columns.second[pairs]
    np.minimum.at(lowest, np.maximum(first, second), np.minimum(first, second))
    low = np.repeat(lowest * dimensions, dimensions)
    start = np.concatenate([[0], np.cumsum(np.arange(count * dimensions) - low + 1)])
    return Envelope(low, start, np.empty(start[-1]))


class Problem(NamedTuple):
    """Columns, and what they must carry. mass, load: (rows,), by coordinate; dimensions: coordinates of a disc."""

    columns: Columns
    bilateral: Bools
    mass: Floats
    load: Floats
    dimensions: int


class Search(NamedTuple):
    """Memory of Newton's method.

    step: (rows,); opening, rate: (k,), of the columns now and along the step; pushes: (k,), whether the matrix has the
    column's spring.
    """

    matrix: Envelope
    step: Floats
    opening: Floats
    rate: Floats
    pushes: Bools


def equilibrium(
    columns: Columns, mass: Floats, load: Floats, force: Floats, bilateral: Bools, stiffness: float | None = None
) -> tuple[Floats, Floats]:
    """Return the accelerations under a load, like `load`, and the forces of the columns, like `force`.

    mass, load: (n, 2 or 3), by coordinate; force: (k,), from which the search starts; bilateral: (k,), whether the
    column also pulls; stiffness: kg/s², of the springs, STIFFNESS times the mean mass by default. Fast if the discs are
    sorted along a line.
    """
    if stiffness is None:
        stiffness = STIFFNESS * float(mass[:, 0].mean())
    a, f, k = np.zeros(load.size), force.copy(), len(force)
    problem = Problem(columns, bilateral, mass.ravel(), load.ravel(), load.shape[1])
    search = Search(_envelope(columns, *load.shape), np.empty(a.size), np.empty(k), np.empty(k), np.empty(k, bool))
    _solve(problem, stiffness, search, a, f)
    return a.reshape(load.shape), f


def pushed(columns: Columns, force: Floats, count: int) -> Floats:
    """Return what forces of the columns, (k,), do to each of the discs, of which there are `count`: (count, 2)."""
    total, pairs = np.zeros((count, 2)), columns.second != NONE
    push = force[:, None] * np.stack([columns.x, columns.y], axis=1)
    np.subtract.at(total, columns.first, push)
    np.add.at(total, columns.second[pairs], push[pairs])
    return total


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
    nothing = np.zeros(len(columns.x))
    return [equilibrium(columns, mass, load, nothing, presses)[0] for load in (anywhere, -anywhere)]


@kernel
def _opening(columns: Columns, c: int, v: Floats, d: int) -> float:
    """Return the rate at which column c opens if the discs' coordinates change at the rates v, d for each disc."""
    i, j = columns.first[c] * d, columns.second[c] * d
    rate = -columns.x[c] * v[i] - columns.y[c] * v[i + 1]
    if d == 3:
        rate -= columns.turn[c] * v[i + 2]
    if j >= 0:
        rate += columns.x[c] * v[j] + columns.y[c] * v[j + 1]
        if d == 3:
            rate -= columns.turn[c] * v[j + 2]
    return rate


@kernel
def _push(columns: Columns, c: int, force: float, total: Floats, d: int) -> None:
    """Add what a force of column c does to the forces on the discs' coordinates."""
    i, j = columns.first[c] * d, columns.second[c] * d
    x, y, turn = force * columns.x[c], force * columns.y[c], force * columns.turn[c]
    total[i] -= x
    total[i + 1] -= y
    if d == 3:
        total[i + 2] -= turn
    if j >= 0:
        total[j] += x
        total[j + 1] += y
        if d == 3:
            total[j + 2] -= turn


@kernel
def _add_spring(columns: Columns, c: int, stiffness: float, matrix: Envelope, d: int) -> None:
    """Add the spring of column c to the matrix."""
    i, j = columns.first[c], columns.second[c]
    to_i = (-columns.x[c], -columns.y[c], -columns.turn[c])
    to_j = (columns.x[c], columns.y[c], -columns.turn[c])
    for p in range(d):
        row = i * d + p
        for q in range(p + 1):
            matrix.value[matrix.start[row] + i * d + q - matrix.low[row]] += stiffness * to_i[p] * to_i[q]
        if j < 0:
            continue
        row = j * d + p
        for q in range(p + 1):
            matrix.value[matrix.start[row] + j * d + q - matrix.low[row]] += stiffness * to_j[p] * to_j[q]
        for q in range(d):
            if i < j:
                matrix.value[matrix.start[row] + i * d + q - matrix.low[row]] += stiffness * to_j[p] * to_i[q]
            else:
                row_i = i * d + p
                matrix.value[matrix.start[row_i] + j * d + q - matrix.low[row_i]] += stiffness * to_i[p] * to_j[q]


@kernel
def _dot(a: Floats, i: int, b: Floats, j: int, count: int) -> float:
    """Return the scalar product of parts of two arrays. Four sums, because one would wait for itself."""
    s0 = s1 = s2 = s3 = 0.0
    k = 0
    while k + 4 <= count:
        s0 += a[i + k] * b[j + k]
        s1 += a[i + k + 1] * b[j + k + 1]
        s2 += a[i + k + 2] * b[j + k + 2]
        s3 += a[i + k + 3] * b[j + k + 3]
        k += 4
    while k < count:
        s0 += a[i + k] * b[j + k]
        k += 1
    return (s0 + s1) + (s2 + s3)


@kernel
def _factorise(matrix: Envelope) -> None:
    """Replace a positive definite matrix by its Cholesky factor."""
    low, start, value = matrix
    for row in range(len(low)):
        for column in range(low[row], row):
            shared = max(low[row], low[column])
            before = _dot(
                value, start[row] + shared - low[row], value, start[column] + shared - low[column], column - shared
            )
            at = start[row] + column - low[row]
            value[at] = (value[at] - before) / value[start[column + 1] - 1]
        diagonal = start[row + 1] - 1
        before = _dot(value, start[row], value, start[row], diagonal - start[row])
        value[diagonal] = np.sqrt(value[diagonal] - before)


@kernel
def _divide(matrix: Envelope, x: Floats) -> None:
    """Replace a vector by the solution of the factorised matrix's system with it on the right."""
    low, start, value = matrix
    for row in range(len(low)):
        before = _dot(value, start[row], x, low[row], row - low[row])
        x[row] = (x[row] - before) / value[start[row + 1] - 1]
    for row in range(len(low) - 1, -1, -1):
        x[row] /= value[start[row + 1] - 1]
        for column in range(low[row], row):
            x[column] -= x[row] * value[start[row] + column - low[row]]


@kernel
def _largest(x: Floats) -> float:
    largest = 0.0
    for value in x:
        largest = max(largest, abs(value))
    return largest


@kernel
def _push_of(problem: Problem, f: Floats, stiffness: float, opening: float, c: int) -> float:
    """Return the force of column c, which opens at a rate."""
    push = f[c] - stiffness * opening
    return push if push > 0 or problem.bilateral[c] else 0.0


@kernel
def _factorise_springs(problem: Problem, stiffness: float, search: Search) -> None:
    """Factorise the matrix of the masses and of the columns that push."""
    matrix, d = search.matrix, problem.dimensions
    matrix.value[:] = 0.0
    for row in range(len(problem.mass)):
        matrix.value[matrix.start[row + 1] - 1] = problem.mass[row]
    for c in range(len(search.pushes)):
        if search.pushes[c]:
            _add_spring(problem.columns, c, stiffness, matrix, d)
    _factorise(matrix)


@kernel
def _derivative(problem: Problem, f: Floats, stiffness: float, search: Search, a: Floats, t: float) -> float:
    """Return the derivative of the function along the step, a share t of it on."""
    total = 0.0
    for k in range(len(a)):
        total += search.step[k] * (problem.mass[k] * (a[k] + t * search.step[k]) - problem.load[k])
    for c in range(len(f)):
        total -= search.rate[c] * _push_of(problem, f, stiffness, search.opening[c] + t * search.rate[c], c)
    return total


@kernel
def _share_of_step(problem: Problem, f: Floats, stiffness: float, search: Search, a: Floats) -> float:
    """Return the share of the step at which the function is least, at most 1."""
    if _derivative(problem, f, stiffness, search, a, 1.0) <= 0:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(LINE_STEPS):
        middle = (low + high) / 2
        if _derivative(problem, f, stiffness, search, a, middle) > 0:
            high = middle
        else:
            low = middle
    return high


@kernel
def _minimise(problem: Problem, f: Floats, stiffness: float, search: Search, a: Floats, tolerance: float) -> None:
    """Find the least a for the multipliers f. tolerance: kg px/s², of the sum of forces."""
    columns, d = problem.columns, problem.dimensions
    share = 0.0
    for attempt in range(MAX_NEWTON):
        is_new = attempt == 0
        for k in range(len(a)):
            search.step[k] = problem.load[k] - problem.mass[k] * a[k]
        for c in range(len(f)):
            search.opening[c] = _opening(columns, c, a, d)
            push = _push_of(problem, f, stiffness, search.opening[c], c)
            _push(columns, c, push, search.step, d)
            pushes = push > 0 or problem.bilateral[c]
            is_new = is_new or pushes != search.pushes[c]
            search.pushes[c] = pushes
        if _largest(search.step) <= tolerance + ROUNDING * stiffness * _largest(a) or (share == 1 and not is_new):
            return
        if is_new:
            _factorise_springs(problem, stiffness, search)
        _divide(search.matrix, search.step)
        for c in range(len(f)):
            search.rate[c] = _opening(columns, c, search.step, d)
        share = _share_of_step(problem, f, stiffness, search, a)
        for k in range(len(a)):
            a[k] += share * search.step[k]


@entry
def _solve(problem: Problem, stiffness: float, search: Search, a: Floats, f: Floats) -> None:
    """Find a, (rows,), and f, (k,), from those given."""
    tolerance = CONVERGED * _largest(problem.load)
    for _ in range(MAX_UPDATES):
        _minimise(problem, f, stiffness, search, a, tolerance)
        change = 0.0
        for c in range(len(f)):
            push = _push_of(problem, f, stiffness, _opening(problem.columns, c, a, problem.dimensions), c)
            change = max(change, abs(push - f[c]))
            f[c] = push
        if change <= tolerance + ROUNDING * stiffness * _largest(a):
            break
