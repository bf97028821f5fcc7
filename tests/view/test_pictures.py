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
from window_driver import press, run

from sandbox.scene.files import load
from sandbox.view.window import Window

DOCS: Final = Path(__file__).parents[2] / "docs"
SIZE: Final = (1024, 640)
MAX_CHANGED: Final = 0.01  # share of the pixels: the last digits of a text, or a ball by a px


def window_of(scene: str, engines: list[str] | None, steps: int) -> Window:
    """Return a window that is paused after some steps."""
    window = Window(load(scene), engines)
    window.screen = pygame.display.set_mode(SIZE)
    window.about.close()
    press(window, "p")
    run(window, steps)
    return window


def default_window() -> Window:
    """At 5 s of 12, of which all are in the charts."""
    window = window_of("article", None, 720)
    for _ in range(7):
        press(window, "PageUp")
    window.playback.settle()
    return window


PICTURES: Final[dict[str, Callable[[], Window]]] = {"toolbar.png": default_window}


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
