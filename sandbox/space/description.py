"""A whole `pymunk.Space` as plain data: what is in it, in which state, and how it is rebuilt.

Names are Pymunk's own. Functions of the program are named, not kept. A rebuilt Space starts afresh: it has no cached
impulses, and steps as the Space would if it had just been built in this state, in this order.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal, Self, get_args

import numpy as np
import pymunk
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    Strict,
    WithJsonSchema,
    model_serializer,
    model_validator,
)
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.errors import KeyPath, SandboxError, shown
from sandbox.scene.fields import Model
from sandbox.scene.validation import Problem, invalid
from sandbox.space.memory import SpaceMemory

INFINITY: Final = "Infinity"  # how infinite numbers are written: JSON has none


def _from_json(value: object) -> object:
    return {INFINITY: math.inf, f"-{INFINITY}": -math.inf}.get(value, value) if isinstance(value, str) else value


def _to_json(value: float) -> float | str:
    return value if math.isfinite(value) else INFINITY if value > 0 else f"-{INFINITY}"


def _check_number(value: float) -> float:
    if math.isnan(value):
        raise invalid(((), "must be a number, got nan"))
    return value


_Infinite = (
    BeforeValidator(_from_json),
    PlainSerializer(_to_json, when_used="json"),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"enum": [INFINITY, f"-{INFINITY}"]}]}),
)
Finite = Annotated[float, Strict()]
NotNegative = Annotated[Finite, Field(ge=0)]
Unlimited = Annotated[float, Strict(), Field(allow_inf_nan=True), AfterValidator(_check_number), *_Infinite]
UnlimitedNotNegative = Annotated[Unlimited, Field(ge=0)]
Vector = tuple[Finite, Finite]
Word = Annotated[int, Strict(), Field(ge=0, lt=2**64)]
Bits = Annotated[int, Strict(), Field(ge=0, lt=2**32)]
Flag = Annotated[bool, Strict()]
BodyIndex = Annotated[int, Strict(), Field(ge=0)] | None
"""Of a body in `bodies`; None: the Space's own static body."""


# Pymunk's defaults, which it computes from numbers in single precision: 0.1, and 0.9**60.
_SLOP: Final = 0.10000000149011612
_BIAS: Final = 0.0017970074436457143


class BodyType(StrEnum):
    """How a body moves."""

    DYNAMIC = "dynamic"
    KINEMATIC = "kinematic"
    STATIC = "static"


BODY_TYPES: Final = {getattr(pymunk.Body, kind.name): kind for kind in BodyType}


