"""Numbers on pages, written as people write them: 1,200,000 and 3.3 × 10⁻¹⁶, not 1.2e+06 and 3.3e-16."""

import re
from decimal import Decimal
from typing import Final

LARGEST: Final = Decimal("1e15")  # that is written without a power of ten
SMALLEST: Final = Decimal("1e-4")
WHOLE: Final = 1000  # from which on no decimals are written
SUPERSCRIPTS: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LONG: Final = re.compile(r"(?<![\w.,])\d{4,}(?![\w.,])")  # a whole number without separators
# Python's exponents have a sign and two digits; what follows "=" is a setting in an engine's name.
EXPONENT: Final = re.compile(r"(?<![\w=.])(?<![\w=.]-)(-?\d(?:\.\d+)?)e([+-]\d\d+)(?!\w)")


def readable(text: str) -> str:
    """Write the numbers of a text without Python's exponents.

    >>> readable("1.2e+06 kg px/s, 0.00e+00, 5.84e-01 and -3.30e-16 in pymunk(damping=1e-05)")
    '1,200,000 kg px/s, 0, 0.584 and -3.3 × 10⁻¹⁶ in pymunk(damping=1e-05)'
    """
    return EXPONENT.sub(_written, text)


def _written(match: re.Match[str]) -> str:
    value, (mantissa, exponent) = Decimal(match[0]), match.groups()
    if not value:
        return "0"
    if SMALLEST <= abs(value) < LARGEST:
        return f"{value:,f}"
    digits = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{digits} \N{MULTIPLICATION SIGN} 10{str(int(exponent)).translate(SUPERSCRIPTS)}"


def rounded(value: float) -> str:
    """Format a number with four digits, or without decimals if it is large. Values that differ by noise look alike."""
    value = float(f"{value:.12g}")
    return f"{value + 0.0:,.4g}" if abs(value) < WHOLE else f"{value:,.0f}"


def minus(text: str) -> str:
    """Write a cell's numbers, with the sign for minus."""
    return LONG.sub(lambda match: f"{int(match[0]):,}", readable(text)).replace("-", "\N{MINUS SIGN}")
