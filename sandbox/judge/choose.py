"""What explains single contacts: of all laws, times and places that fit, the one with the fewest free numbers.

Ties go to what most of the run shows, with the same parameter. Tied causes that differ are unknown, and so is what a
single contact shows with as many free numbers as it has. What is right wins every tie.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.laws import BOUNCES, BY_NAME, LAWS, Law, Place, places, six_of
from sandbox.judge.observe import FITTED, Met, Singles, When
from sandbox.judge.thresholds import ALIKE, DOUBTED, FEW, REFUTED
from sandbox.state import Bools, Floats, Integers

NAME: Final = "U24"
SAID: Final = np.dtype(  # what is said of contacts, or of islands of them
    [
        ("cause", "i8"),  # NOTHING, RIGHT, or a Cause
        ("when", NAME),
        ("law", NAME),
        ("place", NAME),
        ("also", NAME),  # another law that explains it as well, by the same cause
        ("value", "f8"),  # of the law's parameter
        ("depth", "f8"),  # px
    ]
)
Said = NDArray[np.void]
NOTHING: Final = -1  # the cause of what nothing explains
RIGHT: Final = -2  # the cause of what is as it should be
ANYWHERE: Final = "?"  # the place of balls that a law leaves elsewhere than any rule puts them
UNTOUCHED: Final = "none"  # the law of balls that are only put elsewhere
FREE_LAW, FREE_VALUE, FREE_ANYWHERE = 0.25, 1.0, 3.0  # numbers that a candidate takes to fit
EVERY: Final = 1e7  # more contacts than there are in a block
DOUBTFUL: Final = 2.0  # free numbers, from which on a single contact proves nothing


class Candidate(NamedTuple):
    """What may explain contacts, by a time, a place and a law: (k,) of each of the others but the free numbers."""

    free: float
    when: When
    law: str
    place: str
    cause: Integers
    value: Floats
    fits: Bools
    depth: Floats

    def support(self) -> Floats:
        """Return how many contacts show what each does, with the same parameter."""
        support = np.full(len(self.fits), float(np.count_nonzero(self.fits)))
        if not np.isnan(self.value[self.fits]).all():
            with np.errstate(divide="ignore"):
                alike = np.round(np.log(np.abs(self.value[self.fits])) / ALIKE)
            _, back, times = np.unique(alike, return_inverse=True, return_counts=True)
            support[self.fits] = times[back]
        return support

    def proof(self, count: int) -> float:
        """Return how many of so many contacts must show what one alone does not prove: two, or a share of them."""
        fits = np.count_nonzero(self.fits)
        if self.place == ANYWHERE:
            return max(2.0, DOUBTED * count)
        if fits >= FEW and self.law in BY_NAME and BY_NAME[self.law].constant:
            return max(2.0, 2 * DOUBTED * fits)
        return 2.0 if self.free >= DOUBTFUL else 0.0


def nothing_said(count: int) -> Said:
    """Return SAID of contacts, (count,), that nothing explains yet."""
    return np.full(count, np.array((NOTHING, "", "", "", "", np.nan, np.nan), SAID))


def is_right(said: Said) -> Bools:
    """Return where the law of contacts is right, so that only the time or the place may be wrong: (k,)."""
    right: Bools = np.isin(said["law"], ["", *BOUNCES])
    return right


def is_fault(said: Said) -> Bools:
    """Return where the law of contacts is wrong, not only the time or the place: (k,)."""
    wrong: Bools = ~(is_right(said) | (said["law"] == UNTOUCHED))
    return wrong


class Case(NamedTuple):
    """Contacts where they may be resolved, the causes that their depths show, and what may have become of places."""

    met: Met
    by_depth: Integers
    places: list[tuple[Place, Bools]]


def _cases(s: Singles) -> Iterator[Case]:
    for met in s.all_met():
        least = max(s.run.tiny, 1e-4 * float(s.run.r.min())) if met.when in FITTED else s.run.tiny
        by_depth = np.where(met.depth > least, Cause.LATE, np.where(met.depth < -least, Cause.EARLY, RIGHT))
        yield Case(met, by_depth, places(s, met))


def choose(s: Singles) -> Said:
    """Return what explains contacts: the right law at each time, with each place, and then each other law."""
    said, rows = nothing_said(len(s.dt)), np.arange(len(s.dt))
    candidates = [candidate for case in _cases(s) for candidate in _right(s, case)]
    left = ~np.any([c.fits for c in candidates if c.free < DOUBTFUL] or [np.zeros(len(rows), bool)], axis=0)
    _decide(candidates, said, rows)
    if left.any():
        part, candidates = s.part(left), []
        for case in _cases(part):
            candidates += _right(part, case)
            if case.met.when != When.TURNED and case.met.is_valid.any():
                candidates += (candidate for law in LAWS for candidate in _wrong(part, law, case))
        _decide(candidates, said, rows[left])
    return said


def _right(s: Singles, case: Case) -> Iterator[Candidate]:
    """Yield what has the right law, or no impulse."""
    c = case.met
    laws, nan = [("", six_of(c.due, c.rub), c.closes)], np.full(len(c.due), np.nan)
    if c.when in (When.END, When.START):
        laws.append((UNTOUCHED, six_of(0 * c.due, 0 * c.due), np.ones(len(c.due), bool)))
    for law, six, may in laws:
        right = c.is_valid & may & (s.miss(c.six, six) <= s.tol + c.slack)
        if not law and c.when in (When.TOUCH, When.END):  # no wrong law explains what only the place is wrong with
            nothing = np.full(len(right), NOTHING)
            yield Candidate(FREE_ANYWHERE, c.when, law, ANYWHERE, nothing, nan, right, c.depth)
        for place, fits in case.places if right.any() else ():
            causes = case.by_depth if place.cause is None else np.full(len(fits), place.cause)
            if law:
                causes = np.where(c.depth > -s.run.tiny, Cause.POSITION_CORRECTION, Cause.TELEPORTED)
            if (right & fits).any() and (place.name not in ("", "apart") or not law):
                free = FITTED.get(c.when, 0.0) + place.free
                yield Candidate(free, c.when, law, place.name, causes, nan, right & fits, c.depth)


def _wrong(s: Singles, law: Law, case: Case) -> Iterator[Candidate]:
    """Yield what has another law of contact."""
    c = case.met
    with np.errstate(all="ignore"):
        says = law.formula(c, None)
        ok = c.is_valid & says.may & (c.closes | law.parting) & (c.pair | (not law.of_pairs))
        ok &= s.miss(c.six, says.six) <= s.tol + c.slack
    if not ok.any():
        return
    value = np.full(len(ok), np.nan) if says.value is None else says.value
    free = FITTED.get(c.when, 0.0) + (FREE_VALUE if law.reads or law.constant else FREE_LAW)
    causes = np.full(len(ok), law.cause) if says.causes is None else says.causes
    for place, fits in case.places:
        if law.name in BOUNCES:
            causes = case.by_depth if place.cause is None else np.full(len(ok), place.cause)
        if (ok & fits).any():
            yield Candidate(free + place.free, c.when, law.name, place.name, causes, value, ok & fits, c.depth)
    if c.when in (When.TOUCH, When.END):
        yield Candidate(free + FREE_ANYWHERE, c.when, law.name, ANYWHERE, causes, value, ok, c.depth)


def _decide(candidates: list[Candidate], said: Said, rows: Integers) -> None:
    """Choose for each contact the candidate with the fewest free numbers, and of these the most frequent."""
    if not candidates:
        return
    table = {name: np.array([getattr(c, name) for c in candidates]) for name in Candidate._fields}
    fits, cause, at = table["fits"], table["cause"], np.arange(len(rows))
    support = np.array([c.support() for c in candidates])
    support[cause == RIGHT] = EVERY
    rank = np.where(fits, table["free"][:, None] * 10 * EVERY - support, np.inf)
    best = rank.argmin(axis=0)
    tied, named = fits & (rank == rank[best, at]), cause[best, at]
    is_doubted = support[best, at] < np.array([c.proof(len(said)) for c in candidates])[best]
    is_doubted |= (tied & (cause != named)).any(axis=0)
    named = np.where(is_doubted & (named != NOTHING), Cause.UNKNOWN, named)
    others = tied & (np.arange(len(candidates))[:, None] != best)
    also = np.where(others.any(axis=0), table["law"][others.argmax(axis=0)], "")
    columns = {name: table[name][best] for name in ("when", "law", "place")}
    columns |= {"cause": named, "also": also, "value": table["value"][best, at], "depth": table["depth"][best, at]}
    is_found = tied.any(axis=0)
    for name, column in columns.items():
        said[name][rows[is_found]] = column[is_found]


def doubt_faults(said: Said, kicked: Bools) -> None:
    """Name no law as wrong that most others refute, and none where many come early or fit nothing: chance explains it.

    kicked: (k,) which change a velocity; the others only put balls elsewhere.
    """
    cause, law = said["cause"], said["law"]
    loose, faults = ((cause == NOTHING) & kicked) | (cause == Cause.EARLY), is_fault(said) & (cause >= 0)
    for name in np.unique(law[faults]).tolist():
        if np.count_nonzero(law == name) < REFUTED * np.count_nonzero(kicked):
            cause[faults & (law == name)] = Cause.UNKNOWN
    if np.count_nonzero(loose) > DOUBTED * np.count_nonzero(kicked):
        cause[faults] = Cause.UNKNOWN
