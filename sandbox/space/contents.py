"""The contents of a Space as the rules of the linter read them."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any, Final, TypeVar
from weakref import WeakSet

import numpy as np
import pymunk

from sandbox.errors import SandboxError
from sandbox.space.findings import BodyReport, Fault
from sandbox.space.origins import Origins

BODY_TYPES: Final = {pymunk.Body.DYNAMIC: "dynamic", pymunk.Body.KINEMATIC: "kinematic", pymunk.Body.STATIC: "static"}
Thing = TypeVar("Thing")  # a shape, body or joint
BodyOrShape = pymunk.Body | pymunk.Shape


@dataclass
class Contents:
    """What a Space has, and which of its shapes and bodies a rule has to look at: those added since the last time.

    seen: shapes, bodies and joints that rules have looked at.
    """

    space: pymunk.Space
    origins: Origins
    seen: WeakSet[Any] = field(default_factory=WeakSet)

    @cached_property
    def bodies(self) -> list[pymunk.Body]:
        """All bodies in order of addition, without the Space's own static body."""
        return list(self.space.bodies)

    @cached_property
    def shapes(self) -> list[pymunk.Shape]:
        """All shapes with a body, in order of addition."""
        return [shape for shape in self.space.shapes if shape.body is not None]

    @cached_property
    def solid(self) -> list[pymunk.Shape]:
        """The shapes that collide."""
        return [shape for shape in self.shapes if not shape.sensor]

    def new(self, things: Iterable[Thing]) -> list[Thing]:
        """Return those of some shapes, bodies or joints that were added since the last time."""
        return [thing for thing in things if thing not in self.seen]

    @cached_property
    def _index_of(self) -> dict[int, int]:
        return {id(body): index for index, body in enumerate(self.bodies)}

    def report(self, thing: BodyOrShape, detail: str) -> BodyReport:
        """Name a body, or a body by a shape of it, and what is wrong with it."""
        body, shape = (thing, None) if isinstance(thing, pymunk.Body) else (body_of(thing), thing)
        shape = shape or next(iter([*solid_of(body), *body.shapes]), None)
        kind = f"a {BODY_TYPES[body.body_type]} {shape_words(shape) if shape else 'body without a shape'}"
        line = self.origins.lines.get(body) or (self.origins.lines.get(shape, "") if shape else "")
        place = place_of(shape) if shape and not is_dynamic(body) else body.position
        return BodyReport(self._index_of.get(id(body)), kind, (place[0], place[1]), line, detail)

    def fault(self, rule: str, thing: BodyOrShape, what: str, size: float = 1.0, figure: str = "") -> Fault:
        """Return the fault of a body, or of a body by its shape."""
        return Fault(rule, self.report(thing, what), size, figure)

    def name(self, body: pymunk.Body) -> str:
        """Name a body in a sentence."""
        report = self.report(body, "")
        number = "" if report.index is None else f"body {report.index}, "
        return "the Space's static body" if body is self.space._static_body else f"{number}{report.kind}"

    def overlaps(self) -> Iterator[tuple[pymunk.Shape, pymunk.Shape, float]]:
        """Yield pairs of shapes that may collide, of which one is new, where their boxes meet, and their depth, px."""
        shapes, is_new = self.solid, [shape not in self.seen for shape in self.solid]
        # Of a shape that moves, where it is; of others, where Pymunk believes it to be
        boxes = [shape.bb if is_static(body_of(shape)) else shape.cache_bb() for shape in shapes]
        low, high = np.hsplit(np.array(boxes).reshape(-1, 4), 2)
        is_other = np.ones(len(shapes), bool)
        for number in np.flatnonzero(is_new).tolist():
            is_other[number] = False  # each pair once
            meets = is_other & ((low <= high[number]) & (high >= low[number])).all(axis=1)
            for other in np.flatnonzero(meets).tolist():
                if may_collide(shapes[number], shapes[other]):
                    yield shapes[number], shapes[other], depth_of(shapes[number], shapes[other])


