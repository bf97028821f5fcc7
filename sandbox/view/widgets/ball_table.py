"""A table of all balls, in one engine."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from pygame import Rect, Surface

from sandbox.quantity import kinetic_energies, length
from sandbox.scene.fields import rgb
from sandbox.scene.model import Scene
from sandbox.state import Floats, State
from sandbox.view.primitives import dot, text_width, write
from sandbox.view.theme import theme
from sandbox.view.widgets.widget import Widget

LINE: Final = 1.5  # height of a row, in heights of the text
NUMBER: Final = 3.2  # width of the column of numbers, likewise
MAX_BALLS: Final = 2_000  # in the table


Values = Callable[[State, Scene], Floats]
MOTION: Final[Mapping[str, Values]] = {
    "x, px": lambda state, _: state.position[:, 0],
    "y, px": lambda state, _: state.position[:, 1],
    "vx, px/s": lambda state, _: state.velocity[:, 0],
    "vy, px/s": lambda state, _: state.velocity[:, 1],
    "speed": lambda state, _: length(state.velocity),
}
BODY: Final[Mapping[str, Values]] = {
    "mass": lambda _, scene: scene.bodies.mass,
    "radius": lambda _, scene: scene.bodies.radius,
    "momentum": lambda state, scene: length(state.velocity) * scene.bodies.mass,
    "energy": lambda state, scene: kinetic_energies(state.velocity, state.spin, scene.bodies.mass, scene.bodies.moment),
    "spin": lambda state, _: state.spin,
}


@dataclass(eq=False)
class BallTable(Widget):
    """Rows of balls under the names of columns: a press on a name sorts by it, one on a row selects the ball.

    shown: returns the state, the scene and the step in an engine. columns: returns the columns shown.
    """

    shown: Callable[[], tuple[State, Scene, int]]
    columns: Callable[[], Mapping[str, Values]]
    selected: Callable[[], int | None]
    select: Callable[[int], None]
    sorted_by: str = ""  # a column, or nothing: by number
    falling: bool = False  # from the largest
    width: float = 5.0

    takes_keys = False
    _line = _text_height = 1  # px

    @property
    def look(self) -> object:
        """The step, and how it is sorted."""
        state, scene, step = self.shown()
        return step, id(state), id(scene), tuple(self.columns()), self.selected(), self.sorted_by, self.falling

    def height(self, width: int, text_height: int) -> int:
        """Return the height of its rows, px."""
        return round(LINE * text_height) * (1 + min(MAX_BALLS, len(self.shown()[0].position)))

    @property
    def order(self) -> Sequence[int]:
        """The balls in the order of the rows."""
        state, scene, _ = self.shown()
        if self.sorted_by not in self.columns():
            return range(len(state.position))
        values = self.columns()[self.sorted_by](state, scene)
        order: list[int] = np.argsort(-values if self.falling else values, kind="stable").tolist()
        return order

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the rows that are in the clipped part of the surface."""
        state, scene, _ = self.shown()
        self._line, self._text_height = round(LINE * text_height), text_height
        names = list(self.columns())
        first = round(NUMBER * text_height)
        width = (place.width - first) // len(names)
        small = round(0.9 * text_height)
        values = np.column_stack([self.columns()[name](state, scene) for name in names])
        for column, name in enumerate(names):
            cell = Rect(place.x + first + column * width, place.y, width, self._line)
            is_sorted = name == self.sorted_by
            heading = name if text_width(name, small, bold=is_sorted) < width - small // 2 else name.partition(",")[0]
            _right(surface, heading, cell, small, bold=is_sorted)
        clip, chosen = surface.get_clip(), self.selected()
        order = self.order
        top = max(0, (clip.y - place.y) // self._line - 1)
        for row in range(top, min(len(order), MAX_BALLS)):
            line = Rect(place.x, place.y + (row + 1) * self._line, place.width, self._line)
            if line.y > clip.bottom:
                break
            ball = order[row]
            if ball == chosen:
                surface.fill(theme.hover, line)
            rim = (theme.dim.r, theme.dim.g, theme.dim.b)  # or white balls would not be seen
            disc = dot(max(2, small // 3), rgb(scene.colors[ball]), rim)
            surface.blit(disc, disc.get_rect(center=(line.x + small // 2, line.centery)))
            write(surface, str(ball), Rect(line.x + small, line.y, first, line.height), theme.ink, small)
            for column in range(len(names)):
                cell = Rect(line.x + first + column * width, line.y, width, line.height)
                _right(surface, _number(values[ball, column]), cell, small, ink=True)

    def press(self, place: Rect, point: tuple[int, int]) -> None:
        """Sort by the column whose name is pressed, or select the ball of the row."""
        row = (point[1] - place.y) // max(1, self._line) - 1
        if row >= 0:
            order = self.order
            if row < len(order):
                self.select(order[row])
            return
        names = list(self.columns())
        first = round(NUMBER * self._text_height)
        column = (point[0] - place.x - first) // max(1, (place.width - first) // len(names))
        self._sort(names[min(column, len(names) - 1)] if column >= 0 else "")

    def _sort(self, name: str) -> None:
        """Sort by a column, the largest first; if that is so already, the smallest first."""
        self.falling = name != self.sorted_by or not self.falling
        self.sorted_by = name


def _number(value: float) -> str:
    if abs(value) < 0.05:
        return "0" if abs(value) < 5e-4 else f"{value:.1g}"
    return f"{value:,.1f}" if abs(value) < 1e5 else f"{value:.3g}"


def _right(surface: Surface, text: str, cell: Rect, height: int, *, ink: bool = False, bold: bool = False) -> None:
    """Write a text at the right of a cell."""
    x = max(cell.x, cell.right - text_width(text, height, bold=bold))
    place = Rect(x, cell.y, cell.right - x, cell.height)
    write(surface, text, place, theme.ink if ink else theme.dim, height, bold=bold)
