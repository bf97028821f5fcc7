"""A card with what a scene is about, for some seconds after it was opened."""

from time import monotonic
from typing import Final

from pygame import Surface

from sandbox.scene.model import Scene
from sandbox.view.layout import Layout
from sandbox.view.primitives import card, wrapped

SECONDS_SHOWN: Final = 8.0
MIN_HELP_HEIGHT: Final = 400  # px
LINE_WIDTH: Final = 40  # heights of the text, at most


class AboutCard:
    """What a scene is about; it is shown for some seconds, and longer while it is asked for."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._until = monotonic() + SECONDS_SHOWN
        self.asked_for = False

    @property
    def text(self) -> str:
        """What is shown, or nothing."""
        return self.scene.about if self.asked_for or monotonic() < self._until else ""

    def close(self) -> None:
        """Show it no longer, unless it is asked for."""
        self._until = 0.0

    def top(self, layout: Layout) -> int:
        """Return how much of the window's height the card leaves for the help; all of it if that is little, px."""
        left = layout.status.y - round((len(self._lines(layout)) + 2) * 1.4 * layout.text_height)
        return left if self.text and left > MIN_HELP_HEIGHT else layout.window[1]

    def _lines(self, layout: Layout) -> tuple[str, ...]:
        height = layout.text_height
        return wrapped(self.text, min(layout.status.width - 2 * height, LINE_WIDTH * height), height)

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw it above the status line."""
        height, lines = layout.text_height, [[line] for line in self._lines(layout)]
        if lines and not (self.asked_for and self.top(layout) == layout.window[1]):
            head = [[self.scene.title or self.scene.name]]
            card(surface, head + lines, layout.status.topleft, height, surface.get_rect())
