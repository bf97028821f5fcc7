"""Which contacts of two engines are the same: matched by pair and time, or by their order."""

from bisect import bisect_left, bisect_right
from collections import defaultdict

import numpy as np

from sandbox.analysis.record import Record
from sandbox.state import Bools, Contacts, Integers


def match_contacts(of_engine: Record, of_other: Record, until: float, slack: float) -> tuple[Integers, Bools]:
    """Match contacts of the same pair: by time, if they are no further apart than the slack (s), else by their order.

    Of several that are near enough, the one with the most similar velocities before is taken. Later than the slack, a
    contact matches if it is the next of both its bodies in the engine and in the reference: then the two have met
    nothing else meanwhile, and one that was missed is not matched with a later one. A contact without an impulse
    matches none. Returns, for each of the engine's contacts up to a time, the number of the reference's or -1, and
    which of the reference's are matched.
    """
    own, reference = of_engine.contacts, of_other.contacts
    reference = reference[: np.searchsorted(reference["time"], until + slack, "right")]
    own_before, before = of_engine.findings["before"], of_other.findings["before"]
    of_reference = np.full(len(own), -1)
    matched = np.zeros(len(reference), bool)
    waiting: dict[tuple[int, int], list[int]] = defaultdict(list)
    for r, pair in enumerate(zip(reference["first"].tolist(), reference["second"].tolist(), strict=True)):
        waiting[pair].append(r)
    begin: dict[tuple[int, int], int] = defaultdict(int)
    times = reference["time"].tolist()
    within = int(np.searchsorted(own["time"], until + slack, "right"))
    has_impulse = np.flatnonzero(own["impulse"])
    columns = (own[key][has_impulse].tolist() for key in ("time", "first", "second"))
    for k, time, first, second in zip(has_impulse.tolist(), *columns, strict=True):
        queue, at = waiting[first, second], begin[first, second]
        while at < len(queue) and times[queue[at]] < time - slack:
            at += 1
        end = at
        while end < len(queue) and times[queue[end]] <= time + slack:
            end += 1
        if end - at > 1:
            at += int(np.abs(before[queue[at:end]] - own_before[k]).max(axis=(1, 2)).argmin())
        if k < within and at < end:
            of_reference[k] = queue[at]
            matched[queue[at]] = True
            at += 1
        begin[first, second] = at
    _match_by_order(own, reference, of_reference, matched)
    count = max(within, int(np.flatnonzero(of_reference >= 0).max(initial=-1)) + 1)
    return of_reference[:count], matched


def _match_by_order(own: Contacts, reference: Contacts, of_reference: Integers, matched: Bools) -> None:
    """Match what is left of the reference's contacts, each with the next of both its bodies since their last match."""
    left = np.flatnonzero(~matched).tolist()
    if not left:
        return
    sequences, expected = _sequences(own), _sequences(reference)
    own_of = {int(of_reference[k]): k for k in np.flatnonzero(of_reference >= 0).tolist()}
    for r in left:
        followers = set()
        for ball in (int(reference["first"][r]), int(reference["second"][r])):
            if ball >= 0:
                earlier = bisect_left(expected[ball], r)
                last = own_of.get(expected[ball][earlier - 1], len(own)) if earlier else -1
                later = sequences[ball][bisect_right(sequences[ball], last) :][:1]
                followers.add(later[0] if later else -1)
        k = followers.pop()
        if k < 0 or followers or of_reference[k] >= 0:
            continue
        if all(own[key][k] == reference[key][r] for key in ("first", "second")):
            of_reference[k], matched[r], own_of[r] = r, True, k


def _sequences(contacts: Contacts) -> dict[int, list[int]]:
    """Return the numbers of each ball's contacts that have an impulse."""
    sequences: dict[int, list[int]] = defaultdict(list)
    for k in np.flatnonzero(contacts["impulse"]).tolist():
        for key in ("first", "second"):
            sequences[int(contacts[key][k])].append(k)
    return sequences
