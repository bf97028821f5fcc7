"""A group of balls: how many, of what kind, and how they are placed and thrown."""

import math
from collections.abc import Iterator, Sequence
from decimal import Context, Decimal
from random import Random
from typing import Annotated, Final

from pydantic import Field

from sandbox.scene.fields import (
    Bits,
    Colour,
    Count,
    Elasticity,
    Index,
    Model,
    NotNegative,
    NotTiny,
    NumberOrRange,
    Range,
    Vector,
)
from sandbox.scene.validation import Problem
from sandbox.state import MEETS_ALL

MAX_BALLS: Final = 200_000  # in a scene
DECIMAL_ROUNDING: Final = 1e-9  # relative error that sums of decimal fractions may have
BITS: Final = 160  # numbers as small as 2^-53 still have more of them than a float
ONE: Final = 1 << BITS
PRECISE: Final = Context(prec=30)  # decimals
TERMS: Final = 70  # of the series: the next is below 2^-BITS
PER_BALL: Final = ("positions", "velocities")  # keys that list a value for each ball of a group
PLACEMENT_KEYS: Final = ("position", "positions", "x", "inside", "grid")
THROW_KEYS: Final = ("velocity", "velocities", "vx", "vy", "speed", "rms_speed")


class Filter(Model):
    """Which balls pass through each other, with the three keys of a `pymunk.ShapeFilter`."""

    group: Index = MEETS_ALL[0]
    """Balls with the same group pass through each other, unless it is 0."""
    categories: Bits = MEETS_ALL[1]
    """Categories of the ball, a bit for each of 32: `0b101` is the first and the third."""
    mask: Bits = MEETS_ALL[2]
    """Categories that the ball collides with; two balls collide if each mask has a category of the other."""


