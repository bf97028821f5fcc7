"""A button with an icon: a control's on the toolbar."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from pygame import Rect, Surface

from sandbox.view.controls import Control
from sandbox.view.icons import icon
from sandbox.view.palette import ACCENT, FRAME, INK, RAISED
from sandbox.view.widgets.widget import Pressable, draw_ground

ICON_OFF: Final = (INK.r, INK.g, INK.b)
ICON_ON: Final = (FRAME.r, FRAME.g, FRAME.b)


@dataclass(frozen=True)
class Button(Pressable):
    """Does what a control's key does. is_on: whether what the control turns on is on."""

    control: Control
    do: Callable[[Control], None]
    is_on: Callable[[Control], bool]

    @property
    def tip(self) -> str:
        """What it does, and its keys."""
        return f"{self.control.does}  ({self.control.key_names})"

    @property
    def look(self) -> object:
        """Whether it is on."""
        return self.is_on(self.control)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the icon; while it is on, dark on a light ground."""
        on = self.is_on(self.control)
        draw_ground(surface, place, ACCENT if on else RAISED, text_height, hot=hot)
        name = self.control.icon_on if on and self.control.icon_on else self.control.icon
        picture = icon(name, round(0.68 * place.height), ICON_ON if on else ICON_OFF)
        surface.blit(picture, picture.get_rect(center=place.center))

    def act(self) -> None:
        """Do what the control does."""
        self.do(self.control)
