"""What the linter looks for in a Space: one function for each rule of rules.toml."""

import dis
import math
from collections.abc import Iterator
from functools import lru_cache, partial
from itertools import combinations, pairwise
from types import CodeType
from typing import Final

import numpy as np
import pymunk

from sandbox.space.changes import NAMES
from sandbox.space.contents import (
    Contents,
    body_of,
    corners_of,
    depth_of,
    half_length,
    half_width,
    is_dynamic,
    is_static,
    may_collide,
    place_of,
    shape_words,
)
from sandbox.space.findings import Fault, Rules
from sandbox.space.recording import has_pymunks_law

MAX_MOMENT_RATIO: Final = 2.2  # a ring, or a hollow square, has twice the moment of a full one of its mass
MIN_MOMENT_RATIO: Final = 1 / 1.5  # of what is denser in its middle
MAX_OFF_CENTRE: Final = 0.05  # of the square root of the shapes' area
OVERLAP: Final = 0.01  # of the smaller half width, beyond collision_slop
MAX_JOIN_ANGLE: Final = math.radians(45)  # between segments that a body passes over
MAX_JOIN_GAP: Final = 1e-3  # of the shorter segment
MAX_MASS_RATIO: Final = 100.0
MAX_SLOP: Final = 0.2  # of a half width
MAX_DT: Final = 1 / 30  # s
DT_VARIES: Final = 1e-6  # relative, above rounding
FAR: Final = 3.0  # half lengths of a body, for an anchor
NEAR: Final = 0.1  # of the size of a shape
ANCHORED: Final = (pymunk.PinJoint, pymunk.SlideJoint, pymunk.DampedSpring)  # by two anchors, one on each body
MOVED: Final = 1e-6  # of the extent of a static shape, or of 1 px
_SPRINGS: Final = (pymunk.DampedSpring, pymunk.DampedRotarySpring)
LOOK_AHEAD: Final = 1.0  # s, of the straight path of a body
ON_SHAPES: Final = ("elasticity", "friction", "filter", "collision_type", "sensor", "surface_velocity")
OF_OLD_SHAPES: Final = ("group", "layers")  # before Pymunk 5
OF_OLD_BODIES: Final = ("velocity_limit", "angular_velocity_limit")


def _massless(contents: Contents) -> Iterator[Fault]:
    for body in contents.new_bodies:
        for value, name in ((body.mass, "mass"), (body.moment, "moment")):
            if not value > 0 or (name == "mass" and math.isinf(value)):
                yield Fault(1, contents.report(body, f"its {name} is {value:g}"))
                break


def _not_finite(contents: Contents) -> Iterator[Fault]:
    for body in contents.new_bodies:
        if not all(map(math.isfinite, (*body.position, *body.velocity, body.angle, body.angular_velocity))):
            yield not_finite(contents, body)


def not_finite(contents: Contents, body: pymunk.Body) -> Fault:
    """Return the fault of a body whose motion is not finite."""
    (x, y), (u, v) = body.position, body.velocity
    return Fault(1, contents.report(body, f"position ({x:.4g}, {y:.4g}), velocity ({u:.4g}, {v:.4g})"))


def _no_mass_of_its_own(contents: Contents) -> Iterator[Fault]:
    for body in contents.new_bodies:
        shapes = contents.solid_of.get(id(body), [])
        if any(shape.mass > 0 for shape in shapes):
            for shape in shapes:
                if shape.mass == 0:
                    yield Fault(1, contents.report(body, f"its {shape_words(shape)} has density 0", shape))


def _moment(contents: Contents) -> Iterator[Fault]:
    """Moments that the program gave, of bodies that something can turn, which do not fit.

    If the centre of gravity is off the shapes, a moment about their middle fits too: it is the centre that is wrong.
    """
    for body in contents.new_bodies:
        shapes = contents.solid_of.get(id(body), [])
        if not 0 < body.mass < math.inf or not 0 < body.moment < math.inf or not _can_turn(contents, body):
            continue
        centres = body.center_of_gravity, _missed_middle(shapes, body) or body.center_of_gravity
        of_shapes = [body.mass * _radius_of_gyration_squared(shapes, centre) for centre in centres]
        ratios = [body.moment / moment for moment in of_shapes if moment]
        if len(ratios) == 2 and not any(MIN_MOMENT_RATIO <= ratio <= MAX_MOMENT_RATIO for ratio in ratios):
            size, how = max(ratios[1], 1 / ratios[1]), "large" if ratios[1] > 1 else "small"
            what = f"moment {body.moment:.4g}, {size:.3g} times too {how}: its shapes have {of_shapes[1]:.4g}"
            yield Fault(size, contents.report(body, what))


