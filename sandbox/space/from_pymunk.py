"""A scene of a live `pymunk.Space`, and the Space of a scene: balls are dynamic bodies, walls and pegs static ones."""

import math
import os
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from enum import Enum
from functools import cache
from itertools import combinations, pairwise
from typing import Final, NamedTuple
from warnings import warn

import numpy as np
import pymunk
from pymunk.batch import ArbiterFields, Buffer, get_space_arbiters

from sandbox.engines.pymunk import PymunkEngine
from sandbox.errors import SandboxError, SpaceWarning
from sandbox.quantity import pass_through
from sandbox.scene.fields import Vector
from sandbox.scene.files import ball_groups, load
from sandbox.scene.model import MIN_LENGTH, SPACE_SETTINGS, Arena, PymunkSettings, Scene
from sandbox.scene.overlaps import needed_overlap
from sandbox.scene.spawn import spawn
from sandbox.space.contents import body_of, checked, is_dynamic
from sandbox.state import Bodies, Floats, State

MAX_MOMENT_ERROR: Final = 1e-9  # of m r²/2, which is rounding
MAX_LISTED: Final = 5  # moments in a warning


class Unsupported(Enum):
    """Things that a Space may have and a scene cannot: the name in messages, and the plural."""

    DYNAMIC_POLYGON = "dynamic polygon", "dynamic polygons"
    DYNAMIC_SEGMENT = "dynamic segment", "dynamic segments"
    KINEMATIC = "shape on a moving kinematic body", "shapes on moving kinematic bodies"
    SEVERAL_SHAPES = "dynamic body with several shapes", "dynamic bodies with several shapes"
    NO_SHAPE = "dynamic body without a shape", "dynamic bodies without a shape"
    OFF_CENTRE = "circle off its body's centre of gravity", "circles off their bodies' centres of gravity"
    ELASTICITY = "shape with an elasticity outside 0 to 1", "shapes with an elasticity outside 0 to 1"
    POINT = "wall without size", "walls without size"
    INFINITE_MOMENT = "infinite moment of a circle with friction", "infinite moments of circles with friction"
    FORCE = "body with a force or torque", "bodies with a force or torque"
    VELOCITY_FUNCTION = "custom velocity function", "custom velocity functions"
    POSITION_FUNCTION = "custom position function", "custom position functions"
    SURFACE_VELOCITY = "surface velocity", "surface velocities"
    FILTER = "shape with a filter between balls and walls", "shapes with filters between balls and walls"
    HANDLER = "collision handler", "collision handlers"
    DAMPING = "damping outside 0 to 1", "dampings outside 0 to 1"
    THREADS = "solver with threads", "solvers with threads"


class WallInSpace(NamedTuple):
    """A wall or peg of a Space; the sides of a polygon are joined.

    start, to: px, in the coordinates of the Space.
    """

    start: Vector
    to: Vector
    thickness: float
    elasticity: float
    friction: float
    joined: bool


