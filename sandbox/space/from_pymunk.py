"""A scene of a live `pymunk.Space`, and the Space of a scene: balls are dynamic bodies, walls and pegs static ones."""

import math
import os
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import combinations, pairwise
from typing import Any, Final
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
from sandbox.space.contents import body_of, checked, corners_of, is_dynamic
from sandbox.state import Bodies, Floats, State

MAX_MOMENT_ERROR: Final = 1e-9  # of m r²/2, which is rounding
MAX_LISTED: Final = 5  # moments in a warning

Name = tuple[str, str]  # of what a scene cannot have: singular and plural


def _is_driven(body: pymunk.Body) -> bool:
    """Return whether a kinematic body moves, or may by its program's functions."""
    functions = body.velocity_func, body.position_func
    own = functions != (pymunk.Body.update_velocity, pymunk.Body.update_position)
    return body.velocity != (0, 0) or body.angular_velocity != 0 or own


def _is_point(shape: pymunk.Shape) -> bool:
    """Return whether a segment, or a circle that does not move, has no size."""
    is_short = isinstance(shape, pymunk.Segment) and math.dist(shape.a, shape.b) < MIN_LENGTH
    return not shape.radius and (is_short or (isinstance(shape, pymunk.Circle) and not _moves(shape)))


def _moves(shape: pymunk.Shape) -> bool:
    return is_dynamic(body_of(shape))


# Of each solid shape, the first that is true:
_OF_SHAPES: Final[dict[Name, Callable[[pymunk.Shape], bool]]] = {
    ("shape on a moving kinematic body", "shapes on moving kinematic bodies"): lambda shape: (
        body_of(shape).body_type == pymunk.Body.KINEMATIC and _is_driven(body_of(shape))
    ),
    ("dynamic segment", "dynamic segments"): lambda shape: _moves(shape) and isinstance(shape, pymunk.Segment),
    ("dynamic polygon", "dynamic polygons"): lambda shape: _moves(shape) and isinstance(shape, pymunk.Poly),
    ("circle off its body's centre of gravity", "circles off their bodies' centres of gravity"): lambda shape: (
        _moves(shape) and (shape.center_of_gravity != (0, 0) or body_of(shape).center_of_gravity != (0, 0))
    ),
    ("shape with an elasticity outside 0 to 1", "shapes with an elasticity outside 0 to 1"): lambda shape: (
        not 0 <= shape.elasticity <= 1
    ),
    ("wall without size", "walls without size"): _is_point,
}
# Of each dynamic body and its solid shapes, all that are true:
_OF_BODIES: Final[dict[Name, Callable[[pymunk.Body, Sequence[pymunk.Shape]], Any]]] = {
    ("dynamic body without a shape", "dynamic bodies without a shape"): lambda _, solid: not solid,
    ("dynamic body with several shapes", "dynamic bodies with several shapes"): lambda _, solid: len(solid) > 1,
    ("infinite moment of a circle with friction", "infinite moments of circles with friction"): lambda body, solid: (
        math.isinf(body.moment) and [type(shape) for shape in solid if shape.friction] == [pymunk.Circle]
    ),
    ("body with a force or torque", "bodies with a force or torque"): lambda body, _: (
        body.force != (0, 0) or body.torque
    ),
    ("custom velocity function", "custom velocity functions"): lambda body, _: (
        body.velocity_func is not pymunk.Body.update_velocity
    ),
    ("custom position function", "custom position functions"): lambda body, _: (
        body.position_func is not pymunk.Body.update_position
    ),
}


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
    solid = [shape for shape in checked(space).shapes if not shape.sensor]  # sensors touch nothing
    of_body: dict[pymunk.Body, list[pymunk.Shape]] = defaultdict(list)
    for shape in solid:
        of_body[body_of(shape)].append(shape)
    left_out = _counts_in_words(Counter(_unsupported(space, solid, of_body)))
    if left_out and not skip:
        raise SandboxError(f"the Space has {left_out}, which a scene cannot have; skip=True leaves that out")
    kept = [shape for shape in solid if _why_not(shape) is None]
    circles = [shape for shape in kept if _moves(shape) and len(of_body[body_of(shape)]) == 1]
    walls = [wall for shape in kept if not _moves(shape) for wall in _walls_of(shape)]
    motion, bodies = _motion_of(circles), _constants_of(circles)
    scene = Scene(
        title=title,
        rate=rate,
        gravity=(space.gravity.x, space.gravity.y),
        arena=Arena(size=size or _view(walls, motion.position, bodies.radius), walls=False),
        balls=list(ball_groups(bodies, motion)),
        walls=walls,
        pymunk=PymunkSettings(**_settings_of(space, solid)),
    )
    if overlap := needed_overlap(scene, motion.position):
        scene = scene.changed(arena=scene.arena.model_copy(update={"overlap": overlap}))
    if left_out:
        warn(f"left out of the scene: {left_out}", SpaceWarning, stacklevel=2)
    for warning in _warnings(space, circles):
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


