"""What plots are drawn on: an SVG text, or a PNG picture."""

import io
from collections.abc import Sequence
from typing import Final, Protocol
from xml.etree import ElementTree

import pygame
from pygame import Color, Surface

from sandbox.analysis.junit import NOT_IN_XML
from sandbox.state import Floats
from sandbox.view.primitives import drawable, lettering

TEXT_HEIGHT: Final = 14  # units of a plot
PNG_SCALE: Final = 2  # px of a PNG for a unit
SMOOTHING: Final = 2  # lines are drawn larger by this factor and scaled down
_ANCHORS: Final = {0.0: "start", 0.5: "middle", 1.0: "end"}


class Canvas(Protocol):
    """A white rectangle, with x to the right and y down."""

    def line(self, points: Floats, colour: Color, width: float) -> None:
        """Draw a line through points. points: (n, 2)."""
        ...

    def text(self, words: str, at: Sequence[float], colour: Color, align: float = 0.0) -> None:
        """Write a line of text, TEXT_HEIGHT high, centred at a height. align: the share of it that is left of `at`."""
        ...

    def content(self) -> bytes:
        """Return what a file of it contains."""
        ...


class SvgCanvas:
    """Draws SVG."""

    def __init__(self, size: tuple[int, int]) -> None:
        width, height = map(str, size)
        self._root = ElementTree.Element(
            "svg", xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {width} {height}", width=width, height=height
        )
        self._root.set("font-family", "system-ui, sans-serif")
        self._root.set("font-size", str(TEXT_HEIGHT))
        ElementTree.SubElement(self._root, "rect", width=width, height=height, fill="white")

    def line(self, points: Floats, colour: Color, width: float) -> None:
        """Draw a line through points."""
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
        drawn = ElementTree.SubElement(self._root, "polyline", points=path, fill="none", stroke=_hex(colour))
        drawn.set("stroke-width", f"{width:g}")
        drawn.set("stroke-linejoin", "round")

    def text(self, words: str, at: Sequence[float], colour: Color, align: float = 0.0) -> None:
        """Write a line of text."""
        x, y = (f"{value:.1f}" for value in at)
        written = ElementTree.SubElement(self._root, "text", x=x, y=y, dy="0.35em", fill=_hex(colour))
        written.set("text-anchor", _ANCHORS[align])
        written.text = drawable(words).translate(NOT_IN_XML)

    def content(self) -> bytes:
        """Return the SVG text."""
        ElementTree.indent(self._root)
        text: bytes = ElementTree.tostring(self._root, encoding="utf-8", xml_declaration=True)
        return text + b"\n"


class PngCanvas:
    """Draws a picture of PNG_SCALE px for each unit."""

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = PNG_SCALE * size[0], PNG_SCALE * size[1]
        self._lines = Surface((SMOOTHING * self._size[0], SMOOTHING * self._size[1]))
        self._lines.fill("white")
        self._texts: list[tuple[Surface, tuple[float, float]]] = []

    def line(self, points: Floats, colour: Color, width: float) -> None:
        """Draw a line through points."""
        scaled = PNG_SCALE * SMOOTHING * points
        thick = max(1, round(PNG_SCALE * SMOOTHING * width))
        pygame.draw.lines(self._lines, colour, False, scaled.tolist(), thick)

    def text(self, words: str, at: Sequence[float], colour: Color, align: float = 0.0) -> None:
        """Write a line of text."""
        written = lettering(words, colour, PNG_SCALE * TEXT_HEIGHT)
        place = PNG_SCALE * at[0] - align * written.get_width(), PNG_SCALE * at[1] - written.get_height() / 2
        self._texts.append((written, place))

    def content(self) -> bytes:
        """Return the PNG file."""
        picture = pygame.transform.smoothscale(self._lines, self._size)
        for written, place in self._texts:
            picture.blit(written, place)
        png = io.BytesIO()
        pygame.image.save(picture, png, "plot.png")
        return png.getvalue()


def _hex(colour: Color) -> str:
    return f"#{colour.r:02x}{colour.g:02x}{colour.b:02x}"
