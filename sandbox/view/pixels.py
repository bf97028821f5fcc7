"""Kernels that draw many smooth discs and lines at once into the pixels of a surface."""

import math
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pygame import Color, Surface
from pygame.surfarray import pixels2d

from sandbox.compiled import NotCompiledYet, between_frames, entry, kernel
from sandbox.state import Integers

# Gauss's nodes and weights for integrals from 0 to 1: where a disc's width is measured in each row of pixels.
NODES: Final = (0.1127016653792583, 0.5, 0.8872983346207417)
WEIGHTS: Final = (5 / 18, 8 / 18, 5 / 18)
MIN_RUN: Final = 3.0  # px; in narrower rows, pixels that are covered wholly are not looked for
MIN_TURNED: Final = 0.5  # px; the direction of a shorter line cannot be seen, so it is not drawn


def has_kernels(surface: Surface) -> bool:
    """Return whether kernels can draw on a surface, and are compiled."""
    if not has_byte_channels(surface):
        return False
    try:
        with between_frames():
            load_kernels()
    except NotCompiledYet:
        return False
    return True


@cache
def load_kernels() -> None:
    """Compile the kernels, or load their machine code.

    numba keeps the arguments of the first call alive for some time, which must not be those of a locked surface.
    """
    pixels, place, none = np.zeros(1, np.uint32), np.zeros(4, np.int64), np.zeros(0)
    stamp_discs(pixels, 1, place, np.zeros((0, 2)), none, np.zeros(0, np.int64), none, 0)
    stamp_lines(pixels, 1, place, np.zeros((0, 4)), 0)
    stamp_wall(pixels, 1, place, np.zeros(4), 0.5, 0)


def has_byte_channels(surface: Surface) -> bool:
    """Return whether each colour of a pixel is a byte of 32 bits, as on nearly every screen. Kernels need that."""
    return surface.get_bytesize() == 4 and not any(surface.get_losses()[:3])


def fill(surface: Surface, colour: Color) -> None:
    """Fill a surface. SDL takes up to six times as long for one whose rows begin in the middle of a cache line."""
    if has_byte_channels(surface):
        pixels2d(surface)[:] = pixel_of(surface, colour)
    else:
        surface.fill(colour)


def pixel_of(surface: Surface, colour: Color | tuple[int, ...]) -> int:
    """Return the value of a pixel in a colour, from 0; pygame's is negative if the highest bit is set."""
    return surface.map_rgb(colour) & 0xFFFFFFFF


def pixels_of(surface: Surface) -> tuple[NDArray[np.uint32], int]:
    """Return the pixels of a surface, or of the one that it is a part of, and how many there are from row to row.

    The surface is locked, and nothing else can draw on it, as long as the array exists.
    """
    whole = surface.get_abs_parent()
    # Not in a variable here either: numba keeps the frames in which it compiled.
    return np.frombuffer(whole.get_buffer(), np.uint32), whole.get_pitch() // 4  # type: ignore[call-overload]


def place_of(surface: Surface) -> Integers:
    """Return the left, top, right and bottom of a surface in the one that it is a part of, px."""
    (left, top), (width, height) = surface.get_abs_offset(), surface.get_size()
    return np.array([left, top, left + width, top + height])


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
    for node in range(len(WEIGHTS)):
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
            coverage = across * min(max(min(along, length - along) + 0.5, 0.0), 1.0)
            if coverage > 0.0:
                _blend(pixels, line * row + column, value, coverage)


@entry
def stamp_discs(pixels, row, place, centre, radius, values, angle, line):  # type: ignore[no-untyped-def]
    """Draw discs, each over those before it.

    pixels: (rows * row,) uint32, of a surface with `row` pixels from one row to the next; place: its left, top, right
    and bottom, px, from which centres are measured and outside of which nothing is drawn; centre: (n, 2) px; radius:
    (n,) px; values: (n,) of pixels in the discs' colours; angle: (n,); line: value of the lines that show the angles.
    """
    for ball in range(len(radius)):
        x, y, r = centre[ball, 0] + place[0], centre[ball, 1] + place[1], radius[ball]
        if not (x + r > place[0] and x - r < place[2] and y + r > place[1] and y - r < place[3]):  # or not a number
            continue
        _stamp_disc(pixels, row, place, x, y, r, values[ball])
        if r - 1.0 > MIN_TURNED:
            _stamp_line(pixels, row, place, x, y, r - 1.0, angle[ball], line)


@entry
def stamp_lines(pixels, row, place, ends, value):  # type: ignore[no-untyped-def]
    """Draw smooth lines, 1 px wide, as `pygame.draw.aaline` draws them.

    pixels, row, place: as for discs; ends: (n, 4) whole px, x and y of both ends of each line; value: of pixels in
    their colour.
    """
    for line in range(len(ends)):
        along = 0 if abs(ends[line, 2] - ends[line, 0]) >= abs(ends[line, 3] - ends[line, 1]) else 1
        first, last = (0, 2) if ends[line, along] <= ends[line, 2 + along] else (2, 0)
        start, steps = ends[line, first + along], ends[line, last + along] - ends[line, first + along]
        side = ends[line, first + 1 - along]
        slope = (ends[line, last + 1 - along] - side) / max(steps, 1.0)
        size, span = place[2 + along] - place[along], place[3 - along] - place[1 - along]
        begin, end = max(0.0, -start), min(steps, size - 1.0 - start)
        for step in range(math.ceil(begin), math.floor(end) + 1):
            across = side + slope * step
            low = math.floor(min(max(across, -2.0), span + 1.0))
            for beside in range(2):
                if 0 <= low + beside < span:
                    column, height = start + step, low + beside
                    if along == 1:
                        column, height = height, column
                    at = (int(height) + place[1]) * row + int(column) + place[0]
                    _blend(pixels, at, value, abs(1.0 - beside - (across - low)))


@entry
def stamp_wall(pixels, row, place, ends, radius, value):  # type: ignore[no-untyped-def]
    """Draw a smooth segment with round ends.

    pixels, row, place: as for discs; ends: (4,) px, x and y of both; radius: half its thickness, px; value: of a pixel
    in its colour.
    """
    x, y, reach = ends[0] + place[0], ends[1] + place[1], radius + 0.5
    length = math.hypot(ends[2] - ends[0], ends[3] - ends[1])
    along_x, along_y = (ends[2] - ends[0]) / max(length, 1e-9), (ends[3] - ends[1]) / max(length, 1e-9)
    end_x, end_y = x + length * along_x, y + length * along_y
    for line in range(
        math.floor(max(min(y, end_y) - reach, place[1])), math.ceil(min(max(y, end_y) + reach, place[3]))
    ):
        low, high = min(x, end_x) - reach, max(x, end_x) + reach
        off_y = line + 0.5 - y
        if abs(along_y) > 0.01:  # only the columns that it crosses in this row
            middle, spread = x + off_y * along_x / along_y, reach / abs(along_y)
            low, high = max(low, middle - spread), min(high, middle + spread)
        for column in range(math.floor(max(low, place[0])), math.ceil(min(high, place[2]))):
            off_x = column + 0.5 - x
            along = min(max(off_x * along_x + off_y * along_y, 0.0), length)
            coverage = reach - math.hypot(off_x - along * along_x, off_y - along * along_y)
            if coverage > 0.0:
                _blend(pixels, line * row + column, value, min(coverage, 1.0))
