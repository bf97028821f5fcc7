"""Moving balls and walls of a paused run with the mouse, dragging walls of a running one, and drawing walls."""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import numpy as np
import pygame
from pygame import Color, Surface

from sandbox.errors import SandboxError
from sandbox.quantity import length
from sandbox.run.edits import AddWall, ChangeBall, ChangeWall, Edit, edited
from sandbox.scene.fields import Vector
from sandbox.scene.model import ARENA_WALLS, Wall
from sandbox.scene.walls import segment_distance
from sandbox.view.editor import Editor
from sandbox.view.layout import Layout
from sandbox.view.playback import Playback
from sandbox.view.primitives import draw_wall, label
from sandbox.view.theme import palette, theme

Line = tuple[Vector, Vector, float]  # the ends of a wall and its thickness, px
HANDLE: Final = 0.45  # radius of the rings at a wall's ends, in heights of the text
SHARES: Final = (1.0, 0.5, 0.25, 0.125, 0.0625)  # of a dragged wall's way in a step, tried where balls are in its way


class Tool(Enum):
    """What the mouse does in a pane."""

    HAND = "Hand"
    MOVE = "Move"
    BALL = "Ball"
    WALL = "Wall"
    ERASE = "Erase"


DOES: Final = {  # what a press of the mouse does with each tool
    Tool.HAND: "pull a ball or push a wall while time passes; set a ball's velocity while it stands still",
    Tool.MOVE: "move a ball, a wall, or the end of a wall, in every engine; pauses",
    Tool.BALL: "add a ball where you click, like the selected one or the last",
    Tool.WALL: "draw a wall from here to there; pauses",
    Tool.ERASE: "delete the ball or the wall that you click",
}
PAUSING: Final = (Tool.MOVE, Tool.WALL)  # what is to be moved must stand still


@dataclass(frozen=True)
class Grip:
    """What the mouse holds, or could: a ball, or a wall, or one end of it; nothing of these if it draws a new wall.

    pressed: where the mouse went down, px of the scene; end: 0 for a wall's `from`, 1 for its `to`.
    """

    pressed: Vector
    ball: int | None = None
    wall: int | None = None
    end: int | None = None


