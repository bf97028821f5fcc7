"""The column's page of what is shown: layers over the panes, and how the window looks."""

from collections.abc import Callable, Sequence
from typing import Final

from sandbox.view.controls import CONTROLS, Action, Control, Group
from sandbox.view.header import OF_ACTION, tip_of
from sandbox.view.layers import Layer
from sandbox.view.widgets.buttons import TextButton
from sandbox.view.widgets.widget import Widget
from sandbox.view.widgets.words import Words

PER_ROW: Final = 2
NAMES: Final = {  # of layers, where their own names say too little
    Layer.VELOCITY: "velocities",
    Layer.CENTRE: "centre of mass",
    Layer.GHOSTS: "outlines of exact",
    Layer.CHARTS: "chart",
}
LOOKS: Final = {
    Action.PLAIN: "plain debug-draw",
    Action.THEME: "dark",
    Action.SMALLER_TEXT: "smaller text",
    Action.LARGER_TEXT: "larger text",
    Action.FULL_SCREEN: "full screen",
    Action.ABOUT: "what it is about",
}


class ShowPage:
    """Buttons for what can be shown and hidden. do: does what a control does; is_on: whether that is on."""

    def __init__(self, do: Callable[[Control], None], is_on: Callable[[Control], bool]) -> None:
        def button(control: Control, text: str) -> TextButton:
            tip = tip_of(control.action)
            return TextButton(text, lambda: do(control), tip, lambda: is_on(control))

        layers = [control for control in CONTROLS if control.group is Group.LAYERS]
        self._layers = [
            button(control, NAMES.get(control.action, str(control.action)))
            for control in layers
            if isinstance(control.action, Layer)
        ]
        self._looks = [button(OF_ACTION[action], text) for action, text in LOOKS.items()]
        self._headings = Words("In the panes", bold=True), Words("The window", bold=True)

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        panes, window = self._headings
        return [[panes], *_in_rows(self._layers), [window], *_in_rows(self._looks)]


def _in_rows(widgets: Sequence[Widget]) -> list[Sequence[Widget]]:
    return [widgets[k : k + PER_ROW] for k in range(0, len(widgets), PER_ROW)]
