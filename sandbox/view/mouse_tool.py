"""What the mouse does in the panes and in the charts: it pulls balls, sets velocities, places balls, seeks."""

import math
from collections.abc import Callable
from typing import Final

import pygame
from pygame import Surface
from pygame.event import Event

from sandbox.quantity import length
from sandbox.run.inputs import Grab, Move, Release
from sandbox.scene.fields import Vector
from sandbox.scene.model import ARENA_WALLS
from sandbox.scene.units import Dimension
from sandbox.state import Floats, State
from sandbox.view.editor import Editor
from sandbox.view.layout import Layout, Lens, ScreenPoint
from sandbox.view.move_tool import PAUSING, Grip, MoveTool, Tool
from sandbox.view.overlay import ARROW_SECONDS
from sandbox.view.playback import Playback
from sandbox.view.primitives import arrow, label
from sandbox.view.theme import palette

GRAB_DISTANCE: Final = 8  # px of the screen between the pointer and the edge of a ball that it grabs
ZOOM_FACTOR: Final = 1.25  # by which a notch of the wheel enlarges what the panes show, or the charts' time
CLICK_DISTANCE: Final = 4  # px of the screen that the mouse may move in a click


class MouseTool:
    """The mouse over the window.

    The hand pulls a ball or pushes a wall while time passes; while the run is paused, it selects a ball and drags the
    tip of its velocity, or moves a wall. The other tools move, add and delete.
    """

    def __init__(self, playback: Playback, editor: Editor, layout: Callable[[], Layout]) -> None:
        self._playback = playback
        self._editor = editor
        self._layout = layout
        self.move = MoveTool(playback, editor)
        self.point: ScreenPoint | None = None  # of the screen, while the mouse is over the window
        self.scrubbing = False  # the mouse drags the time,
        self._on_track = False  # on the track, or else in the chart
        self.lens = Lens()
        self._moved_from: ScreenPoint | None = None  # where the middle button has moved the panes' contents from
        self.reset()

    def reset(self) -> None:
        """Drop what belongs to a run, because another one begins."""
        self.copying = False  # the next click places a copy of the selected ball
        self.move.let_go()
        self.aim: Vector | None = None  # px, where the selected ball's velocity is dragged to, in the mouse's pane
        self._pressed: ScreenPoint | None = None  # where the mouse went down on that ball, or on what it moves
        self._pane = 0  # in which the mouse went down

    @property
    def tool(self) -> Tool:
        """What a press of the mouse does."""
        return self.move.tool

    def choose(self, tool: Tool) -> None:
        """Let the mouse do something else; pause if that needs it."""
        self.release()
        self.copying = False
        self.move.tool = tool
        if tool in PAUSING:
            self._playback.paused = True

    def choose_next(self) -> None:
        """Let the mouse do what the next tool does."""
        tools = [*Tool, *Tool]
        self.choose(tools[tools.index(self.tool) + 1])

    @property
    def adding(self) -> bool:
        """Whether the next click places a ball."""
        return self.tool is Tool.BALL or self.copying

    # What the mouse is over

    @property
    def pane(self) -> int | None:
        """The pane under the mouse."""
        return self._layout().pane_at(self.point) if self.point else None

    @property
    def position(self) -> Vector | None:
        """The position in the scene under the mouse, px."""
        pane = self.pane
        return self._layout().to_scene(pane, self.point) if pane is not None and self.point else None

    @property
    def _nearest(self) -> tuple[int, float]:
        """The ball whose edge is nearest to the mouse, and how far that is, px; infinite outside a pane."""
        pane, position = self.pane, self.position
        return (0, math.inf) if pane is None or position is None else self._nearest_to(pane, position)

    def _nearest_to(self, pane: int, position: Vector) -> tuple[int, float]:
        view = self._playback.view
        return ball_at(view.panes[pane].state, view.moment.scene.bodies.radius, position)

    @property
    def ball(self) -> int | None:
        """The ball under the mouse."""
        ball, distance = self._nearest
        return ball if distance <= 0 else None

    @property
    def _over_wall(self) -> bool:
        """Whether the mouse is over a wall of the scene, which the hand can move."""
        position = self.position if self.tool is Tool.HAND else None
        wall = None if position is None else self.move.wall_at(position, self._reach)
        return wall is not None and wall >= len(ARENA_WALLS)

    @property
    def cursor(self) -> int:
        """The pointer that shows what the mouse holds, or could hold: one of pygame's SYSTEM_CURSOR."""
        if self.holds or self._moved_from:
            return pygame.SYSTEM_CURSOR_SIZEALL
        if self.pane is not None and (self.adding or self.tool in (Tool.WALL, Tool.ERASE)):
            return pygame.SYSTEM_CURSOR_CROSSHAIR
        grips = self.hovered or self._nearest[1] <= self._reach or self._over_wall
        return pygame.SYSTEM_CURSOR_HAND if grips else pygame.SYSTEM_CURSOR_ARROW

    @property
    def holds(self) -> bool:
        """Whether the mouse holds a ball or a wall, or the tip of a velocity."""
        return self._pressed is not None or self.move.grip is not None or self._playback.session.held is not None

    @property
    def _moves(self) -> bool:
        """Whether a press of the mouse may move something."""
        return self.tool in PAUSING and not self.copying

    @property
    def _reach(self) -> float:
        """How near the mouse must be to what it grabs, px of the scene."""
        return GRAB_DISTANCE / self._layout().scale

    @property
    def hovered(self) -> Grip | None:
        """What a press of the mouse here would move."""
        pane, position = self.pane, self.position
        if pane is None or position is None or not self._moves or self.holds:
            return None
        return self.move.grip_at(pane, position, self._reach)

    @property
    def aimed(self) -> Vector | None:
        """The velocity that the drag gives to the selected ball in every engine, px/s."""
        ball = self._editor.selected
        if self.aim is None or ball is None:
            return None
        vx, vy = ((self.aim - self._playback.view.panes[self._pane].state.position[ball]) / ARROW_SECONDS).tolist()
        return vx, vy

    # Events

    def track(self, event: Event) -> None:
        """Note where the mouse is, whatever lies over the panes."""
        if event.type == pygame.MOUSEMOTION:
            self.point = event.pos
        elif event.type == pygame.WINDOWLEAVE:
            self.point = None

    def on_event(self, event: Event) -> None:
        """Handle what the mouse does outside of the toolbar."""
        if self._zooms_charts(event):
            return
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            layout = self._layout()
            charts, strip = self._playback.view.charts, layout.strip
            over_time = charts.is_over_time(strip, event.pos)
            mark = charts.mark_at(strip, layout.text_height, event.pos) if over_time else None
            if mark and mark.time is not None:
                self._go_to(mark.time)
                return
            self._on_track = layout.bar.collidepoint(event.pos)
            self.scrubbing = over_time or self._on_track
            self._scrub(event.pos) if self.scrubbing else self._press(event.pos)
        elif event.type in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP) and event.button == 2:
            is_down = event.type == pygame.MOUSEBUTTONDOWN and self._layout().pane_at(event.pos) is not None
            self._moved_from = event.pos if is_down else None
        elif event.type == pygame.MOUSEWHEEL and (position := self.position):
            width, height = self._layout().arena
            self.lens = self.lens.zoomed(ZOOM_FACTOR**event.y, (position[0] / width, position[1] / height))
        elif event.type == pygame.MOUSEMOTION and self._moved_from:
            self._move_lens(event.pos if event.buttons[1] else None)
        elif event.type == pygame.MOUSEMOTION and (self.scrubbing or self.holds):
            if not event.buttons[0]:
                self.release()
            else:
                self._scrub(event.pos) if self.scrubbing else self._drag(event.pos)
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 1:
            self.release()
        elif event.type == pygame.WINDOWFOCUSLOST:
            self.aim = self._pressed = None
            self.move.let_go()
            self.release()

    def _zooms_charts(self, event: Event) -> bool:
        """Zoom in time with the wheel, or with a drag of the right button; return whether the event did that."""
        layout, charts, point = self._layout(), self._playback.view.charts, self.point
        if not layout.strip.height or point is None:
            return False
        axis, over_time = charts.axis, charts.is_over_time(layout.strip, point)
        time = charts.time_at(layout.strip, layout.text_height, point[0])
        if event.type == pygame.MOUSEWHEEL and over_time:
            axis.zoom(time, ZOOM_FACTOR**-event.y)
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 3 and over_time:
            axis.selection = time, time
        elif event.type == pygame.MOUSEMOTION and axis.selection and event.buttons[2]:
            axis.selection = axis.selection[0], time
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 3:
            axis.zoom_to_selection()
        else:
            return False
        return True

    def _move_lens(self, point: ScreenPoint | None) -> None:
        """Move what all panes show with the mouse to a point of the screen; without a point, stop moving it."""
        layout, before = self._layout(), self._moved_from
        if point and before:
            x, y = ((before[k] - point[k]) / layout.scale / layout.arena[k] for k in (0, 1))
            self.lens = self.lens.moved((x, y))
        self._moved_from = point

    def zoom_by(self, factor: float) -> None:
        """Zoom all panes about the middle of what they show."""
        self.lens = self.lens.zoomed(factor, self.lens.centre)

    def show_all(self) -> None:
        """Let the panes show all of the arena."""
        self.lens = Lens()

    def _press(self, point: ScreenPoint) -> None:
        """Grab or select the ball nearest to a point of the screen, if it is near enough; or place a new one."""
        layout = self._layout()
        pane = layout.pane_at(point)
        if pane is None:
            return
        self._playback.settle()
        self._pane, position = pane, layout.to_scene(pane, point)
        if self.adding:
            self._editor.copy(position) if self.copying else self._editor.add(position)
            self.copying = False
            return
        ball, distance = self._nearest_to(pane, position)
        if self.tool is Tool.ERASE:
            wall = None if distance <= 0 else self.move.wall_at(position, self._reach)
            if wall is not None:
                self._editor.select_wall(wall)
            if distance <= 0 or wall is not None:
                self._editor.delete(ball if distance <= 0 else None)
            return
        if self._moves:
            self._playback.paused = True
        if self._moves and self.move.press(pane, position, self._reach):
            self._pressed = point
            return
        near = distance <= self._reach
        if near and not self._playback.paused:
            self._playback.give(Grab(step=self._playback.session.step, ball=ball, at=position))
            self._editor.select(ball, pane)
        else:
            self._editor.select(ball if near else None, pane)
            self._pressed = point if near else None
            wall = None if near else self.move.wall_at(position, self._reach)
            if wall is not None:
                self._editor.select_wall(wall)
            if wall is not None and wall >= len(ARENA_WALLS):
                self.move.hold_wall(wall, pane, position)
                self._pressed = point

    def _drag(self, point: ScreenPoint) -> None:
        position = self._layout().to_scene(self._pane, point)
        session, arena = self._playback.session, self._playback.scene.arena
        if session.held is not None:
            self._playback.give(Move(step=session.step, at=arena.nearest_inside(position)))
        elif self._pressed is not None:
            is_drag = math.dist(point, self._pressed) > CLICK_DISTANCE
            if self.move.grip is not None and (self.move.edit or is_drag):
                self.move.drag(position)
            elif self.move.grip is None and (self.aim or is_drag):
                self.aim = position

    def release(self) -> None:
        """Let go of what the mouse holds."""
        if self.move.grip:
            self.move.release()
        if self.aim:
            self._playback.settle()
        velocity, self.aim, self._pressed, self.scrubbing = self.aimed, None, None, False
        session, ball = self._playback.session, self._editor.selected
        if session.held is not None:
            self._playback.give(Release(step=session.step))
        elif velocity is not None and ball is not None:
            self._editor.set_velocity(ball, velocity)

    def _scrub(self, point: ScreenPoint) -> None:
        """Pause, and go to the time at a point of the charts or of the time bar."""
        layout, playback = self._layout(), self._playback
        if self._on_track:
            share = (point[0] - layout.bar.x) / max(1, layout.bar.width - 1)
            playback.paused = True
            playback.seek(round(min(max(share, 0.0), 1.0) * playback.track_end))
        else:
            self._go_to(playback.view.charts.time_at(layout.strip, layout.text_height, point[0]))

    def _go_to(self, time: float) -> None:
        self._playback.paused = True
        self._playback.seek(self._playback.session.step_at(time))

    # Actions that depend on where the mouse is

    def add_ball(self) -> None:
        """Add a ball at the mouse, or else near the middle."""
        self.release()
        self.copying = False
        self._editor.add(self.position)

    def copy_ball(self) -> None:
        """Let the next click place a copy of the selected ball; if that was so already, let it not."""
        self.release()
        self.copying = not self.copying

    def delete_ball(self) -> None:
        """Delete the ball under the mouse, or else the selected ball or wall."""
        self._editor.delete(self.ball)

    def draw(self, surface: Surface) -> None:
        """Mark the selected ball in every pane, and draw what is held."""
        layout, view, ball = self._layout(), self._playback.view, self._editor.selected
        scene, scale = view.moment.scene, layout.scale
        ink, width = palette(scene.arena.background).ink, max(2, round(layout.text_height / 7))
        if ball is not None:
            radius = scene.bodies.radius[ball] * scale + 2 * width
            for pane, arena in zip(view.panes, layout.arenas, strict=True):
                centre = (pane.state.position[ball] * scale + layout.origin).tolist()
                pygame.draw.circle(surface.subsurface(arena), ink, centre, radius, width)
            if self.aimed:
                self._draw_velocity(surface, ball, self.aimed)
        self.move.draw(surface, layout, self.hovered)
        if self.adding and self.point and self.pane is not None:
            copied = self._editor.selected if self.copying else None
            size = self._editor.size_of_new("radius") if copied is None else scene.bodies.radius[copied]
            pygame.draw.circle(surface, ink, self.point, size * scale, width)

    def _draw_velocity(self, surface: Surface, ball: int, velocity: Vector) -> None:
        """Draw the velocity that a ball is given from each of its copies, over the edges of the panes."""
        layout, view = self._layout(), self._playback.view
        colours = palette(view.moment.scene.arena.background)
        width = max(2, round(layout.text_height / 7))
        (vx, vy), units = velocity, view.moment.scene.units
        template = f"{{:.{units.decimals(Dimension.VELOCITY, 0)}f}}"
        speed = units.text(Dimension.VELOCITY, template, math.hypot(vx, vy))
        text = f"{speed}, {math.degrees(math.atan2(vy, vx)):.0f}\N{DEGREE SIGN}"
        for index, (pane, arena) in enumerate(zip(view.panes, layout.arenas, strict=True)):
            x, y = layout.to_screen(index, pane.state.position[ball].tolist())
            if not arena.collidepoint(x, y):
                continue
            tip = x + vx * ARROW_SECONDS * layout.scale, y + vy * ARROW_SECONDS * layout.scale
            arrow(surface, colours.ground, (x, y), tip, 2 * width)  # or the frame would hide it
            arrow(surface, colours.ink, (x, y), tip, width)
            beyond = tip[0], tip[1] + math.copysign(1.2 * layout.text_height, vy)
            label(surface, text, beyond, layout.text_height, arena, colours)


def ball_at(state: State, radius: Floats, position: Vector) -> tuple[int, float]:
    """Find the ball whose edge is nearest to a position, and how far that is: px, negative inside the ball."""
    distance = length(state.position - position) - radius
    ball = int(distance.argmin())
    return ball, float(distance[ball])
