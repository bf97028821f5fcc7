"""Passages: bodies that went through a wall within a step, which found no contact.

Pymunk moves bodies by their velocities, and looks for contacts where they then are. If the centre of gravity of a body
went through a static shape that the step found no contact with, the body has passed.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
import pymunk

from sandbox.space.contents import body_of, is_static, may_collide
from sandbox.space.recording import Recording, Step
from sandbox.space.rules import off_its_place

MIN_WAY: Final = 2.0  # px in a step
OFF_COURSE: Final = 0.5  # of its way: what moved it further than that is not its velocity


class Passage(NamedTuple):
    """A shape that passed a wall in a step, by a way of so many px."""

    step: Step
    shape: pymunk.Shape
    wall: pymunk.Shape
    way: float


def passages_of(step: Step, space: pymunk.Space, recording: Recording) -> Iterator[Passage]:
    """Yield the passages of a step that was just done.

    Not judged: bodies that something else than their velocity moved; shapes that a filter, a joint or a handler may let
    through.
    """
    way = step.new["position"] - step.old["position"]
    length, off_course = np.hypot(*way.T), np.hypot(*(way - step.old["velocity"] * step.dt).T)
    for row in np.flatnonzero((length > MIN_WAY) & (off_course < OFF_COURSE * length)).tolist():
        body = recording.bodies.get(int(step.new["id"][row]))
        start, end = (tuple(rows["position"][row].tolist()) for rows in (step.old, step.new))
        for shape in body.shapes if body and body.space else ():
            if not shape.sensor and shape.point_query(end).distance <= 0:  # its centre of gravity is within it
                walls = [hit.shape for hit in space.segment_query(start, end, 0, shape.filter) if hit.shape]
                passed = [wall for wall in walls if _stops(wall, shape, space) and not _touched(step, shape, wall)]
                for wall in passed:
                    if all(wall.point_query(place).distance > 0 for place in (start, end)):
                        yield Passage(step, shape, wall, float(length[row]))


def _stops(wall: pymunk.Shape, shape: pymunk.Shape, space: pymunk.Space) -> bool:
    """Return whether a static shape stops another one if they meet, and no callback of the program can prevent it."""
    types = {shape.collision_type, wall.collision_type}
    may_be_ignored = any(
        (handler.begin or handler.pre_solve) and types >= {kind for kind in kinds if kind is not None}
        for kinds, handler in space._handlers.items()
    )
    if wall.sensor or may_be_ignored or not is_static(body_of(wall)):
        return False
    return may_collide(shape, wall) and not off_its_place(wall)


def _touched(step: Step, shape: pymunk.Shape, wall: pymunk.Shape) -> bool:
    """Return whether a shape touched a wall in a step."""
    pair = [id(shape), id(wall)]
    return bool((np.isin(step.contacts["shape_a"], pair) & np.isin(step.contacts["shape_b"], pair)).any())