def _can_turn(contents: Contents, body: pymunk.Body) -> bool:
    """Return whether something can turn a body: not a frictionless circle round its centre of gravity.

    If its shapes have mass, Pymunk computed the moment from them.
    """
    shapes = contents.solid_of.get(id(body), [])
    if not shapes or any(shape.mass for shape in shapes):
        return False
    smooth = all(
        isinstance(shape, pymunk.Circle) and not shape.friction and shape.offset == body.center_of_gravity
        for shape in shapes
    )
    return not smooth or bool(body.constraints) or body.angular_velocity != 0 or body.torque != 0


def _area(shape: pymunk.Shape) -> float:
    """Return the area by which mass is shared among shapes: of a segment without thickness, its length."""
    return shape.area or ((shape.b - shape.a).length if isinstance(shape, pymunk.Segment) else 0.0)


def _radius_of_gyration_squared(shapes: list[pymunk.Shape], centre: pymunk.Vec2d) -> float:
    """Return the moment per mass of shapes of one density, about a point of their body, px²."""
    areas = [_area(shape) for shape in shapes]
    if not sum(areas):
        return 0.0
    about = (area * _shape_gyration(shape, centre) for area, shape in zip(areas, shapes, strict=True))
    return sum(about) / sum(areas)


def _shape_gyration(shape: pymunk.Shape, centre: pymunk.Vec2d) -> float:
    if isinstance(shape, pymunk.Circle):
        return pymunk.moment_for_circle(1, 0, shape.radius, shape.offset - centre)
    if isinstance(shape, pymunk.Segment):
        return pymunk.moment_for_segment(1, shape.a - centre, shape.b - centre, shape.radius)
    assert isinstance(shape, pymunk.Poly)
    return pymunk.moment_for_poly(1, shape.get_vertices(), -centre, shape.radius)


def _missed_middle(shapes: list[pymunk.Shape], body: pymunk.Body) -> pymunk.Vec2d | None:
    """Return the middle of a body's shapes if the centre of gravity should be there, but is not."""
    areas = np.array([_area(shape) for shape in shapes])
    given = any(shape.mass for shape in shapes)  # then Pymunk computed the centre of gravity
    if given or areas.sum() <= 0 or math.isinf(body.moment) or _turns_about_a_joint(body):
        return None
    middle = pymunk.Vec2d(*(areas @ np.array([shape.center_of_gravity for shape in shapes]) / areas.sum()).tolist())
    off = math.dist(middle, body.center_of_gravity)
    return middle if off > MAX_OFF_CENTRE * math.sqrt(areas.sum()) else None


def _off_centre(contents: Contents) -> Iterator[Fault]:
    for body in contents.new_bodies:
        if middle := _missed_middle(contents.solid_of.get(id(body), []), body):
            (x, y), (gx, gy) = middle, body.center_of_gravity
            off = math.dist(middle, body.center_of_gravity)
            detail = f"centre of gravity at ({gx:.4g}, {gy:.4g}), middle of its shapes at ({x:.4g}, {y:.4g})"
            yield Fault(off, contents.report(body, f"{detail}: {off:.4g} px off"))


def _turns_about_a_joint(body: pymunk.Body) -> bool:
    """Return whether a joint holds a body to what does not move by forces, so that its place is meant to turn about."""
    return any(not is_dynamic(joint.a) or not is_dynamic(joint.b) for joint in body.constraints)


def _without_shape(contents: Contents) -> Iterator[Fault]:
    for body in contents.new_bodies:
        if not body.shapes and not body.constraints:
            yield Fault(1, contents.report(body, "it has no shape and no joint"))


def _joint_not_added(contents: Contents) -> Iterator[Fault]:
    for joint in contents.space.constraints:
        for body, end in ((joint.a, joint.b), (joint.b, joint.a)):
            if body.space is None and is_dynamic(body) and not (body.mass and body.moment):
                what = f"its {type(joint).__name__} holds on to a Body() that was never added and has no mass"
                yield Fault(1, contents.report(end, what))


