"""`exact` where contacts follow each other closely: chains, rows and heaps, by successive impacts and by momentum."""

import itertools
import math
from collections.abc import Iterable, Sequence
from decimal import Decimal, localcontext

import numpy as np
import pytest
from conftest import bundled_scenes, sample
from exact_scenes import EXACT, accounted, after, engine_of

from sandbox.engines.engine import advance
from sandbox.errors import SandboxError
from sandbox.quantity import momentum, tangent
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import States


def scene_of(
    position: Iterable[Sequence[float]],
    velocity: Iterable[Sequence[float]],
    mass: Iterable[float],
    e: float,
    head: str = "",
    radius: float = 10,
) -> Scene:
    """Make a scene of balls whose pairs have the elasticity e, in an arena of 2,000 x 2,000 px."""
    rows = "".join(
        f"[[balls]]\nposition = [{x!r}, {y!r}]\nvelocity = [{u!r}, {v!r}]\nmass = {m!r}\nradius = {radius}\n"
        f"elasticity = {math.sqrt(e)!r}\n"
        for (x, y), (u, v), m in zip(position, velocity, mass, strict=True)
    )
    return parse(f"{head}\n[arena]\nsize = [2000, 2000]\n{rows}", "test")


# Chains of touching balls


def successive_impacts(
    gap: list[Decimal], speed: list[Decimal], mass: list[Decimal], e: Decimal, until: Decimal
) -> list[Decimal] | None:
    """Return the speeds of balls in a row after some time, s, by one impact after another in 50 digits.

    gap: px, between neighbours. Of impacts at one time, that of the first balls comes first. Returns None if
    there are more than 100, as in an inelastic collapse, or nearly so.
    """
    gap, v, now = [*gap], [*speed], Decimal(0)
    for _ in range(100):
        closing = [a - b for a, b in itertools.pairwise(v)]
        when = [max(g / c, Decimal(0)) if c > 0 else until for g, c in zip(gap, closing, strict=True)]
        soonest = min(when)
        if now + soonest >= until:
            return v
        k = when.index(soonest)
        gap, now = [g - soonest * c for g, c in zip(gap, closing, strict=True)], now + soonest
        impulse = (1 + e) * closing[k] / (1 / mass[k] + 1 / mass[k + 1])
        v[k] -= impulse / mass[k]
        v[k + 1] += impulse / mass[k + 1]
    return None


@pytest.mark.parametrize("unequal", [False, True], ids=["equal", "unequal"])
@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("count", range(2, 11))
def test_touching_chain_leaves_as_by_successive_impacts(count: int, gap: float, unequal: bool) -> None:
    """An elastic contact where another comes soon after would give the energy of a cradle of e = 0.5 wrong by 10 %."""
    ended = 0
    for e in (0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95):
        mass = [1.0 + (0.37 * k % 1 if unequal else 0) for k in range(count)]
        x = [200.0, *(300 + (20 + gap) * k for k in range(count - 1))]
        scene = scene_of([(a, 300) for a in x], [(300, 0), *[(0, 0)] * (count - 1)], mass, e)
        with localcontext(prec=50):
            factor = Decimal(math.sqrt(e))
            start = [Decimal(300), *[Decimal(0)] * (count - 1)]
            gaps = [b - a - 20 for a, b in itertools.pairwise(map(Decimal, x))]
            speed = successive_impacts(gaps, start, [*map(Decimal, mass)], factor * factor, Decimal(1))
        if speed is not None:
            ended += 1
            expected = [*map(float, speed)]
            assert after(scene, 1).velocity[:, 0] == pytest.approx(expected, abs=EXACT)
    assert ended >= 3


# Momentum


def row(count: int, angle: float, gap: float, e: float, rest: float, mass: Iterable[float], head: str) -> Scene:
    """Make a row of balls that move along their line at `rest` px/s, and one more that catches up 4 px/s faster."""
    along = np.array([math.cos(angle), math.sin(angle)])
    place = [np.array([900.0, 300.0]) + along * (20 + gap) * k for k in range(count)]
    speed = [rest + (4.0 if k == 0 else 0.0) for k in range(count)]
    return scene_of([tuple(map(float, p)) for p in place], [tuple(map(float, v * along)) for v in speed], mass, e, head)


@pytest.mark.parametrize("e", [0.05, 0.1, 0.2, 0.3, 0.5])
@pytest.mark.parametrize("count", sample([6, 3, 10], 3))
def test_row_in_free_fall_keeps_its_momentum(count: int, e: float) -> None:
    """Balls that rattle in mid-air are not stopped, be they slow or fast."""
    random = np.random.default_rng(count)
    for angle, gap, rest in itertools.product((0.0, 0.7, 1.57), (0.05, 1e-3, 1e-6), (0.0, 50.0)):
        mass = random.uniform(0.5, 3, count).tolist()
        scene = row(count, angle, gap, e, rest, mass, "gravity = [50, 900]")
        accounted(scene, 60)


