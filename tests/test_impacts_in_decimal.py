"""Sequences of impacts at one time: `exact` beside a program in 60 digits."""

import math
import random
from collections.abc import Callable
from typing import Final

import numpy as np
import pytest
from conftest import sizes
from exact_scenes import ball, box_of, engine_of, lines, play, wall
from impacts_in_decimal import Ending, Touching, continued, is_decided

from sandbox.scene.model import Scene
from sandbox.state import Floats

CLOSE: Final = 1e-9  # of the fastest motion, and of the energy: how exact a limit is
TOUCHING: Final = 1e-9  # px, twice the largest gap of discs that the scenes put together
ONE_STEP: Final = "rate = 1_000_000\nseconds = 1e-6"  # so that nothing moves far enough for other contacts
SPEED: Final = 100.0  # px/s
RADIUS: Final = 10.0  # px
FLOOR: Final = 600.0  # px


def by_exact(scene: Scene) -> Floats:
    """Return the velocities and rim speeds of discs after what impacts follow at the start, (n, 3) px/s."""
    state = play(engine_of(scene), 1)
    return np.column_stack([state.velocity, RADIUS * state.spin])


def heavy_on_light(rng: random.Random) -> list[str]:
    ratio = 10 ** rng.uniform(1, 4)
    y = FLOOR - RADIUS
    velocity = rng.uniform(-200, 200), SPEED
    return [ball((400, y - 2 * RADIUS), velocity, mass=ratio, spin=rng.uniform(-9, 9)), ball((400, y))]


def light_between_heavy(rng: random.Random) -> list[str]:
    """Two discs of about 1,000 kg close on one of 1 kg, which touches one of them first."""
    masses = [1000.0 * rng.uniform(0.3, 3) for _ in range(2)]
    vx, spin = rng.uniform(-SPEED, SPEED), rng.uniform(-9, 9)
    side, vy = 2 * RADIUS, rng.uniform(-50, 50)
    return [
        ball((400 - side, 300), (vx + SPEED, vy), mass=masses[0], spin=spin),
        ball((400, 300), (vx, 0)),
        ball((400 + side, 300), (vx, 0), mass=masses[1]),
    ]


def in_a_corner(rng: random.Random) -> list[str]:
    """A heavy disc presses a light one into the corner of the arena."""
    angle = rng.uniform(0.1, math.pi / 2 - 0.1)
    x, y, reach, mass = RADIUS, FLOOR - RADIUS, 2 * RADIUS, 10 ** rng.uniform(1, 4)
    direction = angle + rng.uniform(-1, 1)
    velocity = -SPEED * math.cos(direction), SPEED * math.sin(direction)
    place = x + reach * math.cos(angle), y - reach * math.sin(angle)
    return [ball((x, y)), ball(place, velocity, mass=mass, spin=rng.uniform(-5, 5))]


def in_a_wedge(rng: random.Random) -> list[str]:
    """A disc is shot into the edge between two walls."""
    half, turn = rng.uniform(0.05, 1.2), rng.uniform(0, 2 * math.pi)
    (x, y), long = (400.0, 300.0), 250.0
    walls = [
        wall((x, y), (x + long * math.cos(turn + side * half), y + long * math.sin(turn + side * half)), 0)
        for side in (-1, 1)
    ]
    off, direction = RADIUS / math.sin(half), turn + math.pi + rng.uniform(-half, half)
    place = x + off * math.cos(turn), y + off * math.sin(turn)
    velocity = SPEED * math.cos(direction), SPEED * math.sin(direction)
    return [*walls, ball(place, velocity, spin=rng.uniform(-9, 9))]


def chain(rng: random.Random) -> list[str]:
    """A disc hits a row of 2 to 4 others, at a wall."""
    masses = [10 ** rng.uniform(0, 4) for _ in range(rng.randint(3, 5))]
    velocities = [*[(0.0, 0.0)] * (len(masses) - 1), (-SPEED, rng.uniform(-50, 50))]
    return [
        ball((RADIUS + 2 * RADIUS * k, 300), velocity, mass=mass)
        for k, (mass, velocity) in enumerate(zip(masses, velocities, strict=True))
    ]


DRAWS: Final[tuple[Callable[[random.Random], list[str]], ...]] = (
    heavy_on_light,
    light_between_heavy,
    in_a_corner,
    in_a_wedge,
    chain,
)


@pytest.mark.wide
@pytest.mark.parametrize("count", sizes(6, slow=100))
@pytest.mark.parametrize("draw", DRAWS)
def test_exact_leaves_the_velocities_and_the_energy_of_impacts_one_by_one(
    draw: Callable[[random.Random], list[str]], count: int
) -> None:
    """In sequences of which the laws decide what they leave, in whatever order impacts at one time are resolved."""
    rng, worst = random.Random(draw.__name__), 0.0
    endings: list[Ending] = []
    while len(endings) < count:
        e, mu = math.sqrt(rng.choice([0.05, 0.25, 0.5, 0.8, 0.9])), math.sqrt(rng.choice([0, 0.1, 0.5, 1]))
        parts = draw(rng)
        law = lines(elasticity=e, friction=mu)
        scene = box_of(*(part + law for part in parts), head=ONE_STEP, elasticity=e, friction=mu)
        touching = Touching(scene, TOUCHING)
        outcome = continued(touching)
        if not is_decided(touching, outcome):
            continue
        start, expected, found = touching.motion.reshape(-1, 3).astype(float), outcome.speeds, by_exact(scene)
        at_start, at_end, by_ours = (scene.bodies.mass @ rows**2 @ (1, 1, 0.5) for rows in (start, expected, found))
        off = max(np.abs(found - expected).max() / np.abs(start).max(), abs(by_ours - at_end) / at_start)
        assert off < CLOSE, parts
        worst = max(worst, off)
        endings.append(outcome.ending)
    collapses = endings.count(Ending.TOGETHER)
    print(f"\n{draw.__name__:20} {count} sequences, {collapses} of them collapses; worst error {worst:.1e}", end="")
    assert set(endings) <= {Ending.PARTED, Ending.TOGETHER}
    assert collapses >= count / 4
