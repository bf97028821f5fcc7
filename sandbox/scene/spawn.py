"""The initial state of a scene: where its balls are placed, and how they are thrown."""

import math
import operator
import random
from collections import deque
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Final

import numpy as np

from sandbox.errors import SandboxError, first_errors
from sandbox.quantity import deepest_overlap, length
from sandbox.scene.balls import DECIMAL_ROUNDING
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.overlaps import balls_in_walls, check_overlaps, depth_rounding
from sandbox.scene.packing import Packing
from sandbox.scene.validation import shown_problems
from sandbox.scene.walls import depths_in_wall
from sandbox.state import Floats, State

MAX_TRIES: Final = 100  # random places in a row for one ball, before its group is put on a lattice instead
MAX_DRAWS: Final = 10_000  # places in a row for one ball that are in walls, before that is an error
MAX_LATTICE_SITES: Final = 400_000  # about twice MAX_BALLS
_recent: Final[deque[tuple[Scene, State]]] = deque(maxlen=4)  # the last ones: spawning a dense group takes seconds


def spawn(scene: Scene) -> State:
    """Return the initial state of a scene: position (n, 2) px, velocity (n, 2) px/s, spin (n,) rad/s, in scene order.

    One `random.Random(scene.seed)` serves all groups in order; each ball draws x, y, vx, vy and spin in that order.
    The arrays are the caller's own. Raises SandboxError if the balls of a group do not fit, if a ball is deeper in a
    wall than the arena's `overlap`, or if too many overlap each other.
    """
    state = next((state for earlier, state in tuple(_recent) if _spawns_alike(scene, earlier)), None)
    if state is None:
        state = _spawn(scene)
        _recent.append((scene, state))
    return state.copy()


def _spawns_alike(scene: Scene, changed: Scene) -> bool:
    """Return whether two scenes share the seed and the same arena, groups and walls, as copies by `changed` do.

    Equality is not enough, since 0.0 equals -0.0.
    """
    return (
        (scene.seed, len(scene.balls), len(scene.walls)) == (changed.seed, len(changed.balls), len(changed.walls))
        and scene.arena is changed.arena
        and all(map(operator.is_, scene.balls, changed.balls))
        and all(map(operator.is_, scene.walls, changed.walls))
    )


def _spawn(scene: Scene) -> State:
    if problems := [*balls_in_walls(scene)]:
        raise first_errors((scene.at_key(path, message) for path, message in shown_problems(problems)), str(scene.file))
    rng = random.Random(scene.seed)
    packing = Packing(scene)
    last_packed = max((index for index, group in enumerate(scene.balls) if group.inside), default=-1)
    position: list[Vector] = []
    velocity: list[Vector] = []
    spin: list[float] = []
    for index, group in enumerate(scene.balls):
        places: Iterable[Vector]
        if group.inside:
            places = _pack(scene, index, rng, packing)
        elif group.x:
            places = _outside_walls(scene, index, group.drawn(rng)) if scene.walls else group.drawn(rng)
        else:
            places = group.points(scene.arena.size)
        # zip alternates the draws of place, velocity and spin.
        balls = zip(places, group.thrown(rng), group.spins(rng), strict=False)
        for place, thrown, turning in islice(balls, group.ball_count):
            position.append(place)
            velocity.append(thrown)
            spin.append(turning)
        if index < last_packed and not group.inside:
            packing.add(np.array(position[-group.ball_count :], float), group.radius)
    state = State(0.0, np.array(position, float), np.array(velocity, float), spin=np.array(spin, float))
    try:
        check_overlaps(state.position, scene.bodies)
    except SandboxError as error:
        raise SandboxError(scene.at_key((), str(error))) from None
    return state


def _outside_walls(scene: Scene, index: int, places: Iterable[Vector]) -> Iterator[Vector]:
    """Yield the places of a group's balls that are in no wall. Raises SandboxError if too many in a row are in one."""
    radius, missed = np.array([scene.balls[index].radius]), 0
    allowed = scene.arena.overlap + depth_rounding(scene)
    for place in places:
        position = np.array([place])
        if all(depths_in_wall(wall, position, radius) <= allowed for wall in scene.walls):
            missed = 0
            yield place
        elif (missed := missed + 1) == MAX_DRAWS:
            raise SandboxError(scene.at_key(("balls", index, "x"), "and y leave hardly any place outside the walls"))


