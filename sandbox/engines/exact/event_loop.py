"""The event loop, and the functions that Python calls: `start`, `run`, `kick`, `snapshot`.

`run` processes the earliest event, predicts the next one of each disc concerned, and so on until the time is up.
"""

from typing import Final

import numpy as np

from sandbox.compiled import entry, kernel, prefetch
from sandbox.engines.contact_log import Log
from sandbox.engines.exact.contact import bounce, collapses, collide, wakes
from sandbox.engines.exact.event_queue import runner_up
from sandbox.engines.exact.grid import enter, leave, prefetch_around
from sandbox.engines.exact.islands import max_reports, plan_next_check, report_islands
from sandbox.engines.exact.prediction import predict, update_prediction
from sandbox.engines.exact.records import NONE, STATIC
from sandbox.engines.exact.support import MAX_SUPPORTS, report_support
from sandbox.engines.exact.touching import is_restless
from sandbox.engines.exact.world import World, motion, move_to_now, release, rotation
from sandbox.state import Floats, States

MAX_EVENTS_PER_CALL: Final = 50_000  # of `run`: about 50 ms, so that Ctrl-C can end an endless step at once
MAX_ROWS_PER_EVENT: Final = 2 * MAX_SUPPORTS + 1  # of the log: what carried two discs until then, and a contact


@kernel
def _enter_next_cell(world: World, i: int, now: float) -> None:
    """Move disc i to the next cell, where it can newly meet the cell's walls and the discs of the three cells ahead."""
    event, stride = world.event[i], world.grid.stride
    offset = np.int64(event.cell_offset)
    leave(world.grid, world.disc, i, event.cell)
    event.cell += offset
    enter(world.grid, world.disc, i, event.cell)
    ahead = event.cell + offset
    corner, columns, rows = (ahead - stride, 1, 3) if abs(offset) == 1 else (ahead - 1, 3, 1)
    update_prediction(world, i, now, corner, columns, rows)


@kernel
def _prefetch_event(world: World, i: int) -> None:
    """Prefetch what is read first when disc i's event comes up."""
    prefetch(world.disc, i)
    prefetch(world.event, i)


@kernel
def _prefetch_contact(world: World, i: int) -> None:
    """Prefetch what a contact reads of disc i and of the discs around it."""
    prefetch(world.body, i)
    prefetch_around(world.grid, world.disc, world.event[i].cell)


@kernel
def _process_events(world: World, since: float, until: float, log: Log, max_events: int) -> tuple[int, int]:
    """Process events from a time to a time (s), or until the log is full, or up to a number of events.

    Also stops where Python must examine discs or wake an island. Returns the number of contacts between discs, and of
    events left.
    """
    disc, event, root, plan = world.disc, world.event, world.queue.node[0], world.rest.plan[0]
    collisions = 0
    while root.time <= until and len(log.row) - log.filled[0] >= MAX_ROWS_PER_EVENT and max_events > 0:
        now, i, j = root.time, np.int64(root.disc), np.int64(NONE)
        max_events -= 1
        if world.has_gravity and plan.is_due:
            break
        _prefetch_event(world, runner_up(world.queue))
        partner = np.int64(event[i].partner)
        if event[i].crossing < disc[i].hit:
            _enter_next_cell(world, i, now)
            continue
        is_due = partner < 0 or disc[partner].serial == event[i].partner_serial
        if is_due and (collapses(world, i, now) or (partner >= 0 and collapses(world, partner, now))):
            plan.collapsing, plan.time = i if collapses(world, i, now) else partner, now
            break
        if partner < 0:
            bounce(world, i, ~partner, since, now, log)
        elif is_due:
            if world.has_gravity and (wakes(world, i, partner, now) or wakes(world, partner, i, now)):
                plan.wake_request, plan.time = i if event[i].carrier == STATIC else partner, now
                break
            _prefetch_contact(world, i)
            _prefetch_contact(world, partner)
            i, j = (i, partner) if event[i].ball < event[partner].ball else (partner, i)
            collide(world, i, j, since, now, log)
            collisions += 1
        # A contact with a disc that has since changed course is not due: only a new prediction is.
        for k in (i, j):
            if k != NONE:
                predict(world, k, now)
    return collisions, max_events


@kernel
def _write_state(world: World, now: float, states: States, row: int) -> None:
    for i in range(len(world.disc)):
        m, ball = motion(world, i, now), world.event[i].ball
        states.position[row, ball, 0], states.position[row, ball, 1] = m.x, m.y
        states.velocity[row, ball, 0], states.velocity[row, ball, 1] = m.vx, m.vy
        if world.is_rough:
            states.angle[row, ball], states.spin[row, ball] = rotation(world, i, now)


@kernel
def _must_examine(world: World, now: float) -> bool:
    """Return whether discs are to be examined, as is planned for now; otherwise plan the next time."""
    for i in range(len(world.disc)):
        if is_restless(world, i, now):
            return True
    plan_next_check(world, now)
    return False


@entry
def run(world: World, times: Floats, states: States, log: Log) -> tuple[int, int]:
    """Process the events of as many steps as there are states, and write the state after each, in scene order.

    Stops early if the log is full, after MAX_EVENTS_PER_CALL, or if Python must do what is planned in `world.rest`;
    the next call continues from there. times: (steps + 1,) s, between the steps; log: with more rows than can be
    reported at the end of a step. Returns the number of steps completed, and of contacts between discs.
    """
    log.filled[0] = 0
    collisions, events_left = 0, MAX_EVENTS_PER_CALL
    plan, root = world.rest.plan[0], world.queue.node[0]
    for step in range(len(states.position)):
        since, now = times[step], times[step + 1]
        until = -np.inf
        while until < now:
            until = min(now, plan.next_check)
            more, events_left = _process_events(world, since, until, log, events_left)
            collisions += more
            if root.time <= until or plan.is_due or len(log.row) - log.filled[0] < max_reports(world):
                return step, collisions
            if until == plan.next_check and _must_examine(world, until):
                plan.is_due, plan.time = 1, until
                return step, collisions
        if world.has_gravity and log.collects:
            if plan.pending_momentum:
                return step, collisions
            for i in range(len(world.disc)):
                report_support(world, i, since, now, log)
            report_islands(world, since, now, log)
        _write_state(world, now, states, step)
    return len(states.position), collisions


@entry
def snapshot(world: World, now: float, states: States) -> None:
    """Write the state of each ball now into the first row, in scene order."""
    _write_state(world, now, states, 0)


@entry
def start(world: World) -> None:
    """Enter every disc in its cell, and predict its first event."""
    for i in range(len(world.disc)):
        enter(world.grid, world.disc, i, world.event[i].cell)
    for i in range(len(world.disc)):
        predict(world, i, world.disc[i].t)


@entry
def kick(world: World, i: int, now: float, dvx: float, dvy: float) -> None:
    """Add to the velocity of disc i (px/s), and predict its next event."""
    move_to_now(world, i, now)
    world.disc[i].vx += dvx
    world.disc[i].vy += dvy
    release(world, i)
    predict(world, i, now)
