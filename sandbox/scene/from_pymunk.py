"""A scene from a live `pymunk.Space`: circles on dynamic bodies, walls on static ones, and the Space's settings."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from enum import Enum
from functools import cache
from itertools import combinations_with_replacement, pairwise
from typing import Final, NamedTuple
from warnings import warn

import numpy as np
import pymunk
from pymunk.batch import ArbiterFields, Buffer, get_space_arbiters

from sandbox.errors import SandboxError, SpaceWarning
from sandbox.scene.fields import Vector
from sandbox.scene.files import ball_groups
from sandbox.scene.model import SPACE_SETTINGS, Arena, PymunkSettings, Scene, Wall
from sandbox.scene.overlaps import needed_overlap
from sandbox.state import Bodies, Floats, State

MIN_WALL_LENGTH: Final = 1e-6  # px, as a scene requires
MAX_MOMENT_ERROR: Final = 1e-9  # of m r²/2, which is rounding
MAX_LISTED: Final = 5  # moments in a warning


class Unsupported(Enum):
    """Things that a Space may have and a scene cannot: the name in messages, and the plural."""

    DYNAMIC_POLYGON = "dynamic polygon", "dynamic polygons"
    DYNAMIC_SEGMENT = "dynamic segment", "dynamic segments"
    STATIC_CIRCLE = "static circle", "static circles"
    SENSOR = "sensor", "sensors"
    KINEMATIC = "shape on a kinematic body", "shapes on kinematic bodies"
    SEVERAL_SHAPES = "dynamic body with several shapes", "dynamic bodies with several shapes"
    NO_SHAPE = "dynamic body without a shape", "dynamic bodies without a shape"
    OFF_CENTRE = "circle off its body's centre of gravity", "circles off their bodies' centres of gravity"
    ELASTICITY = "shape with an elasticity outside 0 to 1", "shapes with an elasticity outside 0 to 1"
    POINT = "segment without length", "segments without length"
    INFINITE_MOMENT = "infinite moment of a circle with friction", "infinite moments of circles with friction"
    FORCE = "body with a force or torque", "bodies with a force or torque"
    ASLEEP = "sleeping body", "sleeping bodies"
    VELOCITY_FUNCTION = "custom velocity function", "custom velocity functions"
    POSITION_FUNCTION = "custom position function", "custom position functions"
    SURFACE_VELOCITY = "surface velocity", "surface velocities"
    FILTER = "shape with a filter that ignores others", "shapes with filters that ignore others"
    HANDLER = "collision handler", "collision handlers"
    SLEEPING = "sleep_time_threshold", "sleep_time_thresholds"
    DAMPING = "damping outside 0 to 1", "dampings outside 0 to 1"
    THREADS = "solver with threads", "solvers with threads"


class WallOnBody(NamedTuple):
    """A straight wall of a Space, and the static body that carries it; the sides of a polygon are joined.

    start, to: px, in the coordinates of the Space.
    """

    body: pymunk.Body
    start: Vector
    to: Vector
    thickness: float
    elasticity: float
    friction: float
    joined: bool


class SpaceContents(NamedTuple):
    """The contents of a Space, without the motion of its circles; equal if a scene of it is.

    circles: the balls, in the order of their shapes; masses: and moments; kinds: radius, elasticity and friction;
    settings: those that are not Pymunk's defaults; left_out: what a scene cannot have, by its name, singular and
    plural.
    """

    circles: tuple[pymunk.Circle, ...]
    masses: tuple[tuple[float, float], ...]
    kinds: tuple[tuple[float, float, float], ...]
    walls: tuple[WallOnBody, ...]
    gravity: Vector
    settings: dict[str, float]
    left_out: dict[tuple[str, str], int]

    @property
    def bodies(self) -> Bodies:
        """The balls' constants."""
        radius, elasticity, friction = np.array(self.kinds, float).reshape(-1, 3).T
        return Bodies(radius, np.array(self.masses, float).reshape(-1, 2)[:, 0], elasticity, friction)


