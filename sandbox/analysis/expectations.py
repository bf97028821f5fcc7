"""Expectations: how far a state is from what its scene expects."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, Self, TypeVar

import numpy as np

from sandbox.quantity import deepest_overlap, energy, length, momentum
from sandbox.scene.fields import Vector
from sandbox.scene.model import Columns, Expect, Scene
from sandbox.scene.units import Dimension
from sandbox.scene.walls import wall_distance
from sandbox.state import Floats, State

SAME_TIME: Final = 1e-6  # of a step; a time that is closer to a step than this is that step's
MAX_PRECISE: Final = 2  # numbers of a vector that are written with ten digits; shares are rounded to 0.1 %
SAME_VELOCITY: Final = 1e-6  # of the speed; a smaller change within a step is rounding, also in 32 bits

Numbers = tuple[float, ...]
T = TypeVar("T", bound=float | Numbers)


class ExpectedQuantity(Enum):
    """A quantity that can be expected: its key in `[[expect]]`, its dimension, and whether it is of one ball."""

    POSITION = "position", Dimension.LENGTH, True
    VELOCITY = "velocity", Dimension.VELOCITY, True
    ENERGY_RATIO = "energy_ratio", Dimension.NUMBER, False
    MOMENTUM = "momentum", Dimension.MOMENTUM, False
    CENTRE_OF_MASS = "centre_of_mass", Dimension.LENGTH, False
    OVERLAP = "overlap", Dimension.LENGTH, False
    COLUMNS = "columns", Dimension.NUMBER, False
    SPIN = "spin", Dimension.SPIN, True

    dimension: Dimension
    of_ball: bool

    def __new__(cls, key: str, dimension: Dimension, of_ball: bool) -> Self:
        """Return a quantity, whose value is its key."""
        quantity = object.__new__(cls)
        quantity._value_, quantity.dimension, quantity.of_ball = key, dimension, of_ball
        return quantity

    @property
    def label(self) -> str:
        """The quantity in words."""
        return str(self.value).replace("_", " ")

    @property
    def unit(self) -> str:
        """The unit in the scene's file; empty for a ratio."""
        return self.dimension.value


@dataclass(frozen=True)
class Deviation:
    """The expected and the actual value of one quantity, and their distance in its unit."""

    quantity: ExpectedQuantity
    expected: float | Numbers
    measured: float | Numbers

    @property
    def error(self) -> float:
        """The distance of the two; of shares in columns, the largest of their sums up to a column."""
        if self.quantity is ExpectedQuantity.COLUMNS:
            return float(np.abs(np.cumsum(np.subtract(self.measured, self.expected))).max())
        error = math.dist(np.atleast_1d(self.expected), np.atleast_1d(self.measured))
        return math.inf if math.isnan(error) else error


@dataclass(frozen=True)
class Score:
    """How an engine did on one expectation. skipped: why it could not be judged; empty if it was."""

    expect: Expect
    deviations: tuple[Deviation, ...] = ()
    skipped: str = ""

    @property
    def error(self) -> float:
        """The largest error, in the unit of what is expected, as is the tolerance."""
        return max((deviation.error for deviation in self.deviations), default=0.0)

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance; True if it was not judged."""
        return self.error <= self.expect.tolerance

    @property
    def missed(self) -> tuple[Deviation, ...]:
        """The deviations beyond the tolerance, the furthest first."""
        beyond = [deviation for deviation in self.deviations if deviation.error > self.expect.tolerance]
        return tuple(sorted(beyond, key=lambda deviation: -deviation.error))

    def lines(self) -> Iterator[str]:
        """Yield a line for each quantity that is missed, or one that says why none was judged."""
        at = f"at {self.expect.at:g} s"
        of_ball = f"ball {self.expect.ball} {at}"
        if self.skipped:
            yield f"{at if self.expect.ball is None else of_ball}: skipped, since {self.skipped}"
        for deviation in self.missed:
            quantity, off = deviation.quantity, f"{deviation.error:.2g} {deviation.quantity.unit}".strip()
            yield (
                f"{of_ball if quantity.of_ball else at}: {quantity.label} {_words(deviation.measured)} instead of "
                f"{_words(deviation.expected)}, off by {off} (tolerance "
                f"{self.expect.tolerance:g}): {' '.join(self.expect.because.split())}"
            )

    def misses(self) -> Iterator["Miss"]:
        """Yield what `--json` writes for each quantity that is missed; an infinite number is None."""
        for deviation in self.missed:
            yield Miss(
                at=self.expect.at,
                ball=self.expect.ball if deviation.quantity.of_ball else None,
                quantity=deviation.quantity.value,
                unit=deviation.quantity.unit,
                expected=deviation.expected,
                found=finite(deviation.measured),
                error=finite(deviation.error),
                tolerance=self.expect.tolerance,
                because=self.expect.because,
            )


@dataclass(frozen=True)
class Miss:
    """A quantity that an engine misses, as JSON has it: in its unit, at a time in s; ball is None for all together."""

    at: float
    ball: int | None
    quantity: str
    unit: str
    expected: float | Numbers
    found: float | Numbers | None
    error: float | None
    tolerance: float
    because: str


def finite(value: T) -> T | None:
    """Return a number or a vector for JSON, None if it is not finite."""
    return value if np.isfinite(np.atleast_1d(value)).all() else None


def _words(value: float | Numbers) -> str:
    is_long = len(np.atleast_1d(value)) > MAX_PRECISE
    numbers = ", ".join(f"{number:.3f}" if is_long else f"{number:.10g}" for number in np.atleast_1d(value))
    return f"({numbers})" if isinstance(value, tuple) else numbers


def steps_around(at: float, rate: int) -> tuple[int, int]:
    """Return the step before a time and the step after it; twice the same step if the time is that step's."""
    nearest = round(at * rate)
    if abs(at * rate - nearest) <= SAME_TIME:
        return nearest, nearest
    return math.floor(at * rate), math.ceil(at * rate)


