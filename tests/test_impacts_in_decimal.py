"""Sequences of impacts at one time: the program in 60 digits where closed forms are known, and `exact` beside it."""

import math
import random
from collections.abc import Callable, Sequence
from decimal import Decimal, localcontext
from typing import Final, NamedTuple

import numpy as np
import pytest
from conftest import sizes
from impacts_in_decimal import DIGITS, Ending, Touch, continued, is_decided, speeds, touches_of
from scene_in_decimal import Numbers
from table_in_decimal import Disc

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
    table = numbers.table()
    return table.discs, touches_of(table, lambda _: TOUCHING)


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


def energy(discs: Sequence[Disc]) -> Decimal:
    """Return the energy of flight and of spin, kg px²/s²."""
    return sum(
        (disc.mass * (disc.vx**2 + disc.vy**2 + (disc.radius * disc.spin) ** 2 / 2) / 2 for disc in discs), Decimal(0)
    )


def column(masses: Sequence[float], e: float, mu: float = 0, vx: float = 0) -> Numbers:
    """Return a column of discs on the floor, the highest of which falls on it."""
    top = SIZE[1] - RADIUS - 2 * RADIUS * (len(masses) - 1)
    balls = [Ball(400.0, top + 2 * RADIUS * k, mass=mass) for k, mass in enumerate(masses)]
    balls[0] = balls[0]._replace(vx=vx, vy=SPEED)
    return numbers_of(balls, e, mu)


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


def test_momentum_is_kept_and_energy_is_not_gained() -> None:
    rng = random.Random(1)
    for _ in range(20):
        numbers = numbers_of(light_between_heavy(rng)[0], rng.uniform(0.1, 1), rng.choice([0.0, 0.3, 1.0]))
        discs, contacts = touches(numbers)
        after = continued(discs, contacts).discs
        with localcontext(prec=DIGITS):
            for part in ("vx", "vy"):
                momenta = [sum(disc.mass * getattr(disc, part) for disc in some) for some in (discs, after)]
                assert abs(momenta[1] - momenta[0]) < Decimal("1e-50")
            assert energy(after) < energy(discs)


@pytest.mark.parametrize("mu", [0, 0.3, 1])
@pytest.mark.parametrize("e", [0.5, 0.9])
@pytest.mark.parametrize("ratio", [5, 15, 30])
def test_leaps_leave_what_the_same_impacts_one_by_one_leave(ratio: float, e: float, mu: float) -> None:
    discs, contacts = touches(column([ratio, 1], e, mu, 70))
    leaping, plodding = (continued(discs, contacts, leaps=leaps) for leaps in (True, False))
    assert leaping.ending == plodding.ending
    for one, other in zip(leaping.discs, plodding.discs, strict=True):
        assert all(abs(a - b) < Decimal("1e-37") for a, b in zip(speeds(one), speeds(other), strict=True))
    for pair in zip(leaping.impulses, plodding.impulses, strict=True):
        assert all(abs(a - b) < Decimal(ratio) * Decimal("1e-36") for a, b in zip(*pair, strict=True))


def test_a_heavy_disc_that_slides_on_a_light_one_makes_it_roll() -> None:
    """The floor gets M v, and so does the light disc, whose rim gets F = mu M v: it rolls at 4 F / (3 m)."""
    discs, contacts = touches(column([1000, 1], 0.5, 0.1, 3000))
    outcome = continued(discs, contacts)
    to_floor = next(pair for touch, pair in zip(contacts, outcome.impulses, strict=True) if touch.second < 0)
    friction = 0.1**2 * 1000 * SPEED
    assert float(to_floor[0]) == pytest.approx(1000 * SPEED, rel=1e-14)
    assert float(to_floor[1]) == pytest.approx(friction / 3, rel=1e-14)
    heavy, light = array(outcome.discs)
    assert light == pytest.approx((4 / 3 * friction, 0, 4 / 3 * friction), rel=1e-14, abs=1e-14)
    assert heavy == pytest.approx((3000 - friction / 1000, 0, 2 * friction / 1000), rel=1e-14, abs=1e-14)


@pytest.mark.parametrize(("e", "decided"), [(0.3, True), (1.0, False)])
def test_order_matters_only_where_bodies_part(e: float, decided: bool) -> None:
    """Two discs of 1,000 kg close on one of 1 kg that touches both: which of them it meets first does not matter."""
    balls = [Ball(380.0, 300.0, SPEED, mass=1000), Ball(400.0, 300.0), Ball(420.0, 300.0, -SPEED, mass=1000)]
    assert is_decided(*touches(numbers_of(balls, e, 0))) == decided


def test_a_disc_in_a_slot_has_no_room_to_part() -> None:
    slot = Numbers(
        (2 * RADIUS, 600.0), 1.0, 0.0, (0.0, 0.0), MAX_RATE, ((RADIUS, 300.0, SPEED, 0, RADIUS, 1, 1, 0, 0),), ()
    )
    assert continued(*touches(slot)).ending == Ending.NO_ROOM
