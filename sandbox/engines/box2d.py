"""Box2D v3, through pyb2d3: circles, static polygons and capsules in a `pyb2d3.World` at Box2D's default settings.

Three settings differ: no approach is too slow to bounce (restitution threshold 0), nothing sleeps, and speed is hardly
limited. Continuous collision is on, but Box2D applies it between balls and walls only: for two balls, one would have to
be a bullet and the other not.

Box2D computes in float32: positions and velocities have seven digits, about 1e-4 px in an arena of 1,000 px.
"""
# ruff: noqa: D102 (the interface of an engine documents the methods)

from collections.abc import Iterator, Sequence
from itertools import groupby, product
from operator import itemgetter
from typing import Any, Final

import numpy as np
import pyb2d3

from sandbox.engines.contact_log import ContactLog
from sandbox.engines.engine import Traits
from sandbox.errors import Refused
from sandbox.quantity import dot, pass_through, slips, tangent
from sandbox.scene.fields import Vector
from sandbox.scene.model import Arena, Scene, Wall
from sandbox.scene.walls import ARENA_COUNT, OUTWARD, separation, walls_of
from sandbox.state import CONTACT, Contacts, Floats, Integers, State

# px. Box2D is tuned for things of 0.1 to 10 m (its FAQ): here 13 to 1,280 px. It finds contacts up to 0.02 m early:
# 2.56 px. A power of two, so that scaling rounds nothing.
METRE: Final = 128.0

SUBSTEPS: Final = 4  # a step: what Box2D recommends, and its samples use
MAX_SPEED: Final = 1e9  # m/s, above which Box2D slows a body down; its default is 400 m/s (51,200 px/s)
FILTER_BITS: Final = 64  # of a shape; they select the shapes that it collides with

# px, of an arena wall. The wall stands outside; a ball beyond its middle would be pushed out on the far side.
WALL_THICKNESS: Final = 40_000.0

MAX_ITERATIONS: Final = 200  # of conjugate gradients; gases and piles take tens
RESIDUAL_TOLERANCE: Final = 1e-7  # relative to the residual at the start: the precision of float32
DISC_TURNS: Final = 2  # m r²/I of a disc: an impulse at the rim turns it by this times as much as it moves it
VELOCITY_ROUNDING: Final = 16 * float(np.finfo(np.float32).eps)  # relative: the rounding of four substeps


Kind = tuple[float, tuple[int, ...]]  # elasticity, and filter; a wall's is empty