def _body_not_added(contents: Contents) -> Iterator[Fault]:
    for shape in contents.shapes:
        if body_of(shape).space is None:
            what = f"its {shape_words(shape)} is still in the Space"
            yield Fault(1, contents.report(body_of(shape), what, shape))
    for joint in contents.space.constraints:
        for body, end in ((joint.a, joint.b), (joint.b, joint.a)):
            if body.space is None and is_dynamic(body) and body.mass and body.moment:
                yield Fault(1, contents.report(body, f"its {type(joint).__name__} still holds {contents.name(end)}"))


def _placed_twice(contents: Contents) -> Iterator[Fault]:
    """Walls that contain their body's position as a point of the body, but not the body's own origin."""
    for shape in filter(contents.is_new, contents.solid):
        body, corners = body_of(shape), np.array(corners_of(shape))
        margin = shape.radius + NEAR * half_length(shape)
        low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
        around = [bool(((point > low) & (point < high)).all()) for point in (np.array(body.position), np.zeros(2))]
        if not is_dynamic(body) and around == [True, False]:
            (x, y), (u, v) = body.position, place_of(shape)
            what = f"its body is at ({x:.4g}, {y:.4g}), as are its corners; so they are about ({u:.4g}, {v:.4g})"
            yield Fault(1, contents.report(body, what, shape))


def _concave(contents: Contents) -> Iterator[Fault]:
    for shape in contents.solid:
        if isinstance(shape, pymunk.Poly) and contents.is_new(shape) and (dent := contents.origins.dents.get(shape)):
            what = f"a vertex that was given is {dent:.4g} px inside of what collides"
            yield Fault(dent, contents.report(body_of(shape), what, shape))


def _anchor_far(contents: Contents) -> Iterator[Fault]:
    """Anchors far outside of their body that, as places in the Space, are within it."""
    for joint in contents.space.constraints:
        if isinstance(joint, ANCHORED) and joint not in contents.seen:
            for body, end, anchor in ((joint.a, joint.b, joint.anchor_a), (joint.b, joint.a, joint.anchor_b)):
                size = max(map(half_length, body.shapes), default=math.inf)
                if is_dynamic(body) and anchor.length > FAR * size and (anchor - body.position).length < size:
                    off = f"{anchor.length:.4g} px"
                    what = f"its {type(joint).__name__} to {contents.name(end)} has the anchor {_pair(anchor)}"
                    yield Fault(anchor.length / size, contents.report(body, what), off)


def _categories(contents: Contents) -> Iterator[Fault]:
    """Categories of several bits, of which others use two on their own: numbers that were meant as numbers."""
    used = {shape.filter.categories for shape in contents.solid}
    single = {bits for bits in used if bits.bit_count() == 1}
    for shape in filter(contents.is_new, contents.solid):
        parts = sorted(bits for bits in single if bits & shape.filter.categories)
        if len(parts) > 1 and shape.filter.categories != pymunk.ShapeFilter.ALL_CATEGORIES():
            what = f"category {shape.filter.categories} is {' and '.join(map(str, parts))} at once"
            yield Fault(1, contents.report(body_of(shape), what, shape))


def _motor_unlimited(contents: Contents) -> Iterator[Fault]:
    for joint in contents.space.constraints:
        if isinstance(joint, pymunk.SimpleMotor) and joint not in contents.seen and math.isinf(joint.max_force):
            body, end = (joint.a, joint.b) if is_dynamic(joint.a) else (joint.b, joint.a)
            if joint.rate:
                what = f"turns against {contents.name(end)} at {joint.rate:.3g} rad/s, with any torque that this takes"
                yield Fault(abs(joint.rate), contents.report(body, what))


def _pair(point: pymunk.Vec2d) -> str:
    return f"({point.x:.4g}, {point.y:.4g})"


def _shape_not_added(contents: Contents) -> Iterator[Fault]:
    for body in contents.new_bodies:
        shapes = list(body.shapes)
        if shapes and all(shape.space is None for shape in shapes):
            yield Fault(1, contents.report(body, f"its {shape_words(shapes[0])} is not in the Space", shapes[0]))


