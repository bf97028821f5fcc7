"""The model of a scene: its tables, their keys and defaults, and which values are allowed."""

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Self

import numpy as np
from pydantic import Field, PrivateAttr, Strict, ValidationError, model_validator

from sandbox.errors import KeyPath
from sandbox.scene.balls import MAX_BALLS, BallGroup
from sandbox.scene.clock import Clock
from sandbox.scene.fields import (
    PALETTE,
    Colour,
    Count,
    Elasticity,
    Index,
    Model,
    NotNegative,
    NotTiny,
    Number,
    Positive,
    Text,
    Title,
    Vector,
)
from sandbox.scene.toml_lines import Source
from sandbox.scene.units import PIXELS, Units
from sandbox.scene.validation import Problem, sandbox_error
from sandbox.state import Bodies
from sandbox.text import counted, printable

MAX_WALLS: Final = 1_000  # each is compared with each ball
MIN_LENGTH: Final = 1e-6  # px, of a wall that is no peg
MAX_STEPS: Final = 10_000_000
ARENA_WALLS: Final = ("left", "top", "right", "bottom")  # walls 0 to 3; the scene's own follow


class Arena(Model):
    """The view, and the box around the balls: its edges are four static walls, unless `walls` is false."""

    size: tuple[NotTiny, NotTiny]
    """Width and height, px."""
    walls: Annotated[bool, Strict()] = True
    """Whether the four walls stand; without them the arena is only the view, and balls may be outside it."""
    elasticity: Elasticity = 1
    """The four walls' factor: the elasticity of a contact is the product of the wall's and the ball's."""
    friction: NotNegative = 0
    """The four walls' factor: the friction of a contact is the product of the wall's and the ball's."""
    background: Colour = "white"
    """A CSS colour name or #rrggbb."""
    overlap: NotNegative = 0
    """Largest depth of a ball in a wall at the start, px; scenes saved in mid-run may need it."""

    def nearest_inside(self, position: Sequence[float], margin: float = 0.0) -> Vector:
        """Return the position nearest to another that is inside, at least a margin from the edges, px."""
        x, y = (min(max(to, margin), side - margin) for to, side in zip(position, self.size, strict=True))
        return x, y


class Wall(Model):
    """A static wall inside the arena: a segment with round ends; a peg, which is a circle, if both are one point."""

    start: Vector = Field(validation_alias="from", serialization_alias="from")
    """One end, px."""
    to: Vector
    """The other end, px."""
    thickness: NotNegative = 4
    """Full thickness, px: half of it on either side of the segment."""
    elasticity: Elasticity = 1
    """The wall's factor: the elasticity of a contact is the product of the wall's and the ball's."""
    friction: NotNegative = 0
    """The wall's factor: the friction of a contact is the product of the wall's and the ball's."""

    joined: Annotated[bool, Strict()] = False
    """Whether it continues the joined wall before it: Pymunk then ignores the crack between the two."""

    def problems(self) -> Iterator[Problem]:
        """Yield what is wrong in the wall's length."""
        if self.start is None or self.to is None:
            return
        if self.is_peg and self.thickness == 0:
            yield ("thickness",), "must be greater than 0 where to is the same point as from"
        if self.is_peg and self.joined:
            yield ("joined",), "requires that from and to are not the same point"
        if not self.is_peg and math.dist(self.start, self.to) < MIN_LENGTH:
            yield ("to",), "is nearly the same point as from; only at the same point, the wall is a peg"

    @property
    def is_peg(self) -> bool:
        """Whether it has no length: a circle, as wide as it is thick."""
        return self.start == self.to


class Pegs(Model):
    """Static circles of one size: in a scene, walls whose ends are one point, after its other walls."""

    radius: NotTiny
    """Radius of each peg, px."""
    positions: Annotated[tuple[Vector, ...], Field(min_length=1, max_length=MAX_WALLS)]
    """Centres, px."""
    elasticity: Elasticity = 1
    """Each peg's factor: the elasticity of a contact is the product of the peg's and the ball's."""
    friction: NotNegative = 0
    """Each peg's factor: the friction of a contact is the product of the peg's and the ball's."""

    @property
    def walls(self) -> Iterator[Wall]:
        """The pegs as walls."""
        for at in self.positions:
            yield Wall(start=at, to=at, thickness=2 * self.radius, elasticity=self.elasticity, friction=self.friction)


