"""The column's pages of the scene, and of what is shown."""

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Final

from sandbox.scene.model import Scene
from sandbox.scene.units import PER_METRE, Dimension
from sandbox.view.controls import OF_ACTION, Action, tip_of
from sandbox.view.editor import Editor
from sandbox.view.header import action_button
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
        self._title, self._about, self._facts = Words("", bold=True), Words(""), Words("")

        def gravity() -> float:
            return editor.gravity() * self._scene.units.factor(Dimension.ACCELERATION)

        def set_gravity(value: float) -> None:
            editor.set_gravity(value / self._scene.units.factor(Dimension.ACCELERATION))

        self._gravity = Slider("gravity", GRAVITIES, gravity, set_gravity)
        self._elasticity = Slider(
            "elasticity", ELASTICITIES, editor.elasticity, editor.set_elasticity, "elasticity of every pair"
        )
        self._steps = Slider("steps", RATES, editor.rate, editor.set_rate, "steps per second", " per second")
        self._heater = [action_button("Cool", Action.COOL, do), action_button("Heat", Action.HEAT, do)]
        self._buttons = [action_button("Restart", Action.RESTART, do), action_button("Next seed", Action.NEXT_SEED, do)]
        self._take = action_button("Take a snapshot", Action.TAKE_SNAPSHOT, do)
        self._return_button = cache(self._make_return_button)

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
        returns = [self._return_button(snapshot) for snapshot in self._snapshots.taken]
        return [
            [self._title],
            *([[self._about]] if scene.about else []),
            [self._facts],
            [self._gravity],
            [self._elasticity],
            [self._steps],
            self._heater,
            self._buttons,
            [self._take],
            *rows_of(returns, SNAPSHOTS_PER_ROW),
        ]

    def _make_return_button(self, snapshot: Snapshot) -> TextButton:
        text = f"{snapshot.time:.2f} s"
        return TextButton(text, partial(self._snapshots.return_to, snapshot), f"return to the snapshot at {text}")


class ShowPage:
    """Buttons for what can be shown and hidden. do: does an action, or shows or hides a layer; is_on: its state."""

    def __init__(self, do: Callable[[Action | Layer], None], is_on: Callable[[Action | Layer], bool]) -> None:
        def button(action: Action | Layer, text: str) -> TextButton:
            return TextButton(text, partial(do, action), tip_of(action), partial(is_on, action))

        self._layers = [button(layer, NAMES.get(layer, layer)) for layer in OF_ACTION if isinstance(layer, Layer)]
        self._looks = [button(action, text) for action, text in LOOKS.items()]
        self._headings = Words("In the panes", bold=True), Words("The window", bold=True)

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        panes, window = self._headings
        return [[panes], *rows_of(self._layers), [window], *rows_of(self._looks)]