def score(scene: Scene, expect: Expect, initial: State, before: State, after: State, energy_scale: float) -> Score:
    """Score an engine by its states at the steps around the time of an expectation, as of `steps_around`.

    Between two steps, the state of the nearer one is flown to that time: x + v t + g t²/2, v + g t. If a ball that the
    expectation is about touched something in this step, no state is known for that time, and the score is skipped.
    energy_scale: kg px²/s², the scale that shares of energy refer to; at 0, no share is defined.
    """
    if after.time > before.time and (touched := _first_touched(scene, expect, before, after)) is not None:
        return Score(
            expect, skipped=f"{expect.at:g} s is between two steps, and ball {touched} touches something between them"
        )
    nearest = min((before, after), key=lambda state: abs(state.time - expect.at))
    state = nearest if after.time == before.time else _flown(scene, nearest, expect.at)
    if expect.energy_ratio is not None and not energy_scale:
        return Score(expect, skipped="nothing moves, so the energy has no ratio")
    return Score(expect, tuple(_deviations(scene, expect, initial, state, energy_scale)))


def _first_touched(scene: Scene, expect: Expect, before: State, after: State) -> int | None:
    """Return the first ball of those expected whose velocity changed by more than its fall; None if none's did."""
    fall = np.multiply(scene.gravity, after.time - before.time)
    change = length(after.velocity - before.velocity - fall)
    touched = change > SAME_VELOCITY * (length(before.velocity) + length(after.velocity) + math.hypot(*fall))
    of_all = any(getattr(expect, quantity.value) is not None for quantity in ExpectedQuantity if not quantity.of_ball)
    balls = range(len(touched)) if of_all or expect.ball is None else [expect.ball]
    return next((ball for ball in balls if touched[ball]), None)


def _flown(scene: Scene, state: State, at: float) -> State:
    """Return where a state is at another time if nothing is touched."""
    time, gravity = at - state.time, np.array(scene.gravity)
    flight = state.velocity * time + gravity * time**2 / 2
    return State(
        at, state.position + flight, state.velocity + gravity * time, state.angle + state.spin * time, state.spin
    )


def _deviations(scene: Scene, expect: Expect, initial: State, state: State, energy_scale: float) -> Iterator[Deviation]:
    mass = scene.bodies.mass
    if expect.ball is not None:
        for quantity, expected, measured in (
            (ExpectedQuantity.POSITION, expect.position, state.position),
            (ExpectedQuantity.VELOCITY, expect.velocity, state.velocity),
        ):
            if expected is not None:
                yield Deviation(quantity, expected, _vector(measured[expect.ball]))
        if expect.spin is not None:
            yield Deviation(ExpectedQuantity.SPIN, expect.spin, float(state.spin[expect.ball]))
    if expect.energy_ratio is not None:
        ratio = 1 + (_energy(scene, state) - _energy(scene, initial)) / energy_scale
        yield Deviation(ExpectedQuantity.ENERGY_RATIO, expect.energy_ratio, ratio)
    if expect.momentum is not None:
        yield Deviation(ExpectedQuantity.MOMENTUM, expect.momentum, _vector(momentum(state.velocity, mass)))
    if expect.centre_of_mass is not None:
        centre = np.average(state.position, axis=0, weights=mass)
        yield Deviation(ExpectedQuantity.CENTRE_OF_MASS, expect.centre_of_mass, _vector(centre))
    if expect.overlap is not None:
        yield Deviation(ExpectedQuantity.OVERLAP, expect.overlap, overlap_in(scene, state.position))
    if expect.columns is not None:
        shares = np.divide(expect.columns.shares, sum(expect.columns.shares))
        measured = shares_in(expect.columns, state.position[:, 0])
        yield Deviation(ExpectedQuantity.COLUMNS, tuple(shares.tolist()), tuple(measured.tolist()))


def _vector(values: Floats) -> Vector:
    x, y = values.tolist()
    return x, y


def _energy(scene: Scene, state: State) -> float:
    return float(energy(state, scene.bodies, scene.gravity, scene.arena.size))


def overlap_in(scene: Scene, position: Floats) -> float:
    """Return the deepest overlap of two balls, or of a ball and a wall, px; 0 if nothing overlaps."""
    radius, filters = scene.bodies.radius, scene.bodies.filters
    return max(deepest_overlap(position, radius, filters)[0], float((radius - wall_distance(scene, position)).max()))


def shares_in(columns: Columns, x: Floats) -> Floats:
    """Return which share of all balls is in each column: (columns,). x: (n,) px, of all balls."""
    edges = np.linspace(columns.start, columns.to, len(columns.shares) + 1)
    return np.histogram(x, edges)[0] / len(x)


def relative_error(score: Score) -> float:
    """Return the error in units of the tolerance."""
    return score.error / score.expect.tolerance


def worst(scores: Sequence[Score]) -> Score:
    """Return the score with the largest error relative to its tolerance."""
    return max(scores, key=relative_error)
