"""Reading what a `pymunk.Space` does in its steps: the motion of its discs, and their contacts."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import pymunk
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.engines.contact_log import ContactLog
from sandbox.quantity import dot, slips, tangent
from sandbox.state import CONTACT, Damping, Floats, Integers, States

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


class SpaceReader:
    """Reads the discs of a Space and their contacts: `begin`, then `read` after each call of `Space.step`, then `end`.

    balls: their bodies, in scene order; radius: (n,) px; carriers: the static body of each wall, by the wall's number;
    rate: steps per second; substeps: calls of `Space.step` in a step; calls: of all steps so far; log: of the contacts.
    """

    def __init__(
        self,
        space: pymunk.Space,
        balls: Sequence[pymunk.Body],
        radius: Floats,
        carriers: dict[int, pymunk.Body],
        rate: int,
        substeps: int,
    ) -> None:
        self._space, self._radius, self._rate, self._substeps = space, radius, rate, substeps
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
        # To identify the bodies of a contact: the ids of all, sorted, and the number of each, a ball or ~wall.
        number_of = dict(zip(ids, range(len(ids)), strict=True)) | {body.id: ~wall for wall, body in carriers.items()}
        self._body_ids = np.array(sorted(number_of), np.uintp)
        self._numbers = np.array([number_of[body] for body in self._body_ids.tolist()])
        self._pairs = len(balls) + max(carriers, default=0) + 1  # as many as a contact may have as its second
        # The last total impulse of each pair: the pair's number, the impulse, and the call of `Space.step`, from 0.
        self._cached = np.empty(0, np.int64), np.empty((0, 2)), np.empty(0, np.int64)
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
        call = np.repeat(np.arange(len(counts)), counts)[touching]
        values = np.frombuffer(self._arbiters.float_buf()).reshape(-1, 5)[touching]
        a, b = self._numbers[np.searchsorted(self._body_ids, of_bodies[touching, :2])].T
        swapped = (a < 0) | ((b >= 0) & (b < a))
        first, second = np.where(swapped, b, a), np.where(swapped, a, b)
        on_a, normal = values[:, 0:2], values[:, 2:4]  # impulse as accumulated, and normal from A to B
        impulse = -np.column_stack([dot(on_a, normal), dot(on_a, tangent(normal))])
        pair = first * self._pairs + second  # in the order of first, then second
        first_call = self.calls - len(counts)
        impulse -= self._stale_impulse(pair, impulse, first_call + call)
        order = np.lexsort((pair, call))
        order = order[impulse[order, 0] != 0]
        call, contacts = call[order], np.empty(len(order), CONTACT)
        contacts["first"], contacts["second"] = first[order], second[order]
        contacts["normal"] = np.where(swapped[:, None], -1.0, 1.0)[order] * normal[order]
        contacts["impulse"], contacts["tangential"] = impulse[order].T
        contacts["depth"] = -values[order, 4]
        states, dt = self.states(), 1 / self._rate / self._substeps
        left = self.damping.per_second**dt
        velocity = left * states.velocity + np.multiply(self._space.gravity, dt)  # when `Space.step` solves
        contacts["slip"] = slips(contacts, call, velocity, left * states.spin, self._radius)
        step, substep = np.divmod(first_call + call, self._substeps)
        contacts["time"] = (step + (substep + 1) / self._substeps) / self._rate
        self.log.add(contacts)

    def _stale_impulse(self, pair: Integers, impulse: Floats, call: Integers) -> Floats:
        """Return the part of each total impulse that an earlier contact left and that was not applied: (k, 2) kg px/s.

        Pymunk caches a contact's impulse for `collision_persistence` steps. If the two part and touch again within
        them, the solver starts from that impulse and includes it in the total, but applies only the difference.
        pair: (k,) a number for each pair; impulse: (k, 2) in total; call: (k,) among all calls.
        """
        persistence, cached = int(self._space.collision_persistence), self._cached
        pair, impulse, call = (np.concatenate(both) for both in zip(cached, (pair, impulse, call), strict=True))
        order = np.argsort(pair, kind="stable")
        again, gap = pair[order[1:]] == pair[order[:-1]], np.diff(call[order])
        is_stale = again & (gap > 1) & (gap <= persistence)
        stale = np.zeros((len(pair), 2))
        stale[order[1:][is_stale]] = impulse[order[:-1][is_stale]]
        last = order[~np.append(again, False)]
        last = last[self.calls - call[last] <= persistence]
        self._cached = pair[last], impulse[last], call[last]
        return stale[len(cached[0]) :]


def parts(states: Floats) -> States:
    """Return the parts of states as Pymunk writes them, (..., n, 6), which share the array."""
    return States(states[..., :2], states[..., 3:5], states[..., 2], states[..., 5])
