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
from decimal import Decimal, localcontext
from enum import Enum
from itertools import combinations
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scene.walls import walls_of
from sandbox.state import Floats

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
OPEN: Final = None  # what a contact does in a round, other than to stick, or to slip one way or the other
STICKS: Final = 0

Decimals = Any  # an array of them
Courses = tuple[int | None, ...]  # in a round, of each contact: OPEN, STICKS, or the sign of its slip


class Ending(Enum):
    """How a sequence of impacts ends."""

    PARTED = "parted"
    TOGETHER = "together"
    NO_ROOM = "no room to part"
    UNKNOWN = "neither an end nor a limit"


class Outcome(NamedTuple):
    """What a sequence of impacts leaves.

    motion: (n, 3) px/s, of each disc vx, vy, and radius times spin; impulses: (c, 2) kg px/s along normal and tangent,
    that each contact gave to its second.
    """

    motion: Decimals
    impulses: Decimals
    ending: Ending

    @property
    def speeds(self) -> Floats:
        """The motion in floats."""
        return np.array(self.motion, float)


class Touching:
    """The discs of a scene and their contacts: of discs with walls, then of discs with each other.

    slack: px, of a disc; gaps within it are closed. motion: (3 n,) px/s, at the start; normal, tangent: (c, 3 n), which
    give the speeds of closing and slip; per_mass: (c,) 1/kg, of both bodies; law: (c, 2), elasticity and friction.
    """

    def __init__(self, scene: Scene, slack: float) -> None:
        state, bodies = spawn(scene), scene.bodies
        with localcontext(prec=DIGITS):
            per, rim = 1 / in_decimal(bodies.mass), in_decimal(bodies.radius) * in_decimal(state.spin)
            self.motion = np.column_stack([in_decimal(state.velocity), rim]).ravel()
            self.yields = np.stack([per, per, 2 * per], axis=1).ravel()  # 1/kg
            self.normal, self.tangent = np.full((2, 0, len(self.motion)), ZERO)
            self.law: list[Decimals] = []
            self._find(scene, in_decimal(state.position), Decimal(slack))
            self.per_mass = (self.normal * self.normal) @ self.yields
            touches = (self.tangent != 0).any(axis=0)
            self.still = STILL * np.abs(self.motion[touches]).max(initial=ZERO)  # px/s: a slower approach is none

    def _find(self, scene: Scene, x: Decimals, slack: Decimal) -> None:
        radius = in_decimal(scene.bodies.radius)
        factors = in_decimal(np.stack([scene.bodies.elasticity, scene.bodies.friction], axis=1))
        for k, reach in enumerate(radius + slack):
            for start, end, half_thickness, *of_wall in zip(*map(in_decimal, walls_of(scene)), strict=True):
                dx, dy = end - start
                across = np.array([-dy, dx]) / (dx * dx + dy * dy).sqrt()
                off = across @ (start - x[k])
                if abs(off) - half_thickness <= reach:
                    self._touch(across if off > 0 else -across, (k, 1))
                    self.law.append(factors[k] * of_wall)
        for i, j in combinations(range(len(radius)), 2):
            way = x[j] - x[i]
            distance = (way @ way).sqrt()
            if distance - radius[i] - radius[j] <= 2 * slack:
                self._touch(way / distance, (i, 1), (j, -1))
                self.law.append(factors[i] * factors[j])

    def _touch(self, n: Decimals, *ends: tuple[int, int]) -> None:
        """Add a contact. n: unit normal from the first; ends: discs, the first with 1 and the second with -1."""
        row = np.full((2, 1, len(self.motion)), ZERO)
        for k, sign in ends:
            row[:, 0, 3 * k : 3 * k + 3] = [[sign * n[0], sign * n[1], ZERO], [-sign * n[1], sign * n[0], Decimal(1)]]
        self.normal, self.tangent = np.concatenate([[self.normal, self.tangent], row], axis=1)

    def course(self, k: int, motion: Decimals) -> int | None:
        """Return what contact k does next."""
        closing, (e, friction) = self.normal[k] @ motion, self.law[k]
        if closing <= self.still:
            return OPEN
        slip, largest = self.tangent[k] @ motion, friction * (1 + e) * closing / self.per_mass[k]
        if slip == 0 or friction == 0 or abs(slip) / (3 * self.per_mass[k]) < largest:
            return STICKS
        return 1 if slip > 0 else -1

    def strike(self, k: int, motion: Decimals, given: Decimals, course: int | None) -> None:
        """Resolve one impact of contact k, whatever its course would be by itself, and add its impulses to those given.

        It is linear in the motion. motion: (3 n, ...); given: (2 c, ...).
        """
        if course is OPEN:
            return
        e, friction = self.law[k]
        impulse = (1 + e) * (self.normal[k] @ motion) / self.per_mass[k]
        tangential = course * friction * impulse
        if course == STICKS and friction != 0:
            tangential = self.tangent[k] @ motion / (3 * self.per_mass[k])
        motion -= np.multiply.outer(self.yields * self.normal[k], impulse)
        motion -= np.multiply.outer(self.yields * self.tangent[k], tangential)
        given[2 * k] += impulse
        given[2 * k + 1] += tangential

    def make_round(self, motion: Decimals, given: Decimals, order: Sequence[int]) -> Courses:
        """Resolve each contact that closes, and return what each did."""
        courses = []
        for k in order:
            courses.append(course := self.course(k, motion))
            self.strike(k, motion, given, course)
        return tuple(courses)

    def shuffle(self, motion: Decimals, given: Decimals, rng: random.Random) -> None:
        """Resolve some impacts, each time of a contact that is chosen at random among those that close."""
        for _ in range(SHUFFLED):
            courses = [(k, self.course(k, motion)) for k in range(len(self.law))]
            closing = [(k, course) for k, course in courses if course is not OPEN]
            if not closing:
                return
            k, course = rng.choice(closing)
            self.strike(k, motion, given, course)

    def leap(
        self, motion: Decimals, given: Decimals, rounds: Sequence[Courses], order: Sequence[int]
    ) -> tuple[Decimals, Decimals, bool]:
        """Repeat some rounds 1, 2, 4, 8 ... times at once, as long as all contacts then do as before.

        Returns the motion, the impulses given, and whether this has no end.
        """
        after = in_decimal(np.eye(len(motion)))
        impulses = np.full((len(given), len(motion)), ZERO)
        for courses in rounds:
            for k, course in zip(order, courses, strict=True):
                self.strike(k, after, impulses, course)
        for _ in range(MAX_DOUBLINGS):
            next_motion = after @ motion
            trial = next_motion.copy(), given.copy()
            if any(self.make_round(*trial, order) != courses for courses in rounds):
                return motion, given, False
            motion, given = next_motion, given + impulses @ motion
            after, impulses = after @ after, impulses + impulses @ after
        return motion, given, True


