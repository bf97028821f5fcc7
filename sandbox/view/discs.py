"""Balls as smooth discs: cached pictures of few balls, and a kernel that draws many into a surface's pixels."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import pygame
from numpy.typing import NDArray
from pygame import Surface

from sandbox.engines.compiled import entry, kernel
from sandbox.scene.fields import rgb
from sandbox.state import Floats

MANY: Final = 200  # balls, from which on the kernel takes less time than pictures
MIN_RADIUS: Final = 1.0  # px; smaller discs are drawn with it, or they would hardly be seen
MAX_BLIT_OFFSET: Final = 10**6  # px; pictures further away are moved here, where they are as invisible
DISC_SCALE: Final = 4  # pictures are drawn larger and scaled down, which smooths their edges
TURNS: Final = 64  # directions that a line in a picture can have, so at most 3 degrees off

# Gauss's nodes and weights for integrals from 0 to 1: where a disc's width is measured in each row of pixels.
NODES: Final = (0.1127016653792583, 0.5, 0.8872983346207417)
MIN_RUN: Final = 3.0  # px
WEIGHTS: Final = (5 / 18, 8 / 18, 5 / 18)

Pixels = NDArray[np.uint32]


class Discs:
    """The discs of some balls on the screen, in their order. radius: (n,) px of the scene.

    line: the colour of a line from each centre that shows the ball's angle, as Pymunk's debug-draw has it.
    """

    def __init__(self, radius: Floats, colours: Sequence[str], line: tuple[int, int, int] | None = None) -> None:
        self._radius = radius
        self._colours = colours
        self._line = line
        self._angle = np.zeros(len(radius))  # for discs without lines
        self._format: tuple[int, ...] = ()  # of the surface that the values are for
        self._values = np.empty(0, np.int64)  # of pixels in each ball's colour

    def draw(self, surface: Surface, position: Floats, scale: float, angle: Floats | None = None) -> None:
        """Draw the discs. position: (n, 2) px of the scene; scale: px of the surface for one of these; angle: (n,)."""
        centre, radius = scale * position, np.maximum(scale * self._radius, MIN_RADIUS)
        if len(radius) < MANY or not _has_byte_channels(surface):
            self._blit(surface, centre, radius, angle)
        else:
            self._stamp(surface, centre, radius, angle)

    def _blit(self, surface: Surface, centre: Floats, radius: Floats, angle: Floats | None) -> None:
        if self._line is None or angle is None:
            pictures = list(map(disc, radius.tolist(), self._colours))
        else:
            turns = np.rint(angle / math.tau * TURNS).astype(int) % TURNS
            lines = [self._line] * len(radius)
            pictures = list(map(turned_disc, radius.tolist(), self._colours, turns.tolist(), lines))
        half = np.rint(radius) + 1
        corners = np.clip(np.rint(centre) - half[:, None], -MAX_BLIT_OFFSET, MAX_BLIT_OFFSET).astype(int)
        surface.blits(list(zip(pictures, corners.tolist(), strict=True)), doreturn=False)

    def _stamp(self, surface: Surface, centre: Floats, radius: Floats, angle: Floats | None) -> None:
        if surface.get_shifts() != self._format:
            self._format = surface.get_shifts()
            values = {colour: surface.map_rgb(rgb(colour)) for colour in set(self._colours)}
            self._values = np.array([values[colour] for colour in self._colours])
        line = -1 if self._line is None or angle is None else surface.map_rgb(self._line)
        whole, (left, top) = surface.get_abs_parent(), surface.get_abs_offset()
        place = np.array([left, top, left + surface.get_width(), top + surface.get_height()])
        pixels = np.frombuffer(whole.get_buffer(), np.uint32)  # type: ignore[call-overload]  # pygame's stubs lack it
        angle = self._angle if angle is None else angle
        stamp_discs(pixels, whole.get_pitch() // 4, place, centre, radius, self._values, angle, line)


@lru_cache(maxsize=1024)
def disc(radius: float, colour: str) -> Surface:
    """Draw a smooth disc on a clear surface of its size. radius: px of the screen, at least MIN_RADIUS."""
    side = 2 * (round(radius) + 1)
    large = Surface((DISC_SCALE * side, DISC_SCALE * side), pygame.SRCALPHA)
    centre = DISC_SCALE * side / 2
    pygame.draw.circle(large, rgb(colour), (centre, centre), DISC_SCALE * radius)
    return pygame.transform.smoothscale(large, (side, side))


@lru_cache(maxsize=4096)
def turned_disc(radius: float, colour: str, turn: int, line: tuple[int, int, int]) -> Surface:
    """Draw a disc with the line that shows its angle, as pymunk does. turn: one of TURNS."""
    picture = disc(radius, colour).copy()
    half, angle = picture.get_width() // 2, turn * math.tau / TURNS
    edge = half + round((radius - 1) * math.cos(angle)), half + round((radius - 1) * math.sin(angle))
    pygame.draw.line(picture, line, (half, half), edge, 2 if radius > 20 else 1)
    return picture


def forget_pictures() -> None:
    """Empty the caches of pictures, because discs of their sizes are not drawn again."""
    disc.cache_clear()
    turned_disc.cache_clear()


def _has_byte_channels(surface: Surface) -> bool:
    """Return whether each colour of a pixel has a byte of its own in 32 bits, as on nearly every screen."""
    return surface.get_bytesize() == 4 and not any(surface.get_losses()[:3])


@kernel
def _blend(pixels, at, value, coverage):  # type: ignore[no-untyped-def]
    """Cover a share of a pixel with the colour of a value."""
    share, below = int(256 * coverage + 0.5), np.int64(pixels[at])
    even = ((value & 0xFF00FF) * share + (below & 0xFF00FF) * (256 - share) + 0x800080) >> 8
    odd = ((value >> 8) & 0xFF00FF) * share + ((below >> 8) & 0xFF00FF) * (256 - share) + 0x800080
    pixels[at] = (even & 0xFF00FF) | (odd & 0xFF00FF00)


@kernel
def _chord(radius, off):  # type: ignore[no-untyped-def]
    """Return half the width of a disc at a distance from its centre, px."""
    return math.sqrt(max((radius - off) * (radius + off), 0.0))


@kernel
def _covered(chords, left):  # type: ignore[no-untyped-def]
    """Return the share of a pixel that chords of half these widths cover. left: px from their middle to its left."""
    covered = 0.0
    for node in range(3):
        overlap = min(chords[node], left + 1.0) - max(-chords[node], left)
        covered += WEIGHTS[node] * max(overlap, 0.0)
    return covered


@kernel
def _stamp_disc(pixels, row, place, x, y, radius, value):  # type: ignore[no-untyped-def]
    """Draw a disc. Each row of pixels is covered by the chords at three heights of what is in it of the disc."""
    for line in range(math.floor(max(y - radius, place[1])), math.ceil(min(y + radius, place[3]))):
        top, bottom = max(line - y, -radius), min(line + 1 - y, radius)
        height = bottom - top
        chords = (
            _chord(radius, top + NODES[0] * height),
            _chord(radius, top + NODES[1] * height),
            _chord(radius, top + NODES[2] * height),
        )
        narrow, wide = min(chords[0], chords[2]), max(chords[0], chords[1], chords[2])
        left, right = math.floor(max(x - wide, place[0])), math.ceil(min(x + wide, place[2]))
        begin, end = right, right  # of the pixels that are covered wholly; the few of a small disc are not looked for
        if height == 1.0 and narrow > MIN_RUN:
            begin = math.ceil(min(max(x - narrow, left), right))
            end = math.floor(max(min(x + narrow, right), begin))
        for column in range(left, begin):
            _blend(pixels, line * row + column, value, height * _covered(chords, column - x))
        for column in range(begin, end):
            pixels[line * row + column] = value
        for column in range(end, right):
            _blend(pixels, line * row + column, value, height * _covered(chords, column - x))


@kernel
def _stamp_line(pixels, row, place, x, y, length, angle, value):  # type: ignore[no-untyped-def]
    """Draw a line of some length from a point, 1 px wide and smooth; 2 px from a length of 20 px on, as Pymunk does."""
    along_x, along_y = 1.0, 0.0
    if length > 0.5:  # or else nobody can see where it points
        along_x, along_y = math.cos(angle), math.sin(angle)
    half = 1.0 if length > 20.0 else 0.5
    reach = half + 0.5
    end_x, end_y = x + length * along_x, y + length * along_y
    first = math.floor(max(min(y, end_y) - reach, place[1]))
    for line in range(first, math.ceil(min(max(y, end_y) + reach, place[3]))):
        low, high = min(x, end_x) - reach, max(x, end_x) + reach
        off_y = line + 0.5 - y
        if abs(along_y) > 0.1:  # only the columns that the line crosses in this row
            middle, spread = x + off_y * along_x / along_y, reach / abs(along_y)
            low, high = max(low, middle - spread), min(high, middle + spread)
        for column in range(math.floor(max(low, place[0])), math.ceil(min(high, place[2]))):
            off_x = column + 0.5 - x
            across = min(max(reach - abs(off_x * along_y - off_y * along_x), 0.0), 1.0)
            along = off_x * along_x + off_y * along_y
            _blend(pixels, line * row + column, value, across * min(max(min(along, length - along) + 0.5, 0.0), 1.0))


@entry
def stamp_discs(pixels, row, place, centre, radius, values, angle, line):  # type: ignore[no-untyped-def]
    """Draw discs, each over those before it.

    pixels: (rows * row,) uint32, of a surface with `row` pixels from one row to the next; place: its left, top, right
    and bottom, px, from which centres are measured and outside of which nothing is drawn; centre: (n, 2) px; radius:
    (n,) px; values: (n,) of pixels in the discs' colours; angle: (n,); line: value of the lines that show the angles,
    or -1 for none.
    """
    for ball in range(len(radius)):
        x, y, r = centre[ball, 0] + place[0], centre[ball, 1] + place[1], radius[ball]
        if not (x + r > place[0] and x - r < place[2] and y + r > place[1] and y - r < place[3]):  # or not a number
            continue
        _stamp_disc(pixels, row, place, x, y, r, values[ball])
        if line >= 0:
            _stamp_line(pixels, row, place, x, y, r - 1.0, angle[ball], line)
