"""The units in which a scene is shown to people. Its file, its physics, JSON and CSV are in px."""

import math
from collections.abc import Iterator
from enum import Enum, StrEnum
from typing import Final

from sandbox.scene.fields import Model, NotTiny
from sandbox.scene.validation import Problem


class Dimension(Enum):
    """The dimension of a quantity; the value is its unit in px."""

    NUMBER = ""
    MASS = "kg"
    SPIN = "rad/s"
    LENGTH = "px"
    VELOCITY = "px/s"
    ACCELERATION = "px/s²"
    MOMENTUM = "kg px/s"
    ENERGY = "kg px²/s²"


class LengthUnit(StrEnum):
    """A unit of length."""

    PIXEL = "px"
    MILLIMETRE = "mm"
    CENTIMETRE = "cm"
    METRE = "m"


PER_METRE: Final = {LengthUnit.MILLIMETRE: 1000.0, LengthUnit.CENTIMETRE: 100.0, LengthUnit.METRE: 1.0}


class Units(Model):
    """The units of tables, charts and pages. With a unit other than px, energies are in J; masses are in kg always."""

    length: LengthUnit = LengthUnit.PIXEL
    """Unit in which lengths are shown, and in which they are in velocities, accelerations and momenta."""
    pixels_per_metre: NotTiny | None = None
    """Number of pixels in a metre, whatever the unit of length; required unless that is px."""

    def problems(self) -> Iterator[Problem]:
        """Yield that one of the two keys lacks the other."""
        if not self._invalid and (self.length is LengthUnit.PIXEL) != (self.pixels_per_metre is None):
            yield (), "must have both pixels_per_metre and a length of 'mm', 'cm' or 'm'"

    def name(self, dimension: Dimension) -> str:
        """Return the name of a dimension's unit."""
        if dimension is Dimension.ENERGY and self.pixels_per_metre is not None:
            return "J"
        return dimension.value.replace("px", self.length)

    def factor(self, dimension: Dimension) -> float:
        """Return what a value in px becomes the shown one by: 1 if px are shown."""
        if self.pixels_per_metre is None:
            return 1.0
        per_metre = 1.0 if dimension is Dimension.ENERGY else PER_METRE[self.length]
        return (per_metre / self.pixels_per_metre) ** _power(dimension)

    def text(self, dimension: Dimension, template: str, *values: float) -> str:
        """Return values, given in px, as they are shown, with their unit.

        >>> Units(length="m", pixels_per_metre=100).text(Dimension.VELOCITY, "{:.3g}", 626.4)
        '6.26 m/s'
        """
        return f"{template.format(*self.scaled(dimension, *values))} {self.name(dimension)}".rstrip()

    def decimals(self, dimension: Dimension, of_pixels: int) -> int:
        """Return how many decimals show a length as precisely as some of a px, and other dimensions accordingly."""
        of_length = self.factor(dimension) ** (1 / max(1, _power(dimension)))
        return max(0, of_pixels - math.floor(math.log10(of_length) + 1e-9))

    def scaled(self, dimension: Dimension, *values: float) -> tuple[float, ...]:
        """Return values, given in px, as they are shown."""
        factor = self.factor(dimension)
        return tuple(factor * value for value in values)


PIXELS: Final = Units()


def _power(dimension: Dimension) -> int:
    """Return the power of a length in a dimension."""
    return ("px" in dimension.value) + ("px²" in dimension.value)
