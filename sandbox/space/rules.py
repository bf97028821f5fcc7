"""What the linter looks for in a Space: one function for each rule of rules.toml that holds without a step."""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Any, Final

import numpy as np
import pymunk

from sandbox.space.contents import (
    Contents,
    body_of,
    corners_of,
    end_of,
    half_length,
    half_width,
    is_dynamic,
    is_static,
    may_collide,
    place_of,
    shape_words,
    solid_of,
)
from sandbox.space.findings import CHANGES, Fault, Rules

MAX_MOMENT_RATIO: Final = 2.2  # a ring, or a hollow square, has twice the moment of a full one of its mass
MIN_MOMENT_RATIO: Final = 1 / 1.5  # of what is denser in its middle
MAX_OFF_CENTRE: Final = 0.15  # of the length of the longest shape
OVERLAP: Final = 0.01  # of the smaller half width, beyond collision_slop
FAR: Final = 3.0  # half lengths of a body, for an anchor
MAX_LEVER: Final = 2.0  # of the reach of a body's shapes, for a point at which it is pushed
NEAR: Final = 0.1  # half lengths of a shape
ANCHORED: Final = (pymunk.PinJoint, pymunk.SlideJoint, pymunk.DampedSpring)  # by two anchors, one on each body
MOVED: Final = 1e-6  # of the extent of a static shape, or of 1 px
ON_SHAPES: Final = ("elasticity", "friction", "filter", "collision_type", "sensor", "surface_velocity")
Touched = tuple[pymunk.Shape, pymunk.Shape | None, float | None]  # its first partner in a run, and when, s
# Attributes that a program may set, though Pymunk reads none of them, and what to write instead
IGNORED: Final = {
    **{name: change["instead"] for name, change in CHANGES["names"].items()},
    **{f"Body.{name}": f"shape.{name}" for name in ON_SHAPES},
}


def _given(contents: Contents) -> Iterator[tuple[pymunk.Body, list[pymunk.Shape]]]:
    """Yield the bodies whose mass and moment the program gave, not Pymunk, and their solid shapes of a size."""
    for body in contents.new(contents.bodies):
        shapes = [each for each in solid_of(body) if half_length(each) > 0 and math.isfinite(each.center_of_gravity.x)]
        if shapes and is_dynamic(body) and not any(shape.mass for shape in body.shapes):
            yield body, shapes


def _size(shape: pymunk.Shape) -> float:
    """Return the area of a shape, px², or the length of one without area, px: its part of the mass."""
    return shape.area if shape.area > 0 else 2 * half_length(shape)


def _moment_of(shape: pymunk.Shape, point: pymunk.Vec2d) -> float:
    """Return the moment of a shape of mass 1 about a point, px²."""
    corners = [corner - point for corner in corners_of(shape)]
    if isinstance(shape, pymunk.Circle):
        return pymunk.moment_for_circle(1, 0, shape.radius, corners[0])
    if isinstance(shape, pymunk.Segment):
        return pymunk.moment_for_segment(1, corners[0], corners[1], shape.radius)
    return pymunk.moment_for_poly(1, corners, radius=shape.radius)


def _moment(contents: Contents) -> Iterator[Fault]:
    """Moments below or above those of all shapes, if one has all mass: about its middle, or the centre of gravity."""
    for body, shapes in _given(contents):
        centre = body.center_of_gravity
        least = body.mass * min(_moment_of(shape, shape.center_of_gravity) for shape in shapes)
        moments = [body.mass * _moment_of(shape, centre) for shape in shapes]
        most, right = max(moments), float(np.average(moments, weights=[*map(_size, shapes)]))
        fits = MIN_MOMENT_RATIO * least <= body.moment <= MAX_MOMENT_RATIO * most
        # Contacts cannot turn frictionless circles round the centre of gravity
        can_turn = any(
            shape.friction or not isinstance(shape, pymunk.Circle) or shape.offset != centre for shape in shapes
        )
        if all(0 < number < math.inf for number in (least, most, body.moment)) and can_turn and not fits:
            size, how = max(body.moment / right, right / body.moment), "large" if body.moment > right else "small"
            what = f"moment {body.moment:.4g}, {size:.3g} times too {how}: its shapes have {right:.4g}"
            yield contents.fault("moment", body, what, size)


def _off_centre(contents: Contents) -> Iterator[Fault]:
    """Bodies with all shapes to one side of their centre of gravity, which is the default; none that a joint holds."""
    for body, shapes in _given(contents):
        middles = np.array([shape.center_of_gravity for shape in shapes])
        margin = MAX_OFF_CENTRE * 2 * max(map(half_length, shapes))
        is_beside = ((middles.min(axis=0) > margin) | (middles.max(axis=0) < -margin)).any()
        is_free = all(isinstance(joint, pymunk.DampedSpring) for joint in body.constraints)
        if is_beside and body.center_of_gravity == (0, 0) and math.isfinite(body.moment) and is_free:
            middle = pymunk.Vec2d(*np.average(middles, axis=0, weights=[*map(_size, shapes)]).tolist())
            places = f"centre of gravity at (0, 0), middle of its shapes at {_pair(middle)}"
            yield contents.fault("off-centre", body, f"{places}: {middle.length:.4g} px off", middle.length)


