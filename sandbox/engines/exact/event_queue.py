"""What is next: one event a disc, and a tree of winners over them.

Every node of the tree is the earliest of its four children, the root the earliest of all. A disc whose event changes
replays its matches on the way up, as far as their outcome changes. Such trees are what M. Marín and P. Cordero (Comput.
Phys. Commun. 92 (1995) 214) found fastest for discs; four children, not two, because they share a line of the cache.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.engines.compiled import Record, kernel
from sandbox.engines.exact.records import aligned

NOBODY: Final = 2**31 - 1  # no partner; ranks behind every other
FAN: Final = 4  # children of a node

NODE: Final = np.dtype([("time", "f8"), ("disc", "i8")])


class Agenda(NamedTuple):
    """The events to come.

    disc: (n,) DISC; event: (n,) EVENT; node: NODE, times in s. Node 0 is the root, the children of k are
    4 k + 1 to 4 k + 4, the last n are the discs' own.
    """

    disc: NDArray[np.void]
    event: NDArray[np.void]
    node: NDArray[np.void]


def empty_agenda(disc: NDArray[np.void], event: NDArray[np.void]) -> Agenda:
    """Make the agenda of discs to which nothing will ever happen."""
    n = len(disc)
    disc["hit"], event["cross"], event["partner"] = np.inf, np.inf, NOBODY
    inner = -(-(n - 1) // (FAN - 1))
    # Siblings begin on a line of the cache; the places behind the last disc never win.
    node = aligned(FAN * inner + FAN, NODE)[FAN - 1 :]
    node["time"] = np.inf
    node["disc"][inner : inner + n] = np.arange(n)
    return Agenda(disc, event, node)


@kernel
def rank(agenda: Agenda, i: int, partner: int) -> tuple[np.int64, np.int64]:
    """Order events of one time by ball, then partner; a wall (as ~piece) comes before a ball."""
    a = np.int64(agenda.event[i].ball)
    if partner < 0 or partner == NOBODY:
        return a, np.int64(partner)
    b = np.int64(agenda.event[partner].ball)
    return min(a, b), max(a, b)


@kernel
def _rank_of_next(agenda: Agenda, i: int) -> tuple[np.int64, np.int64]:
    crosses = agenda.event[i].cross < agenda.disc[i].hit
    return rank(agenda, i, NOBODY if crosses else np.int64(agenda.event[i].partner))


@kernel
def _precedes(agenda: Agenda, a: Record, b: Record) -> bool:
    if a.time != b.time or a.time == np.inf:
        return a.time < b.time
    return _rank_of_next(agenda, a.disc) < _rank_of_next(agenda, b.disc)


@kernel
def schedule(agenda: Agenda, i: int) -> None:
    """Put disc i's event in its place among the others: the next contact, or the crossing if that is earlier."""
    node = agenda.node
    k = (len(node) - 1) // FAN + i
    node[k].time = min(agenda.disc[i].hit, agenda.event[i].cross)
    while k > 0:
        k = (k - 1) // FAN
        winner = node[FAN * k + 1]
        for child in range(FAN * k + 2, FAN * k + FAN + 1):
            if _precedes(agenda, node[child], winner):
                winner = node[child]
        # A match that i neither won before nor wins now leaves all above as they are.
        if node[k].disc == winner.disc and winner.disc != i:
            break
        node[k].time, node[k].disc = winner.time, winner.disc


@kernel
def runner_up(agenda: Agenda) -> int:
    """Return the disc whose event is most likely the one after the next: the root's second best child."""
    node = agenda.node
    second = node[0]
    time = np.inf
    for child in range(1, min(FAN + 1, len(node))):
        if node[child].disc != node[0].disc and node[child].time < time:
            second = node[child]
            time = second.time
    return second.disc
