"""The column's page of the balls: the selected one, and a table of all in one engine."""

from collections.abc import Mapping, Sequence
from functools import partial

from sandbox.scene.model import Scene
from sandbox.state import State
from sandbox.view.editor import Editor
from sandbox.view.inspector import Inspector
from sandbox.view.mouse_tool import MouseTool
from sandbox.view.notice import Notice
from sandbox.view.palette import chart_palette
from sandbox.view.playback import Playback
from sandbox.view.widgets.ball_table import BODY, MOTION, BallTable, Values
from sandbox.view.widgets.buttons import TextButton
from sandbox.view.widgets.widget import Widget


class BallsPage:
    """Shows the selected ball or wall over a table of all balls, in the engine that is chosen."""

    def __init__(self, playback: Playback, editor: Editor, mouse: MouseTool, notice: Notice) -> None:
        self._playback = playback
        self._editor = editor
        self._inspector = Inspector(playback, editor, mouse, notice)
        self._table = BallTable(self._shown, self._columns, lambda: editor.selected, self._select)
        self._engines: dict[str, TextButton] = {}
        self._has_motion = True
        self._kinds = [
            TextButton("motion", partial(self._show, motion=True), "position and velocity", lambda: self._has_motion),
            TextButton("body", partial(self._show, motion=False), "mass, radius, momentum (kg px/s), kinetic energy "
                       "(kg px²/s²) and spin (rad/s)", lambda: not self._has_motion),
        ]  # fmt: skip

    def _show(self, *, motion: bool) -> None:
        self._has_motion = motion

    def _columns(self) -> Mapping[str, Values]:
        return MOTION if self._has_motion else BODY

    def _shown(self) -> tuple[State, Scene, int]:
        view = self._playback.view
        return view.panes[self._editor.pane].state, view.moment.scene, view.moment.step

    def _select(self, ball: int) -> None:
        self._editor.select(ball, self._editor.pane)

    def _choose(self, pane: int) -> None:
        self._editor.show_in(pane)

    def _is_chosen(self, pane: int) -> bool:
        return self._editor.pane == pane

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        names = [pane.name for pane in self._playback.view.panes]
        colours = chart_palette().engines([*names, self._playback.session.reference])
        buttons = []
        for pane, name in enumerate(names):
            button = self._engines.setdefault(
                f"{pane} {name}",
                TextButton(name, partial(self._choose, pane), f"the balls in {name}", partial(self._is_chosen, pane)),
            )
            button.colour = colours[name]
            buttons.append(button)
        return [*self._inspector.rows(), buttons, self._kinds, [self._table]]