def checked(space: pymunk.Space) -> pymunk.Space:
    """Return a Space. Raises SandboxError if it is not one."""
    if not isinstance(space, pymunk.Space):
        raise SandboxError(f"space must be a pymunk.Space, got {type(space).__name__}")
    return space


def body_of(shape: pymunk.Shape) -> pymunk.Body:
    """Return the body of a shape in a Space, which therefore has one."""
    assert shape.body is not None
    return shape.body


def solid_of(body: pymunk.Body) -> list[pymunk.Shape]:
    """Return the shapes of a body that collide, also if they are not in its Space."""
    return [shape for shape in body.shapes if not shape.sensor]


def end_of(joint: pymunk.Constraint) -> pymunk.Body:
    """Return a body that a joint holds, a dynamic one if there is any."""
    return joint.a if is_dynamic(joint.a) else joint.b


def is_dynamic(body: pymunk.Body) -> bool:
    """Return whether a body moves by forces."""
    return body.body_type == pymunk.Body.DYNAMIC


def is_static(body: pymunk.Body) -> bool:
    """Return whether a body never moves."""
    return body.body_type == pymunk.Body.STATIC


def may_collide(a: pymunk.Shape, b: pymunk.Shape) -> bool:
    """Return whether two solid shapes collide if they meet, by their bodies, filters and joints."""
    first, second = body_of(a), body_of(b)
    if first is second or not (is_dynamic(first) or is_dynamic(second)) or a.filter.rejects_collision(b.filter):
        return False
    return all(joint.collide_bodies or {joint.a, joint.b} != {first, second} for joint in first.constraints)


def depth_of(a: pymunk.Shape, b: pymunk.Shape) -> float:
    """Return how deep two shapes overlap, px; 0 if they are apart."""
    try:
        contact = a.shapes_collide(b)
    except AssertionError:  # how Pymunk says that there is no contact
        return 0.0
    if not contact.normal.length:  # their middles are at one place, or segments on one line
        return half_width(b) - a.point_query(place_of(b)).distance
    # Not `distance`, whose sign Pymunk turns if `a` is of a later kind than `b`: circles, segments, polygons
    return max((point.point_a - point.point_b).dot(contact.normal) for point in contact.points)


def half_width(shape: pymunk.Shape) -> float:
    """Return half the smallest width of a shape, px."""
    if not isinstance(shape, pymunk.Poly):
        return float(shape.radius)
    corners = shape.get_vertices()
    sides = [(a, (b - a).perpendicular_normal()) for a, b in pairwise([*corners, corners[0]]) if a != b]
    widths = [max(abs((corner - a).dot(normal)) for corner in corners) for a, normal in sides]
    return min(widths, default=0.0) / 2 + shape.radius


def half_length(shape: pymunk.Shape) -> float:
    """Return half the largest width of a shape, px."""
    corners = corners_of(shape)
    return max((a - b).length for a in corners for b in corners) / 2 + float(shape.radius)


def corners_of(shape: pymunk.Shape) -> list[pymunk.Vec2d]:
    """Return the points that a shape is around, at its radius, px, in the coordinates of its body."""
    if isinstance(shape, pymunk.Circle):
        return [shape.offset]
    if isinstance(shape, pymunk.Segment):
        return [shape.a, shape.b]
    assert isinstance(shape, pymunk.Poly)
    return shape.get_vertices()


def shape_words(shape: pymunk.Shape) -> str:
    """Describe a shape: its class and size."""
    if isinstance(shape, pymunk.Circle):
        return f"circle of radius {shape.radius:.4g}"
    if isinstance(shape, pymunk.Segment):
        return f"segment of length {(shape.b - shape.a).length:.4g}"
    return f"polygon of {len(corners_of(shape))} corners"


def place_of(shape: pymunk.Shape) -> tuple[float, float]:
    """Return the middle of a shape, px, in the coordinates of the Space."""
    return body_of(shape).local_to_world(shape.center_of_gravity)
