"""What explains single contacts: of all laws, times and places that fit, the one with the fewest free numbers.

Ties go to what most of the run shows, with the same parameter. Tied causes that differ are unknown, and so is what a
single contact shows with as many free numbers as it has. What is right wins every tie.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.laws import BOUNCES, BY_NAME, LAWS, Law, Place, places, six_of
from sandbox.judge.observe import FITTED, Met, Singles, When
from sandbox.judge.run import NEVER, dot
from sandbox.judge.thresholds import DOUBTED, FEW, REFUTED
from sandbox.state import Bools, Floats, Integers

CHOICE: Final = np.dtype(
    [
        ("cause", "i8"),  # NOTHING, RIGHT, or a Cause
        ("key", "i8"),  # the number of its key
        ("also", "i8"),  # of another that explains it as well, by the same cause, or NOTHING
        ("value", "f8"),  # of the law's parameter
        ("depth", "f8"),  # px
    ]
)
SAID: Final = np.dtype(  # what is said of contacts, or of islands of them
    [("cause", "i8"), ("law", "U32"), ("place", "U32"), ("also", "U32"), ("value", "f8"), ("depth", "f8")]
)
Said = NDArray[np.void]
NOTHING: Final = -1  # the cause of what nothing explains
RIGHT: Final = -2  # the cause of what is as it should be
ANYWHERE: Final = "?"  # the place of balls that a law leaves elsewhere than any rule puts them
UNTOUCHED: Final = "none"  # the law of balls that are only put elsewhere
FREE_LAW, FREE_VALUE, FREE_ODD, FREE_ANYWHERE = 0.25, 1.0, 0.8, 3.0  # numbers that a candidate takes to fit
DOUBTFUL: Final = 2.0  # free numbers, from which on a single contact proves nothing


class Key(NamedTuple):
    """What a contact is explained by: a time, a place and a law."""

    when: When
    place: str
    law: str

    @property
    def is_right(self) -> bool:
        """Whether the law is that of contacts, so that only the time or the place may be wrong."""
        return not self.law or self.law in BOUNCES


class Candidate(NamedTuple):
    """What may explain contacts: (k,) of each but the free numbers and the key."""

    free: float
    key: Key
    cause: Integers
    value: Floats
    fits: Bools
    depth: Floats

    @property
    def is_constant(self) -> bool:
        """Whether its law has one parameter in all contacts."""
        return self.key.law in BY_NAME and BY_NAME[self.key.law].constant

    @property
    def is_doubtful(self) -> bool:
        """Whether a single contact proves nothing of it."""
        is_loose = self.key.place == ANYWHERE or self.free >= DOUBTFUL or self.key.law == "moment"
        return is_loose or (self.is_constant and int(np.count_nonzero(self.fits)) >= FEW)

    def support(self) -> Floats:
        """Return how many contacts show what each does, with the same parameter."""
        support = np.full(len(self.fits), float(np.count_nonzero(self.fits)))
        if not np.isnan(self.value[self.fits]).all():
            digits = three_digits(np.abs(self.value[self.fits]))
            _, back, times = np.unique(digits, return_inverse=True, return_counts=True)
            support[self.fits] = times[back]
        return support

    def proof(self, count: int) -> float:
        """Return how many of so many contacts must show what is doubtful: two, or a share of those that can."""
        if self.key.place == ANYWHERE:
            return max(2.0, DOUBTED * count)
        return max(2.0, 2 * DOUBTED * np.count_nonzero(self.fits)) if self.is_constant else 2.0


@dataclass
class Chosen:
    """What explains contacts. rows: CHOICE, (k,); keys: of all of them."""

    rows: NDArray[np.void]
    keys: list[Key]

    @classmethod
    def none(cls, count: int) -> "Chosen":
        """Return that nothing explains so many contacts yet."""
        return cls(np.array([(NOTHING, NOTHING, NOTHING, np.nan, np.nan)] * count, CHOICE), [])

    def number(self, key: Key) -> int:
        """Return the number of a key."""
        if key not in self.keys:
            self.keys.append(key)
        return self.keys.index(key)

    def those(self, which: Sequence[bool]) -> Bools:
        """Return which contacts have a key of some. which: of all keys."""
        have: Bools = np.array([*which, False])[self.rows["key"]]  # that of no key is the last
        return have

    def said(self) -> Said:
        """Return what is said of contacts, SAID."""
        said, rows = np.zeros(len(self.rows), SAID), self.rows
        for name in ("cause", "value", "depth"):
            said[name] = rows[name]
        laws, of_places = (np.array([*names, ""]) for names in zip(*((k.law, k.place) for k in self.keys), strict=True))
        said["law"], said["place"], said["also"] = laws[rows["key"]], of_places[rows["key"]], laws[rows["also"]]
        return said


def explain(s: Singles) -> Chosen:
    """Return what explains each contact: those in time and those at the end of a step first, which most are."""
    chosen, left = Chosen.none(len(s.dt)), np.arange(len(s.dt))
    for when in (When.TOUCH, When.END):
        part = s.part(left)
        met = part.met(when)
        fits = met.is_valid & met.closes & (part.miss(met.six, six_of(met.due, met.rub)) <= part.tol)
        fits &= next((ok for place, ok in places(part, met) if not place.name), False)
        rows, depth, key = left[fits], met.depth[fits], chosen.number(Key(when, "", ""))
        for name, values in (("cause", _by_depth(depth, s.run.tiny)), ("depth", depth), ("key", key)):
            chosen.rows[name][rows] = values
        left = left[~fits]
    if len(left):
        choose(s.part(left), chosen, left)
    _doubt_repeated(s, chosen)
    return chosen


def _by_depth(depth: Floats, least: float) -> Integers:
    """Return the causes of right contacts by how deep the bodies are in each other, px."""
    return np.where(depth > least, Cause.LATE, np.where(depth < -least, Cause.EARLY, RIGHT))


def _doubt_repeated(s: Singles, chosen: Chosen) -> None:
    """Doubt what a ball that comes back within a step is said to do: it has several contacts, of which this is one."""
    met, cause = s.met(When.TOUCH), chosen.rows["cause"]
    falls = dot(np.asarray(s.run.pull), met.n)
    with np.errstate(all="ignore"):
        back = 2 * s.e * dot(met.v[0], met.n) / falls < s.dt - s.touch
    again = ~s.pair & (s.touch < NEVER) & (falls > 0) & back
    is_timed = np.isin(cause, [RIGHT, Cause.LATE]) & ~chosen.those([key.when in FITTED for key in chosen.keys])
    cause[again & ~is_timed] = NOTHING


class Case(NamedTuple):
    """Contacts where they may be resolved, the causes that their depths show, and what may have become of places."""

    met: Met
    by_depth: Integers
    places: list[tuple[Place, Bools]]


def _cases(s: Singles) -> Iterator[Case]:
    for met in s.all_met():
        least = max(s.run.tiny, 1e-4 * float(s.run.r.min())) if met.when in FITTED else s.run.tiny
        yield Case(met, _by_depth(met.depth, least), places(s, met))


def choose(s: Singles, chosen: Chosen, rows: Integers) -> None:
    """Find what explains contacts, for some rows of what is chosen: each law, at each time, with each place."""
    candidates = [candidate for case in _cases(s) for candidate in _right(s, case)]
    left = ~np.any([c.fits for c in candidates if c.free < DOUBTFUL] or [np.zeros(len(rows), bool)], axis=0)
    _decide(candidates, chosen, rows)
    if left.any():
        part, candidates = s.part(left), []
        for case in _cases(part):
            candidates += _right(part, case)
            if case.met.when != When.TURNED and case.met.is_valid.any():
                candidates += (candidate for law in LAWS for candidate in _wrong(part, law, case))
        _decide(candidates, chosen, rows[left])


def _right(s: Singles, case: Case) -> Iterator[Candidate]:
    """Yield what has the right law, or no impulse."""
    c = case.met
    laws = [("", six_of(c.due, c.rub), c.closes)]
    if c.when in (When.END, When.START):
        laws.append((UNTOUCHED, six_of(0 * c.due, 0 * c.due), np.ones(len(c.due), bool)))
    for law, six, may in laws:
        right = c.is_valid & may & (s.miss(c.six, six) <= s.tol + c.slack)
        for place, fits in case.places if right.any() else ():
            causes = case.by_depth if place.cause is None else np.full(len(fits), place.cause)
            if law:
                causes = np.where(c.depth > -s.run.tiny, Cause.POSITION_CORRECTION, Cause.TELEPORTED)
            if (right & fits).any() and (place.name or not law):
                key, free = Key(c.when, place.name, law), FITTED.get(c.when, 0.0) + place.free
                yield Candidate(free, key, causes, np.full(len(fits), np.nan), right & fits, c.depth)


def _wrong(s: Singles, law: Law, case: Case) -> Iterator[Candidate]:
    """Yield what has another law of contact."""
    c = case.met
    if law.of_pairs and not c.pair.any():
        return
    with np.errstate(all="ignore"):
        says = law.formula(c, None)
        ok = c.is_valid & says.may & (c.closes | law.parting) & (c.pair | (not law.of_pairs))
        ok &= s.miss(c.six, says.six) <= s.tol + c.slack
    if not ok.any():
        return
    value = np.full(len(ok), np.nan) if says.value is None else says.value
    reads = FREE_VALUE if law.reads or law.constant else FREE_LAW
    free = FITTED.get(c.when, 0.0) + reads + FREE_ODD * law.odd
    causes = np.full(len(ok), law.cause) if says.causes is None else says.causes
    for place, fits in case.places:
        if law.name in BOUNCES:
            causes = case.by_depth if place.cause is None else np.full(len(ok), place.cause)
        if (ok & fits).any():
            yield Candidate(free + place.free, Key(c.when, place.name, law.name), causes, value, ok & fits, c.depth)
    if c.when in (When.TOUCH, When.END):
        key = Key(c.when, ANYWHERE, law.name)
        yield Candidate(free + FREE_ANYWHERE, key, causes, value, ok, c.depth)


def _decide(candidates: list[Candidate], chosen: Chosen, rows: Integers) -> None:
    """Choose for each contact the candidate with the fewest free numbers, and of these the most frequent."""
    if not candidates:
        return
    fits, cause, value, depth = (
        np.array([getattr(c, name) for c in candidates]) for name in ("fits", "cause", "value", "depth")
    )
    support, at = np.array([c.support() for c in candidates]), np.arange(len(rows))
    rank = np.where(fits, np.array([[c.free] for c in candidates]) * 1e7 - support, np.inf)
    best = rank.argmin(axis=0)
    tied, said = fits & (rank == rank[best, at]), cause[best, at]
    proof = np.array([c.proof(len(chosen.rows)) for c in candidates])[best]
    is_doubted = np.array([c.is_doubtful for c in candidates])[best] & (support[best, at] < proof)
    said = np.where((tied & (cause != said)).any(axis=0) | is_doubted, Cause.UNKNOWN, said)
    said[(tied & (cause == RIGHT)).any(axis=0)] = RIGHT
    others = tied & (np.arange(len(candidates))[:, None] != best)
    number = np.array([chosen.number(c.key) for c in candidates])
    also = np.where(others.any(axis=0), number[others.argmax(axis=0)], NOTHING)
    for name, column in (("cause", said), ("key", number[best]), ("also", also)):
        chosen.rows[name][rows] = np.where(tied.any(axis=0), column, chosen.rows[name][rows])
    for name, columns in (("value", value), ("depth", depth)):
        chosen.rows[name][rows] = np.where(tied.any(axis=0), columns[best, at], chosen.rows[name][rows])


def three_digits(values: Floats) -> Floats:
    """Return values rounded to three digits, as sentences have them."""
    with np.errstate(all="ignore"):
        unit = 10.0 ** (np.floor(np.log10(np.abs(values))) - 2)
        rounded: Floats = np.where(np.isfinite(unit) & (unit > 0), np.round(values / unit) * unit, values)
    return rounded


def doubt_faults(chosen: Chosen, kicked: Bools) -> None:
    """Name no law as wrong that most others refute, and none where many come early or fit nothing: chance explains it.

    kicked: (k,) which change a velocity; the others only put balls elsewhere.
    """
    cause, key = chosen.rows["cause"], chosen.rows["key"]
    loose = ((cause == NOTHING) & kicked) | (cause == Cause.EARLY)
    faults = chosen.those([key.law in BY_NAME and not key.is_right for key in chosen.keys]) & (cause >= 0)
    laws = np.array([key.law for key in chosen.keys] + [""])[key]
    for law in np.unique(laws[faults]).tolist():
        if np.count_nonzero(laws == law) < REFUTED * np.count_nonzero(kicked):
            cause[faults & (laws == law)] = Cause.UNKNOWN
    if np.count_nonzero(loose) > DOUBTED * np.count_nonzero(kicked):
        cause[faults] = Cause.UNKNOWN
