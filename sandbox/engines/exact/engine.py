"""The exact engine: builds the arrays of the event loop from a scene, runs it, and collects its contacts."""
# ruff: noqa: D102 (the interface of an engine documents the methods)

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from sandbox.compiled import Function, as_python, compiled, write_back
from sandbox.engines.contact_log import ContactLog, empty_log
from sandbox.engines.engine import RunningEngine
from sandbox.engines.exact.contact import HOP_TIME
from sandbox.engines.exact.event_loop import COLLAPSE, JAM, UNFINISHED, UP_TO_DATE, WAKE, Stop, simulate
from sandbox.engines.exact.event_queue import NO_PARTNER, empty_queue
from sandbox.engines.exact.heaps.collapse import resolve
from sandbox.engines.exact.heaps.islands import Islands
from sandbox.engines.exact.prediction import predict_each
from sandbox.engines.exact.support import MAX_SUPPORTS, report_supports
from sandbox.engines.exact.world import OF_DISC, World, motions, move_to_now, release, rotations
from sandbox.engines.grid import NONE, cell_at, enter, grid_for
from sandbox.engines.machine_code import MachineCode
from sandbox.errors import LimitReached
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.walls import pieces_of
from sandbox.state import Contacts, Floats, Integers, State, States
from sandbox.threads import checkpoint

MAX_LOGGED_CONTACTS: Final = 5_000_000  # not yet read: half a GB, and five times that in a comparison
LOG_ROWS: Final = 64  # of a new engine's log, besides those of what walls carry; it doubles when it is full
ROUNDING: Final = 1e-9  # of gravity; a weaker pull is rounding
MAX_EVENTS: Final = (50_000, 300)  # as machine code and Python: about 50 ms, so that Ctrl-C can end an endless step
CODE: Final = MachineCode("exact", compiling=60_000, loading=10_000, many=200)  # events; discs


class ExactEngine(RunningEngine):
    """Hard discs, event by event. `collisions` counts the contacts between balls.

    hop_time: s, for which discs that lean on each other are apart; where a result depends on it, it is not exact.
    """

    def __init__(self, scene: Scene, initial: State, hop_time: float = HOP_TIME) -> None:
        self._clock = scene.clock
        self._start = initial.time  # s, of the run
        self._steps = 0
        self._arrays = _world(scene, initial, hop_time)
        self._world = as_python(self._arrays)
        self._runs_python = True
        self._disc_of_ball = np.argsort(self._arrays.event["ball"])
        self._islands = Islands(self._world)
        self._log = empty_log(LOG_ROWS + MAX_SUPPORTS * len(scene.bodies))
        self._contacts = ContactLog()
        self.collisions = 0
        self._change_over(work=0)
        self._predict(np.arange(len(scene.bodies)), 0.0)
        if self._world.has_gravity:
            self._do(self._islands.examine(0.0, 0.0, is_start=True), 0.0)

    def _change_over(self, work: int) -> None:
        """Change over to machine code, if that is due after more work (events)."""
        if self._runs_python and CODE.is_due(work, len(self._world.disc)):
            write_back(self._world, self._arrays)
            self._world, self._runs_python = self._arrays, False
            self._islands.world = self._world

    def _code(self, kernel: Function) -> Function:
        return kernel if self._runs_python else compiled(kernel)

    def step(self) -> None:
        """Process the events of one step. Nothing is computed at its end, so the rate changes no event.

        Raises LimitReached if contacts are recorded and exceed MAX_LOGGED_CONTACTS, with or without end.
        """
        since, now = self._now, self._clock.time(self._steps + 1)
        while self._next_event <= now:
            self._process_events(since, now)
            self._check_limit()
        if self._world.has_gravity and self._contacts.recording:
            self._log.filled[0] = 0
            self._code(report_supports)(self._world, since, now, self._log._replace(collects=True))
            self._take_log()
            self._report(self._islands.report(since, now))
        self._check_limit()
        self._steps += 1

    def advance(self, steps: int, *states: Floats) -> None:
        """Do steps; those before the next event are one flight, unless each has to report what supports the discs."""
        times, done = self._clock.times(self._steps + np.arange(1, steps + 1)), 0
        while done < steps:
            self.step()
            first, done = done, done + 1
            if not (self._world.has_gravity and self._contacts.recording):
                done = max(done, int(np.searchsorted(times, self._next_event)))
                self._steps += done - first - 1
            rows = slice(first, done)
            self._write(times[rows], States(*states).rows(rows))

    def _process_events(self, since: float, now: float) -> None:
        """Process events until a time (s), or until something else has been done that was due before."""
        checkpoint()
        self._log.filled[0] = 0
        log, until = self._log._replace(collects=self._contacts.recording), min(now, self._islands.next_check)
        most = MAX_EVENTS[self._runs_python]
        stop: Stop = self._code(simulate)(self._world, since, until, self._islands.jams_from, most, log)
        self.collisions += stop.collisions
        self._take_log()
        if stop.reason == UNFINISHED and stop.events < most:
            self._log = empty_log(2 * len(log.row))
        elif stop.reason == UP_TO_DATE and until == self._islands.next_check:
            self._do(self._islands.examine(since, until), until)
        elif stop.reason == JAM:
            self._do(self._islands.examine(since, stop.time), stop.time)
        elif stop.reason == WAKE:
            self._do(self._islands.wake(stop.disc, since, stop.time), stop.time)
        elif stop.reason == COLLAPSE:
            *done, jams = resolve(self._world, stop.disc, since, stop.time, collects=log.collects)
            self._do(done, stop.time)
            if jams and stop.time >= self._islands.jams_from:
                self._do(self._islands.examine(since, stop.time), stop.time)
        self._change_over(stop.events)

    def _do(self, done: Sequence[Any], now: float) -> None:
        """Predict discs anew (n,) and report contacts, as is to be done after a change to islands or a collapse."""
        discs, contacts = done
        self._predict(discs, now)
        self._report(contacts)

    def _predict(self, discs: Integers, now: float) -> None:
        self._code(predict_each)(self._world, discs.tolist() if self._runs_python else discs, now)

    def _check_limit(self) -> None:
        """Raise LimitReached if there are too many contacts."""
        if self._contacts.count > MAX_LOGGED_CONTACTS:
            limit = f"{MAX_LOGGED_CONTACTS:,} contacts"
            raise LimitReached("exact", self._start + self._now, f"the next step exceeds the limit of {limit}")

    @property
    def _next_event(self) -> float:
        return min(self._world.node[0].time, self._islands.next_check)

    @property
    def _now(self) -> float:
        return self._clock.time(self._steps)

    def state(self) -> State:
        """Return a snapshot, with every ball moved to now."""
        states = States.empty(1, len(self._disc_of_ball))
        self._write(np.array([self._now]), states)
        return states.state(0, self._now)

    def _write(self, times: Floats, states: States) -> None:
        """Write where the balls are at times (s) before the next event, in scene order."""
        now, disc = times[:, None], self._disc_of_ball
        m = motions(self._world, now)
        for part, x, y in ((states.position, m.x, m.y), (states.velocity, m.vx, m.vy)):
            part[..., 0], part[..., 1] = x[..., disc], y[..., disc]
        if self._world.is_rough:
            states.angle[:], states.spin[:] = (part[:, disc] for part in rotations(self._world, now))

    def record_contacts(self) -> None:
        if not self._contacts.recording:
            self._islands.report(self._now, self._now)  # of what was not recorded
            self._contacts.recording = True

    def contacts(self) -> Contacts:
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        disc = int(self._disc_of_ball[ball])
        self._do(self._islands.wake(disc, self._now, self._now), self._now)
        move_to_now(self._world, disc, self._now)
        self._world.disc[disc].vx += float(dv[0])
        self._world.disc[disc].vy += float(dv[1])
        release(self._world, disc)
        self._predict(np.array([disc]), self._now)

    def _take_log(self) -> None:
        self._report(self._log.row[: self._log.filled[0]].copy())

    def _report(self, contacts: Contacts) -> None:
        if len(contacts) and self._contacts.recording:
            self._contacts.add(contacts)


