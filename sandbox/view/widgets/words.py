"""Texts among widgets: a paragraph, a line, and a named bar."""

from collections.abc import Callable
from dataclasses import dataclass

from pygame import Color, Rect, Surface

from sandbox.view.primitives import dot, shortened, text_width, wrapped, write
from sandbox.view.theme import theme
from sandbox.view.widgets.widget import Pressable, Widget, draw_ground


@dataclass(eq=False)
class Words(Pressable):
    """A text that is broken into lines. do: what a click on it does; marked: it stands out as the chosen one.

    colour: by default, that of all text. scale: of the text. dots: colours of the balls that it is about.
    """

    text: str
    colour: Color | None = None
    do: Callable[[], None] | None = None
    marked: bool = False
    bold: bool = False
    scale: float = 1.0
    dots: tuple[Color, ...] = ()
    width: float = 5.0

    @property
    def takes_keys(self) -> bool:  # type: ignore[override]
        """Whether something is done."""
        return self.do is not None

    @property
    def look(self) -> object:
        """The text, and whether it is marked."""
        return self.text, self.colour and tuple(self.colour), self.marked, [tuple(colour) for colour in self.dots]

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its lines, px."""
        return len(self._lines(width, text_height)) * self._step(text_height) + text_height // 3

    def _lines(self, width: int, text_height: int) -> tuple[str, ...]:
        room = width - (1 + len(self.dots)) * text_height
        return wrapped(self.text, room, round(self.scale * text_height), bold=self.bold)

    def _step(self, text_height: int) -> int:
        return round(1.35 * self.scale * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw its lines in the middle of its height; on a ground of its own if it can be pressed."""
        if self.do:
            draw_ground(surface, place, theme.raised, text_height, hot=hot)
        if self.marked:
            surface.fill(theme.accent, (place.x, place.y, max(2, text_height // 4), place.height))
        top = place.y + (place.height - self.height(place.width, text_height)) // 2 + text_height // 6
        line = Rect(place.x + text_height // 2, top, place.width - text_height, self._step(text_height))
        for colour in self.dots:
            disc = dot(max(2, text_height // 3), colour, theme.dim)
            surface.blit(disc, disc.get_rect(center=(line.x + text_height // 3, line.centery)))
            line.x += text_height
            line.width -= text_height
        for text in self._lines(place.width, text_height):
            write(surface, text, line, self.colour or theme.ink, round(self.scale * text_height), bold=self.bold)
            line.y += line.height


@dataclass(eq=False)
class Label(Widget):
    """Says something. said: what; more: what is said while the mouse is on it; scale: of its text."""

    said: Callable[[], str]
    more: Callable[[], str] = str
    bold: bool = False
    dim: bool = False
    scale: float = 1.0
    widest: str = ""
    width: float = 5.0

    takes_keys = False

    @property
    def tip(self) -> str:
        """What it says at length."""
        return self.more()

    @property
    def look(self) -> object:
        """The text."""
        return self.said()

    def natural_width(self, text_height: int) -> int:
        """Return the width of its text, px."""
        height = round(self.scale * text_height)
        return text_width(self.widest or self.said(), height, bold=self.bold) + text_height // 2

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text."""
        height = round(self.scale * text_height)
        text = shortened(self.said(), max(place.width, 1), height)
        write(surface, text, place, theme.dim if self.dim else theme.ink, height, bold=self.bold)


@dataclass(eq=False)
class Bar(Widget):
    """A name and a value over a bar from the middle: to the right for what is gained, to the left for what is lost.

    share: length and sign of the bar, -1 to 1 of half of the width.
    """

    name: str
    value: str
    share: float
    colour: Color
    width: float = 5.0

    takes_keys = False

    @property
    def look(self) -> object:
        """All of it."""
        return self.name, self.value, self.share, self.colour.normalize()

    def height(self, width: int, text_height: int) -> int:
        """Return the height of a line of text and a bar, px."""
        return round(1.3 * text_height) + max(4, text_height // 2)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text over the bar."""
        thick = max(3, text_height // 3)
        line = Rect(place.x + text_height // 2, place.y, place.width - text_height, place.height - thick - 1)
        name, value = line.copy(), line.copy()
        value.width = text_width(self.value, text_height)
        name.width, value.right = line.width - value.width, line.right
        write(surface, self.name, name, theme.ink, text_height)
        write(surface, self.value, value, theme.ink, text_height)
        length = round(self.share * line.width / 2)
        bar = Rect(line.centerx + min(length, 0), line.bottom, max(1, abs(length)), thick)
        surface.fill(theme.dim, (line.x, bar.centery, line.width, 1))
        surface.fill(self.colour, bar)
