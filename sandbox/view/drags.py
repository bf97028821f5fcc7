"""What the mouse holds from a press to its release: a ball, the tip of a velocity, a wall, the view, the time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from pygame import Color, Surface

from sandbox.errors import SandboxError
from sandbox.quantity import length
from sandbox.run.edits import AddWall, ChangeBall, ChangeWall, Edit, edited
from sandbox.run.inputs import Grab, Move, Release
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene, Wall
from sandbox.scene.units import Dimension
from sandbox.scene.walls import segment_distance
from sandbox.state import Floats, State
from sandbox.view.editor import Editor
from sandbox.view.layout import Layout, ScreenPoint
from sandbox.view.overlay import ARROW_SECONDS
from sandbox.view.playback import Playback
from sandbox.view.primitives import arrow, circle, draw_wall, label
from sandbox.view.theme import palette, theme

CLICK_DISTANCE: Final = 4  # px of the screen that the mouse may move in a click
WALL_THICKNESS: Final = 4.0  # px of the scene, of new walls
HANDLE: Final = 0.45  # radius of the rings at a wall's ends, in heights of the text
SHARES: Final = (1.0, 0.5, 0.25, 0.125, 0.0625)  # of a pushed wall's way in a step, tried where balls are in its way


@dataclass(frozen=True)
class Bench:
    """What the mouse works on."""

    playback: Playback
    editor: Editor
    layout: Callable[[], Layout]

    @property
    def scene(self) -> Scene:
        """The scene at the step shown."""
        return self.playback.scene


@dataclass(frozen=True)
class Spot:
    """A point of the screen in a pane, and of the scene, px. reach: how near the mouse must be to what it grabs, px."""

    point: ScreenPoint
    pane: int
    position: Vector
    reach: float


class Drag:
    """Something that the mouse holds. point: of the screen, where it was pressed."""

    def __init__(self, bench: Bench, point: ScreenPoint) -> None:
        self.bench, self.pressed = bench, point

    def move(self, point: ScreenPoint) -> None:
        """Handle a move of the mouse to a point of the screen."""

    def end(self) -> None:
        """Handle the release of the button."""

    def cancel(self) -> None:
        """Handle the loss of the window's focus."""

    def step(self) -> None:
        """Do what is to be done before the next step, while time passes."""

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Show in every pane what a release would do."""


class Slide(Drag):
    """Calls a function with each point that the mouse is moved to, and with that of the press."""

    def __init__(self, bench: Bench, point: ScreenPoint, go_to: Callable[[ScreenPoint], None]) -> None:
        super().__init__(bench, point)
        self._go_to = go_to
        go_to(point)

    def move(self, point: ScreenPoint) -> None:
        """Call it."""
        self._go_to(point)


class Pull(Drag):
    """Pulls a ball in every engine while time passes."""

    def __init__(self, bench: Bench, spot: Spot, ball: int) -> None:
        super().__init__(bench, spot.point)
        self._pane = spot.pane
        bench.playback.give(Grab(step=bench.playback.session.step, ball=ball, at=spot.position))
        bench.editor.select(ball, spot.pane)

    def move(self, point: ScreenPoint) -> None:
        """Pull towards a point of the screen."""
        playback = self.bench.playback
        if playback.session.held is not None:
            at = self.bench.scene.arena.nearest_inside(self.bench.layout().to_scene(self._pane, point))
            playback.give(Move(step=playback.session.step, at=at))

    def end(self) -> None:
        """Let go."""
        if self.bench.playback.session.held is not None:
            self.bench.playback.give(Release(step=self.bench.playback.session.step))

    cancel = end


class Aim(Drag):
    """Sets the velocity of the selected ball of a paused run, in every engine.

    velocity: that the drag gives to it, px/s; None until the mouse has moved.
    """

    velocity: Vector | None = None

    def __init__(self, bench: Bench, spot: Spot, ball: int) -> None:
        super().__init__(bench, spot.point)
        self._pane = spot.pane
        bench.editor.select(ball, spot.pane)

    def move(self, point: ScreenPoint) -> None:
        """Drag the tip of the velocity to a point of the screen."""
        ball, bench = self.bench.editor.selected, self.bench
        if ball is not None and (self.velocity or math.dist(point, self.pressed) > CLICK_DISTANCE):
            position = bench.playback.view.panes[self._pane].state.position[ball]
            vx, vy = ((bench.layout().to_scene(self._pane, point) - position) / ARROW_SECONDS).tolist()
            self.velocity = vx, vy

    def end(self) -> None:
        """Set the velocity."""
        self.bench.playback.settle()
        if self.velocity and self.bench.editor.selected is not None:
            self.bench.editor.set_velocity(self.bench.editor.selected, self.velocity)


class Shift(Drag):
    """Moves a ball, a wall or an end of it to the same place in every engine, or draws a wall, at its release.

    ball, wall: which one; none of both is a new wall. ends: which of the wall's are moved.
    """

    def __init__(
        self, bench: Bench, spot: Spot, *, ball: int | None = None, wall: int | None = None,
        ends: Sequence[str] = ("start", "to"),
    ) -> None:  # fmt: skip
        super().__init__(bench, spot.point)
        self._pane, self._ball, self._wall, self._ends = spot.pane, ball, wall, ends
        is_new = ball is None and wall is None
        self._from = bench.scene.arena.nearest_inside(spot.position) if is_new else spot.position
        self._at: Vector | None = None  # px of the scene, where the mouse has dragged it
        if wall is not None:
            bench.editor.select_wall(wall)
        else:
            bench.editor.select(ball, spot.pane)

    def move(self, point: ScreenPoint) -> None:
        """Drag it to a point of the screen."""
        if self._at or math.dist(point, self.pressed) > CLICK_DISTANCE:
            self._at = self.bench.scene.arena.nearest_inside(self.bench.layout().to_scene(self._pane, point))

    def end(self) -> None:
        """Do what the drag shows, in every engine."""
        self.bench.playback.settle()
        edit, walls = self.edit, len(self.bench.scene.walls)
        if edit is not None:
            self.bench.editor.give(edit)
        if len(self.bench.scene.walls) > walls:
            self.bench.editor.select_wall(walls)

    @property
    def is_there(self) -> bool:
        """Whether what the mouse holds is still there: a key can undo what added it."""
        scene, ball, wall = self.bench.scene, self._ball, self._wall
        return (ball is None or ball < len(scene.bodies)) and (wall is None or wall < len(scene.walls))

    @property
    def edit(self) -> Edit | None:
        """What a release of the mouse would do."""
        scene, at, step = self.bench.scene, self._at, self.bench.playback.session.step
        if at is None or not self.is_there:
            return None
        if self._ball is not None:
            state = self.bench.playback.view.panes[self._pane].state
            x, y = _shifted(state.position[self._ball].tolist(), self._from, at)
            if scene.arena.walls:
                x, y = scene.arena.nearest_inside((x, y), float(scene.bodies.radius[self._ball]))
            return ChangeBall(step=step, ball=self._ball, x=x, y=y)
        if self._wall is None:
            return AddWall(step=step, start=self._from, to=at, thickness=WALL_THICKNESS)
        wall = scene.walls[self._wall]
        return ChangeWall(
            step=step, wall=self._wall, **{end: _shifted(getattr(wall, end), self._from, at) for end in self._ends}
        )

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw what a release leads to in every pane; in the colour of contacts, with the reason, if it is refused."""
        edit, scene, why = self.edit, self.bench.scene, ""
        if edit is None or self._at is None:
            return
        try:
            edited(scene, edit, self.bench.playback.view.moment.states)
        except SandboxError as error:
            why = str(error)
        colours = palette(scene.arena.background)
        colour = colours.contact if why else colours.ink
        for arena in layout.arenas:
            inside = surface.subsurface(arena)
            match edit:
                case ChangeBall(ball=ball, x=float(x), y=float(y)):
                    ring(inside, layout, (x, y), float(scene.bodies.radius[ball]), colour)
                case AddWall(start=start, to=to, thickness=thickness):
                    draw_wall(inside, colour, (start, to), thickness, layout.scale, layout.origin)
                case ChangeWall(wall=number):
                    wall = scene.walls[number]
                    ends = edit.start or wall.start, edit.to or wall.to
                    draw_wall(inside, colour, ends, wall.thickness, layout.scale, layout.origin)
        if why:
            x, y = layout.to_screen(self._pane, self._at)
            label(surface, why, (x, y - 2 * layout.text_height), layout.text_height, surface.get_rect(), colours)


