"""What the window is drawn with: text, discs, thick segments, arrows, markers, cards."""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib.resources import files
from itertools import accumulate, product
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.scene.fields import Vector, rgb
from sandbox.scene.model import Scene
from sandbox.scene.walls import segment_distance
from sandbox.state import Floats
from sandbox.text import printable
from sandbox.view.theme import Palette, palette, theme

FACES: Final = files("font_source_sans_pro") / "files"
DASHES: Final = 0.7  # of a circle, for each px of its radius
EDGE: Final = 0.51  # px; a segment of which less is seen, as of an arena's walls if its size is rounded, is not drawn
MAX_LETTERS: Final = 1000  # of a line that are drawn; no screen has room for more
SMALLEST_TEXT: Final = 9  # px, of what is made smaller to fit
TEXT_SCALE: Final = 3  # text is drawn larger and scaled down: at its own size, letters are spaced unevenly
Point = Sequence[float]
Ink = Color | tuple[int, ...]
MIN_RADIUS: Final = 1.0  # px; smaller discs are drawn with it, or they would hardly be seen
PHASES: Final = 4  # of a disc's centre in a pixel, along x and y; of discs from
MANY_PHASES: Final = 40  # px of radius on, two
TURNS: Final = 120  # angles of the line that shows how a disc is turned
MAX_SPRITE: Final = 256  # px, radius of the largest disc of which a picture is kept
MIN_TURNED: Final = 0.5  # px; the direction of a shorter line cannot be seen, so it is not drawn
RADIUS_INK: Final = (44, 62, 80)  # of the line from the centre to the rim, as in Pymunk's debug-draw


@lru_cache(maxsize=256)
def font(height: int, *, bold: bool = False) -> pygame.font.Font:
    """Return a font, the same on every machine. height: px."""
    pygame.font.init()
    return pygame.font.Font(str(FACES / f"SourceSansPro-{'Semibold' if bold else 'Regular'}.ttf"), round(1.15 * height))


@lru_cache(maxsize=2048)
def _text(text: str, colour: tuple[int, int, int, int], height: int, *, bold: bool) -> Surface:
    width = text_width(text, height, bold=bold)
    if not width:
        return Surface((0, height))
    large = font(TEXT_SCALE * height, bold=bold).render(drawable(text), True, colour)
    return pygame.transform.smoothscale(large, (width, round(large.get_height() / TEXT_SCALE)))


@lru_cache(maxsize=2048)
def text_width(text: str, height: int, *, bold: bool = False) -> int:
    """Return the width of a line of text, px."""
    return round(font(TEXT_SCALE * height, bold=bold).size(drawable(text))[0] / TEXT_SCALE)