def _world(scene: Scene, initial: State, hop_time: float) -> World:
    """Return the arrays of the event loop, in which no disc has an event yet."""
    bodies, n = scene.bodies, len(scene.bodies)
    piece = pieces_of(scene).view(np.recarray)
    grid = grid_for(n, 2 * float(bodies.radius.max()), scene.arena.size, piece)
    cell = np.array([cell_at(grid, x, y) for x, y in initial.position.tolist()])
    ball = np.argsort(cell, kind="stable")
    disc, event, body, turn, absorbed = (np.zeros(n, kind).view(np.recarray) for kind in OF_DISC)
    disc["x"], disc["y"] = initial.position[ball].T
    disc["vx"], disc["vy"] = initial.velocity[ball].T
    disc["radius"], disc["hit"], disc["next"] = bodies.radius[ball], np.inf, NONE
    event["cell"], event["ball"], event["carrier"] = cell[ball], ball, NONE
    event["crossing"], event["partner"] = np.inf, NO_PARTNER
    body["ax"], body["ay"] = scene.gravity
    body["mass"], body["elasticity"], body["last_contact"] = bodies.mass[ball], bodies.elasticity[ball], -np.inf
    body["last_disc_contact"] = body["settled"] = -np.inf
    body["corner"] = NONE
    turn["angle"], turn["spin"] = initial.angle[ball], initial.spin[ball]
    turn["friction"], turn["slips_until"] = bodies.friction[ball], np.inf
    for i, number in enumerate(event["cell"].tolist()):
        enter(grid, disc, i, number)
    is_rough = scene.is_rough or bool(initial.spin.any() or initial.angle.any())
    gravity = (float(scene.gravity[0]), float(scene.gravity[1]))
    g = math.hypot(*gravity)
    arrays = disc, event, body, turn, absorbed, bodies.filters[ball], piece, grid, empty_queue(n)
    return World(*arrays, gravity, g > 0, is_rough, bodies.are_filtered, ROUNDING * g, hop_time, g * hop_time / 2)
