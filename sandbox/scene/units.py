"""The units in which a scene is shown to people. Its file, its physics, JSON and CSV are in px."""

import math
import re
from collections.abc import Container, Iterator
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


_VALUE: Final = re.compile(r"\b(than|least|most|from|to|got) ([-+.\de]*\d)")
PER_METRE: Final = {LengthUnit.MILLIMETRE: 1000.0, LengthUnit.CENTIMETRE: 100.0, LengthUnit.METRE: 1.0}


class Units(Model):
    """The units of tables, charts and pages. With a unit other than px, energies are in J; masses are in kg always."""

    length: LengthUnit = LengthUnit.PIXEL
    """Unit in which lengths are shown, and in which they are in velocities, accelerations and momenta."""
    pixels_per_metre: NotTiny | None = None
    """Number of pixels in a metre, whatever the unit of length; required unless that is px."""

    def problems(self, checked: Container[int]) -> Iterator[Problem]:
        """Yield what is missing for the unit of length."""
        if not self._invalid:
            if self.length is not LengthUnit.PIXEL and self.pixels_per_metre is None:
                yield ("pixels_per_metre",), "is missing (number of pixels in a metre)"
            if self.length is LengthUnit.PIXEL and self.pixels_per_metre is not None:
                yield ("length",), "must be 'mm', 'cm' or 'm' with pixels_per_metre"

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

    def in_message(self, dimension: Dimension, message: str) -> str:
        """Return a message about a value with its bounds and the value, which it has in px, as they are shown.

        >>> Units(length="cm", pixels_per_metre=1000).in_message(Dimension.LENGTH, "must be at most 20, got 35.0")
        'must be at most 2 cm, got 3.5 cm'
        """
        if self.factor(dimension) == 1:
            return message
        return _VALUE.sub(lambda value: f"{value[1]} {self.text(dimension, '{:.6g}', float(value[2]))}", message)

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
