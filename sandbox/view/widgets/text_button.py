"""A button with a word on it."""

from collections.abc import Callable
from dataclasses import dataclass

from pygame import Color, Rect, Surface

from sandbox.view.palette import ACCENT, FAINT, FRAME, INK, RAISED
from sandbox.view.primitives import fitting, text_width, write
from sandbox.view.widgets.widget import Pressable, draw_ground


def _never() -> bool:
    return False


@dataclass(eq=False)
class TextButton(Pressable):
    """Does something. is_on: whether what it turns on is on; refusal: why it cannot be pressed, or nothing.

    colour: of a mark before the text, such as an engine's in the charts.
    """

    text: str
    do: Callable[[], None]
    does: str = ""
    is_on: Callable[[], bool] = _never
    refusal: Callable[[], str] = str
    colour: Color | None = None
    width: float = 5.0

    @property
    def tip(self) -> str:
        """What it does, or why it cannot."""
        return self.refusal() or self.does

    @property
    def look(self) -> object:
        """The text, and how it stands."""
        return self.text, self.is_on(), self.refusal()

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the text in the middle, smaller if need be; dark on a light ground while on, grey if it is refused."""
        on = self.is_on()
        draw_ground(surface, place, ACCENT if on else RAISED, text_height, hot=hot)
        mark = text_height if self.colour else 0
        room = place.width - 2 * (text_height // 3) - mark
        height = fitting(text_width(self.text, text_height), room, text_height)
        pad = max(text_height // 3, (place.width - text_width(self.text, height) - mark) // 2)
        line = Rect(place.x + pad, place.y, place.width - 2 * pad, place.height)
        if self.colour:
            surface.fill(self.colour, (line.x, line.centery - text_height // 3, 2 * text_height // 3, text_height // 2))
            line = Rect(line.x + mark, line.y, line.width - mark, line.height)
        write(surface, self.text, line, FAINT if self.refusal() else FRAME if on else INK, height)

    def act(self) -> None:
        """Do it."""
        if not self.refusal():
            self.do()
