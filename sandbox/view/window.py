"""The window: several engines run a scene before one's eyes, and the mouse drags their balls."""

import math
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count, groupby
from pathlib import Path
from time import monotonic
from typing import Final

import pygame
from pygame import Surface
from pygame.event import Event

from sandbox.errors import SandboxError
from sandbox.run.edits import DeleteBall, SetElasticity, SetGravity, SetRate
from sandbox.run.inputs import Input
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import write
from sandbox.scene.model import Scene
from sandbox.view.chart import Charts
from sandbox.view.controls import CONTROLS, Control, control_of
from sandbox.view.draw import card
from sandbox.view.draw import write as write_text
from sandbox.view.film import Film, Gif
from sandbox.view.grasp import Grasp, Point
from sandbox.view.help import draw_help
from sandbox.view.layout import LEAST, Layout, natural_size
from sandbox.view.notice import draw_mistake
from sandbox.view.overlay import ball_at
from sandbox.view.palette import FAINT, FRAME
from sandbox.view.pane import Pane, facts
from sandbox.view.picture import save_picture
from sandbox.view.player import SPEEDS, Player
from sandbox.view.shelf import Shelf
from sandbox.view.stage import Stage
from sandbox.view.timebar import draw_bar, step_at
from sandbox.view.toolbar import Button, Slider, Toolbar, Widget