class Push(Shift):
    """Pushes a wall: while time passes, it follows the mouse between the steps; in a pause, it is moved."""

    _latest: ChangeWall | None = None

    def end(self) -> None:
        """Move the wall, if the run is paused."""
        if self.bench.playback.paused:
            super().end()

    def step(self) -> None:
        """Let the wall go towards the mouse before the next step, as far as no ball is in its way.

        In a step it goes at most the smallest radius, so that no ball is passed.
        """
        session, start, at = self.bench.playback.session, self._from, self._at
        is_done = self._latest is not None and self._latest.step == session.step
        if at is None or is_done or session.steps_behind or not self.is_there or at == start:
            return
        longest = min(1.0, float(self.bench.scene.bodies.radius.min()) / math.dist(start, at))
        for share in SHARES:
            there = start[0] + share * longest * (at[0] - start[0]), start[1] + share * longest * (at[1] - start[1])
            if self._push_to(there):
                self._from = there
                return

    def _push_to(self, there: Vector) -> bool:
        """Move the wall with the mouse, as a part of the drag. Return whether there was room for it in every engine."""
        playback, wall = self.bench.playback, self.bench.scene.walls[self._wall or 0]
        session = playback.session
        start, to = (_shifted(end, self._from, there) for end in (wall.start, wall.to))
        continued = True if self._latest is not None and session.given()[-1:] == [self._latest] else None
        edit = ChangeWall(step=session.step, wall=self._wall, start=start, to=to, continued=continued)
        try:
            edited(self.bench.scene, edit, playback.view.moment.states)
        except SandboxError:
            return False
        playback.give(edit)
        self._latest = edit
        return True