def _too_elastic(contents: Contents) -> Iterator[Fault]:
    for shape in contents.solid:
        if contents.is_new(shape) and shape.elasticity > 1:
            yield Fault(shape.elasticity, contents.report(body_of(shape), f"elasticity {shape.elasticity:g}", shape))


def _products(contents: Contents, quantity: str, *, without_any_effect: bool) -> Iterator[Fault]:
    """Shapes with an elasticity or a friction, and partners that have none."""
    shapes = dict.fromkeys((*filter(contents.is_new, contents.solid), *contents.partners))
    with_value = [shape for shape in shapes if getattr(shape, quantity)]
    samples = _samples(contents, quantity) if with_value else []
    for shape in with_value:
        partners = [partner for partner in samples if _could_meet(shape, partner)]
        has_no_effect = not any(getattr(partner, quantity) for partner in partners)
        met = dict.fromkeys(partners) if contents.met is None else _met_without(contents, shape, quantity)
        without = next((each for each in met.items() if not getattr(each[0], quantity)), None)
        if without and has_no_effect == without_any_effect:
            value, (partner, since) = getattr(shape, quantity), without
            detail = f"{quantity} {value:g}, but a {shape_words(partner)} has {quantity} 0"
            yield Fault(value, contents.report(body_of(shape), detail, shape), since=since)


def _samples(contents: Contents, quantity: str) -> list[pymunk.Shape]:
    """Return two shapes of each kind, which stand for all that another shape could meet."""
    kinds: dict[object, list[pymunk.Shape]] = {}
    for shape in contents.solid:
        kind = kinds.setdefault((shape.filter, body_of(shape).body_type, bool(getattr(shape, quantity))), [])
        if len(kind) < 2:
            kind.append(shape)
    return [shape for kind in kinds.values() for shape in kind]


def _met_without(contents: Contents, shape: pymunk.Shape, quantity: str) -> dict[pymunk.Shape, float | None]:
    """Return since when, s, a shape met others in contacts whose elasticity, or friction, was 0."""
    meetings = [meeting for meeting in contents.partners.get(shape, ()) if not getattr(meeting, quantity)]
    return {meeting.other(shape): meeting.since for meeting in meetings}


def _could_meet(a: pymunk.Shape, b: pymunk.Shape) -> bool:
    """Return whether two shapes, or others of their kinds, could collide."""
    apart = body_of(a) is not body_of(b)
    return apart and (is_dynamic(body_of(a)) or is_dynamic(body_of(b))) and not a.filter.rejects_collision(b.filter)


def _ignored_attributes(contents: Contents) -> Iterator[Fault]:
    for shape in filter(contents.is_new, contents.shapes):
        for name in filter(vars(shape).__contains__, OF_OLD_SHAPES):
            cure = NAMES[f"Shape.{name}"].plain
            yield Fault(1, contents.report(body_of(shape), f"shape.{name} was set; write {cure}", shape))
    for body in contents.new_bodies:
        cures = {name: NAMES[f"Body.{name}"].plain for name in OF_OLD_BODIES}
        for name, cure in (cures | {name: f"shape.{name}" for name in ON_SHAPES}).items():
            if name in vars(body):
                yield Fault(1, contents.report(body, f"body.{name} was set; write {cure}"))


def _overlaps(contents: Contents, *, joined: bool) -> Iterator[Fault]:
    """Shapes that overlap, of bodies that a joint connects, or of others."""
    for a, b, depth in contents.touching:
        smaller = min(filter(None, (half_width(a), half_width(b))), default=0.0)
        if depth > contents.space.collision_slop + OVERLAP * smaller and joined == _are_joined(a, b):
            shape, partner = (a, b) if is_dynamic(body_of(a)) else (b, a)
            number = contents.index_of.get(id(body_of(partner)))
            name = shape_words(partner) + ("" if number is None else f" of body {number}")
            detail = f"overlaps a {name} by {depth:.4g} px"
            yield Fault(depth / (smaller or 1), contents.report(body_of(shape), detail, shape))


def _are_joined(a: pymunk.Shape, b: pymunk.Shape) -> bool:
    second = body_of(b)
    return any(second in (joint.a, joint.b) for joint in body_of(a).constraints)