def from_space(
    space: pymunk.Space,
    *,
    size: Vector | None = None,
    rate: int = 60,
    title: str = "",
    skip: bool = False,
) -> Scene:
    """Return a scene of what a Space has now, without walls round the arena.

    Circles on dynamic bodies become balls, in the order of their shapes; segments and the outlines of polygons on
    static bodies become walls. size: width and height of the view, px, by default up to the furthest ball or wall;
    rate: steps per second.
    Raises SandboxError, which lists all that a scene cannot have; with skip, leaves that out, and warns. Also warns
    (SpaceWarning) of moments of inertia that are not those of uniform discs, and of contacts that have begun.
    """
    contents = contents_of(space)
    if not skip:
        refuse_unsupported(contents, "; skip=True leaves that out")
    scene = scene_of(contents, motion_of(contents.circles), size=size, rate=rate, title=title)
    if contents.left_out:
        warn(f"left out of the scene: {listed(contents.left_out)}", SpaceWarning, stacklevel=2)
    for warning in _warnings(space, contents):
        warn(warning, SpaceWarning, stacklevel=2)
    return scene


def refuse_unsupported(contents: SpaceContents, advice: str = "") -> None:
    """Raise SandboxError if a Space has what a scene cannot have. advice: on that, the end of the message."""
    if contents.left_out:
        raise SandboxError(f"the Space has {listed(contents.left_out)}, which a scene cannot have{advice}")


def scene_of(contents: SpaceContents, motion: State, *, size: Vector | None, rate: int, title: str) -> Scene:
    """Return a scene of what a Space has, as `from_space` does, with its circles in motion."""
    walls = [{key: getattr(wall, key) for key in Wall.model_fields} for wall in contents.walls]
    scene = Scene(
        title=title,
        rate=rate,
        gravity=contents.gravity,
        arena=Arena(size=size or _view(contents, motion.position), walls=False),
        balls=list(ball_groups(contents.bodies, motion)),
        walls=walls,
        pymunk=PymunkSettings(**contents.settings),
    )
    overlap = needed_overlap(scene, motion.position)
    return scene.changed(arena=scene.arena.model_copy(update={"overlap": overlap})) if overlap else scene


def contents_of(space: pymunk.Space) -> SpaceContents:
    """Read what a Space has. Raises SandboxError if it is not a Space."""
    if not isinstance(space, pymunk.Space):
        raise SandboxError(f"space must be a pymunk.Space, got {type(space).__name__}")
    of_body: dict[pymunk.Body, list[pymunk.Shape]] = defaultdict(list)  # solid ones
    for shape in space.shapes:
        if not shape.sensor:
            of_body[_body(shape)].append(shape)
    left_out = Counter(kind.value for kind in _unsupported_in(space, of_body))
    left_out.update((name := type(joint).__name__, f"{name}s") for joint in space.constraints)
    circles: list[pymunk.Circle] = []
    walls: list[WallOnBody] = []
    for shape in space.shapes:
        kind = _unsupported_shape(shape)
        if kind:
            left_out[kind.value] += 1
        elif not isinstance(shape, pymunk.Circle):
            walls += _walls_of(shape)
        elif len(of_body[_body(shape)]) == 1:
            circles.append(shape)
    return SpaceContents(
        tuple(circles),
        tuple((_body(circle).mass, _body(circle).moment) for circle in circles),
        tuple((circle.radius, circle.elasticity, circle.friction) for circle in circles),
        tuple(walls),
        (space.gravity.x, space.gravity.y),
        _settings_of(space),
        dict(left_out),
    )


def _settings_of(space: pymunk.Space) -> dict[str, float]:
    """Return the settings that a scene can have and that are not Pymunk's defaults."""
    settings = {key: getattr(space, key) for key in SPACE_SETTINGS if getattr(space, key) != getattr(_new_space(), key)}
    if _odd(space.damping):
        del settings["damping"]
    first = next(iter(space.shapes), None)
    if first and not isinstance(first, pymunk.Circle):
        settings["walls_first"] = 1
    return settings


