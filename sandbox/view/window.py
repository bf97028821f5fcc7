"""The window: several engines run a scene side by side, and the mouse drags their balls."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.signals import signals_deferred
from sandbox.view.balls_page import BallsPage
from sandbox.view.cards import draw_ball_card, draw_error_card, draw_help
from sandbox.view.case_so_far import CaseSoFar
from sandbox.view.compilation import Compilation
from sandbox.view.compiling import caption, draw_status, status_width
from sandbox.view.controls import Action, Control, Group, Panel, control_of
from sandbox.view.editor import Editor
from sandbox.view.engines_page import EnginesPage, LineUp
from sandbox.view.events import KeyRepeat, PendingEvents, Stopped
from sandbox.view.header import OF_ACTION, Header
from sandbox.view.layers import Layer
from sandbox.view.layout import MIN_SIZE, TEXT_HEIGHT, TEXT_HEIGHTS, WIDE, Layout, ScreenPoint, layout_of, natural_size
from sandbox.view.mouse_tool import ZOOM_FACTOR, MouseTool, ToolPalette
from sandbox.view.move_tool import Tool
from sandbox.view.notice import Guard, Kind, Notice, draw_notice
from sandbox.view.pixels import fill
from sandbox.view.playback import Playback, Snapshots
from sandbox.view.saver import Saver
from sandbox.view.scene_loader import SceneLoader
from sandbox.view.scene_page import ScenePage, ShowPage
from sandbox.view.session_view import SessionView
from sandbox.view.side_panel import Page, SidePanel
from sandbox.view.theme import SystemTheme, theme
from sandbox.view.timeline import Timeline, marks_of_track
from sandbox.view.video import Recorder
from sandbox.view.why_page import WhyPage
from sandbox.view.widgets.group import Placed, WidgetGroup
from sandbox.view.widgets.widget import ARROWS, ENTER

FRAME_RATE: Final = 60  # frames a second
IDLE_RATE: Final = 25  # checks for events a second while nothing happens; pygame's own wait checks 1,000 times
MAX_NUMBERED: Final = 30  # balls of a scene that opens with their numbers
OPENS_WITH: Final = (Layer.CHARTS, Layer.GHOSTS)
MIN_MESSAGE: Final = 20  # width of a message beside what is compiled, in heights of the text
MAX_OUTLINED: Final = 300  # balls of a scene that opens with outlines; more would hide the balls
QUIT_HINT: Final = "Esc again quits"
UNSAVED_HINT: Final = "the edits of this run are not saved; Esc again quits"
WHY_PAGE: Final = "the page Why"
STOPPED: Final = "stopped running again"
ANYWHERE: Final = (Action.FULL_SCREEN, Action.THEME, Action.SAVE_PICTURE, Action.RECORD)  # whatever is open
RELEASES: Final = (pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST)  # handled even while the picker is open


def has_display() -> bool:
    """Return whether a window can be seen here. Without a screen SDL picks a driver that shows nothing."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    try:
        pygame.display.init()
    except pygame.error:
        return False
    return pygame.display.get_driver() not in ("offscreen", "dummy")


