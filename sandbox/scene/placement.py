"""How the balls of a group are placed: a class for each kind of placement in a scene file."""
# ruff: noqa: D102 (the base class documents the methods)

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from random import Random
from typing import ClassVar

from sandbox.scene.fields import Range, Vector
from sandbox.scene.validation import Problem

Pack = Callable[[Vector, Vector], Iterable[Vector]]  # lowest and highest centre, px -> centres with room


class Placement(ABC):
    """Where the balls of a group are at the start. arena: its width and height, px.

    is_random: whether the places are drawn at random, which are always inside the arena.
    """

    is_random: ClassVar = False

    @property
    def default_count(self) -> int:
        """The number of balls of a group without `count`."""
        return 1

    def errors(self, count: int) -> Iterator[Problem]:
        """Yield the errors of this placement for a number of balls."""
        yield from ()

    @abstractmethod
    def span(self, axis: int, count: int, arena: Vector) -> tuple[float, float, str]:
        """Return the lowest and highest centre on an axis (0 is x), px, and the key that sets them."""

    @abstractmethod
    def positions(self, count: int, arena: Vector, rng: Random, pack: Pack) -> Iterable[Vector]:
        """Return the centres of the balls, px: at least as many as asked for."""


@dataclass(frozen=True)
class AtPoint(Placement):
    """One ball at a point."""

    position: Vector

    def errors(self, count: int) -> Iterator[Problem]:
        if count > 1:
            yield ("count",), f"puts {count} balls on one position; use positions, x and y, inside, or grid"

    def span(self, axis: int, count: int, arena: Vector) -> tuple[float, float, str]:
        return self.position[axis], self.position[axis], "position"

    def positions(self, count: int, arena: Vector, rng: Random, pack: Pack) -> Iterable[Vector]:
        return [self.position]


@dataclass(frozen=True)
class AtPoints(Placement):
    """One ball at each point."""

    points: tuple[Vector, ...]

    @property
    def default_count(self) -> int:
        return len(self.points)

    def errors(self, count: int) -> Iterator[Problem]:
        if count != self.default_count:
            yield ("count",), f"must be the number of positions, {self.default_count}, got {count}; leave it out"

    def span(self, axis: int, count: int, arena: Vector) -> tuple[float, float, str]:
        along = [point[axis] for point in self.points]
        return min(along), max(along), "positions"

    def positions(self, count: int, arena: Vector, rng: Random, pack: Pack) -> Iterable[Vector]:
        return self.points


@dataclass(frozen=True)
class AtRandom(Placement):
    """At coordinates drawn at random, in no wall; the balls may overlap each other."""

    is_random: ClassVar = True
    x: Range
    y: Range

    def span(self, axis: int, count: int, arena: Vector) -> tuple[float, float, str]:
        drawn = (self.x, self.y)[axis]
        return min(drawn.start, drawn.to), max(drawn.start, drawn.to), "xy"[axis]

    def positions(self, count: int, arena: Vector, rng: Random, pack: Pack) -> Iterator[Vector]:
        while True:
            yield self.x.draw(rng), self.y.draw(rng)


@dataclass(frozen=True)
class Packed(Placement):
    """At random places wholly inside a rectangle, overlapping neither each other nor earlier balls nor walls."""

    is_random: ClassVar = True
    corners: tuple[Vector, Vector]
    radius: float

    def errors(self, count: int) -> Iterator[Problem]:
        width, height = (abs(low - high) for low, high in zip(*self.corners, strict=True))
        if min(width, height) < 2 * self.radius:
            yield ("inside",), f"is smaller than one ball, which is {2 * self.radius:g} wide"
        elif count > _max_discs(width, height, self.radius):
            balls = f"{count} balls of radius {self.radius:g}"
            yield ("count",), f"is too large: there is no room for {balls} in {width:g} x {height:g}"

    def span(self, axis: int, count: int, arena: Vector) -> tuple[float, float, str]:
        low, high = sorted(corner[axis] for corner in self.corners)
        return low + self.radius, high - self.radius, "inside"

    def positions(self, count: int, arena: Vector, rng: Random, pack: Pack) -> Iterable[Vector]:
        (x0, x1, _), (y0, y1, _) = (self.span(axis, count, arena) for axis in (0, 1))
        return pack((x0, y0), (x1, y1))


@dataclass(frozen=True)
class OnGrid(Placement):
    """In columns and rows, filled row by row; centred in the arena unless the first ball's centre is given."""

    columns: int
    rows: int
    spacing: float
    first: Vector | None

    @property
    def default_count(self) -> int:
        return self.columns * self.rows

    def errors(self, count: int) -> Iterator[Problem]:
        if count > self.default_count:
            yield ("count",), f"must be at most {self.default_count}, the places of the grid, got {count}"

    def span(self, axis: int, count: int, arena: Vector) -> tuple[float, float, str]:
        first = self._first(arena)[axis]
        used = (min(count, self.columns), -(-count // self.columns))[axis]
        return first, first + (used - 1) * self.spacing, "position" if self.first else "grid"

    def positions(self, count: int, arena: Vector, rng: Random, pack: Pack) -> Iterator[Vector]:
        x, y = self._first(arena)
        for ball in range(count):
            row, column = divmod(ball, self.columns)
            yield x + column * self.spacing, y + row * self.spacing

    def _first(self, arena: Vector) -> Vector:
        if self.first is not None:
            return self.first
        x, y = ((size - (n - 1) * self.spacing) / 2 for size, n in zip(arena, (self.columns, self.rows), strict=True))
        return x, y


def _max_discs(width: float, height: float, radius: float) -> float:
    """Return an upper bound of how many equal discs fit in a rectangle (Oler 1961: points in a convex set)."""
    a, b, d = width - 2 * radius, height - 2 * radius, 2 * radius  # a, b: of the rectangle of the centres
    return 2 / 3**0.5 * a * b / d**2 + (a + b) / d + 1
