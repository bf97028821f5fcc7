"""The exact engine beside an independent program in 50 digits, in random scenes."""

import math
import random
from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from itertools import accumulate
from typing import Final, NamedTuple

import numpy as np
import pytest
from conftest import sizes
from discs_in_decimal import DIGITS, Disc, Run, Table, Wall, run

from sandbox.engines.exact import ExactEngine
from sandbox.scene.files import parse
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, Floats, States

STEPS: Final = 60
MAX_CONTACTS: Final = 300
ALLOWED: Final = 1e-9  # px, and px/s and s, times the growth
NUDGE: Final = Decimal("1e-20")  # px and px/s, by which the twins' starts differ
TWINS: Final = 2
AMBIGUOUS: Final = Decimal("1e-6")  # s before the end of a comparison, where a contact may be on either side of it


@dataclass(frozen=True)
class Numbers:
    """The numbers of a scene. balls: (x, y, vx, vy, radius, mass, elasticity); walls: (x, y, x, y, thickness, e)."""

    size: tuple[float, float]
    elasticity: float
    gravity: tuple[float, float]
    rate: int
    balls: tuple[tuple[float, ...], ...]
    walls: tuple[tuple[float, ...], ...]

    def toml(self) -> str:
        """Write the scene for the sandbox."""
        lines = [f"rate = {self.rate}", f"seconds = {STEPS / self.rate!r}", f"gravity = {[*self.gravity]}"]
        lines += ["[arena]", f"size = {[*self.size]}", f"elasticity = {self.elasticity!r}"]
        for x, y, vx, vy, radius, mass, elasticity in self.balls:
            lines += ["[[balls]]", f"position = {[x, y]}", f"velocity = {[vx, vy]}"]
            lines += [f"radius = {radius!r}", f"mass = {mass!r}", f"elasticity = {elasticity!r}"]
        for x0, y0, x1, y1, thickness, elasticity in self.walls:
            lines += ["[[walls]]", f"from = {[x0, y0]}", f"to = {[x1, y1]}"]
            lines += [f"thickness = {thickness!r}", f"elasticity = {elasticity!r}"]
        return "\n".join(lines)

    def table(self) -> Table:
        """Write the scene for the independent program."""
        width, height = map(Decimal, self.size)
        corners = [(Decimal(0), height), (Decimal(0), Decimal(0)), (width, Decimal(0)), (width, height)]
        sides = zip(corners, corners[1:] + corners[:1], strict=True)
        e = Decimal(self.elasticity)
        walls = [Wall(number, *start, *end, Decimal(0), e, True) for number, (start, end) in enumerate(sides)]
        for number, (*ends, thickness, elasticity) in enumerate(self.walls, len(walls)):
            x0, y0, x1, y1 = map(Decimal, ends)
            walls.append(Wall(number, x0, y0, x1, y1, Decimal(thickness / 2), Decimal(elasticity)))
        discs = [Disc(*map(Decimal, ball)) for ball in self.balls]
        return Table(discs, tuple(walls), (Decimal(self.gravity[0]), Decimal(self.gravity[1])))