class Window:
    """The event loop, the layout and the drawing; its parts do the rest.

    `engines` run in every scene that they accept; by default, Pymunk and a textbook engine do. `inputs` are replayed in
    the first run. The status line shows a `compilation` while it runs. beside: whether no frame waits for `exact`.
    """

    def __init__(
        self,
        scene: Scene,
        engines: Sequence[str] | None,
        inputs: Sequence[Input] = (),
        compilation: Compilation | None = None,
        *,
        beside: bool = False,
    ) -> None:
        self._system = SystemTheme()
        self._follow_system()
        self._compilation = compilation
        self.notice = Notice()
        self.guard = Guard(self.notice)
        self.playback = Playback(SessionView(scene, engines, inputs, beside=beside), self.notice, self.show_progress)
        self.editor = Editor(self.playback, self.notice, self._replace_engines)
        self.mouse = MouseTool(self.playback, self.editor, lambda: self.layout)
        self.scenes = SceneLoader(scene, engines, self.begin, self.notice)
        self.line_up = LineUp(self.playback, self.notice, self.use_engines)
        self.saver = Saver(self.playback, self.notice)
        self.recorder = Recorder(self.notice)
        self.snapshots = Snapshots(self.playback, self.notice)
        self.key_repeat = KeyRepeat()
        self.showing = self._by_itself(scene)
        self.text_height = TEXT_HEIGHT
        self.help_open = False
        self.about_open = True
        self.why = WhyPage(self.playback, self.saver, CaseSoFar(self.notice), self._act)
        self.widgets = WidgetGroup()
        self.actions = self._actions()
        self._is_on = self._states()
        self.header = Header(self.widgets, lambda: self.scene, self._act, self._has_on, lambda: self.recorder.seconds)
        self.palette = ToolPalette(self.widgets, self.mouse, self._act)
        self.timeline = Timeline(self.widgets, self.playback, self._act, lambda: self._shown_time)
        self.panel = SidePanel(self._pages(), self.widgets)
        pygame.display.init()
        pygame.display.set_caption(caption(scene))  # before the window is there, or it would open as "pygame window"
        with signals_deferred():  # set_mode discards exceptions
            self.screen = pygame.display.set_mode(natural_size(pygame.display.get_desktop_sizes()[0]), pygame.RESIZABLE)
        self._closed = Panel.SCENE  # the page that the column opens with again
        self._was_wide = False
        self._fit_column()
        self.running = True
        self._pending = PendingEvents()
        self._waits = False  # something is to be done as soon as engines have run again
        self._cursor = pygame.SYSTEM_CURSOR_ARROW
        self._window_size: tuple[int, int] | None = None  # before full screen, px
        self._outdated = True  # something other than step and status has changed since the window was drawn
        self._drawn: tuple[Moment | None, Moment | None, str] = (None, None, "")  # in the panes and charts; and status

    def _follow_system(self) -> None:
        """Use the theme that the system prefers."""
        self._system_was_dark = self._system.is_dark
        theme.use(dark=self._system_was_dark)

    def _fit_column(self) -> None:
        """Open the column if the window has become wide enough for it, or close it if it no longer is."""
        is_wide = self.screen.get_width() >= WIDE * self.text_height
        if is_wide not in (self._was_wide, self.panel.open is not None):
            self._toggle_column()
        self._was_wide = is_wide

    @classmethod
    def _by_itself(cls, scene: Scene) -> set[Layer]:
        """Return what a scene opens with."""
        return set(OPENS_WITH) - cls._hidden(scene) | cls._numbers(scene)

    @staticmethod
    def _numbers(scene: Scene) -> set[Layer]:
        """Return the numbers of balls, if the scene has few."""
        return {Layer.NUMBERS} if len(scene.bodies) <= MAX_NUMBERED else set()

    @staticmethod
    def _hidden(scene: Scene) -> set[Layer]:
        """Return what would hide the balls of the scene."""
        return {Layer.GHOSTS} if len(scene.bodies) > MAX_OUTLINED else set()

    def _pages(self) -> dict[Panel, Page]:
        return {
            Panel.SCENE: ScenePage(self.playback, self.editor, self.snapshots, self._act),
            Panel.BALLS: BallsPage(self.playback, self.editor, self.mouse, self.notice),
            Panel.ENGINES: EnginesPage(self.line_up),
            Panel.WHY: self.why,
            Panel.SHOW: ShowPage(self.do, self.is_on),
        }

    def _inspects(self) -> bool:
        return self.panel.open is Panel.BALLS

    def _states(self) -> dict[Action, Callable[[], bool]]:
        """Return whether what an action turns on and off is on."""
        return {
            Action.PAUSE: lambda: self.playback.paused,
            Action.STOPWATCH: lambda: self.playback.stopwatch is not None,
            Action.RECORD: lambda: self.recorder.video is not None,
            Action.FULL_SCREEN: lambda: self._window_size is not None,
            Action.HELP: lambda: self.help_open,
            Action.ABOUT: lambda: self.about_open,
            Action.COLUMN: lambda: self.panel.open is not None,
            Action.PLAIN: lambda: self.view.plain,
            Action.THEME: lambda: theme.is_dark,
        }

    def _actions(self) -> dict[Action, Callable[[], None]]:
        return self._actions_in_time() | self._other_actions()

    def _actions_in_time(self) -> dict[Action, Callable[[], None]]:
        playback = self.playback
        return {
            Action.GO_TO_START: partial(playback.seek, 0),
            Action.STEP_BACK: playback.step_back,
            Action.PAUSE: playback.pause,
            Action.STEP: playback.step,
            Action.GO_TO_END: lambda: playback.seek(playback.session.end),
            Action.SECOND_BACK: partial(playback.skip, -1),
            Action.SECOND_FORWARD: partial(playback.skip, 1),
            Action.PREVIOUS_CONTACT: partial(self._show_contact, -1),
            Action.NEXT_CONTACT: partial(self._show_contact, 1),
            Action.RESTART: lambda: self.begin(self.scene, self.view.session.names),
            Action.STOPWATCH: playback.toggle_stopwatch,
            Action.TAKE_SNAPSHOT: self.snapshots.take,
            Action.RETURN: self.snapshots.return_to_latest,
            Action.SLOWER: playback.slower,
            Action.FASTER: playback.faster,
        }

    def _other_actions(self) -> dict[Action, Callable[[], None]]:
        scenes, editor, mouse = self.scenes, self.editor, self.mouse
        return {
            Action.PICK_SCENE: scenes.open_picker,
            Action.PREVIOUS_SCENE: partial(scenes.open_bundled, -1),
            Action.NEXT_SCENE: partial(scenes.open_bundled, 1),
            Action.NEXT_SEED: scenes.next_seed,
            Action.SAVE_SCENE: lambda: self.saver.save_scene(mouse.pane or 0),
            Action.SAVE_INPUTS: self.saver.save_inputs,
            Action.COPY_CODE: lambda: self.saver.copy_code(mouse.pane or 0),
            Action.UNDO: editor.undo,
            Action.REDO: editor.redo,
            Action.ADD_BALL: mouse.add_ball,
            Action.DELETE_BALL: mouse.delete_ball,
            Action.NEXT_TOOL: self._choose_next_tool,
            Action.COOL: editor.cool,
            Action.HEAT: editor.heat,
            Action.USE_IMPULSE: self.use_impulse,
            Action.SELECT_PREVIOUS: lambda: editor.select_next(-1, with_walls=self._inspects()),
            Action.SELECT_NEXT: lambda: editor.select_next(1, with_walls=self._inspects()),
            Action.NEXT_CHART: lambda: self._change_chart(self.view.charts.show_next),
            Action.SCALE: lambda: self._change_chart(self.view.charts.toggle_scale),
            Action.SHOW_ALL: mouse.show_all,
            Action.ZOOM_IN: partial(mouse.zoom_by, ZOOM_FACTOR),
            Action.ZOOM_OUT: partial(mouse.zoom_by, 1 / ZOOM_FACTOR),
            Action.LARGER_TEXT: partial(self._change_text, 1),
            Action.SMALLER_TEXT: partial(self._change_text, -1),
            Action.THEME: self._toggle_theme,
            Action.ABOUT: self._toggle_about,
            Action.COLUMN: self._toggle_column,
            Action.PLAIN: self._toggle_plain,
            Action.SAVE_PICTURE: self._save_picture,
            Action.RECORD: lambda: self.recorder.toggle(self.saver.file_name(".gif"), self.screen.get_size()),
            Action.FULL_SCREEN: self._toggle_full_screen,
            Action.HELP: self._toggle_help,
            Action.ESCAPE: self._escape,
        }

    # Running

    @property
    def view(self) -> SessionView:
        """The session that runs, with its panes and charts."""
        return self.playback.view

    @property
    def scene(self) -> Scene:
        """The scene at the start of the run."""
        return self.view.session.start

    def begin(self, scene: Scene, engines: Sequence[str] | None) -> None:
        """Run a scene from its start. Raises SandboxError, with the old one still running, if that is impossible."""
        size, before = self.scene.arena.size, self._by_itself(self.scene)
        if scene != self.scene:
            self.snapshots.forget()
        self.playback.stopwatch = None
        view = SessionView(scene, engines, beside=self.view.session.beside)
        self.view.session.stop()
        self.playback.play(view)
        if scene.arena.size != size:
            self.mouse.show_all()
        for layer in before ^ self._by_itself(scene):  # unless it was chosen otherwise
            if (layer in before) == (layer in self.showing):
                self.showing ^= {layer}
        self.editor.select(None)
        self.editor.forget_engines()
        self.mouse.reset()
        self.notice.clear()
        self.guard.try_again()

    def use_impulse(self) -> None:
        """Let impulse run in place of article, with the same inputs, to the same step."""
        session = self.view.session
        if "article" not in session.names:
            self.notice.show("article does not run here, so impulse cannot replace it")
            return
        self.use_engines(list(dict.fromkeys("impulse" if name == "article" else name for name in session.names)))

    def use_engines(self, names: Sequence[str]) -> None:
        """Let other engines run instead, from now on in every scene; if one refuses this run, show why."""
        if self._replace_engines(names):
            self.scenes.engines = names
            self.editor.forget_engines()
            self.notice.go_stale()  # such as the error of a name typed wrongly before

    def _replace_engines(self, names: Sequence[str]) -> bool:
        """Let other engines run in this run. Return whether they do."""
        self.mouse.release()
        return self.playback.use_engines(names)

    def run(self) -> None:
        """Show the window until it is closed."""
        clock = pygame.time.Clock()
        try:
            while self.running:
                events = self._pending.take()
                for event in events:
                    self.on_event(event)
                self._outdated = self.scenes.reload_if_edited() or self._outdated
                idle = self.playback.paused and self.playback.shows_current_step and not events
                idle = idle and self.key_repeat.held is None
                rate = IDLE_RATE if idle else self.recorder.video.fps if self.recorder.video else FRAME_RATE
                self.frame(min(clock.tick(rate) / 1000, 4 / FRAME_RATE))
        finally:  # the window can also be closed while a kernel is waited for
            self.recorder.stop()
            self.view.session.stop()
            self.why.case.stop()
            pygame.display.quit()

    def frame(self, seconds: float) -> None:
        """Let some seconds pass, and draw what has changed."""
        playback, video = self.playback, self.recorder.video
        if self._system.is_dark != self._system_was_dark:
            self._follow_system()
            self.view.recolour()
            self._outdated = True
        again = self.key_repeat.due(seconds)
        if again:
            with self._stoppable():
                self._on_press(again)
        compiling = self._compilation is not None and self._compilation.is_running
        if self._compilation and compiling:
            self._compilation.poll()
            self._outdated = True
        if playback.paused:
            playback.wait()
        else:
            self.mouse.move.follow()
            playback.advance(1 / video.fps if video else seconds, patient=video is not None)
        if not compiling:
            self._outdated = self.guard.run(WHY_PAGE, self.why.update) or self._outdated
        self._outdated = self.view.mark(self.why.marks) or self._outdated
        if self._outdated or not self._is_drawn:
            self.draw()
            pygame.display.flip()
        if not playback.paused:
            self.recorder.add_frame(self.screen)

    @property
    def _is_drawn(self) -> bool:
        moment, charted, status = self._drawn
        view = self.view
        return moment is view.moment and charted is view.charts.moment and status == self.status

    # Events

    def on_event(self, event: Event) -> None:
        """Handle an event. If engines must run again for what it asks for, Esc or closing the window stops that."""
        self._outdated = True
        with self._stoppable():
            self._handle(event)

    @contextmanager
    def _stoppable(self) -> Iterator[None]:
        try:
            with self.guard.reporting(self._part_at_work):
                yield
        except Stopped:
            self.key_repeat.held = None
            self.mouse.reset()
            self.notice.show(STOPPED)

    def _part_at_work(self) -> str:
        """Return the page whose widget handles an event, or nothing if something else does."""
        widget, layout = self.widgets.at_work, self.layout
        rows = (self.header, self.palette, self.timeline)
        others = [one for row in rows for one, _ in row.placed(layout)]
        return "" if widget is None or any(widget is one for one in others) else self._page_name

    def _handle(self, event: Event) -> None:
        self.mouse.track(event)
        self.key_repeat.track(event)
        if event.type == pygame.KEYDOWN:
            self.key_repeat.press(event, repeats=self._repeats(event))
            self._on_press(event)
        elif event.type == pygame.QUIT:
            self.running = False
        elif event.type == pygame.WINDOWSIZECHANGED:
            self._fit_column()
        elif event.type == pygame.WINDOWFOCUSGAINED:  # perhaps from the system's settings
            self._system.ask()
        elif event.type == pygame.DROPFILE:
            self.scenes.open_file(Path(event.file))
        elif self.scenes.picker and event.type not in RELEASES:
            self.scenes.picker.on_event(event)
        else:
            if event.type == pygame.MOUSEBUTTONDOWN:
                self.notice.go_stale()
            if event.type == pygame.MOUSEWHEEL and self._is_over_panel:
                self.panel.scroll(event.y)
            elif not self.widgets.on_event(event, self._placed):
                self.mouse.on_event(event)

    def _repeats(self, event: Event) -> bool:
        """Return whether a key is repeated while it is held."""
        if self.scenes.picker:
            return event.key not in (*ENTER, pygame.K_ESCAPE)
        if self.widgets.is_typed_into or (self.widgets.focus and event.key in ARROWS):
            return event.key not in (*ENTER, pygame.K_ESCAPE)
        control = control_of(event)
        return control is not None and control.repeats

    def _on_press(self, event: Event) -> None:
        """Handle a key."""
        self._outdated = True
        control = control_of(event)
        if control and control.action in ANYWHERE:
            self.do(control)
        elif self.scenes.picker:
            self.scenes.picker.on_event(event)
        elif self.widgets.on_event(event, self._placed):
            self.panel.show_focus(self.layout.panel, self.layout.text_height)
        elif control:
            if control.action is not Action.ESCAPE:
                self.notice.go_stale()
            self.do(control)

    def do(self, control: Control) -> None:
        """Do a control's action, or show or hide its layer or its page of the side panel."""
        if control.group == Group.EDIT:
            self.playback.settle()  # an edit applies to the balls at the current step
        if isinstance(control.action, Layer):
            self.showing ^= {control.action}
        elif isinstance(control.action, Panel):
            self.panel.toggle(control.action)
        else:
            self.actions[control.action]()

    def _act(self, action: Action) -> None:
        """Do an action, as its key does."""
        self.do(OF_ACTION[action])

    def _has_on(self, action: Action) -> bool:
        return self.is_on(OF_ACTION[action])

    def is_on(self, control: Control) -> bool:
        """Return whether what a control turns on and off is on."""
        match control.action:
            case Layer():
                return control.action in self.showing
            case Panel():
                return control.action is self.panel.open
            case action:
                return action in self._is_on and self._is_on[action]()

    def _change_chart(self, change: Callable[[], None]) -> None:
        self.showing |= {Layer.CHARTS}
        change()

    def _choose_next_tool(self) -> None:
        tools = list(Tool)
        self.mouse.choose(tools[(tools.index(self.mouse.tool) + 1) % len(tools)])

    def _show_contact(self, by: int) -> None:
        """Show the next contact that differs, or the previous one; first of all, open the page that finds them."""
        self.panel.show(Panel.WHY)
        if not self.why.show_next(by):
            order = "later" if by > 0 else "earlier"
            self.notice.show(f"no {order} contact differs, as far as it is compared")

    def _save_picture(self) -> None:
        self.draw()  # a window that has just got another size is black
        self.saver.save_picture(self.screen)

    def _toggle_full_screen(self) -> None:
        desktop = pygame.display.get_desktop_sizes()[0]
        size, flags = (self._window_size, pygame.RESIZABLE) if self._window_size else (desktop, pygame.FULLSCREEN)
        self._window_size = None if self._window_size else self.screen.get_size()
        with signals_deferred():  # set_mode discards exceptions
            self.screen = pygame.display.set_mode(size, flags)

    def _toggle_plain(self) -> None:
        self.view.plain = not self.view.plain

    def _toggle_theme(self) -> None:
        theme.use(dark=not theme.is_dark)
        self.view.recolour()

    def _toggle_column(self) -> None:
        """Close the column, or open the page that it had."""
        if self.panel.open:
            self._closed = self.panel.open
            self.panel.close()
        else:
            self.panel.show(self._closed)

    def _change_text(self, by: int) -> None:
        low, high = TEXT_HEIGHTS
        self.text_height = min(max(self.text_height + by, low), high)

    def _toggle_about(self) -> None:
        self.about_open = not self.about_open

    def _toggle_help(self) -> None:
        self.help_open = not self.help_open

    def _escape(self) -> None:
        """Close what is open over the panes; if nothing is, close the window, the second time."""
        if self.scenes.error or self.mouse.copying or self.help_open or self.mouse.tool is not Tool.HAND:
            self.scenes.error, self.help_open = "", False
            self.mouse.choose(Tool.HAND)
        elif self.notice.text in (QUIT_HINT, UNSAVED_HINT):
            self.running = False
        else:
            self.notice.show(UNSAVED_HINT if self._has_unsaved_edits else QUIT_HINT)

    @property
    def _has_unsaved_edits(self) -> bool:
        inputs = self.view.session.inputs
        return bool(inputs) and self.saver.saved != inputs

    # Drawing

    def show_progress(self) -> None:
        """Draw the window while engines run again and nothing else can be done. Raises Stopped if the user stops it."""
        self._waits = True
        self.draw()
        pygame.display.flip()
        self._waits = False
        self._pending.check()

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
            self.palette.widths(self.text_height),
            *self.timeline.widths(self.text_height),
        )

    @property
    def _placed(self) -> list[Placed]:
        """All widgets with their places."""
        layout = self.layout
        rows = (self.header, self.palette, self.timeline)
        placed = [one for row in rows for one in row.placed(layout)]
        return placed + (self.guard.run(self._page_name, self.panel.placed, layout.panel, layout.text_height) or [])

    @property
    def _page_name(self) -> str:
        return f"the page {self.panel.open.value}" if self.panel.open else "the column"

    @property
    def _is_over_panel(self) -> bool:
        return self.mouse.point is not None and self.layout.panel.collidepoint(self.mouse.point)

    def draw(self) -> None:
        """Draw everything."""
        self._show_cursor()
        if (ball := self.editor.selected) is not None:
            self.view.charts.follow(self.view.moment.balls[ball])
        layout, placed = self.layout, self._placed
        if self.screen.get_size() == layout.window:
            self._draw_on(self.screen, layout, placed)
        else:
            whole = Surface(layout.window)
            self._draw_on(whole, layout, placed)
            self.screen.blit(whole, (0, 0))
        pygame.display.set_caption(caption(self.scene))
        self._drawn = self.view.moment, self.view.charts.moment, self.status
        self._outdated = self.scenes.picker is not None and not self.scenes.picker.is_complete

    def _show_cursor(self) -> None:
        over_panes = not self.scenes.picker and self.widgets.over is None
        cursor = self.mouse.cursor if over_panes else pygame.SYSTEM_CURSOR_ARROW
        if cursor != self._cursor:
            self._cursor = cursor
            with suppress(pygame.error):  # a screen in memory has no pointers
                pygame.mouse.set_cursor(cursor)

    def _draw_on(self, surface: Surface, layout: Layout, placed: Sequence[Placed]) -> None:
        """Draw everything on a surface of the layout's size. placed: the widgets with their places."""
        guard, menu = self.guard, self.widgets.open_menu(placed)
        free_point = None if menu else self.mouse.point  # where the mouse is, unless a list is open there
        for part in layout.frame:
            fill(surface.subsurface(part), theme.ground)
        guard.run("the panes", self.view.draw_panes, surface, layout, self.showing)
        if self.panel.open is Panel.WHY:
            guard.run(WHY_PAGE, self.why.draw_contact, surface, layout)
        guard.run("the mark of the mouse", self.mouse.draw, surface)
        guard.run("the timeline", self._draw_timeline, surface, layout)
        guard.run("the chart", self.view.draw_chart, surface, layout, free_point)
        guard.run(self._page_name, self.panel.draw, surface, layout.panel, layout.text_height)
        guard.run("the buttons", self._draw_buttons, surface, layout)
        guard.run("what lies over the panes", self._draw_over, surface, layout, placed, free_point)

    def _draw_timeline(self, surface: Surface, layout: Layout) -> None:
        self.timeline.draw(surface, layout, marks_of_track(self.playback))

    def _draw_buttons(self, surface: Surface, layout: Layout) -> None:
        self.header.draw(surface, layout)
        self.palette.draw(surface, layout)

    def _draw_messages(self, surface: Surface, layout: Layout) -> None:
        """Draw a message, and what is compiled beside it; the message alone if there is no room for both."""
        text, place, height = self._progress or self.notice.text, layout.status.copy(), layout.text_height
        if self._compilation and self._compilation.is_running:
            room = place.width - status_width(self._compilation, height) - height
            if text and room < MIN_MESSAGE * height:
                room = place.width
            else:
                draw_status(surface, place, self._compilation, height)
            place.width = room
        if text:
            draw_notice(surface, place, height, text, Kind.HINT if self._progress else self.notice.kind)

    def _draw_over(
        self, surface: Surface, layout: Layout, placed: Sequence[Placed], free_point: ScreenPoint | None
    ) -> None:
        """Draw cards, messages, and what fills the window."""
        self._draw_messages(surface, layout)
        self._draw_ball_card(surface, layout)
        if free_point:
            self.view.draw_title_card(surface, layout, free_point)
        if self.scenes.error:
            draw_error_card(surface, layout, self.scenes.error)
        if self.help_open:
            draw_help(surface, layout)
        if self.scenes.picker:
            self.scenes.picker.fit(surface.get_rect(), layout.text_height)
            self.scenes.picker.draw(surface)
        elif not self.mouse.holds:
            self.widgets.fit(surface.get_rect(), layout.text_height)
            if not self.help_open:
                self.widgets.draw_tip(surface, placed, layout.text_height)
            self.widgets.draw_list(surface, placed)

    def _draw_ball_card(self, surface: Surface, layout: Layout) -> None:
        """Draw the card of the ball under the mouse, or else of one that a key selected."""
        if self.mouse.holds:
            return
        ball, point, panes = self.mouse.ball, self.mouse.point, self.view.panes
        in_charts = point is not None and layout.timeline.collidepoint(point)  # which have a card of their own
        chosen = self.editor.by_key and self.editor.selected is not None and not self._inspects()
        if ball is None and chosen and not in_charts:
            ball = self.editor.selected
            x, y = layout.to_screen(0, panes[0].state.position[ball].tolist())
            point = Rect(round(x), round(y), 1, 1).clamp(layout.arenas[0]).topleft  # a zoomed pane may not show it
        if ball is not None and point:
            draw_ball_card(surface, layout, panes, ball, point)

    @property
    def status(self) -> str:
        """What the window says of time and of what was done last."""
        recorded = "" if self.recorder.seconds is None else f"    {self.recorder.seconds:.1f} s"
        said = self._progress or self.notice.text
        return f"{self._time_line}    {self._speed}{recorded}    {self.view.charts.note}    {said}"

    @property
    def _time_line(self) -> str:
        return f"{self.view.moment.time:.2f} s"

    @property
    def _shown_time(self) -> str:
        """What the stopwatch says, or else the time."""
        zero = self.playback.stopwatch
        return self._time_line if zero is None else f"{self.view.moment.time - zero:+.3f} s"

    @property
    def _progress(self) -> str:
        """How far engines that run again still are from the current step, or nothing."""
        playback, behind, lag = self.playback, self.view.session.steps_behind, self.view.session.lag
        if behind and not (playback.paused and playback.shows_current_step):
            return f"catching up: {behind:,} steps to go{', Esc stops' if self._waits else ''}"
        if lag and self._waits:
            return f"{self.view.session.reference} is catching up: {lag:.1f} s to go, Esc stops"
        return ""

    @property
    def _speed(self) -> str:
        return "paused" if self.playback.paused else self.playback.pace.text(self.playback.speed)
