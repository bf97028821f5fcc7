"""The exact engine beside an independent program in 50 digits, in random scenes.

What is compared: places, velocities, angles, spins, what walls gave to each disc, and each contact, to 1e-9 times the
growth of an error. A comparison ends with the scene; or at the horizon, where a few units in the last place have grown
to a radius; or just before something that the independent program has no law for: a disc comes to rest on another, on
the round end of a wall or in a corner, it has two contacts at once, or contacts without end (a collapse).
"""

import math
import random
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal, localcontext
from itertools import accumulate
from typing import Final, NamedTuple

import numpy as np
import pytest
from conftest import sizes
from discs_in_decimal import Noise, Run, run
from roots_in_decimal import DIGITS
from scene_in_decimal import STEPS, Numbers

from sandbox.engines import advance
from sandbox.engines.exact import ExactEngine
from sandbox.scene.files import parse
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, Floats, States

MAX_CONTACTS: Final = 1000
ALLOWED: Final = 1e-9  # px, and px/s and s, times the growth
NUDGE: Final = Decimal("1e-20")  # px, px/s and rad/s, by which the twins' starts differ
LATER_NUDGE: Final = NUDGE / 10  # at each step, since errors grow that are made after others have decayed
TWINS: Final = 2
AMBIGUOUS: Final = Decimal("1e-6")  # s, within which a contact is looked for, and may be beyond the end instead