class PymunkSettings(Model):
    """Settings of the `pymunk.Space`; by default Pymunk's own."""

    iterations: Count | None = None
    """Iterations of the impulse solver in each call of `Space.step`."""
    substeps: Count = 1
    """Calls of `Space.step` in each step of the scene."""
    collision_slop: NotNegative | None = None
    """Overlap that Pymunk does not correct, px."""
    collision_bias: Annotated[Number, Field(ge=0, le=1)] | None = None
    """Share of an overlap that is left after one second."""
    collision_persistence: Annotated[Index, Field(le=1_000_000)] | None = None
    """Number of steps for which the solution of a contact is kept."""
    damping: Annotated[Number, Field(gt=0, le=1)] | None = None
    """Share of each velocity and spin that is left after one second of flight; 1 is no damping."""
    sleep_time_threshold: Positive | None = None
    """Time after which bodies that hardly move fall asleep, s; by default they do not."""
    idle_speed_threshold: NotNegative | None = None
    """Speed below which a body hardly moves, px/s; 0 is a speed that depends on gravity."""
    walls_first: Annotated[Index, Field(le=1)] = 0
    """1 if walls are added to the Space before balls, else 0; contacts of a step are solved in another order then."""


# Those that are attributes of a Space too; without a value it keeps Pymunk's own.
SPACE_SETTINGS: Final = tuple(name for name, field in PymunkSettings.model_fields.items() if field.default is None)


class Columns(Model):
    """How balls are distributed over columns of equal width, side by side, by where their centres are."""

    start: Number = Field(validation_alias="from", serialization_alias="from")
    """Left edge of the first column, px."""
    to: Number
    """Right edge of the last column, px."""
    shares: Annotated[tuple[NotNegative, ...], Field(min_length=1, max_length=1_000)]
    """Share of the balls in each column, from the left; only ratios matter."""

    def problems(self) -> Iterator[Problem]:
        """Yield why there is no column, or no ball in any."""
        if self.start is not None and self.to is not None and self.start >= self.to:
            yield ("to",), f"must be greater than from, {self.start:g}, got {self.to:g}"
        if self.shares is not None and not any(self.shares):
            yield ("shares",), "must contain a number greater than 0"


class Expect(Model):
    """A prediction of a law of physics for a time: for one ball, or for all together."""

    at: NotNegative
    """Time, s; if it is between two steps, the expectation is skipped."""
    ball: Index | None = None
    """Number of the ball, from 0 in scene order; requires position, velocity or spin."""
    position: Vector | None = None
    """Position of the ball, px."""
    velocity: Vector | None = None
    """Velocity of the ball, px/s."""
    spin: Number | None = None
    """Angular velocity of the ball, rad/s; positive is clockwise on the screen."""
    energy_ratio: NotNegative | None = None
    """1 + the change of the energy since the start, as a share of the largest kinetic energy in the run."""
    momentum: Vector | None = None
    """Momentum of all balls, kg px/s."""
    centre_of_mass: Vector | None = None
    """Centre of mass of all balls, px."""
    overlap: NotNegative | None = None
    """Deepest overlap of two balls, or of a ball and a wall, px."""
    columns: Columns | None = None
    """Shares of the balls in columns; the error is the largest of the shares up to a column (Kolmogorov, Smirnov)."""
    tolerance: Positive
    """Largest error that passes, in the unit of the expected value."""
    because: Text
    """The law that predicts it."""

    def problems(self) -> Iterator[Problem]:
        """Yield what is missing to expect something, of one ball or of all."""
        given = {key for key, value in self if value is not None} | self._invalid
        of_ball = given & {"position", "velocity", "spin"}
        keys = ("energy_ratio", "momentum", "centre_of_mass", "overlap", "columns")
        of_all = [key for key in keys if key in given]
        if not self._may_lack_keys:
            return
        if not of_ball and not of_all:
            yield (), f"must contain position, velocity, spin, {', '.join(keys[:-1])} or {keys[-1]}"
        elif of_ball and "ball" not in given:
            yield ("ball",), "is missing; position, velocity and spin are those of one ball"
        elif not of_ball and "ball" in given:
            yield ("ball",), f"requires position, velocity or spin; {of_all[0]} is of all balls"


