"""The velocities of a group's balls at the start: a class for each kind of throw in a scene file."""
# ruff: noqa: D102 (the base class documents the method)

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from random import Random

from sandbox.scene.elementary import logarithm, sine_cosine
from sandbox.scene.fields import Range, Vector


class Throw(ABC):
    """How the balls of a group move at the start."""

    @abstractmethod
    def velocities(self, rng: Random) -> Iterator[Vector]:
        """Return the velocities, ball by ball, px/s."""


@dataclass(frozen=True)
class AllAlike(Throw):
    """The same velocity for every ball."""

    velocity: Vector

    def velocities(self, rng: Random) -> Iterator[Vector]:
        while True:
            yield self.velocity


@dataclass(frozen=True)
class OneByOne(Throw):
    """A velocity for each ball."""

    each: tuple[Vector, ...]

    def velocities(self, rng: Random) -> Iterator[Vector]:
        return iter(self.each)


@dataclass(frozen=True)
class RandomComponents(Throw):
    """Components drawn at random; a component without a range is 0."""

    vx: Range | None
    vy: Range | None

    def velocities(self, rng: Random) -> Iterator[Vector]:
        while True:
            yield self.vx.draw(rng) if self.vx else 0.0, self.vy.draw(rng) if self.vy else 0.0


@dataclass(frozen=True)
class RandomDirection(Throw):
    """One speed, in directions drawn at random."""

    speed: float

    def velocities(self, rng: Random) -> Iterator[Vector]:
        while True:
            sine, cosine = sine_cosine(rng.uniform(0, 2 * math.pi))
            yield self.speed * cosine, self.speed * sine


@dataclass(frozen=True)
class Maxwellian(Throw):
    """Both components drawn from a normal distribution, by the rule of Box and Muller, as `Random.gauss` draws them."""

    rms_speed: float

    def velocities(self, rng: Random) -> Iterator[Vector]:
        sigma = self.rms_speed / math.sqrt(2)
        while True:
            sine, cosine = sine_cosine(rng.random() * 2 * math.pi)
            size = math.sqrt(-2 * logarithm(1 - rng.random()))
            yield cosine * size * sigma, sine * size * sigma
