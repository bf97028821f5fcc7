"""Layers are drawn where the numbers say."""

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame import Color, Surface

from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Floats
from sandbox.view.overlay import ARROW_SECONDS, Overlay

BLUE = "#0072b2"
GREY = (128, 128, 128)
NO_TRAIL = np.empty((0, 1, 2))


@pytest.fixture
def scene() -> Scene:
    light = f'radius = 20\nmass = 1\nposition = [200, 300]\nvelocity = [300, -150]\ncolors = ["{BLUE}"]'
    return scene_of(light, "radius = 20\nmass = 3\nposition = [600, 300]\nvelocity = [0, 100]")


def overlay_of(scene: Scene, scale: float = 1.0, trail: Floats = NO_TRAIL) -> Overlay:
    """Make an overlay of a scene's start, on grey."""
    surface, start = Surface((round(800 * scale), round(600 * scale))), spawn(scene)
    surface.fill(GREY)
    return Overlay(surface, scene, start, scale, 16, (0.0, 0.0), trail)


def drawn(overlay: Overlay) -> pygame.Rect:
    """Return the smallest rectangle with all that was drawn on grey."""
    x, y = np.nonzero((pygame.surfarray.array3d(overlay.surface) != GREY).any(axis=2))
    return pygame.Rect(int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1)


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_a_velocity_arrow_ends_where_the_ball_would_be(scale: float) -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]\nvelocity = [300, -150]")
    overlay = overlay_of(scene, scale)
    overlay.velocity()
    box = drawn(overlay)
    assert box.bottomleft == pytest.approx((200 * scale, 300 * scale), abs=2)
    right, up = 300 * ARROW_SECONDS, 150 * ARROW_SECONDS
    assert box.topright == pytest.approx(((200 + right) * scale, (300 - up) * scale), abs=2)
    middle = round((200 + right / 2) * scale), round((300 - up / 2) * scale)
    assert overlay.surface.get_at(middle) == Color("black")


def test_a_trail_runs_through_its_places_and_is_fainter_for_older_ones() -> None:
    scene = scene_of(f'radius = 5\nposition = [100, 100]\ncolors = ["{BLUE}"]')
    places = [*((x, 100) for x in range(100, 501, 100)), (500, 300)]
    overlay = overlay_of(scene, trail=np.array(places, float)[:, None])
    overlay.trails()
    assert overlay.surface.get_at((500, 299)) == Color(BLUE)
    assert drawn(overlay).topleft == (100, 100)
    assert drawn(overlay).bottomright == pytest.approx((501, 301), abs=2)
    ground = Color("white")
    away = [abs(overlay.surface.get_at(at).r - ground.r) for at in ((110, 100), (310, 100), (500, 250))]
    assert 0 < away[0] < away[1] < away[2]


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Color]]:
    """The texts that are written, and their colours; each is drawn as a square of 8 px in its colour."""
    found = list[tuple[str, Color]]()

    def note(text: str, colour: Color, height: int) -> Surface:
        found.append((text, colour))
        square = Surface((8, 8))
        square.fill(colour)
        return square

    monkeypatch.setattr("sandbox.view.overlay.lettering", note)
    return found


def test_balls_have_their_numbers_in_scene_order(scene: Scene, written: list[tuple[str, Color]]) -> None:
    overlay = overlay_of(scene)
    overlay.numbers()
    assert written == [("0", Color("white")), ("1", Color("black"))]
    assert [overlay.surface.get_at((x, 300)) for x in (200, 600)] == [Color("white"), Color("black")]
