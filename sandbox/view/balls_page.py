"""The column's page of the balls: the selected ball or wall, to see and change, and a table of all balls."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Final, NamedTuple

import numpy as np
from pygame import Color, Rect, Surface

from sandbox.errors import SandboxError, shown
from sandbox.quantity import kinetic_energies, length
from sandbox.scene.fields import PALETTE, rgb
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension, Units
from sandbox.state import Floats, State
from sandbox.view.editor import Editor
from sandbox.view.instruments import ROUNDING
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback
from sandbox.view.primitives import dot, fitting, shortened, text_width, write
from sandbox.view.theme import chart_palette, theme
from sandbox.view.widgets import Widget, Words
from sandbox.view.widgets.buttons import TextButton
from sandbox.view.widgets.fields import Field
from sandbox.view.widgets.group import rows_of

CELL_HEIGHT: Final = 1.5  # in heights of the text
NUMBER: Final = 3.2  # width of the column of numbers, likewise
MAX_BALLS: Final = 2_000  # in the table
Values = Callable[[State, Scene], Floats]
HINT: Final = "Click a ball, or a row of the table, to change it; a wall, while the run is paused."
DECIMALS: Final = 3  # of numbers in px


class Column(NamedTuple):
    """A column: its values in px, and their dimension."""

    values: Values
    dimension: Dimension


COLUMNS: Final[Mapping[str, Column]] = {  # as many on each of the two lines of a row
    "x": Column(lambda state, _: state.position[:, 0], Dimension.LENGTH),
    "y": Column(lambda state, _: state.position[:, 1], Dimension.LENGTH),
    "vx": Column(lambda state, _: state.velocity[:, 0], Dimension.VELOCITY),
    "vy": Column(lambda state, _: state.velocity[:, 1], Dimension.VELOCITY),
    "speed": Column(lambda state, _: length(state.velocity), Dimension.VELOCITY),
    "mass": Column(lambda _, scene: scene.bodies.mass, Dimension.MASS),
    "radius": Column(lambda _, scene: scene.bodies.radius, Dimension.LENGTH),
    "momentum": Column(lambda state, scene: length(state.velocity) * scene.bodies.mass, Dimension.MOMENTUM),
    "energy": Column(
        lambda state, scene: kinetic_energies(state.velocity, state.spin, scene.bodies.mass, scene.bodies.moment),
        Dimension.ENERGY,
    ),
    "spin": Column(lambda state, _: state.spin, Dimension.SPIN),
}
PER_LINE: Final = len(COLUMNS) // 2


@dataclass(eq=False)
class BallTable(Widget):
    """Rows of balls under the names of columns: a press on a name sorts by it, one on a row selects the ball.

    shown: returns the state, the scene and the step in an engine.
    """

    shown: Callable[[], tuple[State, Scene, int]]
    selected: Callable[[], int | None]
    select: Callable[[int], None]
    sorted_by: str = ""  # a column, or nothing: by number
    falling: bool = False  # from the largest

    takes_keys = False
    _line = _text_height = 1  # px

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its rows, px."""
        return 2 * round(CELL_HEIGHT * text_height) * (1 + min(MAX_BALLS, len(self.shown()[0].position)))

    @property
    def order(self) -> Sequence[int]:
        """The balls in the order of the rows."""
        state, scene, _ = self.shown()
        if not self.sorted_by:
            return range(len(state.position))
        values = COLUMNS[self.sorted_by].values(state, scene)
        order: list[int] = np.argsort(-values if self.falling else values, kind="stable").tolist()
        return order

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the rows that are in the clipped part of the surface."""
        state, scene, _ = self.shown()
        self._line, self._text_height = round(CELL_HEIGHT * text_height), text_height
        units, first, small = scene.units, round(NUMBER * text_height), round(0.9 * text_height)
        width, tall = (place.width - first) // PER_LINE, 2 * self._line
        cells = [
            Rect(place.x + first + k % PER_LINE * width, place.y + k // PER_LINE * self._line, width, self._line)
            for k in range(len(COLUMNS))
        ]
        values = np.column_stack([column.values(state, scene) for column in COLUMNS.values()])
        for cell, (name, column) in zip(cells, COLUMNS.items(), strict=True):
            is_sorted = name == self.sorted_by
            heading = f"{name}, {units.name(column.dimension)}"
            room = width - 4
            heading = heading if text_width(heading, small, bold=is_sorted) < room else name
            height = fitting(text_width(heading, small, bold=is_sorted), room, small)
            _right(surface, shortened(heading, room, height), cell, height, bold=is_sorted)
        clip, chosen, order = surface.get_clip(), self.selected(), self.order
        top = max(0, (clip.y - place.y) // tall - 1)
        for row in range(top, min(len(order), MAX_BALLS)):
            line = Rect(place.x, place.y + (row + 1) * tall, place.width, tall)
            if line.y > clip.bottom:
                break
            ball = order[row]
            if ball == chosen:
                surface.fill(theme.hover, line)
            surface.fill(theme.line, (line.x, line.y, line.width, 1))
            dot(surface, rgb(scene.colors[ball]), theme.dim, (line.x + small // 2, line.centery), small // 3)
            write(surface, str(ball), Rect(line.x + small, line.y, first, line.height), theme.ink, small)
            for cell, value, column in zip(cells, values[ball], COLUMNS.values(), strict=True):
                text = _cell_text(value, column.dimension, units)
                _right(surface, text, cell.move(0, line.y - place.y), small, ink=True)

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Sort by the column whose name is pressed, or select the ball of the row."""
        line, first = (point[1] - place.y) // self._line, round(NUMBER * self._text_height)
        if line >= 2:
            for ball in self.order[line // 2 - 1 : line // 2]:
                self.select(ball)
            return
        column = (point[0] - place.x - first) // max(1, (place.width - first) // PER_LINE)
        name = list(COLUMNS)[PER_LINE * line + min(column, PER_LINE - 1)] if column >= 0 else ""
        self.falling = name != self.sorted_by or not self.falling  # the largest first, then the smallest
        self.sorted_by = name


def _cell_text(value: float, dimension: Dimension, units: Units) -> str:
    """Return a value in px as it is shown."""
    shown, decimals = units.factor(dimension) * value, units.decimals(dimension, 1)
    if abs(value) < 0.05:
        return "0" if abs(value) < 5e-4 else f"{shown:.1g}"
    return f"{shown:,.{decimals}f}" if abs(value) < 1e5 else f"{shown:.3g}"


def _right(surface: Surface, text: str, cell: Rect, height: int, *, ink: bool = False, bold: bool = False) -> None:
    """Write a text at the right of a cell."""
    x = max(cell.x, cell.right - text_width(text, height, bold=bold))
    place = Rect(x, cell.y, cell.right - x, cell.height)
    write(surface, text, place, theme.ink if ink else theme.dim, height, bold=bold)


IF_SET: Final = "the same in every engine if you set it"
DOES: Final = {
    "x": f"position of its centre, to the right; {IF_SET}",
    "y": f"position of its centre, downwards; {IF_SET}",
    "vx": f"velocity to the right; {IF_SET}",
    "vy": f"velocity downwards; {IF_SET}",
    "spin": f"angular velocity, clockwise; {IF_SET}",
    "radius": "radius",
    "mass": "mass; only ratios matter",
    "elasticity": "its factor: a contact has the product of two",
    "friction": "its factor: a contact has the product of two",
    "thickness": "full thickness",
}
ENDS: Final = {  # of a wall: the end and the axis of each number
    "from x": ("start", 0),
    "from y": ("start", 1),
    "to x": ("to", 0),
    "to y": ("to", 1),
}
BALL_KEYS: Final = ("x", "y", "vx", "vy", "spin", "mass", "radius", "elasticity", "friction")
WALL_KEYS: Final = (*ENDS, "thickness", "elasticity", "friction")
DIMENSIONS: Final = dict.fromkeys(WALL_KEYS[:5], Dimension.LENGTH) | {
    key: column.dimension for key, column in COLUMNS.items()
}


class Inspector:
    """Shows the selected ball, as it is in the pane where it was clicked, or the selected wall, and changes it.

    The run is paused while its fields are typed into.
    """

    def __init__(self, playback: Playback, editor: Editor, notice: Notice) -> None:
        self._playback = playback
        self._editor = editor
        self._notice = notice
        self._heading, self._hint = Words("", width=2.0), Words(HINT)
        self._delete = TextButton("Delete", lambda: editor.delete(None), "delete it", width=1.0)
        self._fields = {key: self._number_field(key) for key in dict.fromkeys((*BALL_KEYS, *WALL_KEYS))}
        colour = self._field(
            "colour", self._colour, lambda text: editor.change(color=text), "a CSS colour name or #rrggbb"
        )
        swatches = [
            TextButton("", partial(colour.choose, name), name, partial(self._has_colour, name), colour=Color(name))
            for name in PALETTE
        ]
        self._of_ball = [*rows_of([*(self._fields[key] for key in BALL_KEYS), colour]), swatches]
        self._of_wall = rows_of([self._fields[key] for key in WALL_KEYS])

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return what is selected."""
        ball, wall = self._editor.selected, self._editor.selected_wall
        for key, field in self._fields.items():
            field.unit = self._playback.scene.units.name(DIMENSIONS.get(key, Dimension.NUMBER))
        if ball is None and wall is None:
            return [[self._hint]]
        self._heading.text = f"wall {wall}"
        if ball is not None:
            self._heading.text = f"ball {ball} in {self._playback.view.panes[self._editor.pane].name}"
        return [[self._heading, self._delete], *(self._of_wall if ball is None else self._of_ball)]

    def _field(self, name: str, value: Callable[[], str], choose: Callable[[str], None], does: str) -> Field:
        def choose_or_say(text: str) -> None:
            with self._notice.reporting():
                choose(text)

        return Field(name, value, choose_or_say, does, begin=self._pause)

    def _pause(self) -> None:
        self._playback.paused = True

    def _number_field(self, key: str) -> Field:
        """Return a field of a number in the scene's units."""
        dimension = DIMENSIONS.get(key, Dimension.NUMBER)

        def text() -> str:
            units = self._playback.scene.units
            return _text(self._value(key), units.factor(dimension), units.decimals(dimension, DECIMALS))

        def choose(typed: str) -> None:
            units = self._playback.scene.units
            number = _number(key, typed) / units.factor(dimension)
            try:
                self._change(key, number)
            except SandboxError as error:
                raise SandboxError(units.in_message(dimension, str(error))) from None

        return self._field(key, text, choose, DOES.get(key, "position of this end"))

    def _value(self, key: str) -> float:
        """Return a value of what is selected, px."""
        view, scene, ball = self._playback.view, self._playback.scene, self._editor.selected
        if ball is None:
            wall = scene.walls[self._editor.selected_wall or 0]
            end, axis = ENDS.get(key, (key, 0))
            return float(getattr(wall, end)[axis] if key in ENDS else getattr(wall, key))
        if key in COLUMNS:
            return float(COLUMNS[key].values(view.panes[self._editor.pane].state, scene)[ball])
        return float(getattr(scene.bodies, key)[ball])

    def _change(self, key: str, number: float) -> None:
        """Change a value of what is selected, px. Raises SandboxError."""
        if key not in ENDS:
            self._editor.change(**{key: number})
        elif (wall := self._editor.selected_wall) is not None:
            end, axis = ENDS[key]
            point = [*getattr(self._playback.scene.walls[wall], end)]
            point[axis] = number
            self._editor.change(**{end: tuple(point)})

    def _colour(self) -> str:
        return self._playback.scene.colors[self._editor.selected or 0]

    def _has_colour(self, name: str) -> bool:
        return self._colour() == name


def _text(value: float, factor: float, decimals: int) -> str:
    """Return a number in px times a factor as it is shown: with some decimals, or a power of ten if it is small."""
    if abs(value) < ROUNDING:
        return "0"
    return f"{factor * value:.3g}" if abs(value) < 10**-DECIMALS else f"{round(factor * value, decimals):.7g}"


def _number(name: str, text: str) -> float:
    """Return the number in a text. Raises SandboxError if the text is not a number."""
    try:
        return float(text)
    except ValueError:
        raise SandboxError(f"{name} must be a number, got {shown(text)}") from None


class BallsPage:
    """Shows the selected ball or wall over a table of all balls, in the engine that is chosen."""

    def __init__(self, playback: Playback, editor: Editor, notice: Notice) -> None:
        self._playback = playback
        self._editor = editor
        self._inspector = Inspector(playback, editor, notice)
        self._table = BallTable(self._shown, lambda: editor.selected, lambda ball: editor.select(ball, editor.pane))
        self._engine = cache(self._make_engine)

    def _shown(self) -> tuple[State, Scene, int]:
        view = self._playback.view
        return view.panes[self._editor.pane].state, view.moment.scene, view.moment.step

    def _make_engine(self, pane: int, name: str) -> TextButton:
        editor = self._editor
        return TextButton(name, partial(editor.show_in, pane), f"the balls in {name}", lambda: editor.pane == pane)

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        names = [pane.name for pane in self._playback.view.panes]
        colours = chart_palette().engines([*names, self._playback.session.reference])
        buttons = [self._engine(pane, name) for pane, name in enumerate(names)]
        for button in buttons:
            button.colour = colours[button.text]
        return [*self._inspector.rows(), buttons, [self._table]]
