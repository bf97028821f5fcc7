"""The window: several engines run a scene before one's eyes, and the mouse drags their balls."""

import os
import sys
from collections.abc import Sequence
from itertools import groupby
from time import monotonic, perf_counter
from typing import Final

import pygame
from pygame.event import Event

from sandbox.engines import Refused, default_engines
from sandbox.inputs import Grab, Input, Move, Release
from sandbox.mistakes import Mistake
from sandbox.scene import Scene, bundled, load
from sandbox.spawn import spawn
from sandbox.trajectory import Lockstep
from sandbox.view.chart import Charts, History
from sandbox.view.controls import CONTROLS, Control, control_of
from sandbox.view.draw import card, write
from sandbox.view.film import Film, Gif
from sandbox.view.help import draw_help
from sandbox.view.layout import Layout, natural_size
from sandbox.view.overlay import ball_at
from sandbox.view.palette import FAINT, FRAME
from sandbox.view.pane import Pane, draw_panes, facts
from sandbox.view.picture import save_picture
from sandbox.view.toolbar import Button, Slider, Toolbar, Widget

FRAMES: Final = 60  # a second, of the screen
BUDGET: Final = 0.025  # s of a frame that may go into physics; what does not fit slows time
REACH: Final = 8  # px of the screen between the pointer and the edge of a ball it takes
SPEEDS: Final = tuple(2.0**power for power in range(-6, 5))
IDLE: Final = 25  # looks a second for events, while paused and none come; pygame's own wait looks 1,000 times
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
        self.showing = {"charts"}  # what is shown that a control can hide
        self.speed = 1.0
        self.pointer: tuple[int, int] | None = None  # where the mouse is, if over the window
        self.toolbar = Toolbar(self._widgets())
        self.stale = True  # something has changed beside step and status since the window was drawn
        self.shown = (-1, "")  # step and status that the window shows
        self.film: Film | None = None  # that is being recorded
        self.running = True

    def _widgets(self) -> list[Widget]:
        sliders = [
            Slider("time", "speed", "how fast time passes", SPEEDS, lambda: self.speed, self.set_speed, unit=" x"),
        ]
        widgets: list[Widget] = []
        for group, controls in groupby(CONTROLS, key=lambda control: control.group):
            widgets += [Button(control, self.do, self.is_on) for control in controls if control.icon]
            widgets += [slider for slider in sliders if slider.group == group]
        return widgets

    # What runs

    def begin(self, scene: Scene, engines: Sequence[str] | None = None, inputs: Sequence[Input] = ()) -> None:
        """Run a scene from its start. Raises Mistake, with the old one still running, where it cannot be."""
        names = engines or default_engines(scene, spawn(scene))
        self.lockstep = Lockstep(scene, names, inputs)
        self.scene = scene
        self.panes = [Pane(scene, name, runner.engine) for name, runner in self.lockstep.engines.items()]
        self.charts = Charts(History(scene, {pane.name: pane.state for pane in self.panes}))
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
        self.charts.history.add(self.lockstep.steps, {pane.name: pane.state for pane in self.panes})

    def run(self) -> None:
        """Show the window until it is closed."""
        clock = pygame.time.Clock()
        while self.running:
            events = pygame.event.get()
            for event in events:
                self.on_event(event)
            looks = FRAMES if events or not self.paused else IDLE
            self.frame(min(clock.tick(looks) / 1000, 4 / FRAMES))
        self.stop_recording()
        pygame.display.quit()

    def frame(self, seconds: float) -> None:
        """Let some time of the screen pass, and show what there is to see."""
        if not self.paused:
            self.advance(1 / self.film.fps if self.film else seconds)
        if self.stale or self.shown != (self.lockstep.steps, self.status):
            self.draw()
            pygame.display.flip()
        if self.film and not self.paused:
            self.film_frame(self.film)

    # What keys and mouse do

    def on_event(self, event: Event) -> None:
        """Do what an event asks for."""
        self.stale = True
        if event.type in (pygame.MOUSEMOTION, pygame.WINDOWLEAVE):
            self.pointer = event.pos if event.type == pygame.MOUSEMOTION else None
        if event.type == pygame.QUIT:
            self.quit()
        elif self.toolbar.on_event(event, self.layout.toolbar):
            pass
        elif event.type == pygame.KEYDOWN:
            control = control_of(event)
            if control:
                self.do(control)
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self.grab(event.pos)
        elif event.type == pygame.MOUSEMOTION and self.lockstep.hand.ball is not None:
            self.move(event)
        elif event.type == pygame.WINDOWFOCUSLOST or (event.type == pygame.MOUSEBUTTONUP and event.button == 1):
            self.release()

    def do(self, control: Control) -> None:
        """Do what a control is for."""
        act = getattr(self, control.action)
        act(control.shows) if control.shows else act()

    def is_on(self, control: Control) -> bool:
        """Tell whether what a control turns on and off is on."""
        on = {"pause": self.paused, "record": self.film is not None}
        return on.get(control.action, control.shows in self.showing)

    def grab(self, point: tuple[int, int]) -> None:
        """Take the ball nearest to a point of the screen, if it is near enough."""
        pane = self.layout.pane_at(point)
        if pane is None:
            return
        at = self.layout.to_scene(pane, point)
        ball, away = ball_at(self.panes[pane].state, self.scene.bodies.radius, at)
        if away * self.layout.scale <= REACH:
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

    def show(self, what: str) -> None:
        """Show or hide something."""
        self.showing ^= {what}

    def faster(self) -> None:
        """Let time pass twice as fast."""
        self.speed = min(2 * self.speed, SPEEDS[-1])

    def slower(self) -> None:
        """Let time pass half as fast."""
        self.speed = max(self.speed / 2, SPEEDS[0])

    def set_speed(self, speed: float) -> None:
        """Let time pass at some speed."""
        self.speed = speed

    def save_picture(self) -> None:
        """Save what the window shows, in the folder it was opened from."""
        name = self.file_name(".png")
        try:
            save_picture(self.screen, name)
            self.tell(f"saved {name}")
        except Mistake as mistake:
            self.tell(str(mistake))

    def file_name(self, ending: str) -> str:
        """Name a file after what is shown now."""
        return f"{self.scene.name}-{self.scene.seed}-{self.lockstep.steps:06}{ending}"

    def record(self) -> None:
        """Begin to record what the window shows, at the pace at which it shows it; or end and save that.

        While the window is paused, nothing is recorded.
        """
        if self.film:
            self.stop_recording()
            return
        try:
            self.film = Gif(self.file_name(".gif"), self.screen.get_size())
        except Mistake as mistake:
            self.tell(str(mistake))

    def film_frame(self, film: Film) -> None:
        """Add what is shown now to a film; a window of another size ends it."""
        if film.size != self.screen.get_size():
            self.stop_recording()
            return
        try:
            film.add(self.screen)
        except Mistake as mistake:
            film.discard()
            self.film = None
            self.tell(str(mistake))

    def stop_recording(self) -> None:
        """Save the film that is being recorded, if one is."""
        film, self.film = self.film, None
        if film:
            try:
                film.save()
                self.tell(f"saved {film.path}")
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
        return self.layout_in(self.screen.get_size())

    def layout_in(self, size: tuple[int, int]) -> Layout:
        """Return where things would stand in a window of some size, px."""
        charts = len(self.charts.history.quantities) if "charts" in self.showing else 0
        return Layout(size, self.scene.arena.size, len(self.panes), self.toolbar.widths, charts)

    def draw(self) -> None:
        """Draw everything."""
        layout = self.layout
        self.screen.fill(FRAME)
        draw_panes(self.screen, layout, self.panes, showing=self.showing, hand=self.lockstep.hand)
        self.charts.draw(self.screen, layout.strip, layout.text_height, self.panes[0].state.time)
        self.shown = self.lockstep.steps, self.status
        write(self.screen, self.status, layout.status, FAINT, layout.text_height)
        self.toolbar.draw(self.screen, layout.toolbar)
        self.draw_facts(layout)
        if "help" in self.showing:
            draw_help(self.screen, layout)
        self.toolbar.draw_tip(self.screen, layout.toolbar, layout.text_height)
        pygame.display.set_caption(f"{self.scene.title or self.scene.name} - sandbox")
        self.stale = False

    def draw_facts(self, layout: Layout) -> None:
        """Draw what is to be told of the ball under the mouse."""
        pane = layout.pane_at(self.pointer) if self.pointer else None
        if pane is None or self.pointer is None or self.lockstep.hand.ball is not None:
            return
        at = layout.to_scene(pane, self.pointer)
        ball, away = ball_at(self.panes[pane].state, self.scene.bodies.radius, at)
        if away <= 0:
            card(self.screen, facts(self.panes, ball), self.pointer, layout.text_height, self.screen.get_rect())

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