@cache
def _new_space() -> pymunk.Space:
    """Return a Space with Pymunk's default settings."""
    return pymunk.Space()


def motion_of(circles: Iterable[pymunk.Circle]) -> State:
    """Return where circles are and how they move: (n, 2) px, px/s; (n,) rad, rad/s."""
    bodies = [_body(circle) for circle in circles]

    def pairs(key: str) -> Floats:
        return np.array([getattr(body, key) for body in bodies], float).reshape(-1, 2)

    angle, spin = (np.array([getattr(body, key) for body in bodies], float) for key in ("angle", "angular_velocity"))
    return State(0.0, pairs("position"), pairs("velocity"), angle, spin)


def listed(counts: dict[tuple[str, str], int]) -> str:
    """Return numbers of things in words: "2 dynamic polygons, 1 PivotJoint"."""
    return ", ".join(f"{count} {singular if count == 1 else plural}" for (singular, plural), count in counts.items())


def _body(shape: pymunk.Shape) -> pymunk.Body:
    """Return the body of a shape that is in a Space, which therefore has one."""
    assert shape.body is not None
    return shape.body


def _odd(damping: float) -> bool:
    """Return whether a scene cannot have this damping."""
    return not 0 < damping <= 1


def _unsupported_in(space: pymunk.Space, of_body: dict[pymunk.Body, list[pymunk.Shape]]) -> Iterator[Unsupported]:
    """Yield what a scene cannot have, besides shapes of other kinds. of_body: the solid shapes of each body."""
    for body in space.bodies:
        if body.body_type == pymunk.Body.DYNAMIC:
            yield from _unsupported_body(body, of_body.get(body, []))
    for shape in space.shapes:
        if shape.surface_velocity != (0, 0):
            yield Unsupported.SURFACE_VELOCITY
    yield from [Unsupported.FILTER] * _filtered([shape for shapes in of_body.values() for shape in shapes])
    for handler in space._handlers.values():  # Pymunk has no public list of them
        if any((handler.begin, handler.pre_solve, handler.post_solve, handler.separate)):
            yield Unsupported.HANDLER
    if math.isfinite(space.sleep_time_threshold):
        yield Unsupported.SLEEPING
    if _odd(space.damping):
        yield Unsupported.DAMPING
    if space.threads > 1:
        yield Unsupported.THREADS


def _unsupported_body(body: pymunk.Body, solid: Sequence[pymunk.Shape]) -> Iterator[Unsupported]:
    """Yield what a scene cannot have of a dynamic body and its solid shapes."""
    if not solid:
        yield Unsupported.NO_SHAPE
    elif len(solid) > 1:
        yield Unsupported.SEVERAL_SHAPES
    elif isinstance(solid[0], pymunk.Circle) and solid[0].friction and math.isinf(body.moment):
        yield Unsupported.INFINITE_MOMENT
    if body.force != (0, 0) or body.torque:
        yield Unsupported.FORCE
    if body.is_sleeping:
        yield Unsupported.ASLEEP
    if body.velocity_func is not pymunk.Body.update_velocity:
        yield Unsupported.VELOCITY_FUNCTION
    if body.position_func is not pymunk.Body.update_position:
        yield Unsupported.POSITION_FUNCTION


def _unsupported_shape(shape: pymunk.Shape) -> Unsupported | None:
    """Return why a scene cannot have a shape, or None."""
    body = _body(shape)
    circle, segment = isinstance(shape, pymunk.Circle), isinstance(shape, pymunk.Segment)
    moves = body.body_type == pymunk.Body.DYNAMIC
    values = {
        Unsupported.SENSOR: shape.sensor,
        Unsupported.KINEMATIC: body.body_type == pymunk.Body.KINEMATIC,
        Unsupported.DYNAMIC_SEGMENT: moves and segment,
        Unsupported.DYNAMIC_POLYGON: moves and not circle,
        Unsupported.STATIC_CIRCLE: circle and not moves,
        Unsupported.OFF_CENTRE: circle and (shape.center_of_gravity != (0, 0) or body.center_of_gravity != (0, 0)),
        Unsupported.ELASTICITY: not 0 <= shape.elasticity <= 1,
        Unsupported.POINT: isinstance(shape, pymunk.Segment) and math.dist(shape.a, shape.b) < MIN_WALL_LENGTH,
    }
    return next((kind for kind, is_there in values.items() if is_there), None)


