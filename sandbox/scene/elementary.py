"""Sine, cosine and logarithm in whole numbers, with the same bits on every machine.

Those of the C library differ from one library to the next, and within one: glibc has two variants of each, chosen by
whether the processor has FMA. Here a number is an integer in units of 2^-BITS, rounded to a float at the end.
"""

import math
from typing import Final

BITS: Final = 160  # so that numbers as small as 2^-53 still have more than a float
ONE: Final = 1 << BITS
HALF_PI: Final = 2295721403524109460692402599871655564227077512209
LN_2: Final = 1013035739299659071135698605846798551586536899366

_SINE: Final = [(-1) ** k * ONE // math.factorial(2 * k + 1) for k in range(14)]  # of x^(2k + 1)
_COSINE: Final = [(-1) ** k * ONE // math.factorial(2 * k) for k in range(14)]  # of x^(2k)
_ARTANH: Final = [ONE // (2 * k + 1) for k in range(20)]  # of z^(2k + 1)


def _fixed(number: float) -> int:
    numerator, denominator = number.as_integer_ratio()
    return numerator * ONE // denominator


def _series(coefficients: list[int], x2: int) -> int:
    """Return the value of a polynomial in x2."""
    value = 0
    for coefficient in reversed(coefficients):
        value = coefficient + (value * x2 >> BITS)
    return value


def sine_cosine(angle: float) -> tuple[float, float]:
    """Return the sine and the cosine of an angle, rad."""
    x = _fixed(angle)
    quarter = (x + HALF_PI // 2) // HALF_PI
    x -= quarter * HALF_PI
    x2 = x * x >> BITS
    sine, cosine = (x * _series(_SINE, x2) >> BITS) / ONE, _series(_COSINE, x2) / ONE
    return ((sine, cosine), (cosine, -sine), (-sine, -cosine), (-cosine, sine))[quarter % 4]


def logarithm(number: float) -> float:
    """Return the natural logarithm of a positive number: k ln 2 + 2 artanh((m - 1)/(m + 1)), number = 2^k m."""
    mantissa, k = math.frexp(number)
    if mantissa < math.sqrt(0.5):
        mantissa, k = 2 * mantissa, k - 1
    m = _fixed(mantissa)
    z = ((m - ONE) << BITS) // (m + ONE)
    return (k * LN_2 + 2 * (z * _series(_ARTANH, z * z >> BITS) >> BITS)) / ONE
