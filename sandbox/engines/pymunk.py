"""Pymunk: a `pymunk.Space` of circle bodies and static segment walls. Pymunk finds and solves the contacts."""

from typing import Final

import numpy as np
import pymunk
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.engines.contact_log import ContactLog
from sandbox.engines.walls import Segments, separation
from sandbox.quantity import dot
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import CONTACT, Bools, Contacts, Floats, Integers, State

# px, of an arena wall. The wall stands outside, its inner face on the arena's edge. A ball escapes only if its centre
# crosses the wall's centre line in one step, which at 60 steps per second takes 1.2 million px/s.
WALL_HALF_THICKNESS: Final = 20_000.0

_CONTACT_FIELDS: Final = (
    ArbiterFields.BODY_A_ID
    | ArbiterFields.BODY_B_ID
    | ArbiterFields.TOTAL_IMPULSE
    | ArbiterFields.NORMAL
    | ArbiterFields.DISTANCE_1
)

_IDS_BYTES: Final = 2 * np.dtype(np.uintp).itemsize  # of an arbiter's two bodies
_STATE_FIELDS: Final = BodyFields.POSITION | BodyFields.VELOCITY
STATES_BYTES: Final = 500_000  # of states in the buffer, which are decoded together
_CACHED: Final = np.dtype([("pair", "i8"), ("impulse", "f8"), ("call", "i8")])  # call: of `Space.step`, from 1


