"""The header: the scene, what it is about, and what is saved of it."""

from collections.abc import Callable
from functools import partial
from typing import Any, Final

from pygame import Rect

from sandbox.scene.model import Scene
from sandbox.view.controls import OF_ACTION, Action, tip_of
from sandbox.view.layout import GAP, Layout
from sandbox.view.primitives import wrapped
from sandbox.view.widgets.buttons import Item, Menu, TextButton
from sandbox.view.widgets.group import Placed, WidgetRow
from sandbox.view.widgets.widget import Widget
from sandbox.view.widgets.words import Label

ABOUT_LETTERS: Final = 40  # width of what the scene is about, while the mouse is on it, in heights of the text
MIN_ABOUT: Final = 10  # heights of the text; where there is less room, it is left out
SAVES: Final = {
    Action.SAVE_SCENE: "Scene",
    Action.SAVE_PICTURE: "Picture",
    Action.SAVE_INPUTS: "What I did",
    Action.COPY_CODE: "Pymunk code",
}


def action_button(text: str, action: Action, do: Callable[[Action], None], **more: Any) -> TextButton:
    """Return a button that does an action, with its keys in its tip. more: as for `TextButton`."""
    return TextButton(text, partial(do, action), tip_of(action), **more)


class Header:
    """A row of buttons round what the scene is about.

    scene: returns the one that runs. do: does an action. is_on: whether an action's state is on. recorded: s, None
    while nothing is recorded.
    """

    def __init__(
        self,
        scene: Callable[[], Scene],
        do: Callable[[Action], None],
        is_on: Callable[[Action], bool],
        recorded: Callable[[], float | None],
    ) -> None:
        self._scene = scene
        self._is_on = is_on

        def button(text: str, action: Action, **more: Any) -> TextButton:
            return action_button(text, action, do, is_on=partial(is_on, action), **more)

        def record_text() -> str:
            return "Record" if (seconds := recorded()) is None else f"Stop {seconds:.1f} s"

        saves = [
            Item(text, partial(do, action), f"{OF_ACTION[action].does} ({OF_ACTION[action].key_names})")
            for action, text in SAVES.items()
        ]
        self._title = Label(lambda: scene().title or scene().name, bold=True, scale=1.2)
        self._about = Label(
            lambda: scene().about, lambda: "\n".join(wrapped(scene().about, ABOUT_LETTERS * 14, 14)), dim=True
        )
        self._close = action_button("\N{MULTIPLICATION SIGN}", Action.ABOUT, do)
        self._buttons: list[Widget] = [
            button("Open\N{HORIZONTAL ELLIPSIS}", Action.PICK_SCENE),
            button("\N{SINGLE LEFT-POINTING ANGLE QUOTATION MARK}", Action.PREVIOUS_SCENE),
            button("\N{SINGLE RIGHT-POINTING ANGLE QUOTATION MARK}", Action.NEXT_SCENE),
        ]
        right = [
            Menu(lambda: "Save", lambda: saves, "save or copy something"),
            button("", Action.RECORD, said=record_text, widest="Stop 88.8 s"),
            button("Help", Action.HELP),
            button("Panel", Action.COLUMN),
        ]
        self._row = WidgetRow([self._title, *self._buttons], right)

    def placed(self, layout: Layout) -> list[Placed]:
        """Return its widgets with their places; what the scene is about has the room that the others leave."""
        place, height = layout.header, layout.text_height
        self._row.left = [self._title, *self._buttons]
        if self._row.width(height) > place.width:
            self._row.left = self._buttons
        placed = self._row.placed(place, height, layout.side)
        left = max((where.right for widget, where in placed if widget in self._row.left), default=place.x) + GAP
        right = min((where.x for widget, where in placed if widget in self._row.right), default=place.right) - GAP
        close = Rect(right - layout.side, place.y, layout.side, layout.side)
        if close.x - left > MIN_ABOUT * height and self._scene().about and self._is_on(Action.ABOUT):
            placed += [(self._about, Rect(left, place.y, close.x - GAP - left, layout.side)), (self._close, close)]
        return placed
