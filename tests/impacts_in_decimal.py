"""Sequences of impacts at one time and place, one by one in 60 decimal digits: a second opinion on the exact engine.

Bodies that touch exchange impulses contact by contact, by the law of restitution and Coulomb's law of friction, while
nothing moves: only velocities change, and the normals stay. A round resolves each contact that closes, in the order
given. A sequence ends where the bodies part, or has a limit in which they move on together, or, where they have no room
to part, neither.

In a round, each contact is open, sticks or slips one way, and as long as all go on as they do, a round is one linear
map of the velocities. The map of 2, 4, 8 ... rounds is its square, the square of that, and so on. So `continued` makes
steps of doubling length, and after each one makes a round by itself, to see whether all contacts go on as before. So it
reaches the limit in seconds where approach speeds fall by a millionth in each round.

Where two contacts close at one time, no law says which comes first. `is_decided` tries other orders.
"""

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from enum import Enum
from itertools import combinations
from typing import Final, NamedTuple

from scene_in_decimal import Disc, Numbers

DIGITS: Final = 60
ZERO: Final = Decimal(0)
STILL: Final = Decimal("1e-40")  # of the fastest motion at the start: a slower approach is none
MAX_ROUNDS: Final = 5000  # made by themselves
MAX_DOUBLINGS: Final = 150  # of rounds: one map for 1e45 of them
SHUFFLED: Final = 100  # impacts in a random order, before those in rounds
RANDOM_ORDERS: Final = 4  # that are tried
SAME: Final = Decimal("1e-12")  # of the fastest motion: what an order may change
MAX_PERIOD: Final = 6  # rounds, after which all contacts do the same again
REPEATS: Final = 3  # such periods, before a step of more of them

Vector = list[Decimal]
Matrix = list[Vector]


class Touch(NamedTuple):
    """A contact. first: a disc; second: a disc, or ~number of a wall; nx, ny: unit normal from the first to it."""

    first: int
    second: int
    nx: Decimal
    ny: Decimal
    elasticity: Decimal
    friction: Decimal = ZERO


def touches_of(numbers: Numbers, slack: Decimal) -> tuple[list[Disc], list[Touch]]:
    """Return the discs of a scene, and their contacts: gaps within a slack for each disc, px."""
    touches, discs = [], numbers.discs()
    for i, disc in enumerate(discs):
        for number, wall in enumerate(numbers.surfaces()):
            nx, ny, distance = wall.nearest(disc.x, disc.y)
            if distance - disc.radius - wall.half_thickness <= slack:
                e, mu = disc.elasticity * wall.elasticity, disc.friction * wall.friction
                touches.append(Touch(i, ~number, nx, ny, e, mu))
    for (i, a), (j, b) in combinations(enumerate(discs), 2):
        x, y = b.x - a.x, b.y - a.y
        distance = (x * x + y * y).sqrt()
        if distance - a.radius - b.radius <= 2 * slack:
            e, mu = a.elasticity * b.elasticity, a.friction * b.friction
            touches.append(Touch(i, j, x / distance, y / distance, e, mu))
    return discs, touches


class Course(Enum):
    """What a contact does in a round."""

    OPEN = 0
    STICKS = 1
    SLIPS = 2  # its slip is positive
    SLIPS_BACK = 3


Courses = tuple[tuple[Course, ...], ...]  # in rounds, of contacts


class Ending(Enum):
    """How a sequence of impacts ends."""

    PARTED = "parted"
    TOGETHER = "together"
    NO_ROOM = "no room to part"
    UNKNOWN = "neither an end nor a limit"


@dataclass(frozen=True)
class Outcome:
    """What a sequence of impacts leaves.

    discs: with other velocities; impulses: along normal and tangent, kg px/s, that each contact gave to its second;
    stays: whether each contact's bodies neither close nor part.
    """

    discs: list[Disc]
    impulses: list[tuple[Decimal, Decimal]]
    stays: list[bool]
    ending: Ending


def impulses_of(
    closing: Decimal, slip: Decimal, per_mass: Decimal, elasticity: Decimal, friction: Decimal
) -> tuple[Decimal, Decimal]:
    """Return the impulses along normal and tangent of one impact, kg px/s. per_mass: of both bodies, 1/kg."""
    impulse = (1 + elasticity) * closing / per_mass
    limit = friction * impulse
    return impulse, max(-limit, min(limit, slip / (3 * per_mass)))


