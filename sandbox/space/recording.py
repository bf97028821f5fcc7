"""Recording the steps of any `pymunk.Space`: its bodies before and after each step, and what acted between them.

Contacts are read from the structs cpArbiter and cpContact, whose fields Pymunk compiles in; all else are properties.
Handlers and callbacks stay as they are. Bodies and constraints may come and go between steps, and within them.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from itertools import takewhile
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import lib

from sandbox.quantity import dot
from sandbox.state import Bools, Floats

Rows = NDArray[Any]
Cached = dict[tuple[frozenset[Any], int], tuple[float, float]]  # by the two shapes, either of which may be A
Numbers = NDArray[np.intp]

MAX_ROWS: Final = 5_000_000  # of bodies, contacts and joints, some 200 bytes each
ROWS_OF_A_STEP: Final = 100  # that a step counts as besides its own: with few bodies, 10 min are kept
LARGEST: Final = 1e15  # px, px/s, rad or rad/s: what goes beyond that does not come back
FIRST: Final = 0  # the state of an arbiter whose shapes did not touch in the step before
HARD: Final = (pymunk.PinJoint, pymunk.PivotJoint, pymunk.GearJoint)  # others stop without a bounce


# Masses kg, moments kg px², places px, angles rad, velocities px/s and rad/s, forces kg px/s², impulses kg px/s.
BODY: Final = np.dtype(
    [
        ("position", "f8", 2),  # of the centre of gravity
        ("angle", "f8"),
        ("velocity", "f8", 2),
        ("spin", "f8"),
        ("force", "f8", 2),
        ("torque", "f8"),
        ("id", "u8"),  # pymunk.Body.id
        ("mass", "f8"),
        ("moment", "f8"),
        ("asleep", "?"),
        ("is_own", "?"),  # it has a velocity_func or a position_func of the program
    ]
)
CONTACT: Final = np.dtype(  # a point of an arbiter; the normal points from body A to body B
    [
        ("body_a", "u8"),
        ("body_b", "u8"),
        ("row_a", "i8"),  # of a body after the step, -1 if it is not there
        ("row_b", "i8"),
        ("shape_a", "u8"),  # keys
        ("shape_b", "u8"),
        ("elasticity", "f8"),
        ("friction", "f8"),
        ("normal", "f8", 2),
        ("arm_a", "f8", 2),  # from the centre of gravity to the point
        ("arm_b", "f8", 2),
        ("impulse", "f8"),  # that the step applied, on B along the normal
        ("tangential", "f8"),  # that on B along the normal turned by +90°
        ("distance", "f8"),  # below 0: overlap
    ]
)
JOINT: Final = np.dtype(
    [
        ("key", "u8"),  # distinguishes constraints
        ("body_a", "u8"),
        ("body_b", "u8"),
        ("row_a", "i8"),
        ("row_b", "i8"),
        ("is_hard", "?"),  # it always holds its bodies, and does not drive them: its work on them is an error
        ("error", "f8"),  # how far its anchors are off its law, px
    ]
)


class Step(NamedTuple):
    """One call of `Space.step`: from `time` on, `dt` s long.

    gravity: px/s²; handles: whether the Space has a collision handler; before, after: the kinetic and the potential
    energy of all bodies, kg px²/s²; was, old, new: (n,) BODY after the step before, before this step and after it, of
    the bodies that are there after it; (k,) CONTACT and (j,) JOINT that it solved.
    """

    time: float
    dt: float
    gravity: tuple[float, float]
    damping: float
    handles: bool
    before: tuple[float, float]
    after: tuple[float, float]
    was: Rows
    old: Rows
    new: Rows
    contacts: Rows
    joints: Rows

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.time + self.dt

    @property
    def lost(self) -> Bools:
        """(n,) whether a body's place or velocity is no number below LARGEST after it."""
        keys = ("position", "velocity", "angle", "spin")
        return np.asarray(~(np.abs(np.column_stack([self.new[key] for key in keys])) < LARGEST).all(axis=1))


