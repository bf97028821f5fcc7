"""Sequences of impacts at one time: `exact` beside a program in 60 digits."""

import math
import random
from collections.abc import Callable, Sequence
from decimal import Decimal
from typing import Final, NamedTuple

import numpy as np
import pytest
from conftest import sizes
from impacts_in_decimal import Ending, Touch, continued, is_decided, speeds, touches_of
from scene_in_decimal import Disc, Numbers

from sandbox.engines.exact import ExactEngine
from sandbox.scene.files import parse
from sandbox.scene.spawn import spawn
from sandbox.state import Floats

CLOSE: Final = 1e-9  # of the fastest motion, and of the energy: how exact a limit is
TOUCHING: Final = Decimal("1e-9")  # px, twice the largest gap of discs that the scenes put together
MAX_RATE: Final = 1_000_000  # so that after a step nothing has moved far enough for other contacts
SPEED: Final = 100.0  # px/s
RADIUS: Final = 10.0  # px
SIZE: Final = (800.0, 600.0)


class Ball(NamedTuple):
    """A row of `Numbers.balls` but for the factors of contacts."""

    x: float
    y: float
    vx: float = 0.0
    vy: float = 0.0
    mass: float = 1.0
    spin: float = 0.0


def numbers_of(balls: Sequence[Ball], e: float, mu: float, walls: Sequence[tuple[float, ...]] = ()) -> Numbers:
    """Return discs that touch, without gravity, in a scene whose bodies all have the same factors."""
    rows = tuple((b.x, b.y, b.vx, b.vy, RADIUS, b.mass, e, mu, b.spin) for b in balls)
    return Numbers(SIZE, e, mu, (0.0, 0.0), MAX_RATE, rows, tuple((*ends, 0.0, e, mu) for ends in walls))


def touches(numbers: Numbers) -> tuple[list[Disc], list[Touch]]:
    return touches_of(numbers, TOUCHING)


def by_exact(numbers: Numbers) -> Floats:
    """Return the velocities and rim speeds of discs after what impacts follow at the start, (n, 3) px/s."""
    scene = parse(numbers.toml(), "touching.toml")
    engine = ExactEngine(scene, spawn(scene))
    engine.step()
    state = engine.state()
    return np.column_stack([state.velocity, RADIUS * state.spin])


def array(discs: Sequence[Disc]) -> Floats:
    """Return the velocities and rim speeds of discs, (n, 3) px/s."""
    return np.array([[float(speed) for speed in speeds(disc)] for disc in discs])


def heavy_on_light(rng: random.Random) -> tuple[list[Ball], list[tuple[float, ...]]]:
    ratio = 10 ** rng.uniform(1, 4)
    y = SIZE[1] - RADIUS
    return [Ball(400.0, y - 2 * RADIUS, rng.uniform(-200, 200), SPEED, ratio, rng.uniform(-9, 9)), Ball(400.0, y)], []


def light_between_heavy(rng: random.Random) -> tuple[list[Ball], list[tuple[float, ...]]]:
    """Two discs of about 1,000 kg close on one of 1 kg, which touches one of them first."""
    masses = [1000.0 * rng.uniform(0.3, 3) for _ in range(2)]
    vx, spin = rng.uniform(-SPEED, SPEED), rng.uniform(-9, 9)
    side, vy = 2 * RADIUS, rng.uniform(-50, 50)
    return [
        Ball(400.0 - side, 300.0, vx + SPEED, vy, masses[0], spin),
        Ball(400.0, 300.0, vx),
        Ball(400.0 + side, 300.0, vx, 0.0, masses[1]),
    ], []


