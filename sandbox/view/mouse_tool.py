"""What the mouse does in the panes and in the chart: a table of its tools, and what a press begins."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import pygame
from pygame import Surface
from pygame.event import Event

from sandbox.run.inputs import Release
from sandbox.scene.fields import Vector
from sandbox.view.controls import ZOOM_FACTOR
from sandbox.view.drags import Aim, Bench, Drag, NewWall, Pull, Shift, Slide, Spot, draw_velocity, mark_wall, ring
from sandbox.view.editor import Editor
from sandbox.view.layout import TIMELINE_SHARE, Layout, Lens, ScreenPoint
from sandbox.view.playback import Playback
from sandbox.view.primitives import circle
from sandbox.view.theme import palette

GRAB_DISTANCE: Final = 8  # px of the screen between the pointer and the edge of a ball that it grabs


@dataclass(frozen=True, eq=False)
class Tool:
    """What a press in a pane does.

    press: does it at a spot, and returns what the mouse holds from then on. pauses: it needs a run that stands still.
    holds: it is for a ball or a wall, which is selected first; a drag of anything else moves what the panes show. mark:
    shows what a press at a spot would do.
    """

    name: str
    does: str
    press: Callable[[Bench, Spot], Drag | None]
    pauses: bool = False
    holds: bool = False
    mark: Callable[[Bench, Spot, Surface], None] = lambda *_: None


def _hand(bench: Bench, spot: Spot) -> Drag:
    if bench.editor.selected is None:
        return Shift(bench, spot)
    return (Aim if bench.playback.paused else Pull)(bench, spot)


def _mark_wall(bench: Bench, spot: Spot, surface: Surface) -> None:
    if (wall := bench.at(spot)[1]) is not None:
        mark_wall(surface, bench.layout(), bench.scene.walls[wall])


def _add_ball(bench: Bench, spot: Spot) -> None:
    bench.editor.add(spot.position)


def _mark_ball(bench: Bench, spot: Spot, surface: Surface) -> None:
    layout, ink = bench.layout(), palette(bench.scene.arena.background).ink
    radius, width = bench.editor.new_ball["radius"] * layout.scale, max(2, round(layout.text_height / 7))
    circle(surface, ink, spot.point, radius, width)


def _erase(bench: Bench, spot: Spot) -> None:
    bench.editor.delete(None)


HAND: Final = Tool(
    "Hand", "Pull a ball while time passes, set its velocity while it stands still; move a wall", _hand, holds=True
)
TOOLS: Final = (
    HAND,
    Tool("Move", "Move a ball, a wall, or the end of a wall, in every engine; pauses", Shift, True, True, _mark_wall),
    Tool("Ball", "Add a ball where you click, like the selected one or the last", _add_ball, mark=_mark_ball),
    Tool("Wall", "Draw a wall from here to there; pauses", NewWall, pauses=True),
    Tool("Erase", "Delete the ball or the wall that you click", _erase, holds=True),
)


class MouseTool:
    """The mouse over the panes and the chart.

    tool: what a press in a pane does. drag: what the mouse holds. point: of the screen, while the mouse is over the
    window. lens: what the panes show. timeline_share: of the window's height.
    """

    hand, tools = HAND, TOOLS

    def __init__(self, playback: Playback, editor: Editor, layout: Callable[[], Layout]) -> None:
        self._playback, self._editor, self._layout = playback, editor, layout
        self._bench = Bench(playback, editor, layout)
        self.tool = self.hand
        self.point: ScreenPoint | None = None
        self.lens, self.timeline_share = Lens(), TIMELINE_SHARE
        self.drag: Drag | None = None

    def choose(self, tool: Tool) -> None:
        """Let the mouse do something else; pause if that needs it."""
        self.release()
        self.tool = tool
        self._playback.paused = self._playback.paused or tool.pauses

    # What the mouse is over

    @property
    def pane(self) -> int | None:
        """The pane under the mouse."""
        return self._layout().pane_at(self.point) if self.point else None

    def _spot(self, point: ScreenPoint | None) -> Spot | None:
        layout = self._layout()
        pane = layout.pane_at(point) if point else None
        if pane is None or point is None:
            return None
        return Spot(point, pane, layout.to_scene(pane, point), GRAB_DISTANCE / layout.scale)

    @property
    def position(self) -> Vector | None:
        """The position in the scene under the mouse, px."""
        spot = self._spot(self.point)
        return spot.position if spot else None

    @property
    def ball(self) -> int | None:
        """The ball under the mouse."""
        spot = self._spot(self.point)
        return self._bench.at(replace(spot, reach=0.0))[0] if spot else None

    @property
    def cursor(self) -> int:
        """The pointer that shows what the mouse holds, or could hold: one of pygame's SYSTEM_CURSOR."""
        spot, splitter = self._spot(self.point), self._layout().splitter
        if self.drag is None and self.point and splitter.collidepoint(self.point):
            return pygame.SYSTEM_CURSOR_SIZENS
        if self.holds:
            return pygame.SYSTEM_CURSOR_SIZEALL
        if spot and not self.tool.holds:
            return pygame.SYSTEM_CURSOR_CROSSHAIR
        is_near = spot is not None and self._bench.at(spot) != (None, None)
        return pygame.SYSTEM_CURSOR_HAND if is_near else pygame.SYSTEM_CURSOR_ARROW

    @property
    def holds(self) -> bool:
        """Whether the mouse holds something."""
        return self.drag is not None or self._playback.session.held is not None

    @property
    def aimed(self) -> Vector | None:
        """The velocity that the drag gives to the selected ball in every engine, px/s."""
        return self.drag.velocity if isinstance(self.drag, Aim) else None

    # Events

    def track(self, event: Event) -> None:
        """Note where the mouse is, whatever lies over the panes."""
        if event.type == pygame.MOUSEMOTION:
            self.point = event.pos
        elif event.type == pygame.WINDOWLEAVE:
            self.point = None

    def on_event(self, event: Event) -> None:
        """Handle what the mouse does outside of the toolbar."""
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._playback.settle()
            self.drag = self._pressed(event.pos)
        elif event.type == pygame.MOUSEWHEEL and (position := self.position):  # about which the panes zoom
            x, y = (at / side for at, side in zip(position, self._layout().arena, strict=True))
            self.lens = self.lens.zoomed(ZOOM_FACTOR**event.y, (x, y))
        elif event.type == pygame.MOUSEMOTION and self.drag and event.buttons[0]:
            self.drag.move(event.pos)
        elif (event.type == pygame.MOUSEBUTTONUP and event.button == 1) or event.type == pygame.MOUSEMOTION:
            self.release()
        elif event.type == pygame.WINDOWFOCUSLOST:
            drag, self.drag = self.drag, None
            if drag:
                drag.cancel()
            self.release()

    def _pressed(self, point: ScreenPoint) -> Drag | None:
        """Return what the mouse holds after a press of its left button."""
        layout, charts, spot = self._layout(), self._playback.view.charts, self._spot(point)
        over_time = charts.is_over_time(layout.strip, point)
        on_track, on_splitter = layout.bar.collidepoint(point), layout.splitter.collidepoint(point)
        if over_time or on_track or on_splitter:
            return Slide(self._scrub_chart if over_time else self._scrub_track if on_track else self._split, point)
        return self._pressed_pane(spot) if spot else None

    def _pressed_pane(self, spot: Spot) -> Drag | None:
        self._playback.paused = self._playback.paused or self.tool.pauses
        if self.tool.holds:
            ball, wall = self._bench.at(spot)
            self._editor.select(ball, spot.pane, wall)
            if ball is None and wall is None:
                self._panned_from = spot.point
                return Slide(self._pan, spot.point)
        return self.tool.press(self._bench, spot)

    def _split(self, point: ScreenPoint) -> None:
        self.timeline_share = self._layout().timeline_share_at(point[1])

    def _pan(self, point: ScreenPoint) -> None:
        """Move what all panes show with the mouse to a point of the screen."""
        layout, before = self._layout(), self._panned_from
        x, y = ((before[k] - point[k]) / layout.scale / layout.arena[k] for k in (0, 1))
        self.lens, self._panned_from = self.lens.moved((x, y)), point

    def _scrub_track(self, point: ScreenPoint) -> None:
        bar, playback = self._layout().bar, self._playback
        share = (point[0] - bar.x) / max(1, bar.width - 1)
        playback.paused = True
        playback.seek(round(min(max(share, 0.0), 1.0) * playback.track_end))

    def _scrub_chart(self, point: ScreenPoint) -> None:
        layout = self._layout()
        time = self._playback.view.charts.time_at(layout.strip, layout.text_height, point[0])
        self._playback.paused = True
        self._playback.seek(self._playback.session.step_at(time))

    def zoom_by(self, factor: float) -> None:
        """Zoom all panes about the middle of what they show."""
        self.lens = self.lens.zoomed(factor, self.lens.centre)

    def show_all(self) -> None:
        """Let the panes show all of the arena."""
        self.lens = Lens()

    def release(self) -> None:
        """Let go of what the mouse holds."""
        drag, self.drag = self.drag, None
        if drag:
            drag.end()
        elif self._playback.session.held is not None:
            self._playback.give(Release(step=self._playback.session.step))

    def draw(self, surface: Surface) -> None:
        """Mark what is selected in every pane, and what the mouse holds or could hold."""
        layout, view, spot = self._layout(), self._playback.view, self._spot(self.point)
        ball, scene = self._editor.selected, view.moment.scene
        if ball is not None:
            ink, radius = palette(scene.arena.background).ink, float(scene.bodies.radius[ball])
            for pane, arena in zip(view.panes, layout.arenas, strict=True):
                ring(surface.subsurface(arena), layout, pane.state.position[ball].tolist(), radius, ink)
            if self.aimed or self._playback.paused:
                draw_velocity(surface, self._bench, ball, self.aimed)
        if (wall := self._editor.selected_wall) is not None:
            mark_wall(surface, layout, scene.walls[wall])
        if self.drag:
            self.drag.draw(surface, layout)
        elif spot:
            self.tool.mark(self._bench, spot, surface)
