"""Reading what a `pymunk.Space` does in its steps: the motion of its discs, and their contacts."""

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.engines.contact_log import ContactLog
from sandbox.quantity import dot, length, slips, tangent
from sandbox.scene.walls import Walls, separation
from sandbox.state import CONTACT, Contacts, Damping, Floats, Integers, States

STATE_FIELDS: Final = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
STATE_BYTES: Final = 48  # of a body
_CONTACT_FIELDS: Final = (
    ArbiterFields.BODY_A_ID
    | ArbiterFields.BODY_B_ID
    | ArbiterFields.CONTACT_COUNT
    | ArbiterFields.TOTAL_IMPULSE
    | ArbiterFields.NORMAL
    | ArbiterFields.DISTANCE_1
)
_INTS_BYTES: Final = 3 * np.dtype(np.uintp).itemsize  # of an arbiter


class Solved(NamedTuple):
    """What calls of `Space.step` solved: k contacts, in the order of the calls.

    call: (k,) from 0; bodies: (k, 2) ids, A and B; impulse: (k, 2) kg px/s, on A, as accumulated; normal: (k, 2), from
    A to B; depth: (k,) px.
    """

    call: Integers
    bodies: NDArray[Any]
    impulse: Floats
    normal: Floats
    depth: Floats


class ContactReader:
    """Returns the contacts of the discs of a Space from what its solver accumulated.

    balls: the ids of their bodies, in scene order; radius: (n,) px; carriers: the id of the static body of each wall,
    by the wall's number; walls: by number; persistence: `Space.collision_persistence`, steps.
    """

    def __init__(
        self, balls: Sequence[int], radius: Floats, carriers: dict[int, int], walls: Walls, persistence: int
    ) -> None:
        self._radius, self._walls, self._persistence = radius, walls, persistence
        # To identify the bodies of a contact: their ids, sorted, and the number of each: a ball, or ~wall, its first.
        on_body: dict[int, list[int]] = {}
        for wall, carrier in carriers.items():
            on_body.setdefault(carrier, []).append(wall)
        number_of = {body: ball for ball, body in enumerate(balls)}
        number_of |= {body: ~walls[0] for body, walls in on_body.items()}
        self._ids = np.array(sorted(number_of), np.uintp)
        self._numbers = np.array([number_of[body] for body in self._ids.tolist()])
        self._count = len(balls) + len(walls.start)
        self._sharing = {walls[0]: np.array(walls) for walls in on_body.values() if len(walls) > 1}
        # The last total impulse of each pair: the pair's number, the impulse, and the call of `Space.step`, from 0.
        self._cached = np.empty(0, np.int64), np.empty((0, 2)), np.empty(0, np.int64)

    def contacts(
        self, solved: Solved, first_call: int, ratio: Floats, velocity: Floats, spin: Floats, position: Floats
    ) -> tuple[Integers, Contacts]:
        """Return the call of each contact that has an impulse, and these contacts by call, without their times.

        first_call: its number among all calls; ratio: (calls,) of dt to that of the call before; velocity, spin:
        (calls, n, 2) px/s and (calls, n) rad/s, when `Space.step` solves; position: (calls, n, 2) px, after each.
        """
        a, b = self._numbers[np.searchsorted(self._ids, solved.bodies)].T
        swapped = (a < 0) | ((b >= 0) & (b < a))
        first, second = np.where(swapped, b, a), np.where(swapped, a, b)
        impulse = -np.column_stack([dot(solved.impulse, solved.normal), dot(solved.impulse, tangent(solved.normal))])
        normal = np.where(swapped[:, None], -1.0, 1.0) * solved.normal
        if self._sharing:
            second = self._wall_numbers(first, second, normal, solved.depth, position[solved.call, first])
        pair = first * self._count + second  # in the order of first, then second
        impulse -= self._stale_impulse(pair, impulse, solved.call, first_call, ratio)
        order = np.lexsort((pair, solved.call))
        order = order[impulse[order, 0] != 0]
        call, contacts = solved.call[order], np.empty(len(order), CONTACT)
        contacts["first"], contacts["second"] = first[order], second[order]
        contacts["normal"] = normal[order]
        contacts["impulse"], contacts["tangential"] = impulse[order].T
        contacts["depth"] = solved.depth[order]
        contacts["slip"] = slips(contacts, call, velocity, spin, self._radius)
        return call, contacts

    def _wall_numbers(
        self, first: Integers, second: Integers, normal: Floats, depth: Floats, position: Floats
    ) -> Integers:
        """Return the second of each contact, of the walls on one body the one that it is with: (k,).

        That is the wall at which the normal and the depth (px) lead to the nearest point of the centre line. position:
        (k, 2) px, of the first.
        """
        second = second.copy()
        for k in np.flatnonzero(np.isin(second, [~wall for wall in self._sharing])).tolist():
            walls = self._sharing[~second[k]]
            ball = np.zeros(len(walls), np.int64)
            away, reach = separation(position[[k]], self._radius[first[[k]]], self._walls, ball, ~walls)
            second[k] = ~walls[length(away - (reach - depth[k])[:, None] * normal[k]).argmin()]
        return second

    def _stale_impulse(self, pair: Integers, impulse: Floats, call: Integers, first_call: int, ratio: Floats) -> Floats:
        """Return the part of each total impulse that an earlier contact left and that was not applied: (k, 2) kg px/s.

        Pymunk caches a contact's impulse for `collision_persistence` steps. If the two part and touch again within
        them, the solver starts from that impulse and includes it in the total, but applies only the difference. If they
        stay in contact, it applies the impulse times the ratio of this call's dt to that of the call before.
        pair: (k,) a number for each pair; impulse: (k, 2) in total; the others as in `contacts`.
        """
        persistence, cached = self._persistence, self._cached
        new = pair, impulse, first_call + call
        pair, impulse, call = (np.concatenate(both) for both in zip(cached, new, strict=True))
        order = np.argsort(pair, kind="stable")
        again = pair[order[1:]] == pair[order[:-1]]
        gap = np.diff(call[order])
        grown = ratio[(call[order[1:]] - first_call).clip(min=0)]  # of the second of two of a pair, which is new
        share = np.where(gap > 1, 1.0, 1 - grown) * (again & (gap <= persistence))
        stale = np.zeros((len(pair), 2))
        stale[order[1:]] = np.where(share[:, None] != 0, share[:, None] * impulse[order[:-1]], 0.0)
        last = order[~np.append(again, False)[: len(order)]]
        last = last[first_call + len(ratio) - call[last] <= persistence]
        self._cached = pair[last], impulse[last], call[last]
        return stale[len(cached[0]) :]


