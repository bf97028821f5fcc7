"""A paragraph, which may be pressed."""

from collections.abc import Callable
from dataclasses import dataclass

from pygame import Color, Rect, Surface

from sandbox.view.palette import ACCENT, INK, RAISED
from sandbox.view.primitives import wrapped, write
from sandbox.view.widgets.widget import Pressable, draw_ground


@dataclass(eq=False)
class Words(Pressable):
    """A text that is broken into lines. do: what a click on it does; marked: it stands out as the chosen one.

    colour: by default, that of all text.
    """

    text: str
    colour: Color | None = None
    do: Callable[[], None] | None = None
    marked: bool = False
    width: float = 5.0

    @property
    def takes_keys(self) -> bool:  # type: ignore[override]
        """Whether something is done."""
        return self.do is not None

    @property
    def look(self) -> object:
        """The text, and whether it is marked."""
        return self.text, self.colour and self.colour.normalize(), self.marked

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its lines, px."""
        return len(self._lines(width, text_height)) * round(1.3 * text_height) + text_height // 3

    def _lines(self, width: int, text_height: int) -> tuple[str, ...]:
        return wrapped(self.text, width - text_height, text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw its lines in the middle of its height; on a ground of its own if it can be pressed."""
        if self.do:
            draw_ground(surface, place, RAISED, text_height, hot=hot)
        if self.marked:
            surface.fill(ACCENT, (place.x, place.y, max(2, text_height // 4), place.height))
        top = place.y + (place.height - self.height(place.width, text_height)) // 2 + text_height // 6
        line = Rect(place.x + text_height // 2, top, place.width - text_height, round(1.3 * text_height))
        for text in self._lines(place.width, text_height):
            write(surface, text, line, self.colour or INK, text_height)
            line.y += line.height

    def act(self) -> None:
        """Do it."""
        if self.do:
            self.do()
