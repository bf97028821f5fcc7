"""Time of a frame of the window, on SDL's dummy screen."""

import os
from collections.abc import Iterator
from functools import partial
from typing import Final
from unittest.mock import patch

import pygame
from pymunk.pygame_util import DrawOptions

from sandbox.bench.engines import plain_space
from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_of
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.view.window import FRAME_RATE, Window

WINDOW_SIZE: Final = (1680, 1010)  # px; large enough for both panes at the size of the scene, and the charts below
MIN_FRAMES: Final = 8  # in a round: the garbage collector runs in some frames only


def frame(rounds: int) -> Iterator[Figure]:
    """Measure a frame of two panes and charts, and relative to plain Pymunk's with one pane.

    Plain Pymunk's frame is a step, and its own debug-draw.
    """
    with patch.dict(os.environ, {"SDL_VIDEODRIVER": "dummy"}):
        try:
            for scene in (load("article"), load("gas-1000"), finer_gas(20_000)):
                yield from _frame(scene, rounds)
        finally:
            pygame.display.quit()


def finer_gas(n: int) -> Scene:
    """Make the scene gas-1000 with n smaller balls: they cover the same area, at as many radii per step."""
    smaller = (1_000 / n) ** 0.5
    balls = f"{{ count = {n}, radius = {5.5 * smaller}, inside = [[0, 0], [800, 600]], rms_speed = {100 * smaller} }}"
    return parse(f"arena.size = [800, 600]\nballs = [{balls}]", f"gas-{n}")


def _frame(scene: Scene, rounds: int) -> Iterator[Figure]:
    n, space = len(scene.bodies), plain_space(scene)
    window = Window(scene, ["pymunk", "article"])
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

    acts = [(act, max(MIN_FRAMES, repeats_of(act))) for act in (ours, plain)]
    measured = alternately(rounds, *(partial(processor_time, act, frames) for act, frames in acts))
    yield figure(f"frame n={n}", f"{n:,} balls: frame of two panes", [1000 * a for a, _ in measured], "ms")
    yield figure(f"frame / plain n={n}", f"{n:,} balls: frame / plain Pymunk's pane", [a / b for a, b in measured])
