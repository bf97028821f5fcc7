"""The broad phase finds the same contacts as a test of all pairs i < j in order, to the bit."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from conftest import sizes
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.compiled import compiled
from sandbox.engines import article, impulse
from sandbox.engines.contact_log import empty_log
from sandbox.engines.neighbours import NeighbourGrid, new_grid
from sandbox.engines.stepped import BALL, balls_of
from sandbox.scene.walls import OUTWARD
from sandbox.state import MEETS_ALL, Bodies, Floats, States

Kernel = Callable[..., Any]
MOVING = ("x", "y", "vx", "vy", "angle", "spin")


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


def assert_equal_to_the_bit(steps: Kernel, state: list[Floats], frames: int, grid: NeighbourGrid | None) -> Floats:
    """Assert that steps(grid, ...) does the same with a grid as without one; return the positions after each step."""
    n = len(state[0])
    expected, found = States.empty(frames, n), States.empty(frames, n)
    start, room = (*state, np.zeros(n), np.linspace(-9, 9, n)), (n + 5) ** 2 * frames
    plain, quick = (empty_log(room)._replace(collects=True) for _ in range(2))
    done, count = steps(None, start, expected, plain)
    assert steps(grid, start, found, quick) == (done, count) == (frames, count)
    for part, by_brute_force in zip(found, expected, strict=True):
        assert part.tobytes() == by_brute_force.tobytes()
    assert quick.row[:count].tobytes() == plain.row[:count].tobytes()
    return found.position


def stepping(step: Kernel, world_on: Callable[[NeighbourGrid | None, Any], Any], ball: Any) -> Kernel:
    """Return a function that does steps as machine code with a grid or without one. world_on: of a grid and balls."""

    def steps(grid: NeighbourGrid | None, start: Any, states: States, log: Any) -> Any:
        world = world_on(grid, ball.copy())
        position, velocity, angle, spin = start
        for name, part in zip(MOVING, (*position.T, *velocity.T, angle, spin), strict=True):
            world.ball[name] = part
        for k in range(len(states.position)):
            compiled(step)(world, (k + 1) / 60, log)
            states.position[k], states.velocity[k] = (
                np.stack([world.ball[a], world.ball[b]], axis=1) for a, b in (("x", "y"), ("vx", "vy"))
            )
            states.angle[k], states.spin[k] = world.ball["angle"], world.ball["spin"]
        return len(states.position), log.filled[0]

    return steps


def article_frames(n: int, size: Sequence[float]) -> Kernel:
    def world_on(grid: NeighbourGrid | None, ball: Any) -> Any:
        return article.World(ball, 5.0, float(size[0]), float(size[1]), article.SQUARE, grid)

    return stepping(article.frame, world_on, np.zeros(n, BALL))


def article_grid(n: int, size: Sequence[float]) -> NeighbourGrid | None:
    return new_grid(n, 10 * article.MAX_TOUCHING, size)


def article_equals_brute_force(seed: int, n: int, eta: float, heaped: float, pace: float, frames: int) -> None:
    rng, position, size, _ = packed_balls(seed, n, eta, heaped)
    state = [position, rng.normal(0, pace, (n, 2))]
    assert_equal_to_the_bit(article_frames(n, size.tolist()), state, frames, article_grid(n, size.tolist()))


def impulse_equals_brute_force(
    seed: int, n: int, eta: float, heaped: float, pace: float, frames: int, spread: float
) -> None:
    """Balls of several radii, masses, elasticities, frictions and groups; gravity, and a wall across the box."""
    rng, position, size, far = packed_balls(seed, n, eta, heaped)
    radius, mass, elasticity = (rng.uniform(low, high, n) for low, high in ((5 * spread, 5), (0.1, 10), (0.5, 1)))
    w, h = size
    wall = np.zeros(5, impulse.WALL)  # the first four are the arena's
    wall["elasticity"], wall["friction"] = np.array([(1, 0), (1, 0.5), (0.9, 0), (1, 1), (0.8, 0.3)]).T
    (wall["nx"][:4], wall["ny"][:4]), wall["face"][:4] = OUTWARD.T, (0, 0, w, h)
    wall["across"] = w, h, w, h, np.inf
    wall[4]["x"], wall[4]["y"], wall[4]["end_x"], wall[4]["end_y"] = 0.1 * w, 0.4 * h, 0.7 * w, 0.6 * h
    wall[4]["half_thickness"] = 2
    wall["left"] = wall["top"] = -np.inf
    wall["right"] = wall["bottom"] = np.inf
    gravity, friction = rng.normal(0, 900, 2).tolist(), rng.uniform(0, 1, n)
    filters = np.tile(np.array(MEETS_ALL), (n, 1))
    filters[:, 0] = rng.integers(0, 4, n)
    ball = balls_of(Bodies(radius, mass, elasticity, friction, filters))
    state = [position, rng.normal(0, 60 * min(pace, far), (n, 2))]

    def world_on(grid: NeighbourGrid | None, ball: Any) -> Any:
        return impulse.World(ball, wall, filters, True, (gravity[0], gravity[1]), 1 / 60, grid)

    grid = new_grid(n, 2 * float(radius.max()), size.tolist())
    assert_equal_to_the_bit(stepping(impulse.step, world_on, ball), state, frames, grid)


@pytest.mark.parametrize("cases", sizes(100, slow=10_000))
@pytest.mark.parametrize(
    ("equals", "more"),
    [(article_equals_brute_force, {}), (impulse_equals_brute_force, {"spread": st.floats(0.1, 1)})],
    ids=["article", "impulse"],
)
def test_an_engine_equals_brute_force(equals: Kernel, more: dict[str, Any], cases: int) -> None:
    settings(max_examples=cases)(given(**CASES, **more)(equals))()


def test_a_ball_pushed_through_a_heap_meets_what_was_out_of_sight_at_first() -> None:
    """Each ball of a row overlaps the next by half of its width, so ball 0 is pushed far to where others wait."""
    n = 40
    rng = np.random.default_rng(1)
    position = np.column_stack([300 - 5.0 * np.arange(n) + rng.normal(0, 1, n), 100 + rng.normal(0, 2, n)])
    state = [np.maximum(position, 5), np.column_stack([np.linspace(-4, 4, n), np.zeros(n)])]
    positions = assert_equal_to_the_bit(article_frames(n, (400, 200)), state, 6, article_grid(n, (400, 200)))
    pushed = np.abs(positions[0] - state[0] - state[1]).max(axis=1)
    assert pushed.max() > 2  # so it had to look again


@pytest.mark.parametrize("place", [math.nan, math.inf, -math.inf, 1e300, -5.0])
def test_a_ball_at_nan_or_infinity_is_in_a_cell_of_the_grid(place: float) -> None:
    position = np.full((30, 2), 50.0)
    position[7] = place
    assert_equal_to_the_bit(
        article_frames(30, (400, 200)), [position, np.zeros((30, 2))], 2, article_grid(30, (400, 200))
    )


@pytest.mark.parametrize("size", [(1e9, 50.0), (50.0, 1e9), (1e9, 1e9)])
def test_the_number_of_cells_is_bounded_by_the_number_of_balls(size: tuple[float, float]) -> None:
    """In a channel of 1e9 px, cells as wide as a ball would be 1e8."""
    grid = new_grid(100, 10.0, size)
    assert grid is not None
    assert len(grid.grid.cell) < 2000
