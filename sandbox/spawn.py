"""A scene and its seed -> the initial state."""

import copy
import itertools
import math
import random
from collections import defaultdict
from collections.abc import Iterator
from typing import Final

import numpy as np

from sandbox.mistakes import Mistake
from sandbox.quantity import deepest_overlap, length, segment_distance
from sandbox.scene import ROUNDING, BallGroup, Range, Scene, Vector
from sandbox.state import Floats, State

TRIES: Final = 100  # random places tried for a ball before its group is put on a lattice instead


def spawn(scene: Scene) -> State:
    """Place and throw the balls of a scene, as its seed has it.

    One `random.Random(seed)` serves all groups in order; a ball takes from it x, y, vx, vy in that order.
    The scene keeps what was found; what is returned is the caller's own. Raises Mistake where the balls of a group do
    not fit.
    """
    source = (scene.seed, scene.balls, scene.arena, scene.walls)
    if scene._spawned is None or scene._spawned[0] != source:
        scene._spawned = source, _spawn(scene)
    drawn = scene._spawned[1]
    return State(0.0, drawn.position.copy(), drawn.velocity.copy())


def _spawn(scene: Scene) -> State:
    rng = random.Random(scene.seed)
    crowd = _Crowd(scene)
    position: list[Vector] = []
    velocity: list[Vector] = []
    for index, group in enumerate(scene.balls):
        place = _places(scene, index, rng, crowd)
        throw = _throws(group, rng)
        for _ in range(group.size):
            position.append(next(place))
            crowd.add(position[-1], group.radius)
            velocity.append(next(throw))
    return State(0.0, np.array(position, float), np.array(velocity, float))


def warnings(scene: Scene, state: State) -> Iterator[str]:
    """Tell what a scene's author may not have meant: overlaps, and balls that outrun their radius."""
    radius = scene.bodies.radius
    overlap, first, second = deepest_overlap(state.position, radius)
    if overlap > 0:
        yield scene.at((), f"warning: balls {first} and {second} overlap by {overlap:.3g} px at the start")
    for index, wall in enumerate(scene.walls):
        depth = radius + wall.thickness / 2 - segment_distance(state.position, wall.start, wall.to)
        if (ball := int(depth.argmax())) >= 0 and depth[ball] > 0:
            yield scene.at(("walls", index), f"warning: overlaps ball {ball} by {depth[ball]:.3g} px at the start")
    moved = length(state.velocity) / scene.rate  # px a step
    ball = int((moved / radius).argmax())
    if moved[ball] > radius[ball] * (1 + ROUNDING):
        enough = math.ceil(moved[ball] * scene.rate / (radius[ball] * (1 + ROUNDING)))
        yield scene.at(
            (),
            f"warning: ball {ball} moves {moved[ball]:.3g} px a step, more than its radius of {radius[ball]:g}, "
            f"so solvers that step may miss contacts; a rate of {enough} would do",
        )


def _draw(drawn: Range, rng: random.Random) -> float:
    if drawn.step is None:
        return rng.uniform(drawn.start, drawn.to)
    start, to, step = int(drawn.start), int(drawn.to), int(drawn.step)
    return float(rng.randrange(start, to + step, step))


def _places(scene: Scene, index: int, rng: random.Random, crowd: "_Crowd") -> Iterator[Vector]:
    group = scene.balls[index]
    if group.grid and group.spacing:
        x, y = group.first_of_grid(scene.arena)
        for ball in range(group.size):
            row, column = divmod(ball, group.grid[0])
            yield x + column * group.spacing, y + row * group.spacing
    elif group.position:
        yield group.position
    elif group.positions:
        yield from group.positions
    elif group.x and group.y:
        for _ in range(group.size):
            yield _draw(group.x, rng), _draw(group.y, rng)
    else:
        yield from _inside(scene, index, rng, crowd)


