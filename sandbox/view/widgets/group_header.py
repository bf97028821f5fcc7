"""The name of a group of widgets; pressing it folds the group away, or unfolds it."""

from collections.abc import Callable
from typing import Final

from pygame import Rect, Surface

from sandbox.view.palette import FAINT, FRAME
from sandbox.view.primitives import lettering, text_width
from sandbox.view.widgets.widget import Pressable, draw_fold, draw_ground

TEXT: Final = 0.4  # height of the name, in heights of the toolbar
MARK: Final = 0.75  # width of the mark and the room about it, likewise


class GroupHeader(Pressable):
    """is_open: whether the group is unfolded, as the layout has it. toggle: folds or unfolds it."""

    def __init__(self, name: str, toggle: Callable[[], None]) -> None:
        self.name = name
        self.is_open = True
        self._toggle = toggle
        self.width = MARK + TEXT * text_width(name, 100) / 100

    @property
    def tip(self) -> str:
        """What a press does."""
        return f"{'fold' if self.is_open else 'unfold'} {self.name}"

    @property
    def look(self) -> object:
        """Whether the group is unfolded."""
        return self.is_open

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the name after a mark that points down while the group is unfolded, else to the right."""
        draw_ground(surface, place, FRAME, text_height, hot=hot)
        height, wing = round(TEXT * place.height), max(3, place.height // 8)
        x, y = place.x + place.height // 4, place.centery
        draw_fold(surface, (x, y), wing, is_open=self.is_open)
        name = lettering(self.name, FAINT, height)
        surface.blit(name, name.get_rect(left=x + round(1.6 * wing), centery=y))

    def act(self) -> None:
        """Fold or unfold the group."""
        self._toggle()