class Box2DEngine:
    """A scene in a `pyb2d3.World`, which is public as `world`: body k is ball k.

    pyb2d3 reports which shapes touch, but not the impulses: these are computed from the changes of momentum, see
    `impulses`. Box2D limits friction while it stops the approach, and applies restitution afterwards: in a bounce that
    slides, friction is 1/(1 + e) of Coulomb's.
    """

    traits = Traits(soft=True)

    def __init__(self, scene: Scene, initial: State) -> None:
        self.world = pyb2d3.World(
            gravity=_metres(scene.gravity),
            restitution_threshold=0.0,
            maximum_linear_speed=MAX_SPEED,
        )
        if not self.world.is_valid():
            raise Refused("box2d: it has room for 128 worlds at a time in a process, and all are in use")
        self._rate = scene.rate
        self._gravity = np.array(scene.gravity, float)
        self._steps = 0
        self._balls = scene.bodies
        materials = _Materials(scene)
        self._bodies = _add_balls(self.world, materials, scene, initial)
        self._batch = pyb2d3.Bodies()
        for body in self._bodies:
            self._batch.append(body)
        _add_walls(self.world, materials, scene)
        self._walls = walls_of(scene, WALL_THICKNESS / 2)
        self._friction = np.append(scene.bodies.friction, self._walls.friction[::-1])  # so that ~wall is its index
        self._start_angle, self._angle = initial.angle, initial.angle.copy()
        self._touching: set[tuple[int, int]] = set()
        self._contacts = ContactLog()

    def step(self) -> None:
        """Call `World.step`."""
        before = self.state() if self._contacts.recording else None
        self.world.step(1 / self._rate, SUBSTEPS)
        self._steps += 1
        self._turn()
        self._update_touching()
        if before is not None and self._touching:
            self._collect(before)

    def state(self) -> State:
        """Return a snapshot: float32 numbers."""
        position, velocity = self._batch.get_positions(), self._batch.get_linear_velocities()
        spin = self._batch.get_angular_velocities().astype(np.float64)
        x, v = position * np.float64(METRE), velocity * np.float64(METRE)
        return State(self._steps / self._rate, x, v, self._angle.copy(), spin)

    def record_contacts(self) -> None:
        self._contacts.recording = True

    def contacts(self) -> Contacts:
        """Return the contacts since the last call.

        Box2D solves a contact that will touch within the step before it does: its depth is then negative.
        """
        return self._contacts.take()

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

    def _update_touching(self) -> None:
        """Update which pairs touch, from the events of the last step."""
        events = self.world.get_contact_events()
        for event in events.begin_events():
            self._touching.add(self._pair(event))
        for event in events.end_events():
            self._touching.discard(self._pair(event))

    def _pair(self, event: Any) -> tuple[int, int]:
        n = len(self._balls)
        first, second = sorted((event.shape_a.user_data, event.shape_b.user_data))
        return first, second if second < n else ~(second - n)

    def _collect(self, before: State) -> None:
        """Log the contacts of the last step. Box2D finds them, and their normals, on the positions before the step."""
        after = self.state()
        first, second = np.array(sorted(self._touching)).T
        contacts = np.empty(len(first), CONTACT)
        contacts["time"] = after.time
        contacts["first"], contacts["second"] = first, second
        contacts["normal"], contacts["depth"] = self._geometry(before.position, first, second)
        change = after.velocity - before.velocity - self._gravity / self._rate
        turned = self._balls.radius * (after.spin - before.spin)
        rough = self._friction[first] * self._friction[second] > 0
        # The point of contact is in the middle of the overlap, or of the gap that will close within the step.
        reach = self._balls.radius[np.column_stack([first, np.maximum(second, 0)])]
        lever = np.where(rough[:, None], 1 - contacts["depth"][:, None] / (2 * reach), np.nan)
        changes = np.column_stack([change, turned])
        fastest = np.abs([before.velocity, after.velocity]).max()
        least = VELOCITY_ROUNDING * fastest * self._balls.mass[first]
        impulse = impulses(first, second, contacts["normal"], changes, self._balls.mass, lever)
        solved = impulse[:, 0] > least
        if rough.any() and not solved.all():  # none pulls, and without those that would, the others are others
            pressing = first[solved], second[solved], contacts["normal"][solved]
            impulse[solved] = impulses(*pressing, changes, self._balls.mass, lever[solved])
            solved &= impulse[:, 0] > least
        contacts["impulse"], contacts["tangential"] = impulse.T
        falling, row = before.velocity + self._gravity / self._rate, np.zeros(len(first), np.int64)
        contacts["slip"] = slips(contacts, row, falling[None], before.spin[None], self._balls.radius)
        self._contacts.add(contacts[solved])

    def _geometry(self, position: Floats, first: Integers, second: Integers) -> tuple[Floats, Floats]:
        """Return the unit vectors from first to second, and the depth of their overlap (px)."""
        away, reach = separation(position, self._balls.radius, self._walls, first, second)
        distance = np.hypot(*away.T)
        normal = away / np.where(distance > 0, distance, 1.0)[:, None]  # 0 if centres coincide: Box2D ignores them
        return normal, reach - distance


