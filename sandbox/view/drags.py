"""What the mouse holds from a press to its release: a ball, the tip of a velocity, a wall, the view, the time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from pygame import Color, Surface

from sandbox.quantity import length
from sandbox.run.edits import AddWall, ChangeBall, ChangeWall, Edit
from sandbox.run.inputs import Grab, Move
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene, Wall
from sandbox.scene.units import Dimension
from sandbox.scene.walls import segment_distance
from sandbox.view.editor import Editor
from sandbox.view.layout import Layout, ScreenPoint
from sandbox.view.overlay import ARROW_SECONDS
from sandbox.view.playback import Playback
from sandbox.view.primitives import arrow, circle, draw_wall, label
from sandbox.view.theme import palette, theme

CLICK_DISTANCE: Final = 4  # px of the screen that the mouse may move in a click
WALL_THICKNESS: Final = 4.0  # px of the scene, of new walls


@dataclass(frozen=True)
class Spot:
    """A point of the screen in a pane, and of the scene, px. reach: how near the mouse must be to what it grabs, px."""

    point: ScreenPoint
    pane: int
    position: Vector
    reach: float


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

    def at(self, spot: Spot) -> tuple[int | None, int | None]:
        """Return the ball or else the wall of the scene within reach of a spot; a ball comes first if it is there."""
        here, scene = np.array(spot.position), self.scene
        to_balls = length(self.playback.view.panes[spot.pane].state.position - here) - scene.bodies.radius
        to_walls = [float(segment_distance(here, wall.start, wall.to)) - wall.thickness / 2 for wall in scene.walls]
        ball, wall = int(to_balls.argmin()), int(np.argmin([*to_walls, math.inf]))
        if to_balls[ball] > 0 and [*to_walls, math.inf][wall] <= spot.reach:
            return None, wall
        return (ball if to_balls[ball] <= spot.reach else None), None


class Drag:
    """What the mouse does with what is selected, from the press at a spot to the release."""

    def __init__(self, bench: Bench, spot: Spot) -> None:
        self.bench, self.spot = bench, spot

    @property
    def step(self) -> int:
        """The current step, to which inputs belong."""
        return self.bench.playback.session.step

    def target(self, point: ScreenPoint) -> Vector:
        """Return where a point of the screen is in the scene of the pane that was pressed, inside the arena."""
        return self.bench.scene.arena.nearest_inside(self.bench.layout().to_scene(self.spot.pane, point))

    def is_moved(self, point: ScreenPoint) -> bool:
        """Return whether the mouse has gone further than in a click."""
        return math.dist(point, self.spot.point) > CLICK_DISTANCE

    def move(self, point: ScreenPoint) -> None:
        """Handle a move of the mouse to a point of the screen."""

    def end(self) -> None:
        """Handle the release of the button."""

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Show in every pane what a release would do."""


class Slide(Drag):
    """Calls a function with each point that the mouse is moved to, and with that of the press."""

    def __init__(self, go_to: Callable[[ScreenPoint], None], point: ScreenPoint) -> None:
        self._go_to = go_to
        go_to(point)

    def move(self, point: ScreenPoint) -> None:
        """Call it."""
        self._go_to(point)


class Pull(Drag):
    """Pulls the selected ball in every engine while time passes, until `MouseTool` lets go of it."""

    def __init__(self, bench: Bench, spot: Spot) -> None:
        super().__init__(bench, spot)
        bench.playback.give(Grab(step=self.step, ball=bench.editor.selected, at=spot.position))

    def move(self, point: ScreenPoint) -> None:
        """Pull towards a point of the screen."""
        if self.bench.playback.session.held is not None:
            self.bench.playback.give(Move(step=self.step, at=self.target(point)))