def _throws(group: BallGroup, rng: random.Random) -> Iterator[Vector]:
    yield from group.velocities or ()
    while True:
        if group.vx or group.vy:
            yield _draw(group.vx, rng) if group.vx else 0.0, _draw(group.vy, rng) if group.vy else 0.0
        elif group.speed is not None:
            angle = rng.uniform(0, 2 * math.pi)
            yield group.speed * math.cos(angle), group.speed * math.sin(angle)
        elif group.rms_speed is not None:
            sigma = group.rms_speed / math.sqrt(2)
            yield rng.gauss(0, sigma), rng.gauss(0, sigma)
        else:
            yield group.velocity or (0.0, 0.0)


class _Crowd:
    """The balls placed so far, each in all the square cells that its bounding box meets."""

    def __init__(self, scene: Scene) -> None:
        radii = [group.radius for group in scene.balls]
        self.walls = scene.walls
        self.width = max(2 * min(radii), max(radii) / 25)  # the largest ball is in some 2,500 cells
        self.cells: dict[tuple[int, int], list[tuple[float, float, float]]] = defaultdict(list)

    def _cells(self, place: Vector, radius: float) -> Iterator[tuple[int, int]]:
        columns, rows = (range(int((c - radius) // self.width), int((c + radius) // self.width) + 1) for c in place)
        return itertools.product(columns, rows)

    def add(self, place: Vector, radius: float) -> None:
        for cell in self._cells(place, radius):
            self.cells[cell].append((*place, radius))

    def has_room(self, place: Vector, radius: float) -> bool:
        for cell in self._cells(place, radius):
            for x, y, other in self.cells.get(cell, ()):
                if math.dist(place, (x, y)) < radius + other:
                    return False
        return all(
            segment_distance(np.array(place), wall.start, wall.to) >= radius + wall.thickness / 2 for wall in self.walls
        )


def _inside(scene: Scene, index: int, rng: random.Random, crowd: _Crowd) -> list[Vector]:
    """Find random places in a rectangle: wherever there is room, and in a tight crowd on a shuffled lattice.

    Placing one by one jams at about half of the area (0.547, Feder 1980); a hexagonal lattice goes to 0.907.
    """
    group = scene.balls[index]
    assert group.inside is not None
    corners = np.sort(np.array(group.inside), axis=0)
    low, high = corners[0] + group.radius, corners[1] - group.radius
    places = _one_by_one(group, low, high, rng, copy.deepcopy(crowd))
    if len(places) == group.size:
        return places
    extent = high - low
    pitch = math.sqrt(float(extent[0] * extent[1]) / group.size / math.sqrt(0.75)) + 2 * group.radius
    closest = 2 * group.radius * (1 + 1e-12)
    while True:
        pitch = max(0.98 * pitch, closest)
        sites = [site for site in _lattice(low, high, pitch) if crowd.has_room(site, group.radius)]
        if len(sites) >= group.size:
            return rng.sample(sites, group.size)
        if pitch == closest:
            raise Mistake(scene.at(("balls", index, "count"), f"is more than fit: {group.size} balls"))


def _one_by_one(group: BallGroup, low: Floats, high: Floats, rng: random.Random, crowd: _Crowd) -> list[Vector]:
    """Place balls where there is room until all are placed, or one finds none in `TRIES` tries."""
    places: list[Vector] = []
    tries = 0
    while len(places) < group.size and tries < TRIES:
        place = rng.uniform(low[0], high[0]), rng.uniform(low[1], high[1])
        tries += 1
        if crowd.has_room(place, group.radius):
            crowd.add(place, group.radius)
            places.append(place)
            tries = 0
    return places


def _lattice(low: Floats, high: Floats, pitch: float) -> Iterator[Vector]:
    """Yield the sites of a hexagonal lattice in a rectangle, rows along x."""
    for row in range(int((high[1] - low[1]) / (pitch * math.sqrt(0.75)) + ROUNDING) + 1):
        x, y = float(low[0]) + row % 2 * pitch / 2, float(low[1]) + row * pitch * math.sqrt(0.75)
        for column in range(math.floor((high[0] - x) / pitch + ROUNDING) + 1):
            yield x + column * pitch, y