def _filtered(shapes: Iterable[pymunk.Shape]) -> int:
    """Return the number of shapes that ignore another, which they could otherwise touch, by their filters."""
    kinds = Counter((shape.filter, _body(shape).body_type == pymunk.Body.DYNAMIC) for shape in shapes)
    ignoring: set[tuple[pymunk.ShapeFilter, bool]] = set()
    for kind, partner in combinations_with_replacement(kinds, 2):
        (a, one_moves), (b, other_moves) = kind, partner
        meet = (one_moves or other_moves) and (kind != partner or kinds[kind] > 1)
        if meet and ((a.group and a.group == b.group) or not a.categories & b.mask or not b.categories & a.mask):
            ignoring |= {kind, partner}
    return sum(kinds[kind] for kind in ignoring)


def _walls_of(shape: pymunk.Shape) -> Iterator[WallOnBody]:
    """Yield a static segment, or the sides of a static polygon."""
    body = _body(shape)
    assert isinstance(shape, pymunk.Segment | pymunk.Poly)
    corners = [shape.a, shape.b] if isinstance(shape, pymunk.Segment) else shape.get_vertices()
    if isinstance(shape, pymunk.Poly):
        corners.append(corners[0])
    surface = shape.elasticity, shape.friction, isinstance(shape, pymunk.Poly)
    for start, to in pairwise(map(body.local_to_world, corners)):
        yield WallOnBody(body, (start.x, start.y), (to.x, to.y), 2 * shape.radius, *surface)


def _view(contents: SpaceContents, position: Floats) -> Vector:
    """Return the width and height of a view from (0, 0) to the furthest ball or wall, in whole px, at least 1.

    What is not finite is left to the checks of a scene.
    """
    ends = [(wall.start, wall.thickness / 2) for wall in contents.walls]
    ends += [(wall.to, wall.thickness / 2) for wall in contents.walls]
    ends += zip(position.tolist(), contents.bodies.radius.tolist(), strict=True)
    reach = [[place[axis] + radius for place, radius in ends] for axis in (0, 1)]
    width, height = (max([1, *map(math.ceil, filter(math.isfinite, each))]) for each in reach)
    return width, height


def other_moments(contents: SpaceContents) -> str:
    """Say which moments of inertia are not those of a scene's balls, where that matters; empty if none are."""
    odd = []
    for number, (circle, (mass, moment)) in enumerate(zip(contents.circles, contents.masses, strict=True)):
        disc, turns = mass * circle.radius**2 / 2, circle.friction or _body(circle).angular_velocity
        if turns and MAX_MOMENT_ERROR * disc < abs(moment - disc) < math.inf:
            odd.append(f"ball {number} {moment:.6g} instead of {disc:.6g}")
    if not odd:
        return ""
    more = f" and {len(odd) - MAX_LISTED} more" if len(odd) > MAX_LISTED else ""
    return f"balls turn as uniform discs, with moments m r²/2; in this Space, {', '.join(odd[:MAX_LISTED])}{more}"


def _warnings(space: pymunk.Space, contents: SpaceContents) -> Iterator[str]:
    """Yield warnings of what makes a scene move otherwise than its Space."""
    if odd := other_moments(contents):
        yield odd
    buffer = Buffer()
    get_space_arbiters(space, ArbiterFields.CONTACT_COUNT, buffer)
    if begun := np.count_nonzero(np.frombuffer(buffer.int_buf(), np.uintp)):
        what, their = ("contact has", "its impulse") if begun == 1 else ("contacts have", "their impulses")
        yield (
            f"{begun} {what} begun, and Pymunk starts from {their} in its next step, which a scene does not have: "
            "call from_space before the first step, or while nothing touches"
        )
