"""The initial state of a scene."""

import math
import random
import re

import numpy as np
import pytest
from conftest import scene_of
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from sandbox.errors import SandboxError
from sandbox.quantity import deepest_overlap
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn, warnings
from sandbox.state import Floats

ANYWHERE = "x = { from = 100, to = 700 }\ny = { from = 100, to = 500 }"


def closest(position: Floats, radius: Floats) -> float:
    """Return the smallest gap between two discs, px, over every pair."""
    return min(
        (
            math.dist(position[i], position[j]) - radius[i] - radius[j]
            for i in range(len(radius))
            for j in range(i + 1, len(radius))
        ),
        default=math.inf,
    )


def gap_to_wall(position: Floats, radius: float, start: tuple[float, float], end: tuple[float, float]) -> float:
    """Return the smallest gap between a disc and a line, px, over points of the line."""
    along = np.linspace(start, end, 2001)
    distance = np.hypot(*(position[:, None, :] - along[None, :, :]).transpose(2, 0, 1))
    return float(distance.min()) - radius


# --- Drawn one by one ------------------------------------------------------------------------------------------


@given(seed=st.integers(0, 2**64), count=st.integers(1, 40))
def test_seed_k_starts_as_the_article_does_after_seeding_with_k(seed: int, count: int) -> None:
    article = load("article")
    group = article.balls[0].model_copy(update={"count": count})
    state = spawn(article.model_copy(update={"seed": seed, "balls": (group,)}))
    rng = random.Random(seed)
    for position, velocity in zip(state.position, state.velocity, strict=True):
        assert position.tolist() == [rng.randint(20, 780), rng.randint(20, 580)]
        assert velocity.tolist() == [rng.randint(1, 3) * 2 * 60, rng.randint(1, 3) * -2 * 60]
    assert state.time == 0


def test_one_generator_serves_all_groups_in_order() -> None:
    scene = scene_of(
        f"radius = 5\ncount = 2\n{ANYWHERE}\nvy = {{ from = -3, to = 4 }}",
        "radius = 5\nposition = [50, 50]\nvx = { from = 5, to = 5 }\nvy = { from = 1, to = 9, step = 4 }",
        f"radius = 5\n{ANYWHERE}",
        more="seed = 12",
    )
    state = spawn(scene)
    rng = random.Random(12)
    expected = []
    for _ in range(2):
        x, y = rng.uniform(100, 700), rng.uniform(100, 500)
        expected.append([x, y, 0, rng.uniform(-3, 4)])
    expected.append([50, 50, rng.uniform(5, 5), rng.randrange(1, 13, 4)])
    expected.append([rng.uniform(100, 700), rng.uniform(100, 500), 0, 0])
    assert np.hstack([state.position, state.velocity]).tolist() == expected


# --- Grid ------------------------------------------------------------------------------------------------------


@given(
    columns=st.integers(1, 12),
    rows=st.integers(1, 12),
    spacing=st.floats(20, 40),
    width=st.floats(500, 900),
    height=st.floats(500, 900),
)
def test_a_grid_is_centred(columns: int, rows: int, spacing: float, width: float, height: float) -> None:
    group = f"radius = 10\ngrid = [{columns}, {rows}]\nspacing = {spacing!r}"
    position = spawn(scene_of(group, size=f"[{width!r}, {height!r}]")).position
    assert position.mean(axis=0) == pytest.approx([width / 2, height / 2], rel=1e-12)
    extent = position.max(axis=0) - position.min(axis=0)
    assert extent == pytest.approx([(columns - 1) * spacing, (rows - 1) * spacing], abs=1e-9)


def test_a_grid_at_a_position_and_partly_filled() -> None:
    state = spawn(scene_of("radius = 10\ngrid = [2, 2]\nspacing = 25.5\nposition = [60, 70]\ncount = 3"))
    assert state.position.tolist() == [[60, 70], [85.5, 70], [60, 95.5]]


