"""The window: several engines run a scene side by side, and the mouse drags their balls."""

import gc
import os
import signal
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Final

import pygame
from pygame import Surface
from pygame.event import Event

from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.view import Layer
from sandbox.view.balls_page import BallsPage
from sandbox.view.cards import Cards, MassSlider, Messages
from sandbox.view.case_so_far import CaseSoFar
from sandbox.view.contact_mark import ring_balls
from sandbox.view.controls import Action, Panel, Topic, action_of
from sandbox.view.display import caption, new_events, open_window
from sandbox.view.editor import Editor
from sandbox.view.engines_page import EnginesPage
from sandbox.view.layout import MIN_SIZE, TEXT_HEIGHT, TEXT_HEIGHTS, WIDE, Layout, layout_of
from sandbox.view.mouse_tool import MouseTool
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback
from sandbox.view.saver import Saver
from sandbox.view.scene_loader import SceneLoader
from sandbox.view.session_view import SessionView
from sandbox.view.side_panel import Page, ScenePage, ShowPage, SidePanel
from sandbox.view.theme import THEME, theme
from sandbox.view.toolbars import Toolbars
from sandbox.view.video import Recorder
from sandbox.view.why_page import WhyPage
from sandbox.view.widgets.group import Placed, WidgetGroup

FRAME_RATE: Final = 60  # frames a second
IDLE_RATE: Final = 25  # checks for events a second while nothing happens; pygame's own wait checks 1,000 times
QUIT_HINT: Final = "Esc again quits"
OPENS_WITH: Final = (Layer.CHARTS, Layer.GHOSTS, Layer.NUMBERS)
ANYWHERE: Final = (Action.THEME, Action.SAVE_PICTURE, Action.RECORD)  # whatever is open
RELEASES: Final = (pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST)  # handled even while the picker is open


