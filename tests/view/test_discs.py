"""Discs and lines are smooth, and at their places."""

import math
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray
from pygame import Surface
from window_driver import pixels

import sandbox.view.debug_draw
import sandbox.view.primitives
from sandbox.scene.fields import rgb
from sandbox.state import Floats
from sandbox.view.primitives import PHASES, Discs

RED = "#d55e00"
GROUNDS = [(255, 255, 255), (0, 0, 0), (20, 24, 29), (128, 128, 128), (0, 114, 178)]


def drawn(
    surface: Surface, centres: Floats, radius: float, colour: str = RED, angle: float | None = None
) -> NDArray[np.int64]:
    """Draw discs, with black lines at an angle, or in the discs' own colour. Return the pixels: (width, height, 3)."""
    n = len(centres)
    with patch.object(sandbox.view.primitives, "RADIUS_INK", rgb(colour) if angle is None else (0, 0, 0)):
        Discs(np.full(n, radius), [colour] * n).draw(surface, centres, 1.0, np.full(n, angle or 0.0))
    return pixels(surface).astype(np.int64)


def white_surface(depth: int) -> Surface:
    surface = Surface((100, 80), depth=depth)
    surface.fill("white")
    return surface


def coverage(centre: tuple[float, float], radius: float) -> Floats:
    """Return the share of each pixel that a white disc covers on black: (width, height)."""
    return drawn(Surface((100, 80)), np.array([centre]), radius, "white")[..., 0] / 255


@pytest.mark.parametrize("radius", [1.0, 1.3, 2.0, 3.5, 7.25, 20.0])
def test_a_disc_has_its_area_at_its_place(radius: float) -> None:
    for x, y in np.random.default_rng(1).uniform(40, 41, (20, 2)).tolist():
        share = coverage((x, y), radius)
        assert share.sum() == pytest.approx(math.pi * radius**2, rel=0.01)
        across, down = np.mgrid[0:100, 0:80] + 0.5
        assert (share * across).sum() / share.sum() == pytest.approx(x, abs=0.6 / PHASES)
        assert (share * down).sum() / share.sum() == pytest.approx(y, abs=0.6 / PHASES)
        distance = np.hypot(across - x, down - y)
        assert not share[distance > radius + 0.9].any()  # half a pixel's diagonal, and of a phase
        assert (share[distance < radius - 0.9] == 1).all()


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("colour", [RED, "white", "black", "#0072b2"])
def test_edges_have_no_fringe_on_any_background(ground: tuple[int, int, int], colour: str) -> None:
    surface = Surface((100, 80))
    surface.fill(ground)
    seen = drawn(surface, np.array([(40.3, 40.8)]), 6.4, colour)
    share = coverage((40.3, 40.8), 6.4)[..., None]
    expected = share * rgb(colour) + (1 - share) * ground
    assert np.abs(seen - expected).max() <= 1.5


@pytest.mark.parametrize("depth", [16, 32])
@pytest.mark.parametrize("far", [1e9, -1e9, 1e300, math.inf, -math.inf, math.nan])
def test_a_disc_far_away_or_nowhere_is_not_drawn(far: float, depth: int) -> None:
    for centre in ((far, 40.0), (40.0, far), (far, far)):
        assert not drawn(Surface((100, 80), depth=depth), np.array([centre]), 5.0).any()


@pytest.mark.parametrize(("radius", "depth"), [(1e3, 16), (1e9, 16), (1e3, 32), (1e9, 32), (1e300, 32)])
def test_a_disc_larger_than_the_surface_fills_it(radius: float, depth: int) -> None:
    surface = Surface((100, 80), depth=depth)
    assert (drawn(surface, np.array([(40.0, 40.0)]), radius, "white") == 255).all()


@pytest.mark.parametrize("degrees", range(0, 360, 30))
def test_the_line_shows_the_angle(degrees: int) -> None:
    angle = math.radians(degrees)
    surface = Surface((100, 80))
    surface.fill("white")
    dark = 1 - drawn(surface, np.array([(40.4, 40.2)]), 12.0, "white", angle)[..., 0] / 255
    across, down = np.mgrid[0:100, 0:80] + 0.5
    middle = (dark * across).sum() / dark.sum(), (dark * down).sum() / dark.sum()
    assert middle == pytest.approx((40.4 + 5.5 * math.cos(angle), 40.2 + 5.5 * math.sin(angle)), abs=0.2)
    assert dark.sum() == pytest.approx(11.0, rel=0.12)


def test_a_disc_at_the_edge_of_a_pane_stays_in_it() -> None:
    centres = np.array([(0, 10), (30, 10), (15, 0), (15, 20), (-30, -30), (29.6, 19.7), (12.2, 8.9)], float)
    window = Surface((100, 80))
    window.fill("white")
    drawn(window.subsurface((40, 30, 30, 20)), centres, 5.5)
    alone = Surface((30, 20))
    alone.fill("white")
    assert np.array_equal(pixels(window.subsurface((40, 30, 30, 20))), drawn(alone, centres, 5.5))
    window.fill("white", (40, 30, 30, 20))
    assert (pixels(window) == 255).all()


@pytest.mark.parametrize("depth", [16, 32])
@pytest.mark.parametrize(("radius", "is_drawn"), [(1.4, False), (1.6, True)])
def test_a_line_too_short_to_show_an_angle_is_not_drawn(radius: float, is_drawn: bool, depth: int) -> None:
    pictures = [drawn(white_surface(depth), np.array([[40.0, 40.0]]), radius, angle=angle) for angle in (None, 1.0)]
    assert (pictures[0] != pictures[1]).any() == is_drawn