def in_a_corner(rng: random.Random) -> tuple[list[Ball], list[tuple[float, ...]]]:
    """A heavy disc presses a light one into the corner of the arena."""
    angle = rng.uniform(0.1, math.pi / 2 - 0.1)
    x, y = RADIUS, SIZE[1] - RADIUS
    reach = 2 * RADIUS
    heavy = Ball(x + reach * math.cos(angle), y - reach * math.sin(angle), mass=10 ** rng.uniform(1, 4))
    direction = angle + rng.uniform(-1, 1)
    vx, vy = -SPEED * math.cos(direction), SPEED * math.sin(direction)
    return [Ball(x, y), heavy._replace(vx=vx, vy=vy, spin=rng.uniform(-5, 5))], []


def in_a_wedge(rng: random.Random) -> tuple[list[Ball], list[tuple[float, ...]]]:
    """A disc is shot into the edge between two walls."""
    half, turn = rng.uniform(0.05, 1.2), rng.uniform(0, 2 * math.pi)
    apex, long = (400.0, 300.0), 250.0
    walls: list[tuple[float, ...]] = [
        (*apex, apex[0] + long * math.cos(turn + side * half), apex[1] + long * math.sin(turn + side * half))
        for side in (-1, 1)
    ]
    off, direction = RADIUS / math.sin(half), turn + math.pi + rng.uniform(-half, half)
    x, y = apex[0] + off * math.cos(turn), apex[1] + off * math.sin(turn)
    return [Ball(x, y, SPEED * math.cos(direction), SPEED * math.sin(direction), spin=rng.uniform(-9, 9))], walls


def chain(rng: random.Random) -> tuple[list[Ball], list[tuple[float, ...]]]:
    """A disc hits a row of 2 to 4 others, at a wall."""
    balls = [Ball(RADIUS + 2 * RADIUS * k, 300.0, mass=10 ** rng.uniform(0, 4)) for k in range(rng.randint(3, 5))]
    return [*balls[:-1], balls[-1]._replace(vx=-SPEED, vy=rng.uniform(-50, 50))], []


Draw = Callable[[random.Random], tuple[list[Ball], list[tuple[float, ...]]]]
DRAWS: Final[tuple[Draw, ...]] = (heavy_on_light, light_between_heavy, in_a_corner, in_a_wedge, chain)


def errors(discs: Sequence[Disc], expected: Floats, found: Floats) -> tuple[float, float]:
    """Return by how much velocities are off, as a share of the fastest motion, and the energy, of that at the start."""
    mass, before = np.array([float(disc.mass) for disc in discs]), array(discs)
    at_start, at_end, wrong = (float(mass @ rows**2 @ (1, 1, 0.5)) for rows in (before, expected, found))
    return float(np.abs(found - expected).max() / np.abs(before).max()), abs(wrong - at_end) / at_start


@pytest.mark.wide
@pytest.mark.parametrize("count", sizes(6, slow=100))
@pytest.mark.parametrize("draw", DRAWS)
def test_exact_leaves_the_velocities_and_the_energy_of_impacts_one_by_one(draw: Draw, count: int) -> None:
    """In sequences of which the laws decide what they leave, in whatever order impacts at one time are resolved."""
    rng, worst = random.Random(draw.__name__), 0.0
    endings: list[Ending] = []
    while len(endings) < count:
        e, mu = math.sqrt(rng.choice([0.05, 0.25, 0.5, 0.8, 0.9])), math.sqrt(rng.choice([0, 0.1, 0.5, 1]))
        balls, walls = draw(rng)
        numbers = numbers_of(balls, e, mu, walls)
        discs, contacts = touches(numbers)
        if is_decided(discs, contacts):
            outcome = continued(discs, contacts)
            off = max(errors(discs, array(outcome.discs), by_exact(numbers)))
            assert off < CLOSE, numbers.toml()
            worst = max(worst, off)
            endings.append(outcome.ending)
    collapses = endings.count(Ending.TOGETHER)
    print(f"\n{draw.__name__:20} {count} sequences, {collapses} of them collapses; worst error {worst:.1e}", end="")
    assert set(endings) <= {Ending.PARTED, Ending.TOGETHER}
    assert collapses >= count / 4
