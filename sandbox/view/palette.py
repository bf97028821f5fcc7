"""The window's colours, which colour-blind people can distinguish."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from pygame import Color

from sandbox.report.colours import colours_of
from sandbox.scene.fields import PALETTE, rgb
from sandbox.view.theme import DARK, luminance, readable, theme

BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = PALETTE
GLARE: Final = 0.3  # luminance of a background that would glare in a dark window
YELLOW: Final = "#f0e442"  # of Okabe and Ito's colours; balls do not have it, as it is hardly visible on white


@dataclass(frozen=True)
class Palette:
    """The colours of everything that is drawn on one background.

    ink: text and marks. wall: inner walls, which do not glare either. faint: grid and axes. law: lines of a theory.
    momentum, contact: arrows and contacts.
    is_dark: the background.
    """

    ground: Color
    ink: Color
    wall: Color
    faint: Color
    law: Color
    momentum: Color
    contact: Color
    is_dark: bool

    def engines(self, names: Iterable[str]) -> dict[str, Color]:
        """Return the colour of each engine in a run: that of its line and of its name, which can be read."""
        colours = colours_of(names, dark=self.is_dark)
        return {name: readable(Color(colour), self.ground) for name, colour in colours.items()}


def palette(background: str) -> Palette:
    """Choose colours that stand out from a scene's background, which the dark theme replaces if it would glare."""
    ground = Color(*rgb(background))
    if theme.is_dark and luminance(ground) > GLARE:
        ground = theme.pane
    return _palette((ground.r, ground.g, ground.b))


def chart_palette() -> Palette:
    """Return the colours of charts."""
    return _palette((theme.raised.r, theme.raised.g, theme.raised.b))


@lru_cache(maxsize=64)
def _palette(ground: tuple[int, int, int]) -> Palette:
    ink = contrast_with(Color(*ground))
    dark = ink == Color("white")
    return Palette(
        ground=Color(*ground),
        ink=ink,
        wall=DARK.dim if Color(*ground) == DARK.pane else ink,
        faint=Color(*ground).lerp(ink, 0.12),
        law=Color(*ground).lerp(ink, 0.4),
        momentum=Color(ORANGE if dark else PURPLE),
        contact=Color(YELLOW if dark else VERMILLION),
        is_dark=dark,
    )


def contrast(background: str) -> Color:
    """Choose black or white, whichever stands out from a colour."""
    return contrast_with(Color(*rgb(background)))


def contrast_with(ground: Color) -> Color:
    """Choose black or white, whichever stands out from a ground."""
    return Color("black") if 0.299 * ground.r + 0.587 * ground.g + 0.114 * ground.b > 128 else Color("white")
