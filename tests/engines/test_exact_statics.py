"""The forces in heaps at rest, and whether they stand, against closed forms."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from sandbox.engines.exact.heaps.statics import Columns, columns_of, equilibrium, loose
from sandbox.engines.grid import NONE
from sandbox.state import Bools, Floats

G = 900.0  # px/s²
EXACT = 1e-12  # of the weight


class Heap:
    """Discs of mass 1 kg and their contacts. contacts: (first, second or NONE, normal) each."""

    def __init__(self, count: int, contacts: Sequence[tuple[int, int, Sequence[float]]], friction: float = 0) -> None:
        first, second, normal = zip(*contacts, strict=True)
        self.columns: Columns = columns_of(
            np.array(first), np.array(second), np.array(normal, float), np.full(len(contacts), float(friction))
        )
        self.mass = np.ones((count, 3 if friction else 2))
        self.mass[:, 2:] = 0.5
        self.weight = np.zeros_like(self.mass)
        self.weight[:, 1] = G
        self.a, self.force = equilibrium(self.columns, self.mass, self.weight)

    @property
    def normal_force(self) -> Floats:
        """Forces along the normals, of one disc's weight."""
        return np.bincount(self.columns.contact, self.force) / G

    @property
    def tangential_force(self) -> Floats:
        return np.bincount(self.columns.contact, self.force * self.columns.turn) / G

    @property
    def is_carried(self) -> bool:
        return bool(np.abs(self.a).max() < 1e-6 * G)

    @property
    def loose(self) -> Bools:
        return loose(self.columns, self.mass, self.force)


def towards(degrees: float) -> tuple[float, float]:
    """Return the unit vector at an angle from straight down, to the right."""
    return math.sin(math.radians(degrees)), math.cos(math.radians(degrees))


DOWN, LEFT, RIGHT = (0, 1), (-1, 0), (1, 0)


def pyramid(friction: float) -> Heap:
    """Two discs side by side on a floor, and a third on them."""
    contacts = [(0, NONE, DOWN), (1, NONE, DOWN), (2, 0, towards(-30)), (2, 1, towards(30)), (0, 1, RIGHT)]
    return Heap(3, contacts, friction)


@pytest.mark.parametrize(("left", "right"), [(30, 30), (45, 45), (20, 50), (80, 5)])
def test_disc_in_a_groove_presses_on_both_sides_by_the_rule_of_sines(left: float, right: float) -> None:
    """Lami: N_left / sin(right) = N_right / sin(left) = m g / sin(left + right)."""
    heap = Heap(1, [(0, NONE, towards(-left)), (0, NONE, towards(right))])
    whole = math.sin(math.radians(left + right))
    expected = [math.sin(math.radians(right)) / whole, math.sin(math.radians(left)) / whole]
    assert heap.normal_force == pytest.approx(expected, abs=EXACT)
    assert heap.is_carried
    assert not heap.loose.any()


def test_each_disc_of_a_stack_carries_those_above_it() -> None:
    heap = Heap(10, [(0, NONE, DOWN), *((k + 1, k, DOWN) for k in range(9))])
    assert heap.normal_force == pytest.approx(np.arange(10, 0, -1), abs=10 * EXACT)
    assert heap.is_carried


def test_corner_carries_a_disc_with_what_tilted_gravity_has_along_each_wall() -> None:
    heap = Heap(1, [(0, NONE, DOWN), (0, NONE, RIGHT)])
    tilted = np.array([[300.0, G]])
    a, force = equilibrium(heap.columns, heap.mass, tilted)
    assert force == pytest.approx([G, 300], rel=EXACT)
    assert np.abs(a).max() < 1e-9


def test_pyramid_between_walls_presses_them_apart() -> None:
    contacts = [(0, NONE, DOWN), (1, NONE, DOWN), (2, 0, towards(-30)), (2, 1, towards(30))]
    heap = Heap(3, [*contacts, (0, NONE, LEFT), (1, NONE, RIGHT)])
    slope, out = 1 / (2 * math.cos(math.radians(30))), math.tan(math.radians(30)) / 2
    assert heap.normal_force == pytest.approx([1.5, 1.5, slope, slope, out, out], abs=EXACT)
    assert heap.is_carried
    assert not heap.loose.any()


@pytest.mark.parametrize("rows", [2, 5, 12])
def test_floor_under_a_pyramid_between_walls_carries_its_weight(rows: int) -> None:
    """Rows of touching discs, one fewer in each: more contacts than equations, of which only sums are determined."""
    number = {(row, k): n for n, (row, k) in enumerate((row, k) for row in range(rows) for k in range(rows - row))}
    contacts: list[tuple[int, int, Sequence[float]]] = []
    for (row, k), n in number.items():
        if row == 0:
            contacts.append((n, NONE, DOWN))
        else:
            contacts += [(n, number[row - 1, k], towards(-30)), (n, number[row - 1, k + 1], towards(30))]
        if k == 0:
            contacts.append((n, NONE, LEFT))
        contacts.append((n, n + 1 if k < rows - row - 1 else NONE, RIGHT))
    heap = Heap(len(number), contacts)
    floor = [n for n, (_, _, normal) in enumerate(contacts) if normal is DOWN]
    left = [n for n, (_, _, normal) in enumerate(contacts) if normal is LEFT]
    right = [n for n, (_, second, normal) in enumerate(contacts) if second == NONE and normal is RIGHT]
    assert heap.is_carried
    assert heap.normal_force[floor].sum() == pytest.approx(len(number), rel=EXACT)
    assert heap.normal_force[left].sum() == pytest.approx(heap.normal_force[right].sum(), rel=EXACT)
    assert not heap.loose.any()


@pytest.mark.parametrize("friction", [0.26, 0.275, 1.0])
def test_pyramid_on_a_rough_floor_stands_if_friction_exceeds_the_tangent_of_15_degrees(friction: float) -> None:
    """At both contacts of a lower disc, the force is half-way between the normals, which are 30 degrees apart."""
    heap = pyramid(friction)
    assert heap.is_carried == (friction > math.tan(math.radians(15)))
    if heap.is_carried:
        assert heap.normal_force[:2] == pytest.approx([1.5, 1.5], abs=EXACT)
        assert np.all(np.abs(heap.tangential_force) <= friction * heap.normal_force + EXACT)
        assert not heap.loose.any()


def test_column_is_carried_but_can_roll_off_with_and_without_friction() -> None:
    for friction in (0.0, 0.8):
        heap = Heap(2, [(0, NONE, DOWN), (1, 0, DOWN)], friction)
        assert heap.is_carried
        assert heap.loose.all()


def test_discs_on_a_smooth_floor_are_loose_and_on_a_rough_one_are_not() -> None:
    row = [(0, NONE, DOWN), (1, NONE, DOWN), (0, 1, RIGHT)]
    assert Heap(2, row).loose.all()
    assert not Heap(2, row, friction=0.1).loose.any()
    assert not Heap(2, [*row, (0, NONE, LEFT), (1, NONE, RIGHT)]).loose.any()


def test_accelerations_of_what_is_not_carried_are_those_of_gausss_principle() -> None:
    """A disc slides down a smooth slope at g sin(a), rolls down a rough one at 2/3 g sin(a), and falls freely."""
    down = np.array([math.cos(math.radians(20)), math.sin(math.radians(20))])
    for friction, share in ((0.0, 1.0), (0.5, 2 / 3)):
        heap = Heap(2, [(0, NONE, towards(-20))], friction)
        assert heap.a[0, :2] == pytest.approx(share * G * down[1] * down, rel=1e-6)
        assert heap.a[1].tolist() == heap.weight[1].tolist()
