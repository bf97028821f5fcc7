"""The model of a scene, and the only reader and writer of its TOML.

A scene is checked whole before anything runs: `load` finds every mistake in the file and raises them
together, each with its line.
"""

import difflib
import itertools
import math
import re
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Final, Self

import numpy as np
from PIL import ImageColor
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PrivateAttr,
    Strict,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from sandbox.errors import KeyPath, dotted, shown
from sandbox.scene.toml_lines import line_of, lines_of_keys
from sandbox.scene.validation import Finding, error_of, findings
from sandbox.state import Bodies, State
from sandbox.text import printable, unprintable

MAX_BALLS: Final = 200_000
MAX_WALLS: Final = 1_000  # each of which is held beside each ball
MAX_STEPS: Final = 10_000_000
ROUNDING: Final = 1e-9  # of an arena's size: what sums of decimal fractions may be off by
ARENA_WALLS: Final = ("left", "top", "right", "bottom")  # walls 0 to 3; the scene's own follow


def rgb(colour: str) -> tuple[int, int, int]:
    """Return the red, green and blue of a CSS colour name or #rrggbb, 0 to 255."""
    red, green, blue, *_ = ImageColor.getrgb(colour)
    return red, green, blue


def _colour(name: str) -> str:
    if name.lower() in ImageColor.colormap or re.fullmatch("#([0-9a-fA-F]{3}){1,2}", name):
        return name
    raise findings(((), lambda: _no_colour(name)))


def _no_colour(name: str) -> str:
    close = difflib.get_close_matches(name.lower(), ImageColor.colormap, n=1)
    right = f"did you mean {close[0]}?" if close else "write a CSS name or #rrggbb"
    return f"is no colour: {shown(name)}; {right}"


def _not_minute(size: float) -> float:
    if size < 1e-6:
        raise findings(((), f"must be at least 1e-06, got {size:g}"))
    return size


def _printable(line: str) -> str:
    """Let no text of a scene command the terminal that prints it, nor look as if it said something else."""
    found = next(filter(unprintable, line), None)
    if found is not None:
        raise findings(((), f"must not have control characters, got U+{ord(found):04X}"))
    return line


def _printable_lines(text: str) -> str:
    for line in text.split("\n"):
        _printable(line.replace("\t", " "))
    return text