class BallGroup(Model):
    """Balls of one size, placed and thrown in one way. The scene's balls are those of its groups, in order."""

    count: Annotated[Count, Field(le=MAX_BALLS)] | None = None
    """Number of balls; by default as many as there are positions or places in the grid, otherwise 1."""
    radius: NotTiny
    """Radius of each ball, px."""
    mass: NotTiny = 1
    """Mass of each ball, kg; the motion depends on ratios only."""
    elasticity: Elasticity = 1
    """The ball's factor: the elasticity of a pair is the product of its two factors."""
    friction: NotNegative = 0
    """The ball's factor: the friction of a pair is the product of its two factors."""
    filter: Filter = Filter()
    """Which other balls it passes through, as `pymunk.ShapeFilter` has it: group, categories, mask."""
    colors: tuple[Colour, ...] | None = None
    """CSS colour names or #rrggbb, taken in turn."""
    position: Vector | None = None
    """Centre of the ball, px; with grid, the centre of its first ball."""
    positions: Annotated[tuple[Vector, ...], Field(min_length=1, max_length=MAX_BALLS)] | None = None
    """Centres of the balls, px: one per ball."""
    x: Range | None = None
    """Centres drawn at random, px. Requires y."""
    y: Range | None = None
    """Centres drawn at random, px. Requires x."""
    inside: tuple[Vector, Vector] | None = None
    """Two opposite corners of a rectangle, px: the balls are at random places wholly inside it, without overlaps."""
    grid: tuple[Count, Count] | None = None
    """Number of columns and rows, filled row by row. Requires spacing."""
    spacing: NotTiny | None = None
    """Distance between neighbouring centres of a grid, px."""
    velocity: Vector | None = None
    """Velocity of every ball, px/s."""
    velocities: tuple[Vector, ...] | None = None
    """Velocities of the balls, px/s: one per ball."""
    vx: Range | None = None
    """Horizontal velocity drawn at random, px/s; 0 if only vy is given."""
    vy: Range | None = None
    """Vertical velocity drawn at random, px/s; 0 if only vx is given."""
    speed: NotNegative | None = None
    """Speed of every ball in a direction drawn at random, px/s."""
    rms_speed: NotNegative | None = None
    """Root mean square speed, px/s: both components are drawn from a normal distribution."""
    spin: NumberOrRange = 0
    """Angular velocity, rad/s, of every ball or drawn at random; positive is clockwise on the screen."""

    @property
    def placement_key(self) -> str:
        """The key that sets where the balls are: of several, the one with the most balls; empty if none is valid."""
        if self.grid and self.spacing:
            return "grid"
        if self.positions or self.position:
            return "positions" if self.positions else "position"
        if self.x and self.y:
            return "x"
        return "inside" if self.inside and self.radius else ""

    @property
    def is_placed(self) -> bool:
        """Whether it is known where its balls are and how many, as of every group without errors."""
        return bool(self.placement_key) and "count" not in self._invalid

    @property
    def is_drawn(self) -> bool:
        """Whether its balls are placed at random, always inside the arena and in no wall."""
        return self.placement_key in ("x", "inside")

    @property
    def ball_count(self) -> int:
        """The number of balls: `count`, or as many as there are places, or 1."""
        return self._places if self.count is None else self.count

    @property
    def _places(self) -> int:
        if self.grid and self.spacing:
            return math.prod(self.grid)
        return len(self.positions) if self.positions else 1

    def _first(self, arena: Vector) -> Vector:
        """Return the centre of the first ball of a grid, px."""
        columns_and_rows, spacing = self.grid or (1, 1), self.spacing or 0.0
        x, y = ((size - (n - 1) * spacing) / 2 for size, n in zip(arena, columns_and_rows, strict=True))
        return self.position or (x, y)

    def span(self, axis: int, arena: Vector) -> tuple[float, float, str]:
        """Return the lowest and highest centre on an axis (0 is x), px, and the key that sets them.

        arena: its width and height, px.
        """
        if self.grid and self.spacing:
            first, columns = self._first(arena)[axis], self.grid[0]
            used = (min(self.ball_count, columns), -(-self.ball_count // columns))[axis]
            return first, first + (used - 1) * self.spacing, "position" if self.position else "grid"
        if self.x and self.y:
            drawn = (self.x, self.y)[axis]
            return min(drawn.start, drawn.to), max(drawn.start, drawn.to), "xy"[axis]
        if self.inside and self.placement_key == "inside":
            low, high = sorted(corner[axis] for corner in self.inside)
            return low + self.radius, high - self.radius, "inside"
        along = [point[axis] for point in self.points(arena)]
        return min(along), max(along), self.placement_key

    def points(self, arena: Vector) -> Sequence[Vector]:
        """Return the centres of balls that are not placed at random, px. arena: its width and height, px."""
        if not (self.grid and self.spacing):
            return self.positions or ((self.position,) if self.position else ())
        x, y = self._first(arena)
        places = (divmod(ball, self.grid[0]) for ball in range(self.ball_count))
        return [(x + column * self.spacing, y + row * self.spacing) for row, column in places]

    def drawn(self, rng: Random) -> Iterator[Vector]:
        """Yield centres drawn from x and y, px."""
        while self.x and self.y:
            yield self.x.draw(rng), self.y.draw(rng)

    def thrown(self, rng: Random) -> Iterator[Vector]:
        """Yield the velocities at the start, ball by ball, px/s."""
        if self.velocities is not None:
            yield from self.velocities
            return
        while True:
            if self.vx or self.vy:
                yield self.vx.draw(rng) if self.vx else 0.0, self.vy.draw(rng) if self.vy else 0.0
            elif self.speed is not None:
                sine, cosine = sine_cosine(rng.uniform(0, 2 * math.pi))
                yield self.speed * cosine, self.speed * sine
            elif self.rms_speed is not None:  # by the rule of Box and Muller, as `Random.gauss` draws them
                sine, cosine = sine_cosine(rng.random() * 2 * math.pi)
                logarithm = float(Decimal(1 - rng.random()).ln(PRECISE))
                size, sigma = math.sqrt(-2 * logarithm), self.rms_speed / math.sqrt(2)
                yield cosine * size * sigma, sine * size * sigma
            else:
                yield self.velocity or (0.0, 0.0)

    def spins(self, rng: Random) -> Iterator[float]:
        """Yield the angular velocities at the start, ball by ball, rad/s."""
        spin = self.spin
        while True:
            yield spin.draw(rng) if isinstance(spin, Range) else spin

    def problems(self) -> Iterator[Problem]:
        """Yield what is wrong in keys together."""
        given = {key for key, value in self if value is not None} | self._invalid
        placements = [key for key in PLACEMENT_KEYS if key in given and not (key == "position" and "grid" in given)]
        throws = [key for key in THROW_KEYS if key in given and not (key == "vy" and "vx" in given)]
        for keys in (placements, throws):
            for key in keys[1:]:
                yield (key,), f"cannot be combined with {keys[0]}; keep one of them"
        if not placements and self._may_lack_keys:
            yield (), "needs a placement: position, positions, x and y, inside, or grid with spacing"
        for key, partner in (("x", "y"), ("y", "x"), ("grid", "spacing"), ("spacing", "grid")):
            if key in given and partner not in given and self._may_lack_keys:
                yield (key,), f"must be given together with {partner}"
        if self.colors == ():
            yield ("colors",), "must contain at least one colour"
        if self.is_placed:
            yield from self._problems_of_count()

    def _problems_of_count(self) -> Iterator[Problem]:
        key, count = self.placement_key, self.ball_count
        if not self.is_drawn and (count > self._places or (key != "grid" and count < self._places)):
            most = "at most " if key == "grid" else ""
            yield ("count",), f"must be {most}{self._places}, the number of places in {key}, got {count}"
        if key == "inside" and self.inside:
            width, height = (abs(low - high) for low, high in zip(*self.inside, strict=True))
            if min(width, height) < 2 * self.radius:
                yield ("inside",), f"is smaller than one ball, which is {2 * self.radius:g} wide"
        if self.velocities is not None and count != len(self.velocities):
            yield ("velocities",), f"must have one entry per ball, {count}, got {len(self.velocities)}"

    def problems_in(self, arena: Vector, overlap: float) -> Iterator[Problem]:
        """Yield an error if balls may be outside an arena for some seed.

        arena: its width and height, px; overlap: how deep a ball may be in its walls, px.
        """
        for axis, (name, size) in enumerate(zip("xy", arena, strict=True)):
            low, high = self.radius, size - self.radius
            if low > high:
                yield ("radius",), f"{self.radius:g} is too large for an arena of {arena[0]:g} x {arena[1]:g}"
                return
            first, last, key = self.span(axis, arena)
            slack = DECIMAL_ROUNDING * size + overlap
            if not (low - slack <= first and last <= high + slack):
                got = f"{name} must be from {low:g} to {high:g}, got {first if first < low else last:g}"
                yield (key,), f"puts a ball outside the arena: {got}"


# The C library's sine, cosine and logarithm differ from one machine to the next; these and Decimal's do not.


def sine_cosine(angle: float) -> tuple[float, float]:
    """Return the sine and the cosine of an angle of at most a turn, rad, rounded correctly.

    They are sums of their series, in whole numbers of 2^-BITS.
    """
    numerator, denominator = angle.as_integer_ratio()
    x, term, sums = numerator * ONE // denominator, ONE, [0] * 4  # sums: of x^k / k!, by the remainder of k / 4
    for k in range(TERMS):
        sums[k % 4] += term
        term = (term * x >> BITS) // (k + 1)
    return (sums[1] - sums[3]) / ONE, (sums[0] - sums[2]) / ONE