def _ends(contents: Contents, *, has_mass: bool) -> Iterator[tuple[str, pymunk.Body, pymunk.Body]]:
    """Yield the joints on bodies that were never added, or are gone, by their class; that body; and the other one."""
    for joint in contents.space.constraints:
        for body, end in ((joint.a, joint.b), (joint.b, joint.a)):
            if body.space is None and is_dynamic(body) and has_mass == bool(body.mass and body.moment):
                yield type(joint).__name__, body, end


def _joint_not_added(contents: Contents) -> Iterator[Fault]:
    for joint, _, end in _ends(contents, has_mass=False):
        what = f"its {joint} holds on to a Body() that was never added and has no mass"
        yield contents.fault("joint-not-added", end, what)


def _body_not_added(contents: Contents) -> Iterator[Fault]:
    for shape in contents.shapes:
        if body_of(shape).space is None:
            yield contents.fault("body-not-added", shape, f"its {shape_words(shape)} is still in the Space")
    for joint, body, end in _ends(contents, has_mass=True):
        yield contents.fault("body-not-added", body, f"its {joint} still holds {contents.name(end)}")


def _placed_twice(contents: Contents) -> Iterator[Fault]:
    """Walls that contain their body's position as a point of the body, but not the body's own origin."""
    for shape in (each for each in contents.new(contents.solid) if not is_dynamic(body_of(each))):
        position, corners = body_of(shape).position, np.array(corners_of(shape))
        margin = shape.radius + NEAR * half_length(shape)
        low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
        around = [bool(((point > low) & (point < high)).all()) for point in (np.array(position), np.zeros(2))]
        if around == [True, False]:
            at, about = _pair(position), _pair(place_of(shape))
            what = f"its body is at {at}, as are its corners; so they are about {about}"
            yield contents.fault("placed-twice", shape, what)


def _concave(contents: Contents) -> Iterator[Fault]:
    for shape in contents.new(contents.solid):
        if isinstance(shape, pymunk.Poly) and (dent := contents.origins.dents.get(shape)):
            what = f"a vertex that was given is {dent:.4g} px inside of what collides"
            yield contents.fault("concave", shape, what, dent)


def _anchor_far(contents: Contents) -> Iterator[Fault]:
    """Anchors far outside of their body that, as places in the Space, are within it."""
    for joint in contents.new(contents.space.constraints):
        if isinstance(joint, ANCHORED):
            for body, end, anchor in ((joint.a, joint.b, joint.anchor_a), (joint.b, joint.a, joint.anchor_b)):
                size = max(map(half_length, body.shapes), default=math.inf)
                if is_dynamic(body) and anchor.length > FAR * size and (anchor - body.position).length < size:
                    what = f"its {type(joint).__name__} to {contents.name(end)} has the anchor {_pair(anchor)}"
                    yield contents.fault("anchor-far", body, what, anchor.length / size, f"{anchor.length:.4g} px")


def _degrees(contents: Contents) -> Iterator[Fault]:
    """Bodies that do not spin, and begin with more than a turn, by a whole number."""
    for body in contents.bodies if not contents.seen else ():
        if abs(body.angle) > 2 * math.pi and body.angle.is_integer() and not body.angular_velocity:
            yield contents.fault("degrees", body, f"angle {body.angle:.4g}, {body.angle / (2 * math.pi):.3g} turns")


def _wrong_point(contents: Contents) -> Iterator[Fault]:
    """Bodies that were pushed at points far outside of them that, in the other coordinates, are within them."""
    for body, push in contents.origins.pushes.items():
        corners = [(corner, shape.radius) for shape in body.shapes for corner in corners_of(shape)]
        reach = max((math.dist(place, body.center_of_gravity) + r for place, r in corners), default=math.inf)
        is_other = push.lever > MAX_LEVER * reach and push.other_lever < reach
        if is_other and math.isfinite(body.moment) and body.space is contents.space:
            what = f"{push.call}: {push.lever:.3g} px off its centre of gravity"
            yield contents.fault("wrong-point", body, what, push.lever / reach)


def _categories(contents: Contents) -> Iterator[Fault]:
    """Categories of several bits, of which others use two on their own: numbers that were meant as numbers."""
    used = {shape.filter.categories for shape in contents.solid}
    single = {bits for bits in used if bits.bit_count() == 1}
    for shape in contents.new(contents.solid):
        parts = sorted(bits for bits in single if bits & shape.filter.categories)
        if len(parts) > 1 and shape.filter.categories != pymunk.ShapeFilter.ALL_CATEGORIES():
            what = f"category {shape.filter.categories} is {' and '.join(map(str, parts))} at once"
            yield contents.fault("categories", shape, what)


def _pair(point: tuple[float, float]) -> str:
    return f"({point[0]:.4g}, {point[1]:.4g})"


def _shape_not_added(contents: Contents) -> Iterator[Fault]:
    for body in filter(is_dynamic, contents.new(contents.bodies)):
        shapes = list(body.shapes)
        if shapes and all(shape.space is None for shape in shapes):
            yield contents.fault("shape-not-added", shapes[0], f"its {shape_words(shapes[0])} is not in the Space")