def _unsupported(
    space: pymunk.Space, solid: Sequence[pymunk.Shape], of_body: dict[pymunk.Body, list[pymunk.Shape]]
) -> Iterator[Name]:
    """Yield what a scene cannot have. of_body: the solid shapes of each body."""
    for body in filter(is_dynamic, space.bodies):
        yield from (name for name, is_there in _OF_BODIES.items() if is_there(body, of_body.get(body, [])))
    for shape in solid:
        if shape.surface_velocity != (0, 0):
            yield "surface velocity", "surface velocities"
    yield from [("shape with a filter between balls and walls", "shapes with filters between balls and walls")] * (
        _filtered(solid)
    )
    for handler in space._handlers.values():  # Pymunk has no public list of them
        if any((handler.begin, handler.pre_solve, handler.post_solve, handler.separate)):
            yield "collision handler", "collision handlers"
    if _odd(space.damping):
        yield "damping outside 0 to 1", "dampings outside 0 to 1"
    if space.threads > 1:
        yield "solver with threads", "solvers with threads"
    for joint in space.constraints:
        yield type(joint).__name__, f"{type(joint).__name__}s"
    yield from filter(None, map(_why_not, solid))


def _why_not(shape: pymunk.Shape) -> Name | None:
    """Return why a scene cannot have a shape, or None."""
    return next((name for name, is_there in _OF_SHAPES.items() if is_there(shape)), None)


def _counts_in_words(counts: Counter[Name]) -> str:
    """Return numbers of things in words: "2 dynamic polygons, 1 PivotJoint"."""
    return ", ".join(f"{count} {singular if count == 1 else plural}" for (singular, plural), count in counts.items())


def _odd(damping: float) -> bool:
    """Return whether a scene cannot have this damping."""
    return not 0 < damping <= 1


def _filtered(shapes: Sequence[pymunk.Shape]) -> int:
    """Return the number of balls and walls that ignore a wall or a ball by their filters."""
    kinds = Counter((shape.filter, _moves(shape)) for shape in shapes)
    ignoring: set[tuple[pymunk.ShapeFilter, bool]] = set()
    for kind, partner in combinations(kinds, 2):
        if kind[1] != partner[1] and pass_through(kind[0], partner[0]):
            ignoring |= {kind, partner}
    return sum(kinds[kind] for kind in ignoring)


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


def _motion_of(circles: Sequence[pymunk.Shape]) -> State:
    """Return where circles are and how they move: (n, 2) px, px/s; (n,) rad, rad/s. What is asleep does not move."""
    position, velocity, angle, spin, asleep = (
        np.array([getattr(body_of(circle), key) for circle in circles], float)
        for key in ("position", "velocity", "angle", "angular_velocity", "is_sleeping")
    )
    moves = asleep == 0
    return State(0.0, position.reshape(-1, 2), velocity.reshape(-1, 2) * moves[:, None], angle, spin * moves)


def _constants_of(circles: Sequence[pymunk.Shape]) -> Bodies:
    """Return the balls' constants; groups of filters get numbers of their own."""
    groups = {0: 0}
    filters = [(groups.setdefault(shape.filter.group, len(groups)), *shape.filter[1:]) for shape in circles]
    kinds = [(circle.radius, body_of(circle).mass, circle.elasticity, circle.friction) for circle in circles]
    radius, mass, elasticity, friction = np.array(kinds, float).reshape(-1, 4).T
    return Bodies(radius, mass, elasticity, friction, np.array(filters, np.int64).reshape(-1, 3))


def _walls_of(shape: pymunk.Shape) -> Iterator[dict[str, Any]]:
    """Yield a static segment, or circle, or the sides of a static polygon, which are joined: px in the Space."""
    corners, is_polygon = corners_of(shape), isinstance(shape, pymunk.Poly)
    if isinstance(shape, pymunk.Segment) and math.dist(shape.a, shape.b) < MIN_LENGTH:
        corners = [shape.a]
    if is_polygon or len(corners) == 1:
        corners.append(corners[0])
    surface = {"elasticity": shape.elasticity, "friction": shape.friction, "joined": is_polygon}
    for start, to in pairwise(map(body_of(shape).local_to_world, corners)):
        yield {"start": tuple(start), "to": tuple(to), "thickness": 2 * shape.radius} | surface


def _view(walls: Sequence[dict[str, Any]], position: Floats, radius: Floats) -> Vector:
    """Return the width and height of a view from (0, 0) to the furthest ball or wall, in whole px, at least 1.

    What is not finite is left to the checks of a scene.
    """
    ends = [(wall[end], wall["thickness"] / 2) for wall in walls for end in ("start", "to")]
    ends += zip(position.tolist(), radius.tolist(), strict=True)
    reach = [[place[axis] + half for place, half in ends] for axis in (0, 1)]
    width, height = (max([1, *map(math.ceil, filter(math.isfinite, each))]) for each in reach)
    return width, height


def _warnings(space: pymunk.Space, circles: Sequence[pymunk.Shape]) -> Iterator[str]:
    """Yield warnings of what makes a scene move otherwise than its Space."""
    odd = []
    for number, circle in enumerate(circles):
        body, disc = body_of(circle), body_of(circle).mass * circle.radius**2 / 2
        turns = circle.friction or (body.angular_velocity and not body.is_sleeping)
        if turns and MAX_MOMENT_ERROR * disc < abs(body.moment - disc) < math.inf:
            odd.append(f"ball {number} {body.moment:.6g} instead of {disc:.6g}")
    if odd:
        more = f" and {len(odd) - MAX_LISTED} more" if len(odd) > MAX_LISTED else ""
        yield f"balls turn as uniform discs, with moments m r²/2; in this Space, {', '.join(odd[:MAX_LISTED])}{more}"
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