class MoveTool:
    """Moves a ball to the same place in every engine, without throwing it; moves walls and their ends; draws walls.

    While time passes, a wall that is held follows the mouse between the steps, and no ball is moved.
    """

    def __init__(self, playback: Playback, editor: Editor) -> None:
        self._playback = playback
        self._editor = editor
        self.tool = Tool.HAND
        self.thickness = 4.0  # px, of walls to be drawn
        self.let_go()

    def let_go(self) -> None:
        """Hold nothing."""
        self.grip: Grip | None = None
        self._pane = 0
        self._at: Vector | None = None  # px of the scene, where the mouse has dragged it
        self._latest: Edit | None = None  # of the drag of a wall while time passes

    def grip_at(self, pane: int, position: Vector, reach: float) -> Grip | None:
        """Return what the mouse would hold at a position in a pane, px of the scene. reach: how near it must be, px."""
        if self.tool is Tool.WALL:
            return Grip(self._playback.scene.arena.nearest_inside(position))
        state, scene = self._playback.view.panes[pane].state, self._playback.scene
        to_ball = length(state.position - position) - scene.bodies.radius
        to_wall = [_distance((wall.start, wall.to, wall.thickness), position) for wall in scene.walls]
        ball, wall = int(to_ball.argmin()), int(np.argmin(to_wall)) if to_wall else None
        if wall is not None and to_wall[wall] < min(float(to_ball[ball]), reach):
            return Grip(position, wall=wall, end=_end_at(scene.walls[wall], position, 2 * reach))
        return Grip(position, ball=ball) if to_ball[ball] <= reach else None

    def wall_at(self, position: Vector, reach: float) -> int | None:
        """Return the number of the wall within reach (px) of a position, if there is one; the arena's are walls too."""
        away = {
            wall: _distance(self._playback.scene.wall_line(wall), position)
            for wall in self._playback.scene.wall_numbers
        }
        return min((wall for wall in away if away[wall] <= reach), key=away.__getitem__, default=None)

    def press(self, pane: int, position: Vector, reach: float) -> bool:
        """Hold what is at a position, and select it. Return whether there is something to move, or a wall to draw."""
        grip = self.grip_at(pane, position, reach)
        if grip is None:
            return False
        if grip.wall is not None:
            self._editor.select_wall(len(ARENA_WALLS) + grip.wall)
        else:
            self._editor.select(grip.ball, pane)
        self.grip, self._pane, self._at = grip, pane, None
        return True

    def hold_wall(self, wall: int, pane: int, position: Vector) -> None:
        """Hold a wall of the scene, by its number among all walls, at a position in a pane, px of the scene."""
        self.grip, self._pane, self._at = Grip(position, wall=wall - len(ARENA_WALLS)), pane, None

    def drag(self, position: Vector) -> None:
        """Move what is held, or the new wall's end, to a position, px of the scene."""
        self._at = self._playback.scene.arena.nearest_inside(position)

    def release(self) -> None:
        """Do what the drag shows, in every engine; let go."""
        self._playback.settle()
        edit = None if self._follows else self.edit
        self.let_go()
        if edit is not None:
            walls = len(self._playback.scene.walls)
            self._editor.give(edit)
            if len(self._playback.scene.walls) > walls:
                self._editor.select_wall(len(ARENA_WALLS) + walls)

    @property
    def _follows(self) -> bool:
        """Whether what the mouse holds is a wall that moves while time passes."""
        grip = self.grip
        return grip is not None and grip.wall is not None and grip.end is None and not self._playback.paused

    def follow(self) -> None:
        """Let a wall that is held go towards the mouse before the next step, as far as no ball is in its way.

        In a step it goes at most the smallest radius, so that no ball is passed.
        """
        grip, at, session = self.grip, self._at, self._playback.session
        is_done = self._latest is not None and self._latest.step == session.step
        if (
            grip is None
            or at is None
            or not self._follows
            or not self._is_there(grip)
            or is_done
            or session.steps_behind
        ):
            return
        distance = math.dist(grip.pressed, at)
        longest = min(1.0, float(self._playback.scene.bodies.radius.min()) / distance) if distance else 0.0
        for share in SHARES if distance else ():
            dx, dy = (share * longest * (end - start) for start, end in zip(grip.pressed, at, strict=True))
            if self._shift_wall(grip.wall or 0, (dx, dy)):
                self.grip = replace(grip, pressed=(grip.pressed[0] + dx, grip.pressed[1] + dy))
                return

    def _shift_wall(self, number: int, by: Vector) -> bool:
        """Move a wall by some px, as a part of the drag. Return whether there was room for it in every engine."""
        session, wall = self._playback.session, self._playback.scene.walls[number]
        start, to = (_shifted(end, (0.0, 0.0), by) for end in (wall.start, wall.to))
        continued = True if self._latest is not None and session.given()[-1:] == [self._latest] else None
        edit = ChangeWall(step=session.step, wall=number, start=start, to=to, continued=continued)
        try:
            edited(self._playback.scene, edit, self._playback.view.moment.states)
        except SandboxError:
            return False
        self._playback.give(edit)
        self._latest = edit
        return True

    @property
    def edit(self) -> Edit | None:
        """What a release of the mouse would do."""
        grip, at, step = self.grip, self._at, self._playback.session.step
        if grip is None or at is None or not self._is_there(grip):
            return None
        if grip.ball is not None:
            state, arena = self._playback.view.panes[self._pane].state, self._playback.scene.arena
            x, y = _shifted(state.position[grip.ball].tolist(), grip.pressed, at)
            if arena.walls:
                x, y = arena.nearest_inside((x, y), float(self._playback.scene.bodies.radius[grip.ball]))
            return ChangeBall(step=step, ball=grip.ball, x=x, y=y)
        if grip.wall is None:
            return AddWall(step=step, start=grip.pressed, to=at, thickness=self.thickness)
        wall = self._playback.scene.walls[grip.wall]
        start, to = (_shifted(end, grip.pressed, at) for end in (wall.start, wall.to))
        ends = ({"start": start}, {"to": to}, {"start": start, "to": to})[2 if grip.end is None else grip.end]
        return ChangeWall(step=step, wall=grip.wall, **ends)

    def _is_there(self, grip: Grip) -> bool:
        """Return whether what the mouse holds is still there: a key can undo what added it."""
        scene = self._playback.scene
        return (grip.ball or 0) < len(scene.bodies) and (grip.wall is None or grip.wall < len(scene.walls))

    # Drawing

    def draw(self, surface: Surface, layout: Layout, hovered: Grip | None) -> None:
        """Mark the selected wall and what is hovered, and show in every pane what the drag would do."""
        scene = self._playback.scene
        over = len(ARENA_WALLS) + hovered.wall if hovered and hovered.wall is not None else None
        marked = [wall for wall in dict.fromkeys((self._editor.selected_wall, over)) if wall is not None]
        for pane, arena in enumerate(layout.arenas):
            inside = surface.subsurface(arena)
            for wall in marked:
                _mark(inside, layout, scene.wall_line(wall), has_handles=wall >= len(ARENA_WALLS))
            if hovered and hovered.ball is not None and self.grip is None:
                position = self._playback.view.panes[pane].state.position[hovered.ball]
                _ring(inside, layout, position.tolist(), float(scene.bodies.radius[hovered.ball]), theme.accent)
        edit = self.edit
        if edit is not None:
            self._draw_edit(surface, layout, edit)

    def _draw_edit(self, surface: Surface, layout: Layout, edit: Edit) -> None:
        """Draw what an edit leads to in every pane; in the colour of contacts, with the reason, if it is refused."""
        scene, why = self._playback.scene, ""
        try:
            edited(scene, edit, self._playback.view.moment.states)
        except SandboxError as error:
            why = str(error)
        colours = palette(scene.arena.background)
        colour = colours.contact if why else colours.ink
        for arena in layout.arenas:
            inside = surface.subsurface(arena)
            match edit:
                case ChangeBall(ball=ball, x=float(x), y=float(y)):
                    _ring(inside, layout, (x, y), float(scene.bodies.radius[ball]), colour)
                case AddWall(start=start, to=to, thickness=thickness):
                    draw_wall(inside, colour, (start, to), thickness, layout.scale, layout.origin)
                case ChangeWall(wall=number):
                    wall = scene.walls[number]
                    ends = edit.start or wall.start, edit.to or wall.to
                    draw_wall(inside, colour, ends, wall.thickness, layout.scale, layout.origin)
        if why and self._at:
            x, y = layout.to_screen(self._pane, self._at)
            label(surface, why, (x, y - 2 * layout.text_height), layout.text_height, surface.get_rect(), colours)