class Scene(Model):
    """Balls, walls and gravity, which several engines run side by side.

    Lengths are in px, times in s, masses in kg; y points down. Tables may be dictionaries, as in a file, or models.
    Raises SandboxError with every error, a line each.

    >>> scene = Scene(arena={"size": (800, 600)}, balls=[BallGroup(radius=20, position=(400, 300))], gravity=(0, 900))
    >>> len(scene.bodies), scene.steps
    (1, 1200)
    """

    title: Title = ""
    """Title in the window and the report, on one line."""
    about: Text = ""
    """Why the scene is worth watching."""
    topic: Title = ""
    """Under which the window lists the scene, on one line."""
    rate: Count = 60
    """Steps per second."""
    seconds: Positive = 20
    """Duration of a comparison, s."""
    seed: Index = 0
    """Seed of everything that is drawn at random."""
    gravity: Vector = (0, 0)
    """Acceleration of all balls, px/s², y down."""
    arena: Arena
    balls: tuple[BallGroup, ...]
    walls: Annotated[tuple[Wall, ...], Field(max_length=MAX_WALLS)] = ()
    pegs: tuple[Pegs, ...] = ()
    """Pegs to add to the walls; empty once they are among them."""
    units: Units = PIXELS
    pymunk: PymunkSettings = PymunkSettings()
    expect: tuple[Expect, ...] = ()

    _source: Source = PrivateAttr(Source())

    if TYPE_CHECKING:  # pydantic accepts dictionaries and lists, which its own hints reject

        def __init__(self, **values: object) -> None: ...

    def problems(self) -> Iterator[Problem]:
        """Yield what is wrong in tables together."""
        arena = self.arena
        for index, group in enumerate(self.balls or ()):
            is_inside = arena and (arena.walls or group.is_drawn)  # or may be anywhere
            if is_inside and group.is_placed and group.radius:
                problems = group.problems_in(arena.size, arena.overlap or 0.0)
                yield from ((("balls", index, *path), message) for path, message in problems)
        if self.balls is not None and all(group.is_placed for group in self.balls):
            yield from self._problems_of_count(sum(group.ball_count for group in self.balls))
        count = len(self.walls or ()) + sum(len(group.positions or ()) for group in self.pegs or ())
        if self.pegs and count > MAX_WALLS:
            yield ("pegs",), f"and walls must be at most {MAX_WALLS} together, got {count}"
        if self.seconds and self.rate:
            if self.seconds * self.rate > MAX_STEPS:
                most = f"{MAX_STEPS / self.rate:g} at this rate"
                yield ("seconds",), f"must be at most {most}, got {self.seconds:g}"
            elif Clock(self.rate).step(self.seconds) < 1:
                yield ("seconds",), f"must be at least one step, {1 / self.rate:g} s, got {self.seconds:g}"

    def _problems_of_count(self, balls: int) -> Iterator[Problem]:
        if balls == 0:
            yield ("balls",), "must contain at least one ball"
        elif balls > MAX_BALLS:
            yield ("balls",), f"must contain at most {MAX_BALLS} balls in all, got {balls}"
        for index, expected in enumerate(self.expect or ()):
            if expected.ball is not None and expected.ball >= balls > 0:
                yield ("expect", index, "ball"), f"must be at most {balls - 1}, got {expected.ball}"

    def problems_of_file(self) -> Iterator[Problem]:
        """Yield what is wrong in a file, but not where a run is shorter than its scene."""
        for index, expected in enumerate(self.expect or ()):
            if self.seconds and (expected.at or 0) > self.seconds:
                message = f"must be at most {self.seconds:g}, the seconds of the run, got {expected.at:g}"
                yield ("expect", index, "at"), message

    @model_validator(mode="after")
    def _make_pegs_walls(self) -> Self:
        self.__dict__.update(walls=(*self.walls, *(wall for group in self.pegs for wall in group.walls)), pegs=())
        return self

    def __repr__(self) -> str:
        return f"<Scene {self.name}: {counted(len(self.bodies), 'ball')}, {self.seconds:g} s {self.clock}>"

    __str__ = __repr__

    def changed(self, **changes: object) -> Self:
        """Return a copy with other values: `scene.changed(seed=3, seconds=5.0)`.

        Raises SandboxError for a value that a scene file may not have either.
        """
        values = {key: getattr(self, key) for key in type(self).model_fields} | changes
        try:
            scene = type(self).model_validate(values)
        except ValidationError as error:
            raise sandbox_error(error, type(self)) from None
        scene._source = self._source
        return scene

    @property
    def source(self) -> str:
        """The text that the scene was read from; empty if it was built in Python."""
        return self._source.text

    @property
    def file(self) -> Path:
        """The file that the scene was read from; "scene" if it was built in Python."""
        return Path(self._source.file)

    @property
    def name(self) -> str:
        """The name of the scene's file, printable and without the ending."""
        return printable(self.file.stem)

    def at_key(self, path: KeyPath, message: str) -> str:
        """Return a message about a key of the scene, with its file and line: `file:line: key message`."""
        return self._source.at_key(path, message)

    @property
    def clock(self) -> Clock:
        """The times of its steps."""
        return Clock(self.rate)

    @property
    def steps(self) -> int:
        """The number of steps in `seconds`."""
        return self.clock.step(self.seconds)

    @cached_property
    def bodies(self) -> Bodies:
        """The balls' constants, one entry per ball in scene order: (n,) each."""
        sizes = [group.ball_count for group in self.balls]

        def each(key: str) -> np.ndarray[Any, np.dtype[np.float64]]:
            return np.repeat([float(getattr(group, key)) for group in self.balls], sizes)

        filters = np.array([[*dict(group.filter).values()] for group in self.balls], np.int64)
        constants = each("radius"), each("mass"), each("elasticity"), each("friction")
        return Bodies(*constants, np.repeat(filters, sizes, axis=0))

    @property
    def surfaces(self) -> tuple[Arena | Wall, ...]:
        """The models with the elasticity and friction of walls: the arena, if its walls stand, and the scene's own."""
        return (self.arena, *self.walls) if self.arena.walls else self.walls

    @property
    def wall_numbers(self) -> range:
        """Numbers of the walls that stand: 0 to 3 are the arena's, the scene's own follow."""
        return range(0 if self.arena.walls else len(ARENA_WALLS), len(ARENA_WALLS) + len(self.walls))

    @cached_property
    def is_rough(self) -> bool:
        """Whether two things that can touch have friction, which is the product of their factors."""
        balls = np.count_nonzero(self.bodies.friction)
        return bool(balls > 1 or (balls == 1 and any(wall.friction for wall in self.surfaces)))

    @cached_property
    def keeps_energy(self) -> bool:
        """Whether no contact takes or gives energy, so that it is known beyond every horizon."""
        factors = [*(wall.elasticity for wall in self.surfaces), *self.bodies.elasticity]
        return all(factor == 1 for factor in factors) and not self.bodies.friction.any()

    @property
    def turns(self) -> bool:
        """Whether balls can turn: they do at the start, or friction can make them."""
        return self.is_rough or any(group.spin for group in self.balls)

    @cached_property
    def colors(self) -> tuple[str, ...]:
        """Colour of each ball in scene order; groups without colours have the palette's in turn."""
        colors: list[str] = []
        for index, group in enumerate(self.balls):
            in_turn = group.colors or (PALETTE[index % len(PALETTE)],)
            colors += itertools.islice(itertools.cycle(in_turn), group.ball_count)
        return tuple(colors)

    def wall_name(self, wall: int) -> str:
        """Return the name of a wall in messages, by its number, see `wall_numbers`."""
        return f"the {ARENA_WALLS[wall]} wall" if wall < len(ARENA_WALLS) else f"wall {wall - len(ARENA_WALLS)}"
