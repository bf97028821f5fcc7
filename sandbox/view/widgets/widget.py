"""What every widget can do."""

from collections.abc import Callable
from typing import Final

import pygame
from pygame import Color, Rect, Surface
from pygame.event import Event

from sandbox.view.theme import theme

ENTER: Final = (pygame.K_RETURN, pygame.K_KP_ENTER)
ARROWS: Final = {pygame.K_LEFT: -1, pygame.K_DOWN: -1, pygame.K_RIGHT: 1, pygame.K_UP: 1}


class Widget:
    """Something that shows a state and can be pressed. It is given its place at each call, since windows change.

    width: in heights of the toolbar; in a row of the side panel, relative to its neighbours. takes_keys: the keyboard
    can be on it. takes_text: it is typed into once it has been pressed. follows_mouse: it is pressed again at each
    move of the mouse that holds it. does: what it is for. refusal: why it cannot be used now, or nothing. seen_in: the
    part of the window outside of which it is scrolled out of sight; None if it never is.
    """

    width: float = 1.0
    takes_keys = True
    takes_text = False
    follows_mouse = False
    does: str = ""
    refusal: Callable[[], str] = str
    seen_in: Rect | None = None

    @property
    def tip(self) -> str:
        """The text below it while the mouse or the keyboard is on it."""
        return self.refusal() or self.does

    @property
    def look(self) -> object:
        """What is drawn; something else if the widget must be drawn again."""
        raise NotImplementedError

    def natural_width(self, text_height: int) -> int:
        """Return the width that it has in a row of the window, px."""
        return round(1.75 * text_height * self.width)

    def height(self, width: int, text_height: int) -> int:
        """Return the height that it needs in the side panel, px. width, text_height: px."""
        return round(1.85 * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw it. hot: the mouse or the keyboard is on it."""
        raise NotImplementedError

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Handle the mouse going down on it, or moving since then, at a point of the window."""

    def release(self) -> None:
        """Handle the mouse button going up."""

    def key(self, event: Event) -> bool:
        """Handle a key. Return whether the widget uses it."""
        return False

    def leave(self) -> None:
        """Handle that the keyboard goes elsewhere."""


class Pressable(Widget):
    """A widget that does something when it is pressed, or when Enter is while the keyboard is on it."""

    do: Callable[[], None] | None

    def act(self) -> None:
        """Do it, unless it is refused."""
        if self.do and not self.refusal():
            self.do()

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Do it."""
        self.act()

    def key(self, event: Event) -> bool:
        """Do it if the key is Enter."""
        if event.key in ENTER:
            self.act()
        return event.key in ENTER


def draw_fold(surface: Surface, centre: tuple[int, int], size: int, *, is_open: bool) -> None:
    """Draw a triangle that points down if something is unfolded, else to the right. size: half its width, px."""
    x, y = centre
    tips = [(-1, -0.5), (1, -0.5), (0, 0.7)] if is_open else [(-0.5, -1), (-0.5, 1), (0.7, 0)]
    pygame.draw.polygon(surface, theme.dim, [(x + size * across, y + size * down) for across, down in tips])


def draw_ground(surface: Surface, place: Rect, colour: Color, text_height: int, *, hot: bool) -> None:
    """Draw what a widget stands on, with a stronger edge while the mouse or the keyboard is on it."""
    radius = round(0.4 * text_height)
    pygame.draw.rect(surface, theme.hover if hot and colour == theme.raised else colour, place, border_radius=radius)
    edge = theme.accent if hot else theme.line
    pygame.draw.rect(surface, edge, place, max(1, text_height // 12), border_radius=radius)