def _shifted(point: Vector, start: Vector, end: Vector) -> Vector:
    return point[0] + end[0] - start[0], point[1] + end[1] - start[1]


def _distance(line: Line, position: Vector) -> float:
    """Return how far a position is from a wall's face, px, negative inside the wall."""
    start, to, thickness = line
    return float(segment_distance(np.array(position), start, to)) - thickness / 2


def _end_at(wall: Wall, position: Vector, reach: float) -> int | None:
    """Return which end of a wall is at a position; None if neither is within reach (px) of it, and of a peg."""
    if wall.is_peg:
        return None
    away = [float(length(np.subtract(position, end))) - wall.thickness / 2 for end in (wall.start, wall.to)]
    nearest = int(np.argmin(away))
    return nearest if away[nearest] <= min(reach, float(length(np.subtract(wall.start, wall.to))) / 3) else None


def _mark(surface: Surface, layout: Layout, line: Line, *, has_handles: bool) -> None:
    """Draw a line along a wall, and a ring at each of its ends, which can be dragged if it has handles."""
    start, to, thickness = line
    thinnest = 0 if has_handles else layout.text_height / 2 / layout.scale  # of which half is in the pane
    draw_wall(surface, theme.accent, (start, to), max(thickness / 3, thinnest), layout.scale, layout.origin)
    for end in (start, to) if has_handles else ():
        _ring(surface, layout, end, HANDLE * layout.text_height / layout.scale, theme.accent)


def _ring(surface: Surface, layout: Layout, centre: Vector, radius: float, colour: Color) -> None:
    """Draw a ring round a point. centre, radius: px of the scene."""
    width = max(2, round(layout.text_height / 7))
    point = centre[0] * layout.scale + layout.origin[0], centre[1] * layout.scale + layout.origin[1]
    pygame.draw.circle(surface, colour, point, radius * layout.scale + width, width)
