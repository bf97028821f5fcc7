"""The broad phase finds the same contacts as a test of all pairs i < j in order, to the bit."""

import math

import numpy as np
import pytest
from conftest import sizes
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.engines import article, create, impulse
from sandbox.engines.engine import advance
from sandbox.engines.grid import grid_for
from sandbox.scene.model import Scene
from sandbox.state import Floats, State, States

MODULES = {"article": article, "impulse": impulse}


def packed_balls(rng: np.random.Generator, n: int, eta: float, heaped: float) -> tuple[Floats, Floats]:
    """Return places of n balls of radius 5 in a box of which they would cover the fraction eta, and the box's size.

    heaped: the fraction of them that is in one heap. At eta 0.9 the others are a slightly disturbed lattice.
    """
    area, aspect = n * 25 * math.pi / eta, rng.uniform(0.2, 5)
    size = np.maximum([math.sqrt(area * aspect), math.sqrt(area / aspect)], 10.5)
    position = rng.uniform(5, size - 5, (n, 2))
    if eta > 0.85:
        columns = max(1, int(size[0] / 10))
        lattice = np.column_stack([np.arange(n) % columns, np.arange(n) // columns]) * 10 + 5.0
        position = np.clip(lattice + rng.normal(0, 0.05, (n, 2)), 5, size - 5)[rng.permutation(n)]
    heap = rng.random(n) < heaped
    position[heap] = np.clip(rng.normal(size / 3, 6, (heap.sum(), 2)), 5, size - 5)
    return position, size


def assert_equal_to_the_bit(name: str, scene: Scene, position: Floats, velocity: Floats, steps: int) -> None:
    """Assert that an engine does the same with its broad phase as if every pair were near."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MODULES[name].CODE, "is_due", lambda *_, **__: False)
        ends = []
        for _ in range(2):
            engine, states = create(name, scene, State(0.0, position, velocity)), States.empty(steps, len(position))
            engine.record_contacts()
            advance(engine, states)
            ends.append([*(part.tobytes() for part in states), engine.contacts().tobytes()])
            patch.setattr(MODULES[name], "next_neighbour", lambda _grid, _ball, _i, last, _reach: last + 1)
    assert ends[0] == ends[1]


@pytest.mark.parametrize("cases", sizes(100, slow=5_000))
@pytest.mark.parametrize("name", MODULES)
def test_an_engine_equals_brute_force(name: str, cases: int) -> None:
    """For `impulse`, balls of several radii, masses, elasticities, frictions and groups; gravity, and a wall."""

    @settings(max_examples=cases)
    @given(
        seed=st.integers(0, 2**32),
        n=st.integers(1, 70),
        eta=st.one_of(st.floats(0.005, 0.85), st.just(0.9)),
        heaped=st.sampled_from([0.0, 0.0, 0.1, 1.0]),
        pace=st.floats(0, 700),
    )
    def equals(seed: int, n: int, eta: float, heaped: float, pace: float) -> None:
        rng = np.random.default_rng(seed)
        position, size = packed_balls(rng, n, eta, heaped)
        arena = {"size": tuple(size.tolist())}
        scene = Scene(arena=arena, balls=[{"radius": 5, "position": at} for at in position.tolist()])
        if name == "impulse":
            kinds = zip(*(rng.uniform(low, high, n).tolist() for low, high in KINDS.values()), range(n), strict=True)
            balls = [
                dict(zip(KINDS, kind, strict=False), position=at, filter={"group": kind[-1] % 4})
                for at, kind in zip(position.tolist(), kinds, strict=True)
            ]
            wall = {"from": tuple(size * (0.1, 0.4)), "to": tuple(size * (0.7, 0.6)), "thickness": 4}
            scene = scene.changed(balls=balls, walls=[wall], gravity=tuple(rng.normal(0, 900, 2).tolist()))
        assert_equal_to_the_bit(name, scene, position, rng.normal(0, pace, (n, 2)), 4)

    equals()


KINDS = {"radius": (1, 5), "mass": (0.1, 10), "elasticity": (0.5, 1), "friction": (0, 1)}


@pytest.mark.parametrize("place", [math.nan, math.inf, -math.inf, 1e300, -5.0])
def test_a_ball_at_nan_or_infinity_is_in_a_cell_of_the_grid(place: float) -> None:
    position = np.full((30, 2), 50.0)
    scene = Scene(arena={"size": (400, 200)}, balls=[{"radius": 5, "position": at} for at in position.tolist()])
    position[7] = place
    assert_equal_to_the_bit("article", scene, position, np.zeros((30, 2)), 2)


@pytest.mark.parametrize("size", [(1e9, 50.0), (50.0, 1e9), (1e9, 1e9)])
def test_the_number_of_cells_is_bounded_by_the_number_of_balls(size: tuple[float, float]) -> None:
    """In a channel of 1e9 px, cells as wide as a ball would be 1e8."""
    assert len(grid_for(100, 10.0, size).cell) < 2000
