"""Panes show every engine's balls and walls where they are."""

import math

import numpy as np
import pygame
import pytest
from conftest import ball_at, scene_of
from pygame import Color, Rect
from pymunk.pygame_util import DrawOptions
from window_driver import colour_at, pixels, point, press, run

from sandbox.analysis.reference import Trust
from sandbox.engines.pymunk import PymunkEngine
from sandbox.scene.fields import rgb
from sandbox.view.layout import TEXT_HEIGHT, Layout
from sandbox.view.primitives import text_width
from sandbox.view.run_so_far import Marks
from sandbox.view.session_view import AS_IT_SHOULD_BE, energy_in_words
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")
RED, BLUE = "#d55e00", "#0072b2"
TWO_BALLS = (ball_at(200, 300, vx=60, colors=[RED]), ball_at(600, 300, colors=[BLUE]))


@pytest.fixture
def window(memory_screen: None) -> Window:
    return Window(scene_of(*TWO_BALLS), None)


def test_beyond_the_horizon_an_energy_is_only_compared() -> None:
    balls = "radius = 20\npositions = [[200, 300], [300, 310]]\nvelocities = [[240, 0], [0, 0]]"
    window = Window(scene_of(balls), ["article"])
    run(window, 400)
    for horizon, words in ((None, "it should have"), (0.5, "exact")):
        window.view.mark(Marks(Trust(horizon)))
        window.draw()
        assert window.view.panes[0].energy_text.endswith(f" than {words}")


@pytest.mark.parametrize("name", ["pymunk", "pymunk(iterations=30, substeps=4)"])
def test_no_energy_is_cut_off_in_a_title_but_a_long_name(
    window: Window, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = set[str]()

    def note(_: object, text: str, place: Rect, __: object, height: int, *, bold: bool = False) -> int:
        drawn.add(text)
        assert text.startswith("py") or text_width(text, height, bold=bold) <= place.width
        return place.x + text_width(text, height, bold=bold)

    monkeypatch.setattr("sandbox.view.session_view.write", note)
    window.view.panes[0].error, window.view.panes[0].name = -12.0, name
    for width in range(60, 700, 5):
        layout = Layout((width, 500), (800, 600), 1, TEXT_HEIGHT)
        window.view.panes[0]._draw_title(window.screen, layout, 0, Color("red"))
    assert drawn >= {"", "12 % less", "12 % less than it should have", name}


def test_an_error_is_in_words() -> None:
    for error, words in ((-58, "58 % less than exact"), (4.23, "4.2 % more than exact"), (0, AS_IT_SHOULD_BE)):
        assert energy_in_words(error, "exact") == words


def shows_line(window: Window, x: float, y: float, pane: int = 0) -> bool:
    """Return whether a red ball has a smooth line in the colour of stock debug-draw at a place of the scene."""
    left, top = point(window, x, y, pane)
    seen = pixels(window.screen)[left - 1 : left + 2, top - 1 : top + 2]
    to_line = np.subtract(DrawOptions(window.screen).shape_outline_color.as_int()[:3], rgb(RED))
    share = (seen - np.array(rgb(RED))) @ to_line / (to_line @ to_line)
    assert np.abs(seen - (rgb(RED) + share[..., None] * to_line)).max() < 2
    return bool(share.sum() > 2)  # of 3 x 3 pixels


@pytest.mark.parametrize("quarter", [0, 1, 2, 3, 5])
def test_discs_in_debug_draw_show_their_angle(quarter: int) -> None:
    window = Window(scene_of(f'radius = 30\nposition = [200, 300]\ncolors = ["{RED}"]'), ["pymunk"])
    engine = window.view.session.lockstep.engines["pymunk"].engine
    assert isinstance(engine, PymunkEngine)
    [ball] = [body for body in engine.space.bodies if body.body_type == body.DYNAMIC]
    ball.angle = quarter * math.pi / 2
    window.draw()
    seen = [
        shows_line(window, 200 + 18 * x, 300 + 18 * y)
        for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))  # clockwise, as y goes down
    ]
    assert seen == [quarter % 4 == k for k in range(4)]


def test_balls_that_cannot_turn_have_the_line_of_their_angle_in_every_pane_alike() -> None:
    engines = ["pymunk", "article", "impulse", "exact"]
    window = Window(scene_of(f'radius = 30\nposition = [200, 300]\ncolors = ["{RED}"]'), engines)
    window.draw()
    for pane in range(4):
        assert shows_line(window, 218, 300, pane)
        assert not shows_line(window, 182, 300, pane)


def test_ghosts_are_the_outlines_of_the_other_pane_s_balls(window: Window) -> None:
    window.screen = pygame.display.set_mode((1600, 1000))
    inside = window.screen.subsurface(window.layout.arenas[0])
    window.draw()
    before = pixels(inside)
    press(window, "g")
    window.draw()
    assert np.array_equal(pixels(inside), before)
    press(window, "g")
    window.view.session.lockstep.engines["pymunk"].engine.kick(0, (0.0, 600.0))
    run(window, 6)  # the panes' first balls are 60 px apart now
    window.draw()
    x = 206 + 20  # the right edge of the article's ball, in Pymunk's pane
    assert colour_at(window, x, 300) == (255, 255, 255)
    press(window, "g")
    window.draw()
    angles = np.linspace(0, math.tau, 200, endpoint=False)
    ring = [colour_at(window, 206 + 20 * math.cos(angle), 300 + 20 * math.sin(angle)) for angle in angles]
    coloured = np.mean([colour != (255, 255, 255) for colour in ring])
    assert 0.4 < coloured < 0.9  # it is dashed
    assert colour_at(window, 206, 310) == (255, 255, 255)  # but not filled


@pytest.mark.parametrize("ends", [((300, 150), (500, 150)), ((300, 100), (500, 200)), ((300, 200), (500, 100))])
def test_inner_walls_have_their_thickness_at_any_slope_in_every_pane(
    ends: tuple[tuple[float, float], tuple[float, float]],
) -> None:
    (x0, y0), (x1, y1) = ends
    scene = scene_of(*TWO_BALLS, more=f"walls = [{{ from = [{x0}, {y0}], to = [{x1}, {y1}], thickness = 20 }}]")
    window = Window(scene, ["pymunk", "impulse"])
    window.screen = pygame.display.set_mode((1600, 1000))
    window.draw()
    ink, length = (0, 0, 0), math.dist(*ends)  # black on white
    for pane in range(2):
        for across, colour in ((-13, (255, 255, 255)), (-8, ink), (8, ink), (13, (255, 255, 255))):
            x, y = 400 - (y1 - y0) / length * across, 150 + (x1 - x0) / length * across
            assert colour_at(window, x, y, pane) == colour
