"""Box2D v3, through pyb2d3: circles, static polygons and capsules in a `pyb2d3.World` at Box2D's default settings.

Three settings differ: no approach is too slow to bounce (restitution threshold 0), nothing sleeps, and speed is hardly
limited. Continuous collision is on, but Box2D applies it between balls and walls only: for two balls, one would have to
be a bullet and the other not.

Box2D computes in float32: positions and velocities have seven digits, about 1e-4 px in an arena of 1,000 px.
"""
# ruff: noqa: D102 (the interface of an engine documents the methods)

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, Final

import numpy as np
import pyb2d3

from sandbox.engines.engine import Traits
from sandbox.errors import Refused
from sandbox.scene.fields import Vector
from sandbox.scene.model import Arena, Scene, Wall
from sandbox.scene.walls import ARENA_COUNT, OUTWARD
from sandbox.state import State

# px. Box2D is tuned for things of 0.1 to 10 m (its FAQ): here 13 to 1,280 px. It finds contacts up to 0.02 m early:
# 2.56 px. A power of two, so that scaling rounds nothing.
METRE: Final = 128.0

SUBSTEPS: Final = 4  # a step: what Box2D recommends, and its samples use
MAX_SPEED: Final = 1e9  # m/s, above which Box2D slows a body down; its default is 400 m/s (51,200 px/s)
FILTER_BITS: Final = 64  # of a shape; they select the shapes that it collides with

# px, of an arena wall. The wall stands outside; a ball beyond its middle would be pushed out on the far side.
WALL_THICKNESS: Final = 40_000.0


class Box2DEngine:
    """A scene in a `pyb2d3.World`, which is public as `world`: body k is ball k.

    It reports no contacts: pyb2d3 knows which shapes touch, but not with which impulses. Box2D limits friction while it
    stops the approach, and applies restitution afterwards: in a bounce that slides, friction is 1/(1 + e) of Coulomb's.
    """

    traits = Traits(soft=True, reports_contacts=False)

    def __init__(self, scene: Scene, initial: State) -> None:
        if scene.bodies.are_filtered:
            raise Refused("box2d: filters of balls are not supported; use --engines pymunk")
        self.world = pyb2d3.World(
            gravity=_metres(scene.gravity), restitution_threshold=0.0, maximum_linear_speed=MAX_SPEED
        )
        if not self.world.is_valid():
            raise Refused("box2d: it has room for 128 worlds at a time in a process, and all are in use")
        self._rate = scene.rate
        self._steps = 0
        materials = _Materials(scene)
        self._bodies = _add_balls(self.world, materials, scene, initial)
        self._batch = pyb2d3.Bodies()
        for body in self._bodies:
            self._batch.append(body)
        _add_walls(self.world, materials, scene)
        self._start_angle, self._angle = initial.angle, initial.angle.copy()

    def step(self) -> None:
        """Call `World.step`."""
        self.world.step(1 / self._rate, SUBSTEPS)
        self._steps += 1
        self._turn()

    def state(self) -> State:
        """Return a snapshot: float32 numbers."""
        position, velocity = self._batch.get_positions(), self._batch.get_linear_velocities()
        spin = self._batch.get_angular_velocities().astype(np.float64)
        x, v = position * np.float64(METRE), velocity * np.float64(METRE)
        return State(self._steps / self._rate, x, v, self._angle.copy(), spin)

    def kick(self, ball: int, dv: Vector) -> None:
        x, y = _metres(dv)
        velocity = self._bodies[ball].linear_velocity
        self._bodies[ball].linear_velocity = (velocity.x + x, velocity.y + y)

    def _turn(self) -> None:
        """Update the angles: Box2D knows them up to whole turns, of which the spin makes the nearest in a step."""
        cosine, sine = self._batch.get_rotations().astype(np.float64).T
        expected = self._angle + self._batch.get_angular_velocities() / self._rate
        more = self._start_angle + np.arctan2(sine, cosine) - expected
        self._angle = expected + more - 2 * np.pi * np.rint(more / (2 * np.pi))


def _metres(vector: Vector) -> Vector:
    return vector[0] / METRE, vector[1] / METRE


