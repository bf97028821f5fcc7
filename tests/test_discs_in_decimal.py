"""The independent program in 50 digits, where closed forms are known."""

from collections.abc import Sequence
from decimal import Decimal, localcontext
from itertools import pairwise

import pytest
from discs_in_decimal import DIGITS, Disc, Run, Table, Wall, first_fall, run

SIDE = 1000
CORNERS = ((0, SIDE), (0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE))


def number(value: float | str) -> Decimal:
    return Decimal(value)


def box(discs: Sequence[Disc], *walls: Wall, e: str = "1", gravity: int = 0) -> Table:
    """Return discs in a square arena."""
    sides = []
    for side, (start, end) in enumerate(pairwise(CORNERS)):
        x0, y0, x1, y1 = map(number, start + end)
        sides.append(Wall(side, x0, y0, x1, y1, number(0), number(e), one_sided=True))
    return Table(list(discs), (*sides, *walls), (number(0), number(gravity)))


def disc(x: int, y: int, vx: int = 0, vy: int = 0, mass: int = 1, e: str = "1") -> Disc:
    return Disc(number(x), number(y), number(vx), number(vy), number(10), number(mass), number(e))


def played(table: Table, seconds: str) -> Run:
    return run(table, [Decimal(seconds)], 1000)


def test_a_light_disc_between_a_wall_and_a_heavy_one_counts_the_digits_of_pi() -> None:
    table = box([disc(100, 500), disc(200, 500, vx=-100, mass=10_000)])
    found = played(table, "9")
    assert len(found.contacts) == 314
    with localcontext(prec=DIGITS):
        energy = sum((one.mass * (one.vx**2 + one.vy**2) for one in found.snapshots[-1].discs), number(0))
    assert abs(energy / (10_000 * 100**2) - 1) < Decimal("1e-44")


def test_an_inelastic_pair_parts_by_the_law_of_restitution() -> None:
    table = box([disc(100, 500, vx=100, mass=3, e="0.5"), disc(220, 500)])
    found = played(table, "2")
    assert [contact.time for contact in found.contacts] == [number(1)]
    assert [contact.impulse for contact in found.contacts] == [number(1.5 * 100 * 3 / 4)]
    for one, expected in zip(found.snapshots[0].discs, ("62.5", "112.5"), strict=True):
        assert abs(one.vx - Decimal(expected)) < Decimal("1e-44")


def test_bounces_end_before_the_time_at_which_infinitely_many_are_over() -> None:
    """From 450 px with 900 px/s² to the floor in 1 s; each bounce then lasts half of the one before: 1 + 2 s in all."""
    table = box([disc(500, SIDE - 10 - 450)], e="0.5", gravity=900)
    found = played(table, "5")
    assert found.ended == "rest"
    times = [float(contact.time) for contact in found.contacts]
    assert times == pytest.approx([3 - 2 ** (1 - k) for k in range(len(times))], rel=1e-25)
    assert 3 - 4e-4 < found.until < 3


def test_a_disc_that_falls_on_a_round_end_leaves_it_by_the_mirror() -> None:
    """It falls on the end of a thick wall, 30 px from its centre and 18 px beside it: 24 px above it, 320 px deep."""
    wall = Wall(4, Decimal(500), Decimal(500), Decimal(500), Decimal(900), Decimal(20), Decimal(1))
    found = played(box([disc(518, 500 - 24 - 320)], wall, gravity=1000), "0.9")
    contact = found.contacts[0]
    assert (contact.first, ~contact.second) == (0, wall.number)
    assert float(contact.time) == pytest.approx(0.8, rel=1e-30)
    assert float(contact.impulse) == pytest.approx(2 * 800 * 24 / 30, rel=1e-30)
    after = found.snapshots[0].discs[0]
    assert float(after.vx) == pytest.approx(1280 * 18 / 30, rel=1e-30)
    assert float(after.vy) == pytest.approx(800 - 1280 * 24 / 30 + 1000 * 0.1, rel=1e-30)


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
    assert (found == Decimal("Infinity")) if expected is None else (abs(found - expected) < Decimal("1e-28"))