def fitting(width: int, room: int, height: int) -> int:
    """Return the height in which a line of text fits, px. width: what it has in the usual height; room: px."""
    return height if width <= room else max(SMALLEST_TEXT, height * room // width)


def drawable(text: str) -> str:
    """Return as much of a text as there is room for, in characters that pygame can draw."""
    return printable(text[:MAX_LETTERS])


def lettering(text: str, colour: Color, height: int, *, bold: bool = False) -> Surface:
    """Return a line of text on a clear surface of its size. The surface is shared: do not draw on it."""
    return _text(text, (colour.r, colour.g, colour.b, colour.a), height, bold=bold)


def write(surface: Surface, text: str, place: Rect, colour: Color, height: int, *, bold: bool = False) -> int:
    """Write a line of text at half of a place's height, cut off at its right edge; return its right end."""
    line = lettering(text, colour, height, bold=bold)
    width = min(line.get_width(), max(0, place.width))
    surface.blit(line, (place.x, place.centery - line.get_height() // 2), (0, 0, width, line.get_height()))
    return place.x + width


@lru_cache(maxsize=256)
def shortened(text: str, width: int, height: int, *, bold: bool = False) -> str:
    """Return as much of the start of a text as fits into a width (px), with an ellipsis if that is not all of it."""
    if text_width(text, height, bold=bold) <= width:
        return text
    fitting = (text[:k].rstrip() + "\N{HORIZONTAL ELLIPSIS}" for k in range(len(text) - 1, 0, -1))
    return next((cut for cut in fitting if text_width(cut, height, bold=bold) <= width), "\N{HORIZONTAL ELLIPSIS}")


@lru_cache(maxsize=256)
def wrapped(text: str, width: int, height: int, indent: str = "", *, bold: bool = False) -> tuple[str, ...]:
    """Break a text into lines that fit into a width, px; all but the first are indented."""
    lines, line = list[str](), ""
    for word in filter(None, drawable(text).split(" ")):
        if line and text_width(f"{line} {word}", height, bold=bold) > width:
            lines.append(line)
            line = ""
        line = f"{line} {word}" if line else (indent if lines else "") + word
        while len(line) > len(indent) + 1 and text_width(line, height, bold=bold) > width:  # a word longer than a line
            cuts = range(len(line) - 1, len(indent), -1)
            cut = next((k for k in cuts if text_width(line[:k], height, bold=bold) <= width), cuts[-1])
            lines.append(line[:cut])
            line = indent + line[cut:]
    return tuple(filter(None, (*lines, line)))


def first_lines(text: str, width: int, height: int, most: int, indent: str = "", *, bold: bool = False) -> list[str]:
    """Break a text into lines as `wrapped` does, at most so many; an ellipsis ends the last if that is not all."""
    lines = wrapped(text, width, height, indent, bold=bold)
    if len(lines) <= most:
        return list(lines)
    return [*lines[: most - 1], shortened(f"{lines[most - 1]} {lines[most].lstrip()}", width, height)]


def capsule(surface: Surface, colour: Ink, a: Point, b: Point, radius: float) -> None:
    """Draw a segment with round ends, if more of it than its edge is on the surface. a, b, radius: px of that."""
    radius = max(float(radius), 0.5)
    for low, high, size in zip(map(min, a, b), map(max, a, b), surface.get_size(), strict=True):
        if high < EDGE - radius or low > size - EDGE + radius:
            return
    if tuple(a) == tuple(b) and radius <= MAX_SPRITE:
        surface.blit(*_disc(a[0], a[1], radius, tuple(colour)[:3]))
    else:
        surface.blit(*_segment((a[0], a[1]), (b[0], b[1]), radius, tuple(colour)[:3], surface.get_size()))


@lru_cache(maxsize=64)
def _segment(
    a: Vector, b: Vector, radius: float, colour: tuple[int, ...], size: tuple[int, int]
) -> tuple[Surface, tuple[int, int]]:
    """Return what is seen of a segment on a surface of some size, and its left and top, px."""
    (left, right), (top, bottom) = (
        (max(0, math.floor(min(ends) - radius - 1)), min(most, math.ceil(max(ends) + radius) + 1))
        for *ends, most in zip(a, b, size, strict=True)
    )
    at = np.moveaxis(np.mgrid[left:right, top:bottom], 0, -1) + 0.5
    return _painted(radius + 0.5 - segment_distance(at, a, b), colour), (left, top)


def _painted(share: Floats, colour: tuple[int, ...]) -> Surface:
    """Return a picture of which a colour covers a share of each pixel."""
    picture = Surface(share.shape, pygame.SRCALPHA)
    picture.fill((*colour, 0))
    pygame.surfarray.pixels_alpha(picture)[:] = np.rint(255 * np.clip(share, 0, 1))
    return picture


def draw_wall(
    surface: Surface, colour: Ink, ends: Sequence[Point], thickness: float, scale: float, origin: Point
) -> None:
    """Draw a wall. ends, thickness: px of the scene; scale: px of the surface for one of these; origin: the scene's."""
    start, end = ((x * scale + origin[0], y * scale + origin[1]) for x, y in ends)
    capsule(surface, colour, start, end, thickness / 2 * scale)


def draw_walls(surface: Surface, scene: Scene, scale: float, origin: Vector = (0.0, 0.0)) -> None:
    """Draw a scene's walls. scale: px of the surface for one px of the scene; origin: where the scene's is."""
    ink = palette(scene.arena.background).wall
    for wall in scene.walls:
        draw_wall(surface, ink, (wall.start, wall.to), wall.thickness, scale, origin)


def circle(surface: Surface, colour: Ink, centre: Point, radius: float, width: float, *, dashed: bool = False) -> None:
    """Draw a smooth circle, also between two pixels. radius: of its outer edge; all in px."""
    if radius > MAX_SPRITE:
        pygame.draw.circle(surface, colour, centre, radius, round(width))
    else:
        key = tuple(colour)[:3], width, dashed
        surface.blit(*_sprite(_circle_picture, centre[0], centre[1], round(radius, 2), PHASES, *key))


@lru_cache(maxsize=1024)
def _circle_picture(
    right: float, low: float, radius: float, colour: tuple[int, ...], width: float, dashed: bool
) -> Surface:
    x, y = _offsets(radius, right, low)
    share = np.clip(width / 2 + 0.5 - np.abs(radius - width / 2 - np.hypot(x, y)), 0, 1)
    if dashed:
        share *= np.arctan2(y, x) / math.tau * max(8, round(radius * DASHES)) % 1 > 0.4
    return _painted(share, colour)


def dot(surface: Surface, colour: Ink, rim: Ink, centre: Point, radius: float) -> None:
    """Draw a smooth disc with a thin rim, of which white ones are seen too. centre, radius: px."""
    capsule(surface, rim, centre, centre, radius + 0.5)
    capsule(surface, colour, centre, centre, radius - 0.5)


def arrow(surface: Surface, colour: Ink, tail: Point, tip: Point, width: float) -> None:
    """Draw an arrow. tail, tip, width of its shaft: px of the surface."""
    length = math.dist(tail, tip)
    if length < 1:
        return
    x, y = (tip[0] - tail[0]) / length, (tip[1] - tail[1]) / length
    head = min(4.5 * width, length)
    neck = tip[0] - head * x, tip[1] - head * y
    wing = 0.45 * head
    pygame.draw.line(surface, colour, tail, neck, max(1, round(width)))
    wings = [(neck[0] - wing * y, neck[1] + wing * x), (neck[0] + wing * y, neck[1] - wing * x)]
    pygame.draw.polygon(surface, colour, [tip, *wings])


def card(
    surface: Surface,
    lines: Sequence[Sequence[str]],
    near: Point | Rect,
    height: int,
    within: Rect,
    kept_free: Sequence[Rect] = (),
) -> None:
    """Draw a small table next to a point or a place, inside another. lines: the texts of each row.

    kept_free: what it covers only if there is room nowhere else.
    """
    columns = [max(text_width(row[k], height) for row in lines if k < len(row)) for k in range(max(map(len, lines)))]
    pad, line_height = height // 2, round(1.4 * height)
    stops = list(accumulate(columns, lambda x, width: x + width + 2 * pad, initial=pad))
    place = Rect(0, 0, stops[-1] - pad, len(lines) * line_height + pad)
    beside = near if isinstance(near, Rect) else Rect(round(near[0]), round(near[1]), height, height)
    place.topleft = beside.right if beside is not near else beside.x, beside.bottom + (pad if beside is near else 0)
    if place.bottom > within.bottom:
        place.bottom = beside.y - pad
    place.clamp_ip(within)
    across = place.x, beside.x - pad - place.width, beside.right + pad
    down = place.y, beside.y - pad - place.height, beside.y
    corners = (*product(across, down), *product(across, (at.bottom for at in kept_free)))  # the nearest come first
    places = (Rect(corner, place.size) for corner in corners)
    place = next((at for at in places if within.contains(at) and at.collidelist(kept_free) < 0), place)
    panel(surface, place)
    for number, row in enumerate(lines):
        for column, text in enumerate(row):
            cell = Rect(place.x + stops[column], place.y + pad // 2 + number * line_height, place.width, line_height)
            is_name = number and not column and len(row) > 1
            write(surface, text, cell.clip(place), theme.dim if is_name else theme.ink, height)


def label(surface: Surface, text: str, near: Point, height: int, within: Rect, colours: Palette) -> None:
    """Write a line of text on a ground of its own in the middle of a point, moved inside a place. near: px."""
    line = lettering(text, colours.ink, height)
    place = line.get_rect(center=(round(near[0]), round(near[1]))).inflate(height // 2, 0).clamp(within)
    surface.fill(colours.ground, place)
    surface.blit(line, line.get_rect(center=place.center))


def panel(surface: Surface, place: Rect) -> None:
    """Draw the background of something that lies over everything else."""
    pygame.draw.rect(surface, theme.raised, place, border_radius=6)
    pygame.draw.rect(surface, theme.dim, place, 1, border_radius=6)


def _sprite(
    picture: Callable[..., Surface], x: float, y: float, reach: float, phases: int, *key: object
) -> tuple[Surface, tuple[int, int]]:
    """Return the picture of something that reaches so far round a place, and its left and top, px.

    picture: returns it for a place that is off the middle of the middle pixel by so much to the right and down, px, and
    for the reach and a key.
    """
    across, down, middle = round((x - 0.5) * phases), round((y - 0.5) * phases), math.ceil(reach) + 1
    surface = picture(across % phases / phases, down % phases / phases, reach, *key)
    return surface, (across // phases - middle, down // phases - middle)


def _offsets(reach: float, right: float, low: float, fine: int = 1) -> tuple[Floats, Floats]:
    """Return how far parts of pixels are from a place across, as a column, and down. fine: parts of a pixel a side."""
    middle = math.ceil(reach) + 1
    at = (np.arange(fine * (2 * middle + 1)) + 0.5) / fine - 0.5 - middle
    return at[:, None] - right, at - low


def _disc(x: float, y: float, radius: float, colour: tuple[int, ...]) -> tuple[Surface, tuple[int, int]]:
    """Return a picture of a smooth disc at a place, and its left and top, px."""
    return _sprite(_disc_picture, x, y, radius, PHASES if radius < MANY_PHASES else 2, colour)


@lru_cache(maxsize=4096)
def _disc_picture(right: float, low: float, radius: float, colour: tuple[int, ...]) -> Surface:
    fine, side = 8 if radius < 4 else 2, 2 * math.ceil(radius) + 3
    share = np.clip(fine * (radius - np.hypot(*_offsets(radius, right, low, fine))) + 0.5, 0, 1)
    return _painted(share.reshape(side, fine, side, fine).mean(axis=(1, 3)), colour)


@lru_cache(maxsize=4096)
def _line_picture(right: float, low: float, length: float, turn: int, ink: tuple[int, ...]) -> Surface:
    """Return a line from a disc's centre to its rim, 1 px wide, and 2 px from a length of 20 px on, as Pymunk's."""
    x, y = math.cos(turn / TURNS * math.tau), math.sin(turn / TURNS * math.tau)
    off_x, off_y = _offsets(length, right, low)
    along, across = off_x * x + off_y * y, np.abs(off_x * y - off_y * x)
    beside = np.clip((1.5 if length > 20 else 1.0) - across, 0, 1)
    return _painted(beside * np.clip(np.minimum(along, length - along) + 0.5, 0, 1), ink)


class Discs:
    """The discs of some balls on the screen, in their order. radius: (n,) px of the scene."""

    def __init__(self, radius: Floats, colours: Sequence[str]) -> None:
        self._radius = radius
        inks = {colour: tuple(rgb(colour))[:3] for colour in set(colours)}
        self._inks = [inks[colour] for colour in colours]

    def __len__(self) -> int:
        return len(self._radius)

    def draw(self, surface: Surface, centre: Floats, scale: float, angle: Floats) -> None:
        """Draw the discs with their centres at some places of the surface, (n, 2) px, and lines to their rims."""
        radius, middle = np.maximum(scale * self._radius, MIN_RADIUS), np.divide(surface.get_size(), 2)
        seen = np.flatnonzero((np.abs(centre - middle) < middle + radius[:, None]).all(axis=1))
        pictures = []
        parts = (seen.tolist(), centre[seen].tolist(), radius[seen].tolist(), angle[seen].tolist())
        for k, (x, y), r, turned in zip(*parts, strict=True):
            if r > MAX_SPRITE:
                capsule(surface, self._inks[k], (x, y), (x, y), r)
                continue
            pictures.append(_disc(x, y, r, self._inks[k]))
            if r - 1 > MIN_TURNED:
                turn = round(turned / math.tau * TURNS) % TURNS
                pictures.append(_sprite(_line_picture, x, y, r - 1, PHASES, turn, RADIUS_INK))
        surface.blits(pictures, doreturn=False)
