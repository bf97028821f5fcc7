"""The column's page of the balls: the selected ball or wall, to see and change."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from sandbox.errors import SandboxError, shown
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.state import Floats, State
from sandbox.view.editor import Editor
from sandbox.view.instruments import ROUNDING
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback
from sandbox.view.widgets import Widget, Words
from sandbox.view.widgets.fields import Field
from sandbox.view.widgets.group import rows_of

HINT: Final = "Click a ball or a wall to change it."
DECIMALS: Final = 3  # of numbers in px
IF_SET: Final = "the same in every engine if you set it"
FACTOR: Final = "its factor: a contact has the product of two"


class Value(NamedTuple):
    """A number of every ball: its dimension, what it is, and how it is read, (n,) px."""

    dimension: Dimension
    does: str
    of: Callable[[State, Scene], Floats]


OF_BALL: Final[Mapping[str, Value]] = {
    "x": Value(Dimension.LENGTH, f"position of its centre, to the right; {IF_SET}", lambda s, _: s.position[:, 0]),
    "y": Value(Dimension.LENGTH, f"position of its centre, downwards; {IF_SET}", lambda s, _: s.position[:, 1]),
    "vx": Value(Dimension.VELOCITY, f"velocity to the right; {IF_SET}", lambda s, _: s.velocity[:, 0]),
    "vy": Value(Dimension.VELOCITY, f"velocity downwards; {IF_SET}", lambda s, _: s.velocity[:, 1]),
    "spin": Value(Dimension.SPIN, f"angular velocity, clockwise; {IF_SET}", lambda s, _: s.spin),
    "mass": Value(Dimension.MASS, "mass; the motion depends on ratios only", lambda _, scene: scene.bodies.mass),
    "radius": Value(Dimension.LENGTH, "radius", lambda _, scene: scene.bodies.radius),
    "elasticity": Value(Dimension.NUMBER, FACTOR, lambda _, scene: scene.bodies.elasticity),
    "friction": Value(Dimension.NUMBER, FACTOR, lambda _, scene: scene.bodies.friction),
}
OF_WALL: Final = {  # its dimension, and what it is
    "thickness": (Dimension.LENGTH, "full thickness"),
    "elasticity": (Dimension.NUMBER, FACTOR),
    "friction": (Dimension.NUMBER, FACTOR),
}


class BallsPage:
    """Shows the selected ball, as it is in the pane where it was clicked, or the selected wall.

    Its numbers can be typed, in the scene's units; the run is paused meanwhile.
    """

    def __init__(self, playback: Playback, editor: Editor, notice: Notice) -> None:
        self._playback, self._editor, self._notice = playback, editor, notice
        self._heading, self._hint = Words(""), Words(HINT)
        self._dimensions: dict[Field, Dimension] = {}
        of_ball = [
            self._number(key, value.dimension, value.does, partial(self._of_ball, value))
            for key, value in OF_BALL.items()
        ]
        of_wall = [
            self._number(key, dimension, does, partial(self._of_wall, key))
            for key, (dimension, does) in OF_WALL.items()
        ]
        colour = self._field(
            "colour", self._colour, lambda text: editor.change(color=text), "a CSS colour name or #rrggbb"
        )
        self._ball_rows, self._wall_rows = rows_of([*of_ball, colour]), rows_of(of_wall)

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        for field, dimension in self._dimensions.items():
            field.unit = self._playback.scene.units.name(dimension)
        ball, wall = self._editor.selected, self._editor.selected_wall
        if ball is wall is None:
            return [[self._hint]]
        pane = self._playback.view.panes[self._editor.pane]
        self._heading.text = f"wall {wall}" if ball is None else f"ball {ball} in {pane.name}"
        return [[self._heading], *(self._wall_rows if ball is None else self._ball_rows)]

    def _of_ball(self, value: Value) -> float:
        view = self._playback.view
        values = value.of(view.panes[self._editor.pane].state, view.moment.scene)
        return float(values[self._editor.selected or 0])

    def _of_wall(self, key: str) -> float:
        return float(getattr(self._playback.scene.walls[self._editor.selected_wall or 0], key))

    def _colour(self) -> str:
        return self._playback.scene.colors[self._editor.selected or 0]

    def _field(self, name: str, value: Callable[[], str], choose: Callable[[str], None], does: str) -> Field:
        return Field(name, value, self._notice.reporting()(choose), does, begin=self._pause)

    def _pause(self) -> None:
        self._playback.paused = True

    def _number(self, key: str, dimension: Dimension, does: str, value: Callable[[], float]) -> Field:
        """Return a field of a number in the scene's units. value: returns it in px."""

        def text() -> str:
            units = self._playback.scene.units
            return _text(value(), units.factor(dimension), units.decimals(dimension, DECIMALS))

        def choose(typed: str) -> None:
            units = self._playback.scene.units
            factor = units.factor(dimension)
            try:
                number = float(typed) / factor
            except ValueError:
                raise SandboxError(f"{key} must be a number, got {shown(typed)}") from None
            try:
                self._editor.change(**{key: number})
            except SandboxError as error:
                scale = "" if factor == 1 else f" (1 {units.name(dimension)} is {1 / factor:g} {dimension.value})"
                raise SandboxError(f"{error}{scale}") from None

        field = self._field(key, text, choose, does)
        self._dimensions[field] = dimension
        return field


def _text(value: float, factor: float, decimals: int) -> str:
    """Return a number in px times a factor as it can be typed: with some decimals, or three digits if it is small."""
    if abs(value) < ROUNDING:
        return "0"
    number = float(f"{factor * value:.3g}") if abs(value) < 10**-DECIMALS else round(factor * value, decimals)
    return np.format_float_positional(number, trim="-")
