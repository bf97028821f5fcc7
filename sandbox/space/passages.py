"""Passages: bodies that went through a wall, whether it should stop them or not.

Pymunk moves bodies by their velocities, and looks for contacts where they then are. If the centre of gravity of a body
enters a static shape and leaves it on the other side, the body has passed: within a step, or as contacts push it out.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
import pymunk

from sandbox.space.contents import body_of, is_static, may_collide
from sandbox.space.recording import Recording, Step
from sandbox.space.rules import off_its_place

MIN_WAY: Final = 0.9  # px in a step: what is at rest need not be looked at
ROUNDING: Final = 1e-6  # of the way
OFF_COURSE: Final = 0.5  # of the way by its velocity: what moves it further off is something else


class Passage(NamedTuple):
    """A shape that passed a wall, and entered it in a step, by a way of so many px, from a place.

    stops: whether the wall should stop it, by bodies, filters and joints.
    """

    step: Step
    shape: pymunk.Shape
    wall: pymunk.Shape
    way: float
    start: pymunk.Vec2d
    stops: bool


class Passages:
    """Looks for passages after each step of a Space. found: so far, through walls that should stop; ghosts: others."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self.found: list[Passage] = []
        self.ghosts: list[Passage] = []
        self._entered: dict[tuple[pymunk.Shape, pymunk.Shape], Passage] = {}

    def look(self, step: Step) -> None:
        """Look at a step that was just done.

        Not judged: bodies that something else than their velocity moved; shapes that a handler may let through.
        """
        way = step.new["position"] - step.old["position"]
        by_velocity = step.old["velocity"] * step.dt
        length, off_course = np.hypot(*by_velocity.T), np.hypot(*(way - by_velocity).T)
        for row in np.flatnonzero((length > MIN_WAY) & (off_course < OFF_COURSE * length)).tolist():
            for met in self._met(step, row):
                self._entered.setdefault((met.shape, met.wall), met)
        for passage in list(self._entered.values()):
            self._leave(step, passage)

    def _met(self, step: Step, row: int) -> Iterator[Passage]:
        """Yield the walls that the centre of gravity of a body met by a step, for each shape that it is within."""
        body = self._recording.bodies[int(step.new["id"][row])]
        start, end = (pymunk.Vec2d(*rows["position"][row].tolist()) for rows in (step.old, step.new))
        way = (end - start).length
        start -= ROUNDING * (end - start)  # in whole px, bodies often start just at a surface
        for shape in body.shapes if body.space else ():
            if not shape.sensor and shape.point_query(end).distance <= 0:
                for hit in self._recording.space.segment_query(start, end, 0, pymunk.ShapeFilter()):
                    if (wall := hit.shape) and _is_wall(wall) and wall.point_query(start).distance > 0:
                        stops = may_collide(shape, wall)
                        if not (stops and self._may_be_ignored(shape, wall)):
                            yield Passage(step, shape, wall, way, start, stops)

    def _leave(self, step: Step, passage: Passage) -> None:
        """Decide whether a shape that entered a wall has passed it: once it is behind it, and the two do not touch."""
        shape, wall = passage.shape, passage.wall
        body = shape.body
        rows = np.flatnonzero(step.new["id"] == body.id).tolist() if body and shape.space and wall.space else []
        is_placed = passage.step is not step and any((step.was["position"] != step.old["position"])[rows].ravel())
        if not rows or is_placed:
            del self._entered[shape, wall]
            return
        end = pymunk.Vec2d(*step.new["position"][rows[0]].tolist())
        sides = [np.isin(step.contacts[side], [id(shape), id(wall)]) for side in ("shape_a", "shape_b")]
        is_behind, touches = bool(wall.segment_query(passage.start, end)), (sides[0] & sides[1]).any()
        if wall.point_query(end).distance > 0 and not (is_behind and touches):
            del self._entered[shape, wall]
            if is_behind:
                (self.found if passage.stops else self.ghosts).append(passage)

    def _may_be_ignored(self, shape: pymunk.Shape, wall: pymunk.Shape) -> bool:
        """Return whether a callback can prevent that a wall stops a shape."""
        types = {shape.collision_type, wall.collision_type}
        return any(
            (handler.begin or handler.pre_solve) and types >= {kind for kind in kinds if kind is not None}
            for kinds, handler in self._recording.space._handlers.items()
        )


def _is_wall(shape: pymunk.Shape) -> bool:
    """Return whether a shape is solid, and static where it was put."""
    return not shape.sensor and is_static(body_of(shape)) and not off_its_place(shape)
