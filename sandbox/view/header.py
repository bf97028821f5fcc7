"""The header: the scene, what it is about, and what is saved of it."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from pygame import Rect, Surface

from sandbox.scene.model import Scene
from sandbox.view.controls import CONTROLS, Action, Control
from sandbox.view.layout import GAP, Layout
from sandbox.view.primitives import wrapped
from sandbox.view.theme import theme
from sandbox.view.widgets.buttons import Item, Menu, TextButton
from sandbox.view.widgets.group import Placed, WidgetGroup, WidgetRow
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
OF_ACTION: Final[Mapping[object, Control]] = {control.action: control for control in CONTROLS}


def tip_of(action: object) -> str:
    """Return what a control does, and its keys."""
    control = OF_ACTION[action]
    return f"{control.does[0].upper()}{control.does[1:]}  ({control.key_names})"


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
        group: WidgetGroup,
        scene: Callable[[], Scene],
        do: Callable[[Action], None],
        is_on: Callable[[Action], bool],
        recorded: Callable[[], float | None],
    ) -> None:
        self._scene = scene
        self._recorded = recorded

        def button(text: str, action: Action, said: Callable[[], str] | None = None, widest: str = "") -> TextButton:
            return action_button(text, action, do, is_on=lambda: is_on(action), said=said, widest=widest)

        def item(action: Action) -> Item:
            return Item(SAVES[action], lambda: do(action), f"{OF_ACTION[action].does} ({OF_ACTION[action].key_names})")

        self._title = Label(self._title_text, bold=True, scale=1.2)
        self._about = Label(self._about_text, self._whole_about, dim=True)
        self._is_on = is_on
        self._close = action_button("\N{MULTIPLICATION SIGN}", Action.ABOUT, do)
        self._buttons: list[Widget] = [
            button("Open\N{HORIZONTAL ELLIPSIS}", Action.PICK_SCENE),
            button("\N{SINGLE LEFT-POINTING ANGLE QUOTATION MARK}", Action.PREVIOUS_SCENE),
            button("\N{SINGLE RIGHT-POINTING ANGLE QUOTATION MARK}", Action.NEXT_SCENE),
        ]
        saves = [item(action) for action in SAVES]
        right = [
            Menu(lambda: "Save", "save or copy something", lambda: saves),
            button("", Action.RECORD, self._record_text, "Stop 88.8 s"),
            button("Help", Action.HELP),
            button("Panel", Action.COLUMN),
        ]
        self._row = WidgetRow(group, [self._title, *self._buttons], right, lambda: theme.ground)

    def _title_text(self) -> str:
        scene = self._scene()
        return scene.title or scene.name

    def _about_text(self) -> str:
        return self._scene().about

    def _whole_about(self) -> str:
        return "\n".join(wrapped(self._scene().about, ABOUT_LETTERS * 14, 14))

    def _record_text(self) -> str:
        recorded = self._recorded()
        return "Record" if recorded is None else f"Stop {recorded:.1f} s"

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

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw it."""
        self._row.draw(surface, self.placed(layout), layout.text_height)