def draw(seed: int, *, rough: bool) -> Numbers:
    """Draw a scene: radii from 1e-2 to 100 px, masses from 1e-3 to 1e3 kg, elasticities of contacts from 0.3 to 1.

    rough: friction factors up to 1.5, spins, and discs that lie on walls.
    """
    rng = random.Random(seed)

    def log_uniform(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    def vector(length: float) -> tuple[float, float]:
        angle = rng.uniform(0, 2 * math.pi)
        return length * math.cos(angle), length * math.sin(angle)

    def elasticity() -> float:
        return 1.0 if lossless else math.sqrt(rng.uniform(0.3, 1))  # of two factors

    def friction() -> float:
        return rng.choice([0.0, rng.uniform(0, 1.5), rng.uniform(0, 1.5)]) if rough else 0.0

    def spin(radius: float) -> float:
        return min(side * rng.choice([0, 0.1, 1]) / radius, 1000) * rng.uniform(-1, 1) if rough else 0.0

    lossless = rng.random() < (0.1 if rough else 0.4)
    largest = log_uniform(1e-2, 100)
    smallest = max(1e-2, largest / log_uniform(1, rng.choice([30, 1e4])))
    side = largest * rng.uniform(6, 25)
    size = (side, side * rng.uniform(0.6, 1.6))
    fall = side * log_uniform(0.1, 10) if rng.random() < (0.8 if rough else 0.6) else 0.0
    gravity = rng.choice([vector(fall), (0.0, fall)])
    walls: list[tuple[float, ...]] = []
    for _ in range(rng.choice([0, 0, 1, 2, 3, 4])):
        ends = [rng.uniform(0, extent) for extent in size * 2]
        if math.dist(ends[:2], ends[2:]) > side / 20:
            walls.append((*ends, rng.choice([0.0, side * rng.uniform(0, 0.06)]), elasticity(), friction()))
    balls: list[tuple[float, ...]] = []
    in_flock = rng.random() < (0.1 if rough else 0.2)  # they nearly touch, and fly together
    flock = vector(side * log_uniform(0.1, 1)) if in_flock else None
    for _ in range(rng.randint(1, 5 if rough else 8)):
        radius = log_uniform(smallest, largest)
        for _ in range(100):
            x, y = (rng.uniform(radius, extent - radius) for extent in size)
            vx, vy = vector(side * log_uniform(0.1, 5))
            if flock and balls:
                neighbour = rng.choice(balls)
                dx, dy = vector(radius + neighbour[4] + side * log_uniform(1e-6, 1e-2))
                x, y = neighbour[0] + dx, neighbour[1] + dy
                dvx, dvy = vector(side * log_uniform(1e-5, 1e-1))
                vx, vy = flock[0] + dvx, flock[1] + dvy
            elif rough and not lossless and rng.random() < 0.5:
                x, y, vx, vy = lying(rng, radius, size, walls, gravity)
            if is_free(x, y, radius, size, balls, walls):
                mass = log_uniform(1e-3, 1e3)
                balls.append((x, y, vx, vy, radius, mass, elasticity(), friction(), spin(radius)))
                break
    return Numbers(size, elasticity(), friction(), gravity, rng.randint(6, 60), tuple(balls), tuple(walls))


def lying(
    rng: random.Random,
    radius: float,
    size: tuple[float, float],
    walls: Sequence[tuple[float, ...]],
    gravity: tuple[float, float],
) -> tuple[float, float, float, float]:
    """Draw the place and velocity of a disc that touches the upper face of a wall, but for a little, and moves along.

    On the sides of the arena, it is above if gravity says so.
    """
    corners = [(0.0, size[1]), (0.0, 0.0), (size[0], 0.0), size]
    sides = [(*start, *end, 0.0) for start, end in zip(corners, corners[1:] + corners[:1], strict=True)]
    x0, y0, x1, y1, thickness, *_ = rng.choice([*sides, *walls, *walls])
    share, length = rng.random(), math.dist((x0, y0), (x1, y1))
    tx, ty = (x1 - x0) / length, (y1 - y0) / length
    above = math.copysign(radius + thickness / 2 + size[0] * 1e-12, gravity[0] * ty - gravity[1] * tx)
    speed = size[0] * rng.uniform(-1, 1) * rng.choice([0.01, 0.1, 1])
    return x0 + share * length * tx - above * ty, y0 + share * length * ty + above * tx, speed * tx, speed * ty


def is_free(
    x: float,
    y: float,
    radius: float,
    size: tuple[float, float],
    balls: Sequence[tuple[float, ...]],
    walls: Sequence[tuple[float, ...]],
) -> bool:
    """Return whether a disc would be in the arena, and overlap no other and no wall."""
    if not (radius < x < size[0] - radius and radius < y < size[1] - radius):
        return False
    for other_x, other_y, _, _, other, *_ in balls:
        if math.dist((x, y), (other_x, other_y)) <= radius + other:
            return False
    for x0, y0, x1, y1, thickness, *_ in walls:
        dx, dy = x1 - x0, y1 - y0
        share = min(1.0, max(0.0, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy)))
        if math.dist((x, y), (x0 + share * dx, y0 + share * dy)) <= radius + thickness / 2:
            return False
    return True


class Error(NamedTuple):
    """How far exact is off at a time (s), as a share of what is allowed; `inf` for a contact that only one has."""

    share: float
    time: float
    what: str


class Verdict(NamedTuple):
    """The worst error of a scene, what was compared of its time (0 to 1) and its contacts, and where that ended."""

    worst: Error
    compared: float
    contacts: int
    ended: str


Row = Sequence[Decimal]


def places(run: Run) -> list[Row]:
    return [[coordinate for disc in table.discs for coordinate in (disc.x, disc.y)] for table in run.snapshots]


def velocities(run: Run) -> list[Row]:
    return [[component for disc in table.discs for component in (disc.vx, disc.vy)] for table in run.snapshots]


def angles(run: Run) -> list[Row]:
    return [[disc.angle for disc in table.discs] for table in run.snapshots]


def spins(run: Run) -> list[Row]:
    return [[disc.spin for disc in table.discs] for table in run.snapshots]


def pushes(run: Run) -> list[Row]:
    """Return what walls have given to each disc, over its mass, px/s."""
    return [
        [component for disc in table.discs for component in (disc.pushed_x, disc.pushed_y)] for table in run.snapshots
    ]


def contact_places(run: Run) -> list[Row]:
    return [contact.at for contact in run.contacts]


def contact_times(run: Run) -> list[Row]:
    return [[contact.time] for contact in run.contacts]


