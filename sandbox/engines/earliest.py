"""Which of many events is next: a tree of winners, one event a disc.

Every node holds the earlier of its two children, the root the earliest of all. To change a disc's time is to replay
its matches on the way up, as far as their outcome changes: log2(n) of them at most. M. Marín and P. Cordero, "An
empirical assessment of priority queues in event-driven molecular dynamics simulation", Comput. Phys. Commun. 92
(1995) 214, found none faster for discs.
"""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

NODE: Final = np.dtype([("time", "f8"), ("disc", "i8")])


class Queue(NamedTuple):
    """Node 1 is the root, node k the winner of 2k and 2k + 1; node n + i is disc i's own.

    node: (2n,) NODE, times in s; rank: (n,), decides between equal times, the lower is earlier.
    """

    node: NDArray[np.void]
    rank: NDArray[np.int64]


def empty_queue(n: int) -> Queue:
    """Make the queue of n discs to which nothing will ever happen."""
    node = np.empty(2 * n, NODE)
    node["time"] = np.inf
    node["disc"] = np.arange(2 * n) - n
    for k in range(n - 1, 0, -1):
        node["disc"][k] = node["disc"][2 * k]
    return Queue(node, np.zeros(n, np.int64))


@njit
def schedule(queue, i, time, rank):  # type: ignore[no-untyped-def]
    """Set when disc i's next event is (s), and its rank among events of the same time."""
    node = queue.node
    k = len(queue.rank) + i
    queue.rank[i] = rank
    node[k].time = time
    while k > 1:
        k //= 2
        left, right = node[2 * k], node[2 * k + 1]
        if left.time < right.time or (left.time == right.time and queue.rank[left.disc] <= queue.rank[right.disc]):
            winner = left
        else:
            winner = right
        # A match that i neither won before nor wins now leaves all above as they are.
        if node[k].disc == winner.disc and winner.disc != i:
            break
        node[k].time = winner.time
        node[k].disc = winner.disc
