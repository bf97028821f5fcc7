"""What the window shows while kernels are compiled."""

import os
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from typing import Any

import pygame
import pytest
from pygame import Surface

from sandbox import compiled
from sandbox.scene.fields import rgb
from sandbox.scene.files import load
from sandbox.view.compilation import Compilation, Target
from sandbox.view.compiling import WindowCompiler, compiling_beside_window
from sandbox.view.theme import theme
from sandbox.view.window import Window


class Halfway(Compilation):
    """One of four parts is compiled, and another one being compiled, for some looks."""

    def __init__(self, looks: int) -> None:
        super().__init__((), at_once=1)
        self.looks = looks

    def until_compiled(self, module: str) -> Iterator[Compilation]:
        while self.is_running:
            self.looks -= 1
            yield self

    def poll(self) -> None:
        self.looks -= 1

    is_running = property(lambda self: self.looks > 0)
    done = property(lambda _: 1)
    total = property(lambda _: 4)

    def __str__(self) -> str:
        return "Compiling article (once): 2 of 4"


def row_of_bar(surface: Surface) -> tuple[int, int]:
    """Return how many pixels of a progress bar are filled and empty, in the row that has most of them."""
    ink, raised = (surface.map_rgb(pygame.Color(colour)) for colour in (theme.accent, theme.line))
    pixels = pygame.surfarray.pixels2d(surface).T
    rows = [((row == ink).sum(), (row == raised).sum()) for row in pixels]
    filled, empty = max(rows, key=lambda row: row[1] if row[0] else 0)
    return int(filled), int(empty)


@pytest.fixture
def screen(memory_screen: Any) -> Iterator[None]:
    pygame.display.quit()  # another test's window
    pygame.display.init()
    yield
    pygame.display.quit()


@pytest.mark.usefixtures("screen")
def test_a_notice_with_a_bar_is_shown_while_a_kernel_is_waited_for() -> None:
    compiler = WindowCompiler((640, 360))
    compiler.compilation = Halfway(looks=3)
    compiler.wait("sandbox.engines.article")
    shown = pygame.display.get_surface()
    assert shown.get_size() == (640, 360)
    filled, empty = row_of_bar(shown)
    assert filled + empty > 150
    assert filled == pytest.approx((filled + empty) / 4, abs=1)


@pytest.mark.usefixtures("screen")
def test_the_scene_is_shown_at_its_start_while_its_engine_is_waited_for() -> None:
    compiler = WindowCompiler((640, 360), load("break-shot"))
    compiler.compilation = Halfway(looks=3)
    compiler.wait("sandbox.engines.article")
    shown = pygame.display.get_surface()
    scale = 600 / 1000  # of the arena, which is as wide as the window but for its margins
    cue = load("break-shot").balls[0].position
    assert cue
    at = round(20 + scale * cue[0]) - 4, round(30 + scale * cue[1])  # beside the line of its angle
    assert tuple(shown.get_at(at))[:3] == rgb("white")
    assert tuple(shown.get_at((at[0] - 20, at[1])))[:3] == rgb("#14532d")
    assert row_of_bar(shown)[0]


@pytest.mark.usefixtures("screen")
def test_keys_pressed_while_a_kernel_is_waited_for_are_not_done_afterwards() -> None:
    compiler = WindowCompiler((640, 360))
    compiler.compilation = Halfway(looks=3)
    pygame.display.set_mode((640, 360))
    pygame.event.clear()
    for kind in (pygame.KEYDOWN, pygame.KEYUP):
        pygame.event.post(pygame.event.Event(kind, key=pygame.K_n, unicode="n", mod=0))
    compiler.wait("sandbox.engines.article")
    assert [event.type for event in pygame.event.get((pygame.KEYDOWN, pygame.KEYUP))] == [pygame.KEYUP]


def wait() -> None:
    compiler = WindowCompiler((640, 360))
    compiler.compilation = Halfway(looks=3)
    compiler.wait("sandbox.engines.article")


@pytest.mark.usefixtures("screen")
def test_the_window_opens_with_its_title(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []

    def set_mode(size: tuple[int, int], _flags: int) -> Surface:
        opened.append(pygame.display.get_caption()[0])
        raise SystemExit

    monkeypatch.setattr(pygame.display, "set_mode", set_mode)
    scene = load("head-on")
    pygame.display.set_caption("pygame window")
    with suppress(SystemExit), compiling_beside_window(scene, None):
        wait()
    pygame.display.set_caption("pygame window")
    with suppress(SystemExit):
        Window(scene, None)
    assert opened == [f"{scene.title} - sandbox"] * 2


@pytest.mark.usefixtures("screen")
def test_closing_the_window_ends_the_wait() -> None:
    compiler = WindowCompiler((640, 360))
    compiler.compilation = Halfway(looks=10**6)
    pygame.display.set_mode((640, 360))
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    with pytest.raises(SystemExit):
        compiler.wait("sandbox.engines.article")


@pytest.mark.usefixtures("screen")
def test_the_status_line_shows_the_bar_until_all_is_compiled() -> None:
    window = Window(load("article"), None, (), Halfway(looks=3))
    window.playback.paused = True
    window.frame(0.0)
    line = window.screen.subsurface(window.layout.status)
    bar = line.subsurface((line.get_width() - 80 - window.text_height, 0, 80, line.get_height()))
    assert row_of_bar(bar) == (20, 60)
    window.frame(0.0)
    window.frame(0.0)
    window.draw()
    assert row_of_bar(bar)[0] == 0


@pytest.mark.usefixtures("screen")
def test_compiling_ends_with_the_window(monkeypatch: pytest.MonkeyPatch) -> None:
    endless = Target("endless", ("sandbox",), partial(os.system, "sleep 60"))
    monkeypatch.setattr("sandbox.view.compiling.COMPUTATION", (endless,))
    with compiling_beside_window(load("article"), None) as compilation:
        assert compiled._compiler is not None
        compiled._compiler.note_missing("sandbox.quantity")
        assert compilation.is_running
    assert compiled._compiler is None
    assert not compilation.is_running