def jumps(run: Run) -> list[Row]:
    """Return by how much each contact changes the velocity of the lighter disc, along normal and tangent, px/s."""
    return [[contact.impulse / contact.lighter, contact.tangential / contact.lighter] for contact in run.contacts]


def slips(run: Run) -> list[Row]:
    return [[contact.slip] for contact in run.contacts]


def largest_difference(one: Row, other: Row) -> float:
    return float(max(abs(a - b) for a, b in zip(one, other, strict=True)))


def growth(runs: Sequence[Run], part: Callable[[Run], list[Row]]) -> list[float]:
    """Return how much larger the twins' differences in a part have become at each time, or were before; at least 1."""
    truth, *twins = map(part, runs)
    largest = (
        max(largest_difference(row, other) for other in others) / float(NUDGE)
        for row, *others in zip(truth, *twins, strict=False)
    )
    return list(accumulate(largest, max, initial=1.0))[1:]


def horizon_of(runs: Sequence[Run], error: float, radius: float) -> Decimal:
    """Return when an error of the start (px) has grown to a radius (px); if it never does, when the runs end."""
    truth = runs[0]
    moments = [
        *zip((table.time for table in truth.snapshots), growth(runs, places), strict=False),
        *zip((contact.time for contact in truth.contacts), growth(runs, contact_places), strict=False),
    ]
    return min((time for time, grown in moments if grown * error >= radius), default=truth.until)


def compare(numbers: Numbers) -> Verdict:
    """Compare exact with the independent program, up to where a few units in the last place have grown to a radius."""
    start = numbers.table()
    with localcontext(prec=DIGITS):
        times = [Decimal(step) / numbers.rate for step in range(1, STEPS + 1)]
        noises = [None, *(Noise(NUDGE, LATER_NUDGE, random.Random(seed)) for seed in range(TWINS))]
        runs = [run(start, times, MAX_CONTACTS, noise) for noise in noises]
        radius = float(min(disc.radius for disc in start.discs))
        horizon = horizon_of(runs, 8 * math.ulp(max(numbers.size)), radius)
        contacts_until = horizon_of(runs, ALLOWED, radius / 1000)  # from there on, an allowed error can miss a contact
        states, contacts = by_exact(numbers, math.ceil(horizon * numbers.rate))
        found = [
            *errors_of_states(runs, states, horizon),
            *errors_of_contacts(runs, contacts, contacts_until),
        ]
        return Verdict(
            max(found, default=Error(0.0, 0.0, "nothing")),
            float(min(horizon, runs[0].until) / times[-1]),
            sum(contact.time < contacts_until for contact in runs[0].contacts),
            "at the horizon" if horizon < runs[0].until else runs[0].ended or "with the scene",
        )


def errors_of_states(runs: Sequence[Run], states: Sequence[Floats], until: Decimal) -> Iterator[Error]:
    """Yield the errors of exact's states after each step before a time: its positions, velocities and so on."""
    for part, found in zip((places, velocities, angles, spins, pushes), states, strict=True):
        for table, row, grown, other in zip(runs[0].snapshots, part(runs[0]), growth(runs, part), found, strict=False):
            if table.time < until:
                off = largest_difference(row, [Decimal(number) for number in other.ravel().tolist()])
                yield Error(off / (ALLOWED * grown), float(table.time), part.__name__)


