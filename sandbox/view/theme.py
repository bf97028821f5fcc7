"""The colours of the window, light or dark, and of the panes on any background."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from pygame import Color

from sandbox.report.colours import colours_of
from sandbox.scene.fields import PALETTE, rgb

THEME: Final = "SANDBOX_THEME"  # environment variable: dark, or else light


class Theme:
    """The colours in use: the light ones until another theme is chosen.

    ground: of the window; raised: of panels and buttons; hover: of a button under the mouse; ink, dim: of text; line:
    round buttons; accent, on_accent: of what is on or chosen, and of text on it; wall: the frame of a pane; pane: of a
    scene whose background would glare.
    """

    ground: Color
    raised: Color
    hover: Color
    ink: Color
    dim: Color
    line: Color
    accent: Color
    on_accent: Color
    wall: Color
    pane: Color
    is_dark: bool

    def __init__(self, *, dark: bool) -> None:
        self.use(dark=dark)

    def use(self, *, dark: bool) -> None:
        """Use the light theme, or the dark one."""
        vars(self).update({name: Color(colours[dark]) for name, colours in COLOURS.items()}, is_dark=dark)


COLOURS: Final = {  # of each theme: light, dark
    "ground": ("#f4f5f7", "#171a1f"),
    "raised": ("#ffffff", "#20242b"),
    "hover": ("#e8edf3", "#2b313a"),
    "ink": ("#1d2430", "#e8ebf0"),
    "dim": ("#5a6475", "#9aa4b2"),
    "line": ("#d5dae1", "#3d4450"),
    "accent": ("#0b66c3", "#5aa9f0"),
    "on_accent": ("#ffffff", "#0b1016"),
    "wall": ("#9aa5b4", "#6b7686"),
    "pane": ("#ffffff", "#14171b"),
}
LIGHT, DARK = Theme(dark=False), Theme(dark=True)
theme: Final = Theme(dark=False)


def luminance(colour: Color) -> float:
    """Return the relative luminance of a colour, as WCAG defines it: 0 is black, 1 white."""
    shares = [value / 255 for value in (colour.r, colour.g, colour.b)]
    red, green, blue = (s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast_ratio(one: Color, other: Color) -> float:
    """Return the contrast of two colours, as WCAG defines it: from 1 to 21."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def readable(colour: Color, ground: Color, ratio: float = 4.5) -> Color:
    """Return the colour nearest to another, on the way to black or white, in which text can be read on a ground.

    ratio: the contrast that it has at least; 3 is enough for lines.
    """
    to = Color("black") if luminance(ground) > 0.18 else Color("white")
    shades = (colour.lerp(to, k / 20) for k in range(21))
    return next((shade for shade in shades if contrast_ratio(shade, ground) >= ratio), to)


BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = PALETTE
GLARE: Final = 0.3  # luminance of a background that would glare in a dark window
YELLOW: Final = "#f0e442"  # of Okabe and Ito's colours; balls do not have it, as it is hardly visible on white


@dataclass(frozen=True)
class Palette:
    """The colours of everything that is drawn on one background.

    ink: text and marks. wall: inner walls, which do not glare either. faint: grid and axes. law: lines of a theory.
    contact: of contacts.
    is_dark: the background.
    """

    ground: Color
    ink: Color
    wall: Color
    faint: Color
    law: Color
    contact: Color
    is_dark: bool

    def engines(self, names: Iterable[str]) -> dict[str, Color]:
        """Return the colour of each engine in a run: that of its line and of its name, which can be read."""
        return dict(_engines(tuple(names), (self.ground.r, self.ground.g, self.ground.b), dark=self.is_dark))


@lru_cache(maxsize=64)
def _engines(names: tuple[str, ...], ground: tuple[int, int, int], *, dark: bool) -> dict[str, Color]:
    return {name: readable(Color(colour), Color(*ground)) for name, colour in colours_of(names, dark=dark).items()}


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
    ink = contrast(Color(*ground))
    dark = ink == Color("white")
    return Palette(
        ground=Color(*ground),
        ink=ink,
        wall=DARK.dim if Color(*ground) == DARK.pane else ink,
        faint=Color(*ground).lerp(ink, 0.12),
        law=Color(*ground).lerp(ink, 0.4),
        contact=Color(YELLOW if dark else VERMILLION),
        is_dark=dark,
    )


def contrast(ground: Color) -> Color:
    """Choose black or white, whichever stands out from a ground."""
    return Color("black") if 0.299 * ground.r + 0.587 * ground.g + 0.114 * ground.b > 128 else Color("white")
