"""Small pictures of scenes at their start, drawn a few at a time."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Final

import pygame
from pygame import Rect, Surface

from sandbox.errors import SandboxError
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.view.discs import Discs
from sandbox.view.palette import palette
from sandbox.view.pane import draw_walls
from sandbox.view.primitives import wrapped, write
from sandbox.view.theme import theme

MAX_KEPT: Final = 256  # pictures
FRAME_SHARE: Final = 0.012  # s of a frame that new pictures may take, plus what the last of them takes
ERROR_LINES: Final = 4  # of a scene with errors


@dataclass(frozen=True)
class Preview:
    """A scene's picture and texts; both are empty until they are drawn."""

    surface: Surface
    title: str = ""
    about: str = ""


class Previews:
    """Pictures of scenes, which are kept; new ones are drawn for a share of each frame.

    is_complete: whether all that were asked for since `begin_frame` are there.
    """

    def __init__(self, clock: Callable[[], float] = perf_counter) -> None:
        self._clock = clock
        self._kept: dict[object, Preview] = {}
        self.begin_frame()

    def begin_frame(self) -> None:
        """Let new pictures be drawn for the share of another frame."""
        self._deadline: float | None = None
        self.is_complete = True

    def of(self, file: Path, size: tuple[int, int], text_height: int) -> Preview:
        """Return the picture of a file's scene, or an empty one if this frame has no time for it."""
        key = file, _stamp(file), size, text_height, theme.is_dark
        if key not in self._kept:
            if self._deadline is None:
                self._deadline = self._clock() + FRAME_SHARE
            elif self._clock() > self._deadline:
                self.is_complete = False
                empty = Surface(size, pygame.SRCALPHA)
                pygame.draw.rect(empty, theme.hover, empty.get_rect(), border_radius=text_height // 3)
                return Preview(empty)
            if len(self._kept) >= MAX_KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = _preview(file, size, text_height)
        return self._kept[key]


def _stamp(file: Path) -> int:
    """Return when a file was last changed, ns."""
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return 0


def _preview(file: Path, size: tuple[int, int], text_height: int) -> Preview:
    """Draw a scene's start, or write its first error."""
    surface = Surface(size, pygame.SRCALPHA)
    try:
        scene = load(file)
        draw_start(surface, scene)
    except SandboxError as error:
        height = round(0.85 * text_height)
        line = Rect(0, 0, size[0], round(1.3 * height))
        for text in wrapped(str(error).splitlines()[0], size[0], height)[:ERROR_LINES]:
            write(surface, text, line, theme.dim, height)
            line.y += line.height
        return Preview(surface, "has errors")
    return Preview(surface, scene.title, scene.about)


def draw_start(surface: Surface, scene: Scene) -> None:
    """Draw a scene's start as large as a surface allows, at its left."""
    state = spawn(scene)
    scale = min(have / need for have, need in zip(surface.get_size(), scene.arena.size, strict=True))
    arena = Rect(0, 0, max(1, round(scene.arena.size[0] * scale)), max(1, round(scene.arena.size[1] * scale)))
    arena.midleft = surface.get_rect().midleft
    inside = surface.subsurface(arena.clip(surface.get_rect()))
    inside.fill(palette(scene.arena.background).ground)
    draw_walls(inside, scene, scale)
    discs = Discs(scene.bodies.radius, scene.colors)
    discs.draw(inside, state.position, scale, state.angle)
    pygame.draw.rect(surface, theme.wall, arena, 1)
