"""What the toolbar has: a button for each control with an icon, and sliders."""

from collections.abc import Callable
from functools import partial
from typing import Final

from sandbox.view.controls import CONTROLS, Control, Group
from sandbox.view.editor import ANOTHER_ELASTICITY, ANOTHER_GRAVITY, Editor
from sandbox.view.playback import SPEEDS, Playback
from sandbox.view.widgets.button import Button
from sandbox.view.widgets.slider import Slider
from sandbox.view.widgets.widget import Widget

ELASTICITIES: Final = tuple(k / 20 for k in range(21))
GRAVITIES: Final = tuple(100.0 * k for k in range(-10, 21))  # px/s², downwards
RATES: Final = (15, 30, 60, 120, 240, 480, 960, 1920, 3840)
REMEDY: Final = "Click, or press I, to replace article by impulse."


def tools(
    playback: Playback,
    editor: Editor,
    do: Callable[[Control], None],
    is_on: Callable[[Control], bool],
    use_impulse: Callable[[], None],
) -> dict[Group, list[Widget]]:
    """Return the toolbar's widgets, by group: buttons, then sliders.

    do, is_on: of a control; use_impulse: lets impulse run in place of article, which refuses some edits.
    """
    found: dict[Group, list[Widget]] = {group: [] for group in Group}
    for control in CONTROLS:
        if control.icon:
            found[control.group].append(Button(control, do, is_on))
    found[Group.TIME].append(
        Slider("speed", "how fast time passes", SPEEDS, lambda: playback.speed, playback.set_speed, " x")
    )
    edit = partial(Slider, at_once=False, remedy=use_impulse, remedy_tip=REMEDY)
    found[Group.EDIT] += [
        edit(
            "elasticity",
            "elasticity of every pair",
            ELASTICITIES,
            editor.elasticity,
            editor.set_elasticity,
            refusal=partial(editor.refusal, ANOTHER_ELASTICITY),
        ),
        edit(
            "gravity",
            "gravity downwards, px/s²",
            GRAVITIES,
            editor.gravity,
            editor.set_gravity,
            refusal=partial(editor.refusal, ANOTHER_GRAVITY),
        ),
        edit("rate", "steps per second", RATES, editor.rate, editor.set_rate),
    ]
    return found
