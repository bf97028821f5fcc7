"""Where an engine and the reference part: the contacts that they do not have alike, and why.

Contacts are matched by pair and time. One of the reference's that has no match is missing, one of the engine's is
extra; of those that match, some come in another order than in the reference, and some end otherwise: with other
velocities. The cause is what the ledger says of that contact. Where that explains less than half of the difference, the
two balls came into the contact otherwise, and the cause is what was done to their places before.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple

import numpy as np

from sandbox.analysis.causes import CAUSE, SHARE
from sandbox.analysis.explain import _NOT_ITS_OWN, _ON_THE_WAY, _UNCONVERGED, explain, explain_passage
from sandbox.analysis.ledger import LONGEST, Booked, Integers
from sandbox.analysis.tunnelling import Passage
from sandbox.quantity import length
from sandbox.scene.model import Scene, Vector
from sandbox.state import Bools, Contacts

MOST: Final = 200  # differences that are told of one engine
LOOKED: Final = 20_000  # contacts, of the first of which they are

Kind = Literal["outcome", "missing", "extra", "order"]
Velocities = tuple[Vector, ...]


@dataclass(frozen=True)
class Difference:
    """A contact that an engine and the reference do not have alike."""

    kind: Kind
    time: float  # s: in the engine; in the reference where it is missing
    first: int  # ball
    second: int  # ball, or ~wall
    cause: str  # of CAUSES
    because: str  # in words
    before: Velocities | None  # px/s of the ball or balls in the engine; None where missing
    after: Velocities | None
    should_before: Velocities | None  # in the reference; None where extra
    should_after: Velocities | None


def who(scene: Scene, one: Difference | Passage) -> str:
    """Name the two that a difference, or a passage, is of."""
    first, second = one.first, one.second
    return f"balls {first} and {second}" if second >= 0 else f"ball {first} and {scene.wall_name(~second)}"


class Account(NamedTuple):
    """An engine's contacts, what the ledger says of each, and where it told of none."""

    contacts: Contacts
    rows: Booked
    missed: Sequence[Passage]


class Place(NamedTuple):
    """Where a difference is: numbers of the contact in the engine and in the reference, -1 where there is none."""

    time: float
    kind: Kind
    mine: int
    right: int
    size: float  # px/s by which it ends otherwise


def differences(scene: Scene, mine: Account, right: Account, until: float, end: float) -> tuple[Difference, ...]:
    """Tell what an engine and the reference do not have alike up to a time (s), in order of time.

    end: s, up to which the contacts are there: what is near it may be answered later.
    Where all velocities agree it is the contacts that put balls in other places. At most MOST are told, of the first
    LOOKED contacts.
    """
    for account in (mine, right):
        if len(account.contacts) > LOOKED:
            until = min(until, float(account.contacts["time"][LOOKED]))
    pairs = _Pairs(scene, mine, right, until, end)
    places = sorted([*pairs.otherwise(), *pairs.alone()])[:MOST]
    if not places:
        return tuple(pairs.tell(place) for place in pairs.astray())
    found = [pairs.tell(place) for place in places]
    if not found[0].cause:
        found[:1] = pairs.with_cause(places[0], found[0])
    return tuple(one if one.cause else _inherited(one, found[0]) for one in found)


def _inherited(one: Difference, since: Difference) -> Difference:
    """Say that a contact differs because others did before."""
    because = f"The balls are on other courses since {since.time:.3f} s."
    return replace(one, cause=since.cause, because=because)


