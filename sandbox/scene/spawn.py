"""The initial state of a scene: where its balls are placed, and how they are thrown."""

import itertools
import math
import random
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from sandbox.errors import SandboxError, first_errors
from sandbox.quantity import deepest_overlap, length
from sandbox.scene.balls import DECIMAL_ROUNDING
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.overlaps import balls_in_walls, check_overlaps, depth_rounding
from sandbox.scene.walls import ARENA_COUNT, Walls, segment_distance, walls_of
from sandbox.state import Bools, Floats, State
from sandbox.text import counted

MAX_TRIES: Final = 100  # random places in a row for one ball, before its group is put on a lattice instead
MAX_DRAWS: Final = 10_000  # places in a row for one ball that are in walls, before that is an error
MAX_LATTICE_SITES: Final = 400_000  # about twice MAX_BALLS
PLACES_AT_ONCE: Final = 100  # compared with all walls
AROUND: Final = tuple((column, row) for column in (-1, 0, 1) for row in (-1, 0, 1))


def spawn(scene: Scene) -> State:
    """Return the initial state of a scene: position (n, 2) px, velocity (n, 2) px/s, spin (n,) rad/s, in scene order.

    One `random.Random(scene.seed)` serves all groups in order; each ball draws x, y, vx, vy and spin in that order.
    Raises SandboxError if the balls of a group do not fit, if a ball is deeper in a wall than the arena's `overlap`, or
    if too many overlap each other.
    """
    if problems := [*balls_in_walls(scene)]:
        raise first_errors((scene.at_key(path, message) for path, message in problems), str(scene.file))
    rng = random.Random(scene.seed)
    position: list[Vector] = []
    velocity: list[Vector] = []
    spin: list[float] = []
    for index, group in enumerate(scene.balls):
        places: Iterable[Vector]
        if group.inside:
            earlier = zip(position, scene.bodies.radius.tolist(), strict=False)
            places = _pack(scene, index, rng, [*earlier])
        elif group.x:
            places = _outside_walls(scene, index, group.drawn(rng)) if scene.walls else group.drawn(rng)
        else:
            places = group.points(scene.arena.size)
        # zip alternates the draws of place, velocity and spin.
        balls = zip(places, group.thrown(rng), group.spins(rng), strict=False)
        for place, thrown, turning in itertools.islice(balls, group.ball_count):
            position.append(place)
            velocity.append(thrown)
            spin.append(turning)
    state = State(0.0, np.array(position, float), np.array(velocity, float), spin=np.array(spin, float))
    check_overlaps(scene, state.position)
    return state


def _outside_walls(scene: Scene, index: int, places: Iterable[Vector]) -> Iterator[Vector]:
    """Yield the places of a group's balls that are in no wall. Raises SandboxError if too many in a row are in one."""
    walls, radius, allowed = walls_of(scene), scene.balls[index].radius, scene.arena.overlap + depth_rounding(scene)
    yield from _free(places, lambda place: bool(_in_no_wall(walls, radius, np.array([place]), allowed)), MAX_DRAWS)
    raise SandboxError(scene.at_key(("balls", index, "x"), "and y leave hardly any place outside the walls"))


def _free(places: Iterable[Vector], is_free: Callable[[Vector], bool], tries: int) -> Iterator[Vector]:
    """Yield the places that are free, until so many in a row are not."""
    missed = 0
    for place in places:
        missed = 0 if is_free(place) else missed + 1
        if missed == 0:
            yield place
        elif missed == tries:
            return


def warnings(scene: Scene, state: State) -> Iterator[str]:
    """Yield warnings of what its author may not have meant: overlaps, and balls that move far in a step."""
    radius = scene.bodies.radius
    overlap, first, second = deepest_overlap(state.position, radius, scene.bodies.filters)
    if overlap > 0:
        overlaps = counted(check_overlaps(scene, state.position), "overlap")
        deepest = f"the deepest of balls {first} and {second} by {overlap:.3g} px"
        yield scene.at_key((), f"warning: {overlaps} at the start, {deepest}")
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