class SpaceContents(NamedTuple):
    """The contents of a Space, without the motion of its circles; equal if a scene of it is.

    circles: the balls, in the order of their shapes; masses: and moments; kinds: radius, elasticity and friction;
    filters: group, by a number of its own, categories and mask; settings: those that are not Pymunk's defaults;
    left_out: what a scene cannot have, by its name, singular and plural.
    """

    circles: tuple[pymunk.Circle, ...]
    masses: tuple[tuple[float, float], ...]
    kinds: tuple[tuple[float, float, float], ...]
    filters: tuple[tuple[int, int, int], ...]
    walls: tuple[WallInSpace, ...]
    gravity: Vector
    settings: dict[str, float]
    left_out: dict[tuple[str, str], int]

    @property
    def bodies(self) -> Bodies:
        """The balls' constants."""
        radius, elasticity, friction = np.array(self.kinds, float).reshape(-1, 3).T
        mass, filters = np.array(self.masses, float).reshape(-1, 2)[:, 0], np.array(self.filters, np.int64)
        return Bodies(radius, mass, elasticity, friction, filters.reshape(-1, 3))


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
    static bodies become walls, and circles pegs, which are walls of no length; so do those on kinematic bodies at rest.
    size: width and height of the view, px, by default up to the furthest ball or wall; rate: steps per second.
    Raises SandboxError, which lists all that a scene cannot have; with skip, leaves that out, and warns. Also warns
    (SpaceWarning) of moments of inertia that are not those of uniform discs, of sensors, which touch nothing and are
    left out, and of contacts that have begun.

    >>> space, body = pymunk.Space(), pymunk.Body()
    >>> body.position, space.gravity = (100, 50), (0, 900)
    >>> disc = pymunk.Circle(body, 20)
    >>> disc.mass = 2
    >>> space.add(body, disc, pymunk.Segment(space.static_body, (0, 300), (400, 300), 5))
    >>> scene = from_space(space, size=(400, 320))
    >>> scene.bodies.mass, len(scene.walls), scene.gravity
    (array([2.]), 1, (0.0, 900.0))
    """
    contents = contents_of(space)
    if contents.left_out and not skip:
        what = _counts_in_words(contents.left_out)
        raise SandboxError(f"the Space has {what}, which a scene cannot have; skip=True leaves that out")
    motion = _motion_of(contents.circles)
    scene = Scene(
        title=title,
        rate=rate,
        gravity=contents.gravity,
        arena=Arena(size=size or _view(contents, motion.position), walls=False),
        balls=list(ball_groups(contents.bodies, motion)),
        walls=[wall._asdict() for wall in contents.walls],
        pymunk=PymunkSettings(**contents.settings),
    )
    if overlap := needed_overlap(scene, motion.position):
        scene = scene.changed(arena=scene.arena.model_copy(update={"overlap": overlap}))
    if contents.left_out:
        warn(f"left out of the scene: {_counts_in_words(contents.left_out)}", SpaceWarning, stacklevel=2)
    for warning in _warnings(space, contents, motion.spin):
        warn(warning, SpaceWarning, stacklevel=2)
    return scene


def to_space(scene: Scene | str | os.PathLike[str]) -> pymunk.Space:
    """Return the Space of a scene as the engine `pymunk` builds it: body k is ball k. The rest is your own loop's.

    scene: a Scene, the name of a bundled scene, or a file. A step of the engine is `pymunk.substeps` of the scene calls
    of `space.step(1 / rate / substeps)`.
    Raises SandboxError as `load` does.

    >>> space = to_space("oblique")
    >>> for _ in range(60):
    ...     space.step(1 / 60)
    >>> [round(body.position.x, 1) for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC]
    [287.4, 312.6]
    """
    chosen = scene if isinstance(scene, Scene) else load(scene)
    return PymunkEngine(chosen, spawn(chosen)).space


def contents_of(space: pymunk.Space) -> SpaceContents:
    """Read what a Space has. Raises SandboxError if it is not a Space."""
    solid = [shape for shape in checked(space).shapes if not shape.sensor]  # sensors touch nothing
    of_body: dict[pymunk.Body, list[pymunk.Shape]] = defaultdict(list)
    for shape in solid:
        of_body[body_of(shape)].append(shape)
    left_out = Counter(kind.value for kind in _unsupported_in(space, of_body))
    left_out.update((name := type(joint).__name__, f"{name}s") for joint in space.constraints)
    circles: list[pymunk.Circle] = []
    walls: list[WallInSpace] = []
    groups = {0: 0}
    for shape in solid:
        kind = _unsupported_shape(shape)
        if kind:
            left_out[kind.value] += 1
        elif not (isinstance(shape, pymunk.Circle) and _moves(shape)):
            walls += _walls_of(shape)
        elif len(of_body[body_of(shape)]) == 1:
            circles.append(shape)
    return SpaceContents(
        tuple(circles),
        tuple((body_of(circle).mass, body_of(circle).moment) for circle in circles),
        tuple((circle.radius, circle.elasticity, circle.friction) for circle in circles),
        tuple((groups.setdefault(shape.filter.group, len(groups)), *shape.filter[1:]) for shape in circles),
        tuple(walls),
        (space.gravity.x, space.gravity.y),
        _settings_of(space, solid),
        dict(left_out),
    )


def _settings_of(space: pymunk.Space, solid: Sequence[pymunk.Shape]) -> dict[str, float]:
    """Return the settings that a scene can have and that are not Pymunk's defaults."""
    settings = {key: getattr(space, key) for key in SPACE_SETTINGS if getattr(space, key) != getattr(_new_space(), key)}
    if _odd(space.damping):
        del settings["damping"]
    if solid and not _moves(solid[0]):
        settings["walls_first"] = 1
    return settings


