"""Passages: bodies that went through each other within a step, which found no contact.

Pymunk moves bodies by their velocities, and looks for contacts where they then are. Seen from one body, the centre of
gravity of the other goes along a chord, or along an arc if the first one turns; if it goes through a shape, though the
step found no contact of the two, they have passed.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np
import pymunk
from numpy.typing import NDArray

from sandbox.space.contents import corners_of, is_static, may_collide
from sandbox.space.mechanics import Floats, Rows, common, dot
from sandbox.space.memory import Snapshot, shape_address
from sandbox.space.recording import Recording, Step
from sandbox.space.roster import Roster
from sandbox.space.rules import may_be_ignored, off_its_place

Numbers = NDArray[np.intp]

MAX_TURN: Final = 0.1  # rad: arcs of this angle are replaced by chords, off by 0.1 % of the radius
MAX_CHORDS: Final = 1_000


@dataclass(frozen=True)
class Passage:
    """Two bodies, by id, that passed in a step, by a way of so many px relative to the second; two of their shapes."""

    step: Step
    mover: int
    target: int
    shape: pymunk.Shape
    wall: pymunk.Shape
    way: float


@dataclass
class _Solid:
    """A body's shapes that collide and stayed as they were, and copies of them about its centre of gravity."""

    shapes: list[pymunk.Shape] = field(default_factory=list)

    @cached_property
    def copies(self) -> dict[pymunk.Shape, pymunk.Shape]:
        """The shape of each copy. They are in a Space of their own."""
        space = pymunk.Space()
        body = self.shapes[0].body
        space.static_body.position = -body.center_of_gravity if body else (0, 0)
        copies = [_copy(shape, space.static_body) for shape in self.shapes]
        space.add(*copies)
        self._space = space
        return dict(zip(copies, self.shapes, strict=True))

    @cached_property
    def reach(self) -> float:
        """How far its shapes reach from its centre of gravity, px."""
        corners = (abs(x) for copy in self.copies for box in [copy.bb] for x in (box.left, box.right))
        return math.hypot(max(corners), max(abs(y) for copy in self.copies for y in (copy.bb.top, copy.bb.bottom)))

    @cached_property
    def core(self) -> tuple[float, pymunk.Shape]:
        """How deep its centre of gravity is in a shape, px, and in which; below 0 if it is outside."""
        depths = ((-copy.point_query((0, 0)).distance, shape) for copy, shape in self.copies.items())
        return max(depths, key=lambda depth: depth[0])

    def hits(self, start: list[float], end: list[float]) -> Iterator[pymunk.Shape]:
        """Yield the shapes through which a line goes that begins outside of them, about the centre of gravity."""
        for hit in self._space.segment_query((start[0], start[1]), (end[0], end[1]), 0, pymunk.ShapeFilter()):
            if hit.shape and hit.shape.point_query((start[0], start[1])).distance > 0:
                yield self.copies[hit.shape]