def _cracks(contents: Contents) -> Iterator[Fault]:
    segments = [
        shape
        for shape in contents.solid
        if isinstance(shape, pymunk.Segment) and not is_dynamic(body_of(shape)) and shape.a != shape.b
    ]
    movers = [shape for shape in contents.solid if is_dynamic(body_of(shape))]
    if not any(map(contents.is_new, segments)) or not movers:
        return
    for a, b, end, beyond_a, beyond_b in _joins(segments):
        if contents.is_new(a) or contents.is_new(b):
            open_ends = [shape for shape, beyond in ((a, beyond_a), (b, beyond_b)) if _pushes_back(shape, end, beyond)]
            if open_ends and any(not mover.filter.rejects_collision(open_ends[0].filter) for mover in movers):
                detail = f"meets the next segment at ({end.x:.4g}, {end.y:.4g}) without set_neighbors"
                yield Fault(1, contents.report(body_of(open_ends[0]), detail, open_ends[0]))


def _joins(
    segments: list[pymunk.Segment],
) -> Iterator[tuple[pymunk.Segment, pymunk.Segment, pymunk.Vec2d, pymunk.Vec2d, pymunk.Vec2d]]:
    """Yield segments that continue each other: both, the common end, and the far end of the second and the first."""
    ends: dict[tuple[int, int], list[tuple[pymunk.Segment, pymunk.Vec2d, pymunk.Vec2d]]] = {}
    shortest = min((segment.b - segment.a).length for segment in segments)
    cell = MAX_JOIN_GAP * shortest
    for segment in segments:
        a, b = (body_of(segment).local_to_world(point) for point in (segment.a, segment.b))
        for near, far in ((a, b), (b, a)):
            ends.setdefault((round(near.x / cell), round(near.y / cell)), []).append((segment, near, far))
    for meeting in ends.values():
        for (first, near, far), (second, _, beyond) in combinations(meeting, 2):
            turn = abs((near - far).get_angle_between(beyond - near))
            if turn <= MAX_JOIN_ANGLE and first.radius == second.radius:
                yield first, second, near, beyond, far


def _pushes_back(segment: pymunk.Segment, end: pymunk.Vec2d, beyond: pymunk.Vec2d) -> bool:
    """Return whether a segment's end collides with what comes along the next segment: it has no neighbour there."""
    probe = pymunk.Body(1, 1)
    radius = segment.radius or 1e-3 * (segment.b - segment.a).length
    probe.position = end + (beyond - end).normalized() * (segment.radius + radius / 2)
    disc = pymunk.Circle(probe, radius)
    disc.cache_bb()
    return depth_of(segment, disc) is not None


def _too_fast(contents: Contents) -> Iterator[Fault]:
    """Bodies that will meet a wall so fast that a step can carry them through, if nothing bends their path."""
    for body in contents.new_bodies:
        shapes = contents.solid_of.get(id(body), [])
        speed = body.velocity.length
        if not shapes or not 0 < speed < math.inf:
            continue
        wall = _first_ahead(contents, body, max(shapes, key=half_width))
        if wall and is_static(body_of(wall)):
            passing = (
                max(_half_along(shape, body.velocity) for shape in shapes) + half_width(wall)
            ) / contents.steps.dt
            if passing < speed:
                how = (
                    f"{speed:.4g} px/s; from {passing:.4g} px/s on, one step can carry it through a {shape_words(wall)}"
                )
                yield Fault(speed / passing if passing else math.inf, contents.report(body, how))


def _half_along(shape: pymunk.Shape, way: pymunk.Vec2d) -> float:
    """Return half the width of a shape along a way of its body, px."""
    direction = way.rotated(-body_of(shape).angle).normalized()
    along = [corner.dot(direction) for corner in corners_of(shape)]
    return (max(along) - min(along)) / 2 + float(shape.radius)


def _first_ahead(contents: Contents, body: pymunk.Body, shape: pymunk.Shape) -> pymunk.Shape | None:
    """Return what a shape of a body will meet first on a straight path."""
    start, end = body.position, body.position + body.velocity * LOOK_AHEAD
    hits = contents.space.segment_query(start, end, half_width(shape), pymunk.ShapeFilter())
    solid = [hit for hit in hits if hit.shape and not hit.shape.sensor and may_collide(shape, hit.shape)]
    ahead = [hit for hit in solid if hit.alpha > 0]  # it does not yet touch them
    return min(ahead, key=lambda hit: hit.alpha).shape if ahead else None


