"""The event loop: process the earliest event, predict the next one of each disc concerned, and so on.

Kernels see to discs that fly, hit each other, and lie on walls. Where discs collapse into each other, jam or wake a
heap, the loop stops, and `engine` has that done.
"""

from typing import Final, NamedTuple

from sandbox.compiled import kernel
from sandbox.engines.contact_log import Log
from sandbox.engines.exact.contact import bounce, collapses, collide, wakes
from sandbox.engines.exact.event_queue import crosses
from sandbox.engines.exact.prediction import predict, update_prediction
from sandbox.engines.exact.support import MAX_SUPPORTS
from sandbox.engines.exact.world import World
from sandbox.engines.grid import NONE, enter, leave

MAX_ROWS_PER_EVENT: Final = 2 * MAX_SUPPORTS + 1  # of the log: what carried two discs until then, and a contact

# Why the event loop stops.
UP_TO_DATE: Final = 0  # there is no event until the time it was given
UNFINISHED: Final = 1  # it has processed many events, or the log is full
COLLAPSE: Final = 2  # the disc is in a sequence of impacts that may have no end
WAKE: Final = 3  # something hits the disc, of a static island, so fast that it wakes it
JAM: Final = 4  # a disc has so many slow contacts that it must be examined
NOTHING: Final = 5  # nothing stops it: the contact is resolved here


class Stop(NamedTuple):
    """Why the event loop stops, and when (s). disc: that the reason names; collisions, events: processed."""

    reason: int
    disc: int
    time: float
    collisions: int
    events: int


@kernel
def simulate(world: World, since: float, until: float, jams_from: float, max_events: int, log: Log) -> Stop:
    """Process the events until a time (s), or until something else than an event is due.

    since: s, the start of the step; jams_from: s, before which no jam is examined; max_events: after which it stops.
    """
    earliest, collisions = world.node[0], 0
    for events in range(max_events):
        now, i = earliest.time, earliest.disc
        if now > until:
            return Stop(UP_TO_DATE, NONE, until, collisions, events)
        if log.filled[0] + MAX_ROWS_PER_EVENT > len(log.row):
            return Stop(UNFINISHED, NONE, now, collisions, events)
        partner, jams = world.event[i].partner, False
        if crosses(world, i):
            _enter_next_cell(world, i, now)
            continue
        if partner >= 0 and world.disc[partner].serial != world.event[i].partner_serial:
            predict(world, i, now)  # the partner has changed course: a new prediction is due, and no contact
            continue
        reason, disc = _interruption(world, i, partner, now)
        if reason != NOTHING:
            return Stop(reason, disc, now, collisions, events)

        if partner < 0:
            jams = bounce(world, i, ~partner, since, now, log)
            predict(world, i, now)
        else:
            first, second = (i, partner) if world.event[i].ball < world.event[partner].ball else (partner, i)
            jams = collide(world, first, second, since, now, log)
            collisions += 1
            predict(world, first, now)
            predict(world, second, now)
        if jams and now >= jams_from:
            return Stop(JAM, NONE, now, collisions, events + 1)
    return Stop(UNFINISHED, NONE, earliest.time, collisions, max_events)


@kernel
def _interruption(world: World, i: int, partner: int, now: float) -> tuple[int, int]:
    """Return why a contact is left to `engine`, and of which disc, or NOTHING."""
    if collapses(world, i, now):
        return COLLAPSE, i
    if partner >= 0 and collapses(world, partner, now):
        return COLLAPSE, partner
    if partner >= 0 and world.has_gravity:
        if wakes(world, i, partner, now):
            return WAKE, i
        if wakes(world, partner, i, now):
            return WAKE, partner
    return NOTHING, NONE


@kernel
def _enter_next_cell(world: World, i: int, now: float) -> None:
    """Move disc i to the next cell, where it can newly meet the cell's walls and the discs of the three cells ahead."""
    event, stride = world.event[i], world.grid.stride
    offset = event.cell_offset
    leave(world.grid, world.disc, i, event.cell)
    event.cell += offset
    enter(world.grid, world.disc, i, event.cell)
    ahead = event.cell + offset
    corner, columns, rows = (ahead - stride, 1, 3) if abs(offset) == 1 else (ahead - 1, 3, 1)
    update_prediction(world, i, now, corner, columns, rows)