class Passages:
    """Finds the passages in a recording.

    Not judged: bodies that something else than their velocity moved in the step, further than their shapes reach, which
    the push out of an overlap does not; shapes that a filter, a joint or a handler may let through; sensors; and shapes
    that changed, or did not come and go with their body.
    """

    def __init__(self, recording: Recording, space: pymunk.Space) -> None:
        self._steps, self._roster, self._space = list(recording), recording.roster, space
        self._solids = _solids(recording.roster)
        self._ids = np.empty(0, np.uint64)
        self._reach, self._depth, self._is_solid = np.empty(0), np.empty(0), np.empty(0, bool)

    def __iter__(self) -> Iterator[Passage]:
        met: set[frozenset[int]] = set()
        for step in self._steps:
            for mover, target, path in self._candidates(step):
                pair = frozenset((mover, target))
                if pair not in met and (passage := self._passage(step, mover, target, path)):
                    met.add(pair)
                    yield passage

    def _look_at(self, rows: Rows) -> None:
        """Read how far shapes reach and how deep centres are in them, of the bodies in rows."""
        if not np.array_equal(rows["id"], self._ids):
            self._ids = rows["id"].copy()
            solids = [self._solids.get(body) for body in self._ids.tolist()]
            self._reach = np.array([solid.reach if solid else 0.0 for solid in solids])
            self._depth = np.array([solid.core[0] if solid else 0.0 for solid in solids])
            self._is_solid = np.array([solid is not None for solid in solids], bool)

    def _candidates(self, step: Step) -> Iterator[tuple[int, int, Floats]]:
        """Yield the ids of bodies whose centres come near enough, and the way of the first as seen from the second."""
        before, after = common(step.before.bodies, step.after.bodies)
        self._look_at(after)
        with np.errstate(invalid="ignore", over="ignore"):
            movers, targets, starts, chords = self._pairs(before, after, step.dt)
        angles, turns = before["angle"][targets], (after["angle"] - before["angle"])[targets]
        paths = map(_path, starts, chords, angles.tolist(), turns.tolist())
        yield from zip(self._ids[movers].tolist(), self._ids[targets].tolist(), paths, strict=True)

    def _pairs(self, before: Rows, after: Rows, dt: float) -> tuple[Numbers, Numbers, Floats, Floats]:
        """Return the rows of such bodies, and where the first begins and how far it moves, relative to the second.

        To come from one side of a body to the other without a contact at either end, it must move by the depth of its
        centre of gravity in it, twice.
        """
        place, way, turn = before["position"], after["position"] - before["position"], after["angle"] - before["angle"]
        pushed = np.hypot(*(way - before["velocity"] * dt).T), np.abs(turn - before["spin"] * dt) * self._reach
        free = self._is_solid & (np.maximum(*pushed) < self._reach)
        lengths, sweep = np.where(free, [np.hypot(*way.T), np.abs(turn) * self._reach], 0.0)
        least = 2 * np.where(free & (self._depth > 0), self._depth, np.inf)
        movers = np.flatnonzero(lengths + (lengths + sweep).max(initial=0.0) >= least)
        targets = np.flatnonzero(free & (lengths.max(initial=0.0) + lengths + sweep >= least.min(initial=np.inf)))
        low, high = np.sort([place[:, 0], place[:, 0] + way[:, 0]], axis=0)
        reach = self._reach[targets]
        rows, columns = np.nonzero(
            (high[movers, None] >= low[targets] - reach) & (low[movers, None] <= high[targets] + reach)
        )
        first, second = movers[rows], targets[columns]
        start, chord = place[first] - place[second], way[first] - way[second]
        length = np.hypot(*chord.T)
        share = np.clip(-dot(start, chord) / np.where(length > 0, length**2, 1.0), 0, 1)[:, None]
        near = np.hypot(*(start + share * chord).T) <= self._reach[second]  # a turn does not change distances
        is_light = np.isfinite(after["mass"])
        near &= (length + sweep[second] >= least[first]) & (is_light[first] | is_light[second]) & (first != second)
        return first[near], second[near], start[near], chord[near]

    def _passage(self, step: Step, mover: int, target: int, path: Floats) -> Passage | None:
        """Return the passage of two bodies, if it is one."""
        shape, solid = self._solids[mover].core[1], self._solids[target]
        for start, end in pairwise(path.tolist()):
            for wall in solid.hits(start, end):
                touched = any(_touch(state, mover, wall) for state in (step.before, step.after))
                if not touched and self._collide(step, shape, wall):
                    way = float(np.hypot(*np.diff(path, axis=0).T).sum())
                    return Passage(step, mover, target, shape, wall, way)
        return None

    def _collide(self, step: Step, shape: pymunk.Shape, wall: pymunk.Shape) -> bool:
        """Return whether two shapes would collide if they met in a step."""
        bodies = {shape.body, wall.body}
        joints = map(self._roster.by_key.get, step.after.joints["key"].tolist())
        return (
            may_collide(shape, wall)
            and not may_be_ignored(self._space, shape, wall)
            and not any(joint and not joint.collide_bodies and {joint.a, joint.b} == bodies for joint in joints)
            and not (wall.body and is_static(wall.body) and off_its_place(wall))
        )


def _solids(roster: Roster) -> dict[int, _Solid]:
    """Return the shapes of each body, by its id: those that came, and went if they did, with their body."""
    solids: dict[int, _Solid] = {}
    for shape in roster.by_address.values():
        if shape.body and not shape.sensor and shape not in roster.unsteady and _is_finite(shape):
            solids.setdefault(shape.body.id, _Solid()).shapes.append(shape)
    return solids


def _is_finite(shape: pymunk.Shape) -> bool:
    return all(map(math.isfinite, (shape.radius, *(x for corner in corners_of(shape) for x in corner))))


def _copy(shape: pymunk.Shape, body: pymunk.Body) -> pymunk.Shape:
    """Return a shape of the same form on another body."""
    if isinstance(shape, pymunk.Circle):
        return pymunk.Circle(body, shape.radius, shape.offset)
    if isinstance(shape, pymunk.Segment):
        return pymunk.Segment(body, shape.a, shape.b, shape.radius)
    return pymunk.Poly(body, corners_of(shape), radius=shape.radius)


def _touch(state: Snapshot, body: int, wall: pymunk.Shape) -> bool:
    """Return whether the step before found a contact of a body with a shape."""
    sides = (("body_a", "shape_b"), ("body_b", "shape_a"))
    return any(
        ((state.contacts[first] == body) & (state.contacts[second] == shape_address(wall))).any()
        for first, second in sides
    )


def _path(start: Floats, chord: Floats, angle: float, turn: float) -> Floats:
    """Return the points of a way relative to a body, as seen from that body, which turns by so much: (n, 2) px."""
    shares = np.linspace(0, 1, 2 + min(MAX_CHORDS, int(abs(turn) / MAX_TURN)))
    x, y = (start + shares[:, None] * chord).T
    cos, sin = np.cos(angle + shares * turn), np.sin(angle + shares * turn)
    return np.column_stack([x * cos + y * sin, y * cos - x * sin])