def may_be_ignored(space: pymunk.Space, a: pymunk.Shape, b: pymunk.Shape) -> bool:
    """Return whether a callback of the program may say that a contact of two shapes is not to be processed."""
    types = {a.collision_type, b.collision_type}
    return any(
        (handler.begin or handler.pre_solve) and types >= {kind for kind in kinds if kind is not None}
        for kinds, handler in space._handlers.items()
    )


def _ignored_returns(contents: Contents) -> Iterator[Fault]:
    for types, handler in contents.space._handlers.items():
        for name in ("begin", "pre_solve"):
            code = getattr(getattr(handler, name), "__code__", None)
            if code and (returned := _truth_returned(code)):
                between = " and ".join("any" if kind is None else str(kind) for kind in types)
                yield Fault(1, None, f"{returned} ({name} of types {between}: {code.co_qualname})")


@lru_cache
def _truth_returned(code: CodeType) -> str:
    """Return which truth value that is not always True a function returns, and says no other way; empty if none."""
    if "process_collision" in code.co_names:
        return ""
    for before, last in pairwise(dis.get_instructions(code)):
        if last.opname == "RETURN_CONST" and last.argval is False:
            return "False"
        if last.opname == "RETURN_VALUE" and before.opname == "LOAD_CONST" and before.argval is False:
            return "False"
        if last.opname == "RETURN_VALUE" and before.opname in ("COMPARE_OP", "IS_OP", "CONTAINS_OP", "UNARY_NOT"):
            return "a condition"
    return ""


def _mass_ratio(contents: Contents) -> Iterator[Fault]:
    """Dynamic bodies that touch, or are joined, of which one is much heavier."""
    pairs = {(body_of(a), body_of(b)) for a, b, _ in contents.touching}
    new = set(contents.new_bodies)
    pairs |= {(joint.a, joint.b) for joint in contents.space.constraints if joint.a in new or joint.b in new}
    for a, b in sorted(pairs, key=lambda pair: [body.id for body in pair]):
        if not (is_dynamic(a) and is_dynamic(b)) or not (0 < a.mass < math.inf and 0 < b.mass < math.inf):
            continue
        heavy, light = (a, b) if a.mass > b.mass else (b, a)
        if (ratio := heavy.mass / light.mass) > MAX_MASS_RATIO:
            detail = f"mass {heavy.mass:.4g}, {ratio:.4g} times that of body {contents.index_of.get(id(light), '?')}"
            yield Fault(ratio, contents.report(heavy, detail))


def _stiff_springs(contents: Contents) -> Iterator[Fault]:
    """Springs whose bodies swing wider in each step.

    In a step, x += v dt and then v = d (v - k x dt / m), with d = exp(-damping dt / m), m the mass or moment that the
    spring moves. The eigenvalues are within the unit circle if k dt² / m < 2 (1 + 1/d).
    """
    dt = contents.steps.dt
    for joint in contents.space.constraints:
        if (
            joint not in contents.seen
            and math.isinf(joint.max_force)
            and isinstance(joint, _SPRINGS)
            and has_pymunks_law(joint)
        ):
            mobility = _mobility(joint)
            limit = 2 * (1 + math.exp(min(joint.damping * dt * mobility, 700.0)))
            ratio = joint.stiffness * dt**2 * mobility / limit
            if ratio > 1:
                largest = f"steps of {dt:.4g} s bear {joint.stiffness / ratio:.3g}"
                what = f"its {type(joint).__name__} has the stiffness {joint.stiffness:.4g}; {largest}"
                yield Fault(ratio, contents.report(joint.a if is_dynamic(joint.a) else joint.b, what))


def _mobility(spring: pymunk.DampedSpring | pymunk.DampedRotarySpring) -> float:
    """Return by what velocity, px/s or rad/s, an impulse of 1 along a spring changes that of its ends."""
    bodies = [body for body in (spring.a, spring.b) if is_dynamic(body)]
    if isinstance(spring, pymunk.DampedRotarySpring):
        return sum(1 / body.moment for body in bodies if body.moment)
    ends = {spring.a: spring.a.local_to_world(spring.anchor_a), spring.b: spring.b.local_to_world(spring.anchor_b)}
    direction = (ends[spring.b] - ends[spring.a]).normalized()
    arms = [(ends[body] - body.local_to_world(body.center_of_gravity)).cross(direction) for body in bodies]
    masses = zip(bodies, arms, strict=True)
    return sum(1 / body.mass + arm**2 / body.moment for body, arm in masses if body.mass and body.moment)


