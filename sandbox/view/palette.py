"""The window's colours, which colour-blind people can distinguish, and dashes that distinguish engines too."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from pygame import Color

from sandbox.scene.fields import PALETTE, rgb

FRAME: Final = Color("#22262b")  # around the panes
RAISED: Final = Color("#3a4047")  # buttons and fields on the frame
INK: Final = Color("#e8eaed")
FAINT: Final = Color("#9aa0a6")
DARK_BACKGROUND: Final = "#14181d"

BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = PALETTE
ACCENT: Final = Color(SKY)  # buttons that are on, and what is chosen
YELLOW: Final = "#f0e442"  # of Okabe and Ito's colours; balls do not have it, as it is hardly visible on white

# The engines' lines in turn: those of Okabe and Ito's colours that stand out on a light or on a dark ground.
ON_LIGHT: Final = (BLUE, VERMILLION, GREEN, PURPLE, "#000000")
ON_DARK: Final = (SKY, ORANGE, GREEN, YELLOW, "#ffffff")
DASHES: Final = ((1, 0), (8, 4), (2, 3), (14, 3, 2, 3), (4, 8))  # on, off, ..., in line widths


@dataclass(frozen=True)
class Line:
    """How an engine's line is drawn. dash: lengths on, off, ..., in line widths; solid if it is never off."""

    colour: Color
    dash: tuple[int, ...]


@dataclass(frozen=True)
class Palette:
    """The colours of everything that is drawn on one background.

    ink: text and marks. faint: grid and axes. momentum, contact: arrows and contacts.
    """

    ground: Color
    ink: Color
    faint: Color
    momentum: Color
    contact: Color
    lines: tuple[Line, ...]

    def line(self, engine: int) -> Line:
        """Return the line of an engine, counted from 0. After the last line comes the first again."""
        return self.lines[engine % len(self.lines)]


@lru_cache(maxsize=64)
def palette(background: str) -> Palette:
    """Choose colours that stand out from a background."""
    ground, ink = Color(*rgb(background)), contrast(background)
    dark = ink == Color("white")
    lines = zip(ON_DARK if dark else ON_LIGHT, DASHES, strict=True)
    return Palette(
        ground=ground,
        ink=ink,
        faint=ground.lerp(ink, 0.15),
        momentum=Color(ORANGE if dark else PURPLE),
        contact=Color(YELLOW if dark else VERMILLION),
        lines=tuple(Line(Color(colour), dash) for colour, dash in lines),
    )


def chart_background(background: str) -> str:
    """Choose the charts' background: light or dark like a scene's, but never a colour that hides a line."""
    return "white" if contrast(background) == Color("black") else DARK_BACKGROUND


def contrast(background: str) -> Color:
    """Choose black or white, whichever stands out from a background."""
    red, green, blue = rgb(background)
    return Color("black") if 0.299 * red + 0.587 * green + 0.114 * blue > 128 else Color("white")
