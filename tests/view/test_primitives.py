"""Shapes of any size, and round numbers."""

from collections.abc import Callable

import numpy as np
import pytest
from pygame import Surface
from window_driver import pixels

from sandbox.analysis.scales import round_up
from sandbox.state import Bools, Floats
from sandbox.view.primitives import capsule


@pytest.mark.parametrize(("size", "up"), [(1, 1), (1.1, 2), (3, 5), (7, 10), (0.03, 0.05), (400, 500), (2e-7, 2e-7)])
def test_numbers_are_rounded_up_to_1_2_or_5(size: float, up: float) -> None:
    assert round_up(size) == pytest.approx(up, rel=1e-12)


@pytest.mark.parametrize(
    ("ends", "thickness", "seen"),
    [
        (((0, 0), (1e9, 1e9)), 20, lambda x, y: abs(x - y) < 10 * 2**0.5),
        (((-1e9, 300), (1e9, 300)), 20, lambda x, y: abs(y - 300) < 10),
        (((400, 5e8 + 300), (400, 1e9)), 1e9, lambda x, y: y > 300),
        (((-1e9, 300), (400, 300)), 200, lambda x, y: np.hypot(np.maximum(x - 400, 0), y - 300) < 100),
    ],
    ids=["along the diagonal", "across", "thick", "with a round end"],
)  # fmt: skip
def test_walls_that_extend_far_beyond_the_arena_are_drawn_where_visible(
    ends: tuple[tuple[float, float], tuple[float, float]], thickness: float, seen: Callable[[Floats, Floats], Bools]
) -> None:
    """pygame takes half a minute to draw such a shape."""
    surface = Surface((800, 600))
    capsule(surface, (255, 255, 255), *ends, thickness / 2)
    x, y = np.mgrid[0:800, 0:600].astype(float)
    drawn = pixels(surface)[..., 0] > 0
    assert (drawn != seen(x, y)).sum() < 2500  # at the edges