@pytest.mark.parametrize("e", [0.05, 0.3, 0.5])
def test_row_that_slides_down_a_slope_keeps_its_momentum(e: float) -> None:
    """On a frictionless slope of 3 : 4, the row's centre of mass slides by g sin(a) t² / 2, whatever it does within."""
    along, out = np.array([0.8, 0.6]), np.array([0.6, -0.8])
    place = [np.array([300.0, 275.0]) + out * 10 + along * 20.01 * k for k in range(6)]
    velocity = [(3.2, 2.4), *[(0.0, 0.0)] * 5]
    head = "gravity = [0, 500]\nwalls = [{ from = [200, 200], to = [1800, 1400], thickness = 0 }]"
    scene = scene_of([tuple(map(float, p)) for p in place], velocity, [1, 2, 1, 3, 1, 2], e, head)
    mass = scene.bodies.mass
    slid = (after(scene, 1).position - spawn(scene).position) @ along @ mass / mass.sum()
    assert slid == pytest.approx(500 * 0.6 / 2 + 4 / mass.sum(), abs=1e-7)
    accounted(scene, 60)


HEAPS = {
    "column of two": (2, 1, 20.0),
    "column of five": (5, 1, 20.0),
    "stack of 5 x 8": (8, 5, 20.0),
    "stack with gaps": (8, 5, 20.5),
}


@pytest.mark.parametrize("name", HEAPS)
def test_floor_gets_the_weight_of_a_resting_heap(name: str) -> None:
    rows, columns, spacing = HEAPS[name]
    place = [(800 + spacing * c, 1990 - spacing * r) for r in range(rows) for c in range(columns)]
    scene = scene_of(place, [(0, 0)] * len(place), [1] * len(place), 0.25, "gravity = [0, 900]")
    _, found = accounted(scene, 60)
    on_floor = found[found["second"] == ~3]
    assert on_floor["impulse"].sum() == pytest.approx(len(place) * 900, rel=0.1)


def test_floor_gets_the_weight_of_a_ball_that_others_hit_while_it_rests() -> None:
    """What a wall carries is summed at every contact, not only at the end of a step."""
    scene = scene_of([(500, 1990), (300, 1990)], [(0, 0), (150, 0)], [1, 1], 1.0, "gravity = [0, 900]")
    accounted(scene, 120)


def test_ball_that_comes_to_rest_in_a_corner_gives_both_walls_its_momentum() -> None:
    scene = scene_of([(1900, 1950)], [(0, 50)], [1], 0.25, "gravity = [300, 900]")
    accounted(scene, 600)


@pytest.mark.parametrize("name", bundled_scenes())
def test_walls_and_gravity_account_for_the_momentum_of_bundled_scenes(name: str) -> None:
    """Of all balls together: friction on a heap that is frozen takes spins away, without a contact."""
    scene = load(name)
    engine, start, mass, steps = engine_of(scene), spawn(scene).velocity, scene.bodies.mass, 120
    states = States.empty(steps, len(mass))
    advance(engine, states)
    found = engine.contacts()
    walls = found[found["second"] < 0]
    step = np.clip(np.ceil(walls["time"] * scene.rate - 1e-9).astype(int) - 1, 0, steps - 1)
    given = np.zeros((steps, 2))
    np.add.at(given, step, walls["impulse"][:, None] * walls["normal"])
    np.add.at(given, step, walls["tangential"][:, None] * tangent(walls["normal"]))
    change = np.diff(momentum(np.concatenate([start[None], states.velocity]), mass), axis=0)
    weight = mass.sum() * np.array(scene.gravity) / scene.rate
    scale = np.hypot(*start.T) @ mass + mass.sum() * np.hypot(*scene.gravity)
    assert np.abs((change - weight + given).cumsum(axis=0)).max() < 1e-9 * scale


def test_too_many_contacts_of_a_heap_end_its_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.engines.exact.engine.MAX_LOGGED_CONTACTS", 1_000)
    scene = scene_of([(800, 1990), (800, 1970)], [(0, 0)] * 2, [1, 1], 0.5, "gravity = [0, 900]")
    engine = engine_of(scene)
    with pytest.raises(SandboxError, match=r"^exact ends at .* s: the next step exceeds the limit of 1,000 contacts$"):
        advance(engine, States.empty(60, 2))
