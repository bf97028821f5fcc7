"""A live `pymunk.Space`, drawn by pymunk's own `pygame_util` debug-draw."""

from typing import Final

import numpy as np
import pymunk
from pygame import Color, Surface
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies
from pymunk.pygame_util import DrawOptions

from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import State
from sandbox.view.discs import Discs
from sandbox.view.primitives import draw_wall, thin_lines

POINT_LENGTH: Final = 2.0  # px of the space, by which pymunk lengthens the line between a contact's two points

_POINT_FIELDS: Final = (
    ArbiterFields.CONTACT_COUNT | ArbiterFields.NORMAL | ArbiterFields.POINT_A_1 | ArbiterFields.POINT_B_1
)


class DebugDraw(DrawOptions):
    """Pymunk's drawing of a space, except for its shapes and collision points.

    Pymunk calls Python for each of these, which takes half a frame for a thousand discs. Here all bodies and all
    contacts are read at once; they look as pymunk draws them. Walls have their thickness at any slope; the arena's,
    which are very large, are left out. ink: of walls, the same as in other panes.
    """

    def __init__(self, space: pymunk.Space, ink: Color) -> None:
        super().__init__(Surface((1, 1)))
        self.flags = DrawOptions.DRAW_CONSTRAINTS
        self._ink = ink
        self._space = space
        self._walls = [(s.a, s.b, 2 * s.radius) for s in space.shapes if isinstance(s, pymunk.Segment)]
        self._buffer = Buffer()

    def draw(
        self,
        surface: Surface,
        scale: float,
        discs: Discs,
        past: tuple[Scene, State] | None = None,
        origin: Vector = (0.0, 0.0),
    ) -> None:
        """Draw the space on a surface. scale: px of the surface for one px of the space; origin: where its own is.

        past: the scene and where its balls are, which are drawn without contacts; by default those that are there now.
        """
        self.surface = surface
        self.transform = pymunk.Transform(a=scale, d=scale, tx=origin[0], ty=origin[1])
        walls = [(wall.start, wall.to, wall.thickness) for wall in past[0].walls] if past else self._walls
        for start, to, thickness in walls:
            draw_wall(surface, self._ink, (start, to), thickness, scale, origin)
        if past is not None:
            discs.draw(surface, past[1].position, scale, past[1].angle, origin)
            return
        self._draw_discs(scale, discs, origin)
        self._space.debug_draw(self)
        self._draw_collision_points(scale, origin)

    def _draw_discs(self, scale: float, discs: Discs, origin: Vector) -> None:
        self._buffer.clear()
        get_space_bodies(self._space, BodyFields.POSITION | BodyFields.ANGLE, self._buffer)
        rows = np.frombuffer(self._buffer.float_buf()).reshape(-1, 3)[: len(discs)]
        discs.draw(self.surface, rows[:, :2], scale, rows[:, 2].copy(), origin)

    def _draw_collision_points(self, scale: float, origin: Vector) -> None:
        """Draw each contact as a line through its two points, which a listed contact that has ended does not have.

        The shapes are discs and segments, so a contact has one point on each body.
        """
        self._buffer.clear()
        get_space_arbiters(self._space, _POINT_FIELDS, self._buffer)
        found = np.frombuffer(self._buffer.int_buf(), np.uintp) > 0
        normal, on_a, on_b = np.frombuffer(self._buffer.float_buf()).reshape(-1, 3, 2)[found].swapaxes(0, 1)
        ends = scale * np.hstack([on_a - POINT_LENGTH * normal, on_b + POINT_LENGTH * normal]) + 2 * origin
        thin_lines(self.surface, self.collision_point_color.as_int(), np.rint(ends))