class _Pairs:
    """The contacts of one engine, each with the reference's that it answers to."""

    def __init__(self, scene: Scene, mine: Account, right: Account, until: float, end: float) -> None:
        self.scene, self.mine, self.right = scene, mine, right
        slack = LONGEST / scene.rate
        self.until = min(until, end - slack)
        self.answers, self.answered = _match(mine.contacts, right.contacts, until, slack)

    def otherwise(self) -> Iterator[Place]:
        """Find what both have, and what ends with other velocities, or comes in another order."""
        matched = np.flatnonzero(self.answers >= 0)
        answers = self.answers[matched]
        contacts, mine, right = self.mine.contacts[matched], self.mine.rows[matched], self.right.rows[answers]
        fall = np.multiply.outer(contacts["time"] - self.right.contacts["time"][answers], self.scene.gravity)
        difference = mine["after"] - right["after"] - fall[:, None]
        difference[contacts["second"] < 0, 1] = 0.0
        size = length(difference).max(axis=1)
        fastest = np.maximum(np.abs(mine["before"]).max(axis=(1, 2)), np.abs(right["before"]).max(axis=(1, 2)))
        disordered = self._disordered(matched)
        for at in np.flatnonzero((size > SHARE * fastest) | disordered).tolist():
            kind: Kind = "order" if disordered[at] else "outcome"
            yield Place(float(contacts["time"][at]), kind, int(matched[at]), int(answers[at]), float(size[at]))

    def alone(self) -> Iterator[Place]:
        """Find what only one of the two has."""
        given = self.mine.contacts["impulse"][: len(self.answers)] != 0
        for k in np.flatnonzero((self.answers < 0) & given).tolist():
            time = float(self.mine.contacts["time"][k])
            if time <= self.until:
                yield Place(time, "extra", k, -1, math.inf)
        for r in np.flatnonzero(~self.answered).tolist():
            time = float(self.right.contacts["time"][r])
            if time <= self.until:
                yield Place(time, "missing", -1, r, math.inf)

    def astray(self) -> Iterator[Place]:
        """Find the contacts that put balls where they should not be."""
        radius = self.scene.bodies.radius[self.mine.contacts["first"][: len(self.answers)]]
        for k in np.flatnonzero(self.mine.rows["moved"][: len(self.answers)] > SHARE * radius)[:MOST].tolist():
            yield Place(float(self.mine.contacts["time"][k]), "outcome", k, int(self.answers[k]), 0.0)

    def with_cause(self, place: Place, one: Difference) -> list[Difference]:
        """Find why a contact that is right by itself, or is none, differs: by what was done to the two before."""
        contacts, balls = self.mine.contacts[: len(self.answers)], [one.first, one.second]
        earlier = np.isin(contacts["first"], balls) | np.isin(contacts["second"], [ball for ball in balls if ball >= 0])
        moved = np.where(earlier & (contacts["time"] < one.time), self.mine.rows["moved"][: len(contacts)], 0.0)
        if moved.max(initial=0.0) > SHARE * self.scene.bodies.radius[one.first]:
            k = int(moved.argmax())
            return [self.tell(Place(float(contacts["time"][k]), "outcome", k, int(self.answers[k]), 0.0)), one]
        if place.kind == "missing":
            return [replace(one, cause="missed", because=self._brief(place.right))]
        if place.kind == "order":
            because = (
                "Several contacts were found late, at the end of a step, and resolved in another order than they came."
            )
            return [replace(one, cause="late", because=because)]
        cause, because = self._from_elsewhere(place)
        return [replace(one, cause=cause, because=because)]

    def _from_elsewhere(self, place: Place) -> tuple[str, str]:
        """Find why a contact that is right by itself differs: another of its time, the reference, or the way there."""
        contact, row = self.mine.contacts[place.mine], self.mine.rows[place.mine]
        if _is_beside_unconverged(self.mine, contact):
            return "unconverged", _UNCONVERGED
        if place.right >= 0:
            its, right = self.right.contacts[place.right], self.right.rows[place.right]
            if self._explains(its, right, place.size):
                return CAUSE[right["cause"]], f"{_NOT_ITS_OWN} {explain(self.scene, its, right)}"
            if _is_beside_unconverged(self.right, its):
                return "unconverged", f"{_NOT_ITS_OWN} {_UNCONVERGED}"
            after = float(contact["time"] - its["time"])
            turned = math.acos(min(1.0, float(contact["normal"] @ its["normal"])))
            alike = np.abs(row["before"] - right["before"]).max() <= SHARE * np.abs(row["before"]).max()
            if alike and turned > SHARE and after:
                when = f"{1e3 * abs(after):.3g} ms {'after' if after > 0 else 'before'} the reference"
                because = f"Found {when}, on a normal that is turned by {math.degrees(turned):.2g}°."
                return "late" if after > 0 else "early", because
        cause = "gravity" if any(self.scene.gravity) else "friction" if self.scene.bodies.friction.any() else "untold"
        passage = self._passage(self.right, place.time, int(contact["first"]), int(contact["second"]))
        if place.kind == "extra" and (passage or cause == "untold"):
            said = f"{_NOT_ITS_OWN} {explain_passage(self.scene, passage)}" if passage else ""
            return "missed", said or f"The reference has no such contact within {self._slack}."
        return cause, _ON_THE_WAY[cause]

    @property
    def _slack(self) -> str:
        return f"{1e3 * LONGEST / self.scene.rate:.3g} ms"

    def _brief(self, r: int) -> str:
        """Say why a contact of the reference's may be missing."""
        contact, row = self.right.contacts[r], self.right.rows[r]
        first, second = int(contact["first"]), int(contact["second"])
        if second >= 0 and row["approach"] > 0:
            reach = float(self.scene.bodies.radius[[first, second]].sum())
            together = 2 * reach * float(row["approach"]) / float(np.sum((row["before"][0] - row["before"][1]) ** 2))
            if together * self.scene.rate < 1:
                return f"The two would overlap for {1e3 * together:.2g} ms, less than a step, which can miss them."
        return f"The engine has no such contact within {self._slack}."

    def _disordered(self, matched: Integers) -> Bools:
        """Tell after which contacts a ball has one that comes earlier in the reference."""
        last: dict[int, int] = {}
        found = np.zeros(len(matched), bool)
        balls = zip(*(self.mine.contacts[key][matched].tolist() for key in ("first", "second")), strict=True)
        for at, pair in enumerate(balls):
            for ball in pair:
                if ball >= 0 and ball in last and self.answers[matched[last[ball]]] > self.answers[matched[at]]:
                    found[last[ball]] = True
                last[ball] = at
        return found

    def tell(self, place: Place) -> Difference:
        """Describe a difference. Its cause is left empty where the contact itself does not explain it."""
        mine = self.mine.rows[place.mine] if place.mine >= 0 else None
        right = self.right.rows[place.right] if place.right >= 0 else None
        contact = self.right.contacts[place.right] if mine is None else self.mine.contacts[place.mine]
        first, second = int(contact["first"]), int(contact["second"])
        cause = because = ""
        if mine is None:
            if passage := self._passage(self.mine, place.time, first, second):
                cause, because = "missed", explain_passage(self.scene, passage)
        elif self._explains(contact, mine, place.size):
            cause, because = CAUSE[mine["cause"]], explain(self.scene, contact, mine)
        return Difference(
            place.kind,
            place.time,
            first,
            second,
            cause,
            because,
            *(_of_balls(row, key, second) for row in (mine, right) for key in ("before", "after")),
        )

    def _passage(self, account: Account, time: float, first: int, second: int) -> Passage | None:
        """Find where an engine lets two pass through each other that should have touched at a time (s)."""
        step = time * self.scene.rate
        return next(
            (
                one
                for one in account.missed
                if (one.first, one.second) == (first, second) and 0 <= one.step - step <= 2 * LONGEST
            ),
            None,
        )

    def _explains(self, contact: np.void, row: np.void, size: float) -> bool:
        """Tell whether what is wrong with a contact is half, at least, of what it ends otherwise (px/s)."""
        mass = self.scene.bodies.mass
        lighter = min(mass[contact["first"]], mass[contact["second"]] if contact["second"] >= 0 else math.inf)
        return CAUSE[row["cause"]] != "rounding" and bool(row["wrong"] / lighter >= min(size, abs(row["approach"])) / 2)