# --- Inside ----------------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(
    radius=st.floats(3, 30),
    count=st.integers(1, 60),
    width=st.floats(61, 300),
    height=st.floats(61, 300),
    seed=st.integers(0, 1000),
    wall=st.booleans(),
)
def test_packed_balls_do_not_overlap(
    radius: float, count: int, width: float, height: float, seed: int, wall: bool
) -> None:
    walls = f"[[walls]]\nfrom = [50, 50]\nto = [{50 + width!r}, {50 + height!r}]\nthickness = 6\n" if wall else ""
    try:
        scene = parse(
            f"seed = {seed}\n[arena]\nsize = [400, 400]\n[[balls]]\nradius = {radius!r}\ncount = {count}\n"
            f"inside = [[50, 50], [{50 + width!r}, {50 + height!r}]]\n{walls}",
            "mine.toml",
        )
        position = spawn(scene).position
    except SandboxError as error:
        assert " there is no room for " in str(error)  # noqa: PT017 - the only possible error
        assume(False)
        return
    assert position.shape == (count, 2)
    assert (position.min(axis=0) >= 50 + radius).all()
    assert (position.max(axis=0) <= np.array([50 + width, 50 + height]) - radius + 1e-9).all()
    assert closest(position, scene.bodies.radius) >= -1e-9
    if wall:
        assert gap_to_wall(position, radius, (50, 50), (50 + width, 50 + height)) >= 3 - 1e-9


@pytest.mark.parametrize("share", [0.05, 0.3, 0.5, 0.6, 0.7, 0.8])
@pytest.mark.parametrize("seed", range(3))
def test_balls_fit_inside_up_to_four_fifths_of_the_area(share: float, seed: int) -> None:
    count = int(share * 400**2 / (math.pi * 10**2))
    state = spawn(scene_of(f"radius = 10\ncount = {count}\ninside = [[0, 0], [400, 400]]", more=f"seed = {seed}"))
    assert len(state.position) == count
    assert closest(state.position, np.full(count, 10.0)) >= 0
    assert state.position.min() >= 10
    assert state.position.max() <= 390 + 1e-9


def test_a_lattice_is_shuffled() -> None:
    group = "radius = 10\ncount = 300\ninside = [[0, 0], [400, 400]]"
    first, second = (spawn(scene_of(group, more=f"seed = {seed}")).position for seed in (1, 2))
    in_order = first[np.lexsort((first[:, 0], first[:, 1]))]
    assert not np.array_equal(first, in_order)
    assert not np.array_equal(first, second)


def test_balls_inside_do_not_overlap_earlier_groups_of_any_size() -> None:
    scene = scene_of(
        "radius = 100\nposition = [400, 300]",
        "radius = 3\ncount = 100\ninside = [[250, 150], [550, 450]]",
        "radius = 12\ncount = 8\ninside = [[250, 150], [550, 450]]",
    )
    state = spawn(scene)
    assert closest(state.position, scene.bodies.radius) >= 0


def test_a_row_of_balls_that_fits_exactly() -> None:
    position = spawn(scene_of("radius = 5\ncount = 10\ninside = [[0, 0], [100, 10]]")).position
    assert sorted(position[:, 0]) == pytest.approx([5 + 10 * ball for ball in range(10)], abs=1e-6)


NO_ROOM = {
    "among walls": (
        "[800, 600]",
        "radius = 5\ninside = [[0, 0], [100, 20]]\ncount = 5",
        "[[walls]]\nfrom = [0, 10]\nto = [100, 10]",
        ":6: balls[0].count is too large: there is no room for 5",
    ),
    "among earlier ones": (
        "[100, 100]",
        "radius = 40\nposition = [50, 50]",
        "[[balls]]\nradius = 10\ncount = 20\ninside = [[0, 0], [100, 100]]",
        ":8: balls[1].count is too large: there is no room for 20",
    ),
}


@pytest.mark.parametrize(("size", "group", "more", "message"), NO_ROOM.values(), ids=NO_ROOM)
def test_too_many_balls_are_an_error(size: str, group: str, more: str, message: str) -> None:
    scene = parse(f"[arena]\nsize = {size}\n[[balls]]\n{group}\n{more}\n", "mine.toml")
    with pytest.raises(SandboxError) as refused:
        spawn(scene)
    assert str(refused.value) == f"mine.toml{message}"


@pytest.mark.slow
def test_no_room_is_an_error_however_small_the_balls() -> None:
    scene = scene_of("radius = 200\nposition = [400, 300]", "radius = 1e-6\ninside = [[300, 200], [500, 400]]")
    with pytest.raises(SandboxError, match=r"balls\[1\]\.count is too large: there is no room for 1$"):
        spawn(scene)


