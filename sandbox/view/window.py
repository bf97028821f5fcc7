"""The window: several engines run a scene before one's eyes, and the mouse drags their balls."""

import os
import sys
from collections.abc import Sequence
from time import monotonic, perf_counter
from typing import Final

import pygame
from pygame.event import Event

from sandbox.engines import Refused, default_engines
from sandbox.inputs import Grab, Input, Move, Release
from sandbox.mistakes import Mistake
from sandbox.quantity import length
from sandbox.scene import Scene, bundled, load
from sandbox.spawn import spawn
from sandbox.trajectory import Lockstep
from sandbox.view.controls import CONTROLS, DRAG, action_of
from sandbox.view.draw import font, write
from sandbox.view.layout import Layout, natural_size
from sandbox.view.palette import FAINT, FRAME, INK
from sandbox.view.pane import Pane, draw_panes
from sandbox.view.picture import save_picture

FRAMES: Final = 60  # a second, of the screen
BUDGET: Final = 0.025  # s of a frame that may go into physics; what does not fit slows time
REACH: Final = 8  # px of the screen between the pointer and the edge of a ball it takes
SPEEDS: Final = tuple(2.0**power for power in range(-6, 5))
NOTICE: Final = 5.0  # s that a notice stays


def has_display() -> bool:
    """Tell whether a window can be seen here. Without a screen SDL picks a driver that shows nothing."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    try:
        pygame.display.init()
    except pygame.error:
        return False
    return pygame.display.get_driver() not in ("offscreen", "dummy")


class Window:
    """A running scene, its panes, and what keys and mouse do to them.

    `engines` are run in every scene that they can honour; where none are named, Pymunk and its reference are.
    `inputs` are replayed in the first run.
    """

    def __init__(self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input] = ()) -> None:
        self.named = engines
        self.begin(scene, engines, inputs)
        pygame.display.init()
        desktop = pygame.display.get_desktop_sizes()[0]
        size = natural_size(scene.arena.size, len(self.panes), desktop)
        self.screen = pygame.display.set_mode(size, pygame.RESIZABLE)
        self.paused = False
        self.ghosts = False
        self.help = False
        self.speed = 1.0
        self.running = True

    # What runs

    def begin(self, scene: Scene, engines: Sequence[str] | None = None, inputs: Sequence[Input] = ()) -> None:
        """Run a scene from its start. Raises Mistake, with the old one still running, where it cannot be."""
        names = engines or default_engines(scene, spawn(scene))
        self.lockstep = Lockstep(scene, names, inputs)
        self.scene = scene
        self.panes = [Pane(scene, name, engine) for name, engine in self.lockstep.engines.items()]
        self.owed = 0.0  # steps that time has passed for
        self.notice = ("", 0.0)

    def advance(self, seconds: float) -> None:
        """Do the steps that are due after some time of the screen: never a larger step, if need be fewer."""
        self.owed += seconds * self.speed * self.scene.rate
        until = perf_counter() + BUDGET
        while self.owed >= 1:
            self.lockstep.step()
            self.owed -= 1
            if perf_counter() > until:
                self.owed = min(self.owed, 1.0)
                break
        for pane in self.panes:
            pane.refresh()

    def run(self) -> None:
        """Show the window until it is closed."""
        clock = pygame.time.Clock()
        while self.running:
            for event in [pygame.event.wait(250)] if self.paused else []:
                self.on_event(event)
            for event in pygame.event.get():
                self.on_event(event)
            seconds = min(clock.tick(FRAMES) / 1000, 4 / FRAMES)
            if not self.paused:
                self.advance(seconds)
            self.draw()
            pygame.display.flip()
        pygame.display.quit()

    # What keys and mouse do

    def on_event(self, event: Event) -> None:
        """Do what an event asks for."""
        if event.type == pygame.QUIT:
            self.quit()
        elif event.type == pygame.KEYDOWN:
            action = action_of(event)
            if action:
                getattr(self, action)()
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self.grab(event.pos)
        elif event.type == pygame.MOUSEMOTION and self.lockstep.hand.ball is not None:
            self.move(event)
        elif event.type == pygame.WINDOWFOCUSLOST or (event.type == pygame.MOUSEBUTTONUP and event.button == 1):
            self.release()

    def grab(self, point: tuple[int, int]) -> None:
        """Take the ball nearest to a point of the screen, if it is near enough."""
        pane = self.layout.pane_at(point)
        if pane is None:
            return
        at = self.layout.to_scene(pane, point)
        away = length(self.panes[pane].state.position - at) - self.scene.bodies.radius
        ball = int(away.argmin())
        if away[ball] * self.layout.scale <= REACH:
            self.held_in = pane
            self.lockstep.obey(Grab(step=self.lockstep.steps, ball=ball, at=at))

    def move(self, event: Event) -> None:
        """Pull the held ball to where the mouse is now, or let go where its button is no longer down."""
        if event.buttons[0]:
            at = self.layout.to_scene(self.held_in, event.pos)
            self.lockstep.obey(Move(step=self.lockstep.steps, at=at))
        else:
            self.release()

    def release(self) -> None:
        """Let go of the held ball."""
        if self.lockstep.hand.ball is not None:
            self.lockstep.obey(Release(step=self.lockstep.steps))

    def pause(self) -> None:
        """Pause, or go on."""
        self.paused = not self.paused

    def one_step(self) -> None:
        """Do one step, and pause."""
        self.paused = True
        self.owed = 1.0
        self.advance(0.0)

    def restart(self) -> None:
        """Start the scene again."""
        self.begin(self.scene, list(self.lockstep.engines))

    def next_seed(self) -> None:
        """Start the scene again with the next seed."""
        self.try_to_begin(self.scene.changed(seed=self.scene.seed + 1))

    def next_scene(self) -> None:
        """Go on to the next bundled scene."""
        self.turn_to(1)

    def previous_scene(self) -> None:
        """Go back to the bundled scene before."""
        self.turn_to(-1)

    def turn_to(self, by: int) -> None:
        """Turn the pages of the bundled scenes."""
        names = list(bundled())
        here = names.index(self.scene.name) if self.scene.name in names else -1 if by > 0 else 0
        self.try_to_begin(load(names[(here + by) % len(names)]))

    def try_to_begin(self, scene: Scene) -> None:
        """Run another scene; where the named engines cannot, run its own, and say why."""
        try:
            self.begin(scene, self.named)
        except Refused as refusal:
            self.begin(scene)
            self.tell(str(refusal))
        except Mistake as mistake:
            self.tell(str(mistake))

    def toggle_ghosts(self) -> None:
        """Show or hide the outlines of the other pane's balls."""
        self.ghosts = not self.ghosts

    def toggle_help(self) -> None:
        """Show or hide the keys."""
        self.help = not self.help

    def faster(self) -> None:
        """Let time pass twice as fast."""
        self.speed = min(2 * self.speed, SPEEDS[-1])

    def slower(self) -> None:
        """Let time pass half as fast."""
        self.speed = max(self.speed / 2, SPEEDS[0])

    def save_picture(self) -> None:
        """Save what the window shows, in the folder it was opened from."""
        name = f"{self.scene.name}-{self.scene.seed}-{self.lockstep.steps:06}.png"
        try:
            save_picture(self.screen, name)
            self.tell(f"saved {name}")
        except Mistake as mistake:
            self.tell(str(mistake))

    def quit(self) -> None:
        """Close the window."""
        self.running = False

    def tell(self, what: str) -> None:
        """Show a notice in place of the status line for some seconds."""
        self.notice = (what, monotonic() + NOTICE)

    # What is shown

    @property
    def layout(self) -> Layout:
        """Where things stand, in the window as large as it is now."""
        return Layout(self.screen.get_size(), self.scene.arena.size, len(self.panes))

    def draw(self) -> None:
        """Draw everything."""
        layout = self.layout
        self.screen.fill(FRAME)
        draw_panes(self.screen, layout, self.panes, ghosts=self.ghosts, hand=self.lockstep.hand)
        write(self.screen, self.status, layout.status, FAINT, layout.text_height)
        if self.help:
            self.draw_help(layout)
        pygame.display.set_caption(f"{self.scene.title or self.scene.name} - sandbox")

    @property
    def status(self) -> str:
        """A line on what runs, or the last notice."""
        what, until = self.notice
        if monotonic() < until:
            return what
        time = self.lockstep.steps / self.scene.rate
        pace = "paused" if self.paused else f"{self.speed:g} x"
        title = self.scene.title or self.scene.name
        return f"{title}    seed {self.scene.seed}    {time:.2f} s    {pace}    F1 help"

    def draw_help(self, layout: Layout) -> None:
        """Draw the table of keys over everything."""
        rows = [DRAG, *((control.shown, control.does) for control in CONTROLS)]
        height = layout.line_height
        columns = [max(font(layout.text_height).size(row[column])[0] for row in rows) + height for column in (0, 1)]
        panel = pygame.Rect(0, 0, sum(columns) + height, (len(rows) + 1) * height)
        panel.center = self.screen.get_rect().center
        pygame.draw.rect(self.screen, FRAME, panel, border_radius=8)
        pygame.draw.rect(self.screen, FAINT, panel, 1, border_radius=8)
        for index, (keys, does) in enumerate(rows):
            line = pygame.Rect(panel.x + height, panel.y + height // 2 + index * height, panel.width - height, height)
            write(self.screen, keys, line, INK, layout.text_height)
            write(self.screen, does, line.move(columns[0], 0), FAINT, layout.text_height)
