"""A colour to choose."""

from collections.abc import Callable
from dataclasses import dataclass

from pygame import Color, Rect, Surface

from sandbox.view.palette import INK, RAISED
from sandbox.view.widgets.widget import Pressable, draw_ground


@dataclass(eq=False)
class Swatch(Pressable):
    """Shows a colour; a press chooses it. is_on: whether it is the chosen one."""

    colour: str
    do: Callable[[], None]
    is_on: Callable[[], bool]
    refusal: Callable[[], str] = str

    @property
    def tip(self) -> str:
        """The colour's name, or why it cannot be chosen."""
        return self.refusal() or self.colour

    @property
    def look(self) -> object:
        """The colour, and whether it is chosen."""
        return self.colour, self.is_on()

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the colour; with a frame if it is chosen."""
        draw_ground(surface, place, INK if self.is_on() else RAISED, text_height, hot=hot)
        edge = max(2, text_height // 5)
        surface.fill(Color(self.colour), place.inflate(-2 * edge, -2 * edge))

    def act(self) -> None:
        """Choose it."""
        if not self.refusal():
            self.do()
