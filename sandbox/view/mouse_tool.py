"""What the mouse does in the panes and in the charts: its tools, a class each, and what a press begins."""

from collections.abc import Callable
from dataclasses import replace
from typing import ClassVar, Final

import pygame
from pygame import Surface
from pygame.event import Event

from sandbox.run.inputs import Release
from sandbox.scene.fields import Vector
from sandbox.view.controls import ZOOM_FACTOR
from sandbox.view.drags import (
    Aim,
    Bench,
    Drag,
    Pull,
    Push,
    Shift,
    Slide,
    Spot,
    ball_at,
    draw_velocity,
    ends_at,
    mark_wall,
    ring,
    wall_at,
)
from sandbox.view.editor import Editor
from sandbox.view.layout import TIMELINE_SHARE, Layout, Lens, ScreenPoint
from sandbox.view.playback import Playback
from sandbox.view.primitives import circle
from sandbox.view.theme import palette

GRAB_DISTANCE: Final = 8  # px of the screen between the pointer and the edge of a ball that it grabs


class Tool:
    """What a press in a pane does.

    pauses: it needs a run that stands still. holds: it takes hold of balls and walls; a drag of anything else moves
    what the panes show.
    """

    name: ClassVar[str]
    does: ClassVar[str]
    pauses: ClassVar[bool] = False
    holds: ClassVar[bool] = False

    def __init__(self, bench: Bench) -> None:
        self.bench = bench

    def press(self, spot: Spot) -> Drag | None:
        """Do it at a spot; return what the mouse holds from then on."""
        raise NotImplementedError

    def draw(self, surface: Surface, layout: Layout, spot: Spot) -> None:
        """Show what a press at a spot would do."""

    def at(self, spot: Spot) -> tuple[int | None, int | None]:
        """Return the ball or the wall of the scene within reach of a spot."""
        view, wall = self.bench.playback.view, wall_at(self.bench.scene, spot)
        ball, distance = ball_at(view.panes[spot.pane].state, view.moment.scene.bodies.radius, spot.position)
        if distance > 0 and wall is not None:
            return None, wall
        return (ball if distance <= spot.reach else None), None


class Hand(Tool):
    """Pulls balls and pushes walls while time passes; in a pause, it sets velocities and moves walls."""

    name = "Hand"
    does = "Pull a ball or push a wall while time passes; set a ball's velocity while it stands still"
    holds = True

    def press(self, spot: Spot) -> Drag | None:
        """Hold what is at the spot."""
        ball, wall = self.at(spot)
        if wall is not None:
            return Push(self.bench, spot, wall=wall)
        kind = Aim if self.bench.playback.paused else Pull
        return None if ball is None else kind(self.bench, spot, ball)


class MoveTool(Tool):
    """Moves balls without throwing them, walls, and their ends."""

    name = "Move"
    does = "Move a ball, a wall, or the end of a wall, in every engine; pauses"
    pauses = holds = True

    def press(self, spot: Spot) -> Drag | None:
        """Hold what is at the spot."""
        self.bench.playback.paused = True
        ball, wall = self.at(spot)
        if wall is not None:
            return Shift(self.bench, spot, wall=wall, ends=ends_at(self.bench.scene.walls[wall], spot))
        return None if ball is None else Shift(self.bench, spot, ball=ball)

    def draw(self, surface: Surface, layout: Layout, spot: Spot) -> None:
        """Mark the wall that would be held."""
        if (wall := self.at(spot)[1]) is not None:
            mark_wall(surface, layout, self.bench.scene.walls[wall])


class BallTool(Tool):
    """Adds balls."""

    name = "Ball"
    does = "Add a ball where you click, like the selected one or the last"

    def press(self, spot: Spot) -> Drag | None:
        """Add a ball."""
        self.bench.editor.add(spot.position)
        return None

    def draw(self, surface: Surface, layout: Layout, spot: Spot) -> None:
        """Draw its outline."""
        radius, ink = self.bench.editor.new_ball["radius"], palette(self.bench.scene.arena.background).ink
        circle(surface, ink, spot.point, radius * layout.scale, max(2, round(layout.text_height / 7)))


class WallTool(Tool):
    """Draws walls."""

    name = "Wall"
    does = "Draw a wall from here to there; pauses"
    pauses = True

    def press(self, spot: Spot) -> Drag | None:
        """Begin a wall."""
        self.bench.playback.paused = True
        return Shift(self.bench, spot)