def impulses(first: Integers, second: Integers, normal: Floats, change: Floats, mass: Floats, lever: Floats) -> Floats:
    """Return the impulse of each contact along normal and tangent (kg px/s), from the changes of velocity they caused.

    first, second: (k,) as in CONTACT; normal: (k, 2); change: (n, 3) px/s, of both components of the velocity, and of
    radius times spin; mass: (n,) kg; lever: (k, 2), the distance of the point of contact from each centre as a share of
    the radius, NaN where the two have no friction. Returns (k, 2).

    For a ball's only contact, it is the change of the ball's momentum. For several, it is a least-squares solution, by
    conjugate gradients; which solution Box2D found is unknown if there are several.
    """
    between = second >= 0
    partner = second[between]
    along = tangent(normal)
    inertia = 1 / mass[first]
    inertia[between] += 1 / mass[partner]
    inertia = inertia[:, None] * (1, 1 + DISC_TURNS)
    rough = ~np.isnan(lever[:, 0])
    lever = np.nan_to_num(lever)

    def parting_speed(velocity: Floats) -> Floats:
        """Return how fast the bodies part, and the first's rim slips past the second's backwards: (k, 2) px/s."""
        apart = -velocity[first, :2]
        apart[between] += velocity[partner, :2]
        slip = dot(along, apart) - lever[:, 0] * velocity[first, 2]
        slip[between] -= lever[between, 1] * velocity[partner, 2]
        return np.column_stack([dot(normal, apart), np.where(rough, slip, 0.0)])

    def velocity_change(impulse: Floats) -> Floats:
        push = impulse[:, :1] * normal + impulse[:, 1:] * along
        turn = DISC_TURNS * impulse[:, 1:] * lever
        momentum = np.zeros_like(change)
        np.subtract.at(momentum, first, np.hstack([push, turn[:, :1]]))
        np.add.at(momentum, partner, np.hstack([push, -turn[:, 1:]])[between])
        return momentum / mass[:, None]

    impulse = np.zeros((len(first), 2))
    residual = parting_speed(change)
    direction = residual / inertia
    norm = start = float(np.vdot(residual, direction))
    for _ in range(min(impulse.size, MAX_ITERATIONS)):
        if norm <= RESIDUAL_TOLERANCE**2 * start:
            break
        response = parting_speed(velocity_change(direction))
        step = norm / float(np.vdot(direction, response))
        impulse += step * direction
        residual -= step * response
        before, norm = norm, float(np.vdot(residual, residual / inertia))
        direction = residual / inertia + norm / before * direction
    return impulse


def _metres(vector: Vector) -> Vector:
    return vector[0] / METRE, vector[1] / METRE


class _Materials:
    """Defines shapes such that every pair has the product of its elasticities and of its frictions.

    Box2D combines two restitutions by their maximum, and two frictions by the root of their product; pyb2d3 cannot
    change that. So frictions are passed squared. A ball has one circle for each elasticity that it can meet, with the
    product as its restitution. A kind is an elasticity and a filter; each pair of kinds has a filter bit, so that only
    the matching circle collides, and none of balls that pass through each other.
    """

    def __init__(self, scene: Scene) -> None:
        bodies = scene.bodies
        of_balls = zip(bodies.elasticity.tolist(), map(tuple, bodies.filters.tolist()), strict=True)
        kinds = sorted({*of_balls, *((float(wall.elasticity), ()) for wall in scene.surfaces)})
        pairs = list(product(kinds, repeat=2))
        if len(pairs) > FILTER_BITS:
            what = "pairs of elasticity and filter" if bodies.are_filtered else "elasticities"
            raise Refused(
                f"box2d: {len(kinds)} different {what} are more than its filters can tell apart (8); "
                "use --engines pymunk"
            )
        self._kinds = kinds
        self._bits = {(one, other): _meet(one, other) << bit for bit, (one, other) in enumerate(pairs)}

    def of_ball(self, number: int, elasticity: float, friction: float, filter_: tuple[int, ...]) -> Iterator[Any]:
        """Yield the definition of each circle of a ball."""
        for restitution, partners in groupby(self._kinds, key=itemgetter(0)):
            yield self._shape(number, friction, elasticity * restitution, (elasticity, filter_), [*partners])

    def of_wall(self, number: int, elasticity: float, friction: float) -> Any:
        """Return the definition of a wall's shape; its restitution is 0, so that the ball's is the maximum."""
        return self._shape(number, friction, 0.0, (elasticity, ()), self._kinds)

    def _shape(self, number: int, friction: float, restitution: float, kind: Kind, partners: Sequence[Kind]) -> Any:
        return pyb2d3.shape_def(
            user_data=number,
            enable_contact_events=True,
            material=pyb2d3.surface_material(friction=friction**2, restitution=restitution),
            filter=pyb2d3.make_filter(
                category_bits=sum(self._bits[kind, partner] for partner in partners),
                mask_bits=sum(self._bits[partner, kind] for partner in partners),
            ),
        )


def _meet(one: Kind, other: Kind) -> bool:
    """Return whether shapes of two kinds do not pass through each other; walls pass through nothing."""
    return not (one[1] and other[1] and pass_through(one[1], other[1]))


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
        constants = float(bodies.elasticity[ball]), float(bodies.friction[ball]), tuple(bodies.filters[ball].tolist())
        for shape in materials.of_ball(ball, *constants):
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
