"""A scene of a live `pymunk.Space`, and the Space of a scene: balls are dynamic bodies, walls and pegs static ones."""

import math
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from typing import Any, Final
from warnings import warn

import numpy as np
import pymunk

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
from sandbox.text import counted

MAX_MOMENT_ERROR: Final = 1e-9  # of m r²/2, which is rounding


def from_space(space: pymunk.Space, *, size: Vector | None = None, rate: int = 60, title: str = "") -> Scene:
    """Return a scene of what a Space has now, without walls round the arena.

    Circles on dynamic bodies become balls, in the order of their shapes; segments and the outlines of polygons on
    static bodies become walls, and circles pegs, which are walls of no length; so do those on kinematic bodies at rest.
    size: width and height of the view, px, by default up to the furthest ball or wall; rate: steps per second.
    Raises SandboxError, which lists what a scene cannot have, or else its numbers out of range. Warns (SpaceWarning) of
    moments that are not those of uniform discs, of sensors, which are left out, and of contacts that have begun.
    """
    solid = [shape for shape in checked(space).shapes if not shape.sensor]  # sensors touch nothing
    if refused := Counter(_unsupported(space, solid)):
        words = ", ".join(f"{count} x {name}" for name, count in refused.items())
        raise SandboxError(f"the Space has what a scene cannot have: {words}")
    circles = [shape for shape in solid if is_dynamic(body_of(shape))]
    walls = [wall for shape in solid if not is_dynamic(body_of(shape)) for wall in _walls_of(shape)]
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
    for warning in _warnings(space, circles):
        warn(warning, SpaceWarning, stacklevel=2)
    return scene


def to_space(scene: Scene | str | os.PathLike[str]) -> pymunk.Space:
    """Return the Space of a scene as the engine `pymunk` builds it: body k is ball k. The rest is your own loop's.

    scene: a Scene, the name of a bundled scene, or a file. A step of the engine is `pymunk.substeps` of the scene calls
    of `space.step(1 / rate / substeps)`.
    Raises SandboxError as `load` does.
    """
    chosen = scene if isinstance(scene, Scene) else load(scene)
    return PymunkEngine(chosen, spawn(chosen)).space


def _unsupported(space: pymunk.Space, solid: Sequence[pymunk.Shape]) -> Iterator[str]:
    """Yield the name of each thing that a scene cannot have. solid: the shapes that touch."""
    shapes_of = Counter(map(body_of, solid))
    for body in space.bodies:
        if body._velocity_func or body._position_func:
            yield "function for a velocity or position"
        if is_dynamic(body) and shapes_of[body] != 1:
            yield "dynamic body with more or less than one shape"
        if is_dynamic(body) and (body.force != (0, 0) or body.torque):
            yield "force or torque"
        if body.body_type == pymunk.Body.KINEMATIC and (body.velocity != (0, 0) or body.angular_velocity):
            yield "moving kinematic body"
    for shape in solid:
        is_disc = isinstance(shape, pymunk.Circle) and shape.offset == body_of(shape).center_of_gravity == (0, 0)
        if is_dynamic(body_of(shape)) and not is_disc:
            yield "dynamic shape that is not a circle round its body's place"
        if shape.surface_velocity != (0, 0):
            yield "surface velocity"
    balls, walls = ({shape.filter for shape in solid if is_dynamic(body_of(shape)) == moves} for moves in (True, False))
    if any(pass_through(ball, wall) for ball, wall in product(balls, walls)):
        yield "filter between a ball and a wall"
    for handler in space._handlers.values():  # Pymunk has no public list of them
        if any((handler.begin, handler.pre_solve, handler.post_solve, handler.separate)):
            yield "collision handler"
    yield from (type(joint).__name__ for joint in space.constraints)


def _settings_of(space: pymunk.Space, solid: Sequence[pymunk.Shape]) -> dict[str, float]:
    """Return the settings that a scene can have and that are not Pymunk's defaults."""
    plain = pymunk.Space()
    settings = {key: getattr(space, key) for key in SPACE_SETTINGS if getattr(space, key) != getattr(plain, key)}
    if solid and not is_dynamic(body_of(solid[0])):
        settings["walls_first"] = 1
    return settings


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
    ends = [np.add(wall[end], wall["thickness"] / 2) for wall in walls for end in ("start", "to")]
    reach = np.vstack([*ends, position + radius[:, None]])
    width, height = np.ceil(reach.max(axis=0, where=np.isfinite(reach), initial=1)).tolist()
    return width, height


def _warnings(space: pymunk.Space, circles: Sequence[pymunk.Shape]) -> Iterator[str]:
    """Yield warnings of what makes a scene move otherwise than its Space."""
    odd = []
    for number, circle in enumerate(circles):
        body, disc = body_of(circle), body_of(circle).mass * circle.radius**2 / 2
        turns = circle.friction or (body.angular_velocity and not body.is_sleeping)
        if turns and MAX_MOMENT_ERROR * disc < abs(body.moment - disc):
            odd.append(f"ball {number} {body.moment:.6g} instead of {disc:.6g}")
    if odd:
        yield f"balls turn as uniform discs, with moments m r²/2; in this Space, {', '.join(odd)}"
    if sensors := sum(shape.sensor for shape in space.shapes):
        yield f"left out of the scene: {counted(sensors, 'sensor')}, which touch nothing"
    if begun := sum(arbiter.count > 0 for arbiter in space._get_arbiters()):
        yield (
            f"the next step starts from the impulses of {counted(begun, 'contact')}, which a scene does not have: "
            "call from_space before the first step, or while nothing touches"
        )
