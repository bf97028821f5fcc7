"""The exact engine: builds the arrays of the event loop from a scene, runs it, and collects its contacts."""
# ruff: noqa: D102 (the interface of an engine documents the methods)

import math
from typing import Final

import numpy as np

from sandbox.engines.contact_log import ContactLog, empty_log
from sandbox.engines.exact.collapse import Collapses
from sandbox.engines.exact.contact import HOP_TIME
from sandbox.engines.exact.event_loop import kick, run, snapshot, start
from sandbox.engines.exact.event_queue import empty_queue
from sandbox.engines.exact.grid import cell_at, empty_grid, morton_order
from sandbox.engines.exact.islands import Islands, max_reports, no_islands
from sandbox.engines.exact.records import BODY, DISC, EVENT, NONE, TURN, aligned
from sandbox.engines.exact.world import World
from sandbox.errors import LimitReached
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.walls import pieces_of
from sandbox.state import Contacts, Floats, State, States
from sandbox.threads import checkpoint

MAX_LOGGED_CONTACTS: Final = 5_000_000  # not yet read: half a GB, and five times that in a comparison
LOG_ROWS: Final = 64  # of a new engine's log, besides `max_reports`; it doubles when it is full
ROUNDING: Final = 1e-9  # of gravity; a weaker pull is rounding


class ExactEngine:
    """Hard discs, event by event. `collisions` counts the contacts between balls.

    hop_time: s, for which discs that lean on each other are apart; where a result depends on it, it is not exact.
    """

    def __init__(self, scene: Scene, initial: State, hop_time: float = HOP_TIME) -> None:
        self._clock = scene.clock
        self._start = initial.time  # s, of the run
        self._steps = 0
        self._world = _world(scene, initial, hop_time)
        self._disc_of_ball = np.argsort(self._world.event["ball"])
        self._row = States.empty(1, len(scene.bodies))  # for `step`
        self._islands = Islands(self._world)
        self._collapses = Collapses(self._world)
        self._max_reports = max_reports(self._world)
        self._log = empty_log(LOG_ROWS + self._max_reports)
        self._contacts = ContactLog()
        self.collisions = 0
        start(self._world)
        self._islands.begin()

    def step(self) -> None:
        """Process the events of one step. Nothing is computed at its end, so the rate changes no event.

        Raises LimitReached if contacts are recorded and exceed MAX_LOGGED_CONTACTS, with or without end.
        """
        self.advance(1, *self._row)

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        """Do some steps, and write the state after each, see `States`. Raises LimitReached as `step` does."""
        states = States(position, velocity, angle, spin)
        done, recording = 0, self._contacts.recording
        times = self._clock.times(self._steps + np.arange(steps + 1))
        while done < steps:
            checkpoint()
            log = self._log._replace(collects=recording)
            more, collisions = run(self._world, times[done:], states.rows(slice(done, None)), log)
            done += more
            self._steps += more
            self.collisions += collisions
            count = int(log.filled[0])
            if count:
                self._contacts.add(log.row[:count].copy())
            self._report(self._do_planned())
            if self._contacts.count > MAX_LOGGED_CONTACTS:
                raise self._limit_reached()
            if len(log.row) - count < self._max_reports:
                self._log = empty_log(2 * len(log.row))

    def _limit_reached(self) -> LimitReached:
        """Return the error of too many contacts. Its time does not depend on when they are counted."""
        exceeding = int(self._clock.steps_containing(self._contacts.time_of(MAX_LOGGED_CONTACTS)))
        time = self._start + self._clock.time(exceeding - 1)
        return LimitReached("exact", time, f"the next step exceeds the limit of {MAX_LOGGED_CONTACTS:,} contacts")

    def _do_planned(self) -> Contacts:
        """Do what the event loop has planned, and return what must be reported first."""
        plan = self._world.rest.plan[0]
        if plan["collapsing"] != NONE:
            seed, now = int(plan["collapsing"]), float(plan["time"])
            return self._collapses.resolve(seed, self._now, now, collects=self._contacts.recording)
        return self._islands.do_planned(self._now)

    @property
    def _now(self) -> float:
        return self._clock.time(self._steps)

    def state(self) -> State:
        """Return a snapshot, with every ball moved to now."""
        states = States.empty(1, len(self._disc_of_ball))
        snapshot(self._world, self._now, states)
        return states.state(0, self._now)

    def record_contacts(self) -> None:
        if not self._contacts.recording:
            self._islands.begin_reports()
            self._contacts.recording = True

    def contacts(self) -> Contacts:
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        disc, x, y = int(self._disc_of_ball[ball]), float(dv[0]), float(dv[1])
        if not self._islands.absorb(disc, x, y):
            self._report(self._islands.wake(disc, self._now, self._now))
            kick(self._world, disc, self._now, x, y)

    def _report(self, contacts: Contacts) -> None:
        if len(contacts) and self._contacts.recording:
            self._contacts.add(contacts)


def _world(scene: Scene, initial: State, hop_time: float) -> World:
    bodies, n = scene.bodies, len(scene.bodies)
    piece = pieces_of(scene)
    grid = empty_grid(n, 2 * float(bodies.radius.max()), scene.arena.size, piece)
    cell = cell_at(grid, initial.position)
    ball = np.argsort(morton_order(grid, cell), kind="stable")
    disc, event, body, turn = aligned(n, DISC), aligned(n, EVENT), aligned(n, BODY), aligned(n, TURN)
    disc["x"], disc["y"] = initial.position[ball].T
    disc["vx"], disc["vy"] = initial.velocity[ball].T
    disc["radius"], disc["next"] = bodies.radius[ball], NONE
    event["cell"], event["ball"], event["carrier"] = cell[ball], ball, NONE
    body["ax"], body["ay"] = scene.gravity
    body["mass"], body["elasticity"], body["last_contact"] = bodies.mass[ball], bodies.elasticity[ball], -np.inf
    body["last_disc_contact"] = body["settled"] = -np.inf
    body["corner"] = NONE
    turn["angle"], turn["spin"] = initial.angle[ball], initial.spin[ball]
    turn["friction"], turn["slips_until"], turn["reported_until"] = bodies.friction[ball], np.inf, -np.inf
    is_rough = scene.is_rough or bool(initial.spin.any() or initial.angle.any())
    gravity = (float(scene.gravity[0]), float(scene.gravity[1]))
    queue, g = empty_queue(disc, event), math.hypot(*gravity)
    arrays = disc, event, body, turn, bodies.filters[ball], piece, grid, queue, no_islands(n, has_gravity=g > 0)
    return World(*arrays, gravity, g > 0, is_rough, bodies.are_filtered, ROUNDING * g, hop_time, g * hop_time / 2)
