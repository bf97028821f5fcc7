"""A group of balls: how many, of what kind, and how they are placed and thrown."""

import math
from collections.abc import Iterator
from random import Random
from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from sandbox.scene.elementary import logarithm, sine_cosine
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
from sandbox.scene.placement import AtPoint, AtPoints, AtRandom, OnGrid, Packed, Placement
from sandbox.scene.validation import Problem, invalid
from sandbox.state import MEETS_ALL

MAX_BALLS: Final = 200_000  # in a scene
DECIMAL_ROUNDING: Final = 1e-9  # relative error that sums of decimal fractions may have
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
    """Mass of each ball, kg; only ratios matter."""
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
    def ball_count(self) -> int:
        """The number of balls: `count`, or its default."""
        return self.placement.default_count if self.count is None else self.count

    @property
    def placement_key(self) -> str:
        """The key that sets where the balls are."""
        return next(key for key in PLACEMENT_KEYS if getattr(self, key) is not None)

    @property
    def placement(self) -> Placement:
        """How the balls are placed."""
        placement = self._placement()
        assert placement is not None
        return placement

    def _placement(self) -> Placement | None:
        if self.grid and self.spacing:
            return OnGrid(*self.grid, self.spacing, self.position)
        if self.position:
            return AtPoint(self.position)
        if self.positions:
            return AtPoints(self.positions)
        if self.x and self.y:
            return AtRandom(self.x, self.y)
        return Packed(self.inside, self.radius) if self.inside else None

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
                size, sigma = math.sqrt(-2 * logarithm(1 - rng.random())), self.rms_speed / math.sqrt(2)
                yield cosine * size * sigma, sine * size * sigma
            else:
                yield self.velocity or (0.0, 0.0)

    def spins(self, rng: Random) -> Iterator[float]:
        """Yield the angular velocities at the start, ball by ball, rad/s."""
        spin = self.spin
        while True:
            yield spin.draw(rng) if isinstance(spin, Range) else spin

    @model_validator(mode="after")
    def _check_keys_go_together(self) -> Self:
        if errors := [*self._errors()]:
            raise invalid(*errors)
        return self

    def _errors(self) -> Iterator[Problem]:
        given = {key for key, value in self if value is not None}
        placements = [key for key in PLACEMENT_KEYS if key in given and not (key == "position" and "grid" in given)]
        throws = [key for key in THROW_KEYS if key in given and not (key == "vy" and "vx" in given)]
        for keys in (placements, throws):
            for key in keys[1:]:
                yield (key,), f"cannot be combined with {keys[0]}; keep one of them"
        if not placements:
            yield (), "needs a placement: position, positions, x and y, inside, or grid with spacing"
        for key, partner in (("x", "y"), ("y", "x"), ("grid", "spacing"), ("spacing", "grid")):
            if key in given and partner not in given:
                yield (key,), f"must be given together with {partner}"
        if placement := self._placement():
            yield from placement.errors(self.ball_count)
            if self.velocities is not None and self.ball_count != len(self.velocities):
                yield ("velocities",), f"must have one entry per ball, {self.ball_count}, got {len(self.velocities)}"
        if self.colors == ():
            yield ("colors",), "must contain at least one colour"

    def errors_in(self, arena: Vector, overlap: float) -> Iterator[Problem]:
        """Yield an error if balls may be outside an arena for some seed.

        arena: its width and height, px; overlap: how deep a ball may be in its walls, px.
        """
        for axis, (name, size) in enumerate(zip("xy", arena, strict=True)):
            low, high = self.radius, size - self.radius
            if low > high:
                yield ("radius",), f"{self.radius:g} is too large for an arena of {arena[0]:g} x {arena[1]:g}"
                return
            first, last, key = self.placement.span(axis, self.ball_count, arena)
            slack = DECIMAL_ROUNDING * size + overlap
            if not (low - slack <= first and last <= high + slack):
                got = f"{name} must be from {low:g} to {high:g}, got {first if first < low else last:g}"
                yield (key,), f"puts a ball outside the arena: {got}"
