"""The column's page of the balls: the selected ball or wall, to see and change, and a table of all balls."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Final, NamedTuple

import numpy as np
from pygame import Color, Rect, Surface

from sandbox.errors import SandboxError, shown
from sandbox.quantity import kinetic_energies, length
from sandbox.report.numbers import readable
from sandbox.scene.fields import PALETTE, rgb
from sandbox.scene.model import Scene, Wall
from sandbox.scene.units import Dimension, Units
from sandbox.state import Floats, State
from sandbox.view.editor import Editor
from sandbox.view.instruments import ROUNDING
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback
from sandbox.view.primitives import dot, fitting, shortened, text_width, write
from sandbox.view.theme import theme
from sandbox.view.widgets import TextButton, Widget, Words
from sandbox.view.widgets.fields import Field
from sandbox.view.widgets.group import rows_of

CELL_HEIGHT: Final = 1.5  # in heights of the text
NUMBER: Final = 3.2  # width of the column of numbers, likewise
MAX_BALLS: Final = 2_000  # in the table
HINT: Final = "Click a ball, or a row of the table, to change it; a wall, while the run is paused."
DECIMALS: Final = 3  # of numbers in px
IF_SET: Final = "the same in every engine if you set it"
END: Final = "position of this end"
FACTOR: Final = "its factor: a contact has the product of two"


class Value(NamedTuple):
    """A number of every ball: its dimension, how it is read, (n,) px, and what it is, if it can be set."""

    dimension: Dimension
    of: Callable[[State, Scene], Floats]
    does: str = ""


VALUES: Final[Mapping[str, Value]] = {
    "x": Value(Dimension.LENGTH, lambda s, _: s.position[:, 0], f"position of its centre, to the right; {IF_SET}"),
    "y": Value(Dimension.LENGTH, lambda s, _: s.position[:, 1], f"position of its centre, downwards; {IF_SET}"),
    "vx": Value(Dimension.VELOCITY, lambda s, _: s.velocity[:, 0], f"velocity to the right; {IF_SET}"),
    "vy": Value(Dimension.VELOCITY, lambda s, _: s.velocity[:, 1], f"velocity downwards; {IF_SET}"),
    "speed": Value(Dimension.VELOCITY, lambda s, _: length(s.velocity)),
    "mass": Value(Dimension.MASS, lambda _, scene: scene.bodies.mass, "mass; only ratios matter"),
    "radius": Value(Dimension.LENGTH, lambda _, scene: scene.bodies.radius, "radius"),
    "momentum": Value(Dimension.MOMENTUM, lambda s, scene: length(s.velocity) * scene.bodies.mass),
    "energy": Value(
        Dimension.ENERGY, lambda s, scene: kinetic_energies(s.velocity, s.spin, scene.bodies.mass, scene.bodies.moment)
    ),
    "spin": Value(Dimension.SPIN, lambda s, _: s.spin, f"angular velocity, clockwise; {IF_SET}"),
    "elasticity": Value(Dimension.NUMBER, lambda _, scene: scene.bodies.elasticity, FACTOR),
    "friction": Value(Dimension.NUMBER, lambda _, scene: scene.bodies.friction, FACTOR),
}
COLUMNS: Final = dict(list(VALUES.items())[:10])  # of the table, as many on each of the two lines of a row
PER_LINE: Final = len(COLUMNS) // 2
OF_BALL: Final = ("x", "y", "vx", "vy", "spin", "mass", "radius", "elasticity", "friction")
OF_WALL: Final[Mapping[str, tuple[str, int, str]]] = {  # the wall's value, the axis if it is an end, what it is
    "from x": ("start", 0, END),
    "from y": ("start", 1, END),
    "to x": ("to", 0, END),
    "to y": ("to", 1, END),
    "thickness": ("thickness", 0, "full thickness"),
    "elasticity": ("elasticity", 0, FACTOR),
    "friction": ("friction", 0, FACTOR),
}


@dataclass(eq=False)
class BallTable(Widget):
    """Rows of balls under the names of columns: a press on a row selects its ball.

    shown: returns the state of an engine, and the scene.
    """

    shown: Callable[[], tuple[State, Scene]]
    selected: Callable[[], int | None]
    select: Callable[[int], None]

    _row = 1  # px, height

    def _rows(self) -> int:
        return min(MAX_BALLS, len(self.shown()[0].position))

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its rows, px."""
        return 2 * round(CELL_HEIGHT * text_height) * (1 + self._rows())

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the rows that are in the clipped part of the surface."""
        (state, scene), line = self.shown(), round(CELL_HEIGHT * text_height)
        units, first, small = scene.units, round(NUMBER * text_height), round(0.9 * text_height)
        width, self._row = (place.width - first) // PER_LINE, 2 * line
        cells = [
            Rect(place.x + first + k % PER_LINE * width, place.y + k // PER_LINE * line, width, line)
            for k in range(len(COLUMNS))
        ]
        values = np.column_stack([column.of(state, scene) for column in COLUMNS.values()])
        for cell, (name, column) in zip(cells, COLUMNS.items(), strict=True):
            heading = f"{name}, {units.name(column.dimension)}"
            _right(surface, heading if text_width(heading, small) < width - 4 else name, cell, theme.dim, small)
        clip = surface.get_clip()
        for ball in range(max(0, (clip.y - place.y) // self._row - 1), self._rows()):
            row = Rect(place.x, place.y + (ball + 1) * self._row, place.width, self._row)
            if row.y > clip.bottom:
                break
            if ball == self.selected():
                surface.fill(theme.hover, row)
            surface.fill(theme.line, (row.x, row.y, row.width, 1))
            dot(surface, rgb(scene.colors[ball]), theme.dim, (row.x + small // 2, row.centery), small // 3)
            write(surface, str(ball), Rect(row.x + small, row.y, first, row.height), theme.ink, small)
            for cell, value, column in zip(cells, values[ball], COLUMNS.values(), strict=True):
                text = _cell_text(value, column.dimension, units)
                _right(surface, text, cell.move(0, row.y - place.y), theme.ink, small)

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Select the ball of the row."""
        ball = (point[1] - place.y) // self._row - 1
        if 0 <= ball < self._rows():
            self.select(ball)


