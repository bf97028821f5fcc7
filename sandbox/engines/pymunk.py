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
from sandbox.state import CONTACT, Bools, Contacts, Floats, State

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

_STATE_FIELDS: Final = BodyFields.POSITION | BodyFields.VELOCITY
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
        self._buffer = Buffer()
        self._contacts = ContactLog()
        self._cached = np.empty(0, _CACHED)
        self._calls = 0

    def step(self) -> None:
        """Call `Space.step` once for each substep."""
        for substep in range(self._substeps):
            self.space.step(self._dt)
            if self._contacts.recording:
                self._collect((self._steps + (substep + 1) / self._substeps) / self._rate)
        self._steps += 1

    def state(self) -> State:
        """Return a snapshot, read in one batch."""
        self._buffer.clear()
        get_space_bodies(self.space, _STATE_FIELDS, self._buffer)
        rows = np.frombuffer(self._buffer.float_buf()).reshape(-1, 4)[: len(self._bodies)]
        return State(self._steps / self._rate, rows[:, :2].copy(), rows[:, 2:].copy())

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self._bodies[ball].velocity += dv

    def _collect(self, time: float) -> None:
        """Read the contacts that the last `Space.step` solved."""
        self._calls += 1
        self._buffer.clear()
        get_space_arbiters(self.space, _CONTACT_FIELDS, self._buffer)
        ids = np.frombuffer(self._buffer.int_buf(), np.uintp).reshape(-1, 2)
        if not len(ids):
            return
        values = np.frombuffer(self._buffer.float_buf()).reshape(-1, 5)
        a, b = self._numbers[np.searchsorted(self._ids, ids)].T
        swapped = (a < 0) | ((b >= 0) & (b < a))
        contacts = np.empty(len(ids), CONTACT)
        contacts["time"] = time
        contacts["first"], contacts["second"] = np.where(swapped, b, a), np.where(swapped, a, b)
        contacts["normal"] = np.where(swapped[:, None], -1.0, 1.0) * values[:, 2:4]
        contacts["impulse"] = np.abs(dot(values[:, 0:2], values[:, 2:4]))
        contacts["depth"] = -values[:, 4]
        contacts = contacts[self._touching(contacts)]
        if not len(contacts):
            return
        contacts["impulse"] -= self._stale_impulse(contacts)
        solved = contacts[contacts["impulse"] != 0]
        self._contacts.add(solved[np.lexsort((solved["second"], solved["first"]))])

    def _stale_impulse(self, contacts: Contacts) -> Floats:
        """Return the part of each total impulse that an earlier contact left and that was not applied, kg px/s: (k,).

        Pymunk caches a contact's impulse for `collision_persistence` steps. If the two part and touch again within
        them, the solver starts from that impulse and includes it in the total, but applies only the difference.
        """
        now = np.empty(len(contacts), _CACHED)
        now["pair"] = contacts["first"] * len(self._numbers) + contacts["second"]
        now["impulse"], now["call"] = contacts["impulse"], self._calls
        cached = self._cached[self._calls - self._cached["call"] <= self.space.collision_persistence]
        self._cached = np.concatenate([now, cached[~np.isin(cached["pair"], now["pair"])]])
        stale = np.zeros(len(now))
        _, of_now, of_cached = np.intersect1d(now["pair"], cached["pair"], return_indices=True)
        parted = cached["call"][of_cached] < self._calls - 1
        stale[of_now] = np.where(parted, cached["impulse"][of_cached], 0.0)
        return stale

    def _touching(self, contacts: Contacts) -> Bools:
        """Return which contacts' pairs overlap now, in Chipmunk's own arithmetic: (k,).

        Pymunk lists a cached contact, with the impulse it had, for some steps after the two have parted.
        """
        pair = contacts["first"], contacts["second"]
        away, reach = separation(self.state().position, self._radius, self._segments, *pair)
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