def test_a_dense_group_finds_room_among_larger_and_smaller_balls() -> None:
    scene = scene_of(
        "radius = 100\nposition = [400, 300]",
        "radius = 0.001\ncount = 5000\ninside = [[0, 0], [800, 600]]",
        "radius = 1\ncount = 20000\ninside = [[0, 0], [800, 600]]",
        "radius = 3\ncount = 40\ninside = [[0, 0], [800, 600]]",
    )
    state = spawn(scene)
    assert deepest_overlap(state.position, scene.bodies.radius) == (0.0, -1, -1)


# --- Thrown at random ------------------------------------------------------------------------------------------


def thrown(throw: str, seed: int, count: int = 2000) -> Floats:
    return spawn(scene_of(f"radius = 1\ncount = {count}\n{ANYWHERE}\n{throw}", more=f"seed = {seed}")).velocity


@pytest.mark.parametrize("seed", range(3))
def test_a_speed_has_uniform_directions(seed: int) -> None:
    velocity = thrown("speed = 250", seed)
    assert np.hypot(*velocity.T) == pytest.approx(np.full(2000, 250), rel=1e-14)
    # Kolmogorov: sqrt(n) sup |F - uniform| exceeds 1.95 once in a thousand
    angle = np.sort(np.arctan2(velocity[:, 1], velocity[:, 0]) / (2 * math.pi) % 1)
    assert math.sqrt(2000) * np.abs(angle - (np.arange(2000) + 0.5) / 2000).max() < 1.95
    # successive directions are independent: their correlation is ~1/sqrt(n)
    assert abs(np.corrcoef(velocity[:-1, 0], velocity[1:, 0])[0, 1]) < 4 / math.sqrt(2000)


@pytest.mark.parametrize("seed", range(3))
def test_rms_speed_is_a_maxwell_distribution_in_the_plane(seed: int) -> None:
    velocity = thrown("rms_speed = 200", seed)
    squared = (velocity**2).sum(axis=1) / 200**2  # exponential, mean 1, standard deviation 1
    assert squared.mean() == pytest.approx(1, abs=4 / math.sqrt(2000))
    assert (squared > 1).mean() == pytest.approx(math.exp(-1), abs=4 * math.sqrt(0.233 / 2000))
    assert velocity.mean(axis=0) == pytest.approx([0, 0], abs=4 * 200 / math.sqrt(2 * 2000))
    assert velocity.std(axis=0) == pytest.approx(np.full(2, 200 / math.sqrt(2)), rel=4 / math.sqrt(2 * 2000))
    assert abs(np.corrcoef(*velocity.T)[0, 1]) < 4 / math.sqrt(2000)


# --- Warnings --------------------------------------------------------------------------------------------------


def warnings_of(scene: Scene) -> list[str]:
    return list(warnings(scene, spawn(scene)))


def test_overlapping_balls_cause_a_warning_about_the_deepest_pair() -> None:
    scene = scene_of(
        "radius = 5\nposition = [300, 100]",
        "radius = 5\nposition = [309, 100]",
        "radius = 20\nposition = [100, 100]",
        "radius = 5\nposition = [100, 117.5]",
    )
    assert warnings_of(scene) == ["test.toml: warning: 2 overlaps at the start, the deepest of balls 2 and 3 by 7.5 px"]


@pytest.mark.parametrize(
    "group",
    [
        "radius = 5\ngrid = [20, 10]\nspacing = 10",
        "radius = 4\nposition = [300, 300]\nvelocity = [240, 0]",
        "radius = 5\nposition = [100, 107]\n[[walls]]\nfrom = [0, 100]\nto = [200, 100]\nthickness = 4",
    ],
    ids=["touching balls", "moves by its radius", "touching a wall"],
)
def test_the_limit_of_a_warning_causes_none(group: str) -> None:
    assert warnings_of(scene_of(group)) == []


# --- In walls ----------------------------------------------------------------------------------------------------

IN_A_WALL = (
    "[arena]\nsize = [800, 600]{overlap}\n[[balls]]\nradius = 5\nposition = [100, 106]\n"
    "[[balls]]\nradius = 5\nposition = [150, 104]\n"
    "[[walls]]\nfrom = [0, 500]\nto = [200, 500]\n"
    "[[walls]]\nfrom = [0, 100]\nto = [200, 100]\nthickness = 4\n"
)