def _sinks_in(contents: Contents) -> Iterator[Fault]:
    slop = contents.space.collision_slop
    for body in contents.new_bodies:
        widths = [half for shape in contents.solid_of.get(id(body), []) if (half := half_width(shape))]
        if widths and slop > MAX_SLOP * max(widths):
            share = slop / max(widths)
            detail = f"half of its width is {max(widths):.4g}, collision_slop {slop:g}: {share:.0%} of that"
            yield Fault(share, contents.report(body, detail))


def _moved_static(contents: Contents) -> Iterator[Fault]:
    for shape in contents.shapes:
        if is_static(body_of(shape)) and contents.is_new(shape) and (off := off_its_place(shape)):
            what = f"its bounding box is {off:.4g} px off where it was added"
            yield Fault(off, contents.report(body_of(shape), what, shape))


def off_its_place(shape: pymunk.Shape) -> float:
    """Return how far the bounding box of a static shape is from where its body now has it, px; 0 if it is there."""
    points = np.array([body_of(shape).local_to_world(corner) for corner in corners_of(shape)])
    low, high = points.min(axis=0) - shape.radius, points.max(axis=0) + shape.radius
    box = shape.bb
    off = np.abs([*(low - (box.left, box.bottom)), *(high - (box.right, box.top))]).max()
    return float(off) if off > MOVED * max(1.0, float(np.abs(points).max())) else 0.0


def _damping_outside(contents: Contents) -> Iterator[Fault]:
    damping = contents.space.damping
    if not contents.seen and not 0 < damping <= 1:
        yield Fault(1, None, f"{damping:g}")


def _long_steps(contents: Contents) -> Iterator[Fault]:
    if contents.steps.longest > MAX_DT * (1 + DT_VARIES):
        yield Fault(1, None, f"{contents.steps.longest:.4g} s")


def _steps_vary(contents: Contents) -> Iterator[Fault]:
    shortest, longest = contents.steps.shortest, contents.steps.longest
    if contents.steps.count > 1 and longest > shortest * (1 + DT_VARIES):
        yield Fault(1, None, f"from {shortest:.4g} to {longest:.4g} s")


def _invalid_steps(contents: Contents) -> Iterator[Fault]:
    if contents.steps.invalid is not None:
        yield Fault(1, None, f"{contents.steps.invalid:g} s")


PRODUCT_RULES: Final[Rules[Contents]] = {
    "elasticity-unused": partial(_products, quantity="elasticity", without_any_effect=True),
    "friction-unused": partial(_products, quantity="friction", without_any_effect=True),
    "elasticity-zero": partial(_products, quantity="elasticity", without_any_effect=False),
    "friction-zero": partial(_products, quantity="friction", without_any_effect=False),
}
END_RULES: Final[Rules[Contents]] = {**PRODUCT_RULES, "body-not-added": _body_not_added}  # a run shows more of these
RULES: Final[Rules[Contents]] = {
    "mass": _massless,
    "joint-not-added": _joint_not_added,
    "not-finite": _not_finite,
    "dt-invalid": _invalid_steps,
    "shape-not-added": _shape_not_added,
    "attribute": _ignored_attributes,
    "return-ignored": _ignored_returns,
    "placed-twice": _placed_twice,
    "static-moved": _moved_static,
    "concave": _concave,
    "anchor-far": _anchor_far,
    "spring-stiff": _stiff_springs,
    "off-centre": _off_centre,
    "moment": _moment,
    "overlap-joined": partial(_overlaps, joined=True),
    "elasticity": _too_elastic,
    "damping-range": _damping_outside,
    "categories": _categories,
    "overlap": partial(_overlaps, joined=False),
    "dt-long": _long_steps,
    "dt-varies": _steps_vary,
    "slop": _sinks_in,
    "density": _no_mass_of_its_own,
    "no-shape": _without_shape,
    "cracks": _cracks,
    "motor-unlimited": _motor_unlimited,
    "tunnelling": _too_fast,
    "mass-ratio": _mass_ratio,
    **END_RULES,
}