class Motions:
    """The velocities of discs that touch: of each its vx, vy and that of its rim, radius times spin, in px/s."""

    def __init__(self, discs: Sequence[Disc], touches: Sequence[Touch]) -> None:
        self.touches = touches
        self.per_mass = [1 / disc.mass for disc in discs]
        self.of_touch = [sum((self.per_mass[i] for i, _ in sides(touch)), ZERO) for touch in touches]

    def closing(self, touch: Touch, motion: Vector) -> Decimal:
        """Return the speed at which a contact closes, px/s."""
        return sum((s * (motion[3 * i] * touch.nx + motion[3 * i + 1] * touch.ny) for i, s in sides(touch)), ZERO)

    def slip(self, touch: Touch, motion: Vector) -> Decimal:
        """Return how fast the first's rim slips past the second's, px/s."""
        return sum(
            (
                s * (motion[3 * i + 1] * touch.nx - motion[3 * i] * touch.ny) + motion[3 * i + 2]
                for i, s in sides(touch)
            ),
            ZERO,
        )

    def course(self, k: int, motion: Vector, still: Decimal) -> Course:
        """Return what contact k does next."""
        touch, per_mass = self.touches[k], self.of_touch[k]
        closing = self.closing(touch, motion)
        if closing <= still:
            return Course.OPEN
        slip = self.slip(touch, motion)
        impulse, tangential = impulses_of(closing, slip, per_mass, touch.elasticity, touch.friction)
        if abs(tangential) < touch.friction * impulse or slip == 0 or touch.friction == 0:
            return Course.STICKS
        return Course.SLIPS if slip > 0 else Course.SLIPS_BACK

    def strike(self, k: int, motion: Vector, course: Course) -> tuple[Decimal, Decimal]:
        """Resolve one impact of contact k, whatever its course would be by itself, and return its impulses.

        It is linear in the motion.
        """
        touch, per_mass = self.touches[k], self.of_touch[k]
        impulse = (1 + touch.elasticity) * self.closing(touch, motion) / per_mass
        if touch.friction == 0:
            tangential = ZERO
        elif course == Course.STICKS:
            tangential = self.slip(touch, motion) / (3 * per_mass)
        else:
            tangential = touch.friction * impulse * (1 if course == Course.SLIPS else -1)
        x, y = impulse * touch.nx - tangential * touch.ny, impulse * touch.ny + tangential * touch.nx
        for i, s in sides(touch):
            motion[3 * i] -= s * x * self.per_mass[i]
            motion[3 * i + 1] -= s * y * self.per_mass[i]
            motion[3 * i + 2] -= 2 * tangential * self.per_mass[i]
        return impulse, tangential

    def round_of(self, motion: Vector, given: Vector, still: Decimal) -> tuple[Course, ...]:
        """Resolve each contact that closes, add its impulses to those given, and return what each contact did."""
        courses = []
        for k in range(len(self.touches)):
            courses.append(course := self.course(k, motion, still))
            if course != Course.OPEN:
                impulse, tangential = self.strike(k, motion, course)
                given[2 * k] += impulse
                given[2 * k + 1] += tangential
        return tuple(courses)

    def shuffle(self, motion: Vector, given: Vector, still: Decimal, rng: random.Random) -> None:
        """Resolve some impacts, each time of a contact that is chosen at random among those that close."""
        for _ in range(SHUFFLED):
            courses = [(k, self.course(k, motion, still)) for k in range(len(self.touches))]
            closing = [(k, course) for k, course in courses if course != Course.OPEN]
            if not closing:
                return
            k, course = rng.choice(closing)
            impulse, tangential = self.strike(k, motion, course)
            given[2 * k] += impulse
            given[2 * k + 1] += tangential

    def outcome(self, discs: Sequence[Disc], motion: Vector, given: Vector, still: Decimal, ending: Ending) -> Outcome:
        """Return what a sequence leaves."""
        moved = [
            replace(disc, vx=vx, vy=vy, spin=rim / disc.radius)
            for disc, vx, vy, rim in zip(discs, motion[::3], motion[1::3], motion[2::3], strict=True)
        ]
        impulses = list(zip(given[::2], given[1::2], strict=True))
        stays = [abs(self.closing(touch, motion)) <= still for touch in self.touches]
        is_held = any(stay and impulse > 0 for stay, (impulse, _) in zip(stays, impulses, strict=True))
        if ending == Ending.PARTED and is_held:
            ending = Ending.TOGETHER
        return Outcome(moved, impulses, stays, ending)

    def rounds_of(self, count: int, motion: Vector, given: Vector, still: Decimal) -> Courses:
        """Make some rounds, and return what each contact did in each of them."""
        return tuple(self.round_of(motion, given, still) for _ in range(count))

    def map_of(self, rounds: Courses) -> tuple[Matrix, Matrix]:
        """Return the linear maps from the motion before some rounds to after, and their impulses, by columns."""
        after, given = [], []
        size = 3 * len(self.per_mass)
        for column in range(size):
            motion, impulses = [Decimal(row == column) for row in range(size)], [ZERO] * (2 * len(self.touches))
            for k, course in ((k, course) for courses in rounds for k, course in enumerate(courses)):
                if course != Course.OPEN:
                    impulse, tangential = self.strike(k, motion, course)
                    impulses[2 * k] += impulse
                    impulses[2 * k + 1] += tangential
            after.append(motion)
            given.append(impulses)
        return after, given