class SpaceReader:
    """Reads the discs of a Space and their contacts: `begin`, then `read` after each call of `Space.step`, then `end`.

    balls: their bodies, in scene order; radius: (n,) px; carriers: the static body of each wall, by the wall's number;
    walls: by number; rate: steps per second; substeps: calls of `Space.step` in a step; calls: of all steps so far;
    log: of the contacts.
    """

    def __init__(
        self,
        space: pymunk.Space,
        balls: Sequence[pymunk.Body],
        radius: Floats,
        carriers: dict[int, pymunk.Body],
        walls: Walls,
        rate: int,
        substeps: int = 1,
    ) -> None:
        self._space, self._rate, self._substeps = space, rate, substeps
        self.damping = Damping(space.damping, substeps)
        self._states, self._arbiters = Buffer(), Buffer()
        get_space_bodies(space, BodyFields.BODY_ID, self._states)
        row_of = {body: row for row, body in enumerate(np.frombuffer(self._states.int_buf(), np.uintp).tolist())}
        ids = [body.id for body in balls]
        self._rows, self.bodies = np.array([row_of[body] for body in ids]), len(row_of)
        # A body that falls asleep or wakes changes the order in which a Space lists them: then they go by their ids.
        self._can_sleep = math.isfinite(space.sleep_time_threshold)
        self._ids, self._balls = np.array(ids, np.uintp), balls
        self._asleep: list[list[bool]] = []  # (calls + 1, n)
        carrier_ids = {wall: body.id for wall, body in carriers.items()}
        self._contacts = ContactReader(ids, radius, carrier_ids, walls, int(space.collision_persistence))
        self._ends: list[int] = []  # of the arbiters in the buffer after each call of `Space.step`
        self.calls = 0
        self.log = ContactLog()

    def begin(self) -> None:
        """Read the motion before some calls of `Space.step`."""
        self._states.clear()
        self._arbiters.clear()
        self._ends.clear()
        self._asleep.clear()
        self._read_motion()

    def read(self) -> None:
        """Read the motion after a call of `Space.step` and, if contacts are recorded, what it solved."""
        self.calls += 1
        self._read_motion()
        if self.log.recording:
            get_space_arbiters(self._space, _CONTACT_FIELDS, self._arbiters)
            self._ends.append(len(self._arbiters.int_buf()))

    def _read_motion(self) -> None:
        if self._can_sleep:
            get_space_bodies(self._space, STATE_FIELDS | BodyFields.BODY_ID, self._states)
            self._asleep.append([body.is_sleeping for body in self._balls])
        else:
            get_space_bodies(self._space, STATE_FIELDS, self._states)

    def end(self) -> None:
        """Log the contacts of all calls since `begin`."""
        if self._ends and self._ends[-1]:
            self._collect(np.diff(self._ends, prepend=0) // _INTS_BYTES)

    def states(self) -> States:
        """Return the motion before the calls since `begin`, and after each of them. What is asleep does not move."""
        motion = np.frombuffer(self._states.float_buf()).reshape(-1, self.bodies, 6)
        if not self._can_sleep:
            return parts(motion[:, self._rows])
        ids = np.frombuffer(self._states.int_buf(), np.uintp).reshape(-1, self.bodies)
        rank = np.searchsorted(np.sort(ids[0]), self._ids)
        motion = np.take_along_axis(motion, np.argsort(ids, axis=1)[:, rank, None], axis=1)
        motion[np.array(self._asleep), 3:] = 0.0
        return parts(motion)

    def _collect(self, counts: Integers) -> None:
        """Log the contacts in the buffer, which the last calls of `Space.step` solved. counts: (calls,) of arbiters."""
        of_bodies = np.frombuffer(self._arbiters.int_buf(), np.uintp).reshape(-1, 3)
        touching = np.flatnonzero(of_bodies[:, 2])  # a contact that has ended is listed for some steps, without points
        if not len(touching):
            return
        calls = np.arange(len(counts))
        values = np.frombuffer(self._arbiters.float_buf()).reshape(-1, 5)[touching]
        solved = Solved(
            np.repeat(calls, counts)[touching], of_bodies[touching, :2], values[:, 0:2], values[:, 2:4], -values[:, 4]
        )
        states, dt, first_call = self.states(), 1 / self._rate / self._substeps, self.calls - len(counts)
        left = self.damping.left_after(dt)
        velocity = left * states.velocity + np.multiply(self._space.gravity, dt)  # when `Space.step` solves
        call, contacts = self._contacts.contacts(
            solved, first_call, np.ones(len(counts)), velocity, left * states.spin, states.position[1:]
        )
        step, substep = np.divmod(first_call + call, self._substeps)
        contacts["time"] = (step + (substep + 1) / self._substeps) / self._rate
        self.log.add(contacts)


def parts(states: Floats) -> States:
    """Return the parts of states as Pymunk writes them, (..., n, 6), which share the array."""
    return States(states[..., :2], states[..., 3:5], states[..., 2], states[..., 5])