def _is_beside_unconverged(account: Account, contact: np.void) -> bool:
    """Tell whether one of a contact's balls had another at the same time, which did not converge."""
    contacts, balls = account.contacts, [ball for ball in (contact["first"], contact["second"]) if ball >= 0]
    beside = np.isin(contacts["first"], balls) | np.isin(contacts["second"], balls)
    beside &= contacts["time"] == contact["time"]
    return bool((account.rows["cause"][beside] == CAUSE.index("unconverged")).any())


def _of_balls(row: np.void | None, key: str, second: int) -> Velocities | None:
    if row is None:
        return None
    return tuple((float(x), float(y)) for x, y in row[key][: 1 if second < 0 else 2])


def _match(mine: Contacts, right: Contacts, until: float, slack: float) -> tuple[Integers, Bools]:
    """Match contacts of the same pair in order, where they are no further apart in time than the slack (s).

    One that gives no impulse answers to none. Returns for each of mine up to a time the number of the other's or -1,
    and which of the other's are matched.
    """
    mine = mine[: np.searchsorted(mine["time"], until + slack, "right")]
    right = right[: np.searchsorted(right["time"], until + slack, "right")]
    waiting: dict[tuple[int, int], list[int]] = defaultdict(list)
    for r in range(len(right) - 1, -1, -1):
        waiting[int(right["first"][r]), int(right["second"][r])].append(r)
    answers = np.full(len(mine), -1)
    answered = np.zeros(len(right), bool)
    given = np.flatnonzero(mine["impulse"])
    columns = (mine[key][given].tolist() for key in ("time", "first", "second"))
    for k, time, first, second in zip(given.tolist(), *columns, strict=True):
        queue = waiting[first, second]
        while queue and right["time"][queue[-1]] < time - slack:
            queue.pop()
        if queue and right["time"][queue[-1]] <= time + slack:
            answers[k] = queue.pop()
            answered[answers[k]] = True
    return answers, answered


# In words
