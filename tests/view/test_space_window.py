"""The window of a Space: what it draws, and its keys and mouse."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pymunk
import pytest
from conftest import Command
from pygame.event import Event
from window_driver import pixels, press

import sandbox
from sandbox.space.description import describe
from sandbox.space.side_by_side import COARSE, FINE
from sandbox.view.space_window import KEYS, SpaceWindow

RED = (200, 30, 30)
pytestmark = pytest.mark.usefixtures("memory_screen")


def level(gravity: float = 900) -> pymunk.Space:
    """A red box that falls on a floor, and a ball on a spring."""
    space = pymunk.Space()
    space.gravity = (0, gravity)
    down = 1 if gravity > 0 else -1
    floor = pymunk.Segment(space.static_body, (0, 400 * down), (600, 400 * down), 3)
    box, ball = pymunk.Body(1, 300), pymunk.Body(1, 100)
    box.position, ball.position = (150, 100 * down), (450, 200 * down)
    square = pymunk.Poly.create_box(box, (40, 40))
    square.color = (*RED, 255)
    spring = pymunk.DampedSpring(space.static_body, ball, (450, 0), (0, 0), 200, 50, 1)
    space.add(floor, box, square, ball, pymunk.Circle(ball, 20), spring)
    return space


@pytest.fixture
def space_window() -> Iterator[SpaceWindow]:
    window = SpaceWindow(describe(level()), "level.json")
    yield window
    window.pair.close()


def red_rows(window: SpaceWindow, side: int) -> np.ndarray:
    """Return the rows of a pane in which the red box is."""
    window.frame(0)
    pane = window.screen.subsurface(window.view.layout(window.screen.get_size()).arenas[side])
    return np.flatnonzero((np.abs(pixels(pane).astype(int) - RED).sum(axis=2) < 30).any(axis=0))


def test_both_panes_draw_the_space_where_its_bodies_are(space_window: SpaceWindow) -> None:
    layout = space_window.view.layout(space_window.screen.get_size())
    for side in (COARSE, FINE):
        rows = red_rows(space_window, side)
        assert np.ptp(rows) == pytest.approx(40 * layout.scale, abs=3)
        middle = space_window.view.place(layout, side, (0, layout.arenas[side].y + int(rows.mean())))
        assert middle[1] == pytest.approx(100, abs=2)


def test_y_points_up_where_gravity_points_down_that_way(space_window: SpaceWindow) -> None:
    upward = SpaceWindow(describe(level(-900)), "level.json")
    assert (red_rows(upward, COARSE) == red_rows(space_window, COARSE)).mean() > 0.95
    for _ in range(20):
        upward.pair.step()
        space_window.pair.step()
    assert red_rows(upward, FINE).mean() == pytest.approx(red_rows(space_window, FINE).mean(), abs=1.5)
    assert upward.pair.sides[FINE].bodies[0].position.y < -100
    upward.pair.close()


def test_keys_pause_step_restart_and_close(space_window: SpaceWindow) -> None:
    window = space_window
    window.frame(1 / 60)
    assert window.pair.steps == 1
    press(window, "Space")
    window.frame(1 / 60)
    assert window.pair.steps == 1
    press(window, "o")
    assert window.pair.steps == 2
    press(window, "Space")
    window.frame(1.0)  # a frame that took long
    assert window.pair.steps == 6
    press(window, "r")
    assert window.pair.steps == 0
    press(window, "F7")
    press(window, "F7")
    press(window, "Esc")
    assert not window.running


@pytest.mark.parametrize("side", [COARSE, FINE])
def test_the_mouse_drags_a_body_in_both(space_window: SpaceWindow, side: int) -> None:
    window = space_window
    layout = window.view.layout(window.screen.get_size())

    def at(x: float, y: float) -> tuple[int, int]:
        left, top, _, _ = window.pair.view
        right, down = layout.to_screen(side, (x - left, y - top))
        return round(right), round(down)

    window.on_event(Event(pygame.MOUSEBUTTONDOWN, pos=at(150, 100), button=1))
    window.on_event(Event(pygame.MOUSEMOTION, pos=at(300, 200), buttons=(1, 0, 0)))
    for _ in range(60):
        window.frame(1 / 60)
    for one in window.pair.sides:
        assert one.bodies[0].position.get_distance((300, 200)) < 5
    window.on_event(Event(pygame.MOUSEBUTTONUP, pos=at(300, 200), button=1))
    assert window.pair.held is None


def test_the_panes_zoom_and_show_all_again(space_window: SpaceWindow) -> None:
    height = np.ptp(red_rows(space_window, COARSE))
    left, top, right, bottom = space_window.pair.view
    box = (150 - left) / (right - left), (100 - top) / (bottom - top)
    space_window.view.lens = space_window.view.lens.zoomed(2, box)
    assert np.ptp(red_rows(space_window, COARSE)) == pytest.approx(2 * height, abs=4)
    press(space_window, "0")
    assert np.ptp(red_rows(space_window, COARSE)) == height


@pytest.mark.usefixtures("no_display")
def test_without_a_display_there_is_a_picture(working_folder: Path, command: Command) -> None:
    sandbox.save_space(level(), "level.json")
    code, out, _err = command("run", "level.json")
    first, second, third = out.splitlines()
    assert (code, first) == (0, "No display: running 5 s instead of opening the window.")
    assert second.startswith("pymunk and pymunk in 64 substeps, 40 iterations, after 5 s: ")
    assert third == "Picture of the end: level-000300.png"
    picture = pygame.image.load("level-000300.png")
    assert ((pixels(picture).astype(int) - RED) == 0).all(axis=2).any()


@pytest.mark.usefixtures("no_display")
def test_options_of_scenes_and_broken_files_are_refused(working_folder: Path, command: Command) -> None:
    assert command("run", "level.json", "--seed", "3")[::2] == (2, "--seed is for scenes; level.json is a Space\n")
    assert command("run", "level.json")[::2] == (2, "level.json: cannot be read: No such file or directory\n")
    Path("level.json").write_text('{"format": "pymunk-sandbox space", "version": 3, "pymunk": "7"}')
    assert command("run", "level.json")[::2] == (2, "level.json: version must be 1, got 3\n")


def test_a_narrow_window_names_all_keys_and_cuts_nothing_off(space_window: SpaceWindow) -> None:
    space_window.screen = pygame.display.set_mode((640, 480))
    space_window.draw()
    status = space_window.view.layout((640, 480)).status
    for line in (status, status.move(0, status.height)):
        drawn = pixels(space_window.screen.subsurface(line))
        assert not (drawn == drawn[-1, -1]).all()
        assert (drawn[-status.height :] == drawn[-1, -1]).all()


def test_the_line_below_names_the_keys_and_what_is_missing(space_window: SpaceWindow) -> None:
    assert all(key in KEYS for key in ("Space", "Esc", "R "))
    space = level()
    next(iter(space.bodies)).velocity_func = lambda *_: None
    window = SpaceWindow(describe(space), "level.json")
    assert window.pair.readout.endswith("; without 1 function of the program")
    window.pair.close()