def errors_of_contacts(runs: Sequence[Run], contacts: Contacts, until: Decimal) -> Iterator[Error]:
    """Yield the errors of exact's contacts before a time, and whether it has others of two discs.

    It reports each bounce that the independent program has; besides, it may report what a wall gives to a disc that
    lies on it, of which only the sum is compared, as a push.
    """
    truth = [contact for contact in runs[0].contacts if contact.time < until]
    growths = growth(runs, contact_times), growth(runs, jumps), growth(runs, slips)
    of_discs = Counter((contact.first, contact.second) for contact in truth if contact.second >= 0)
    for contact, late, wrong, slipped in zip(truth, *growths, strict=False):
        time, pair = float(contact.time), (contact.first, contact.second)
        rows = contacts[(contacts["first"] == pair[0]) & (contacts["second"] == pair[1])]
        near = rows[np.abs(rows["time"] - time) < max(float(AMBIGUOUS), ALLOWED * late)]
        if not len(near):
            yield Error(math.inf, time, f"no contact of {pair}")
            return
        row = near[np.abs(near["impulse"] - float(contact.impulse)).argmin()]
        exact = {name: Decimal(float(row[name])) for name in ("time", "impulse", "tangential", "slip")}
        yield Error(float(abs(exact["time"] - contact.time)) / (ALLOWED * late), time, f"time of contact {pair}")
        off = max(abs(exact["impulse"] - contact.impulse), abs(exact["tangential"] - contact.tangential))
        yield Error(float(off / contact.lighter) / (ALLOWED * wrong), time, f"impulse of contact {pair}")
        yield Error(float(abs(exact["slip"] - contact.slip)) / (ALLOWED * slipped), time, f"slip of contact {pair}")
    clearly_before = contacts[(contacts["second"] >= 0) & (contacts["time"] < float(until - AMBIGUOUS))]
    for pair, count in Counter(map(tuple, clearly_before[["first", "second"]].tolist())).items():
        if count > of_discs[pair]:
            yield Error(math.inf, float(until), f"{count} contacts of {pair} instead of {of_discs[pair]}")


def by_exact(numbers: Numbers, steps: int) -> tuple[list[Floats], Contacts]:
    """Run a scene in exact: the states after each step, and what walls have given over the masses; the contacts."""
    scene = parse(numbers.toml(), "random.toml")
    engine = ExactEngine(scene, spawn(scene))
    engine.contacts()
    states = States.empty(steps, len(numbers.balls))
    advance(engine, states)
    contacts = engine.contacts()
    pushed = np.zeros_like(states.velocity)
    times = np.arange(1, steps + 1) / numbers.rate
    for row in contacts[contacts["second"] < 0]:
        (nx, ny), along, ball = row["normal"], row["tangential"], row["first"]
        given = np.array([row["impulse"] * nx - along * ny, row["impulse"] * ny + along * nx])
        pushed[np.searchsorted(times, row["time"]) :, ball] -= given / scene.bodies.mass[ball]
    return [*states, pushed], contacts


def table_of(verdicts: Mapping[int, Verdict]) -> str:
    """Return where the comparisons ended, and the worst errors."""
    contacts = sum(verdict.contacts for verdict in verdicts.values())
    compared = sum(verdict.compared for verdict in verdicts.values()) / len(verdicts)
    lines = [f"{contacts} contacts and {compared:.0%} of the time compared", ""]
    lines += ["comparison ended   scenes   agree   worst error, as a share of what is allowed"]
    for ended in sorted({verdict.ended for verdict in verdicts.values()}):
        some = {seed: verdict for seed, verdict in verdicts.items() if verdict.ended == ended}
        seed, worst = max(some.items(), key=lambda item: item[1].worst)
        agree = sum(verdict.worst.share <= 1 for verdict in some.values())
        lines.append(f"{ended:16} {len(some):8} {agree:7}   {worst.worst.share:.1e}: {worst.worst.what}, seed {seed}")
    return "\n".join(lines)


def check(seeds: Iterable[int], *, rough: bool) -> None:
    """Compare some scenes, and print a table."""
    verdicts = {seed: compare(draw(seed, rough=rough)) for seed in seeds}
    print(f"\n{table_of(verdicts)}")
    assert not {seed: verdict for seed, verdict in verdicts.items() if verdict.worst.share > 1}


@pytest.mark.parametrize("count", sizes(12, slow=900))
def test_exact_agrees_with_an_independent_program_in_50_digits(count: int) -> None:
    check(range(count), rough=False)


@pytest.mark.parametrize("count", sizes(12, slow=300))
def test_exact_agrees_with_friction_and_spin_too(count: int) -> None:
    check(range(count), rough=True)