class Recording:
    """The last steps of a Space: as many as MAX_ROWS allows, if all are as large as the latest.

    bodies: by `pymunk.Body.id`, without the Space's own static one; shapes, joints: by their keys; also those that are
    gone, so that no other gets a key of theirs.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self.space = space
        self.steps: deque[Step] = deque()
        self._time = 0.0
        self.bodies: dict[int, pymunk.Body] = {}
        self.shapes: dict[int, pymunk.Shape] = {}
        self.joints: dict[int, pymunk.Constraint] = {}

    def record(self, step: Callable[[float], None], dt: float) -> Step | None:
        """Call a Space's own `step`, and return what it did. dt: s; a step of 0 s does nothing and is not recorded.

        If dt is below 0 or not finite, or if a callback of the program raises in the step, it is not recorded either.
        """
        if not 0 < dt < math.inf:
            step(dt)
            return None
        space, old, cached, last_dt = self.space, self._bodies(), self._cached(), self.space.current_time_step
        settings = space.gravity, space.damping, bool(space._handlers)
        before = energies(old, space.gravity)
        step(dt)
        new = self._bodies()
        row_of = {body: row for row, body in enumerate(new["id"].tolist())}
        contacts, joints = self._contacts(cached, dt / (last_dt or dt), row_of), self._joints(row_of)
        after, old = energies(new, space.gravity), _of_bodies(old, new)
        was = _of_bodies(self.steps[-1].new, old) if self.steps else old
        self.steps.append(Step(self._time, dt, *settings, before, after, was, old, new, contacts, joints))
        self._time += dt
        rows = ROWS_OF_A_STEP + 2 * len(new) + len(contacts) + len(joints)
        while len(self.steps) > max(1, MAX_ROWS // rows):
            self.steps.popleft()
        return self.steps[-1]

    def _bodies(self) -> Rows:
        """Return all bodies but the Space's own static one."""
        bodies = list(self.space.bodies)
        self.bodies |= {body.id: body for body in bodies}
        return np.array([_body(body) for body in bodies], BODY)

    def _cached(self) -> Cached:
        """Return the accumulated impulses of points of contact, from which the next step starts if they touch in it."""
        return {
            (frozenset((arbiter.a, arbiter.b)), point.hash): (point.jnAcc, point.jtAcc)
            for arbiter in self.space._get_arbiters()
            for point in arbiter.contacts[0 : arbiter.count]
        }

    def _contacts(self, cached: Cached, ratio: float, row_of: dict[int, int]) -> Rows:
        """Return the contact points that the last step solved.

        Of cached impulses it applied as much as its dt is of that of the step before, the ratio; nothing if the shapes
        did not touch in that step.
        """
        rows, stamp = [], lib.cpSpaceGetTimestamp(self.space._space)
        # Pymunk lists arbiters by addresses, which differ from run to run; the hash of a shape is its number
        arbiters = [arbiter for arbiter in self.space._get_arbiters() if arbiter.stamp == stamp]
        for arbiter in sorted(arbiters, key=lambda each: [*map(lib.cpShapeGetHashID, (each.a, each.b))]):
            shapes = pymunk.Shape._from_cp_shape(arbiter.a), pymunk.Shape._from_cp_shape(arbiter.b)
            self.shapes |= {id(shape): shape for shape in shapes if shape}
            bodies = [shape.body.id if shape and shape.body else 0 for shape in shapes]
            ids = *bodies, *(row_of.get(body, -1) for body in bodies), *map(id, shapes)
            left = 1.0 if arbiter.state == FIRST else 1 - ratio
            for number, point in enumerate(arbiter.contacts[0 : arbiter.count]):
                normal, tangential = cached.get((frozenset((arbiter.a, arbiter.b)), point.hash), (0.0, 0.0))
                impulses = point.jnAcc - left * normal, point.jtAcc - left * tangential
                vectors = ((vector.x, vector.y) for vector in (arbiter.n, point.r1, point.r2))
                depth = lib.cpArbiterGetDepth(arbiter, number)
                rows.append((*ids, arbiter.e, arbiter.u, *vectors, *impulses, depth))
        return np.array(rows, CONTACT)

    def _joints(self, row_of: dict[int, int]) -> Rows:
        """Return the joints that are awake."""
        joints = [joint for joint in self.space.constraints if not (joint.a.is_sleeping or joint.b.is_sleeping)]
        ends = {body for joint in joints for body in (joint.a, joint.b) if body is not self.space._static_body}
        self.joints |= {id(joint): joint for joint in joints}
        self.bodies |= {body.id: body for body in ends}
        return np.array([_joint(joint, row_of) for joint in joints], JOINT)


