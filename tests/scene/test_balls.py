"""Sine and cosine of balls thrown at random, against sums of their series."""

import math
import random
from fractions import Fraction

import pytest

from sandbox.scene.balls import sine_cosine

RNG = random.Random(1)
ANGLES = (0.0, 0.785, 0.786, 1.5, 2.0, 3.0, 4.0, 5.0, 6.28, -1.0, *(RNG.uniform(0, 2 * math.pi) for _ in range(20)))


def series(angle: float, first: int) -> float:
    """Sum angle^k / k! over every other k from the first, with signs that alternate, and round once."""
    x = Fraction(angle)
    return float(
        sum(((-1) ** n * x ** (2 * n + first) / math.factorial(2 * n + first) for n in range(40)), Fraction(0))
    )


@pytest.mark.parametrize("angle", ANGLES)
def test_sine_and_cosine_are_rounded_correctly(angle: float) -> None:
    assert sine_cosine(angle) == (series(angle, 1), series(angle, 0))