# Bounds keep squares and quotients of what a scene says far from overflow.
Number = Annotated[float, Strict(), Field(ge=-1e9, le=1e9)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Count = Annotated[int, Strict(), Field(ge=1, le=1_000_000)]
Size = Annotated[Number, Field(gt=0), AfterValidator(_not_minute)]
Index = Annotated[int, Strict(), Field(ge=0, lt=2**63)]
Elasticity = Annotated[Number, Field(ge=0, le=1)]
Colour = Annotated[str, AfterValidator(_colour)]
Line = Annotated[str, AfterValidator(_printable)]
Title = Annotated[str, Field(max_length=100), AfterValidator(_printable)]
Text = Annotated[str, Field(max_length=2_000), AfterValidator(_printable_lines)]
Vector = tuple[Number, Number]


class Model(BaseModel):
    """A table of the file: unknown keys, NaN and infinity are mistakes; once read it does not change."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


class Arena(Model):
    """The box the balls are in. Four static walls stand round it."""

    size: tuple[Size, Size]
    """Width and height, px."""
    elasticity: Elasticity = 1
    """Of the four walls."""
    friction: NotNegative = 0
    """Of the four walls."""
    background: Colour = "white"
    """A CSS colour name or #rrggbb."""
    overlap: NotNegative = 0
    """How deep a ball may stand in the four walls at the start, px; a scene saved while it runs may need it."""


class Range(Model):
    """A number drawn at random for each ball: from `from` to `to`, in whole steps of `step` where it is given."""

    start: Number = Field(alias="from")
    to: Number
    step: Number | None = None

    @model_validator(mode="after")
    def _can_produce_something(self) -> Self:
        if self.step is None:
            if self.start > self.to:
                raise findings(((), f"can produce nothing: from {self.start:g} is greater than to {self.to:g}"))
            return self
        if not all(number.is_integer() for number in (self.start, self.to, self.step)):
            raise findings(((), "must have whole numbers as from, to and step"))
        if self.step == 0:
            raise findings((("step",), "must not be 0; leave it out for any number in the range"))
        if (self.to - self.start) * self.step < 0:
            raise findings(
                (
                    (),
                    f"can produce nothing: steps of {self.step:g} from {self.start:g} never reach {self.to:g}",
                )
            )
        if (self.to - self.start) % self.step:
            reached = self.to - (self.to - self.start) % self.step
            raise findings((("to",), f"is not met in steps of {self.step:g} from {self.start:g}; write {reached:g}"))
        return self


PLACES: Final = ("position", "positions", "x", "inside", "grid")
THROWS: Final = ("velocity", "velocities", "vx", "vy", "speed", "rms_speed")


class BallGroup(Model):
    """Balls that share a size and a way to be placed and thrown. In order, they are the scene's balls."""

    count: Annotated[Count, Field(le=MAX_BALLS)] | None = None
    """How many; 1, or as many as there are positions or places in the grid, where left out."""
    radius: Size
    """Radius of each, px."""
    mass: Size = 1
    """Mass of each, kg; only ratios matter."""
    elasticity: Elasticity = 1
    """The ball's factor: a pair's elasticity is the product of the two."""
    friction: NotNegative = 0
    """The ball's factor: a pair's friction is the product of the two."""
    colors: tuple[Colour, ...] | None = None
    """CSS colour names or #rrggbb, taken in turn."""
    position: Vector | None = None
    """Centre, px; of a grid, the centre of its first ball."""
    positions: Annotated[tuple[Vector, ...], Field(min_length=1, max_length=MAX_BALLS)] | None = None
    """Centres, one a ball, px."""
    x: Range | None = None
    """Centres drawn at random, px. Goes with y."""
    y: Range | None = None
    """Centres drawn at random, px. Goes with x."""
    inside: tuple[Vector, Vector] | None = None
    """Two corners of a rectangle, px: balls wholly in it at random places, none overlapping."""
    grid: tuple[Count, Count] | None = None
    """Columns and rows, filled row by row. Goes with spacing."""
    spacing: Size | None = None
    """From centre to centre of a grid, px."""
    velocity: Vector | None = None
    """px/s."""
    velocities: tuple[Vector, ...] | None = None
    """One a ball, px/s."""
    vx: Range | None = None
    """Drawn at random, px/s; 0 where only vy is given."""
    vy: Range | None = None
    """Drawn at random, px/s; 0 where only vx is given."""
    speed: NotNegative | None = None
    """In a random direction, px/s."""
    rms_speed: NotNegative | None = None
    """Both components drawn from a normal distribution with this root mean square speed, px/s."""

    @property
    def size(self) -> int:
        """How many balls the group has."""
        if self.count is not None:
            return self.count
        if self.positions is not None:
            return len(self.positions)
        return self.grid[0] * self.grid[1] if self.grid else 1

    def first_of_grid(self, arena: Arena) -> Vector:
        """Centre of a grid's first ball: the grid stands in the middle of the arena unless it says otherwise."""
        assert self.grid is not None
        assert self.spacing is not None
        if self.position is not None:
            return self.position
        x, y = ((size - (n - 1) * self.spacing) / 2 for size, n in zip(arena.size, self.grid, strict=True))
        return x, y

    @model_validator(mode="after")
    def _placed_and_thrown_one_way(self) -> Self:
        found: list[Finding] = []
        given = self.model_fields_set
        places = [key for key in PLACES if key in given and not (key == "position" and self.grid)]
        found += [((place,), f"is a second place beside {places[0]}; keep one of them") for place in places[1:]]
        if not places:
            found.append(((), "needs a place: position, positions, x and y, inside, or grid with spacing"))
        if (self.x is None) != (self.y is None):
            found.append((("x" if self.x else "y",), "needs both x and y"))
        if (self.grid is None) != (self.spacing is None):
            found.append((("grid" if self.grid else "spacing",), "needs both grid and spacing"))
        throws = [key for key in THROWS if key in given and not (key == "vy" and "vx" in given)]
        found += [((throw,), f"is a second way to throw beside {throws[0]}; keep one of them") for throw in throws[1:]]
        if self.positions is not None and self.size != len(self.positions):
            found.append((("count",), f"is not how many positions there are, {len(self.positions)}; leave it out"))
        if self.velocities is not None and self.size != len(self.velocities):
            found.append((("velocities",), f"must be one a ball, {self.size}, got {len(self.velocities)}"))
        if self.colors == ():
            found.append((("colors",), "must name one colour at least"))
        if places == ["position"] and self.size > 1:
            found.append(
                (("count",), f"puts {self.size} balls on one position; use positions, x and y, inside, or grid")
            )
        if self.grid and self.count and self.count > self.grid[0] * self.grid[1]:
            found.append((("count",), f"is more than the {self.grid[0] * self.grid[1]} places of the grid"))
        if found:
            raise findings(*found)
        return self


def _in_arena(group: BallGroup, info: ValidationInfo) -> BallGroup:
    """Check what can be known of a group's places before a seed is chosen."""
    arena = info.data.get("arena")
    if arena is None:  # has mistakes of its own
        return group
    found: list[Finding] = []
    for axis, (name, size) in enumerate(zip("xy", arena.size, strict=True)):
        low, high = group.radius, size - group.radius
        if low > high:
            found.append(
                (
                    ("radius",),
                    f"{group.radius:g} is too large for an arena of {arena.size[0]:g} x {arena.size[1]:g}",
                )
            )
            break
        span, key = _span(group, arena, axis)
        slack = ROUNDING * size + arena.overlap
        if span is not None and not (low - slack <= span[0] and span[1] <= high + slack):
            outside = span[0] if span[0] < low else span[1]
            found.append(
                (
                    (key,),
                    f"puts a ball outside the arena: {name} must be from {low:g} to {high:g}, got {outside:g}",
                )
            )
    if group.inside and not found:
        (x0, y0), (x1, y1) = group.inside
        width, height = abs(x1 - x0), abs(y1 - y0)
        if min(width, height) < 2 * group.radius:
            found.append((("inside",), f"is smaller than one ball, which is {2 * group.radius:g} wide"))
        elif group.size > _most_that_fit(width, height, group.radius):
            found.append(
                (
                    ("count",),
                    f"is more than fit: {group.size} balls of radius {group.radius:g} in {width:g} x {height:g}",
                )
            )
    if found:
        raise findings(*found)
    return group


def _most_that_fit(width: float, height: float, radius: float) -> float:
    """Bound how many equal discs fit in a rectangle (Oler 1961, of points that far apart in a convex set)."""
    a, b, d = width - 2 * radius, height - 2 * radius, 2 * radius  # where the centres can be
    return 2 / 3**0.5 * a * b / d**2 + (a + b) / d + 1


def _span(group: BallGroup, arena: Arena, axis: int) -> tuple[tuple[float, float] | None, str]:
    """Lowest and highest centre that a group can have on an axis, and the key that says so."""
    drawn = (group.x, group.y)[axis]
    if group.grid and group.spacing:
        first = group.first_of_grid(arena)[axis]
        used = (min(group.size, group.grid[0]), -(-group.size // group.grid[0]))[axis]
        return (first, first + (used - 1) * group.spacing), "position" if group.position else "grid"
    if group.position:
        return (group.position[axis], group.position[axis]), "position"
    if group.positions:
        along = [position[axis] for position in group.positions]
        return (min(along), max(along)), "positions"
    if drawn:
        return (min(drawn.start, drawn.to), max(drawn.start, drawn.to)), "xy"[axis]
    if group.inside:
        corners = sorted(corner[axis] for corner in group.inside)
        return (corners[0] + group.radius, corners[1] - group.radius), "inside"
    return None, ""


class Wall(Model):
    """A static wall inside the arena: a segment with round ends."""

    start: Vector = Field(alias="from")
    """One end, px."""
    to: Vector
    """The other end, px."""
    thickness: NotNegative = 4
    """px, half of it on either side."""
    elasticity: Elasticity = 1
    """The wall's factor of the product with the ball's."""
    friction: NotNegative = 0
    """The wall's factor of the product with the ball's."""

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if math.dist(self.start, self.to) < 1e-6:
            raise findings((("to",), "is the same point as from; a wall needs a length"))
        return self


class PymunkSettings(Model):
    """Settings of the `pymunk.Space`; Pymunk's own defaults where left out."""

    iterations: Count | None = None
    """Of the impulse solver, a step."""
    substeps: Count = 1
    """Calls of `Space.step` for each step of the scene."""
    collision_slop: NotNegative | None = None
    """Overlap that is left alone, px."""
    collision_bias: Annotated[Number, Field(ge=0, le=1)] | None = None
    """Share of an overlap that is left after a second."""
    collision_persistence: Annotated[Index, Field(le=1_000_000)] | None = None
    """Steps for which a contact's solution is kept."""


class Expect(Model):
    """What must be true at a time, by a law of physics: of one ball, or of all together."""

    at: NotNegative
    """s; a whole number of steps."""
    ball: Index | None = None
    """Counted from 0 in scene order; goes with position and velocity."""
    position: Vector | None = None
    """Of the ball, px."""
    velocity: Vector | None = None
    """Of the ball, px/s."""
    energy_ratio: NotNegative | None = None
    """Energy of all balls then, as a share of their energy at the start."""
    momentum: Vector | None = None
    """Of all balls, kg px/s."""
    centre_of_mass: Vector | None = None
    """Of all balls, px."""
    tolerance: Positive
    """Largest error that passes, in the units of what is expected."""
    because: Text
    """The law."""

    @model_validator(mode="after")
    def _says_what_is_expected(self) -> Self:
        of_ball = self.position is not None or self.velocity is not None
        of_all = [key for key in ("energy_ratio", "momentum", "centre_of_mass") if getattr(self, key) is not None]
        if not of_ball and not of_all:
            raise findings(((), "expects nothing: give position, velocity, energy_ratio, momentum or centre_of_mass"))
        if of_ball and self.ball is None:
            raise findings((("ball",), "is missing: whose position or velocity?"))
        if not of_ball and self.ball is not None:
            raise findings((("ball",), f"goes with position or velocity; {of_all[0]} is of all balls"))
        return self


class Scene(Model):
    """Balls, walls and gravity: what several engines run side by side."""

    title: Title = ""
    """What the window and the report call it, on one line."""
    about: Text = ""
    """Why it is worth watching."""
    rate: Count = 60
    """Steps per second."""
    seconds: Positive = 20
    """How long a comparison runs."""
    seed: Index = 0
    """Of everything drawn at random."""
    gravity: Vector = (0, 0)
    """px/s², y down."""
    arena: Arena
    balls: tuple[Annotated[BallGroup, AfterValidator(_in_arena)], ...]
    walls: Annotated[tuple[Wall, ...], Field(max_length=MAX_WALLS)] = ()
    pymunk: PymunkSettings = PymunkSettings()
    expect: tuple[Expect, ...] = ()

    _file: str = PrivateAttr("scene")
    _source: str = PrivateAttr("")
    _spawned: tuple[object, State] | None = PrivateAttr(None)  # what `spawn` drew, and from what: it can take seconds

    @field_validator("balls")
    @classmethod
    def _some_and_not_too_many(cls, balls: tuple[BallGroup, ...]) -> tuple[BallGroup, ...]:
        total = sum(group.size for group in balls)
        if total == 0:
            raise findings(((), "are none; a scene needs one at least"))
        if total > MAX_BALLS:
            raise findings(((), f"are {total} in all; at most {MAX_BALLS} are allowed"))
        return balls

    @field_validator("expect")
    @classmethod
    def _of_balls_and_steps_there_are(cls, expect: tuple[Expect, ...], info: ValidationInfo) -> tuple[Expect, ...]:
        total = sum(group.size for group in info.data.get("balls", ()))
        rate = info.data.get("rate", 1)
        found = [
            ((index, "at"), f"is not on a step, of which there are {rate} a second, got {one.at:g}")
            for index, one in enumerate(expect)
            if abs(one.at * rate - round(one.at * rate)) > 1e-6
        ]
        found += [
            ((index, "ball"), f"must be at most {total - 1}, got {one.ball}")
            for index, one in enumerate(expect)
            if total and one.ball is not None and one.ball >= total
        ]
        if found:
            raise findings(*found)
        return expect

    @model_validator(mode="after")
    def _neither_too_long_nor_too_short(self) -> Self:
        if self.seconds * self.rate > MAX_STEPS:
            raise findings(
                (("seconds",), f"must be at most {MAX_STEPS / self.rate:g} at this rate, got {self.seconds:g}")
            )
        if self.steps < 1:
            raise findings((("seconds",), f"must be at least a step of {1 / self.rate:g}, got {self.seconds:g}"))
        return self

    def changed(self, **changes: object) -> "Scene":
        """Return the same scene otherwise begun or run: `scene.changed(seed=3, seconds=5.0)`.

        Raises SandboxError for a value that a scene file may not have either.
        """
        try:
            scene = Scene.model_validate({key: getattr(self, key) for key in Scene.model_fields} | changes)
        except ValidationError as error:
            raise error_of(error, Scene) from None
        scene._file, scene._source = self._file, self._source
        scene._spawned = self._spawned
        return scene

    @property
    def name(self) -> str:
        """The name of its file, without the ending, as it can be shown."""
        return printable(Path(self._file).stem)

    @property
    def source(self) -> str:
        """The text that it was read from."""
        return self._source

    @property
    def file(self) -> Path:
        """Where it was read from."""
        return Path(self._file)

    @property
    def steps(self) -> int:
        """How many steps `seconds` are."""
        return round(self.seconds * self.rate)

    @cached_property
    def bodies(self) -> Bodies:
        """What does not change of the balls, one entry a ball in scene order."""
        sizes = [group.size for group in self.balls]

        def each(key: str) -> np.ndarray[Any, np.dtype[np.float64]]:
            return np.repeat([float(getattr(group, key)) for group in self.balls], sizes)

        return Bodies(each("radius"), each("mass"), each("elasticity"), each("friction"))

    @cached_property
    def colors(self) -> tuple[str, ...]:
        """Colour of each ball in scene order; groups that name none take the palette's in turn."""
        colors: list[str] = []
        for index, group in enumerate(self.balls):
            own = group.colors or (PALETTE[index % len(PALETTE)],)
            colors += itertools.islice(itertools.cycle(own), group.size)
        return tuple(colors)

    def wall_name(self, wall: int) -> str:
        """Name a wall for people: walls 0 to 3 are the arena's, the scene's own follow."""
        return f"the {ARENA_WALLS[wall]} wall" if wall < len(ARENA_WALLS) else f"wall {wall - len(ARENA_WALLS)}"

    @cached_property
    def lines(self) -> Mapping[KeyPath, int]:
        """On which line of its file each key is."""
        return lines_of_keys(self._source)

    def at(self, path: KeyPath, message: str) -> str:
        """Say something of a key of this scene: `file:line: key message`."""
        line, name = line_of(path, self.lines) if path else None, printable(self._file)
        place = f"{name}:{line}" if line else name
        return f"{place}: {dotted(path)} {message}".replace(":  ", ": ")


# Okabe and Ito's colours, which colour-blind people can tell apart (https://jfly.uni-koeln.de/color/).
PALETTE: Final = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7")
