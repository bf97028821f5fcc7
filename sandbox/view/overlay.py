"""A pane's canvas, and the layers over and under its balls: arrows, trails, numbers."""

from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Final

import numpy as np
import pygame
from pygame import Color, Surface

from sandbox.quantity import length
from sandbox.scene.fields import Vector, rgb
from sandbox.scene.model import Scene
from sandbox.state import Floats, State
from sandbox.view.primitives import SMALLEST_TEXT, arrow, circle, lettering
from sandbox.view.theme import Palette, contrast, palette, readable

ARROW_SECONDS: Final = 0.2  # a velocity's arrow ends where the ball would be after so long
MAX_NUMBERED: Final = 30  # balls; the numbers of more would hide them
MAX_OUTLINED: Final = 300  # balls, likewise
MIN_NUMBERED: Final = 6.5  # px, radius of a ball that has room for its number
MIN_CONTRAST: Final = 3.0  # of an outline with its ground
MIN_APART: Final = 1.5  # px of the screen between a ball and its outline; closer ones would only fray it
NO_TRAIL: Final = np.empty((0, 0, 2))


@dataclass(frozen=True)
class Canvas:
    """A surface that shows a scene in some state.

    scale: px of the surface for one px of the scene; text_height: px; origin: where the scene's is on it.
    """

    surface: Surface
    scene: Scene
    state: State
    scale: float
    text_height: int
    origin: Vector = (0.0, 0.0)

    @property
    def palette(self) -> Palette:
        """The colours on the scene's background."""
        return palette(self.scene.arena.background)

    def at(self, position: Floats) -> Floats:
        """Turn positions in the scene, (..., 2) px, into places on the surface."""
        return position * self.scale + self.origin


@dataclass(frozen=True)
class Overlay(Canvas):
    """Draws layers on one pane's arena.

    trail: where the balls were, the oldest first: (positions, n, 2) px. ghosts: the reference's balls.
    """

    trail: Floats = field(default_factory=lambda: NO_TRAIL)
    ghosts: State | None = None

    @property
    def width(self) -> int:
        """The width of lines, px."""
        return max(1, round(self.text_height / 10))

    def _visible(self, colour: str) -> Color:
        """Return a ball's colour, or the nearest that is visible as a thin line."""
        return _line_colour(colour, tuple(self.palette.ground))

    def trails(self) -> None:
        """Draw where the balls were, in their colours, fainter the longer ago."""
        lines = np.rint(self.at(self.trail)).astype(int).swapaxes(0, 1)
        cuts = [round(k * (len(self.trail) - 1) / 4) for k in range(5)]  # into four lines that meet
        for k, (start, end) in enumerate(pairwise(cuts)):
            for line, colour in zip(lines[:, start : end + 1].tolist(), self.scene.colors, strict=True):
                if end > start:
                    faded = self.palette.ground.lerp(self._visible(colour), (k + 1) / 4)
                    pygame.draw.lines(self.surface, faded, False, line, self.width)

    def velocity(self) -> None:
        """Draw an arrow from each ball to where its velocity takes it in ARROW_SECONDS."""
        position = self.state.position
        tips = self.at(position + ARROW_SECONDS * self.state.velocity)
        for tail, tip in zip(self.at(position).tolist(), tips.tolist(), strict=True):
            arrow(self.surface, self.palette.ink, tail, tip, self.width)

    def numbers(self) -> None:
        """Write each ball's number on it, or above it if it is small, unless they would hide the balls."""
        if len(self.scene.bodies) > MAX_NUMBERED:
            return
        centres = self.at(self.state.position).tolist()
        balls = zip(centres, self.scene.bodies.radius, self.scene.colors, strict=True)
        for number, ((x, y), radius, colour) in enumerate(balls):
            px = radius * self.scale
            height = max(SMALLEST_TEXT, min(round(px), self.text_height))
            has_room = px >= MIN_NUMBERED
            text = lettering(str(number), contrast(Color(*rgb(colour))) if has_room else self.palette.ink, height)
            centre = round(x), round(y if has_room else y - px - height / 2)
            if has_room:  # over the line that shows the ball's angle
                pygame.draw.circle(self.surface, rgb(colour), centre, min(0.85 * height, px - 1))
            self.surface.blit(text, text.get_rect(center=centre))

    def outlines(self) -> None:
        """Draw the outlines of the reference's balls, except those that lie on their ball."""
        if self.ghosts is None or len(self.scene.bodies) > MAX_OUTLINED:
            return
        centres, width = self.at(self.ghosts.position), max(2, self.width)
        radius, size = self.scale * self.scene.bodies.radius, np.array(self.surface.get_size())
        apart = length(centres - self.at(self.state.position)) > MIN_APART
        seen = (np.abs(centres - size / 2) < size / 2 + radius[:, None]).all(axis=1)
        for k in np.flatnonzero(apart & seen).tolist():
            visible = self._visible(self.scene.colors[k])
            circle(self.surface, visible, centres[k].tolist(), max(2.0, float(radius[k])), width, dashed=True)

    def pull(self, ball: int, target: Vector) -> None:
        """Draw a ring round a held ball, and the line from it to where it is pulled, px of the scene."""
        start, end = self.at(np.array([self.state.position[ball], target])).round().astype(int).tolist()
        radius = self.scene.bodies.radius[ball] * self.scale
        width = max(2, self.width)
        pygame.draw.circle(self.surface, self.palette.ground, start, radius + 2 * width, width)
        pygame.draw.circle(self.surface, self.palette.ink, start, radius + 3 * width, width)
        pygame.draw.line(self.surface, self.palette.ink, start, end, width)
        pygame.draw.circle(self.surface, self.palette.ink, end, 2 * self.width + 2)


@lru_cache(maxsize=256)
def _line_colour(colour: str, ground: tuple[int, ...]) -> Color:
    """Return a ball's colour, or the nearest that is visible as a thin line on a ground."""
    return readable(Color(*rgb(colour)), Color(*ground), MIN_CONTRAST)
