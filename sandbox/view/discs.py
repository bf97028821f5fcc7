"""Balls as smooth discs: cached pictures of few balls, and a kernel that draws many into a surface's pixels."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import pygame
from pygame import Surface

from sandbox.scene.fields import Vector, rgb
from sandbox.state import Floats
from sandbox.view.pixels import MIN_TURNED, NODES, WEIGHTS, pixel_of, pixels_of, place_of, stamp_discs, suits_kernels
from sandbox.view.primitives import capsule

MIN_RADIUS: Final = 1.0  # px; smaller discs are drawn with it, or they would hardly be seen
MAX_BLIT_OFFSET: Final = 10**6  # px; pictures further away are moved here, where they are as invisible
MAX_PICTURE_RADIUS: Final = 500.0  # px; a larger disc is drawn at each frame, as its picture would need much memory
TURNS: Final = 64  # directions that a line in a picture can have, so at most 3 degrees off


LINE: Final = (44, 62, 80)  # the colour of the line that shows a ball's angle, as in Pymunk's debug-draw


class Discs:
    """The discs of some balls on the screen, in their order. radius: (n,) px of the scene.

    line: the colour of a line from each centre that shows the ball's angle, None for no line.
    """

    def __init__(self, radius: Floats, colours: Sequence[str], line: tuple[int, int, int] | None = None) -> None:
        self._radius = radius
        self._colours = colours
        self._line = line
        self._angle = np.zeros(len(radius))  # for discs without lines
        self._format: tuple[int, ...] = ()  # of the surface that the values are for
        self._values = np.empty(0, np.int64)  # of pixels in each ball's colour

    def __len__(self) -> int:
        return len(self._radius)

    def draw(
        self,
        surface: Surface,
        position: Floats,
        scale: float,
        angle: Floats | None = None,
        origin: Vector = (0.0, 0.0),
    ) -> None:
        """Draw the discs.

        position: (n, 2) px of the scene; scale: px of the surface for one of these; angle: (n,); origin: where the
        scene's is, px of the surface.
        """
        centre, radius = scale * position + origin, np.maximum(scale * self._radius, MIN_RADIUS)
        if suits_kernels(surface, len(radius)):
            self._stamp(surface, centre, radius, angle)
        else:
            self._blit(surface, centre, radius, angle)

    def _blit(self, surface: Surface, centre: Floats, radius: Floats, angle: Floats | None) -> None:
        large = radius > MAX_PICTURE_RADIUS
        if large.any():
            for k in np.flatnonzero(large).tolist():
                capsule(surface, rgb(self._colours[k]), centre[k], centre[k], float(radius[k]))
            centre, radius = centre[~large], radius[~large]
            angle = None if angle is None else angle[~large]
            colours: Sequence[str] = [c for c, left_out in zip(self._colours, large, strict=True) if not left_out]
        else:
            colours = self._colours
        if self._line is None or angle is None:
            pictures = list(map(disc, radius.tolist(), colours))
        else:
            turns = np.rint(angle / math.tau * TURNS).astype(int) % TURNS
            lines = [self._line] * len(radius)
            pictures = list(map(turned_disc, radius.tolist(), colours, turns.tolist(), lines))
        half = np.rint(radius) + 1
        corners = np.clip(np.rint(centre) - half[:, None], -MAX_BLIT_OFFSET, MAX_BLIT_OFFSET).astype(int)
        surface.blits(list(zip(pictures, corners.tolist(), strict=True)), doreturn=False)

    def _stamp(self, surface: Surface, centre: Floats, radius: Floats, angle: Floats | None) -> None:
        if surface.get_shifts() != self._format:
            self._format = surface.get_shifts()
            values = {colour: pixel_of(surface, rgb(colour)) for colour in set(self._colours)}
            self._values = np.array([values[colour] for colour in self._colours])
        line = -1 if self._line is None or angle is None else pixel_of(surface, self._line)
        angle = self._angle if angle is None else angle
        stamp_discs(*pixels_of(surface), place_of(surface), centre, radius, self._values, angle, line)


@lru_cache(maxsize=1024)
def disc(radius: float, colour: str) -> Surface:
    """Draw a smooth disc on a clear surface of its size. radius: px of the screen, at least MIN_RADIUS."""
    side = 2 * (round(radius) + 1)
    picture = Surface((side, side), pygame.SRCALPHA)
    picture.fill((*rgb(colour), 0))
    pygame.surfarray.pixels_alpha(picture)[:] = np.rint(255 * _coverage(radius, side))
    return picture


def _coverage(radius: float, side: int) -> Floats:
    """Return the share of each pixel that a disc in the middle of a square covers, as the kernel computes it."""
    low = np.arange(side) - side / 2
    top, height = np.maximum(low, -radius), np.minimum(low + 1, radius) - np.maximum(low, -radius)
    left, covered = low[:, None], np.zeros((side, side))
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        off = top + node * height
        chord = np.sqrt(np.maximum((radius - off) * (radius + off), 0.0))
        overlap = np.minimum(chord, left + 1) - np.maximum(-chord, left)
        covered += weight * np.maximum(height, 0.0) * np.maximum(overlap, 0.0)
    return covered


@lru_cache(maxsize=4096)
def turned_disc(radius: float, colour: str, turn: int, line: tuple[int, int, int]) -> Surface:
    """Draw a disc with the line that shows its angle, as pymunk does. turn: one of TURNS."""
    picture = disc(radius, colour).copy()
    if radius - 1 <= MIN_TURNED:
        return picture
    half, angle = picture.get_width() // 2, turn * math.tau / TURNS
    edge = half + round((radius - 1) * math.cos(angle)), half + round((radius - 1) * math.sin(angle))
    pygame.draw.line(picture, line, (half, half), edge, 2 if radius > 20 else 1)
    return picture


def forget_pictures() -> None:
    """Empty the caches of pictures, because discs of their sizes are not drawn again."""
    disc.cache_clear()
    turned_disc.cache_clear()
