"""The column's page of the scene: what it is about, gravity, elasticity, the rate and the seed."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from sandbox.scene.model import Scene
from sandbox.view.controls import Action
from sandbox.view.editor import Editor
from sandbox.view.header import tip_of
from sandbox.view.playback import Playback
from sandbox.view.snapshots import Snapshot, Snapshots
from sandbox.view.theme import theme
from sandbox.view.widgets.buttons import TextButton
from sandbox.view.widgets.slider import Slider
from sandbox.view.widgets.widget import Widget
from sandbox.view.widgets.words import Words

ELASTICITIES: Final = tuple(k / 20 for k in range(21))
GRAVITIES: Final = tuple(100.0 * k for k in range(-10, 21))  # px/s², downwards
PER_ROW: Final = 4  # snapshots
RATES: Final = (15, 30, 60, 120, 240, 480, 960, 1920, 3840)


class ScenePage:
    """Says what the scene is, changes what applies to all balls, and has the snapshots. do: does an action."""

    def __init__(self, playback: Playback, editor: Editor, snapshots: Snapshots, do: Callable[[Action], None]) -> None:
        self._playback = playback
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

        self._sliders = [
            slider("gravity", "gravity downwards, px/s²", GRAVITIES, editor.gravity, editor.set_gravity, " px/s²"),
            slider("elasticity", "elasticity of every pair", ELASTICITIES, editor.elasticity, editor.set_elasticity),
            slider("steps", "steps per second", RATES, editor.rate, editor.set_rate, " per second"),
        ]
        self._heater = [
            TextButton("Cool", lambda: do(Action.COOL), tip_of(Action.COOL)),
            TextButton("Heat", lambda: do(Action.HEAT), tip_of(Action.HEAT)),
        ]
        self._take = TextButton("Take a snapshot", lambda: do(Action.TAKE_SNAPSHOT), tip_of(Action.TAKE_SNAPSHOT))
        self._buttons = [
            TextButton("Restart", lambda: do(Action.RESTART), tip_of(Action.RESTART)),
            TextButton("Next seed", lambda: do(Action.NEXT_SEED), tip_of(Action.NEXT_SEED)),
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
        return [[self._take], *(buttons[k : k + PER_ROW] for k in range(0, len(buttons), PER_ROW))]

    def _return_button(self, snapshot: Snapshot) -> TextButton:
        text = f"{snapshot.time:.2f} s"
        return TextButton(text, partial(self._snapshots.return_to, snapshot), f"return to the snapshot at {text}")
