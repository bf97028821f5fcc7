"""The pictures of the window in the documentation show the window as it is.

SANDBOX_WRITE_DOCS=1 .venv/bin/pytest -q tests/view/test_pictures.py

draws them anew.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
import pygame
import pytest
from window_driver import WorkerHere, hover, mouse, point, press, run, use

from sandbox.scene.files import load
from sandbox.view import Layer
from sandbox.view.case_so_far import CaseSoFar
from sandbox.view.controls import Panel
from sandbox.view.instruments import SPEEDS
from sandbox.view.window import Window

DOCS: Final = Path(__file__).parents[2] / "docs"
SIZE: Final = (1280, 800)
MAX_CHANGED: Final = 0.01  # share of the pixels: the last digits of a text, or a ball by a px


def window_of(scene: str, engines: list[str] | None, steps: int, *, compared: bool = True) -> Window:
    """Return a window that is paused after some steps."""
    window = Window(load(scene), engines)
    window.screen = pygame.display.set_mode(SIZE)
    window.showing |= {Layer.GHOSTS} | ({Layer.NUMBERS} if len(window.scene.bodies) <= 30 else set())
    window.panel.show(Panel.SCENE)
    window.why.case = CaseSoFar(WorkerHere())
    press(window, "Space")
    run(window, steps)
    for _ in range(2 if compared else 0):  # to compare, and to note what was found
        window.why.update()
    window.view.mark(window.why.marks)
    return window


def default_window() -> Window:
    """At 5 s of 12, of which all are in the chart."""
    window = window_of("article", None, 720)
    window.playback.seek(300)
    window.playback.settle()
    return window


def balls() -> Window:
    """A ball is selected, and moved by the mouse."""
    window = window_of("billiards", ["pymunk", "exact"], 40)
    press(window, "F3")
    use(window, "Move")
    x, y = window.view.panes[0].state.position[0].tolist()
    hover(window, point(window, x, y))
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, x, y))
    mouse(window, pygame.MOUSEMOTION, point(window, x + 80, y + 60))
    return window


def gas() -> Window:
    """A gas with the histogram of its speeds, which has no marks."""
    window = window_of("gas-1000", None, 240, compared=False)
    window.view.charts.show(SPEEDS)
    return window


def why_window() -> Window:
    """At the article's first contact, which Pymunk finds late."""
    window = window_of("article", ["pymunk", "article"], 60)
    for key in ("w", ">", "<"):
        press(window, key)
        window.frame(1 / 60)
        window.frame(1 / 60)
    return window


def picker() -> Window:
    """With every picture in sight drawn."""
    window = window_of("head-on", None, 0)
    press(window, "/")
    window.draw()
    while window.scenes.picker and not window.scenes.picker.is_complete:
        window.draw()
    press(window, "Right", "Right")
    return window


def two_pymunks() -> Window:
    """With the panel of engines."""
    window = window_of("newtons-cradle", ["pymunk(iterations=30, substeps=4)", "pymunk"], 240)
    press(window, "F4")
    return window


PICTURES: Final[dict[str, Callable[[], Window]]] = {
    "toolbar.png": default_window,
    "engines.png": two_pymunks,
    "picker.png": picker,
    "inspector.png": balls,
    "instruments.png": gas,
    "why.png": why_window,
}


@pytest.mark.wide
@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_in_the_documentation_is_what_the_window_draws(name: str) -> None:
    window = PICTURES[name]()
    window.draw()
    if os.environ.get("SANDBOX_WRITE_DOCS") == "1":
        pygame.image.save(window.screen, DOCS / name)
    shown, drawn = (
        pygame.surfarray.array3d(one).astype(int) for one in (pygame.image.load(DOCS / name), window.screen)
    )
    assert shown.shape == drawn.shape
    assert (np.abs(shown - drawn).max(axis=2) > 64).mean() < MAX_CHANGED
