"""The event queue: one event per disc, and a tournament tree over them.

Every node of the tree is the earliest of its four children, so the root is the earliest of all. When a disc's event
changes, the matches on its way up are replayed, as far as their outcome changes. M. Marín and P. Cordero (Comput. Phys.
Commun. 92 (1995) 214) found such trees the fastest queue for hard discs. Four children instead of two, because they
share a cache line.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, kernel
from sandbox.engines.exact.records import aligned

NO_PARTNER: Final = 2**31 - 1  # ranks behind every partner
CHILDREN: Final = 4  # of a node, which share a cache line

NODE: Final = np.dtype([("time", "f8"), ("disc", "i8")])


class EventQueue(NamedTuple):
    """The next event of each disc, and the tree over these events.

    disc: (n,) DISC; event: (n,) EVENT; node: NODE, times in s. Node 0 is the root, the children of node k are
    4 k + 1 to 4 k + 4, and the last n nodes are the discs' own.
    """

    disc: NDArray[np.void]
    event: NDArray[np.void]
    node: NDArray[np.void]


def empty_queue(disc: NDArray[np.void], event: NDArray[np.void]) -> EventQueue:
    """Return a queue in which no disc has an event yet."""
    n = len(disc)
    disc["hit"], event["crossing"], event["partner"] = np.inf, np.inf, NO_PARTNER
    inner = -(-(n - 1) // (CHILDREN - 1))
    # Siblings begin on a cache line; the nodes behind the last disc never win.
    node = aligned(CHILDREN * inner + CHILDREN, NODE)[CHILDREN - 1 :]
    node["time"] = np.inf
    node["disc"][inner : inner + n] = np.arange(n)
    return EventQueue(disc, event, node)


@kernel
def rank(queue: EventQueue, i: int, partner: int) -> tuple[np.int64, np.int64]:
    """Return the order of events of equal time: by ball, then by partner, where a wall (~piece) precedes a ball."""
    a = np.int64(queue.event[i].ball)
    if partner < 0 or partner == NO_PARTNER:
        return a, np.int64(partner)
    b = np.int64(queue.event[partner].ball)
    return min(a, b), max(a, b)


@kernel
def _rank_of_next(queue: EventQueue, i: int) -> tuple[np.int64, np.int64]:
    crosses = queue.event[i].crossing < queue.disc[i].hit
    return rank(queue, i, NO_PARTNER if crosses else np.int64(queue.event[i].partner))


@kernel
def _precedes(queue: EventQueue, a: Record, b: Record) -> bool:
    if a.time != b.time or a.time == np.inf:
        return a.time < b.time
    return _rank_of_next(queue, a.disc) < _rank_of_next(queue, b.disc)


@kernel
def schedule(queue: EventQueue, i: int) -> None:
    """Update the tree for disc i's event: its next contact, or its crossing if that is earlier."""
    node = queue.node
    k = (len(node) - 1) // CHILDREN + i
    node[k].time = min(queue.disc[i].hit, queue.event[i].crossing)
    while k > 0:
        k = (k - 1) // CHILDREN
        winner = node[CHILDREN * k + 1]
        for child in range(CHILDREN * k + 2, CHILDREN * k + CHILDREN + 1):
            if _precedes(queue, node[child], winner):
                winner = node[child]
        # A match that i neither won before nor wins now changes nothing above it.
        if node[k].disc == winner.disc and winner.disc != i:
            break
        node[k].time, node[k].disc = winner.time, winner.disc


@kernel
def runner_up(queue: EventQueue) -> int:
    """Return the disc whose event is most likely to follow the next one: the root's second best child."""
    node = queue.node
    second = node[0]
    time = np.inf
    for child in range(1, min(CHILDREN + 1, len(node))):
        if node[child].disc != node[0].disc and node[child].time < time:
            second = node[child]
            time = second.time
    return second.disc