class PymunkEngine:
    """A scene in a `pymunk.Space`, which is public as `space`: body k is ball k."""

    together = True

    def __init__(self, scene: Scene, initial: State) -> None:
        self.space = pymunk.Space()
        self.space.gravity = scene.gravity
        for setting in ("iterations", "collision_slop", "collision_bias", "collision_persistence"):
            value = getattr(scene.pymunk, setting)
            if value is not None:
                setattr(self.space, setting, value)
        self._substeps = scene.pymunk.substeps
        self._dt = 1 / scene.rate / self._substeps
        self._rate = scene.rate
        self._steps = 0
        self._radius = scene.bodies.radius
        self._bodies = _add_balls(self.space, scene, initial)
        segments = _add_walls(self.space, scene)
        # To identify the bodies of a contact: their ids, sorted, and the number of each (a ball, or ~wall).
        ids = np.array([body.id for body in self.space.bodies], np.uintp)
        order = np.argsort(ids)
        self._ids = ids[order]
        self._numbers = np.array([*range(len(self._bodies)), *(~wall for wall in range(len(segments)))])[order]
        a, b, radius = (np.array([getattr(wall, key) for wall in segments]) for key in ("a", "b", "radius"))
        self._segments = Segments(a, b, radius)
        self._states, self._arbiters = Buffer(), Buffer()
        state_bytes = 32 * len(ids)
        self._steps_per_read = max(1, STATES_BYTES // (state_bytes * self._substeps))
        self._contacts = ContactLog()
        self._cached = np.empty(0, _CACHED)
        self._calls = 0

    def step(self) -> None:
        """Call `Space.step` once for each substep."""
        if self._contacts.recording:
            self._run(1)
            return
        for _ in range(self._substeps):
            self.space.step(self._dt)
        self._steps += 1

    def advance(self, steps: int, position: Floats, velocity: Floats) -> None:
        """Do some steps, and write the state after each into the rows of position and velocity: (steps, n, 2)."""
        for begin in range(0, steps, self._steps_per_read):
            rows = slice(begin, min(begin + self._steps_per_read, steps))
            self._run(rows.stop - rows.start)
            states = self._read()[self._substeps - 1 :: self._substeps]
            position[rows], velocity[rows] = states[..., :2], states[..., 2:]

    def state(self) -> State:
        """Return a snapshot, read in one batch."""
        self._states.clear()
        get_space_bodies(self.space, _STATE_FIELDS, self._states)
        [state] = self._read()
        return State(self._steps / self._rate, state[:, :2].copy(), state[:, 2:].copy())

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self._bodies[ball].velocity += dv

    def _run(self, steps: int) -> None:
        """Do some steps, leave the state after each substep in a buffer, and collect the contacts."""
        space, states, arbiters, recording = self.space, self._states, self._arbiters, self._contacts.recording
        ends: list[int] = []  # of the arbiters' ids in the buffer after each call of `Space.step`
        states.clear()
        arbiters.clear()
        for _ in range(steps * self._substeps):
            space.step(self._dt)
            get_space_bodies(space, _STATE_FIELDS, states)
            if recording:
                get_space_arbiters(space, _CONTACT_FIELDS, arbiters)
                ends.append(len(arbiters.int_buf()))
        if recording:
            self._calls += len(ends)
            if ends[-1]:
                self._collect(np.diff(ends, prepend=0) // _IDS_BYTES)
        self._steps += steps

    def _read(self) -> Floats:
        """Return the states in the buffer, which overwrites them later: (states, n, 4), position and velocity."""
        rows = np.frombuffer(self._states.float_buf()).reshape(-1, len(self._ids), 4)
        return rows[:, : len(self._bodies)]

    def _collect(self, counts: Integers) -> None:
        """Log the contacts in the buffer, which the last calls of `Space.step` solved. counts: (calls,) of arbiters."""
        ids = np.frombuffer(self._arbiters.int_buf(), np.uintp).reshape(-1, 2)
        values = np.frombuffer(self._arbiters.float_buf()).reshape(-1, 5)
        call = np.repeat(np.arange(len(counts)), counts)
        a, b = self._numbers[np.searchsorted(self._ids, ids)].T
        swapped = (a < 0) | ((b >= 0) & (b < a))
        contacts = np.empty(len(ids), CONTACT)
        step, substep = np.divmod(call, self._substeps)
        contacts["time"] = (self._steps + step + (substep + 1) / self._substeps) / self._rate
        contacts["first"], contacts["second"] = np.where(swapped, b, a), np.where(swapped, a, b)
        contacts["normal"] = np.where(swapped[:, None], -1.0, 1.0) * values[:, 2:4]
        contacts["impulse"] = np.abs(dot(values[:, 0:2], values[:, 2:4]))
        contacts["depth"] = -values[:, 4]
        touching = self._touching(contacts, call)
        contacts, call = contacts[touching], call[touching]
        contacts["impulse"] -= self._stale_impulse(contacts, self._calls - len(counts) + 1 + call)
        order = np.lexsort((contacts["second"], contacts["first"], call))
        contacts = contacts[order[contacts["impulse"][order] != 0]]
        self._contacts.add(contacts)

    def _stale_impulse(self, contacts: Contacts, call: Integers) -> Floats:
        """Return the part of each total impulse that an earlier contact left and that was not applied, kg px/s: (k,).

        Pymunk caches a contact's impulse for `collision_persistence` steps. If the two part and touch again within
        them, the solver starts from that impulse and includes it in the total, but applies only the difference.
        call: (k,) of `Space.step`, in ascending order.
        """
        now = np.empty(len(contacts), _CACHED)
        now["pair"] = contacts["first"] * len(self._numbers) + contacts["second"]
        now["impulse"], now["call"] = contacts["impulse"], call
        both = np.concatenate([self._cached, now])
        order = np.argsort(both["pair"], kind="stable")
        ordered = both[order]
        same = ordered["pair"][1:] == ordered["pair"][:-1]
        parted = np.diff(ordered["call"])
        stale = np.zeros(len(both))
        reused = same & (parted > 1) & (parted <= self.space.collision_persistence)
        stale[order[1:]] = np.where(reused, ordered["impulse"][:-1], 0.0)
        of_now = stale[len(self._cached) :]
        last = ordered[np.append(~same, np.ones(len(ordered) - len(same), bool))]
        self._cached = last[self._calls - last["call"] < self.space.collision_persistence]
        return of_now

    def _touching(self, contacts: Contacts, call: Integers) -> Bools:
        """Return which contacts' pairs overlap after their call of `Space.step`, in Chipmunk's own arithmetic: (k,).

        Pymunk lists a cached contact, with the impulse it had, for some steps after the two have parted.
        """
        first, second = contacts["first"], contacts["second"]
        numbers = np.arange(len(contacts))
        balls = np.concatenate([first, np.maximum(second, 0)])  # the first of each contact, then the second of each
        position = self._read()[np.concatenate([call, call]), balls, :2]
        pair = numbers, np.where(second >= 0, len(contacts) + numbers, second)
        away, reach = separation(position, self._radius[balls], self._segments, *pair)
        return dot(away, away) < reach * reach


def _add_balls(space: pymunk.Space, scene: Scene, initial: State) -> list[pymunk.Body]:
    bodies = scene.bodies
    added = []
    for ball in range(len(bodies)):
        radius, mass = float(bodies.radius[ball]), float(bodies.mass[ball])
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position = tuple(initial.position[ball].tolist())
        body.velocity = tuple(initial.velocity[ball].tolist())
        shape = pymunk.Circle(body, radius)
        shape.elasticity = float(bodies.elasticity[ball])
        shape.friction = float(bodies.friction[ball])
        space.add(body, shape)
        added.append(body)
    return added


def _add_walls(space: pymunk.Space, scene: Scene) -> list[pymunk.Segment]:
    """Add the arena's walls (left, top, right, bottom) and the scene's own, each on a static body of its own."""
    (width, height), far = scene.arena.size, WALL_HALF_THICKNESS
    arena = scene.arena
    ends = [
        ((-far, -far), (-far, height + far)),
        ((-far, -far), (width + far, -far)),
        ((width + far, -far), (width + far, height + far)),
        ((-far, height + far), (width + far, height + far)),
    ]
    walls = [(a, b, far, arena.elasticity, arena.friction) for a, b in ends]
    walls += [(wall.start, wall.to, wall.thickness / 2, wall.elasticity, wall.friction) for wall in scene.walls]
    added = []
    for a, b, radius, elasticity, friction in walls:
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        segment = pymunk.Segment(body, a, b, radius)
        segment.elasticity, segment.friction = elasticity, friction
        space.add(body, segment)
        added.append(segment)
    return added