@cache
def _new_space() -> pymunk.Space:
    """Return a Space with Pymunk's default settings."""
    return pymunk.Space()


def _motion_of(circles: Iterable[pymunk.Circle]) -> State:
    """Return where circles are and how they move: (n, 2) px, px/s; (n,) rad, rad/s. What is asleep does not move."""
    bodies = [body_of(circle) for circle in circles]

    def pairs(key: str) -> Floats:
        return np.array([getattr(body, key) for body in bodies], float).reshape(-1, 2)

    angle, spin = (np.array([getattr(body, key) for body in bodies], float) for key in ("angle", "angular_velocity"))
    velocity, asleep = pairs("velocity"), [body.is_sleeping for body in bodies]
    velocity[asleep] = spin[asleep] = 0.0
    return State(0.0, pairs("position"), velocity, angle, spin)


def _counts_in_words(counts: dict[tuple[str, str], int]) -> str:
    """Return numbers of things in words: "2 dynamic polygons, 1 PivotJoint"."""
    return ", ".join(f"{count} {singular if count == 1 else plural}" for (singular, plural), count in counts.items())


def _moves(shape: pymunk.Shape) -> bool:
    return is_dynamic(body_of(shape))


def _rests(body: pymunk.Body) -> bool:
    """Return whether a kinematic body stays where it is, unless its program moves it."""
    functions = body.velocity_func, body.position_func
    is_driven = functions != (pymunk.Body.update_velocity, pymunk.Body.update_position)
    return body.velocity == (0, 0) and body.angular_velocity == 0 and not is_driven


def _odd(damping: float) -> bool:
    """Return whether a scene cannot have this damping."""
    return not 0 < damping <= 1


def _unsupported_in(space: pymunk.Space, of_body: dict[pymunk.Body, list[pymunk.Shape]]) -> Iterator[Unsupported]:
    """Yield what a scene cannot have, besides shapes of other kinds. of_body: the solid shapes of each body."""
    for body in space.bodies:
        if is_dynamic(body):
            yield from _unsupported_body(body, of_body.get(body, []))
    solid = [shape for shapes in of_body.values() for shape in shapes]
    for shape in solid:
        if shape.surface_velocity != (0, 0):
            yield Unsupported.SURFACE_VELOCITY
    yield from [Unsupported.FILTER] * _filtered(solid)
    for handler in space._handlers.values():  # Pymunk has no public list of them
        if any((handler.begin, handler.pre_solve, handler.post_solve, handler.separate)):
            yield Unsupported.HANDLER
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
    if body.velocity_func is not pymunk.Body.update_velocity:
        yield Unsupported.VELOCITY_FUNCTION
    if body.position_func is not pymunk.Body.update_position:
        yield Unsupported.POSITION_FUNCTION