def warnings(scene: Scene, state: State) -> Iterator[str]:
    """Yield warnings of what its author may not have meant: overlaps, and balls that move far in a step."""
    radius = scene.bodies.radius
    overlap, first, second = deepest_overlap(state.position, radius, scene.bodies.filters)
    if overlap > 0:
        pairs = check_overlaps(state.position, scene.bodies)
        deepest = f"balls {first} and {second} overlap by {overlap:.3g} px"
        what = deepest if pairs == 1 else f"{pairs:,} pairs of balls overlap, the deepest: {deepest}"
        yield scene.at_key((), f"warning: {what} at the start")
    for index, wall in enumerate(scene.walls):
        depth = depths_in_wall(wall, state.position, radius)
        if (ball := int(depth.argmax())) >= 0 and depth[ball] > 0:
            yield scene.at_key(("walls", index), f"warning: overlaps ball {ball} by {depth[ball]:.3g} px at the start")
    if (enough := needed_rate(scene, state)) is not None:
        moved = length(state.velocity) / scene.rate  # px per step
        ball = int((moved / radius).argmax())
        yield scene.at_key(
            (),
            f"warning: ball {ball} moves {moved[ball]:.3g} px per step, more than its radius of {radius[ball]:g}: "
            f"time-stepped engines may miss contacts; a rate of {enough} would do",
        )


def needed_rate(scene: Scene, state: State) -> int | None:
    """Return the rate at which no ball moves by more than its radius in a step; None if the scene's is enough."""
    radii = float((length(state.velocity) / scene.bodies.radius).max()) / (1 + DECIMAL_ROUNDING)  # per second
    return math.ceil(radii) if radii > scene.rate else None


def _pack(scene: Scene, index: int, rng: random.Random, packing: Packing) -> list[Vector]:
    """Place the balls of a group at random: one by one or, if they do not fit so, on sites of a lattice.

    Placing one by one jams at about half of the area (0.547, Feder 1980); a hexagonal lattice reaches 0.907.
    """
    group = scene.balls[index]
    radius, count = group.radius, group.ball_count
    (x0, x1, _), (y0, y1, _) = (group.span(axis, scene.arena.size) for axis in (0, 1))
    low, high = (x0, y0), (x1, y1)  # opposite corners of the rectangle of the centres, px
    places = _one_by_one(packing, radius, count, low, high, rng)
    if len(places) < count:
        packing.keep_first(len(packing) - len(places))
        free = _free_sites(packing, radius, count, low, high)
        if len(free) < count:
            raise SandboxError(scene.at_key(("balls", index, "count"), f"is too large: there is no room for {count}"))
        places = free[rng.sample(range(len(free)), count)]
        packing.add(places, radius)
    drawn: list[Vector] = places.tolist()
    return drawn


def _one_by_one(packing: Packing, radius: float, count: int, low: Vector, high: Vector, rng: random.Random) -> Floats:
    """Place balls where there is room until all are placed, or one had no room in `MAX_TRIES` tries: (n, 2) px."""
    before, missed = len(packing), 0
    while (wanted := count - (len(packing) - before)) and missed < MAX_TRIES:
        drawn, state = max(wanted, MAX_TRIES), rng.getstate()
        tried, missed = packing.add_some(_anywhere(low, high, drawn, rng), radius, wanted, missed, MAX_TRIES)
        if tried < drawn:  # the generator continues after the last place that was tried
            rng.setstate(state)
            _anywhere(low, high, tried, rng)
    return packing.place[before:]


def _anywhere(low: Vector, high: Vector, count: int, rng: random.Random) -> Floats:
    """Draw points in a rectangle, x before y: (n, 2) px."""
    (x0, y0), (x1, y1) = low, high
    return np.array([(rng.uniform(x0, x1), rng.uniform(y0, y1)) for _ in range(count)])


def _free_sites(packing: Packing, radius: float, count: int, low: Vector, high: Vector) -> Floats:
    """Return the free sites of the widest lattice that has enough of them, or else of the narrowest: (n, 2) px."""
    width, height = high[0] - low[0], high[1] - low[1]
    pitch = math.sqrt(width * height / count / math.sqrt(0.75)) + 2 * radius
    finest = max(math.sqrt(width * height / MAX_LATTICE_SITES / math.sqrt(0.75)), (width + height) / MAX_LATTICE_SITES)
    closest = max(2 * radius * (1 + 1e-12), finest)
    while True:
        pitch = max(0.98 * pitch, closest)
        sites = _lattice(low, high, pitch)
        free: Floats = sites[packing.has_room(sites, radius)]
        if len(free) >= count or pitch == closest:
            return free


def _lattice(low: Vector, high: Vector, pitch: float) -> Floats:
    """Return the sites of a hexagonal lattice in a rectangle, rows along x: (n, 2) px."""
    row = np.arange(int((high[1] - low[1]) / (pitch * math.sqrt(0.75)) + DECIMAL_ROUNDING) + 1)
    x, y = low[0] + row % 2 * pitch / 2, low[1] + row * pitch * math.sqrt(0.75)
    columns = np.floor((high[0] - x) / pitch + DECIMAL_ROUNDING).astype(int) + 1
    column = np.arange(columns.sum()) - np.repeat(np.cumsum(columns) - columns, columns)
    return np.column_stack([np.repeat(x, columns) + column * pitch, np.repeat(y, columns)])
