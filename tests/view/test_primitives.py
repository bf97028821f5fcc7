"""Shapes of any size, and round numbers."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from pygame import Color, Surface
from window_driver import pixels

from sandbox.report.scales import round_up
from sandbox.state import Bools, Floats
from sandbox.view.primitives import capsule, first_lines, text_width, wrapped


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


def test_the_arena_s_walls_are_not_seen_in_a_pane_whose_size_was_rounded() -> None:
    surface, scale = Surface((122, 92)), 122 / 800  # 600 px are 91.5 px
    capsule(surface, Color("red"), (0, 600 * scale + 5), (122, 600 * scale + 5), 5)
    assert not pixels(surface).any()


def test_a_wall_covers_the_area_of_its_rectangle_and_its_round_ends_with_smooth_edges() -> None:
    surface = Surface((200, 100), 0, 32).subsurface((7, 5, 150, 80))
    surface.fill("white")
    capsule(surface, Color("black"), (20.3, 10.4), (110.9, 61.2), 4.3)
    ink = 1 - pixels(surface)[:, :, 0] / 255
    length = math.dist((20.3, 10.4), (110.9, 61.2))
    assert ink.sum() == pytest.approx(2 * 4.3 * length + math.pi * 4.3**2, rel=0.01)
    assert 0.1 < np.mean((ink > 0.02) & (ink < 0.98)) * ink.size / (2 * length) < 3  # about a pixel along either side


@pytest.mark.parametrize("most", [1, 2, 3, 4, 5])
def test_a_text_that_is_cut_off_ends_in_an_ellipsis(most: int) -> None:
    text = "one ball hits a row of balls at rest, and as many leave it as have come"
    whole = wrapped(text, 150, 16)
    assert len(whole) == 4
    lines = first_lines(text, 150, 16, most)
    assert len(lines) == min(most, len(whole))
    assert lines[: most - 1] == list(whole[: most - 1])
    assert lines[-1].endswith("\N{HORIZONTAL ELLIPSIS}") == (most < len(whole))
    assert all(text_width(line, 16) <= 150 for line in lines)
