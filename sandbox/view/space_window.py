"""The window of a Space: Pymunk beside its finer self, and the mouse drags bodies of both."""

from collections.abc import Callable
from functools import partial
from typing import Final

import pygame
from pygame import Surface
from pygame.event import Event

from sandbox.scene.fields import Vector
from sandbox.space.description import SpaceDescription
from sandbox.space.side_by_side import SIDES, SideBySide
from sandbox.view.controls import Action, control_of
from sandbox.view.debug_draw import SpaceOptions
from sandbox.view.display import open_window
from sandbox.view.layout import LINE, TEXT_HEIGHT, Layout, Lens
from sandbox.view.mouse_tool import ZOOM_FACTOR
from sandbox.view.offscreen import PICTURE_SIZE
from sandbox.view.pixels import fill
from sandbox.view.playback import Pace
from sandbox.view.primitives import shortened, write
from sandbox.view.theme import SystemTheme, theme

FRAME_RATE: Final = 60  # frames a second
MAX_FRAME: Final = 4 / FRAME_RATE  # s of the Space's time that pass in a frame at most
KEYS: Final = "Space pauses    O does a step    R restarts    the mouse drags, its wheel zooms    Esc closes"


class SpaceView:
    """Draws both Spaces, each in a pane, with their names above and how far they are apart below.

    lens: what the panes show of the shapes' surroundings at the start. y points up if gravity points down that way.
    """

    def __init__(self, description: SpaceDescription) -> None:
        self.pair = SideBySide(description)
        self.lens = Lens()
        self._options = SpaceOptions(Surface((1, 1)))
        self._options.y_is_up = description.settings.gravity[1] < 0

    def layout(self, size: tuple[int, int]) -> Layout:
        """Return the layout of a picture or window of some size, px, above the line of keys."""
        left, top, right, bottom = self.pair.view
        above = size[0], max(1, size[1] - round(LINE * TEXT_HEIGHT))
        return Layout(above, (right - left, bottom - top), len(SIDES), TEXT_HEIGHT, self.lens)

    def place(self, layout: Layout, side: int, point: tuple[int, int]) -> Vector:
        """Return the place in the Space at a point of the screen in a pane, px."""
        left, top, _, bottom = self.pair.view
        x, y = layout.to_scene(side, point)
        return left + x, bottom - y if self._options.y_is_up else top + y

    def draw(self, surface: Surface, more: str = "", keys: str = "") -> None:
        """Draw everything. more: what else the line below says; keys: what the last line says."""
        layout, pair = self.layout(surface.get_size()), self.pair
        fill(surface, theme.ground)
        left, top, _, bottom = pair.view
        for side, name in zip(SIDES, pair.names, strict=True):
            pane = surface.subsurface(layout.arenas[side].clip(surface.get_rect()))
            fill(pane, theme.pane)
            if not pair.broken:
                x, y = layout.origin
                down = bottom if self._options.y_is_up else -top
                self._options.show(pane, layout.scale, (x - left * layout.scale, y + down * layout.scale))
                pair.sides[side].space.debug_draw(self._options)
            pygame.draw.rect(surface, theme.wall, layout.arenas[side].inflate(2, 2), 1)
            title = layout.title(side)
            write(surface, shortened(name, title.width, layout.text_height), title, theme.ink, layout.text_height)
        for down, line in enumerate((f"{pair.time:.2f} s    {pair.readout}{more}", keys)):
            write(surface, line, layout.status.move(0, down * layout.line_height), theme.dim, layout.text_height)


class SpaceWindow:
    """The event loop. name: of the file, for the title."""

    def __init__(self, description: SpaceDescription, name: str) -> None:
        theme.use(dark=SystemTheme().is_dark)
        self.view = SpaceView(description)
        self.pair = self.view.pair
        self.running, self.paused = True, False
        self._pace = Pace()
        self._due = 0.0  # s of the Space's time
        self._side = 0  # the pane in which the mouse holds a body
        self.screen = open_window(f"{name} - sandbox")
        self._actions: dict[object, Callable[[], None]] = {
            Action.PAUSE: self._pause,
            Action.STEP: self._step,
            Action.RESTART: self._restart,
            Action.ZOOM_IN: partial(self._zoom, ZOOM_FACTOR, (0.5, 0.5)),
            Action.ZOOM_OUT: partial(self._zoom, 1 / ZOOM_FACTOR, (0.5, 0.5)),
            Action.SHOW_ALL: partial(self._zoom, 0.0, (0.5, 0.5)),
            Action.THEME: lambda: theme.use(dark=not theme.is_dark),
            Action.ESCAPE: self._close,
        }

    def run(self) -> None:
        """Show the window until it is closed."""
        clock = pygame.time.Clock()
        try:
            while self.running:
                for event in pygame.event.get():
                    self.on_event(event)
                self.frame(clock.tick(FRAME_RATE) / 1000)
        finally:
            self.pair.close()
            pygame.display.quit()

    def frame(self, seconds: float) -> None:
        """Let some seconds pass, and show what is there then."""
        if not self.paused:
            self._due = min(self._due + seconds, max(MAX_FRAME, self.pair.dt))
            while self._due >= self.pair.dt:
                self._due -= self.pair.dt
                self.pair.step()
            self._pace.observe(self.pair.time)
        self.draw()
        pygame.display.flip()

    def draw(self) -> None:
        """Draw everything."""
        pace = "paused" if self.paused else self._pace.text(1.0)
        self.view.draw(self.screen, f"    {pace}", KEYS)

    def on_event(self, event: Event) -> None:
        """Handle an event."""
        layout = self.view.layout(self.screen.get_size())
        if event.type == pygame.QUIT:
            self._close()
        elif event.type == pygame.KEYDOWN and (control := control_of(event)):
            if action := self._actions.get(control.action):
                action()
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            side = layout.pane_at(event.pos)
            if side is not None:
                self._side = side
                self.pair.grab(side, self.view.place(layout, side, event.pos))
        elif event.type == pygame.MOUSEMOTION:
            self.pair.move(self.view.place(layout, self._side, event.pos))
        elif event.type == pygame.WINDOWFOCUSLOST or (event.type == pygame.MOUSEBUTTONUP and event.button == 1):
            self.pair.release()
        elif event.type == pygame.MOUSEWHEEL and (side := layout.pane_at(pygame.mouse.get_pos())) is not None:
            (x, y), (width, height) = layout.to_scene(side, pygame.mouse.get_pos()), layout.arena
            self._zoom(ZOOM_FACTOR**event.y, (x / width, y / height))

    def _pause(self) -> None:
        self.paused = not self.paused
        self._pace.restart()

    def _step(self) -> None:
        self.paused = True
        self.pair.step()

    def _restart(self) -> None:
        self._due = 0.0
        self._pace.restart()
        self.pair.restart()

    def _zoom(self, factor: float, about: Vector) -> None:
        self.view.lens = self.view.lens.zoomed(factor, about)

    def _close(self) -> None:
        self.running = False


def draw_end(description: SpaceDescription, seconds: float) -> tuple[Surface, SideBySide]:
    """Run both Spaces for some seconds; return a picture of their end, and the two."""
    view = SpaceView(description)
    for _ in range(round(seconds / view.pair.dt)):
        view.pair.step()
    surface = Surface(PICTURE_SIZE)
    view.draw(surface)
    return surface, view.pair