def sides(touch: Touch) -> list[tuple[int, int]]:
    """Return the discs of a contact, the first with 1 and the second with -1."""
    return [(i, s) for i, s in ((touch.first, 1), (touch.second, -1)) if i >= 0]


def times(columns: Matrix, vector: Vector) -> Vector:
    """Multiply a matrix, given by its columns, by a vector."""
    return [
        sum((a * b for a, b in zip(row, vector, strict=True) if a and b), ZERO) for row in zip(*columns, strict=True)
    ]


def total(one: Vector, other: Vector) -> Vector:
    return [a + b for a, b in zip(one, other, strict=True)]


def leap(
    motions: Motions, motion: Vector, given: Vector, rounds: Courses, still: Decimal
) -> tuple[Vector, Vector, bool]:
    """Repeat some rounds 1, 2, 4, 8 ... times at once, as long as all contacts then do as before.

    Returns the motion, the impulses given, and whether this has no end.
    """
    after, impulses = motions.map_of(rounds)
    for _ in range(MAX_DOUBLINGS):
        next_motion = times(after, motion)
        if motions.rounds_of(len(rounds), [*next_motion], [*given], still) != rounds:
            return motion, given, False
        motion, given = next_motion, total(given, times(impulses, motion))
        after, impulses = (
            [times(after, column) for column in after],
            [total(column, times(impulses, next_column)) for column, next_column in zip(impulses, after, strict=True)],
        )
    return motion, given, True


def repeated(history: Sequence[tuple[Course, ...]]) -> Courses:
    """Return the rounds that the latest ones repeat, if they do, REPEATS times or more."""
    for period in range(1, MAX_PERIOD + 1):
        since = -period * REPEATS
        if len(history) >= -since and history[since:-period] == history[since + period :]:
            return tuple(history[-period:])
    return ()


def continued(discs: Sequence[Disc], touches: Sequence[Touch], shuffle: random.Random | None = None) -> Outcome:
    """Continue a sequence of impacts to its end or limit. shuffle: what chooses each of the first SHUFFLED impacts."""
    with localcontext(prec=DIGITS):
        motions = Motions(discs, touches)
        motion = [speed for disc in discs for speed in speeds(disc)]
        given = [ZERO] * (2 * len(touches))
        in_touch = {i for touch in touches for i, _ in sides(touch)}
        still = STILL * max((abs(motion[3 * i + k]) for i in in_touch for k in range(3)), default=ZERO)
        if shuffle:
            motions.shuffle(motion, given, still, shuffle)
        ending = Ending.UNKNOWN
        history: list[tuple[Course, ...]] = []
        for _ in range(MAX_ROUNDS):
            history.append(motions.round_of(motion, given, still))
            if all(course == Course.OPEN for course in history[-1]):
                ending = Ending.PARTED
                break
            if rounds := repeated(history):
                motion, given, endless = leap(motions, motion, given, rounds, still)
                history.clear()
                if endless:
                    ending = Ending.NO_ROOM
                    break
        return motions.outcome(discs, motion, given, still, ending)


def is_decided(discs: Sequence[Disc], touches: Sequence[Touch]) -> bool:
    """Return whether a sequence of impacts leaves the same velocities in other orders, as far as these were tried.

    The contacts are tried backwards, at random, and with one of them after all others have ended.
    """
    with localcontext(prec=DIGITS):
        expected = continued(discs, touches)
        if expected.ending == Ending.UNKNOWN:
            return False
        tolerance = SAME * max(abs(speed) for disc in discs for speed in speeds(disc))
        return all(
            abs(a - b) <= tolerance
            for other in in_other_orders(discs, touches)
            for one, another in zip(expected.discs, other.discs, strict=True)
            for a, b in zip(speeds(one), speeds(another), strict=True)
        )


def in_other_orders(discs: Sequence[Disc], touches: Sequence[Touch]) -> Iterator[Outcome]:
    """Yield what a sequence of impacts leaves in some other orders."""
    yield continued(discs, touches[::-1])
    for k in range(len(touches)):
        before = continued(discs, [*touches[:k], *touches[k + 1 :]])
        yield continued(before.discs, touches)
    for seed in range(RANDOM_ORDERS):
        yield continued(discs, touches, shuffle=random.Random(seed))


def speeds(disc: Disc) -> Vector:
    """Return a disc's velocity and that of its rim, px/s."""
    return [disc.vx, disc.vy, disc.radius * disc.spin]