FRAMES: Final = 60  # a second, of the screen
ELASTICITIES: Final = tuple(k / 20 for k in range(21))
GRAVITIES: Final = tuple(100.0 * k for k in range(-10, 21))  # px/s², downwards
RATES: Final = (15, 30, 60, 120, 240, 480, 960, 1920, 3840)
IDLE: Final = 25  # looks a second for events, while paused and none come; pygame's own wait looks 1,000 times
NOTICE: Final = 5.0  # s that a notice stays
LETTING_GO: Final = (pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST)  # which is done whatever lies over the panes
CHOOSE: Final = "no ball is chosen: pause and click one, or choose with , and ."


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
    """A running scene on its stage, and what keys and mouse do to it.

    `engines` are run in every scene that they can honour; where none are named, Pymunk and its reference are.
    `inputs` are replayed in the first run.
    """

    def __init__(self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input] = ()) -> None:
        self.notice = ("", 0.0)  # a line, and until when it is shown, s
        self.player = Player(Stage(scene, engines, inputs), self.tell, self.show_progress)
        self.shelf = Shelf(scene, engines, self.begin, self.tell)
        self.grasp = Grasp()
        pygame.display.init()
        desktop = pygame.display.get_desktop_sizes()[0]
        size = natural_size(scene.arena.size, len(self.panes), desktop)
        self.screen = pygame.display.set_mode(size, pygame.RESIZABLE)
        self.showing = {"charts"}  # what is shown that a control can hide
        self.pointer: Point | None = None  # where the mouse is, if over the window
        self.toolbar = Toolbar(self._widgets())
        self.scrubs = False  # the mouse drags the time
        self.stale = True  # something has changed beside step and status since the window was drawn
        self.shown = (-1, "")  # step and status that the window shows
        self.film: Film | None = None  # that is being recorded
        self.running = True

    def _widgets(self) -> list[Widget]:
        player = self.player
        sliders = [
            Slider("time", "speed", "how fast time passes", SPEEDS, lambda: player.speed, player.set_speed, " x"),
            Slider("edit", "elasticity", "of any two that meet", ELASTICITIES, self.elasticity, self.set_elasticity),
            Slider("edit", "gravity", "downwards, px/s²", GRAVITIES, lambda: self.now.gravity[1], self.set_gravity),
            Slider("edit", "rate", "steps per second", RATES, lambda: self.now.rate, self.set_rate),
        ]
        for slider in sliders[1:]:
            slider.at_once = False
        widgets: list[Widget] = []
        for group, controls in groupby(CONTROLS, key=lambda control: control.group):
            widgets += [Button(control, self.do, self.is_on) for control in controls if control.icon]
            widgets += [slider for slider in sliders if slider.group == group]
        return widgets

    # What runs

    @property
    def stage(self) -> Stage:
        """What runs, and is shown."""
        return self.player.stage

    @property
    def lockstep(self) -> Lockstep:
        """The engines, which may be at another step than what is shown."""
        return self.stage.session.lockstep

    @property
    def panes(self) -> list[Pane]:
        """A pane for each engine."""
        return self.stage.panes

    @property
    def charts(self) -> Charts:
        """The charts of all engines."""
        return self.stage.charts

    @property
    def scene(self) -> Scene:
        """The scene as the run began."""
        return self.stage.session.start

    @property
    def now(self) -> Scene:
        """The scene as it is after all edits up to what is shown."""
        return self.stage.moment.scene

    def begin(self, scene: Scene, engines: Sequence[str] | None) -> None:
        """Run a scene from its start. Raises SandboxError, with the old one still running, where it cannot be."""
        self.player.put_on(Stage(scene, engines))
        self.grasp = Grasp()
        self.notice = ("", 0.0)

    def restart(self) -> None:
        """Start the scene again."""
        self.begin(self.scene, self.stage.session.names)

    def advance(self, seconds: float) -> None:
        """Do the steps that are due after some time of the screen."""
        self.player.advance(seconds)

    def run(self) -> None:
        """Show the window until it is closed."""
        clock = pygame.time.Clock()
        while self.running:
            events = pygame.event.get()
            for event in events:
                self.on_event(event)
            self.stale = self.shelf.look_at_file() or self.stale
            idle = self.player.paused and self.player.exact and not events
            looks = IDLE if idle else self.film.fps if self.film else FRAMES
            self.frame(min(clock.tick(looks) / 1000, 4 / FRAMES))
        self.stop_recording()
        pygame.display.quit()

    def frame(self, seconds: float) -> None:
        """Let some time of the screen pass, and show what there is to see."""
        if not self.player.paused:
            self.advance(1 / self.film.fps if self.film else seconds)
        elif not self.player.exact:
            self.player.catch_up()
        if self.stale or self.shown != (self.stage.moment.step, self.status):
            self.draw()
            pygame.display.flip()
        if self.film and not self.player.paused:
            self.film_frame(self.film)

    # What keys and mouse do

    def on_event(self, event: Event) -> None:
        """Do what an event asks for."""
        self.stale = True
        if event.type in (pygame.MOUSEMOTION, pygame.WINDOWLEAVE):
            self.pointer = event.pos if event.type == pygame.MOUSEMOTION else None
        if event.type == pygame.QUIT:
            self.quit()
        elif event.type == pygame.DROPFILE:
            self.shelf.open(Path(event.file))
        elif self.shelf.picker and event.type not in LETTING_GO:
            self.shelf.picker.on_event(event)
        elif self.toolbar.on_event(event, self.layout.toolbar):
            pass
        elif event.type == pygame.KEYDOWN:
            control = control_of(event)
            if control:
                self.do(control)
        else:
            self.on_mouse(event)

    def on_mouse(self, event: Event) -> None:
        """Do what the mouse asks for outside of the toolbar."""
        layout = self.layout
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self.scrubs = bool(layout.strip.collidepoint(event.pos) or layout.bar.collidepoint(event.pos))
            if self.scrubs:
                self.scrub(event.pos)
            else:
                self.press(event.pos)
        elif event.type == pygame.MOUSEMOTION and (self.scrubs or self.holds):
            if not event.buttons[0]:
                self.release()
            elif self.scrubs:
                self.scrub(event.pos)
            else:
                self.player.give(self.grasp.drag(self.stage, layout, event.pos))
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 1:
            self.release()
        elif event.type == pygame.WINDOWFOCUSLOST:
            self.grasp.take_back()
            self.release()

    def do(self, control: Control) -> None:
        """Do what a control is for."""
        if control.group == "edit":
            self.player.settle()  # what is done, is done to the balls as they are
        whose = next(part for part in (self, self.player, self.shelf) if hasattr(part, control.action))
        act = getattr(whose, control.action)
        act(control.shows) if control.shows else act()

    def is_on(self, control: Control) -> bool:
        """Tell whether what a control turns on and off is on."""
        on = {"pause": self.player.paused, "record": self.film is not None, "add_ball": self.grasp.adding}
        return on.get(control.action, control.shows in self.showing)

    @property
    def holds(self) -> bool:
        """Whether the mouse has a ball or its velocity in hand."""
        return self.grasp.holds or self.stage.session.held is not None

    def press(self, point: Point) -> None:
        """Take the ball nearest to a point of the screen, if it is near enough; or place a new one there."""
        if self.layout.pane_at(point) is not None:
            self.player.settle()
        with self.telling():
            self.player.give(self.grasp.press(self.stage, self.layout, point, paused=self.player.paused))

    def release(self) -> None:
        """Let go of what the mouse holds."""
        self.scrubs = False
        if self.grasp.aim:
            self.player.settle()
        with self.telling():
            self.player.give(self.grasp.let_go(self.stage))

    def scrub(self, point: Point) -> None:
        """Pause, and go to the time at a point of the charts, or of the bar."""
        self.player.paused = True
        layout, session = self.layout, self.stage.session
        if layout.bar.height:
            self.player.seek(step_at(layout.bar, point[0], session.end))
            return
        x = min(max(point[0], layout.strip.left), layout.strip.right - 1)
        time = self.charts.time_at(layout.strip, layout.text_height, (x, layout.strip.centery))
        if time is not None:
            self.player.seek(session.step_at(time))

    # Balls, and what holds for all of them

    def add_ball(self) -> None:
        """Add a ball at the mouse; where it is on the toolbar, let the next click place it."""
        self.release()
        pane = self.layout.pane_at(self.pointer) if self.pointer else None
        if pane is None and self.toolbar.over is not None:
            self.grasp.adding = not self.grasp.adding
            return
        at = self.layout.to_scene(pane, self.pointer) if pane is not None and self.pointer else None
        with self.telling():
            self.player.give(self.grasp.add(self.stage.moment, at))

    def delete_ball(self) -> None:
        """Delete the ball under the mouse, or else the chosen one."""
        ball = self.ball_under()
        ball = self.grasp.ball(self.stage.moment) if ball is None else ball
        if ball is None:
            self.tell(CHOOSE)
        else:
            self.player.give(DeleteBall(step=self.stage.session.step, ball=ball))

    def push(self, x: int, y: int) -> None:
        """Let the chosen ball go more to the right and down."""
        with self.telling():
            given = self.grasp.push(self.stage, x, y)
            self.player.give(given) if given else self.tell(CHOOSE)

    def ball_under(self) -> int | None:
        """Return the ball under the mouse."""
        pane = self.layout.pane_at(self.pointer) if self.pointer else None
        if pane is None or self.pointer is None:
            return None
        at = self.layout.to_scene(pane, self.pointer)
        ball, away = ball_at(self.panes[pane].state, self.now.bodies.radius, at)
        return ball if away <= 0 else None

    def choose_next(self) -> None:
        """Choose the next ball."""
        self.grasp.choose(self.stage, 1)

    def choose_previous(self) -> None:
        """Choose the ball before."""
        self.grasp.choose(self.stage, -1)

    def push_left(self) -> None:
        """Let the chosen ball go more to the left."""
        self.push(-1, 0)

    def push_right(self) -> None:
        """Let the chosen ball go more to the right."""
        self.push(1, 0)

    def push_up(self) -> None:
        """Let the chosen ball go more upwards."""
        self.push(0, -1)

    def push_down(self) -> None:
        """Let the chosen ball go more downwards."""
        self.push(0, 1)

    def elasticity(self) -> float:
        """Return the elasticity of the first ball with itself and the like, to hundredths."""
        return round(float(self.now.bodies.elasticity[0]) ** 2, 2)

    def set_elasticity(self, elasticity: float) -> None:
        """Set the elasticity of every pair."""
        self.player.give(SetElasticity(step=self.stage.session.step, elasticity=elasticity))

    def set_gravity(self, gravity: float) -> None:
        """Set the gravity downwards."""
        self.player.settle()
        self.player.give(SetGravity(step=self.stage.session.step, gravity=(self.now.gravity[0], gravity)))

    def set_rate(self, rate: float) -> None:
        """Set the steps per second."""
        self.player.give(SetRate(step=self.stage.session.step, rate=round(rate)))

    # Files

    def save_scene(self) -> None:
        """Save the balls as they are in the pane under the mouse, or else in the first, as a scene."""
        self.player.settle()
        pane = self.panes[(self.layout.pane_at(self.pointer) if self.pointer else None) or 0]
        names = (self.file_name(".toml" if k == 1 else f"-{k}.toml") for k in count(1))
        name = next(name for name in names if not os.path.exists(name))  # noqa: PTH110  (Path's raises if it is too long)
        with self.telling():
            write(self.now, pane.state, name)
            self.tell(f"saved {name}: the balls as {pane.name} has them")

    def save_picture(self) -> None:
        """Save what the window shows, in the folder it was opened from."""
        name = self.file_name(".png")
        with self.telling():
            save_picture(self.screen, name)
            self.tell(f"saved {name}")

    def file_name(self, ending: str) -> str:
        """Name a file after what is shown now."""
        return f"{self.scene.name}-{self.scene.seed}-{self.stage.moment.step:06}{ending}"

    def record(self) -> None:
        """Begin to record what the window shows, at the pace at which it shows it; or end and save that.

        While the window is paused, nothing is recorded.
        """
        if self.film:
            self.stop_recording()
            return
        with self.telling():
            self.film = Gif(self.file_name(".gif"), self.screen.get_size())

    def film_frame(self, film: Film) -> None:
        """Add what is shown now to a film; a window of another size ends it."""
        if film.size != self.screen.get_size():
            self.stop_recording()
            return
        try:
            film.add(self.screen)
        except SandboxError as mistake:
            film.discard()
            self.film = None
            self.tell(str(mistake))

    def stop_recording(self) -> None:
        """Save the film that is being recorded, if one is."""
        film, self.film = self.film, None
        if film:
            with self.telling():
                film.save()
                self.tell(f"saved {film.path}")

    def show(self, what: str) -> None:
        """Show or hide something."""
        self.showing ^= {what}

    def escape(self) -> None:
        """Close what lies over the panes; else close the window."""
        if self.shelf.mistake or self.grasp.adding or "help" in self.showing:
            self.shelf.mistake, self.grasp.adding = "", False
            self.showing -= {"help"}
        else:
            self.quit()

    def quit(self) -> None:
        """Close the window."""
        self.running = False

    def tell(self, what: str) -> None:
        """Show a notice in place of the status line for some seconds."""
        self.notice = (what, monotonic() + NOTICE)

    @contextmanager
    def telling(self) -> Iterator[None]:
        """Tell a person's mistake, in place of the status line."""
        try:
            yield
        except SandboxError as mistake:
            self.tell(str(mistake))

    # What is shown

    def show_progress(self) -> None:
        """Show how far engines are that run again, while nothing else can be done."""
        self.draw()
        pygame.display.flip()
        pygame.event.pump()

    @property
    def layout(self) -> Layout:
        """Where things stand, in the window as large as it is now; one that is too small shows the upper left."""
        width, height = map(max, self.screen.get_size(), LEAST)
        return self.layout_in((width, height))

    def layout_in(self, size: tuple[int, int]) -> Layout:
        """Return where things would stand in a window of some size, px."""
        charts = len(self.charts.history.quantities) if "charts" in self.showing else 0
        return Layout(size, self.scene.arena.size, len(self.panes), self.toolbar.widths, charts)

    def draw(self) -> None:
        """Draw everything."""
        layout = self.layout
        if self.screen.get_size() == layout.window:
            self.draw_on(self.screen, layout)
        else:
            whole = Surface(layout.window)
            self.draw_on(whole, layout)
            self.screen.blit(whole, (0, 0))
        pygame.display.set_caption(f"{self.scene.title or self.scene.name} - sandbox")
        self.shown = self.stage.moment.step, self.status
        self.stale = False

    def draw_on(self, surface: Surface, layout: Layout) -> None:
        """Draw everything on a surface of the layout's size."""
        surface.fill(FRAME)
        self.stage.draw(surface, layout, self.showing)
        self.grasp.draw(surface, layout, self.stage, self.pointer)
        draw_bar(surface, layout.bar, self.stage.moment.step, self.stage.session.end)
        write_text(surface, self.status, layout.status, FAINT, layout.text_height)
        self.toolbar.draw(surface, layout.toolbar)
        self.draw_facts(surface, layout)
        if self.shelf.mistake:
            draw_mistake(surface, layout, self.shelf.mistake)
        if "help" in self.showing:
            draw_help(surface, layout)
        if self.shelf.picker:
            self.shelf.picker.fit(surface.get_rect(), layout.text_height)
            self.shelf.picker.draw(surface)
        else:
            self.toolbar.draw_tip(surface, layout.toolbar, layout.text_height)

    def draw_facts(self, surface: Surface, layout: Layout) -> None:
        """Draw what is to be told of the ball under the mouse, or of one that the keyboard chose."""
        if self.holds:
            return
        ball, near = self.ball_under(), self.pointer
        chosen = self.grasp.ball(self.stage.moment)
        if ball is None and self.grasp.by_key and chosen is not None:
            ball = chosen
            x, y = self.panes[0].state.position[ball] * layout.scale
            near = layout.arenas[0].x + round(x), layout.arenas[0].y + round(y)
        if ball is not None and near:
            card(surface, facts(self.panes, ball), near, layout.text_height, surface.get_rect())

    @property
    def status(self) -> str:
        """A line on what runs, or the last notice."""
        what, until = self.notice
        if self.stage.session.steps_behind and not (self.player.paused and self.player.exact):
            return f"running again: {self.stage.session.steps_behind:,} steps to go"
        if monotonic() < until:
            return what
        speed = self.player.speed
        pace = "paused" if self.player.paused else "fastest" if speed == math.inf else f"{speed:g} x"
        title = self.scene.title or self.scene.name
        return f"{title}    seed {self.scene.seed}    {self.stage.moment.time:.2f} s    {pace}    F1 help"
