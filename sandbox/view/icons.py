"""The toolbar's icons, drawn from shapes in a square of 24 x 24, so that they are sharp at any size."""

from functools import lru_cache
from itertools import pairwise
from typing import Final, Literal

import pygame
from pygame import Color, Surface

from sandbox.view.primitives import capsule, font

SIDE: Final = 24
ICON_SCALE: Final = 4  # icons are drawn larger and scaled down, which smooths their edges
STROKE: Final = 2.0  # width of lines, in units of the square's 24

# "line" or "fill", x0, y0, x1, y1, ...; "ring" or "dot", x, y, radius; "text", letter
Part = tuple[Literal["line", "fill", "ring", "dot"], *tuple[float, ...]] | tuple[Literal["text"], str]
_ARROW_UP: Final[Part] = ("fill", 20, 4, 18.5, 12, 12, 5.5)
ICONS: Final[dict[str, tuple[Part, ...]]] = {
    "pause": (("fill", 6, 4, 10, 4, 10, 20, 6, 20), ("fill", 14, 4, 18, 4, 18, 20, 14, 20)),
    "play": (("fill", 7, 3, 20, 12, 7, 21),),
    "step": (("fill", 5, 4, 15, 12, 5, 20), ("fill", 16, 4, 19, 4, 19, 20, 16, 20)),
    "restart": (
        ("line", 17, 7, 12, 5, 7, 8, 5, 13, 7.5, 18, 13, 20, 18, 17, 19, 13), ("fill", 13, 9.5, 20.5, 9, 18.5, 2),
    ),
    "start": (("fill", 19, 4, 9, 12, 19, 20), ("fill", 5, 4, 8, 4, 8, 20, 5, 20)),
    "end": (("fill", 5, 4, 15, 12, 5, 20), ("line", 18, 5, 18, 19), ("dot", 12, 12, 1)),
    "back": (("fill", 19, 4, 9, 12, 19, 20), ("fill", 5, 8, 8, 8, 8, 16, 5, 16)),
    "pick": (
        ("line", 3, 3, 10, 3, 10, 10, 3, 10, 3, 3), ("line", 14, 3, 21, 3, 21, 10, 14, 10, 14, 3),
        ("line", 3, 14, 10, 14, 10, 21, 3, 21, 3, 14), ("line", 14, 14, 21, 14, 21, 21, 14, 21, 14, 14),
    ),
    "engines": (
        ("line", 3, 7, 10, 7, 10, 20, 3, 20, 3, 7), ("line", 14, 7, 21, 7, 21, 20, 14, 20, 14, 7),
        ("dot", 6.5, 12, 1.7), ("dot", 17.5, 15, 1.7), ("line", 3, 3, 10, 3), ("line", 14, 3, 21, 3),
    ),
    "save": (
        ("line", 12, 3, 12, 14), ("fill", 6.5, 10, 17.5, 10, 12, 16.5), ("line", 4, 16, 4, 20.5, 20, 20.5, 20, 16),
    ),
    "inputs": (("line", 4, 6, 20, 6), ("line", 4, 12, 12, 12), ("line", 4, 18, 12, 18), ("dot", 18, 15, 4)),
    "full": (
        ("line", 3, 9, 3, 3, 9, 3), ("line", 15, 3, 21, 3, 21, 9), ("line", 21, 15, 21, 21, 15, 21),
        ("line", 9, 21, 3, 21, 3, 15),
    ),
    "undo": (("line", 8, 18, 14, 18, 18, 15.5, 19, 12.5, 17, 9.5, 13, 8.5, 8, 8.5), ("fill", 9.5, 3, 9.5, 14, 3, 8.5)),
    "redo": (
        ("line", 16, 18, 10, 18, 6, 15.5, 5, 12.5, 7, 9.5, 11, 8.5, 16, 8.5), ("fill", 14.5, 3, 14.5, 14, 21, 8.5),
    ),
    "add": (("ring", 10, 14, 7), ("line", 10, 10.5, 10, 17.5), ("line", 6.5, 14, 13.5, 14), ("dot", 19, 5, 1.5)),
    "delete": (("ring", 12, 12, 9), ("line", 8.5, 8.5, 15.5, 15.5), ("line", 15.5, 8.5, 8.5, 15.5)),
    "inspect": (("ring", 10, 10, 7), ("dot", 10, 10, 2.5), ("line", 15, 15, 21, 21)),
    "slower": (("fill", 12, 5, 12, 19, 3, 12), ("fill", 21, 5, 21, 19, 12, 12)),
    "faster": (("fill", 12, 5, 12, 19, 21, 12), ("fill", 3, 5, 3, 19, 12, 12)),
    "previous": (("line", 15, 5, 8, 12, 15, 19),),
    "next": (("line", 9, 5, 16, 12, 9, 19),),
    "seed": (
        ("line", 4, 4, 20, 4, 20, 20, 4, 20, 4, 4),
        ("dot", 8.5, 8.5, 1.7), ("dot", 15.5, 8.5, 1.7), ("dot", 12, 12, 1.7), ("dot", 8.5, 15.5, 1.7),
        ("dot", 15.5, 15.5, 1.7),
    ),
    "velocity": (("dot", 6, 18, 4), ("line", 6, 18, 16, 8), _ARROW_UP),
    "momentum": (("dot", 7, 17, 6), ("line", 7, 16, 15, 8), ("line", 8, 17, 16, 9), _ARROW_UP),
    "trails": (("dot", 18, 7, 4), ("dot", 12, 13, 2.6), ("dot", 8, 17, 1.9), ("dot", 4.5, 20, 1.3)),
    "contacts": (("ring", 6, 12, 4.5), ("ring", 18, 12, 4.5), ("line", 12, 2, 12, 7), ("line", 12, 17, 12, 22)),
    "centre": (
        ("ring", 12, 12, 9), ("fill", 12, 12, 12, 3, 16, 4, 19.5, 7.5, 21, 12),
        ("fill", 12, 12, 12, 21, 8, 20, 4.5, 16.5, 3, 12),
    ),
    "numbers": (("ring", 12, 12, 9.5), ("text", "1")),
    "ghosts": (("dot", 8, 14, 5.5), ("ring", 16, 9, 5)),
    "grid": (
        ("line", 8.5, 3, 8.5, 21), ("line", 15.5, 3, 15.5, 21), ("line", 3, 8.5, 21, 8.5), ("line", 3, 15.5, 21, 15.5),
    ),
    "charts": (("line", 3, 3, 3, 21, 21, 21), ("line", 6, 16, 10, 10, 14, 13, 20, 5)),
    "why": (
        ("line", 3, 3, 21, 3, 21, 17, 13, 17, 8, 21.5, 8, 17, 3, 17, 3, 3),
        ("line", 9.5, 7.5, 11, 6.2, 13, 6.2, 14.5, 7.5, 14.2, 9, 12, 10.5, 12, 11.5), ("dot", 12, 14.2, 1.2),
    ),
    "picture": (
        ("line", 3, 8, 8, 8, 9.5, 5, 14.5, 5, 16, 8, 21, 8, 21, 19, 3, 19, 3, 8), ("ring", 12, 13, 3.2),
    ),
    "record": (("ring", 12, 12, 9), ("dot", 12, 12, 5)),
    "stop": (("ring", 12, 12, 9), ("fill", 8, 8, 16, 8, 16, 16, 8, 16)),
    "help": (("text", "?"),),
}  # fmt: skip


@lru_cache(maxsize=256)
def icon(name: str, side: int, colour: tuple[int, int, int]) -> Surface:
    """Draw an icon on a clear surface. side: px; colour: red, green, blue."""
    scale = ICON_SCALE * side / SIDE
    large = Surface((ICON_SCALE * side, ICON_SCALE * side), pygame.SRCALPHA)
    for part in ICONS[name]:
        _draw_part(large, part, scale, Color(*colour))
    return pygame.transform.smoothscale(large, (side, side))


def _draw_part(large: Surface, part: Part, scale: float, colour: Color) -> None:
    if part[0] == "text":
        text = font(round(15 * scale)).render(part[1], True, colour)
        large.blit(text, text.get_rect(center=large.get_rect().center))
        return
    kind, *numbers = part
    at = [scale * number for number in numbers]
    if kind in ("dot", "ring"):
        pygame.draw.circle(large, colour, at[:2], at[2], 0 if kind == "dot" else round(STROKE * scale))
        return
    points = list(zip(at[::2], at[1::2], strict=True))
    if kind == "fill":
        pygame.draw.polygon(large, colour, points)
        return
    for start, end in pairwise(points):
        capsule(large, colour, start, end, STROKE * scale / 2)
