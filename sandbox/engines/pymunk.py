"""Pymunk: a `pymunk.Space` of circle bodies and static segment walls. Pymunk finds and solves the contacts."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import pymunk
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.engines.contact_log import ContactLog
from sandbox.engines.walls import Segments, separation
from sandbox.quantity import dot, slips, tangent
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene, Wall
from sandbox.state import CONTACT, Contacts, Damping, Floats, Integers, State, States

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
_STATE_FIELDS: Final = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
STATES_BYTES: Final = 500_000  # of states in the buffer, which are decoded together


class PymunkEngine:
    """A scene in a `pymunk.Space`, which is public as `space`: body k is ball k."""

    together = True

    def __init__(self, scene: Scene, initial: State) -> None:
        self.space = pymunk.Space()
        self.space.gravity = scene.gravity
        for setting in ("iterations", "collision_slop", "collision_bias", "collision_persistence", "damping"):
            value = getattr(scene.pymunk, setting)
            if value is not None:
                setattr(self.space, setting, value)
        self._substeps = scene.pymunk.substeps
        self._dt = 1 / scene.rate / self._substeps
        self.damping = Damping(self.space.damping, self._substeps)
        self._rate = scene.rate
        self._steps = 0
        self._radius = scene.bodies.radius
        self._bodies = _add_balls(self.space, scene, initial)
        segments = _add_walls(self.space, scene)
        # To identify the bodies of a contact: their ids, sorted, and the number of each (a ball, or ~wall).
        ids = np.array([body.id for body in self.space.bodies], np.uintp)
        order = np.argsort(ids)
        self._ids = ids[order]
        self._numbers = np.array([*range(len(self._bodies)), *(~wall for wall in scene.wall_numbers)])[order]
        a, b, radius = (np.array([getattr(wall, key) for wall in segments]) for key in ("a", "b", "radius"))
        self._segments = Segments(a, b, radius)
        self._states, self._arbiters = Buffer(), Buffer()
        state_bytes = 48 * len(ids)
        self._steps_per_read = max(1, STATES_BYTES // (state_bytes * self._substeps))
        self._contacts = ContactLog()
        # The last total impulse of each pair: the pair's number, the impulse, and the call of `Space.step`, from 1.
        self._cached = np.empty(0, np.int64), np.empty((0, 2)), np.empty(0, np.int64)
        self._calls = 0

    def step(self) -> None:
        """Call `Space.step` once for each substep."""
        if self._contacts.recording:
            self._run(1)
            return
        for _ in range(self._substeps):
            self.space.step(self._dt)
        self._steps += 1

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        """Do some steps, and write the state after each into the rows of position, velocity, angle and spin."""
        for begin in range(0, steps, self._steps_per_read):
            rows = slice(begin, min(begin + self._steps_per_read, steps))
            self._run(rows.stop - rows.start)
            states = self._read()[self._substeps :: self._substeps]
            for ours, part in zip((position, velocity, angle, spin), _parts(states), strict=True):
                ours[rows] = part

    def state(self) -> State:
        """Return a snapshot, read in one batch."""
        self._states.clear()
        get_space_bodies(self.space, _STATE_FIELDS, self._states)
        [state] = self._read()
        return State(self._steps / self._rate, *(part.copy() for part in _parts(state)))

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self._bodies[ball].velocity += dv

    def _run(self, steps: int) -> None:
        """Do some steps, leave the state before them and after each substep in a buffer, and collect the contacts."""
        space, states, arbiters, recording = self.space, self._states, self._arbiters, self._contacts.recording
        ends: list[int] = []  # of the arbiters' ids in the buffer after each call of `Space.step`
        states.clear()
        arbiters.clear()
        get_space_bodies(space, _STATE_FIELDS, states)
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
        """Return the states in the buffer, which overwrites them later: (states, n, 6), see `_parts`."""
        rows = np.frombuffer(self._states.float_buf()).reshape(-1, len(self._ids), 6)
        return rows[:, : len(self._bodies)]

    def _collect(self, counts: Integers) -> None:
        """Log the contacts in the buffer, which the last calls of `Space.step` solved. counts: (calls,) of arbiters."""
        ids = np.frombuffer(self._arbiters.int_buf(), np.uintp).reshape(-1, 2)
        values = np.frombuffer(self._arbiters.float_buf()).reshape(-1, 5)
        call = np.repeat(np.arange(len(counts)), counts)
        a, b = self._numbers[np.searchsorted(self._ids, ids)].T
        swapped = (a < 0) | ((b >= 0) & (b < a))
        first, second = np.where(swapped, b, a), np.where(swapped, a, b)
        touching = self._touching(first, second, call)
        if not len(touching):
            return
        first, second, call = first[touching], second[touching], call[touching]
        values, swapped = values[touching], swapped[touching]
        pair = first * len(self._numbers) + second  # in the order of first, then second
        on_a, normal = values[:, 0:2], values[:, 2:4]  # the impulse on body A, and the normal from A to B
        impulse = -np.column_stack([dot(on_a, normal), dot(on_a, tangent(normal))])
        impulse -= self._stale_impulse(pair, impulse, self._calls - len(counts) + 1 + call)
        order = np.lexsort((pair, call))
        order = order[impulse[order, 0] != 0]
        contacts = np.empty(len(order), CONTACT)
        step, substep = np.divmod(call[order], self._substeps)
        contacts["time"] = (self._steps + step + (substep + 1) / self._substeps) / self._rate
        contacts["first"], contacts["second"] = first[order], second[order]
        contacts["normal"] = (np.where(swapped[:, None], -1.0, 1.0) * normal)[order]
        contacts["impulse"], contacts["tangential"] = impulse[order].T
        contacts["depth"] = -values[order, 4]
        contacts["slip"] = self._slip(contacts, call[order])
        self._contacts.add(contacts)

    def _slip(self, contacts: Contacts, call: Integers) -> Floats:
        """Return the slip of each contact before its call of `Space.step` solved it, px/s: (k,)."""
        before, left = _parts(self._read()), self.damping.left_after(self._dt)
        velocity = left * before.velocity + np.multiply(self.space.gravity, self._dt)
        return slips(contacts, call, velocity, left * before.spin, self._radius)

    def _stale_impulse(self, pair: Integers, impulse: Floats, call: Integers) -> Floats:
        """Return the part of each total impulse that an earlier contact left and that was not applied: (k, 2) kg px/s.

        Pymunk caches a contact's impulse for `collision_persistence` steps. If the two part and touch again within
        them, the solver starts from that impulse and includes it in the total, but applies only the difference.
        pair: (k,) a number for each pair; impulse: (k, 2) in total; call: (k,) of `Space.step`, in ascending order.
        """
        persistence, cached = self.space.collision_persistence, self._cached
        pair, impulse, call = (np.concatenate(both) for both in zip(cached, (pair, impulse, call), strict=True))
        order = np.argsort(pair, kind="stable")
        again = pair[order[1:]] == pair[order[:-1]]
        gap = np.diff(call[order])
        stale = np.zeros((len(pair), 2))
        stale[order[1:]] = np.where((again & (gap > 1) & (gap <= persistence))[:, None], impulse[order[:-1]], 0.0)
        last = order[~np.append(again, False)]
        last = last[self._calls - call[last] < persistence]
        self._cached = pair[last], impulse[last], call[last]
        return stale[len(cached[0]) :]

    def _touching(self, first: Integers, second: Integers, call: Integers) -> Integers:
        """Return the numbers of the pairs that overlap after their call of `Space.step`, in Chipmunk's arithmetic.

        Pymunk lists a cached contact, with the impulse it had, for some steps after the two have parted.
        """
        numbers = np.arange(len(call))
        balls = np.concatenate([first, np.maximum(second, 0)])  # the first of each pair, then the second of each
        position = self._read()[1 + np.concatenate([call, call]), balls, :2]
        pair = numbers, np.where(second >= 0, len(call) + numbers, second)
        away, reach = separation(position, self._radius[balls], self._segments, *pair)
        return np.flatnonzero(dot(away, away) < reach * reach)


def _parts(states: Floats) -> States:
    """Return the parts of states as Pymunk writes them, (..., n, 6), which share the array."""
    return States(states[..., :2], states[..., 3:5], states[..., 2], states[..., 5])


def _add_balls(space: pymunk.Space, scene: Scene, initial: State) -> list[pymunk.Body]:
    bodies = scene.bodies
    added = []
    for ball in range(len(bodies)):
        radius, mass = float(bodies.radius[ball]), float(bodies.mass[ball])
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position = tuple(initial.position[ball].tolist())
        body.velocity = tuple(initial.velocity[ball].tolist())
        body.angle, body.angular_velocity = float(initial.angle[ball]), float(initial.spin[ball])
        shape = pymunk.Circle(body, radius)
        shape.elasticity = float(bodies.elasticity[ball])
        shape.friction = float(bodies.friction[ball])
        space.add(body, shape)
        added.append(body)
    return added


def _add_walls(space: pymunk.Space, scene: Scene) -> list[pymunk.Segment]:
    """Add the walls that stand, each on a static body of its own; return the segments of all, see `wall_numbers`."""
    (width, height), far = scene.arena.size, WALL_HALF_THICKNESS
    arena = scene.arena
    ends = [  # left, top, right, bottom
        ((-far, -far), (-far, height + far)),
        ((-far, -far), (width + far, -far)),
        ((width + far, -far), (width + far, height + far)),
        ((-far, height + far), (width + far, height + far)),
    ]
    walls = [(a, b, far, arena.elasticity, arena.friction) for a, b in ends]
    walls += [(wall.start, wall.to, wall.thickness / 2, wall.elasticity, wall.friction) for wall in scene.walls]
    segments = []
    for number, (a, b, radius, elasticity, friction) in enumerate(walls):
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        segment = pymunk.Segment(body, a, b, radius)
        segment.elasticity, segment.friction = elasticity, friction
        if number in scene.wall_numbers:
            space.add(body, segment)
        segments.append(segment)
    for chain in _chains(scene.walls):
        _join([segments[len(ends) + wall] for wall in chain])
    return segments


def _chains(walls: Sequence[Wall]) -> Iterator[list[int]]:
    """Yield the numbers of the walls of each chain of joined walls; one that ends where it began is complete."""
    chain: list[int] = []
    for number, wall in enumerate(walls):
        last = walls[chain[-1]] if chain else wall
        if chain and (not wall.joined or wall.start != last.to or last.to == walls[chain[0]].start):
            yield chain
            chain = []
        if wall.joined:
            chain.append(number)
    yield chain


def _join(chain: Sequence[pymunk.Segment]) -> None:
    """Let no ball hit the ends at which the segments of a chain meet, where it touches both."""
    is_closed = bool(chain) and chain[-1].b == chain[0].a
    for k, segment in enumerate(chain):
        before = chain[k - 1].a if k or is_closed else segment.a
        after = chain[(k + 1) % len(chain)].b if k + 1 < len(chain) or is_closed else segment.b
        segment.set_neighbors(before, after)