def _cell_text(value: float, dimension: Dimension, units: Units) -> str:
    """Return a value in px as it is shown."""
    shown, decimals = units.factor(dimension) * value, units.decimals(dimension, 1)
    if abs(value) < 0.05:
        return "0" if abs(value) < 5e-4 else readable(f"{shown:.1g}")
    return f"{shown:,.{decimals}f}" if abs(value) < 1e5 else readable(f"{shown:,.3g}")


def _right(surface: Surface, text: str, cell: Rect, colour: Color, height: int) -> None:
    """Write a text at the right of a cell, smaller if need be, and then only its start."""
    height = fitting(text_width(text, height), cell.width - 4, height)
    text = shortened(text, cell.width - 4, height)
    x = max(cell.x, cell.right - text_width(text, height))
    write(surface, text, Rect(x, cell.y, cell.right - x, cell.height), colour, height)


class BallsPage:
    """Shows the selected ball, as it is in the pane where it was clicked, or the selected wall, and all balls.

    Numbers of what is selected can be typed, in the scene's units; the run is paused meanwhile.
    """

    def __init__(self, playback: Playback, editor: Editor, notice: Notice) -> None:
        self._playback, self._editor, self._notice = playback, editor, notice
        self._table = BallTable(self._shown, lambda: editor.selected, lambda ball: editor.select(ball, editor.pane))
        self._engine = cache(self._make_engine)
        self._heading, self._hint = Words("", width=2.0), Words(HINT)
        self._delete = TextButton("Delete", editor.delete, "delete it", width=1.0)
        self._dimensions: dict[Field, Dimension] = {}
        of_ball = [self._number(key, VALUES[key].dimension, VALUES[key].does) for key in OF_BALL]
        of_wall = [
            self._number(key, VALUES[key].dimension if key in VALUES else Dimension.LENGTH, does)
            for key, (*_, does) in OF_WALL.items()
        ]
        colour = self._field(
            "colour", self._colour, lambda text: editor.change(color=text), "a CSS colour name or #rrggbb"
        )
        swatches = [
            TextButton("", partial(colour.choose, name), name, partial(self._has_colour, name), colour=Color(name))
            for name in PALETTE
        ]
        self._of_ball, self._of_wall = [*rows_of([*of_ball, colour]), swatches], rows_of(of_wall)

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        names = [pane.name for pane in self._playback.view.panes]
        engines = [self._engine(pane, name) for pane, name in enumerate(names)]
        for button in engines:
            button.colour = self._playback.view.charts.colours[button.text]
        for field, dimension in self._dimensions.items():
            field.unit = self._playback.scene.units.name(dimension)
        ball, wall = self._editor.selected, self._editor.selected_wall
        self._heading.text = f"wall {wall}" if ball is None else f"ball {ball} in {names[self._editor.pane]}"
        rows: list[Sequence[Widget]] = [[self._heading, self._delete]]
        rows += self._of_wall if ball is None else self._of_ball
        return [*([[self._hint]] if ball is wall is None else rows), engines, [self._table]]

    def _shown(self) -> tuple[State, Scene]:
        view = self._playback.view
        return view.panes[self._editor.pane].state, view.moment.scene

    def _make_engine(self, pane: int, name: str) -> TextButton:
        editor = self._editor
        return TextButton(name, partial(editor.show_in, pane), f"the balls in {name}", lambda: editor.pane == pane)

    def _field(self, name: str, value: Callable[[], str], choose: Callable[[str], None], does: str) -> Field:
        return Field(name, value, self._notice.reporting()(choose), does, begin=self._pause)

    def _pause(self) -> None:
        self._playback.paused = True

    def _number(self, key: str, dimension: Dimension, does: str) -> Field:
        """Return a field of a number in the scene's units."""

        def text() -> str:
            units = self._playback.scene.units
            return _text(self._value(key), units.factor(dimension), units.decimals(dimension, DECIMALS))

        def choose(typed: str) -> None:
            units = self._playback.scene.units
            factor = units.factor(dimension)
            try:
                number = float(typed) / factor
            except ValueError:
                raise SandboxError(f"{key} must be a number, got {shown(typed)}") from None
            try:
                self._change(key, number)
            except SandboxError as error:
                scale = "" if factor == 1 else f" (1 {units.name(dimension)} is {1 / factor:g} {dimension.value})"
                raise SandboxError(f"{error}{scale}") from None

        field = self._field(key, text, choose, does)
        self._dimensions[field] = dimension
        return field

    @property
    def _wall(self) -> Wall:
        return self._playback.scene.walls[self._editor.selected_wall or 0]

    def _value(self, key: str) -> float:
        """Return a number of what is selected, px."""
        if (ball := self._editor.selected) is not None:
            return float(VALUES[key].of(*self._shown())[ball])
        name, axis, _ = OF_WALL[key]
        return float(np.ravel(getattr(self._wall, name))[axis])

    def _change(self, key: str, number: float) -> None:
        """Change a number of what is selected, px. Raises SandboxError."""
        name, axis, _ = OF_WALL.get(key, (key, 0, ""))
        value = (
            number
            if name == key
            else tuple(number if k == axis else at for k, at in enumerate(getattr(self._wall, name)))
        )
        self._editor.change(**{name: value})

    def _colour(self) -> str:
        return self._playback.scene.colors[self._editor.selected or 0]

    def _has_colour(self, name: str) -> bool:
        return self._colour() == name


def _text(value: float, factor: float, decimals: int) -> str:
    """Return a number in px times a factor as it can be typed: with some decimals, or three digits if it is small."""
    if abs(value) < ROUNDING:
        return "0"
    number = float(f"{factor * value:.3g}") if abs(value) < 10**-DECIMALS else round(factor * value, decimals)
    return np.format_float_positional(number, trim="-")