def _unsupported_shape(shape: pymunk.Shape) -> Unsupported | None:
    """Return why a scene cannot have a shape, or None."""
    body = body_of(shape)
    circle, segment = isinstance(shape, pymunk.Circle), isinstance(shape, pymunk.Segment)
    moves = _moves(shape)
    off_centre = circle and (shape.center_of_gravity != (0, 0) or body.center_of_gravity != (0, 0))
    is_short = isinstance(shape, pymunk.Segment) and math.dist(shape.a, shape.b) < MIN_LENGTH
    values = {
        Unsupported.KINEMATIC: body.body_type == pymunk.Body.KINEMATIC and not _rests(body),
        Unsupported.DYNAMIC_SEGMENT: moves and segment,
        Unsupported.DYNAMIC_POLYGON: moves and not circle,
        Unsupported.OFF_CENTRE: off_centre and moves,
        Unsupported.ELASTICITY: not 0 <= shape.elasticity <= 1,
        Unsupported.POINT: (is_short or (circle and not moves)) and not shape.radius,
    }
    return next((kind for kind, is_there in values.items() if is_there), None)


def _filtered(shapes: Iterable[pymunk.Shape]) -> int:
    """Return the number of balls and walls that ignore a wall or a ball by their filters."""
    kinds = Counter((shape.filter, _moves(shape)) for shape in shapes)
    ignoring: set[tuple[pymunk.ShapeFilter, bool]] = set()
    for kind, partner in combinations(kinds, 2):
        (a, one_moves), (b, other_moves) = kind, partner
        if one_moves != other_moves and pass_through(a, b):
            ignoring |= {kind, partner}
    return sum(kinds[kind] for kind in ignoring)


def _walls_of(shape: pymunk.Shape) -> Iterator[WallInSpace]:
    """Yield a static segment or circle, or the sides of a static polygon."""
    body = body_of(shape)
    if isinstance(shape, pymunk.Segment):
        is_short = math.dist(shape.a, shape.b) < MIN_LENGTH
        corners = [shape.a, shape.a if is_short else shape.b]
    elif isinstance(shape, pymunk.Circle):
        corners = [shape.offset, shape.offset]
    else:
        assert isinstance(shape, pymunk.Poly)
        corners = shape.get_vertices()
        corners.append(corners[0])
    surface = shape.elasticity, shape.friction, isinstance(shape, pymunk.Poly)
    for start, to in pairwise(map(body.local_to_world, corners)):
        yield WallInSpace((start.x, start.y), (to.x, to.y), 2 * shape.radius, *surface)


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


def _other_moments(contents: SpaceContents, spin: Floats) -> str:
    """Say which moments of inertia are not those of a scene's balls, where that matters; empty if all are.

    spin: (n,) rad/s, of the circles.
    """
    odd = []
    balls = zip(contents.kinds, contents.masses, spin.tolist(), strict=True)
    for number, ((radius, _, friction), (mass, moment), turning) in enumerate(balls):
        disc, turns = mass * radius**2 / 2, friction or turning
        if turns and MAX_MOMENT_ERROR * disc < abs(moment - disc) < math.inf:
            odd.append(f"ball {number} {moment:.6g} instead of {disc:.6g}")
    if not odd:
        return ""
    more = f" and {len(odd) - MAX_LISTED} more" if len(odd) > MAX_LISTED else ""
    return f"balls turn as uniform discs, with moments m r²/2; in this Space, {', '.join(odd[:MAX_LISTED])}{more}"


def _warnings(space: pymunk.Space, contents: SpaceContents, spin: Floats) -> Iterator[str]:
    """Yield warnings of what makes a scene move otherwise than its Space."""
    if odd := _other_moments(contents, spin):
        yield odd
    if sensors := sum(shape.sensor for shape in space.shapes):
        yield f"left out of the scene: {sensors} sensor{'s' if sensors > 1 else ''}, which touch nothing"
    buffer = Buffer()
    get_space_arbiters(space, ArbiterFields.CONTACT_COUNT, buffer)
    if begun := np.count_nonzero(np.frombuffer(buffer.int_buf(), np.uintp)):
        what, their = ("contact has", "its impulse") if begun == 1 else ("contacts have", "their impulses")
        yield (
            f"{begun} {what} begun, and Pymunk starts from {their} in its next step, which a scene does not have: "
            "call from_space before the first step, or while nothing touches"
        )
