"""A heading that unfolds what belongs to it, with a sample of a line in the charts."""

from collections.abc import Callable
from dataclasses import dataclass

from pygame import Color, Rect, Surface

from sandbox.view.palette import INK, RAISED
from sandbox.view.primitives import line_sample, wrapped, write
from sandbox.view.widgets.widget import Pressable, draw_fold, draw_ground


@dataclass(eq=False)
class Heading(Pressable):
    """A text of as many lines as it needs; a press folds or unfolds what is below it. colour, ground: of the sample."""

    text: str
    colour: Color
    ground: Color
    do: Callable[[], None]
    does: str
    is_open: bool = False

    @property
    def tip(self) -> str:
        """What a press does."""
        return self.does

    @property
    def look(self) -> object:
        """The text, the sample, and whether it is unfolded."""
        return self.text, tuple(self.colour), tuple(self.ground), self.is_open

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its lines, px."""
        return round(0.45 * text_height) + len(self._lines(width, text_height)) * round(1.3 * text_height)

    def _lines(self, width: int, text_height: int) -> tuple[str, ...]:
        return wrapped(self.text, width - 5 * text_height, text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the sample, the text, and a triangle that points down if it is unfolded."""
        draw_ground(surface, place, RAISED, text_height, hot=hot)
        step, pad = round(1.3 * text_height), text_height // 2
        line = Rect(place.x + pad, place.y + (place.height % step) // 2, place.width - 3 * pad, step)
        line_sample(surface, Rect(line.x, line.y, 2 * text_height, step), self.colour, self.ground, text_height)
        line.x += 2 * text_height + pad
        line.width = place.right - 3 * pad - line.x
        for text in self._lines(place.width, text_height):
            write(surface, text, line, INK, text_height)
            line.y += step
        draw_fold(surface, (place.right - 2 * pad, place.centery), text_height // 4, is_open=self.is_open)

    def act(self) -> None:
        """Fold or unfold what belongs to it."""
        self.do()
