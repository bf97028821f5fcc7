"""Expectations: how far a state is from what its scene expects."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np

from sandbox.quantity import deepest_overlap, energy, momentum
from sandbox.scene.model import Columns, Expect, Scene
from sandbox.scene.overlaps import depths_in_walls
from sandbox.scene.units import Dimension
from sandbox.state import Floats, State

SAME_TIME: Final = 1e-6  # of a step; a time that is closer to a step than this is that step's

Numbers = tuple[float, ...]


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

    def __init__(self, key: str, dimension: Dimension, of_ball: bool) -> None:
        """Set what it is; `key` is that in the scene's file."""
        self.key, self.dimension, self.of_ball = key, dimension, of_ball

    @property
    def label(self) -> str:
        """The quantity in words."""
        return self.key.replace("_", " ")


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


def step_of(expect: Expect, rate: int) -> int | None:
    """Return the step at whose end something is expected; None if that is between two steps."""
    nearest = round(expect.at * rate)
    return nearest if abs(expect.at * rate - nearest) <= SAME_TIME else None


def scores(
    scene: Scene, expects: Sequence[Expect], initial: State, states: Mapping[int, State], scale: float, ended: str
) -> Iterator[Score]:
    """Score an engine on some expectations by its states at their steps.

    scale: kg px²/s², what shares of energy are of, see `EnergyScale`; ended: why there is no state for some.
    """
    for expect in expects:
        step = step_of(expect, scene.rate)
        if step is None:
            yield Score(expect, skipped=f"{expect.at:g} s is between two of {scene.rate} steps a second")
        elif step not in states:
            yield Score(expect, skipped=ended)
        elif expect.energy_ratio is not None and not scale:
            yield Score(expect, skipped="nothing moves, so the energy has no ratio")
        else:
            yield Score(expect, tuple(_deviations(scene, expect, initial, states[step], scale)))


def _deviations(scene: Scene, expect: Expect, initial: State, state: State, energy_scale: float) -> Iterator[Deviation]:
    mass, ball = scene.bodies.mass, expect.ball or 0
    before, after = (float(energy(each, scene.bodies, scene.gravity, scene.arena.size)) for each in (initial, state))
    columns = expect.columns
    measured: dict[ExpectedQuantity, Callable[[], float | Numbers]] = {
        ExpectedQuantity.POSITION: lambda: _numbers(state.position[ball]),
        ExpectedQuantity.VELOCITY: lambda: _numbers(state.velocity[ball]),
        ExpectedQuantity.SPIN: lambda: float(state.spin[ball]),
        ExpectedQuantity.ENERGY_RATIO: lambda: 1 + (after - before) / energy_scale,
        ExpectedQuantity.MOMENTUM: lambda: _numbers(momentum(state.velocity, mass)),
        ExpectedQuantity.CENTRE_OF_MASS: lambda: _numbers(np.average(state.position, axis=0, weights=mass)),
        ExpectedQuantity.OVERLAP: lambda: overlap_in(scene, state.position),
        ExpectedQuantity.COLUMNS: lambda: _numbers(shares_in(columns, state.position[:, 0])) if columns else (),
    }
    for quantity, measure in measured.items():
        expected = getattr(expect, quantity.key)
        if quantity is ExpectedQuantity.COLUMNS and columns:
            expected = _numbers(np.divide(columns.shares, sum(columns.shares)))
        if expected is not None:
            yield Deviation(quantity, expected, measure())


def _numbers(values: Floats) -> Numbers:
    return tuple(values.tolist())


def overlap_in(scene: Scene, position: Floats) -> float:
    """Return the deepest overlap of two balls, or of a ball and a wall, px; 0 if nothing overlaps."""
    radius, filters = scene.bodies.radius, scene.bodies.filters
    return max(deepest_overlap(position, radius, filters)[0], float(depths_in_walls(scene, position).max()))


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