class Eraser(Tool):
    """Deletes balls and walls."""

    name = "Erase"
    does = "Delete the ball or the wall that you click"

    def press(self, spot: Spot) -> Drag | None:
        """Delete the ball, or else the wall."""
        ball, wall = self.at(spot)
        if wall is not None:
            self.bench.editor.select_wall(wall)
        if ball is not None or wall is not None:
            self.bench.editor.delete(ball)
        return None


class MouseTool:
    """The mouse over the panes and the charts.

    tool: what a press in a pane does. drag: what the mouse holds. point: of the screen, while the mouse is over the
    window. lens: what the panes show. timeline_share: of the window's height.
    """

    def __init__(self, playback: Playback, editor: Editor, layout: Callable[[], Layout]) -> None:
        self._playback, self._editor, self._layout = playback, editor, layout
        self.bench = Bench(playback, editor, layout)
        self.hand = Hand(self.bench)
        self.tools = (self.hand, *(tool(self.bench) for tool in (MoveTool, BallTool, WallTool, Eraser)))
        self.tool: Tool = self.hand
        self.point: ScreenPoint | None = None
        self.lens, self.timeline_share = Lens(), TIMELINE_SHARE
        self.reset()

    def reset(self) -> None:
        """Drop what the mouse holds, because another run begins."""
        self.drag: Drag | None = None

    def choose(self, tool: Tool) -> None:
        """Let the mouse do something else; pause if that needs it."""
        self.release()
        self.tool = tool
        self._playback.paused = self._playback.paused or tool.pauses

    def choose_next(self) -> None:
        """Let the mouse do what the next tool does."""
        self.choose(self.tools[(self.tools.index(self.tool) + 1) % len(self.tools)])

    def is_used(self, tool: Tool) -> bool:
        """Return whether a tool is chosen."""
        return self.tool is tool

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
        return self.tool.at(replace(spot, reach=0.0))[0] if spot else None

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
        is_near = spot is not None and self.tool.at(spot) != (None, None)
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
        elif event.type == pygame.MOUSEWHEEL and self.point:
            self._zoom(self.point, ZOOM_FACTOR**event.y)
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
        mark = charts.mark_at(layout.strip, layout.text_height, point) if over_time else None
        if mark and mark.time is not None:
            self._go_to(mark.time)
        elif over_time:
            return Slide(self.bench, point, self._scrub_chart)
        elif layout.bar.collidepoint(point):
            return Slide(self.bench, point, self._scrub_track)
        elif layout.splitter.collidepoint(point):
            return Slide(self.bench, point, self._split)
        elif spot:
            drag = self.tool.press(spot)
            if drag or not self.tool.holds:
                return drag
            self._editor.select(None, spot.pane)
            self._panned_from = point
            return Slide(self.bench, point, self._pan)
        return None

    def _zoom(self, point: ScreenPoint, factor: float) -> None:
        """Enlarge what the panes show about a point."""
        layout, position = self._layout(), self.position
        if position:
            width, height = layout.arena
            self.lens = self.lens.zoomed(factor, (position[0] / width, position[1] / height))

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
        self._go_to(self._playback.view.charts.time_at(layout.strip, layout.text_height, point[0]))

    def _go_to(self, time: float) -> None:
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

    # Actions that depend on where the mouse is

    def add_ball(self) -> None:
        """Add a ball at the mouse."""
        self.release()
        self._editor.add(self.position)

    def delete_ball(self) -> None:
        """Delete the ball under the mouse, or else the selected ball or wall."""
        self._editor.delete(self.ball)

    def draw(self, surface: Surface) -> None:
        """Mark what is selected in every pane, and what the mouse holds or could hold."""
        layout, view, spot = self._layout(), self._playback.view, self._spot(self.point)
        ball, scene = self._editor.selected, view.moment.scene
        if ball is not None:
            ink, radius = palette(scene.arena.background).ink, float(scene.bodies.radius[ball])
            for pane, arena in zip(view.panes, layout.arenas, strict=True):
                ring(surface.subsurface(arena), layout, pane.state.position[ball].tolist(), radius, ink)
            if self.aimed or self._playback.paused:
                draw_velocity(surface, self.bench, ball, self.aimed)
        if (wall := self._editor.selected_wall) is not None:
            mark_wall(surface, layout, scene.walls[wall])
        if self.drag:
            self.drag.draw(surface, layout)
        elif spot:
            self.tool.draw(surface, layout, spot)
