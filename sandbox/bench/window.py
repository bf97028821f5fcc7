"""How long a frame of the window takes, on a screen that is only in memory."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Final

import pygame
from pymunk.pygame_util import DrawOptions

from sandbox.bench.figure import Figure, figure, in_turn, seconds, times_for
from sandbox.bench.plain import plain_space
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.view.window import FRAME_RATE, Window

SIZE: Final = (1680, 1010)  # px; in it both panes are as large as the scene, with the charts below
DRIVER: Final = "SDL_VIDEODRIVER"  # SDL's choice of a screen


def frame() -> Iterator[Figure]:
    """Measure the window's frame, of two panes and charts with their physics, in turn with a plain Pymunk loop's."""
    with _screen_in_memory():
        for scene in (load("article"), load("gas-100"), load("gas-1000")):
            yield from _frame(scene)


@contextmanager
def _screen_in_memory() -> Iterator[None]:
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
    window.screen = pygame.display.set_mode(SIZE)
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

    rounds = in_turn(*(partial(seconds, act, times_for(act, 0.1)) for act in (ours, plain)))
    yield figure(f"frame n={n}", f"{n:,} balls: frame of two panes", [1000 * a for a, _ in rounds], "ms")
    yield figure(f"frame / plain n={n}", f"{n:,} balls: / plain Pymunk's of one pane", [a / b for a, b in rounds])


def first_frame() -> None:
    """Open the window on the article's scene, as `sandbox` does, and draw once."""
    Window(load("article"), None).draw()