class Aim(Drag):
    """Sets the velocity of the selected ball of a paused run, in every engine.

    velocity: that the drag gives to it, px/s; None until the mouse has moved.
    """

    velocity: Vector | None = None

    def move(self, point: ScreenPoint) -> None:
        """Drag the tip of the velocity to a point of the screen."""
        ball, bench = self.bench.editor.selected, self.bench
        if ball is not None and (self.velocity or self.is_moved(point)):
            position = bench.playback.view.panes[self.spot.pane].state.position[ball]
            vx, vy = ((bench.layout().to_scene(self.spot.pane, point) - position) / ARROW_SECONDS).tolist()
            self.velocity = vx, vy

    def end(self) -> None:
        """Set the velocity."""
        self.bench.playback.settle()
        if self.velocity and self.bench.editor.selected is not None:
            self.bench.editor.set_velocity(self.bench.editor.selected, self.velocity)


class Shift(Drag):
    """Moves the selected ball or wall to the same place in every engine, at its release."""

    at: Vector | None = None  # px of the scene, where the mouse has dragged it

    def move(self, point: ScreenPoint) -> None:
        """Drag it to a point of the screen."""
        if self.at or self.is_moved(point):
            self.at = self.target(point)

    def end(self) -> None:
        """Do what the drag shows, in every engine."""
        self.bench.playback.settle()
        if self.at and (edit := self.edit(self.at)):
            self.bench.editor.give(edit)

    def edit(self, at: Vector) -> Edit | None:
        """Return what a release at a place would do; nothing if what was held is gone, as a key can undo it."""
        scene, editor = self.bench.scene, self.bench.editor
        if (ball := editor.selected) is not None:
            x, y = self._shifted(self.bench.playback.view.panes[self.spot.pane].state.position[ball].tolist(), at)
            if scene.arena.walls:
                x, y = scene.arena.nearest_inside((x, y), float(scene.bodies.radius[ball]))
            return ChangeBall(step=self.step, ball=ball, x=x, y=y)
        if (number := editor.selected_wall) is not None:
            wall = scene.walls[number]
            start, to = self._shifted(wall.start, at), self._shifted(wall.to, at)
            return ChangeWall(step=self.step, wall=number, start=start, to=to)
        return None

    def _shifted(self, point: Sequence[float], at: Vector) -> Vector:
        return point[0] + at[0] - self.spot.position[0], point[1] + at[1] - self.spot.position[1]

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw what a release leads to in every pane."""
        edit, scene = self.at and self.edit(self.at), self.bench.scene
        colour = palette(scene.arena.background).ink
        for inside in map(surface.subsurface, layout.arenas):
            match edit:
                case ChangeBall(ball=ball, x=float(x), y=float(y)):
                    ring(inside, layout, (x, y), float(scene.bodies.radius[ball]), colour)
                case AddWall(start=start, to=to, thickness=thickness):
                    draw_wall(inside, colour, (start, to), thickness, layout.scale, layout.origin)
                case ChangeWall(wall=wall, start=tuple(start), to=tuple(to)):
                    draw_wall(inside, colour, (start, to), scene.walls[wall].thickness, layout.scale, layout.origin)


class NewWall(Shift):
    """Draws a wall from a spot inside the arena to where the mouse is."""

    def edit(self, at: Vector) -> Edit | None:
        """Return the edit that adds it."""
        start = self.bench.scene.arena.nearest_inside(self.spot.position)
        return AddWall(step=self.step, start=start, to=at, thickness=WALL_THICKNESS)

    def end(self) -> None:
        """Add the wall, and select it if there was room."""
        walls = len(self.bench.scene.walls)
        super().end()
        if len(self.bench.scene.walls) > walls:
            self.bench.editor.select(wall=walls)


# Drawing


def mark_wall(surface: Surface, layout: Layout, wall: Wall) -> None:
    """Draw a line along a wall in every pane."""
    for inside in map(surface.subsurface, layout.arenas):
        draw_wall(inside, theme.accent, (wall.start, wall.to), wall.thickness / 3, layout.scale, layout.origin)


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
