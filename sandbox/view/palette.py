"""The window's colours, which colour-blind people can distinguish."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from pygame import Color

from sandbox.report.colours import colours_of
from sandbox.scene.fields import PALETTE, rgb

FRAME: Final = Color("#22262b")  # around the panes
RAISED: Final = Color("#3a4047")  # buttons and fields on the frame
INK: Final = Color("#e8eaed")
FAINT: Final = Color("#9aa0a6")
DARK_BACKGROUND: Final = "#14181d"

BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = PALETTE
ACCENT: Final = Color(SKY)  # buttons that are on, and what is chosen
YELLOW: Final = "#f0e442"  # of Okabe and Ito's colours; balls do not have it, as it is hardly visible on white


@dataclass(frozen=True)
class Palette:
    """The colours of everything that is drawn on one background.

    ink: text and marks. faint: grid and axes. law: lines of a theory. momentum, contact: arrows and contacts.
    is_dark: the background.
    """

    ground: Color
    ink: Color
    faint: Color
    law: Color
    momentum: Color
    contact: Color
    is_dark: bool

    def engines(self, names: Iterable[str]) -> dict[str, Color]:
        """Return the colour of each engine in a run."""
        return {name: Color(colour) for name, colour in colours_of(names, dark=self.is_dark).items()}


@lru_cache(maxsize=64)
def palette(background: str) -> Palette:
    """Choose colours that stand out from a background."""
    ground, ink = Color(*rgb(background)), contrast(background)
    dark = ink == Color("white")
    return Palette(
        ground=ground,
        ink=ink,
        faint=ground.lerp(ink, 0.15),
        law=ground.lerp(ink, 0.4),
        momentum=Color(ORANGE if dark else PURPLE),
        contact=Color(YELLOW if dark else VERMILLION),
        is_dark=dark,
    )


def chart_background(background: str) -> str:
    """Choose the charts' background: light or dark like a scene's, but never a colour that hides a line."""
    return "white" if contrast(background) == Color("black") else DARK_BACKGROUND


@lru_cache(maxsize=64)
def contrast(background: str) -> Color:
    """Choose black or white, whichever stands out from a background."""
    red, green, blue = rgb(background)
    return Color("black") if 0.299 * red + 0.587 * green + 0.114 * blue > 128 else Color("white")
