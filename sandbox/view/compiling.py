"""Compiling while the window is open: what is shown meanwhile."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Final

import pygame
from pygame import Rect, Surface

from sandbox.compiled import NotCompiledYet, compile_by, without_waiting
from sandbox.errors import SandboxError
from sandbox.processes import core_count
from sandbox.scene.model import Scene
from sandbox.view.compilation import COMPUTATION, DRAWING, Compilation
from sandbox.view.display import PRESSES, caption, set_mode
from sandbox.view.layout import GAP, natural_size
from sandbox.view.offscreen import draw_start
from sandbox.view.primitives import panel, shortened, text_width, write
from sandbox.view.theme import theme

TEXT_HEIGHT: Final = 16  # px, of the notice in the middle of the window
BAR_WIDTH: Final = 160  # px


class WindowCompiler:
    """Has one part after another compiled beside the window, and shows a notice in it while one is waited for.

    size: of the window that it opens if none is open, px; scene: that it shows there meanwhile.
    """

    shows_frames = True

    def __init__(self, size: tuple[int, int], scene: Scene | None = None) -> None:
        others = core_count() - 1  # than the one that the window needs
        self.compilation = Compilation((*COMPUTATION, DRAWING), at_once=max(1, others))
        self._size = size
        self._undrawn: Scene | None = None  # as its balls could not be placed without waiting
        self._scene = scene

    def note_missing(self, module: str) -> None:
        """Begin to compile."""
        self.compilation.poll()

    def wait(self, module: str) -> None:
        """Show a notice until the kernels of a module are compiled. Raises SystemExit if the window is closed."""
        for progress in self.compilation.until_compiled(module):
            surface = pygame.display.get_surface() or self._open()
            if self._undrawn:  # as soon as its balls can be placed without waiting
                arena = Rect(0, 0, *map(round, self._undrawn.arena.size))
                place = arena.fit(surface.get_rect().inflate(-4 * GAP, -4 * GAP))
                with suppress(NotCompiledYet, SandboxError), without_waiting():
                    draw_start(surface.subsurface(place), self._undrawn)
                    self._undrawn = None
            draw_progress(surface, progress)
            pygame.display.flip()
            if pygame.event.peek(pygame.QUIT):  # which also lets the system know that the window is alive
                raise SystemExit
            pygame.event.clear(PRESSES)  # or all of them would be done at once when the wait is over

    def _open(self) -> Surface:
        screen = set_mode(self._size)
        screen.fill(theme.ground)
        self._undrawn = self._scene
        return screen


@contextmanager
def compiling_beside_window(scene: Scene, engines: Sequence[str] | None) -> Iterator[Compilation]:
    """Have kernels that are not in the cache compiled while the window of a scene is open, in this block.

    engines: those to be shown, if they are known.
    """
    pygame.display.init()
    pygame.display.set_caption(caption(scene))
    compiler = WindowCompiler(natural_size(pygame.display.get_desktop_sizes()[0]), scene)
    compile_by(compiler)
    try:
        yield compiler.compilation
    finally:
        compile_by(None)
        compiler.compilation.stop()


def draw_progress(surface: Surface, progress: Compilation) -> None:
    """Draw what is being compiled, and how far that is, in the middle of a surface."""
    text = str(progress)
    width = max(text_width(text, TEXT_HEIGHT), BAR_WIDTH)
    card = Rect(0, 0, width + 4 * GAP, 3 * TEXT_HEIGHT + 4 * GAP)
    card.center = surface.get_rect().center
    panel(surface, card)
    write(surface, text, Rect(card.x + 2 * GAP, card.y + GAP, width, 2 * TEXT_HEIGHT), theme.ink, TEXT_HEIGHT)
    _draw_bar(surface, Rect(card.x + 2 * GAP, card.bottom - 2 * GAP - 4, width, 4), progress)


def draw_status(surface: Surface, place: Rect, progress: Compilation, height: int) -> None:
    """Draw the same in a line of text, at the right end of its place. height: of the text, px."""
    width = min(place.width, status_width(progress, height))
    line = Rect(place.right - width, place.y, width, place.height)
    panel(surface, line)
    text = shortened(str(progress), width - 2 * height, height)
    left = write(surface, text, line.move(height, 0), theme.dim, height) + height
    _draw_bar(surface, Rect(left, line.centery - 2, max(0, line.right - height - left), 4), progress)


def status_width(progress: Compilation, height: int) -> int:
    """Return the width of that line, px."""
    return text_width(str(progress), height) + BAR_WIDTH // 2 + 3 * height


def _draw_bar(surface: Surface, place: Rect, progress: Compilation) -> None:
    surface.fill(theme.line, place)
    surface.fill(theme.accent, (place.x, place.y, round(place.width * progress.done / progress.total), place.height))
