"""Pymunk's pane: its Space, drawn by `Space.debug_draw` with an options object of `pymunk.pygame_util`."""

import signal
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import pymunk
from pygame import Color, Surface
from pymunk import Shape, Vec2d
from pymunk.batch import BodyFields, Buffer, get_space_bodies
from pymunk.pygame_util import DrawOptions
from pymunk.space_debug_draw_options import SpaceDebugColor

from sandbox.processes import signals_blocked
from sandbox.scene.fields import Vector, rgb
from sandbox.view.primitives import Discs, capsule, draw_wall

MAX_SHAPES: Final = 300  # that `Space.debug_draw` draws; it calls Python for each, which takes 8 ms for so many
Point = tuple[float, float]


class DebugDraw:
    """Draws a Space: by Pymunk's debug-draw up to MAX_SHAPES shapes, above that by a batch that looks the same.

    The shapes' own `color` decides. A ball without one gets that of the scene, and a wall the ink of other panes.
    """

    def __init__(self, space: pymunk.Space, balls: Sequence[str], ink: Color) -> None:
        self._space = space
        circles = [shape for body in list(space.bodies)[: len(balls)] for shape in body.shapes]
        for shape, colour in zip(circles, balls, strict=True):
            if not hasattr(shape, "color"):
                shape.color = (*rgb(colour), 255)
        self._walls = [shape for shape in space.shapes if isinstance(shape, pymunk.Segment) or _is_peg(shape)]
        self._plain_walls = [wall for wall in self._walls if not hasattr(wall, "color")]
        self.recolour(ink)
        radius = np.array([shape.radius for shape in circles])
        self._discs = Discs(radius, ["#{:02x}{:02x}{:02x}".format(*map(round, shape.color[:3])) for shape in circles])
        self._smooth = SmoothDrawOptions({shape: number for number, shape in enumerate(circles)}, self._discs)
        self._buffer = Buffer()

    def recolour(self, ink: Color) -> None:
        """Draw walls that have no colour of their own in another ink."""
        for wall in self._plain_walls:
            wall.color = tuple(ink)

    @property
    def is_batch(self) -> bool:
        """Whether there are too many shapes for Pymunk's debug-draw."""
        return len(self._space.shapes) > MAX_SHAPES

    def draw(self, surface: Surface, scale: float, origin: Vector = (0.0, 0.0)) -> None:
        """Draw the space on a surface. scale: px of the surface for one px of the space; origin: where its own is."""
        if self.is_batch:
            self._draw_batch(surface, scale, origin)
        else:
            self._smooth.surface = surface
            self._smooth.transform = pymunk.Transform(a=scale, d=scale, tx=origin[0], ty=origin[1])
            with signals_blocked(signal.SIGINT, signal.SIGTERM):  # C calls the options
                self._space.debug_draw(self._smooth)
            self._smooth.draw_collected()

    def _draw_batch(self, surface: Surface, scale: float, origin: Vector) -> None:
        for wall in self._walls:
            ends = (wall.a, wall.b) if isinstance(wall, pymunk.Segment) else (wall.offset, wall.offset)
            draw_wall(surface, wall.color, ends, 2 * wall.radius, scale, origin)
        self._buffer.clear()
        get_space_bodies(self._space, BodyFields.POSITION | BodyFields.ANGLE, self._buffer)
        rows = np.frombuffer(self._buffer.float_buf()).reshape(-1, 3)[: len(self._discs)]
        self._discs.draw(surface, scale * rows[:, :2] + origin, scale, rows[:, 2].copy())


def _is_peg(shape: Shape) -> bool:
    """Return whether a shape is a circle that stands still."""
    return isinstance(shape, pymunk.Circle) and shape.body is not None and shape.body.body_type == pymunk.Body.STATIC


class SmoothDrawOptions(DrawOptions):
    """Pymunk's options for pygame, whose discs and segments have smooth edges.

    balls: the number of each circle among the discs. They are collected, and drawn in that order.
    """

    def __init__(self, balls: Mapping[Shape, int], discs: Discs) -> None:
        super().__init__(Surface((1, 1)))
        self.flags = self.DRAW_SHAPES  # no points of contacts, which would hide small balls
        self._balls = balls
        self._discs = discs
        self._shape: Shape | None = None  # of the next circle
        self._collected: dict[int, tuple[float, float, float]] = {}  # centre and angle by the number of the ball

    def color_for_shape(self, shape: Shape) -> SpaceDebugColor:
        """Return a shape's colour, and note which shape it is: Pymunk asks for it before it has the shape drawn."""
        self._shape = shape
        return super().color_for_shape(shape)

    def draw_circle(
        self, pos: Vec2d, angle: float, radius: float, outline_color: SpaceDebugColor, fill_color: SpaceDebugColor
    ) -> None:
        """Collect a ball, or draw a peg as a wall."""
        number = self._balls.get(self._shape) if self._shape else None
        if number is None:
            capsule(self.surface, fill_color.as_int(), pos, pos, radius)
        else:
            self._collected[number] = pos.x, pos.y, angle

    def draw_fat_segment(
        self, a: Point, b: Point, radius: float, outline_color: SpaceDebugColor, fill_color: SpaceDebugColor
    ) -> None:
        """Draw a segment with its thickness at any slope; of the arena's walls, nothing is in the pane."""
        capsule(self.surface, fill_color.as_int(), a, b, radius)

    def draw_collected(self) -> None:
        """Draw the balls collected since the last call."""
        if self._collected:
            at = np.array([self._collected[number] for number in sorted(self._collected)])
            self._collected = {}
            self._discs.draw(self.surface, at[:, :2].copy(), self.transform.a, at[:, 2].copy())
