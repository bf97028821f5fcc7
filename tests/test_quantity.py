"""Energy, momentum, overlap and distance, compared with explicit sums and searches."""

import math

import numpy as np
import pytest
from conftest import ball_at, scene_of
from hypothesis import given
from hypothesis import strategies as st

from sandbox.quantity import deepest_overlap, energy, kinetic_energy, length, momentum, overlaps, potential_energy
from sandbox.scene.spawn import spawn
from sandbox.scene.walls import segment_distance
from sandbox.state import Floats, States

coordinate = st.floats(-1e3, 1e3).map(lambda x: round(x, 6))
vector = st.tuples(coordinate, coordinate)
moving = st.lists(st.tuples(vector, vector, st.floats(1e-3, 1e3)), min_size=1, max_size=8)  # position, velocity, mass
Moving = list[tuple[tuple[float, float], tuple[float, float], float]]


def arrays(balls: Moving) -> tuple[Floats, Floats, Floats]:
    position, velocity, mass = zip(*balls, strict=True)
    return np.array(position), np.array(velocity), np.array(mass)


@given(balls=moving)
def test_kinetic_energy_and_momentum_are_the_sums_over_the_balls(balls: Moving) -> None:
    _, velocity, mass = arrays(balls)
    expected = math.fsum(m * (vx * vx + vy * vy) / 2 for _, (vx, vy), m in balls)
    assert float(kinetic_energy(velocity, mass)) == pytest.approx(expected, rel=1e-13)
    size = math.fsum(m * (abs(vx) + abs(vy)) for _, (vx, vy), m in balls)
    total = [math.fsum(m * v[axis] for _, v, m in balls) for axis in (0, 1)]
    assert momentum(velocity, mass) == pytest.approx(total, abs=1e-13 * size)


@given(balls=moving, gravity=vector, size=st.tuples(st.floats(1, 1e3), st.floats(1, 1e3)))
def test_potential_energy_is_the_work_gravity_has_left_to_do(
    balls: Moving, gravity: tuple[float, float], size: tuple[float, float]
) -> None:
    position, _, mass = arrays(balls)
    lowest = [size[axis] if gravity[axis] > 0 else 0 for axis in (0, 1)]
    terms = [m * gravity[k] * (lowest[k] - x[k]) for x, _, m in balls for k in (0, 1)]
    scale = math.fsum(m * abs(gravity[k]) * (lowest[k] + abs(x[k])) for x, _, m in balls for k in (0, 1))
    assert float(potential_energy(position, mass, gravity, size)) == pytest.approx(math.fsum(terms), abs=1e-13 * scale)


def test_energy_does_not_change_along_a_parabola() -> None:
    scene = scene_of(
        ball_at(100, 50, vx=20, vy=-30, radius=5, mass=3), ball_at(200, 500, vx=-7, radius=5), more="gravity = [4, 90]"
    )
    start, gravity = spawn(scene), np.array([4.0, 90.0])
    time = np.linspace(0, 2, 9)[:, None, None]
    position = start.position + time * start.velocity + time**2 * gravity / 2
    velocity = start.velocity + time * gravity
    still = np.zeros((9, 2))
    total = energy(States(position, velocity, still, still), scene.bodies, scene.gravity, scene.arena.size)
    assert total.shape == (9,)
    # by hand: 3/2 (20² + 30²) + 1/2 7² and 3 (4 · 700 + 90 · 550) + (4 · 600 + 90 · 100)
    assert total == pytest.approx(np.full(9, 1950 + 24.5 + 156_900 + 11_400), rel=1e-13)


def test_length() -> None:
    assert length(np.array([[3.0, -4.0], [0, 0], [3e200, 4e200]])).tolist() == pytest.approx([5, 0, 5e200], rel=1e-15)


discs = st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100), st.floats(0.5, 30)), min_size=1, max_size=14)


@given(balls=discs, wide=st.booleans())
def test_the_deepest_overlap_equals_that_of_all_pairs(balls: list[tuple[float, float, float]], wide: bool) -> None:
    x, y, radius = np.array(balls).T
    position = np.column_stack([x * 5, y] if wide else [x, y * 5])  # swept along either axis
    depths = {
        (i, j): radius[i] + radius[j] - math.dist(position[i], position[j])
        for i in range(len(balls))
        for j in range(i + 1, len(balls))
    }
    pairs = sum(overlap > 0 for overlap in depths.values())
    if all(abs(overlap) > 1e-9 for overlap in depths.values()):
        assert sum(len(some) for some, _, _ in overlaps(position[None], radius, None)) == pairs
    found, first, second = deepest_overlap(position, radius)
    deepest = max(depths.values(), default=0.0)
    if deepest > 1e-9:
        assert found == pytest.approx(deepest, rel=1e-12, abs=1e-12)
        assert depths[first, second] == pytest.approx(deepest, rel=1e-12, abs=1e-12)
    elif deepest < -1e-9 or len(balls) == 1:
        assert (found, first, second) == (0.0, -1, -1)


def test_touching_balls_do_not_overlap_and_coincident_balls_overlap_by_a_diameter() -> None:
    radius = np.array([20.0, 20.0])
    assert deepest_overlap(np.array([[100.0, 50.0], [140.0, 50.0]]), radius) == (0.0, -1, -1)
    assert deepest_overlap(np.array([[100.0, 50.0], [100.0, 50.0]]), radius) == (40.0, 0, 1)


@given(st.integers(0, 2**32 - 1))
def test_the_deepest_overlap_of_several_states_is_that_of_the_worst(seed: int) -> None:
    random = np.random.default_rng(seed)
    states, radius = (
        random.uniform(0, 200, (4, 12, 2)) * random.choice([1.0, 3.0], (4, 1, 2)),
        random.uniform(5, 20, 12),
    )
    of_each = [deepest_overlap(position, radius) for position in states]
    assert deepest_overlap(states, radius) == max(of_each, key=lambda deepest: deepest[0])


@given(point=vector, start=vector, end=vector)
def test_segment_distance_is_the_least_along_the_segment(
    point: tuple[float, float], start: tuple[float, float], end: tuple[float, float]
) -> None:
    if start == end:
        end = (start[0] + 1, start[1])

    def distance(share: float) -> float:
        return math.dist(point, [a + share * (b - a) for a, b in zip(start, end, strict=True)])

    low, high = 0.0, 1.0
    for _ in range(120):  # the distance is convex along the segment: a ternary search cannot miss its minimum
        third = (high - low) / 3
        low, high = (low, high - third) if distance(low + third) < distance(high - third) else (low + third, high)
    expected = min(distance(low), distance(0), distance(1))
    assert float(segment_distance(np.array(point), start, end)) == pytest.approx(expected, abs=1e-6)


def test_segment_distance_beside_and_beyond_the_ends() -> None:
    points = np.array([[[5.0, 3.0], [13.0, 4.0]], [[-3.0, -4.0], [10.0, 0.0]]])
    assert segment_distance(points, (0, 0), (10, 0)).tolist() == [[3, 5], [5, 0]]
