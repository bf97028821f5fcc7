"""The inspector: the selected ball or wall, to see and change."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from sandbox.errors import SandboxError, shown
from sandbox.run.edits import AddBall
from sandbox.scene.fields import PALETTE, Vector
from sandbox.scene.model import Arena, Scene, Wall
from sandbox.state import State
from sandbox.view.editor import ARENA_WALL, Editor
from sandbox.view.mouse_tool import MouseTool
from sandbox.view.move_tool import Tool
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback
from sandbox.view.widgets.buttons import Swatch, TextButton
from sandbox.view.widgets.field import Field
from sandbox.view.widgets.widget import Widget
from sandbox.view.widgets.words import Words

HINT: Final = "Click a ball, or a row of the table, to change it; a wall, while the run is paused."
NOISE: Final = 1e-9  # of any unit; less is an engine's rounding error
OF_STATE: Final[dict[str, tuple[Callable[[State, int], float], str]]] = {  # a ball's, with their units
    "x": (lambda state, ball: float(state.position[ball, 0]), "px"),
    "y": (lambda state, ball: float(state.position[ball, 1]), "px"),
    "vx": (lambda state, ball: float(state.velocity[ball, 0]), "px/s"),
    "vy": (lambda state, ball: float(state.velocity[ball, 1]), "px/s"),
    "spin": (lambda state, ball: float(state.spin[ball]), "rad/s"),
}
DOES: Final = {
    "x": "position of its centre, to the right; the same in every engine if you set it",
    "y": "position of its centre, downwards; the same in every engine if you set it",
    "vx": "velocity to the right; the same in every engine if you set it",
    "vy": "velocity downwards; the same in every engine if you set it",
    "spin": "angular velocity, clockwise; the same in every engine if you set it",
    "radius": "radius",
    "mass": "mass; only ratios matter",
    "elasticity": "its factor: a contact has the product of two",
    "friction": "its factor: a contact has the product of two",
    "thickness": "full thickness",
}
UNITS: Final = {"radius": "px", "mass": "kg", "thickness": "px"}
ENDS: Final = ((0, 0, "from x"), (0, 1, "from y"), (1, 0, "to x"), (1, 1, "to y"))  # an end, its axis, their name
END_KEYS: Final = ("start", "to")


class Inspector:
    """Shows the selected ball, as it is in the pane where it was clicked, or the selected wall; changes and copies it.

    The run is paused while its fields are typed into.
    """

    def __init__(self, playback: Playback, editor: Editor, mouse: MouseTool, notice: Notice) -> None:
        self._playback = playback
        self._editor = editor
        self._mouse = mouse
        self._notice = notice
        self._heading = Words("", width=2.0)
        self._hint, self._nothing = Words(""), Words("")
        self._copy = TextButton("copy", self._start_copy, "a ball like this one, where you click next", width=1.0,
                                is_on=lambda: mouse.copying, refusal=self._refusal)  # fmt: skip
        self._delete = TextButton("delete", lambda: editor.delete(None), "delete it", width=1.0, refusal=self._refusal)
        self._ball = {key: self._ball_field(key) for key in (*OF_STATE, "radius", "mass", "elasticity", "friction")}
        self._colour = self._field("colour", self._colour_of_ball, lambda text: editor.change(color=text),
                                   "a CSS colour name or #rrggbb")  # fmt: skip
        self._swatches = [self._swatch(colour) for colour in PALETTE]
        self._ends = [self._end_field(*end) for end in ENDS]
        self._wall = {key: self._wall_field(key) for key in ("thickness", "elasticity", "friction")}
        self._new_ball = [self._new_field(key) for key in ("radius", "mass")]
        self._new_ball_heading, self._new_wall_heading = Words("new balls"), Words("new walls")
        self._thickness = self._field("thickness", lambda: _text(mouse.move.thickness), self._set_thickness,
                                      "of walls that you draw", "px")  # fmt: skip

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return what is selected, and what is added next."""
        if self._editor.selected is not None:
            rows = self._ball_rows(self._editor.selected)
        elif self._editor.selected_wall is not None:
            rows = self._wall_rows(self._editor.selected_wall)
        else:
            self._hint.text = HINT
            rows = [[self._hint]]
        if self._mouse.tool is Tool.WALL:
            return [*rows, [self._new_wall_heading, self._thickness]]
        if self._mouse.tool is Tool.BALL:
            return [*rows, [self._new_ball_heading, *self._new_ball]]
        return rows

    def _ball_rows(self, ball: int) -> list[Sequence[Widget]]:
        self._heading.text = f"ball {ball} in {self._playback.view.panes[self._editor.pane].name}"
        field = self._ball
        return [
            [self._heading, self._copy, self._delete],
            [field["x"], field["y"]],
            [field["vx"], field["vy"]],
            [field["spin"], field["mass"]],
            [field["radius"], self._colour],
            [field["elasticity"], field["friction"]],
            self._swatches,
        ]

    def _wall_rows(self, wall: int) -> list[Sequence[Widget]]:
        self._heading.text = self._scene.wall_name(wall)
        field, ends = self._wall, [self._ends[:2], self._ends[2:]]
        if self._editor.own_wall is None:
            self._hint.text = f"{ARENA_WALL[0].upper()}{ARENA_WALL[1:]}."
            return [[self._heading], *ends, [field["elasticity"], field["friction"]], [self._hint]]
        return [
            [self._heading, self._delete],
            *ends,
            [field["thickness"], field["elasticity"]],
            [field["friction"], self._nothing],
        ]

    # Widgets

    @property
    def _scene(self) -> Scene:
        return self._playback.view.moment.scene

    def _refusal(self) -> str:
        if self._editor.selected_wall is not None and self._editor.own_wall is None:
            return ARENA_WALL
        return ""

    def _field(
        self, name: str, value: Callable[[], str], choose: Callable[[str], None], does: str, unit: str = ""
    ) -> Field:
        def choose_or_say(text: str) -> None:
            with self._notice.reporting():
                choose(text)

        return Field(name, value, choose_or_say, does, unit, self._refusal, begin=self._pause)

    def _pause(self) -> None:
        self._playback.paused = True

    def _ball_field(self, key: str) -> Field:
        def value() -> str:
            view, ball = self._playback.view, self._editor.selected or 0
            if key in OF_STATE:
                return _text(OF_STATE[key][0](view.panes[self._editor.pane].state, ball))
            return _text(float(getattr(view.moment.scene.bodies, key)[ball]))

        unit = OF_STATE[key][1] if key in OF_STATE else UNITS.get(key, "")
        return self._field(key, value, lambda text: self._editor.change(**{key: _number(key, text)}), DOES[key], unit)

    @property
    def _surface(self) -> Wall | Arena:
        """What has the selected wall's elasticity and friction."""
        wall = self._editor.own_wall
        return self._scene.arena if wall is None else self._scene.walls[wall]

    def _wall_field(self, key: str) -> Field:
        return self._field(
            key,
            lambda: _text(getattr(self._surface, key)),
            lambda text: self._editor.change(**{key: _number(key, text)}),
            DOES[key],
            UNITS.get(key, ""),
        )

    def _end_field(self, number: int, axis: int, name: str) -> Field:
        def end() -> Vector:
            return self._scene.wall_line(self._editor.selected_wall or 0)[:2][number]

        def choose(text: str) -> None:
            point = list(end())
            point[axis] = _number(name, text)
            self._editor.change(**{END_KEYS[number]: tuple(point)})

        does = f"{('horizontal', 'vertical')[axis]} position of this end"
        return self._field(name, lambda: _text(end()[axis]), choose, does, "px")

    def _colour_of_ball(self) -> str:
        return self._playback.view.moment.scene.colors[self._editor.selected or 0]

    def _swatch(self, colour: str) -> Swatch:
        choose = partial(self._editor.change, color=colour)
        return Swatch(colour, choose, lambda: self._colour_of_ball() == colour, self._refusal)

    def _new_field(self, key: str) -> Field:
        def choose(text: str) -> None:
            size = {key: _number(key, text)}
            AddBall(step=0, position=(0, 0), **{"radius": 1.0} | size)  # which raises SandboxError for what is not one
            self._editor.new_ball |= size

        field = self._field(
            key, lambda: _text(self._editor.size_of_new(key)), choose, f"{key} of new balls", UNITS[key]
        )
        field.refusal = str
        return field

    def _set_thickness(self, text: str) -> None:
        self._mouse.move.thickness = Wall(start=(0, 0), to=(1, 0), thickness=_number("thickness", text)).thickness

    def _start_copy(self) -> None:
        self._mouse.copy_ball()


def _text(value: float) -> str:
    """Return a number as it is shown: three decimals, or a power of ten if it is small."""
    if abs(value) < NOISE:
        return "0"
    return f"{value:.3g}" if abs(value) < 1e-3 else f"{round(value, 3):.7g}"


def _number(name: str, text: str) -> float:
    """Return the number in a text. Raises SandboxError if the text is not a number."""
    try:
        return float(text)
    except ValueError:
        raise SandboxError(f"{name} must be a number, got {shown(text)}") from None
