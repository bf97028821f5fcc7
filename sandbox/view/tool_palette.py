"""The palette below the panes: what the mouse does, undo and redo, and how large the panes show the scene."""

from collections.abc import Callable
from functools import partial

from pygame import Surface

from sandbox.view.controls import Action
from sandbox.view.header import tip_of
from sandbox.view.layout import Layout
from sandbox.view.mouse_tool import MouseTool
from sandbox.view.move_tool import DOES, Tool
from sandbox.view.theme import theme
from sandbox.view.widgets.buttons import TextButton
from sandbox.view.widgets.group import Placed, WidgetGroup
from sandbox.view.widgets.row import WidgetRow
from sandbox.view.widgets.words import Label


class ToolPalette:
    """A row of tools. do: does an action."""

    def __init__(self, group: WidgetGroup, mouse: MouseTool, do: Callable[[Action], None]) -> None:
        def button(text: str, action: Action) -> TextButton:
            return TextButton(text, lambda: do(action), tip_of(action))

        def tool(which: Tool) -> TextButton:
            does = f"{DOES[which][0].upper()}{DOES[which][1:]}  (F: next tool)"
            return TextButton(which.value, partial(mouse.choose, which), does, lambda: mouse.tool is which)

        zoom = Label(lambda: f"{100 * mouse.lens.zoom:.0f} %", dim=True, widest="5000 %")
        tools = [*map(tool, Tool), button("Undo", Action.UNDO), button("Redo", Action.REDO)]
        zooms = [
            zoom,
            button("\N{MINUS SIGN}", Action.ZOOM_OUT),
            button("Fit", Action.SHOW_ALL),
            button("+", Action.ZOOM_IN),
        ]
        self._row = WidgetRow(group, tools, zooms, lambda: theme.ground)

    def widths(self, text_height: int) -> tuple[int, ...]:
        """Return the widths of its widgets, px."""
        return self._row.widths(text_height)

    def placed(self, layout: Layout) -> list[Placed]:
        """Return its widgets with their places."""
        return self._row.placed(layout.palette, layout.text_height, layout.side)

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw it."""
        self._row.draw(surface, self.placed(layout), layout.text_height)
