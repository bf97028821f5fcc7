"""The root finder of the independent program."""

from collections.abc import Sequence
from decimal import Decimal, localcontext

import pytest
from roots_in_decimal import DIGITS, NEVER, first_fall


@pytest.mark.parametrize(
    ("power", "expected"),
    [
        ((6, -5, -2, 1), 1),  # (1 - t)(3 - t)(2 + t)
        ((24, -50, 35, -10, 1), 1),  # also falls at 3
        (("1.00000000000000000001", "-2.00000000000000000001", 1), 1),  # rises 1e-20 later
        (("1.00000000000000000001", -2, 1), None),  # (1 - t)² + 1e-20
        ((30, -11, 1), None),  # 5 and 6 are beyond the limit
    ],
)
def test_the_first_root_is_found_at_which_a_polynomial_falls(power: Sequence[int | str], expected: int | None) -> None:
    with localcontext(prec=DIGITS):
        found = first_fall([Decimal(one) for one in power], Decimal(4))
    assert (found == NEVER) if expected is None else (abs(found - expected) < Decimal("1e-28"))
