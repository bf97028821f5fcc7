"""The event queue: one event per disc, and a tournament tree over them.

Every node of the tree is the earliest of its four children, so the root is the earliest of all. When a disc's event
changes, the matches on its way up are replayed, as far as their outcome changes. M. Marín and P. Cordero (Comput. Phys.
Commun. 92 (1995) 214) found such trees the fastest queue for hard discs. Four children instead of two make
it less deep.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, kernel
from sandbox.engines.exact.world import NODE, World

NO_PARTNER: Final = 2**31 - 1  # ranks behind every partner
CHILDREN: Final = 4  # of a node


def empty_queue(count: int) -> NDArray[np.void]:
    """Return the tree of discs that have no event yet.

    Node 0 is the root, the children of node k are 4 k + 1 to 4 k + 4, and the last n nodes are the discs' own.
    """
    inner = -(-(count - 1) // (CHILDREN - 1))
    node = np.zeros(CHILDREN * inner + 1, NODE).view(np.recarray)
    node["time"] = np.inf  # also of the nodes behind the last disc
    node["disc"][inner : inner + count] = np.arange(count)
    return node


@kernel
def rank(world: World, i: int, partner: int) -> tuple[int, int]:
    """Return the order of events of equal time: by ball, then by partner, where a wall (~piece) precedes a ball."""
    a = world.event[i].ball
    if partner < 0 or partner == NO_PARTNER:
        return a, partner
    b = world.event[partner].ball
    return min(a, b), max(a, b)


@kernel
def crosses(world: World, i: int) -> bool:
    """Return whether disc i enters another cell before its next contact."""
    return world.event[i].crossing < world.disc[i].hit


@kernel
def _precedes(world: World, a: Record, b: Record) -> bool:
    if a.time != b.time or a.time == math.inf:
        return a.time < b.time
    of_a = rank(world, a.disc, NO_PARTNER if crosses(world, a.disc) else world.event[a.disc].partner)
    of_b = rank(world, b.disc, NO_PARTNER if crosses(world, b.disc) else world.event[b.disc].partner)
    return of_a < of_b


@kernel
def schedule(world: World, i: int) -> None:
    """Update the tree for disc i's event: its next contact, or its crossing if that is earlier."""
    node = world.node
    k = (len(node) - 1) // CHILDREN + i
    node[k].time = min(world.disc[i].hit, world.event[i].crossing)
    while k > 0:
        k = (k - 1) // CHILDREN
        winner = node[CHILDREN * k + 1]
        for child in range(CHILDREN * k + 2, CHILDREN * k + CHILDREN + 1):
            if _precedes(world, node[child], winner):
                winner = node[child]
        # A match that i neither won before nor wins now changes nothing above it.
        if node[k].disc == winner.disc and winner.disc != i:
            break
        node[k].time, node[k].disc = winner.time, winner.disc