def unused(contents: Contents, quantity: str, shapes: Iterable[Touched]) -> Iterator[Fault]:
    """Yield the shapes with an elasticity or a friction, if all that they could meet has none.

    Of shapes that touched walls, it counts whether other walls have it, and of bodies, whether anything has. What the
    program set to 0 is meant so.
    """
    # Two shapes of each kind stand for all that another shape could meet
    kinds: dict[tuple[object, int, bool], list[pymunk.Shape]] = defaultdict(list)
    for shape in contents.solid:
        has_value = bool(getattr(shape, quantity)) or shape in contents.origins.zeros[quantity]
        kinds[shape.filter, body_of(shape).body_type, has_value].append(shape)
    for shape, met, since in shapes:
        partners: dict[pymunk.Shape, bool] = {}
        only_walls, value = met and not is_dynamic(body_of(met)), getattr(shape, quantity)
        for (_, kind, has_value), samples in kinds.items():
            if not (only_walls and kind == pymunk.Body.DYNAMIC):
                partners |= {each: has_value for each in samples[:2] if may_collide(shape, each)}
        if value and partners and not any(partners.values()):
            detail = f"{quantity} {value:g}, but a {shape_words(met or next(iter(partners)))} has {quantity} 0"
            yield contents.fault(f"{quantity}-unused", shape, detail, value)._replace(since=since)


def _not_finite(contents: Contents) -> Iterator[Fault]:
    for body in contents.bodies:
        if not all(map(math.isfinite, (*body.position, *body.velocity, body.angle, body.angular_velocity))):
            turns = f"angle {body.angle:.4g}, angular velocity {body.angular_velocity:.4g}"
            what = f"position {_pair(body.position)}, velocity {_pair(body.velocity)}, {turns}"
            yield contents.fault("not-finite", body, what)


def _ignored_attributes(contents: Contents) -> Iterator[Fault]:
    """Attributes that are known to have no effect, or whose names have other capitals or underscores than Pymunk's."""
    things: list[tuple[str, Any, Any]] = [("Body", body, body) for body in contents.new(contents.bodies)]
    things += [("Shape", shape, shape) for shape in contents.new(contents.shapes)]
    things += [("Joint", joint, end_of(joint)) for joint in contents.new(contents.space.constraints)]
    for kind, thing, place in things:
        for name in (name for name in vars(thing) if not name.startswith("_")):
            alike = (each for each in dir(type(thing)) if each.replace("_", "") == name.replace("_", "").lower())
            real = [each for each in alike if each != name]  # which a class of the program may have
            if cure := IGNORED.get(f"{kind}.{name}") or (f"{kind.lower()}.{real[0]}" if real else ""):
                yield contents.fault("attribute", place, f"{kind.lower()}.{name} was set; write {cure}")


def _overlaps(contents: Contents) -> Iterator[Fault]:
    is_first = not contents.seen and contents.space._get_arbiters()  # bodies touch since before
    for a, b, depth in contents.overlaps() if not is_first else ():
        smaller = min(filter(None, (half_width(a), half_width(b))), default=0.0)
        if depth > contents.space.collision_slop + OVERLAP * smaller:
            shape, partner = (a, b) if is_dynamic(body_of(a)) else (b, a)
            what = f"{depth:.4g} px deep in {contents.name(body_of(partner))}"
            yield contents.fault("overlap", shape, what, depth / (smaller or 1))


def _moved_static(contents: Contents) -> Iterator[Fault]:
    for shape in contents.shapes:
        if is_static(body_of(shape)) and (off := off_its_place(shape)):
            yield contents.fault("static-moved", shape, f"its bounding box is {off:.4g} px off where it was added", off)


def off_its_place(shape: pymunk.Shape) -> float:
    """Return how far the bounding box of a static shape is from where its body now has it, px; 0 if it is there."""
    points = np.array([body_of(shape).local_to_world(corner) for corner in corners_of(shape)])
    box = *(points.min(axis=0) - shape.radius), *(points.max(axis=0) + shape.radius)
    off = float(np.abs(np.subtract(box, shape.bb)).max())
    return off if off > MOVED * max(1.0, float(np.abs(points).max())) else 0.0


def _unused(contents: Contents) -> Iterator[Fault]:
    for quantity in contents.origins.zeros:
        yield from unused(contents, quantity, ((shape, None, None) for shape in contents.solid))


_OF_BODIES: Final = (_shape_not_added, _degrees, _off_centre, _moment)
_OF_SHAPES: Final = (_placed_twice, _concave, _categories, _overlaps)
_OF_JOINTS: Final = (_joint_not_added, _anchor_far)
RULES: Final[Rules[Contents]] = (*_OF_BODIES, *_OF_SHAPES, *_OF_JOINTS, _ignored_attributes)
END_RULES: Final[Rules[Contents]] = (_wrong_point, _body_not_added, _moved_static)  # at the end
UNSTEPPED_RULES: Final[Rules[Contents]] = (_not_finite, _unused)  # if no steps show more
