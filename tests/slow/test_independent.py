"""The exact engine beside an independent program in 50 digits, in random scenes.

What is compared: places, velocities, angles, spins, what walls gave to each disc, and each contact, to 1e-9 times the
growth of an error. A comparison ends with the scene; or at the horizon, where a few units in the last place have grown
to a radius; or just before something that the independent program has no law for: a disc comes to rest on another, on
the round end of a wall or in a corner, or it has two contacts at once whose order matters.

Contacts without end (a collapse) are compared through, by what they leave. Where that is discs that lean on each other,
the comparison ends there, with their velocities to within a few of the hops in which `exact` lets them part.
"""

import math
import random
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal, localcontext
from itertools import accumulate, pairwise
from typing import Final, NamedTuple

import numpy as np
import pytest
from collapses_in_decimal import CLOCK_ERROR
from conftest import sizes
from discs_at_random import draw, draw_rattling
from discs_in_decimal import Contact, Noise, Run, Streak, run
from impacts_in_decimal import speeds
from roots_in_decimal import DIGITS
from scene_in_decimal import STEPS, Numbers
from table_in_decimal import Table

from sandbox.engines import advance
from sandbox.engines.exact import ExactEngine
from sandbox.engines.exact.contact import HOP_TIME
from sandbox.scene.files import parse
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, Floats, States

MAX_CONTACTS: Final = 1000
ALLOWED: Final = 1e-9  # px, and px/s and s, times the growth
NUDGE: Final = Decimal("1e-20")  # px, px/s and rad/s, by which the twins' starts differ
LATER_NUDGE: Final = NUDGE / 10  # at each step, since errors grow that are made after others have decayed
TWINS: Final = 2
ROUNDED: Final = 0.1
# Runs with rounding. An error that one sequence of roundings dominates is about Gaussian, in exact as in such a run, so
# that of exact exceeds 1 / ROUNDED times the largest of three with a probability of 1e-3, and of a single one of 0.06.
ROUNDED_RUNS: Final = 3
# ulp, by which a contact is early or late: half of one for each coordinate of two discs, along a diagonal normal.
ROUNDING: Final = math.sqrt(2)
HOPS: Final = 4  # by which leaning discs may be faster or slower
FINE_RATE: Final = 1_000_000  # so that a state after a contact is much earlier than the next one
AMBIGUOUS: Final = Decimal("1e-6")  # s, within which a contact is looked for, and may be beyond the end instead


class Error(NamedTuple):
    """How far exact is off at a time (s), as a share of what is allowed; `inf` for a contact that only one has."""

    share: float
    time: float
    what: str


class Verdict(NamedTuple):
    """The worst error of a scene, what was compared of its time (0 to 1) and its contacts, and where that ended.

    streaks: of contacts that were resolved at one time.
    """

    worst: Error
    compared: float
    contacts: int
    streaks: int
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
    """Return how much larger the twins' differences in a part have become at each time, or were before; at least 1.

    What runs with rounding are off is ROUNDED of what is allowed: an error in a streak grows more the smaller it is.
    """
    truth, *others = map(part, runs)
    scales = [float(NUDGE)] * TWINS + [ROUNDED * ALLOWED] * ROUNDED_RUNS
    largest = (
        max(largest_difference(row, other) / scale for other, scale in zip(rows, scales, strict=True))
        for row, *rows in zip(truth, *others, strict=False)
    )
    return list(accumulate(largest, max, initial=1.0))[1:]


def allowed_at(run: Run, time: Decimal) -> float:
    """Return the error that is allowed at a time, but for its growth; after a collapse, of the fastest motion."""
    return ALLOWED * max((float(streak.fastest) for streak in run.streaks if streak.time < time), default=1.0)


def horizon_of(runs: Sequence[Run], error: float, radius: float) -> Decimal:
    """Return when an error of the start (px) has grown to a radius (px); if it never does, when the runs end."""
    truth = runs[0]
    moments = [
        *zip((table.time for table in truth.snapshots), growth(runs, places), strict=False),
        *zip((contact.time for contact in truth.contacts), growth(runs, contact_places), strict=False),
    ]
    return min((time for time, grown in moments if grown * error >= radius), default=first_end(runs).until)


def first_end(runs: Sequence[Run]) -> Run:
    """Return the run that ends first: how an error grows after that is not known."""
    return min(runs, key=lambda run: run.until)