class Window:
    """The event loop, the layout and the drawing; its parts do the rest.

    `engines` run in every scene that they accept; by default, Pymunk and a textbook engine do. `inputs` are replayed in
    the first run. beside: whether no frame waits for `exact`.
    """

    text_height = TEXT_HEIGHT
    running = True
    _is_wide = False
    _outdated = True  # something other than step and messages has changed since the window was drawn
    _drawn: tuple[Moment | None, Moment | None, str] = (None, None, "")  # in the panes and charts; and message
    _drawn_places: list[Placed] | None = None  # of the widgets as they were drawn, until an event
    _frames = 0  # that have passed

    def __init__(
        self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input] = (), *, beside: bool = False
    ) -> None:
        theme.use(dark=os.environ.get(THEME) == "dark")
        self.notice = notice = Notice()
        view = SessionView(scene, engines, inputs, beside=beside)
        self.playback = playback = Playback(view, notice)
        self.editor = editor = Editor(playback, notice)
        self.mouse = MouseTool(playback, editor, lambda: self.layout)
        self.scenes = SceneLoader(scene, engines, self.begin, notice)
        self.line_up = EnginesPage(playback, notice, self.use_engines)
        self.saver = Saver(playback, notice)
        self.recorder = Recorder(notice)
        self.showing = {*OPENS_WITH}
        self.messages = Messages(playback, notice)
        self.why = WhyPage(playback, CaseSoFar(), self.do)
        self.widgets = WidgetGroup()
        self.cards = Cards(playback, self.mouse, self.scenes, self.widgets, self.messages)
        self.toolbars = Toolbars(playback, self.mouse, self.recorder, self.do, self.is_on)
        self._mass = MassSlider(playback, editor, notice)
        pages: dict[Panel, Page] = {
            Panel.SCENE: ScenePage(playback, editor, self.do),
            Panel.BALLS: BallsPage(playback, editor, notice),
            Panel.ENGINES: self.line_up,
            Panel.WHY: self.why,
            Panel.SHOW: ShowPage(self.do, self.is_on),
        }
        self.panel = SidePanel(pages)
        self._widths = cache(self.toolbars.widths)
        self.screen = open_window(caption(scene))
        self._fit_column()

    # The run

    @property
    def view(self) -> SessionView:
        """The session that runs, with its panes and its chart."""
        return self.playback.view

    @property
    def scene(self) -> Scene:
        """The scene at the start of the run."""
        return self.view.session.start

    def begin(self, scene: Scene, engines: Sequence[str] | None) -> None:
        """Run a scene from its start. Raises SandboxError, with the old one still running, if that is impossible."""
        view = SessionView(scene, engines, beside=self.view.session.beside)
        self.view.session.stop()
        self.playback.play(view)
        self.mouse.show_all()
        self.editor.select()
        self.mouse.drag = None
        self.notice.clear()

    def restart(self, *, keep: bool) -> None:
        """Run the scene again from its start. keep: whether the edits stay."""
        self.mouse.drag = None
        self.playback.restart(keep=keep)

    def use_engines(self, names: Sequence[str]) -> None:
        """Let other engines run instead, from now on in every scene; if one refuses this run, show why."""
        self.mouse.release()
        if self.playback.use_engines(names):
            self.scenes.engines = names
            self.notice.clear()  # such as the error of a name typed wrongly before

    @property
    def _is_too_small(self) -> bool:
        return self.screen.get_size() != self.layout.window

    def _fit_column(self) -> None:
        """Show the column in a window that has become wide enough for it; hide it in one that has become narrow."""
        is_wide = self.screen.get_width() >= WIDE * self.text_height
        if is_wide != self._is_wide:
            self._is_wide = is_wide
            if is_wide != (self.panel.open is not None):
                self.panel.toggle()

    # Running

    def run(self) -> None:
        """Show the window until it is closed."""
        clock, passed = pygame.time.Clock(), 0.0  # s, since speeds were measured
        before = signal.signal(signal.SIGTERM, _close)
        try:
            while self.running:
                events = new_events()
                for event in events:
                    self.on_event(event)
                self._outdated = self.scenes.reload_if_edited() or self._outdated
                idle = self.playback.rests and not events
                seconds = clock.tick(IDLE_RATE if idle else FRAME_RATE) / 1000
                passed += seconds
                self.frame(min(seconds, 4 / FRAME_RATE))
                if self._frames % FRAME_RATE == 0:
                    self.messages.measure(FRAME_RATE, passed)
                    passed = 0.0
        finally:  # the window can also be closed while a kernel is waited for
            self.recorder.stop()
            self.view.session.stop()
            self.why.case.stop()
            pygame.display.quit()
            signal.signal(signal.SIGTERM, before)
            gc.unfreeze()  # what `Playback` has frozen, or Box2D would report objects that are never freed

    def frame(self, seconds: float) -> None:
        """Let some seconds pass, and draw what has changed."""
        playback, self._frames = self.playback, self._frames + 1
        if playback.paused:
            playback.wait()
        else:
            playback.advance(seconds)
        with self.notice.surviving():
            is_news = self.why.update(), self.view.mark(self.why.marks), self.widgets.wait(seconds)
            if any(is_news) or self._outdated or not self._is_drawn:
                self.draw()
                pygame.display.flip()
        if not playback.paused:
            self.recorder.add_frame(self.screen, seconds)

    @property
    def _is_drawn(self) -> bool:
        moment, charted, text = self._drawn
        view = self.view
        return moment is view.moment and charted is view.charts.moment and text == self.messages.text

    # Events

    def on_event(self, event: Event) -> None:
        """Handle an event; show a notice if what it asks for is not possible."""
        self._outdated = True
        with self.notice.surviving(), self.notice.reporting():
            self._handle(event)
        self._drawn_places = None

    def _handle(self, event: Event) -> None:
        self.mouse.track(event)
        if event.type == pygame.KEYDOWN:
            self._on_press(event)
        elif event.type == pygame.QUIT:
            self.running = False
        elif event.type == pygame.WINDOWSIZECHANGED:
            if self._is_too_small:
                self.screen = pygame.display.set_mode(self.layout.window, pygame.RESIZABLE)
            self._fit_column()
        elif event.type == pygame.DROPFILE:
            self.scenes.open_file(Path(event.file))
        elif self.scenes.picker and event.type not in RELEASES:
            self.scenes.picker.on_event(event)
        else:
            if event.type == pygame.MOUSEBUTTONDOWN:
                self._clear_notice()
            point = self.mouse.point
            if event.type == pygame.MOUSEWHEEL and point and self.layout.panel.collidepoint(point):
                self.panel.scroll(event.y)
            elif not self.widgets.on_event(event, self._drawn_places or self._placed):
                self.mouse.on_event(event)

    def _on_press(self, event: Event) -> None:
        action = action_of(event)
        if action in ANYWHERE:
            self.do(action)
        elif self.scenes.picker:
            self.scenes.picker.on_event(event)
        elif not self.widgets.on_event(event, self._drawn_places or self._placed) and action:
            if action is not Action.ESCAPE:
                self._clear_notice()
            self.do(action)

    def _clear_notice(self) -> None:
        """Let the notice go, as something else is done; one that was not drawn yet, of an event just before, stays."""
        if self.messages.text == self._drawn[-1]:
            self.notice.clear()

    def do(self, action: Action) -> None:
        """Do an action."""
        if action.value.topic is Topic.EDIT:  # it applies to the balls at the current step
            self.playback.settle()
        action.value.do(self)

    def is_on(self, action: Action) -> bool:
        """Return whether what an action turns on and off is on."""
        return action.value.is_on(self)

    # What actions do that are about the window

    def show_contact(self, by: int) -> None:
        """Show the next contact that differs, or the previous one; first of all, open the page that finds them."""
        self.panel.show(Panel.WHY)
        if not self.why.show_next(by):
            where, other_way = ("later", "<") if by > 0 else ("earlier", ">")
            self.notice.show(f"no {where} contact differs, as far as it is compared: press {other_way}")

    def save_picture(self) -> None:
        """Save a picture of the window."""
        self.draw()  # a window that has just got another size is black
        self.saver.save_picture(self.screen)

    def change_text(self, by: int) -> None:
        """Make the text larger by some px, or smaller."""
        low, high = TEXT_HEIGHTS
        self.text_height = min(max(self.text_height + by, low), high)

    def escape(self) -> None:
        """Close what is open over the panes; if nothing is, close the window, the second time."""
        if self.cards.close() or self.mouse.tool is not self.mouse.hand:
            self.mouse.choose(self.mouse.hand)
        elif self.notice.text == QUIT_HINT:
            self.running = False
        else:
            self.notice.show(QUIT_HINT)

    # Drawing

    @property
    def layout(self) -> Layout:
        """The layout of the window in its current size; a window that is too small shows the upper left of it."""
        width, height = map(max, self.screen.get_size(), MIN_SIZE)
        return self.layout_in((width, height))

    def layout_in(self, size: tuple[int, int]) -> Layout:
        """Return the layout that the window would have in some size, px."""
        return layout_of(
            size,
            self.scene.arena.size,
            len(self.view.panes),
            self.text_height,
            self.mouse.lens,
            Layer.CHARTS in self.showing,
            True,
            self.panel.open is not None,
            *self._widths(self.text_height),
            self.mouse.timeline_share,
        )

    @property
    def _placed(self) -> list[Placed]:
        """All widgets with their places: the slider at the selected ball, rows, column."""
        layout = self.layout
        at_ball = [] if self.mouse.holds else self._mass.placed(layout)
        return [*at_ball, *self.toolbars.placed(layout), *self.panel.placed(layout.panel, layout.text_height)]

    def draw(self) -> None:
        """Draw everything."""
        self._drawn = self.view.moment, self.view.charts.moment, self.messages.text
        self._outdated = False  # also if the drawing fails, or it would fail again and again
        layout = self.layout
        whole = Surface(layout.window) if self._is_too_small else self.screen
        self._draw_on(whole, layout)
        if whole is not self.screen:
            self.screen.blit(whole, (0, 0))
        pygame.display.set_caption(caption(self.scene))
        self._outdated = self.scenes.picker is not None and not self.scenes.picker.is_complete

    def _draw_on(self, surface: Surface, layout: Layout) -> None:
        """Draw everything on a surface of the layout's size."""
        self._drawn_places = placed = self._placed
        surface.fill(theme.ground)
        self.view.draw_panes(surface, layout, self.showing)
        if self.panel.open is Panel.WHY and (contact := self.why.contact):
            ring_balls(surface, layout, self.view.panes, contact.difference.balls)
        self.mouse.draw(surface)
        self.toolbars.draw_timeline(surface, layout)
        self.panel.draw(surface, layout.panel, layout.text_height)
        self.view.draw_chart(surface, layout, self.mouse.point)
        self.widgets.draw(surface, placed, layout.text_height)
        self.cards.draw(surface, layout, placed)


def _close(number: int, _frame: FrameType | None) -> None:
    """Close the window at a signal; a second one kills."""
    signal.signal(number, signal.SIG_DFL)
    pygame.event.post(Event(pygame.QUIT))
