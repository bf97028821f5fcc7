"""The event loop, and the functions that Python calls: `start`, `run`, `kick`, `snapshot`.

`run` processes the earliest event, predicts the next one of each disc concerned, and so on until the time is up.
"""

import math
from typing import Final

import numpy as np

from sandbox.compiled import Record, entry, kernel, prefetch
from sandbox.engines.exact.contact import bounce, collide
from sandbox.engines.exact.event_queue import runner_up, schedule
from sandbox.engines.exact.grid import enter, leave, prefetch_around
from sandbox.engines.exact.prediction import predict, predict_crossing, predict_discs, predict_walls
from sandbox.engines.exact.world import World, motion, move_to_now, release
from sandbox.state import Contacts, Floats

MAX_EVENTS_PER_CALL: Final = 1_000_000  # of `run`: about a second's, so that Ctrl-C can end an endless step


@kernel
def _leave_cell(world: World, i: int, now: float) -> None:
    """Release disc i if it is held; otherwise move it to the next cell.

    There it can newly meet the cell's walls and the discs of the three cells ahead.
    """
    event, stride = world.event[i], world.grid.stride
    offset = np.int64(event.cell_offset)
    if offset == 0:
        move_to_now(world, i, now)
        release(world, i)
        predict(world, i, now)
        return
    leave(world.grid, world.disc, i, event.cell)
    event.cell += offset
    enter(world.grid, world.disc, i, event.cell)
    m = motion(world, i, now)
    predict_walls(world, i, m, now)
    if abs(offset) == 1:
        predict_discs(world, i, m, now, event.cell + offset - stride, 1, 3)
    else:
        predict_discs(world, i, m, now, event.cell + offset - 1, 3, 1)
    predict_crossing(world, i, m, now)
    schedule(world.queue, i)


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
def _write_row(row: Record, time: float, first: int, second: int, contact: tuple[float, float, float, float]) -> None:
    row.time, row.first, row.second = time, first, second
    row.normal[0], row.normal[1], row.impulse, row.depth = contact


@kernel
def _process_events(
    world: World, until: float, log: Contacts, count: int, max_events: int, collect: bool
) -> tuple[int, int, int]:
    """Process events up to a time (s), or until the log is full, or up to a number of events.

    Returns the number of rows filled in the log, of contacts between discs, and of events left.
    """
    disc, event, root = world.disc, world.event, world.queue.node[0]
    collisions = 0
    while root.time <= until and count < len(log) and max_events > 0:
        now, i = root.time, np.int64(root.disc)
        max_events -= 1
        _prefetch_event(world, runner_up(world.queue))
        partner = np.int64(event[i].partner)
        if event[i].crossing < disc[i].hit:
            _leave_cell(world, i, now)
        elif partner < 0:
            contact = bounce(world, i, ~partner, now)
            predict(world, i, now)
            if collect and contact[2] > 0:
                _write_row(log[count], now, np.int64(event[i].ball), ~world.piece[~partner].wall, contact)
                count += 1
        elif disc[partner].serial != event[i].partner_serial:
            predict(world, i, now)
        else:
            _prefetch_contact(world, i)
            _prefetch_contact(world, partner)
            i, j = (i, partner) if event[i].ball < event[partner].ball else (partner, i)
            contact = collide(world, i, j, now)
            predict(world, i, now)
            predict(world, j, now)
            collisions += 1
            if collect:
                _write_row(log[count], now, np.int64(event[i].ball), np.int64(event[j].ball), contact)
                count += 1
    return count, collisions, max_events


@kernel
def _log_resting_contacts(world: World, now: float, dt: float, log: Contacts, count: int) -> int:
    """Log a contact for each disc that a wall carries, with its impulse in this step since its last contact.

    dt: s, of a step. Returns the number of rows filled.
    """
    for i in range(len(world.disc)):
        event, body = world.event[i], world.body[i]
        x, y = world.gravity[0] - body.ax, world.gravity[1] - body.ay
        pull = math.hypot(x, y)
        if event.carrier >= 0 and pull > 0:
            impulse = body.mass * pull * min(dt, now - body.last_contact)
            contact = (x / pull, y / pull, impulse, 0.0)
            _write_row(log[count], now, np.int64(event.ball), ~world.piece[event.carrier].wall, contact)
            count += 1
    return count


@kernel
def _write_state(world: World, now: float, position: Floats, velocity: Floats) -> None:
    for i in range(len(world.disc)):
        m, ball = motion(world, i, now), world.event[i].ball
        position[ball, 0], position[ball, 1] = m.x, m.y
        velocity[ball, 0], velocity[ball, 1] = m.vx, m.vy


@entry
def run(
    world: World, steps_before: int, rate: int, position: Floats, velocity: Floats, log: Contacts, collect: bool
) -> tuple[int, int, int]:
    """Process the events of some steps, and write the state after each: (steps, n, 2) px, px/s, in scene order.

    Stops early if the log is full, or after MAX_EVENTS_PER_CALL; the next call continues from there. log: (capacity,)
    CONTACT, with more rows than discs, which gets a row per contact if `collect`. Returns the number of steps
    completed, of rows filled, and of contacts between discs.
    """
    count, collisions, events_left = 0, 0, MAX_EVENTS_PER_CALL
    for step in range(len(position)):
        now = (steps_before + step + 1) / rate
        count, more, events_left = _process_events(world, now, log, count, events_left, collect)
        collisions += more
        if world.queue.node[0].time <= now or len(log) - count < len(world.disc):
            return step, count, collisions
        if collect and world.has_gravity:
            count = _log_resting_contacts(world, now, 1 / rate, log, count)
        _write_state(world, now, position[step], velocity[step])
    return len(position), count, collisions


@entry
def snapshot(world: World, now: float, position: Floats, velocity: Floats) -> None:
    """Write the position and velocity of each ball now, in scene order: (n, 2) px, px/s."""
    _write_state(world, now, position, velocity)


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