class _Packing:
    """The balls among which others of one radius (px) are placed.

    Each level has radii up to twice those of the level below, and a grid of its own. Its cells are as wide as a ball
    there and one of the radius may be apart: only those of 3 x 3 cells can overlap.
    """

    def __init__(self, radius: float, balls: Iterable[tuple[Vector, float]]) -> None:
        self._radius = radius
        self._widths: dict[int, float] = {}  # px, of the cells of each level
        self._cells = defaultdict[tuple[int, float, float], list[tuple[complex, float]]](list)
        for place, other in balls:
            self.add(place, other)

    def add(self, place: Vector, radius: float) -> None:
        """Place a ball of a radius (px), whether there is room or not."""
        x, y = place
        _, level = math.frexp(radius)
        width = self._widths.setdefault(level, self._radius + 2.0**level)
        self._cells[level, x // width, y // width].append((complex(x, y), self._radius + radius))

    def has_room(self, place: Vector) -> bool:
        """Return whether a ball at a place overlaps none of these."""
        x, y = place
        centre = complex(x, y)
        for level, width in self._widths.items():
            column, row = x // width, y // width
            for across, down in AROUND:
                for other, apart in self._cells.get((level, column + across, row + down), ()):
                    if abs(other - centre) < apart:
                        return False
        return True


def _pack(scene: Scene, index: int, rng: random.Random, balls: Sequence[tuple[Vector, float]]) -> list[Vector]:
    """Place the balls of a group at random: one by one or, if they do not fit so, on sites of a lattice.

    Placing one by one jams at about half of the area (0.547, Feder 1980); a hexagonal lattice reaches 0.907.
    balls: centres and radii of the balls of earlier groups, px.
    """
    group, walls = scene.balls[index], walls_of(scene)
    radius, count = group.radius, group.ball_count
    (x0, x1, _), (y0, y1, _) = (group.span(axis, scene.arena.size) for axis in (0, 1))
    packing, places = _Packing(radius, balls), list[Vector]()

    def is_free(place: Vector) -> bool:
        return packing.has_room(place) and bool(_in_no_wall(walls, radius, np.array([place])))

    drawn = ((rng.uniform(x0, x1), rng.uniform(y0, y1)) for _ in itertools.count())
    for place in itertools.islice(_free(drawn, is_free, MAX_TRIES), count):
        packing.add(place, radius)
        places.append(place)
    if len(places) < count:
        free = _free_sites(walls, _Packing(radius, balls), radius, count, (x0, y0), (x1, y1))
        if len(free) < count:
            raise SandboxError(scene.at_key(("balls", index, "count"), f"is too large: there is no room for {count}"))
        places = rng.sample(free, count)
    return places


def _in_no_wall(walls: Walls, radius: float, place: Floats, allowed: float = 0.0) -> Bools:
    """Return whether a ball at each place (k, 2) px would be in no wall of the scene deeper than allowed, px: (k,)."""
    if len(walls.start) == ARENA_COUNT:
        return np.ones(len(place), bool)
    start, end, half_thickness = (each[ARENA_COUNT:] for each in walls[:3])
    blocks = np.array_split(place, len(place) // PLACES_AT_ONCE + 1)
    distance = np.concatenate([segment_distance(block[:, None], start, end) for block in blocks])
    clear: Bools = (radius + half_thickness - distance <= allowed).all(axis=1)
    return clear


def _free_sites(walls: Walls, packing: _Packing, radius: float, count: int, low: Vector, high: Vector) -> list[Vector]:
    """Return the free sites of the widest lattice that has enough of them, or else of the narrowest, px."""
    width, height = high[0] - low[0], high[1] - low[1]
    pitch = math.sqrt(width * height / count / math.sqrt(0.75)) + 2 * radius
    finest = max(math.sqrt(width * height / MAX_LATTICE_SITES / math.sqrt(0.75)), (width + height) / MAX_LATTICE_SITES)
    closest = max(2 * radius * (1 + 1e-12), finest)
    while True:
        pitch = max(0.98 * pitch, closest)
        sites = _lattice(low, high, pitch)
        free = [*filter(packing.has_room, map(tuple, sites[_in_no_wall(walls, radius, sites)].tolist()))]
        if len(free) >= count or pitch == closest:
            return free


def _lattice(low: Vector, high: Vector, pitch: float) -> Floats:
    """Return the sites of a hexagonal lattice in a rectangle, rows along x: (n, 2) px."""
    row = np.arange(int((high[1] - low[1]) / (pitch * math.sqrt(0.75)) + DECIMAL_ROUNDING) + 1)
    x, y = low[0] + row % 2 * pitch / 2, low[1] + row * pitch * math.sqrt(0.75)
    columns = np.floor((high[0] - x) / pitch + DECIMAL_ROUNDING).astype(int) + 1
    column = np.arange(columns.sum()) - np.repeat(np.cumsum(columns) - columns, columns)
    return np.column_stack([np.repeat(x, columns) + column * pitch, np.repeat(y, columns)])
