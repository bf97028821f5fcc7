"""The scales of the charts: where a value stands on an axis, how far the axis reaches, and which values it names."""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from sandbox.scene.units import Dimension, Units
from sandbox.state import Floats

Span = tuple[float, float]  # the lowest and the highest position on an axis

MIN_GAP: Final = 1e-3  # px, the lowest value of a logarithmic axis; what is less is drawn there
NEAR_ZERO: Final = 1e-3  # up to which an axis with both signs is linear; then it has powers of ten
LEAST_END: Final = 1e-2  # of such an axis, in both directions


def round_up(size: float) -> float:
    """Return the least of 1, 2, 5, 10, 20, 50, ... that is not less than a size."""
    power = 10.0 ** np.floor(np.log10(size))
    return float(next(power * step for step in (1, 2, 5, 10) if power * step >= size * (1 - 1e-9)))


class Scale(Protocol):
    """Maps values to positions on an axis."""

    def position(self, value: Floats) -> Floats:
        """Return where values stand."""

    def span(self, low: float, high: float) -> Span:
        """Return the positions of round numbers that include two values, which are infinite before any sample."""

    def ticks(self, span: Span) -> list[tuple[float, str]]:
        """Return positions and what is written there, the most important first."""


@dataclass(frozen=True)
class Logarithmic:
    """Powers of ten from some value on, to another one or further. Both are powers of ten themselves."""

    least: float = MIN_GAP
    reach: float = 1.0

    def position(self, value: Floats) -> Floats:
        """Return logarithms to the base 10."""
        return np.log10(np.maximum(value, self.least))

    def span(self, low: float, high: float) -> Span:
        """Return whole powers."""
        end = np.ceil(np.log10(high) - 1e-9) if self.reach < high < np.inf else np.log10(self.reach)
        return float(np.log10(self.least)), float(end)

    def ticks(self, span: Span) -> list[tuple[float, str]]:
        """Return both ends, then the powers between, the highest first."""
        first, last = round(span[0]), round(span[1])
        return [(power, f"{10.0**power:g}") for power in (first, *range(last, first, -1))]


def gap_scale(units: Units) -> Logarithmic:
    """Return the scale of gaps: from MIN_GAP, to a px or further, in the units in which they are shown."""
    pixel = 10.0 ** float(np.floor(np.log10(units.factor(Dimension.LENGTH)) + 1e-9))
    return Logarithmic(float(f"{MIN_GAP * pixel:.0e}"), pixel)


@dataclass(frozen=True)
class BothSigns:
    """Powers of ten in both directions, and linear up to NEAR_ZERO: a thousandth is seen as well as a half."""

    def position(self, value: Floats) -> Floats:
        """Return the logarithm of the magnitude, in units of NEAR_ZERO and plus 1, with the sign."""
        return np.sign(value) * np.log10(1 + np.abs(value) / NEAR_ZERO)

    def span(self, low: float, high: float) -> Span:
        """Return powers of ten, LEAST_END or more in both directions."""
        ends = (
            10 ** np.ceil(np.log10(max(end, LEAST_END)) - 1e-9) if end < np.inf else LEAST_END for end in (-low, high)
        )
        below, above = (float(self.position(np.array(end))) for end in ends)
        return -below, above

    def ticks(self, span: Span) -> list[tuple[float, str]]:
        """Return 0, the further end, the other end, then the powers between from the largest on."""
        powers = [sign * 10.0**k for k in range(9, -3, -1) for sign in (-1, 1)]
        inside = [(float(self.position(np.array(power))), f"{power:+g}") for power in powers]
        return [(0.0, "0"), *((at, text) for at, text in inside if span[0] - 1e-9 <= at <= span[1] + 1e-9)]
