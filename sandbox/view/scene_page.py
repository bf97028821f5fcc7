"""The column's page of the scene: what it is about, gravity, elasticity, the rate and the seed."""

from collections.abc import Callable, Sequence
from typing import Final

from sandbox.scene.model import Scene
from sandbox.view.controls import Action
from sandbox.view.editor import Editor
from sandbox.view.header import tip_of
from sandbox.view.playback import Playback
from sandbox.view.theme import theme
from sandbox.view.widgets.buttons import TextButton
from sandbox.view.widgets.slider import Slider
from sandbox.view.widgets.widget import Widget
from sandbox.view.widgets.words import Words

ELASTICITIES: Final = tuple(k / 20 for k in range(21))
GRAVITIES: Final = tuple(100.0 * k for k in range(-10, 21))  # px/s², downwards
RATES: Final = (15, 30, 60, 120, 240, 480, 960, 1920, 3840)


class ScenePage:
    """Says what the scene is, and changes what applies to all balls. do: does an action."""

    def __init__(self, playback: Playback, editor: Editor, do: Callable[[Action], None]) -> None:
        self._playback = playback
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
        return [[self._title], *about, [self._facts], *([each] for each in self._sliders), self._buttons]