class Part(Model):
    """A part of the description. Keys with their defaults are not written."""

    @model_serializer(mode="wrap")
    def _without_defaults(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        defaults = {name: field.default for name, field in type(self).model_fields.items()}
        # The text distinguishes -0.0 from 0.0.
        changed = {
            name: value for name, value in write(self).items() if repr(getattr(self, name)) != repr(defaults[name])
        }
        return {name: changed[name] for name in ("kind", *changed) if name in changed}


class Settings(Part):
    """The settings of a Space."""

    gravity: Vector = (0.0, 0.0)
    """px/s²."""
    damping: NotNegative = 1.0
    """The part of its velocity that a body keeps in a second."""
    iterations: Annotated[int, Strict(), Field(ge=1, lt=2**31)] = 10
    """Of the solver in each step."""
    collision_slop: Finite = _SLOP
    """The overlap that is left alone, px."""
    collision_bias: Finite = _BIAS
    """The part of an overlap that is left after a second."""
    collision_persistence: Bits = 3
    """For how many steps impulses of contacts are cached."""
    idle_speed_threshold: Finite = 0.0
    """The speed below which a body is idle, px/s; 0: found from gravity."""
    sleep_time_threshold: Unlimited = math.inf
    """How long bodies must be idle to fall asleep, s."""
    threaded: Flag = False
    """Whether the Space was built with threaded=True."""
    threads: Annotated[int, Strict(), Field(ge=1, lt=2**31)] = 1
    """Of a threaded Space."""


class Body(Part):
    """A body."""

    body_type: BodyType
    """dynamic, kinematic or static."""
    mass: UnlimitedNotNegative = math.inf
    """kg; infinite unless it is dynamic."""
    moment: UnlimitedNotNegative = math.inf
    """The moment of inertia, kg px²."""
    position: Vector = (0.0, 0.0)
    """px."""
    angle: Finite = 0.0
    """rad."""
    center_of_gravity: Vector = (0.0, 0.0)
    """In the coordinates of the body, px."""
    center: Vector | None = None
    """Where the centre of gravity is in the Space, px: the position follows from it, to the last bit. Without it, it is
    where position, angle and center_of_gravity say."""
    velocity: Vector = (0.0, 0.0)
    """Of the centre of gravity, px/s."""
    angular_velocity: Finite = 0.0
    """rad/s."""
    force: Vector = (0.0, 0.0)
    """On the centre of gravity in the next step, kg px/s²."""
    torque: Finite = 0.0
    """In the next step, kg px²/s²."""
    in_space: Flag = True
    """Whether it was added to the Space. If not, joints use it, but it does not move."""


class Filter(Part):
    """Which shapes a shape collides with."""

    group: Word = 0
    """Shapes of one group do not collide; 0: no group."""
    categories: Bits = pymunk.ShapeFilter.ALL_CATEGORIES()
    """A bit for each category that the shape belongs to."""
    mask: Bits = pymunk.ShapeFilter.ALL_MASKS()
    """A bit for each category that it collides with."""


class Shape(Part):
    """What all kinds of shapes have."""

    body: BodyIndex = None
    """The index of its body in bodies; null: the Space's own static body."""
    mass: NotNegative = 0.0
    """kg, from which Pymunk computes that of the body; 0: the body has a mass of its own."""
    elasticity: NotNegative = 0.0
    """A factor: that of a contact is the product of both shapes' elasticities."""
    friction: UnlimitedNotNegative = 0.0
    """A factor: that of a contact is the product of both shapes' frictions."""
    surface_velocity: Vector = (0.0, 0.0)
    """px/s."""
    collision_type: Word = 0
    """Of collision handlers."""
    sensor: Flag = False
    """Whether it only reports collisions."""
    filter: Filter = Filter()
    """Which shapes it collides with."""
    color: tuple[float, float, float, float] | None = None
    """Red, green, blue and opacity in pictures, 0 to 255; null: Pymunk's own."""


class Circle(Shape):
    """A circle."""

    kind: Literal["Circle"]
    radius: NotNegative
    """px."""
    offset: Vector = (0.0, 0.0)
    """Of its middle, in the coordinates of the body, px."""


class Segment(Shape):
    """A segment with round ends."""

    kind: Literal["Segment"]
    a: Vector
    """One end, in the coordinates of the body, px."""
    b: Vector
    """The other end, px."""
    radius: NotNegative = 0.0
    """Half its thickness, px."""
    neighbors: tuple[Vector, Vector] | None = None
    """The far ends of the segments before and after it, as in `set_neighbors`, px."""
    moved: Flag = False
    """Whether its ends were set by `unsafe_set_endpoints`, after which its normal points to its other side."""


class Poly(Shape):
    """A convex polygon."""

    kind: Literal["Poly"]
    vertices: Annotated[tuple[Vector, ...], Field(min_length=1)]
    """Its corners as `get_vertices` returns them, in the coordinates of the body, px."""
    radius: NotNegative = 0.0
    """Of its corners, px."""


class Constraint(Part):
    """What all constraints have."""

    a: BodyIndex = None
    """The index of its first body in bodies; null: the Space's own static body."""
    b: BodyIndex = None
    """The index of its second body; null: the Space's own static body."""
    max_force: UnlimitedNotNegative = math.inf
    """The largest force, kg px/s²."""
    error_bias: NotNegative = _BIAS
    """The part of an error that is left after a second."""
    max_bias: UnlimitedNotNegative = math.inf
    """The largest speed with which errors are corrected, px/s or rad/s."""
    collide_bodies: Flag = True
    """Whether its bodies collide with each other."""

    measured: ClassVar[tuple[str, ...]] = ()  # what Pymunk measures when it is built, and has no argument for


class Anchored(Constraint):
    """A constraint between two anchors, in the coordinates of its bodies."""

    anchor_a: Vector
    """px."""
    anchor_b: Vector
    """px."""


class PinJoint(Anchored):
    """Two anchors at a fixed distance."""

    kind: Literal["PinJoint"]
    distance: Finite
    """px."""

    measured: ClassVar = ("distance",)


class SlideJoint(Anchored):
    """Two anchors whose distance has limits."""

    kind: Literal["SlideJoint"]
    min: Unlimited
    """px."""
    max: Unlimited
    """px."""


class PivotJoint(Anchored):
    """Two anchors at one point."""

    kind: Literal["PivotJoint"]


class GrooveJoint(Constraint):
    """An anchor of body b in a groove of body a."""

    kind: Literal["GrooveJoint"]
    groove_a: Vector
    """One end, px."""
    groove_b: Vector
    """The other end, px."""
    anchor_b: Vector
    """px."""


class DampedSpring(Anchored):
    """A spring between two anchors."""

    kind: Literal["DampedSpring"]
    rest_length: Finite
    """px."""
    stiffness: Finite
    """kg/s²."""
    damping: Finite
    """kg/s."""


class DampedRotarySpring(Constraint):
    """A spring between two angles."""

    kind: Literal["DampedRotarySpring"]
    rest_angle: Finite
    """rad."""
    stiffness: Finite
    """kg px²/s² per rad."""
    damping: Finite
    """kg px²/s per rad."""


class RotaryLimitJoint(Constraint):
    """Two angles whose difference has limits."""

    kind: Literal["RotaryLimitJoint"]
    min: Unlimited
    """rad."""
    max: Unlimited
    """rad."""


class RatchetJoint(Constraint):
    """A joint that turns one way."""

    kind: Literal["RatchetJoint"]
    phase: Finite
    """rad."""
    ratchet: Finite
    """The angle between two clicks, rad."""
    angle: Finite
    """At the last click, rad."""

    measured: ClassVar = ("angle",)


class GearJoint(Constraint):
    """Two angles at a fixed ratio."""

    kind: Literal["GearJoint"]
    phase: Finite
    """rad."""
    ratio: Finite


class SimpleMotor(Constraint):
    """A fixed difference of angular velocities."""

    kind: Literal["SimpleMotor"]
    rate: Finite
    """rad/s."""


AnyShape = Circle | Segment | Poly
AnyConstraint = (
    PinJoint
    | SlideJoint
    | PivotJoint
    | GrooveJoint
    | DampedSpring
    | DampedRotarySpring
    | RotaryLimitJoint
    | RatchetJoint
    | GearJoint
    | SimpleMotor
)
_CONSTRAINTS: Final[Mapping[type[pymunk.Constraint], type[Constraint]]] = {
    getattr(pymunk, model.__name__): model for model in get_args(AnyConstraint)
}


class Parts(Part):
    """Parts of a Space that is described elsewhere; its indices of bodies are numbers that they have there."""

    bodies: tuple[Body, ...] = ()
    shapes: tuple[Annotated[AnyShape, Field(discriminator="kind")], ...] = ()
    constraints: tuple[Annotated[AnyConstraint, Field(discriminator="kind")], ...] = ()


class SpaceDescription(Part):
    """A Space: its settings, bodies, shapes and constraints, in the order in which they were added."""

    format: Literal["pymunk-sandbox space"]
    """What kind of file it is."""
    version: Literal[1]
    """Of the format."""
    pymunk: str
    """The version of Pymunk that it was written with."""
    settings: Settings = Settings()
    current_time_step: NotNegative = 0.0
    """The length of the last step, s; 0: there was none."""
    static_body: Body = Body(body_type=BodyType.STATIC)
    """The Space's own static body."""
    bodies: tuple[Body, ...] = ()
    """All others; those that were not added to the Space, but have a shape or a joint in it, are last."""
    shapes: tuple[Annotated[AnyShape, Field(discriminator="kind")], ...] = ()
    constraints: tuple[Annotated[AnyConstraint, Field(discriminator="kind")], ...] = ()
    sleeping: tuple[Annotated[tuple[Annotated[int, Strict(), Field(ge=0)], ...], Field(min_length=1)], ...] = ()
    """The groups of bodies that sleep, and wake up together: their indices, in the order in which they wake up."""
    callables: tuple[str, ...] = ()
    """The functions of the program that it calls, by place and name; they are not stored."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        problems = [*self._wrong_masses(), *self._wrong_indices(), *self._wrong_sleepers()]
        for index, shape in enumerate(self.shapes):
            if isinstance(shape, Poly) and not _is_convex(shape.vertices):
                what = "must be the corners of a convex polygon in the order in which Poly.get_vertices returns them"
                problems.append((("shapes", index, "vertices"), what))
        if problems:
            raise invalid(*problems)
        return self

    @property
    def in_reverse(self) -> Self:
        """The same Space, of which bodies, shapes and constraints were added in reverse order."""
        indices = [*reversed(range(len(self.bodies)))]

        def moved(part: Part, *ends: str) -> Part:
            values = {end: getattr(part, end) for end in ends}
            return part.model_copy(
                update={end: None if index is None else indices[index] for end, index in values.items()}
            )

        return self.model_copy(
            update={
                "bodies": self.bodies[::-1],
                "shapes": tuple(moved(shape, "body") for shape in reversed(self.shapes)),
                "constraints": tuple(moved(joint, "a", "b") for joint in reversed(self.constraints)),
                "sleeping": tuple(tuple(indices[body] for body in group) for group in self.sleeping),
            }
        )

    def _wrong_masses(self) -> Iterator[Problem]:
        """Yield masses at which Chipmunk ends the process, and those with which Pymunk does no step."""
        if self.static_body.body_type is not BodyType.STATIC:
            yield ("static_body", "body_type"), "must be 'static'"
        of_path: dict[KeyPath, Body] = {("bodies", index): body for index, body in enumerate(self.bodies)}
        for path, body in (of_path | {("static_body",): self.static_body}).items():
            if (body.body_type is BodyType.DYNAMIC) == math.isinf(body.mass):
                kind = "finite: its body is" if math.isinf(body.mass) else f'"{INFINITY}", unless its body is'
                yield (*path, "mass"), f"must be {kind} dynamic, got {shown(body.mass)}"
            if body.body_type is BodyType.DYNAMIC and body.in_space:
                for name, value in (("mass", body.mass), ("moment", body.moment)):
                    if value == 0:
                        yield (*path, name), "must be greater than 0: Pymunk does no step with such a body"

    def _wrong_indices(self) -> Iterator[Problem]:
        users: list[tuple[KeyPath, int | None]]
        users = [(("shapes", index, "body"), shape.body) for index, shape in enumerate(self.shapes)]
        for index, joint in enumerate(self.constraints):
            users += (("constraints", index, "a"), joint.a), (("constraints", index, "b"), joint.b)
        for path, body in users:
            if body is not None and body >= len(self.bodies):
                yield path, f"must be the index of a body, of which there are {len(self.bodies)}, got {body}"
                return
        types = [body.body_type for body in self.bodies]
        for index, joint in enumerate(self.constraints):
            if joint.a == joint.b:
                yield ("constraints", index), "must have two different bodies"
            elif BodyType.DYNAMIC not in [types[body] for body in (joint.a, joint.b) if body is not None]:
                yield ("constraints", index), "must have a dynamic body"

    def _wrong_sleepers(self) -> Iterator[Problem]:
        seen: set[int] = set()
        for index, group in enumerate(self.sleeping):
            for place, body in enumerate(group):
                in_space = body < len(self.bodies) and self.bodies[body].in_space
                if body in seen or not in_space or self.bodies[body].body_type is not BodyType.DYNAMIC:
                    yield ("sleeping", index, place), f"must be the index of a dynamic body, each once, got {body}"
                seen.add(body)


@np.errstate(over="ignore", invalid="ignore")
def _is_convex(corners: Sequence[Vector]) -> bool:
    """Return whether a polygon never turns to the right, but for rounding errors."""
    sides = np.roll(corners, -1, axis=0) - np.array(corners)
    lengths = np.hypot(*sides.T)
    turns = sides[:, 0] * np.roll(sides[:, 1], -1) - sides[:, 1] * np.roll(sides[:, 0], -1)
    return bool((turns >= -1e-9 * lengths * np.roll(lengths, -1)).all())


@dataclass(frozen=True)
class Rebuilt:
    """A Space that was rebuilt, and its contents in the order of the description."""

    space: pymunk.Space
    bodies: list[pymunk.Body]
    shapes: list[pymunk.Shape]
    constraints: list[pymunk.Constraint]


def bodies_of(space: pymunk.Space) -> list[pymunk.Body]:
    """Return the bodies of a Space in the order of its description: those added to it, then those it only uses."""
    used = [shape.body for shape in shapes_of(space)] + [
        body for joint in space.constraints for body in (joint.a, joint.b)
    ]
    bodies = dict.fromkeys([*space.bodies, *used])
    return [body for body in bodies if body not in (None, space._static_body)]


def describe(space: pymunk.Space) -> SpaceDescription:
    """Describe a Space, between two steps. Raises SandboxError if a number in it is not finite."""
    bodies = bodies_of(space)
    index_of: dict[pymunk.Body, int | None] = {body: index for index, body in enumerate(bodies)}
    static_body = space._static_body  # `Space.static_body` would make one
    if static_body is not None:
        index_of[static_body] = None
    rows = SpaceMemory(space).snapshot().bodies
    centers = {int(row["id"]): tuple(row["position"].tolist()) for row in rows}
    groups: dict[int, list[int | None]] = {}
    by_id = {body.id: index for body, index in index_of.items()}
    for row in rows[rows["asleep"] != 0]:
        groups.setdefault(int(row["asleep"]), []).append(by_id[int(row["id"])])
    return SpaceDescription(
        format="pymunk-sandbox space",
        version=1,
        pymunk=pymunk.version,
        settings=_values(space, Settings),
        current_time_step=space.current_time_step,
        static_body={"body_type": BodyType.STATIC} if static_body is None else describe_body(static_body, centers),
        bodies=[describe_body(body, centers) for body in bodies],
        shapes=[describe_shape(shape, index_of) for shape in shapes_of(space)],
        constraints=[describe_constraint(joint, index_of) for joint in space.constraints],
        sleeping=list(groups.values()),
        callables=list(_callables(space, index_of)),
    )


def rebuild(description: SpaceDescription, *, at_rest: bool = False) -> Rebuilt:
    """Build a Space from its description. Its bodies, shapes and constraints are added in the same order.

    at_rest: whether bodies get their velocities after their shapes are added, not before. Pymunk's index of shapes
    looks ahead in the direction of a velocity, and contacts are solved in the order in which it finds them.
    """
    settings = description.settings
    space = pymunk.Space(threaded=settings.threaded)
    for name, value in settings:
        if name not in ("threaded", "sleep_time_threshold"):
            setattr(space, name, value)
    bodies = [build_body(body, at_rest=at_rest) for body in description.bodies]
    place(space.static_body, description.static_body)
    of_index: dict[int | None, pymunk.Body] = {**dict(enumerate(bodies)), None: space.static_body}
    shapes = [build_shape(shape, of_index[shape.body]) for shape in description.shapes]
    constraints = [build_constraint(joint, of_index[joint.a], of_index[joint.b]) for joint in description.constraints]
    carriers = {shape.body for shape in shapes}
    guests = [
        body
        for body, described in zip(bodies, description.bodies, strict=True)
        if not described.in_space and body in carriers
    ]
    space.add(*(body for body, described in zip(bodies, description.bodies, strict=True) if described.in_space))
    space.add(*guests, *shapes, *constraints)
    space.remove(*guests)
    for body, described in zip(bodies, description.bodies, strict=True):
        set_mass(body, described)  # adding shapes with masses has set it
        place(body, described)
    space.sleep_time_threshold = 0.0  # Chipmunk lets bodies sleep only if this is finite
    for first, *others in description.sleeping:
        bodies[first].sleep()
        for index in reversed(others):  # each is inserted after the first
            bodies[index].sleep_with_group(bodies[first])
    space.sleep_time_threshold = settings.sleep_time_threshold
    lib.cpSpaceSetCurrentTimeStep(space._space, description.current_time_step)
    return Rebuilt(space, bodies, shapes, constraints)


def shapes_of(space: pymunk.Space) -> list[pymunk.Shape]:
    """Return the shapes of a Space that have a body."""
    return [shape for shape in space.shapes if shape.body is not None]


def _plain(value: Any) -> Any:
    """Return a vector as a tuple, anything else as it is."""
    return tuple(value) if isinstance(value, pymunk.Vec2d) else value


def _values(source: object, model: type[Model], *without: str) -> dict[str, Any]:
    """Return the attributes of an object of Pymunk that a model has, except some."""
    return {name: _plain(getattr(source, name)) for name in model.model_fields if name not in without}


def describe_body(body: pymunk.Body, centers: Mapping[int, tuple[float, float]]) -> dict[str, Any]:
    """Return the values of a Body. centers: of gravity of bodies by their ids, px."""
    values = _values(body, Body, "body_type", "center", "in_space")
    center = centers.get(body.id)
    return values | {
        "body_type": BODY_TYPES[body.body_type],
        "center": None if center == values["position"] and not any(values["center_of_gravity"]) else center,
        "in_space": body.space is not None,
    }


def build_body(described: Body, *, at_rest: bool = False) -> pymunk.Body:
    """Build a body, without its velocity if it is to be at rest."""
    body_type = next(key for key, kind in BODY_TYPES.items() if kind is described.body_type)
    body = pymunk.Body(described.mass, described.moment, body_type)
    set_mass(body, described)
    place(body, described)
    if at_rest:
        body.velocity, body.angular_velocity = (0, 0), 0
    return body


def set_mass(body: pymunk.Body, described: Body) -> None:
    """Set mass and moment, which shapes with masses may have changed."""
    if described.body_type is BodyType.DYNAMIC:
        lib.cpBodySetMass(body._body, described.mass)
    if body.moment != described.moment:
        lib.cpBodySetMoment(body._body, described.moment)


def place(body: pymunk.Body, described: Body) -> None:
    """Set the motion of a body.

    Pymunk computes the place of the centre of gravity from the position and, in a step, the position from the centre
    of gravity, each with rounding errors: so that neither is rounded again, the centre is set as the position of a
    body whose centre of gravity is its origin, and setting the angle computes the position from it.
    """
    body.angle = described.angle
    body.center_of_gravity = (0, 0) if described.center else described.center_of_gravity
    body.position = described.center or described.position
    body.center_of_gravity = described.center_of_gravity
    if body.position != described.position:  # else they were set in this order, and the position is not updated yet
        body.angle = described.angle
    body.velocity, body.angular_velocity = described.velocity, described.angular_velocity
    body.force, body.torque = described.force, described.torque


def describe_shape(shape: pymunk.Shape, index_of: Mapping[pymunk.Body, int | None]) -> dict[str, Any]:
    """Return the values of a Circle, Segment or Poly."""
    assert shape.body is not None
    values = _values(shape, Shape, "body", "filter", "color")
    values |= {"body": index_of[shape.body], "filter": shape.filter._asdict(), "color": _color(shape)}
    if isinstance(shape, pymunk.Circle):
        return values | {"kind": "Circle", "radius": shape.radius, "offset": _plain(shape.offset)}
    if isinstance(shape, pymunk.Segment):
        a, b, radius = _plain(shape.a), _plain(shape.b), shape.radius
        moved = pymunk.Segment(None, a, b, radius).normal != shape.normal
        values |= {"kind": "Segment", "a": a, "b": b, "radius": radius}
        return values | {"neighbors": _neighbors(shape), "moved": moved}
    assert isinstance(shape, pymunk.Poly)
    return values | {"kind": "Poly", "vertices": list(map(_plain, shape.get_vertices())), "radius": shape.radius}


def build_shape(described: AnyShape, body: pymunk.Body) -> pymunk.Shape:
    """Build a shape, and attach it to its body."""
    shape: pymunk.Shape
    match described:
        case Circle():
            shape = pymunk.Circle(body, described.radius, described.offset)
        case Segment(a=a, b=b):
            shape = pymunk.Segment(body, a, b, described.radius)
            if described.moved:
                shape.unsafe_set_endpoints(a, b)
        case Poly():  # whose corners the constructor may order anew; `change_shape` sets them as they are described
            shape = pymunk.Poly(body, described.vertices, radius=described.radius)
    if described.color:
        shape.color = described.color
    change_shape(shape, described)
    return shape


def change_shape(shape: pymunk.Shape, described: AnyShape) -> None:
    """Let a shape become what is described, of the same kind, where it differs: setting a value wakes the body."""
    if isinstance(shape, pymunk.Circle) and isinstance(described, Circle):
        shape.unsafe_set_offset(described.offset)
    elif isinstance(shape, pymunk.Segment) and isinstance(described, Segment):
        if (shape.a, shape.b) != (described.a, described.b):
            shape.unsafe_set_endpoints(described.a, described.b)
        if described.neighbors:
            shape.set_neighbors(*described.neighbors)
    elif isinstance(shape, pymunk.Poly) and isinstance(described, Poly):
        shape.unsafe_set_vertices(described.vertices)
    if shape.radius != described.radius:
        shape.unsafe_set_radius(described.radius)
    for name in ("mass", "elasticity", "friction", "surface_velocity", "collision_type", "sensor"):
        if getattr(shape, name) != getattr(described, name):
            setattr(shape, name, getattr(described, name))
    shape_filter = pymunk.ShapeFilter(**dict(described.filter))
    if shape.filter != shape_filter:
        shape.filter = shape_filter


def _color(shape: pymunk.Shape) -> tuple[float, ...] | None:
    """Return the colour that a program gave a shape for Pymunk's pictures, if it is of four numbers."""
    color = vars(shape).get("color")
    try:
        channels = tuple(map(float, color))  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return None
    return channels if len(channels) == 4 else None


_SEGMENT_ENDS, _SEGMENT_TANGENTS = slice(24, 28), slice(37, 41)  # of the words of Chipmunk's cpSegmentShape


def _neighbors(segment: pymunk.Segment) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the neighbours of a segment, which Pymunk has no function for; None if it has none."""
    memory = ffi.buffer(ffi.cast("char *", segment._shape), 8 * _SEGMENT_TANGENTS.stop)
    numbers = np.frombuffer(memory, np.float64)
    ends = numbers[_SEGMENT_ENDS].tolist()
    if ends != [*segment.a, *segment.b]:
        raise SandboxError(f"Pymunk {pymunk.version} lays out its memory in a way that this version does not know")
    tangents = numbers[_SEGMENT_TANGENTS].tolist()
    if not any(tangents):
        return None
    x1, y1, x2, y2 = (end + tangent for end, tangent in zip(ends, tangents, strict=True))
    return (x1, y1), (x2, y2)


def describe_constraint(joint: pymunk.Constraint, index_of: Mapping[pymunk.Body, int | None]) -> dict[str, Any]:
    """Return the values of one of AnyConstraint."""
    model = next(model for kind, model in _CONSTRAINTS.items() if isinstance(joint, kind))
    values = _values(joint, model, "a", "b", "kind", "collide_bodies")
    ends = {"a": index_of[joint.a], "b": index_of[joint.b], "collide_bodies": bool(joint.collide_bodies)}
    return {"kind": model.__name__} | ends | values


def build_constraint(described: AnyConstraint, a: pymunk.Body, b: pymunk.Body) -> pymunk.Constraint:
    """Build a constraint between two bodies."""
    not_arguments = {*Constraint.model_fields, *described.measured, "kind"}
    arguments = [value for name, value in described if name not in not_arguments]
    joint: pymunk.Constraint = getattr(pymunk, described.kind)(a, b, *arguments)
    for name in ("max_force", "error_bias", "max_bias", "collide_bodies", *described.measured):
        setattr(joint, name, getattr(described, name))
    return joint


def _callables(space: pymunk.Space, index_of: Mapping[pymunk.Body, int | None]) -> Iterator[str]:
    """Yield the functions of the program that a Space calls, by place and name."""
    for body, index in index_of.items():
        for name, function in (("velocity_func", body._velocity_func), ("position_func", body._position_func)):
            if function is not None:
                yield f"{'static_body' if index is None else f'bodies[{index}]'}.{name}: {_name(function)}"
    laws = {"force_func": pymunk.DampedSpring.spring_force, "torque_func": pymunk.DampedRotarySpring.spring_torque}
    for index, joint in enumerate(space.constraints):
        for name in ("pre_solve", "post_solve", "force_func", "torque_func"):
            function = getattr(joint, f"_{name}" if name in laws else name, None)
            if function not in (None, laws.get(name)):
                yield f"constraints[{index}].{name}: {_name(function)}"
    for types, handler in space._handlers.items():  # Pymunk has no public list of them
        for name in ("begin", "pre_solve", "post_solve", "separate"):
            if function := getattr(handler, name):
                yield f"on_collision{types}.{name}: {_name(function)}"


def _name(function: Callable[..., Any]) -> str:
    """Return the name of a function, and where it is defined."""
    name = getattr(function, "__qualname__", type(function).__qualname__)
    code = getattr(function, "__code__", None)
    return f"{name} ({Path(code.co_filename).name}:{code.co_firstlineno})" if code else name
