"""A scene and its seed -> the initial state."""

import math
import random
from collections.abc import Iterator
from typing import Final

import numpy as np

from sandbox.errors import SandboxError
from sandbox.quantity import deepest_overlap, length, segment_distance
from sandbox.scene.model import ROUNDING, BallGroup, Range, Scene, Vector
from sandbox.scene.packing import Crowd, empty_crowd, forget, have_room, place_all, place_some, placed
from sandbox.state import Floats, State

TRIES: Final = 100  # random places tried for a ball before its group is put on a lattice instead
MOST_SITES: Final = 400_000  # of a lattice, about: twice as many as there can be balls


def spawn(scene: Scene) -> State:
    """Place and throw the balls of a scene, as its seed has it.

    One `random.Random(seed)` serves all groups in order; a ball takes from it x, y, vx, vy in that order.
    The scene keeps what was found; what is returned is the caller's own. Raises SandboxError if the balls of a group
    do not fit.
    """
    source = (scene.seed, scene.balls, scene.arena, scene.walls)
    if scene._spawned is None or scene._spawned[0] != source:
        scene._spawned = source, _spawn(scene)
    drawn = scene._spawned[1]
    return State(0.0, drawn.position.copy(), drawn.velocity.copy())


def _spawn(scene: Scene) -> State:
    rng = random.Random(scene.seed)
    crowd = empty_crowd(scene)
    last = max((index for index, group in enumerate(scene.balls) if group.inside), default=-1)  # that needs the crowd
    position: list[Vector] = []
    velocity: list[Vector] = []
    for index, group in enumerate(scene.balls):
        place = _places(scene, index, rng, crowd)
        throw = _throws(group, rng)
        for _ in range(group.size):
            position.append(next(place))
            velocity.append(next(throw))
        if index < last and not group.inside:
            place_all(crowd, np.array(position[-group.size :], float), group.radius)
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


def _places(scene: Scene, index: int, rng: random.Random, crowd: Crowd) -> Iterator[Vector]:
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


def _inside(scene: Scene, index: int, rng: random.Random, crowd: Crowd) -> list[Vector]:
    """Place balls at random in a rectangle: wherever there is room, and in a tight crowd on a shuffled lattice.

    Placing one by one jams at about half of the area (0.547, Feder 1980); a hexagonal lattice goes to 0.907.
    """
    group = scene.balls[index]
    assert group.inside is not None
    corners = np.sort(np.array(group.inside), axis=0)
    low, high = corners[0] + group.radius, corners[1] - group.radius
    places = _one_by_one(group, low, high, rng, crowd)
    if len(places) < group.size:
        forget(crowd, placed(crowd) - len(places))
        free = _free_sites(scene, index, low, high, crowd)
        places = free[rng.sample(range(len(free)), group.size)]
        place_all(crowd, places, group.radius)
    found: list[Vector] = places.tolist()
    return found


def _one_by_one(group: BallGroup, low: Floats, high: Floats, rng: random.Random, crowd: Crowd) -> Floats:
    """Place balls where there is room until all are placed, or one finds none in `TRIES` tries: (n, 2) px."""
    before, missed = placed(crowd), 0
    while (wanted := group.size - (placed(crowd) - before)) and missed < TRIES:
        drawn, state = max(wanted, TRIES), rng.getstate()
        looked, missed = place_some(crowd, _anywhere(low, high, drawn, rng), group.radius, wanted, missed, TRIES)
        if looked < drawn:  # the generator goes on after the last that was looked at
            rng.setstate(state)
            _anywhere(low, high, looked, rng)
    return crowd.ball[before : placed(crowd), :2].copy()


def _anywhere(low: Floats, high: Floats, count: int, rng: random.Random) -> Floats:
    (x0, x1), (y0, y1) = zip(low.tolist(), high.tolist(), strict=True)
    return np.array([(rng.uniform(x0, x1), rng.uniform(y0, y1)) for _ in range(count)])


def _free_sites(scene: Scene, index: int, low: Floats, high: Floats, crowd: Crowd) -> Floats:
    """Find the free sites of the widest lattice that has enough of them: (n, 2) px."""
    group = scene.balls[index]
    width, height = (high - low).tolist()
    pitch = math.sqrt(width * height / group.size / math.sqrt(0.75)) + 2 * group.radius
    finest = max(math.sqrt(width * height / MOST_SITES / math.sqrt(0.75)), (width + height) / MOST_SITES)
    closest = max(2 * group.radius * (1 + 1e-12), finest)
    while True:
        pitch = max(0.98 * pitch, closest)
        sites = _lattice(low, high, pitch)
        free: Floats = sites[have_room(crowd, sites, group.radius)]
        if len(free) >= group.size:
            return free
        if pitch == closest:
            raise SandboxError(scene.at(("balls", index, "count"), f"is more than fit: {group.size} balls"))


def _lattice(low: Floats, high: Floats, pitch: float) -> Floats:
    """Return the sites of a hexagonal lattice in a rectangle, rows along x: (n, 2) px."""
    row = np.arange(int((high[1] - low[1]) / (pitch * math.sqrt(0.75)) + ROUNDING) + 1)
    x, y = low[0] + row % 2 * pitch / 2, low[1] + row * pitch * math.sqrt(0.75)
    columns = np.floor((high[0] - x) / pitch + ROUNDING).astype(int) + 1
    column = np.arange(columns.sum()) - np.repeat(np.cumsum(columns) - columns, columns)
    return np.column_stack([np.repeat(x, columns) + column * pitch, np.repeat(y, columns)])