def in_decimal(numbers: Floats) -> Decimals:
    """Return the exact values of numbers."""
    return np.array([Decimal(number) for number in numbers.ravel().tolist()]).reshape(numbers.shape)


def repeated(history: Sequence[Courses]) -> Sequence[Courses]:
    """Return the rounds that the latest ones repeat, if they do, REPEATS times or more."""
    for period in range(1, MAX_PERIOD + 1):
        since = -period * REPEATS
        if len(history) >= -since and history[since:-period] == history[since + period :]:
            return history[-period:]
    return ()


def continued(
    touching: Touching,
    order: Sequence[int] | None = None,
    motion: Decimals | None = None,
    shuffle: random.Random | None = None,
) -> Outcome:
    """Continue a sequence of impacts to its end or limit.

    order: of the contacts in a round, all by default; motion: (3 n,) px/s, to begin with; shuffle: what chooses each of
    the first SHUFFLED impacts.
    """
    with localcontext(prec=DIGITS):
        order = range(len(touching.law)) if order is None else order
        motion, given = (touching.motion if motion is None else motion).copy(), np.full(2 * len(touching.law), ZERO)
        if shuffle:
            touching.shuffle(motion, given, shuffle)
        ending = Ending.UNKNOWN
        history: list[Courses] = []
        for _ in range(MAX_ROUNDS):
            history.append(touching.make_round(motion, given, order))
            if all(course is OPEN for course in history[-1]):
                stays = np.abs(touching.normal @ motion) <= touching.still
                ending = Ending.TOGETHER if (stays & (given[::2] > 0)).any() else Ending.PARTED
                break
            if rounds := repeated(history):
                motion, given, endless = touching.leap(motion, given, [*rounds], order)
                history.clear()
                if endless:
                    ending = Ending.NO_ROOM
                    break
        return Outcome(motion.reshape(-1, 3), given.reshape(-1, 2), ending)


def is_decided(touching: Touching, expected: Outcome) -> bool:
    """Return whether a sequence of impacts leaves the same velocities in other orders, as far as these were tried.

    The contacts are tried backwards, at random, and with one of them after all others have ended.
    """
    tolerance = SAME * np.abs(touching.motion).max()
    others = in_other_orders(touching)
    return expected.ending != Ending.UNKNOWN and all(
        (np.abs(expected.motion - other.motion) <= tolerance).all() for other in others
    )


def in_other_orders(touching: Touching) -> Iterator[Outcome]:
    """Yield what a sequence of impacts leaves in some other orders."""
    count = len(touching.law)
    yield continued(touching, range(count)[::-1])
    for k in range(count):
        before = continued(touching, [*range(k), *range(k + 1, count)])
        yield continued(touching, motion=before.motion.ravel())
    for seed in range(RANDOM_ORDERS):
        yield continued(touching, shuffle=random.Random(seed))
