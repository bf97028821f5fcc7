"""Passages: bodies that went through each other within a step, which found no contact.

Pymunk moves bodies by their velocities, and looks for contacts where they then are. If the centre of gravity of one,
as seen from the other, goes through a shape that the step found no contact with, they have passed.
"""

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
import pymunk

from sandbox.space.contents import Contents, body_of, half_length, half_width, is_static, may_collide
from sandbox.space.recording import Recording, Rows, Step, address, pairs_of
from sandbox.space.rules import off_its_place

MAX_TURN: Final = 1.0  # rad in a step: seen from a body that turns further, ways are no straight lines


class Passage(NamedTuple):
    """Two bodies that passed in a step, by a way of so many px relative to the second; two of their shapes."""

    step: Step
    shape: pymunk.Shape
    wall: pymunk.Shape
    way: float


class Passages:
    """Finds the bodies that pass in each step, as soon as it is done.

    Not judged: bodies that something else than their velocity moved in the step, further than their shapes reach, which
    the push out of an overlap does not; shapes that a filter, a joint or a handler may let through; sensors.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._sizes: dict[int, tuple[float, float]] = {}  # of each body: its smallest half width, its reach
        self._counts: dict[int, int] = {}  # of its shapes

    def look(self, contents: Contents) -> None:
        """Read the sizes of the bodies, after something was added."""
        self._space = contents.space
        for body in contents.bodies:
            shapes = contents.solid_of.get(id(body), [])
            if len(shapes) != self._counts.get(body.id, 0):
                self._counts[body.id] = len(shapes)
                centre = body.center_of_gravity
                reaches = [half_length(shape) + (shape.center_of_gravity - centre).length for shape in shapes]
                self._sizes[body.id] = min(map(half_width, shapes), default=math.inf), max(reaches, default=0.0)

    def of(self, step: Step) -> Iterator[Passage]:
        """Yield the passages of a step that was just done."""
        _, before, after = pairs_of([(step.before, step.after)])
        ids = after["id"].tolist()
        half, reach = np.array([self._sizes.get(body, (math.inf, 0.0)) for body in ids]).reshape(-1, 2).T
        way, turn = after["position"] - before["position"], np.abs(after["angle"] - before["angle"])
        is_fast = np.hypot(*way.T) + turn * reach > half
        is_fast &= (np.hypot(*(way - before["velocity"] * step.dt).T) < reach) & (turn < MAX_TURN)
        if not is_fast.any():
            return
        rows = {body: (before[row], after[row]) for row, body in enumerate(ids)}
        for row in np.flatnonzero(is_fast).tolist():
            yield from self._passed_by(step, ids[row], rows, float(reach[row]))

    def _passed_by(self, step: Step, mover: int, rows: dict[int, tuple[Rows, Rows]], reach: float) -> Iterator[Passage]:
        body = self._recording.bodies[mover]
        if body.space is None:
            return
        boxes = [pymunk.BB.newForCircle(tuple(row["position"].tolist()), reach) for row in rows[mover]]
        for wall in self._space.bb_query(boxes[0].merge(boxes[1]), pymunk.ShapeFilter()):
            if wall.sensor or wall.body in (None, body):
                continue
            for shape in [shape for shape in body.shapes if not shape.sensor]:
                for passing, passed in ((shape, wall), (wall, shape)):
                    if way := _way_through(passing, passed, rows):
                        if self._collide(passing, passed) and not _touched(step, passing, passed):
                            yield Passage(step, passing, passed, way)
                        break

    def _collide(self, shape: pymunk.Shape, wall: pymunk.Shape) -> bool:
        """Return whether two shapes would collide if they met, and no callback of the program can prevent it."""
        types = {shape.collision_type, wall.collision_type}
        may_be_ignored = any(
            (handler.begin or handler.pre_solve) and types >= {kind for kind in kinds if kind is not None}
            for kinds, handler in self._space._handlers.items()
        )
        is_moved = is_static(body_of(wall)) and off_its_place(wall)
        return may_collide(shape, wall) and not may_be_ignored and not is_moved


def _way_through(shape: pymunk.Shape, wall: pymunk.Shape, rows: dict[int, tuple[Rows, Rows]]) -> float:
    """Return the way of a body's centre of gravity, as seen from another one, if it goes through its shape, px."""
    mover, target = rows.get(body_of(shape).id), rows.get(body_of(wall).id)
    if mover is None or half_width(shape) <= 0:
        return 0.0
    start, end = (pymunk.Vec2d(*row["position"].tolist()) for row in mover)
    if shape.point_query(end).distance > 0:  # its centre of gravity is outside of it
        return 0.0
    if target is not None:
        then, now = (pymunk.Vec2d(*row["position"].tolist()) for row in target)
        start = (start - then).rotated(float(target[1]["angle"] - target[0]["angle"])) + now
    hit = wall.segment_query(start, end)
    outside = min(wall.point_query(start).distance, wall.point_query(end).distance) > 0
    return (end - start).length if hit and 0 < hit.alpha < 1 and outside else 0.0


def _touched(step: Step, shape: pymunk.Shape, wall: pymunk.Shape) -> bool:
    """Return whether the body of a shape touched a wall at the end of a step, or of the one before."""
    body, other = body_of(shape).id, address(wall._shape)
    contacts = np.concatenate([step.before.contacts, step.after.contacts])
    sides = (("body_a", "shape_b"), ("body_b", "shape_a"))
    return any(bool(((contacts[first] == body) & (contacts[second] == other)).any()) for first, second in sides)
