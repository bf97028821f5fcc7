"""The column's pages of the scene, and of what is shown."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from sandbox.scene.model import Scene
from sandbox.scene.units import PER_METRE, Dimension
from sandbox.view.controls import CONTROLS, Action, Control, Group
from sandbox.view.editor import Editor
from sandbox.view.header import OF_ACTION, action_button, tip_of
from sandbox.view.layers import Layer
from sandbox.view.playback import Playback, Snapshot, Snapshots
from sandbox.view.theme import theme
from sandbox.view.widgets.buttons import TextButton
from sandbox.view.widgets.fields import Slider
from sandbox.view.widgets.group import rows_of
from sandbox.view.widgets.widget import Widget
from sandbox.view.widgets.words import Words

ELASTICITIES: Final = tuple(k / 20 for k in range(21))
GRAVITIES: Final = tuple(range(-10, 21))  # m/s², downwards
PIXELS_PER_METRE: Final = 100.0  # of scenes that do not say it
RATES: Final = (15, 30, 60, 120, 240, 480, 960, 1920, 3840)
SNAPSHOTS_PER_ROW: Final = 4
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


class ScenePage:
    """Says what the scene is, changes what applies to all balls, and has the snapshots. do: does an action."""

    def __init__(self, playback: Playback, editor: Editor, snapshots: Snapshots, do: Callable[[Action], None]) -> None:
        self._playback = playback
        self._editor = editor
        self._snapshots = snapshots
        self._returns: list[tuple[Snapshot, TextButton]] = []
        self._title, self._about, self._facts = Words("", bold=True), Words(""), Words("")

        def slider(
            name: str,
            does: str,
            values: Sequence[float],
            value: Callable[[], float],
            choose: Callable[[float], None],
            unit: str = "",
        ) -> Slider:
            return Slider(name, does, values, value, choose, unit, at_once=False)

        def gravity() -> float:
            return editor.gravity() * self._scene.units.factor(Dimension.ACCELERATION)

        def set_gravity(value: float) -> None:
            editor.set_gravity(value / self._scene.units.factor(Dimension.ACCELERATION))

        self._gravity = slider("gravity", "", GRAVITIES, gravity, set_gravity)
        self._elasticity = slider(
            "elasticity", "elasticity of every pair", ELASTICITIES, editor.elasticity, editor.set_elasticity
        )
        self._sliders = [
            self._gravity,
            self._elasticity,
            slider("steps", "steps per second", RATES, editor.rate, editor.set_rate, " per second"),
        ]
        self._heater = [
            action_button("Cool", Action.COOL, do),
            action_button("Heat", Action.HEAT, do),
        ]
        self._take = action_button("Take a snapshot", Action.TAKE_SNAPSHOT, do)
        self._buttons = [
            action_button("Restart", Action.RESTART, do),
            action_button("Next seed", Action.NEXT_SEED, do),
        ]

    @property
    def _scene(self) -> Scene:
        return self._playback.view.moment.scene

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        scene = self._scene
        self._title.text, self._about.text = scene.title or scene.name, scene.about
        balls = len(scene.bodies)
        self._facts.text = f"{balls:,} ball{'s' * (balls != 1)}, seed {scene.seed}"
        self._facts.colour = theme.dim
        unit = scene.units.name(Dimension.ACCELERATION)
        self._gravity.does, self._gravity.unit = f"gravity downwards, {unit}", f" {unit}"
        self._gravity.values = [PER_METRE.get(scene.units.length, PIXELS_PER_METRE) * value for value in GRAVITIES]
        self._elasticity.unit = "" if self._editor.has_one_elasticity else " between balls"
        about = [[self._about]] if scene.about else []
        return [
            [self._title],
            *about,
            [self._facts],
            *([each] for each in self._sliders),
            self._heater,
            self._buttons,
            *self._snapshot_rows(),
        ]

    def _snapshot_rows(self) -> list[Sequence[Widget]]:
        """Return the button that takes a snapshot, and one for each that returns to it."""
        taken = self._snapshots.taken
        if [snapshot for snapshot, _ in self._returns] != taken:
            self._returns = [(snapshot, self._return_button(snapshot)) for snapshot in taken]
        buttons = [button for _, button in self._returns]
        return [[self._take], *rows_of(buttons, SNAPSHOTS_PER_ROW)]

    def _return_button(self, snapshot: Snapshot) -> TextButton:
        text = f"{snapshot.time:.2f} s"
        return TextButton(text, partial(self._snapshots.return_to, snapshot), f"return to the snapshot at {text}")


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
        return [[panes], *rows_of(self._layers), [window], *rows_of(self._looks)]