def test_balls_in_a_wall_are_refused_with_their_lines() -> None:
    with pytest.raises(SandboxError) as refused:
        spawn(parse(IN_A_WALL.format(overlap=""), "mine.toml"))
    reason = "into wall 1: its centre must be at least 7 px from the wall's centre line"
    advice = "(or allow it with overlap in [arena])"
    assert str(refused.value).splitlines() == [
        f"mine.toml:5: balls[0].position puts a ball {reason}, got 6 {advice}",
        f"mine.toml:8: balls[1].position puts a ball {reason}, got 4 {advice}",
    ]


def test_the_overlap_of_the_arena_allows_balls_in_walls() -> None:
    assert warnings_of(parse(IN_A_WALL.format(overlap="\noverlap = 3"), "mine.toml")) == []
    with pytest.raises(SandboxError, match="puts a ball into wall 1"):
        spawn(parse(IN_A_WALL.format(overlap="\noverlap = 2.9"), "mine.toml"))


def test_places_drawn_at_random_are_in_no_wall() -> None:
    walls = "walls = [{ from = [400, 100], to = [400, 500], thickness = 40 }]"
    scene = scene_of(f"count = 300\nradius = 20\n{ANYWHERE}", more=walls)
    assert np.abs(spawn(scene).position[:, 0] - 400).min() >= 40
    free = spawn(scene_of(f"count = 300\nradius = 20\n{ANYWHERE}")).position
    assert np.abs(free[:, 0] - 400).min() < 40


def test_random_places_that_are_all_in_a_wall_are_an_error() -> None:
    walls = "walls = [{ from = [400, 0], to = [400, 600], thickness = 700 }]"
    with pytest.raises(SandboxError, match=r"balls\[0\].x and y leave hardly any place outside the walls"):
        spawn(scene_of(f"radius = 20\n{ANYWHERE}", more=walls))


# --- Crowds ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [152, 153])
def test_balls_may_overlap_in_ten_thousand_pairs_and_ten_for_each(count: int) -> None:
    """On one point, n balls overlap in n (n - 1) / 2 pairs: 11,476 of 152, and 11,628 of 153; 11,520 may."""
    scene = scene_of(f"count = {count}\nradius = 5\nx = {{ from = 400, to = 400 }}\ny = {{ from = 300, to = 300 }}")
    if count * (count - 1) / 2 <= 10_000 + 10 * count:
        assert warnings_of(scene)[0].startswith("test.toml: warning: 11,476 overlaps")
        return
    with pytest.raises(SandboxError) as refused:
        spawn(scene)
    assert str(refused.value) == (
        "test.toml: balls overlap in more than 11,530 pairs, the limit for 153 balls: 10,000, and 10 per ball; "
        "place them further apart"
    )


def test_a_ball_that_moves_by_more_than_its_radius_causes_a_warning() -> None:
    scene = scene_of(
        "radius = 20\nposition = [100, 100]\nvelocity = [1500, 0]",
        "radius = 4\nposition = [300, 300]\nvelocity = [0, 990]",
    )
    assert warnings_of(scene) == [
        (
            "test.toml: warning: ball 1 moves 16.5 px per step, more than its radius of 4: "
            "time-stepped engines may miss contacts; a rate of 248 would do"
            ""
        )
    ]


@given(radius=st.floats(0.5, 50), speed=st.floats(1, 1e5), rate=st.integers(1, 1000))
@example(radius=0.5, speed=1.0000000000222042, rate=1)
@example(radius=0.5, speed=1.0000002, rate=1)
def test_the_rate_in_the_warning_is_enough(radius: float, speed: float, rate: int) -> None:
    group = f"radius = {radius!r}\nposition = [400, 300]\nvelocity = [0, {speed!r}]"
    scene = scene_of(group, more=f"rate = {rate}")
    found = warnings_of(scene)
    assert found or speed / rate <= radius * (1 + 2e-9)
    for warning in found:
        match = re.search(r"a rate of (\d+) would do$", warning)
        assert match
        enough = int(match[1])
        assert rate < enough
        assert speed / enough <= radius * (1 + 2e-9)
        assert enough == 1 or speed / (enough - 1) > radius
