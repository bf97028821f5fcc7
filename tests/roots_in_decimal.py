"""Roots of polynomials in 50 decimal digits, for `discs_in_decimal`."""

from collections.abc import Sequence
from decimal import Decimal
from itertools import pairwise
from math import comb
from typing import Final

DIGITS: Final = 50
TINY: Final = Decimal("1e-34")  # px and s: far above rounding, far below all else
ROOT_ERROR: Final = Decimal("1e-44")  # s
ZERO: Final = Decimal(0)
NEVER: Final = Decimal("Infinity")


def fall_through_zero(c: Decimal, b: Decimal, a: Decimal) -> Decimal:
    """Return the time at which c + b t + a t² falls through zero; a parabola does so once at most.

    Its slope there is minus the root of the discriminant, which gives two forms, each without cancellation for one sign
    of b.
    """
    discriminant = b * b - 4 * a * c
    if discriminant <= 0:
        return NEVER
    slope = -discriminant.sqrt()
    if b < 0:
        return 2 * c / (-b - slope)
    return (slope - b) / (2 * a) if a < 0 else NEVER


def soon(time: Decimal) -> Decimal:
    """Return a time of contact that rounding may have put before now; one that is past is never."""
    return max(time, ZERO) if time > -TINY else NEVER


def first_fall(power: Sequence[Decimal], limit: Decimal) -> Decimal:
    """Return the first root from 0 to a limit of a polynomial that begins positive, by its Bernstein coefficients.

    They bound it: without a change of sign among them it has no root, and with one change exactly one. Else the
    interval is halved, by de Casteljau's rule. power: coefficients of 1, t, t², ...
    """
    degree = len(power) - 1
    scaled = [coefficient * limit**k for k, coefficient in enumerate(power)]
    bernstein = [sum((scaled[k] * comb(i, k) / comb(degree, k) for k in range(i + 1)), ZERO) for i in range(degree + 1)]
    pending = [(ZERO, limit, bernstein)]
    while pending:
        low, high, coefficients = pending.pop()
        signs = [coefficient > 0 for coefficient in coefficients]
        changes = sum(a != b for a, b in pairwise(signs))
        if changes == 1:
            return bisect(power, low, high)
        if changes > 1 and high - low > TINY:
            left, right = halve(coefficients)
            middle = (low + high) / 2
            pending += [(middle, high, right), (low, middle, left)]
    return NEVER


def halve(bernstein: list[Decimal]) -> tuple[list[Decimal], list[Decimal]]:
    """Return the Bernstein coefficients on both halves of an interval."""
    left, right, row = [], [], bernstein
    while row:
        left.append(row[0])
        right.append(row[-1])
        row = [(a + b) / 2 for a, b in pairwise(row)]
    return left, right[::-1]


def bisect(power: Sequence[Decimal], low: Decimal, high: Decimal) -> Decimal:
    """Return the only root of a polynomial from low to high, where it falls."""
    while high - low > ROOT_ERROR:
        middle, value = (low + high) / 2, ZERO
        for coefficient in reversed(power):
            value = value * middle + coefficient
        low, high = (middle, high) if value > 0 else (low, middle)
    return (low + high) / 2