def _shifted(point: Vector, start: Vector, end: Vector) -> Vector:
    return point[0] + end[0] - start[0], point[1] + end[1] - start[1]


# What is where


def ball_at(state: State, radius: Floats, position: Vector) -> tuple[int, float]:
    """Find the ball whose edge is nearest to a position, and how far that is: px, negative inside the ball."""
    distance = length(state.position - position) - radius
    ball = int(distance.argmin())
    return ball, float(distance[ball])


def wall_at(scene: Scene, spot: Spot) -> int | None:
    """Return the number of the scene's wall at a spot, or None."""
    here = np.array(spot.position)
    away = [float(segment_distance(here, wall.start, wall.to)) - wall.thickness / 2 for wall in scene.walls]
    return min((k for k, distance in enumerate(away) if distance <= spot.reach), key=away.__getitem__, default=None)


def ends_at(wall: Wall, spot: Spot) -> Sequence[str]:
    """Return which ends of a wall a drag from a spot moves: the one that is there, or both, as always of a peg."""
    ends = {"start": wall.start, "to": wall.to}
    away = {name: float(length(np.subtract(spot.position, end))) - wall.thickness / 2 for name, end in ends.items()}
    nearest = min(away, key=away.__getitem__)
    reach = min(2 * spot.reach, float(length(np.subtract(wall.start, wall.to))) / 3)
    return [nearest] if not wall.is_peg and away[nearest] <= reach else [*ends]


# Drawing


def mark_wall(surface: Surface, layout: Layout, wall: Wall) -> None:
    """Draw a line along a wall in every pane, and a ring at each of its ends, which can be dragged."""
    for inside in map(surface.subsurface, layout.arenas):
        ends = wall.start, wall.to
        draw_wall(inside, theme.accent, ends, wall.thickness / 3, layout.scale, layout.origin)
        for end in ends:
            ring(inside, layout, end, HANDLE * layout.text_height / layout.scale, theme.accent)


def ring(surface: Surface, layout: Layout, centre: Vector, radius: float, colour: Color) -> None:
    """Draw a ring round a disc of the scene in a pane, a little apart from it. centre, radius: px of the scene."""
    width = max(2, round(layout.text_height / 7))
    point = centre[0] * layout.scale + layout.origin[0], centre[1] * layout.scale + layout.origin[1]
    circle(surface, colour, point, radius * layout.scale + 2 * width, width)


def draw_velocity(surface: Surface, bench: Bench, ball: int, velocity: Vector | None) -> None:
    """Draw the velocity of a ball from each of its copies, over the edges of the panes; by default, its own (px/s)."""
    layout, view, height = bench.layout(), bench.playback.view, bench.layout().text_height
    colours, units = palette(bench.scene.arena.background), bench.scene.units
    width, template = max(2, round(height / 7)), f"{{:.{units.decimals(Dimension.VELOCITY, 0)}f}}"
    for index, (pane, arena) in enumerate(zip(view.panes, layout.arenas, strict=True)):
        x, y = layout.to_screen(index, pane.state.position[ball].tolist())
        vx, vy = velocity or pane.state.velocity[ball].tolist()
        if not arena.collidepoint(x, y) or vx == vy == 0:
            continue
        tip = x + vx * ARROW_SECONDS * layout.scale, y + vy * ARROW_SECONDS * layout.scale
        if velocity is None and math.dist(tip, (x, y)) < pane.scene.bodies.radius[ball] * layout.scale:
            continue  # it would hide the ball's number
        arrow(surface, colours.ground, (x, y), tip, 2 * width)  # or the frame would hide it
        arrow(surface, colours.ink, (x, y), tip, width)
        if velocity:
            speed = units.text(Dimension.VELOCITY, template, math.hypot(vx, vy))
            text = f"{speed}, {math.degrees(math.atan2(-vy, vx)):.0f}\N{DEGREE SIGN}"  # counted upwards
            beyond = tip[0], tip[1] + math.copysign(1.2 * height, vy)
            label(surface, text, beyond, height, arena, colours)