def draw(seed: int) -> Numbers:
    """Draw a scene: radii from 1e-2 to 100 px, masses from 1e-3 to 1e3 kg, elasticities of contacts from 0.3 to 1."""
    rng = random.Random(seed)

    def log_uniform(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    def vector(length: float) -> tuple[float, float]:
        angle = rng.uniform(0, 2 * math.pi)
        return length * math.cos(angle), length * math.sin(angle)

    def elasticity() -> float:
        return 1.0 if lossless else math.sqrt(rng.uniform(0.3, 1))  # of two factors

    lossless = rng.random() < 0.4
    largest = log_uniform(1e-2, 100)
    smallest = max(1e-2, largest / log_uniform(1, rng.choice([30, 1e4])))
    side = largest * rng.uniform(6, 25)
    size = (side, side * rng.uniform(0.6, 1.6))
    fall = side * log_uniform(0.1, 10) if rng.random() < 0.6 else 0.0
    gravity = rng.choice([vector(fall), (0.0, fall)])
    walls: list[tuple[float, ...]] = []
    for _ in range(rng.choice([0, 0, 1, 2, 3, 4])):
        ends = [rng.uniform(0, extent) for extent in size * 2]
        if math.dist(ends[:2], ends[2:]) > side / 20:
            walls.append((*ends, rng.choice([0.0, side * rng.uniform(0, 0.06)]), elasticity()))
    balls: list[tuple[float, ...]] = []
    flock = vector(side * log_uniform(0.1, 1)) if rng.random() < 0.2 else None  # they nearly touch, and fly together
    for _ in range(rng.randint(1, 8)):
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
            if is_free(x, y, radius, size, balls, walls):
                balls.append((x, y, vx, vy, radius, log_uniform(1e-3, 1e3), elasticity()))
                break
    return Numbers(size, elasticity(), gravity, rng.randint(6, 60), tuple(balls), tuple(walls))


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
    for x0, y0, x1, y1, thickness, _ in walls:
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
    """The worst error of a scene, the number of contacts compared, and where the comparison ended."""

    worst: Error
    contacts: int
    ended: str


Row = Sequence[Decimal]


def places(run: Run) -> list[Row]:
    return [[coordinate for disc in table.discs for coordinate in (disc.x, disc.y)] for table in run.snapshots]


def velocities(run: Run) -> list[Row]:
    return [[component for disc in table.discs for component in (disc.vx, disc.vy)] for table in run.snapshots]


def contact_places(run: Run) -> list[Row]:
    return [contact.at for contact in run.contacts]


def contact_times(run: Run) -> list[Row]:
    return [[contact.time] for contact in run.contacts]


def jumps(run: Run) -> list[Row]:
    """Return by how much each contact changes the velocity of the lighter disc, px/s."""
    return [[contact.impulse / contact.lighter] for contact in run.contacts]


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
        starts = [start, *(start.nudged(NUDGE, seed) for seed in range(TWINS))]
        runs = [run(table, times, MAX_CONTACTS) for table in starts]
        radius = float(min(disc.radius for disc in start.discs))
        horizon = horizon_of(runs, 8 * math.ulp(max(numbers.size)), radius)
        contacts_until = horizon_of(runs, ALLOWED, radius)  # from there on, an allowed error can miss a contact
        position, velocity, contacts = by_exact(numbers, math.ceil(horizon * numbers.rate))
        found = [
            *errors_of_states(runs, position, velocity, horizon),
            *errors_of_contacts(runs, contacts, contacts_until),
        ]
        return Verdict(
            max(found, default=Error(0.0, 0.0, "nothing")),
            sum(contact.time < contacts_until for contact in runs[0].contacts),
            "at the horizon" if horizon < runs[0].until else runs[0].ended or "with the scene",
        )


def errors_of_states(runs: Sequence[Run], position: Floats, velocity: Floats, until: Decimal) -> Iterator[Error]:
    """Yield the errors of exact's positions and velocities, (steps, n, 2), after each step before a time."""
    for part, found in ((places, position), (velocities, velocity)):
        for table, row, grown, other in zip(runs[0].snapshots, part(runs[0]), growth(runs, part), found, strict=False):
            if table.time < until:
                off = largest_difference(row, [Decimal(number) for number in other.ravel().tolist()])
                yield Error(off / (ALLOWED * grown), float(table.time), part.__name__)


def errors_of_contacts(runs: Sequence[Run], found: Contacts, until: Decimal) -> Iterator[Error]:
    """Yield the errors of exact's contacts before a time: of each pair, in their order."""
    pending: dict[tuple[int, int], deque[np.void]] = defaultdict(deque)
    for contact in found:
        pending[int(contact["first"]), int(contact["second"])].append(contact)
    growths = growth(runs, contact_times), growth(runs, jumps)
    for contact, late, wrong in zip(runs[0].contacts, *growths, strict=False):
        if contact.time >= until:
            break
        time, pair = float(contact.time), (contact.first, contact.second)
        if not pending[pair]:
            yield Error(math.inf, time, f"no contact of {pair}")
            return
        other = pending[pair].popleft()
        off = abs(Decimal(float(other["time"])) - contact.time)
        yield Error(float(off) / (ALLOWED * late), time, f"time of contact {pair}")
        off = abs(Decimal(float(other["impulse"])) - contact.impulse) / contact.lighter
        yield Error(float(off) / (ALLOWED * wrong), time, f"impulse of contact {pair}")
    later = {(contact.first, contact.second) for contact in runs[0].contacts if contact.time >= until}
    for pair, rest in pending.items():
        if rest and pair not in later and Decimal(float(rest[0]["time"])) < until - AMBIGUOUS:
            yield Error(math.inf, float(rest[0]["time"]), f"a contact of {pair} too many")


def by_exact(numbers: Numbers, steps: int) -> tuple[Floats, Floats, Contacts]:
    """Run a scene in exact: positions and velocities after each step, (steps, n, 2), and the contacts."""
    scene = parse(numbers.toml(), "random.toml")
    engine = ExactEngine(scene, spawn(scene))
    engine.contacts()
    states = States.empty(steps, len(numbers.balls))
    engine.advance(steps, *states)
    return states.position, states.velocity, engine.contacts()


@pytest.mark.parametrize("count", sizes(24, slow=900))
def test_exact_agrees_with_an_independent_program_in_50_digits(count: int) -> None:
    """The comparison of a scene ends with it, or at the horizon; or before contacts without end."""
    verdicts = {seed: compare(draw(seed)) for seed in range(count)}
    wrong = {seed: verdict for seed, verdict in verdicts.items() if verdict.worst.share > 1}
    print(f"\n{sum(verdict.contacts for verdict in verdicts.values())} contacts compared\n")
    print("comparison ended   scenes   agree   worst error, as a share of what is allowed")
    for ended in sorted({verdict.ended for verdict in verdicts.values()}):
        some = {seed: verdict for seed, verdict in verdicts.items() if verdict.ended == ended}
        seed, worst = max(some.items(), key=lambda item: item[1].worst)
        agree = len(some.keys() - wrong.keys())
        print(f"{ended:16} {len(some):8} {agree:7}   {worst.worst.share:.1e}: {worst.worst.what}, seed {seed}")
    assert not wrong
