"""Balls as smooth discs, drawn by a kernel, each with a line that shows its angle."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import pygame
from pygame import Surface

from sandbox.scene.fields import Vector, rgb
from sandbox.state import Floats
from sandbox.view.pixels import MIN_TURNED, has_kernels, pixel_of, pixels_of, place_of, stamp_discs
from sandbox.view.primitives import MAX_PYGAME_SHAPE, capsule

MIN_RADIUS: Final = 1.0  # px; smaller discs are drawn with it, or they would hardly be seen
LINE: Final = (44, 62, 80)  # the colour of the lines, as in Pymunk's debug-draw


class Discs:
    """The discs of some balls on the screen, in their order. radius: (n,) px of the scene."""

    def __init__(self, radius: Floats, colours: Sequence[str]) -> None:
        self._radius = radius
        self._colours = colours
        self._format: tuple[int, ...] = ()  # of the surface that the values are for
        self._values = np.empty(0, np.int64)  # of pixels in each ball's colour

    def __len__(self) -> int:
        return len(self._radius)

    def draw(
        self, surface: Surface, position: Floats, scale: float, angle: Floats, origin: Vector = (0.0, 0.0)
    ) -> None:
        """Draw the discs.

        position: (n, 2) px of the scene; scale: px of the surface for one of these; angle: (n,); origin: where the
        scene's is, px of the surface.
        """
        self.draw_at(surface, scale * position + origin, scale, angle)

    def draw_at(self, surface: Surface, centre: Floats, scale: float, angle: Floats) -> None:
        """Draw the discs with their centres at some places of the surface: (n, 2) px."""
        radius = np.maximum(scale * self._radius, MIN_RADIUS)
        if not has_kernels(surface):
            self._draw_plainly(surface, centre, radius, angle)
            return
        if surface.get_shifts() != self._format:
            self._format = surface.get_shifts()
            values = {colour: pixel_of(surface, rgb(colour)) for colour in set(self._colours)}
            self._values = np.array([values[colour] for colour in self._colours])
        line = pixel_of(surface, LINE)
        stamp_discs(*pixels_of(surface), place_of(surface), centre, radius, self._values, angle, line)

    def _draw_plainly(self, surface: Surface, centre: Floats, radius: Floats, angle: Floats) -> None:
        """Draw the discs where kernels cannot, or are not compiled yet: slowly, and with ragged edges."""
        middle = np.divide(surface.get_size(), 2)
        seen = (np.abs(centre - middle) < middle + radius[:, None]).all(axis=1)
        for k in np.flatnonzero(seen).tolist():
            (x, y), r = centre[k].tolist(), float(radius[k])
            capsule(surface, rgb(self._colours[k]), (x, y), (x, y), r)
            if MIN_TURNED < r - 1 < MAX_PYGAME_SHAPE:
                rim = int(x + (r - 1) * math.cos(angle[k])), int(y + (r - 1) * math.sin(angle[k]))
                pygame.draw.line(surface, LINE, (int(x), int(y)), rim, 2 if r - 1 > 20 else 1)