def compare(numbers: Numbers) -> Verdict:
    """Compare exact with the independent program, up to where a few units in the last place have grown to a radius."""
    start = numbers.table()
    with localcontext(prec=DIGITS):
        times = [Decimal(step) / numbers.rate for step in range(1, STEPS + 1)]
        early = Decimal(2 * ROUNDING * math.ulp(max(numbers.size)))
        noises = [Noise(random.Random(seed), NUDGE, LATER_NUDGE) for seed in range(TWINS)]
        noises += [Noise(random.Random(seed), early=early) for seed in range(ROUNDED_RUNS)]
        runs = [run(start, times, MAX_CONTACTS, noise) for noise in (None, *noises)]
        runs[0] = replace(runs[0], streaks=(*runs[0].streaks, *streaks_at_once(runs[0].contacts)))
        radius = float(min(disc.radius for disc in start.discs))
        horizon = horizon_of(runs, 8 * math.ulp(max(numbers.size)), radius)
        contacts_until = horizon_of(runs, ALLOWED, radius / 1000)  # from there on, an allowed error can miss a contact
        states, contacts = by_exact(numbers, math.ceil(horizon * numbers.rate))
        found = [
            *errors_of_states(runs, states, horizon),
            *errors_of_contacts(runs, contacts, contacts_until, np.array([float(disc.mass) for disc in start.discs])),
        ]
        last = first_end(runs)
        if runs[0].leaning and contacts_until > runs[0].until - CLOCK_ERROR:
            found.append(error_of_leaning(numbers, runs[0].leaning))
        return Verdict(
            max(found, default=Error(0.0, 0.0, "nothing")),
            float(horizon / times[-1]),
            sum(contact.time < contacts_until for contact in runs[0].contacts),
            sum(streak.time < contacts_until for streak in runs[0].streaks),
            "at the horizon" if horizon < last.until else last.ended or "with the scene",
        )


def streaks_at_once(contacts: Sequence[Contact]) -> list[Streak]:
    """Return the contacts that double precision cannot order, and which exact resolves at one time."""
    streaks: list[Streak] = []
    for a, b in pairwise(contacts):
        if b.time - a.time < CLOCK_ERROR:
            since, fastest = a.time, max(abs(a.slip), abs(b.slip), a.impulse / a.lighter, b.impulse / b.lighter)
            if streaks and streaks[-1].time == a.time:
                since, _, before = streaks.pop()
                fastest = max(fastest, before)
            streaks.append(Streak(since, b.time, fastest))
    return streaks


def errors_of_states(runs: Sequence[Run], states: Sequence[Floats], until: Decimal) -> Iterator[Error]:
    """Yield the errors of exact's states after each step before a time: its positions, velocities and so on."""
    for part, found in zip((places, velocities, angles, spins, pushes), states, strict=True):
        for table, row, grown, other in zip(runs[0].snapshots, part(runs[0]), growth(runs, part), found, strict=False):
            if table.time < until:
                off = largest_difference(row, [Decimal(number) for number in other.ravel().tolist()])
                yield Error(off / (allowed_at(runs[0], table.time) * grown), float(table.time), part.__name__)


def errors_of_contacts(runs: Sequence[Run], contacts: Contacts, until: Decimal, mass: Floats) -> Iterator[Error]:
    """Yield the errors of exact's contacts before a time, and whether it has others of two discs.

    It reports each bounce that the independent program has; besides, it may report what a wall gives to a disc that
    lies on it, of which only the sum is compared, as a push. So it is with contacts near a streak that was resolved at
    one time, and with those that change velocities by less than an error may. Where bodies approach at less than
    1 px/s, the time of a contact is as exact as the gap between them. mass: kg.
    """
    streaks = [(float(since - AMBIGUOUS), float(time + AMBIGUOUS)) for since, time, _ in runs[0].streaks]
    for since, time in streaks:
        contacts = contacts[(contacts["time"] < since) | (contacts["time"] > time)]
    truth = [contact for contact in runs[0].contacts if contact.time < until]
    growths = growth(runs, contact_times), growth(runs, jumps), growth(runs, slips)
    of_discs = Counter((contact.first, contact.second) for contact in truth if contact.second >= 0)
    negligible = allowed_at(runs[0], until) * max(growth(runs, velocities), default=1.0)
    for contact, late, wrong, slipped in zip(truth, *growths, strict=False):
        time, pair = float(contact.time), (contact.first, contact.second)
        is_felt = float(contact.impulse / contact.lighter) > negligible
        if not is_felt or any(since <= time <= ended for since, ended in streaks):
            continue
        allowed = allowed_at(runs[0], contact.time)
        rows = contacts[(contacts["first"] == pair[0]) & (contacts["second"] == pair[1])]
        near = rows[np.abs(rows["time"] - time) < max(float(AMBIGUOUS), allowed * late)]
        if not len(near):
            yield Error(math.inf, time, f"no contact of {pair}")
            return
        row = near[np.abs(near["impulse"] - float(contact.impulse)).argmin()]
        exact = {name: Decimal(float(row[name])) for name in ("time", "impulse", "tangential", "slip")}
        gap = float(abs(exact["time"] - contact.time) * min(Decimal(1), contact.impulse / contact.lighter))
        yield Error(gap / (allowed * late), time, f"time of contact {pair}")
        off = max(abs(exact["impulse"] - contact.impulse), abs(exact["tangential"] - contact.tangential))
        yield Error(float(off / contact.lighter) / (allowed * wrong), time, f"impulse of contact {pair}")
        yield Error(float(abs(exact["slip"] - contact.slip)) / (allowed * slipped), time, f"slip of contact {pair}")
    clearly_before = contacts[(contacts["second"] >= 0) & (contacts["time"] < float(until - AMBIGUOUS))]
    lighter = np.minimum(mass[clearly_before["first"]], mass[clearly_before["second"]])
    clearly_before = clearly_before[clearly_before["impulse"] > negligible * lighter]
    for pair, count in Counter(map(tuple, clearly_before[["first", "second"]].tolist())).items():
        if count > of_discs[pair]:
            yield Error(math.inf, float(until), f"{count} contacts of {pair} instead of {of_discs[pair]}")


