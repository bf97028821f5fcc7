"""The broad phase finds the same contacts as a test of all pairs i < j in order, to the bit."""

import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np
import pytest
from conftest import sizes
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from sandbox.engines import article, impulse, neighbours
from sandbox.state import CONTACT, Floats

Kernel = Callable[..., Any]


def of_all_pairs(kernel: Any) -> Kernel:
    """Compile an engine's kernel without a grid for any number of balls: it then tests every pair."""

    def compiled(function: Any, **names: object) -> Kernel:
        function = function.py_func
        return njit(FunctionType(function.__code__, function.__globals__ | names))

    return compiled(kernel, neighbours=compiled(neighbours.neighbours, MIN_BALLS=10**9))


ARTICLE, IMPULSE = of_all_pairs(article.frame), of_all_pairs(impulse.advance)


def packed_balls(seed: int, n: int, eta: float, heaped: float) -> tuple[np.random.Generator, Floats, Floats, float]:
    """Place n balls of radius 5 in a box of which they would cover the fraction eta, some of them in one heap.

    At eta 0.9 they are a slightly disturbed lattice. Returns the generator, the positions, the box, its wider side.
    """
    rng = np.random.default_rng(seed)
    area, aspect = n * 25 * math.pi / eta, rng.uniform(0.2, 5)
    size = np.maximum([math.sqrt(area * aspect), math.sqrt(area / aspect)], 10.5)
    position = rng.uniform(5, size - 5, (n, 2))
    if eta > 0.85:
        columns = max(1, int(size[0] / 10))
        lattice = np.column_stack([np.arange(n) % columns, np.arange(n) // columns]) * 10 + 5.0
        position = np.clip(lattice + rng.normal(0, 0.05, (n, 2)), 5, size - 5)[rng.permutation(n)]
    heap = rng.random(n) < heaped
    position[heap] = np.clip(rng.normal(size / 3, 6, (heap.sum(), 2)), 5, size - 5)
    return rng, position, size, float(size.max())


CASES = {
    "seed": st.integers(0, 2**32),
    "n": st.integers(1, 150),
    "eta": st.one_of(st.floats(0.005, 0.85), st.just(0.9)),
    "heaped": st.sampled_from([0.0, 0.0, 0.1, 1.0]),
    "pace": st.floats(0, 12),
    "frames": st.integers(1, 5),
}


def assert_equal_to_the_bit(plain: Kernel, quick: Kernel, state: list[Floats], frames: int, *constants: object) -> None:
    expected, found = [array.copy() for array in state], [array.copy() for array in state]
    log, other = np.zeros(64, CONTACT), np.zeros(64, CONTACT)
    for _ in range(frames):
        log, count = plain(*expected, *constants, log)
        other, met = quick(*found, *constants, other)
        assert [array.tobytes() for array in found] == [array.tobytes() for array in expected]
        log["time"] = other["time"] = 0  # which a kernel leaves to its engine
        assert other[:met].tobytes() == log[:count].tobytes()


def article_equals_brute_force(seed: int, n: int, eta: float, heaped: float, pace: float, frames: int) -> None:
    rng, position, size, _ = packed_balls(seed, n, eta, heaped)
    state = [position, rng.normal(0, pace, (n, 2))]
    assert_equal_to_the_bit(ARTICLE, article.frame, state, frames, 5.0, *size.tolist(), article.SQUARE)


def impulse_equals_brute_force(
    seed: int, n: int, eta: float, heaped: float, pace: float, frames: int, spread: float
) -> None:
    """Balls of several radii, masses and elasticities; gravity, and a wall across the box."""
    rng, position, size, far = packed_balls(seed, n, eta, heaped)
    radius, mass, elasticity = (rng.uniform(low, high, n) for low, high in ((5 * spread, 5), (0.1, 10), (0.5, 1)))
    w, h = size
    arena = [(-1, 0, 0, 0, 0, 1), (0, -1, 0, 0, 0, 1), (1, 0, w, 0, 0, 0.9), (0, 1, h, 0, 0, 1)]
    walls = np.array([*arena, (0.1 * w, 0.4 * h, 0.7 * w, 0.6 * h, 2, 0.8)], float)
    constants = (radius, mass, elasticity, rng.normal(0, 900, 2), walls, 2 * float(radius.max()), 1 / 60)
    state = [position, rng.normal(0, 60 * min(pace, far), (n, 2))]
    assert_equal_to_the_bit(IMPULSE, impulse.advance, state, frames, *constants)


@pytest.mark.parametrize("cases", sizes(100, slow=10_000))
@pytest.mark.parametrize(
    ("equals", "more"),
    [(article_equals_brute_force, {}), (impulse_equals_brute_force, {"spread": st.floats(0.1, 1)})],
    ids=["article", "impulse"],
)
def test_an_engine_equals_brute_force(equals: Kernel, more: dict[str, Any], cases: int) -> None:
    settings(deadline=None, max_examples=cases)(given(**CASES, **more)(equals))()


def test_a_ball_pushed_through_a_heap_meets_what_was_out_of_sight_at_first() -> None:
    """Each ball of a row overlaps the next by half of its width, so ball 0 is pushed far to where others wait."""
    n = 40
    rng = np.random.default_rng(1)
    position = np.column_stack([300 - 5.0 * np.arange(n) + rng.normal(0, 1, n), 100 + rng.normal(0, 2, n)])
    state = [np.maximum(position, 5), np.column_stack([np.linspace(-4, 4, n), np.zeros(n)])]
    before = state[0].copy()
    assert_equal_to_the_bit(ARTICLE, article.frame, state, 6, 5.0, 400.0, 200.0, article.SQUARE)
    quick: Kernel = article.frame
    quick(*state, 5.0, 400.0, 200.0, article.SQUARE, np.zeros(64, CONTACT))
    pushed = np.abs(state[0] - before - state[1]).max(axis=1)
    assert pushed.max() > 10 * 2 * neighbours.SLACK  # so it had to look again


@pytest.mark.parametrize("place", [math.nan, math.inf, -math.inf, 1e300, -5.0])
def test_a_ball_at_nan_or_infinity_is_in_a_cell_of_the_grid(place: float) -> None:
    position = np.full((30, 2), 50.0)
    position[7] = place
    state = [position, np.zeros((30, 2))]
    assert_equal_to_the_bit(ARTICLE, article.frame, state, 2, 5.0, 400.0, 200.0, article.SQUARE)


@pytest.mark.parametrize("size", [(1e9, 50.0), (50.0, 1e9), (1e9, 1e9)])
def test_the_number_of_cells_is_bounded_by_the_number_of_balls(size: tuple[float, float]) -> None:
    """In a channel of 1e9 px, cells as wide as a ball would be 1e8."""
    position = np.random.default_rng(0).uniform(0, 50, (100, 2))
    found: neighbours.Neighbours = neighbours.neighbours(position, 10.0, *size)
    assert len(found.first) < 2000