class _Materials:
    """Defines shapes such that every pair has the product of its elasticities and of its frictions.

    Box2D combines two restitutions by their maximum, and two frictions by the root of their product; pyb2d3 cannot
    change that. So frictions are passed squared. A ball has one circle for each elasticity that it can meet, with the
    product as its restitution. Each pair of elasticities has a filter bit, so that only the matching circle collides.
    """

    def __init__(self, scene: Scene) -> None:
        self._all = sorted({*scene.bodies.elasticity.tolist(), *(float(wall.elasticity) for wall in scene.surfaces)})
        pairs = list(product(self._all, repeat=2))
        if len(pairs) > FILTER_BITS:
            raise Refused(
                f"box2d: {len(self._all)} different elasticities are more than its filters can tell apart (8); "
                "use --engines pymunk"
            )
        self._bits = {pair: 1 << bit for bit, pair in enumerate(pairs)}

    def of_ball(self, number: int, elasticity: float, friction: float) -> Iterator[Any]:
        """Yield the definition of each circle of a ball."""
        for partner in self._all:
            yield self._shape(number, friction, elasticity * partner, elasticity, [partner])

    def of_wall(self, number: int, elasticity: float, friction: float) -> Any:
        """Return the definition of a wall's shape; its restitution is 0, so that the ball's is the maximum."""
        return self._shape(number, friction, 0.0, elasticity, self._all)

    def _shape(
        self, number: int, friction: float, restitution: float, elasticity: float, partners: Sequence[float]
    ) -> Any:
        return pyb2d3.shape_def(
            user_data=number,
            material=pyb2d3.surface_material(friction=friction**2, restitution=restitution),
            filter=pyb2d3.make_filter(
                category_bits=sum(self._bits[elasticity, partner] for partner in partners),
                mask_bits=sum(self._bits[partner, elasticity] for partner in partners),
            ),
        )


def _add_balls(world: Any, materials: _Materials, scene: Scene, initial: State) -> list[Any]:
    bodies = scene.bodies
    added = []
    for ball in range(len(bodies)):
        body = world.create_dynamic_body(
            position=_metres(initial.position[ball].tolist()),
            linear_velocity=_metres(initial.velocity[ball].tolist()),
            angular_velocity=float(initial.spin[ball]),
            enable_sleep=False,
        )
        radius, mass = float(bodies.radius[ball]) / METRE, float(bodies.mass[ball])
        for shape in materials.of_ball(ball, float(bodies.elasticity[ball]), float(bodies.friction[ball])):
            body.create_shape(shape, pyb2d3.circle(radius=radius))
        of_disc = body.mass_data
        of_disc.mass, of_disc.rotational_inertia = mass, mass * radius**2 / 2
        body.mass_data = of_disc
        added.append(body)
    return added


def _add_walls(world: Any, materials: _Materials, scene: Scene) -> None:
    """Add the arena's walls, if they stand, and the scene's own, with shapes that are numbered after the balls."""
    n, arena, (width, height) = len(scene.bodies), scene.arena, scene.arena.size
    long = WALL_THICKNESS + width + height

    def add(number: int, corner: Vector, wall: Arena | Wall, shape: object) -> None:
        body = world.create_static_body(position=_metres(corner))
        body.create_shape(materials.of_wall(n + number, float(wall.elasticity), wall.friction), shape)

    # Each inner face goes through the origin of its body, where float32 is finest.
    corners = (0, 0), (0, 0), (width, height), (width, height)
    for number, (corner, (ox, oy)) in enumerate(zip(corners, OUTWARD.tolist(), strict=True)):
        slab = [
            (ox * deep - oy * along, oy * deep + ox * along)
            for deep, along in ((0, -long), (0, long), (WALL_THICKNESS, long), (WALL_THICKNESS, -long))
        ]
        if arena.walls:
            add(number, corner, arena, pyb2d3.polygon(np.array(slab) / METRE))
    for number, wall in enumerate(scene.walls, ARENA_COUNT):
        ends = _metres(wall.start), _metres(wall.to)
        radius = wall.thickness / 2 / METRE
        if wall.is_peg:
            add(number, wall.start, wall, pyb2d3.circle(radius=radius))
            continue
        add(number, (0, 0), wall, pyb2d3.capsule(*ends, radius) if radius else pyb2d3.segment(*ends))
