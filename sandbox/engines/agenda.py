"""What is next: one event a disc, and a tree of winners over them.

Every node of the tree is the earliest of its four children, the root the earliest of all. A disc whose event changes
replays its matches on the way up, as far as their outcome changes. Such trees are what M. Marín and P. Cordero (Comput.
Phys. Commun. 92 (1995) 214) found fastest for discs; four children, not two, because they share a line of the cache.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.engines.kernel import Record, kernel

NOBODY: Final = 2**31 - 1  # no partner; ranks behind every other
FAN: Final = 4  # children of a node

EVENT: Final = np.dtype(
    [
        ("hit", "f8"),  # s, when the next contact is
        ("cross", "f8"),  # s, when the disc leaves its cell
        ("partner", "i4"),  # of the contact: a disc, or ~piece of wall
        ("seen", "i4"),  # the partner's serial when the contact was foreseen
        ("serial", "i4"),  # how often this disc's own flight has changed
        ("way", "i4"),  # to the cell it crosses to: what to add to the cell's number
    ]
)
NODE: Final = np.dtype([("time", "f8"), ("disc", "i8")])


class Agenda(NamedTuple):
    """The events to come.

    event: (n,) EVENT; ball: (n,) the disc's number in the scene, by which ties are broken;
    node: NODE, times in s. Node 0 is the root, k's children are 4 k + 1 to 4 k + 4, the last n are the discs'.
    """

    event: NDArray[np.void]
    ball: NDArray[np.int64]
    node: NDArray[np.void]


def empty_agenda(event: NDArray[np.void], ball: NDArray[np.int64]) -> Agenda:
    """Make the agenda of discs to which nothing will ever happen."""
    n = len(event)
    inner = -(-(n - 1) // (FAN - 1))
    event["hit"], event["cross"], event["partner"] = np.inf, np.inf, NOBODY
    node = np.zeros(FAN * inner + 1, NODE)  # the places behind the last disc are never first
    node["time"] = np.inf
    node["disc"][inner : inner + n] = np.arange(n)
    return Agenda(event, ball, node)


@kernel
def rank(agenda: Agenda, i: int, partner: int) -> tuple[int, int]:
    """Order events of one time by ball, then partner; a wall (as ~piece) comes before a ball."""
    if partner < 0 or partner == NOBODY:
        return agenda.ball[i], np.int64(partner)
    a, b = agenda.ball[i], agenda.ball[partner]
    return min(a, b), max(a, b)


@kernel
def next_of(event: Record) -> tuple[float, int]:
    """Return when a disc's event is (s), and with whom: NOBODY where it crosses into the next cell."""
    if event.hit <= event.cross:
        return event.hit, np.int64(event.partner)
    return event.cross, np.int64(NOBODY)


@kernel
def _precedes(agenda: Agenda, a: Record, b: Record) -> bool:
    if a.time != b.time or a.time == np.inf:
        return a.time < b.time
    event = agenda.event
    return rank(agenda, a.disc, next_of(event[a.disc])[1]) < rank(agenda, b.disc, next_of(event[b.disc])[1])


@kernel
def schedule(agenda: Agenda, i: int) -> None:
    """Put disc i's event in its place among the others."""
    node = agenda.node
    k = (len(node) - 1) // FAN + i
    node[k].time = next_of(agenda.event[i])[0]
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
