"""Pymunk's pane is drawn by `Space.debug_draw`; above 300 shapes by a batch that looks the same."""

import signal
from unittest.mock import patch

import numpy as np
import pymunk
import pytest
from conftest import scene_of
from numpy.typing import NDArray
from pygame import Color, Surface
from window_driver import colour_at, pixels

from sandbox.bench.engines import gas
from sandbox.engines import create
from sandbox.engines.pymunk import PymunkEngine
from sandbox.scene.fields import rgb
from sandbox.scene.spawn import spawn
from sandbox.view import debug_draw
from sandbox.view.debug_draw import DebugDraw
from sandbox.view.window import Window

BALL = 'radius = 30\nposition = [200, 300]\ncolors = ["#d55e00"]'
SCALE, ORIGIN = 0.71, (3.3, 7.1)


def drawn(draw: DebugDraw) -> NDArray[np.uint8]:
    surface = Surface((640, 480))
    surface.fill("white")
    draw.draw(surface, SCALE, ORIGIN)
    return pixels(surface)


@pytest.mark.parametrize("balls", [50, 300, 301])
def test_the_batch_draws_the_same_pixels_as_debug_draw(balls: int, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = gas(balls, 0.6)
    engine = create("pymunk", scene, spawn(scene))
    assert isinstance(engine, PymunkEngine)
    for _ in range(30):
        engine.step()  # until some touch
    draw = DebugDraw(engine.space, scene.colors, Color("black"))
    pictures = []
    for limit in (1_000_000, 0):
        monkeypatch.setattr(debug_draw, "MAX_SHAPES", limit)
        assert draw.is_batch == (not limit)
        pictures.append(drawn(draw))
    assert np.array_equal(pictures[0], pictures[1])


def test_a_peg_is_drawn_as_walls_are(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(BALL).changed(pegs=[{"radius": 40, "positions": [(500, 300)]}])
    engine = create("pymunk", scene, spawn(scene))
    assert isinstance(engine, PymunkEngine)
    draw = DebugDraw(engine.space, scene.colors, Color("#123456"))
    x, y = (round(SCALE * at + shift) for at, shift in zip((500, 300), ORIGIN, strict=True))
    for limit in (1_000_000, 0):
        monkeypatch.setattr(debug_draw, "MAX_SHAPES", limit)
        inked = (drawn(draw) == rgb("#123456")).all(axis=2)
        around = inked[x - 35 : x + 35, y - 35 : y + 35]
        assert around.sum() == pytest.approx(np.pi * (40 * SCALE) ** 2, rel=0.05)
        assert inked[x + 20, y]
        assert inked[x, y - 20]


@pytest.mark.parametrize(("balls", "is_batch"), [(296, False), (297, True)])
def test_up_to_300_shapes_are_drawn_by_debug_draw(balls: int, is_batch: bool) -> None:
    scene = gas(balls, 0.3)
    engine = create("pymunk", scene, spawn(scene))
    assert isinstance(engine, PymunkEngine)
    draw = DebugDraw(engine.space, scene.colors, Color("black"))
    assert len(engine.space.shapes) == balls + 4
    with patch.object(pymunk.Space, "debug_draw") as called:
        drawn(draw)
    assert called.called != is_batch


def test_the_colour_of_the_space_s_own_shape_decides(memory_screen: None) -> None:
    window = Window(scene_of(BALL), ["pymunk", "impulse"])
    engine = window.view.session.lockstep.engines["pymunk"].engine
    assert isinstance(engine, PymunkEngine)
    window.draw()
    assert colour_at(window, 200, 315) == rgb("#d55e00")
    for shape in engine.space.shapes:
        if isinstance(shape, pymunk.Circle):
            shape.color = (0, 114, 178, 255)
    again = DebugDraw(engine.space, window.scene.colors, Color("black"))
    surface = Surface((400, 400))
    again.draw(surface, 1.0)
    assert tuple(surface.get_at((200, 315)))[:3] == (0, 114, 178)


def test_a_signal_that_comes_while_pymunk_calls_for_a_shape_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(BALL)
    engine = create("pymunk", scene, spawn(scene))
    assert isinstance(engine, PymunkEngine)
    draw = DebugDraw(engine.space, scene.colors, Color("black"))
    draws: list[tuple[object, ...]] = []

    def interrupted(*given: object) -> None:
        signal.raise_signal(signal.SIGINT)
        draws.append(given)

    monkeypatch.setattr(type(draw._smooth), "draw_circle", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it in what runs in background
    with pytest.raises(KeyboardInterrupt):
        drawn(draw)
    signal.signal(signal.SIGINT, before)
    assert draws
