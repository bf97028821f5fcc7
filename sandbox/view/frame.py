"""How much a frame of the window costs, beside a plain Pymunk loop."""

import os
from collections.abc import Callable, Iterator
from statistics import median
from time import perf_counter
from typing import Final

import pygame
import pymunk
from pymunk.pygame_util import DrawOptions

from sandbox.bench import ROUNDS, Figure
from sandbox.engines.pymunk import PymunkEngine
from sandbox.scene import Scene, load, rgb
from sandbox.spawn import spawn
from sandbox.view.window import FRAMES, Window

WINDOW: Final = (1680, 1010)  # px; in it both panes are as large as the scene
WARM_UP: Final = 30  # frames


def frame_ratio(scene: str = "gas-1000", frames: int = 60) -> Iterator[Figure]:
    """Measure a frame of the window, two engines and their charts, in turn with a plain Pymunk loop's.

    That loop steps a space, and draws it with pymunk's own debug-draw on a screen of the arena's size.
    """
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    chosen = load(scene)
    window = Window(chosen, None)
    window.screen = pygame.display.set_mode(WINDOW)
    assert window.layout.strip.height
    frame, plain = _frame(window), _plain_frame(chosen)
    costs = []
    for round_ in range(ROUNDS + 1):
        pairs = [(_seconds(frame), _seconds(plain)) for _ in range(frames if round_ else WARM_UP)]
        if round_:
            costs.append([median(times) for times in zip(*pairs, strict=True)])
    of_window = [1000 * cost for cost, _ in costs]
    ratios = [cost / of_plain for cost, of_plain in costs]
    balls = len(chosen.bodies)
    yield _figure("frame", f"ms for a frame of the window, {balls:,} balls in two engines, and charts", of_window)
    yield _figure("frame / plain Pymunk", "the same beside a plain Pymunk loop's frame of the left pane", ratios)


def _frame(window: Window) -> Callable[[], None]:
    def frame() -> None:
        window.advance(1 / FRAMES)
        window.draw()
        pygame.display.flip()

    return frame


def _plain_frame(scene: Scene) -> Callable[[], None]:
    engine = PymunkEngine(scene, spawn(scene))
    space = engine.space
    for segment in [shape for shape in space.shapes if isinstance(shape, pymunk.Segment)]:
        space.remove(segment)
    width, height = scene.arena.size
    corners = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    for k in range(4):  # walls as a plain program has them, which are quicker to draw than very thick ones
        wall = pymunk.Segment(space.static_body, corners[k - 1], corners[k], 1)
        wall.elasticity = 1
        space.add(wall)
    for circle, colour in zip((s for s in space.shapes if isinstance(s, pymunk.Circle)), scene.colors, strict=True):
        circle.color = (*rgb(colour), 255)
    screen = pygame.Surface((round(width), round(height)))
    options = DrawOptions(screen)

    def frame() -> None:
        space.step(1 / FRAMES)
        screen.fill("white")
        space.debug_draw(options)

    return frame


def _seconds(act: Callable[[], None]) -> float:
    start = perf_counter()
    act()
    return perf_counter() - start


def _figure(name: str, means: str, values: list[float]) -> Figure:
    return Figure(name, means, median(values), min(values), max(values))
