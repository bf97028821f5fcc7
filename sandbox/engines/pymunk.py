"""Pymunk: a `pymunk.Space` of circle bodies, static segments and static circles. It finds and solves the contacts."""
# ruff: noqa: D102 (the interface of an engine documents the methods)

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import pymunk
from pymunk.batch import Buffer, set_space_bodies

from sandbox.engines.engine import RunningEngine, Traits
from sandbox.engines.space_reader import STATE_BYTES, STATE_FIELDS, SpaceReader
from sandbox.scene.fields import Vector
from sandbox.scene.model import SPACE_SETTINGS, Scene, Wall
from sandbox.scene.walls import ARENA_COUNT, walls_of
from sandbox.state import Contacts, Floats, State, States

# px, of an arena wall. The wall stands outside, its inner face on the arena's edge. A ball escapes only if its centre
# crosses the wall's centre line in one step, which at 60 steps per second takes 1.2 million px/s.
WALL_HALF_THICKNESS: Final = 20_000.0

STATES_BYTES: Final = 500_000  # of states in the buffer, which are decoded together


class PymunkEngine(RunningEngine):
    """A scene in a `pymunk.Space`, which is public as `space`: body k is ball k."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self.space = pymunk.Space()
        self.space.gravity = scene.gravity
        for setting in SPACE_SETTINGS:
            value = getattr(scene.pymunk, setting)
            if value is not None:
                setattr(self.space, setting, value)
        self._substeps = scene.pymunk.substeps
        self._dt = 1 / scene.rate / self._substeps
        self._rate = scene.rate
        self._bodies = _add_bodies(self.space, scene, initial)
        if scene.pymunk.walls_first:
            walls = _add_walls(self.space, scene)
            _add_circles(self.space, scene, self._bodies)
        else:
            _add_circles(self.space, scene, self._bodies)
            walls = _add_walls(self.space, scene)
        carriers = {wall: body for wall in scene.wall_numbers if (body := walls[wall].body)}
        self._reader = SpaceReader(self.space, self._bodies, scene.bodies.radius, carriers, scene.rate, self._substeps)
        self.traits = Traits(damping=self._reader.damping)
        self._substates: list[States] | None = None  # since the last call, if they are asked for
        self._steps_per_read = max(1, STATES_BYTES // (STATE_BYTES * self._reader.bodies * self._substeps))

    def step(self) -> None:
        """Call `Space.step` once for each substep."""
        if self._reader.log.recording or self._substates is not None:
            self._run(1)
            return
        for _ in range(self._substeps):
            self.space.step(self._dt)
            self._reader.calls += 1

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        for begin in range(0, steps, self._steps_per_read):
            rows = slice(begin, min(begin + self._steps_per_read, steps))
            self._run(rows.stop - rows.start)
            for ours, part in zip((position, velocity, angle, spin), self._reader.states(), strict=True):
                ours[rows] = part[self._substeps :: self._substeps]

    def state(self) -> State:
        """Return a snapshot, read in one batch."""
        self._reader.begin()
        return State(
            self._reader.calls // self._substeps / self._rate, *(part[0].copy() for part in self._reader.states())
        )

    def record_contacts(self) -> None:
        self._reader.log.recording = True

    def contacts(self) -> Contacts:
        return self._reader.log.take()

    def substates(self) -> States:
        parts, self._substates = self._substates, []
        return States(*map(np.concatenate, zip(*parts, strict=True))) if parts else States.empty(0, len(self._bodies))

    def kick(self, ball: int, dv: Vector) -> None:
        self._bodies[ball].velocity += dv

    def _run(self, steps: int) -> None:
        """Do some steps, leave the state before them and after each substep in the reader, and collect the contacts."""
        self._reader.begin()
        for _ in range(steps * self._substeps):
            self.space.step(self._dt)
            self._reader.read()
        self._reader.end()
        if self._substates is not None:
            self._substates.append(States(*(part[1:].copy() for part in self._reader.states())))


def _add_bodies(space: pymunk.Space, scene: Scene, initial: State) -> list[pymunk.Body]:
    """Add the bodies of the balls to a Space that has no others, and return them. Their motion is set in one batch."""
    constants = zip(scene.bodies.mass.tolist(), scene.bodies.radius.tolist(), strict=True)
    bodies = [pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius)) for mass, radius in constants]
    space.add(*bodies)
    motion = Buffer()
    motion.set_float_buf(np.column_stack([initial.position, initial.angle, initial.velocity, initial.spin]).data)
    set_space_bodies(space, STATE_FIELDS, motion)
    return bodies


def _add_circles(space: pymunk.Space, scene: Scene, bodies: Sequence[pymunk.Body]) -> None:
    constants = (scene.bodies.radius, scene.bodies.elasticity, scene.bodies.friction, scene.bodies.filters)
    circles = []
    for body, radius, elasticity, friction, filter_ in zip(bodies, *(part.tolist() for part in constants), strict=True):
        circles.append(pymunk.Circle(body, radius))
        circles[-1].elasticity, circles[-1].friction = elasticity, friction
        circles[-1].filter = pymunk.ShapeFilter(*filter_)
    space.add(*circles)


def _add_walls(space: pymunk.Space, scene: Scene) -> list[pymunk.Shape]:
    """Add the walls that stand, each on a static body of its own; return the shapes of all, see `wall_numbers`."""
    walls = walls_of(scene, WALL_HALF_THICKNESS)
    shapes: list[pymunk.Shape] = []
    for number, (a, b, radius, elasticity, friction) in enumerate(zip(*(part.tolist() for part in walls), strict=True)):
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        shape = pymunk.Circle(body, radius, a) if a == b else pymunk.Segment(body, a, b, radius)
        shape.elasticity, shape.friction = elasticity, friction
        if number in scene.wall_numbers:
            space.add(body, shape)
        shapes.append(shape)
    for number, ends in wall_neighbours(scene.walls).items():
        segment = shapes[ARENA_COUNT + number]
        assert isinstance(segment, pymunk.Segment)
        segment.set_neighbors(*ends)
    return shapes


def wall_neighbours(walls: Sequence[Wall]) -> dict[int, tuple[Vector, Vector]]:
    """Return the ends of the walls before and after each one in a chain of joined walls.

    With these, Pymunk lets no ball hit the ends at which two walls meet, where it touches both.
    """
    neighbours = {}
    for chain in _chains(walls):
        is_closed = bool(chain) and walls[chain[-1]].to == walls[chain[0]].start
        for k, number in enumerate(chain):
            before = walls[chain[k - 1]].start if k or is_closed else walls[number].start
            after = walls[chain[(k + 1) % len(chain)]].to if k + 1 < len(chain) or is_closed else walls[number].to
            neighbours[number] = before, after
    return neighbours


def _chains(walls: Sequence[Wall]) -> Iterator[list[int]]:
    """Yield the numbers of the walls of each chain of joined walls; one that ends where it began is complete."""
    chain: list[int] = []
    for number, wall in enumerate(walls):
        last = walls[chain[-1]] if chain else wall
        if chain and (not wall.joined or wall.start != last.to or last.to == walls[chain[0]].start):
            yield chain
            chain = []
        if wall.joined:
            chain.append(number)
    yield chain