def error_of_leaning(numbers: Numbers, table: Table) -> Error:
    """Return the error of exact's velocities just after impacts that leave discs leaning, as a share of HOPS hops."""
    fine = replace(numbers, rate=FINE_RATE)
    states, _ = by_exact(fine, int(table.time * FINE_RATE) + 1)
    rows = np.column_stack([states[1][-1], states[3][-1] * [float(disc.radius) for disc in table.discs]])
    off = max(
        abs(Decimal(found) - speed)
        for disc, row in zip(table.discs, rows.tolist(), strict=True)
        for speed, found in zip(speeds(disc), row, strict=True)
    )
    hop = math.hypot(*numbers.gravity) * HOP_TIME / 2
    return Error(float(off) / (HOPS * hop), float(table.time), "velocities of leaning discs")


def by_exact(numbers: Numbers, steps: int) -> tuple[list[Floats], Contacts]:
    """Run a scene in exact: the states after each step, and what walls have given over the masses; the contacts."""
    scene = parse(numbers.toml(), "random.toml")
    engine = ExactEngine(scene, spawn(scene))
    engine.record_contacts()
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
    streaks = sum(verdict.streaks for verdict in verdicts.values())
    lines = [f"{contacts} contacts, {streaks} streaks resolved at one time, {compared:.0%} of the time compared", ""]
    lines += ["comparison ended   scenes   agree   worst error, as a share of what is allowed"]
    for ended in sorted({verdict.ended for verdict in verdicts.values()}):
        some = {seed: verdict for seed, verdict in verdicts.items() if verdict.ended == ended}
        seed, worst = max(some.items(), key=lambda item: item[1].worst)
        agree = sum(verdict.worst.share <= 1 for verdict in some.values())
        lines.append(f"{ended:16} {len(some):8} {agree:7}   {worst.worst.share:.1e}: {worst.worst.what}, seed {seed}")
    return "\n".join(lines)


def check(scenes: Mapping[int, Numbers]) -> None:
    """Compare some scenes, by seed, and print a table."""
    verdicts = {seed: compare(numbers) for seed, numbers in scenes.items()}
    print(f"\n{table_of(verdicts)}")
    assert not {seed: verdict for seed, verdict in verdicts.items() if verdict.worst.share > 1}


@pytest.mark.wide
@pytest.mark.parametrize("count", sizes(5, slow=900))
def test_exact_agrees_with_an_independent_program_in_50_digits(count: int) -> None:
    check({seed: draw(seed, rough=False) for seed in range(count)})


@pytest.mark.parametrize("count", sizes(5, slow=300))
def test_exact_agrees_with_friction_and_spin_too(count: int) -> None:
    check({seed: draw(seed, rough=True) for seed in range(count)})


@pytest.mark.wide
@pytest.mark.parametrize("seeds", [range(20, 30), pytest.param(range(500), marks=pytest.mark.slow)])
def test_exact_agrees_where_discs_rattle(seeds: range) -> None:
    check({seed: draw_rattling(seed) for seed in seeds})
