"""A named bar, of a chart in words."""

from dataclasses import dataclass

from pygame import Color, Rect, Surface

from sandbox.view.palette import FAINT, INK
from sandbox.view.primitives import text_width, write
from sandbox.view.widgets.widget import Widget


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
        value_width = text_width(self.value, text_height)
        write(surface, self.name, Rect(line.x, line.y, line.width - value_width, line.height), INK, text_height)
        write(
            surface,
            self.value,
            Rect(line.right - value_width, *line.topleft[1:], value_width, line.height),
            INK,
            text_height,
        )
        length = round(self.share * line.width / 2)
        bar = Rect(line.centerx + min(length, 0), line.bottom, max(1, abs(length)), thick)
        surface.fill(FAINT, (line.x, bar.centery, line.width, 1))
        surface.fill(self.colour, bar)