def _body(body: pymunk.Body) -> tuple[Any, ...]:
    """Return a row of BODY."""
    place, motion = body.local_to_world(body.center_of_gravity), (body.velocity, body.angular_velocity)
    is_own = bool(body._velocity_func or body._position_func)
    constants = body.id, body.mass, body.moment, body.is_sleeping, is_own
    return place, body.angle, *motion, body.force, body.torque, *constants


def _joint(joint: pymunk.Constraint, row_of: dict[int, int]) -> tuple[Any, ...]:
    """Return a row of JOINT."""
    drives = pymunk.Body.KINEMATIC in (joint.a.body_type, joint.b.body_type)
    is_hard = isinstance(joint, HARD) and not drives and math.isinf(joint.max_force)
    rows = row_of.get(joint.a.id, -1), row_of.get(joint.b.id, -1)
    return id(joint), joint.a.id, joint.b.id, *rows, is_hard, _error(joint)


def _error(joint: pymunk.Constraint) -> float:
    """Return how far the anchors of a joint that may pull as hard as it needs are off its law, px.

    PinJoint: its length less the distance; SlideJoint: what is outside of its limits; PivotJoint: the distance of the
    anchors. 0 for all others.
    """
    if math.isfinite(joint.max_force) or not isinstance(joint, pymunk.PinJoint | pymunk.SlideJoint | pymunk.PivotJoint):
        return 0.0
    length = (joint.b.local_to_world(joint.anchor_b) - joint.a.local_to_world(joint.anchor_a)).length
    if isinstance(joint, pymunk.PinJoint):
        return abs(length - joint.distance)
    return max(0.0, length - joint.max, joint.min - length) if isinstance(joint, pymunk.SlideJoint) else length


def _of_bodies(rows: Rows, like: Rows) -> Rows:
    """Return the rows of the bodies that another array has; its own, of bodies that are not among them."""
    if np.array_equal(rows["id"], like["id"]):
        return rows
    found = like.copy()
    _, here, there = np.intersect1d(rows["id"], like["id"], return_indices=True)
    found[there] = rows[here]
    return found


def finite(value: Floats) -> Floats:
    """Return masses or moments, 0 for infinite ones, which have no energy here."""
    return np.asarray(np.where(np.isfinite(value), value, 0.0))


def energies(bodies: Rows, gravity: tuple[float, float]) -> tuple[float, float]:
    """Return the kinetic and the potential energy of bodies, kg px²/s²."""
    mass, v = finite(bodies["mass"]), bodies["velocity"]
    with np.errstate(all="ignore"):
        kinetic = (mass * dot(v, v) + finite(bodies["moment"]) * bodies["spin"] ** 2) / 2
        return float(kinetic.sum()), -float((mass * dot(bodies["position"], np.array(gravity))).sum())


class Run:
    """The columns of K recorded steps, until one leaves a number that is not finite or too large.

    broken: the step after them, if it is such a one; start: the energies before them; time: (K + 1,) s; dt: (K,) s;
    step: (n,) the number of the step of each row of was, old and new; contact_step, joint_step: of contacts and joints.
    """

    def __init__(self, recording: Recording) -> None:
        every = list(recording.steps)
        self.steps = list(takewhile(lambda step: not step.lost.any(), every))
        self.broken = every[len(self.steps)] if len(self.steps) < len(every) else None
        self.start = every[0].before
        self.time = np.array([every[0].time, *(step.end for step in self.steps)])
        self.dt = np.array([step.dt for step in self.steps])
        self.step, self.new = _listed([step.new for step in self.steps], BODY)
        self.old = _listed([step.old for step in self.steps], BODY)[1]
        self.was = _listed([step.was for step in self.steps], BODY)[1]
        self.contact_step, self.contacts = _listed([step.contacts for step in self.steps], CONTACT)
        self.joint_step, self.joints = _listed([step.joints for step in self.steps], JOINT)

    def rows_of(self, step: Numbers, rows: Rows) -> Numbers:
        """Return the rows of bodies from those in their steps: the number of all rows where a step has no such body."""
        return np.where(rows < 0, len(self.step), np.searchsorted(self.step, step) + rows)


def _listed(of_step: Sequence[Rows], kind: np.dtype[Any]) -> tuple[Numbers, Rows]:
    """Return the number of the step of each row of all steps, and the rows."""
    return np.repeat(np.arange(len(of_step)), [*map(len, of_step)]), np.concatenate([np.empty(0, kind), *of_step])
