"""Time of a frame of the window, on SDL's dummy screen."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Final

import pygame
from pymunk.pygame_util import DrawOptions

from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_in
from sandbox.bench.plain import plain_space
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.view.window import FRAME_RATE, Window

WINDOW_SIZE: Final = (1680, 1010)  # px; both panes are then as large as the scene, with the charts below
DRIVER: Final = "SDL_VIDEODRIVER"  # environment variable that selects SDL's screen


def frame() -> Iterator[Figure]:
    """Measure a frame of two panes and charts, with physics, and relative to a plain Pymunk loop with debug draw."""
    with _dummy_screen():
        for scene in (load("article"), load("gas-100"), load("gas-1000")):
            yield from _frame(scene)


@contextmanager
def _dummy_screen() -> Iterator[None]:
    before = os.environ.get(DRIVER)
    os.environ[DRIVER] = "dummy"
    try:
        yield
    finally:
        pygame.display.quit()
        if before is None:
            del os.environ[DRIVER]
        else:
            os.environ[DRIVER] = before


def _frame(scene: Scene) -> Iterator[Figure]:
    window, space, n = Window(scene, ["pymunk", "article"]), plain_space(scene), len(scene.bodies)
    window.screen = pygame.display.set_mode(WINDOW_SIZE)
    surface = pygame.Surface([int(side) for side in scene.arena.size])
    options = DrawOptions(surface)

    def ours() -> None:
        window.playback.advance(1 / FRAME_RATE)
        window.draw()
        pygame.display.flip()

    def plain() -> None:
        space.step(1 / scene.rate)
        surface.fill("white")
        space.debug_draw(options)

    rounds = alternately(*(partial(processor_time, act, repeats_in(act, 0.1)) for act in (ours, plain)))
    yield figure(f"frame n={n}", f"{n:,} balls: frame of two panes", [1000 * a for a, _ in rounds], "ms")
    yield figure(f"frame / plain n={n}", f"{n:,} balls: frame / plain Pymunk's, one pane", [a / b for a, b in rounds])


def first_frame() -> None:
    """Open the window on the article's scene, as `sandbox` does, and draw one frame."""
    Window(load("article"), None).draw()
