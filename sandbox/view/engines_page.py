"""The page of the side panel that lists the panes' engines: to add, remove, exchange, move and tune them."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from sandbox.view.line_up import FULL, MAX_PANES, ONLY_ONE, LineUp
from sandbox.view.palette import chart_palette
from sandbox.view.tuning import SCALES, UNITS, has_settings, in_force, meaning_of, scale_of
from sandbox.view.widgets.buttons import Heading, TextButton
from sandbox.view.widgets.field import Field
from sandbox.view.widgets.slider import Slider
from sandbox.view.widgets.widget import Widget
from sandbox.view.widgets.words import Words

PER_ROW: Final = 2  # sliders, and engines to choose from
TYPED: Final = "type an engine, such as pymunk(iterations=30, damping=0.9) or mine.py:Mine, and press Enter"


class EnginesPage:
    """A heading for each pane, in their order, of which one is unfolded: its buttons, and sliders if it is Pymunk.

    Below are the engines to add. The widgets of the unfolded pane are the same for all panes, so that the keyboard
    stays on a button while the pane moves.
    """

    def __init__(self, line_up: LineUp) -> None:
        self._line_up = line_up
        self._open: int | None = next((k for k, name in enumerate(line_up.names) if has_settings(name)), None)
        self._exchanging = False  # the engines to exchange it for are shown
        self._headings: list[Heading] = []
        self._buttons = [
            TextButton("up", partial(self._move, -1), "move the pane before the previous one", refusal=self._is_first),
            TextButton("down", partial(self._move, 1), "move the pane behind the next one", refusal=self._is_last),
            TextButton("exchange", self._show_exchange, "run another engine in this pane", lambda: self._exchanging),
            TextButton("remove", self._remove, "remove the pane", refusal=self._is_alone),
        ]
        for button in self._buttons:
            button.width = len(button.text) + 3  # letters, and room round them
        self._spec = Field("engine", lambda: self._name, self._exchange, TYPED)
        self._values: dict[str, float] = {}  # of the sliders, in force in the unfolded pane
        self._values_of: object = None  # the scene and the engine of these
        self._sliders = {key: self._slider(key) for key in SCALES}
        self._choices: dict[tuple[Callable[[str], None], str], TextButton] = {}
        self._to_add = Words("Add a pane:")
        self._typed = Field("or type one", str, self._add, TYPED)

    def _slider(self, key: str) -> Slider:
        return Slider(
            key.removeprefix("collision_"),
            f"{key}, {meaning_of(key)}",
            SCALES[key],
            lambda: self._values[key],
            partial(self._tune, key),
            UNITS.get(key, ""),
            at_once=False,
        )

    @property
    def _name(self) -> str:
        """The engine of the unfolded pane."""
        return "" if self._open is None else self._line_up.names[self._open]

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets, from the top, as they are now."""
        names = self._line_up.names
        if self._open is not None and self._open >= len(names):
            self._open = None
        rows: list[Sequence[Widget]] = []
        for pane, heading in enumerate(self._shown_headings()):
            rows.append([heading])
            rows += self._unfolded() if pane == self._open else []
        full = FULL if len(names) >= MAX_PANES else ""
        return [*rows, [self._to_add], *self._choice_rows(self._add, full), [self._typed]]

    def _shown_headings(self) -> Sequence[Heading]:
        line_up = self._line_up
        colours = chart_palette()
        lines = colours.engines(line_up.names)
        for pane, name in enumerate(line_up.names):
            if pane == len(self._headings):
                do = partial(self._fold, pane)
                self._headings.append(Heading(name, lines[name], colours.ground, do, "show or hide its settings"))
            heading = self._headings[pane]
            heading.text, heading.colour, heading.ground = name, lines[name], colours.ground
            heading.is_open = pane == self._open
        return self._headings[: len(line_up.names)]

    def _unfolded(self) -> Sequence[Sequence[Widget]]:
        """Return the rows below the heading of the unfolded pane."""
        rows: list[Sequence[Widget]] = [self._buttons]
        if self._exchanging:
            rows += [*self._choice_rows(self._exchange), [self._spec]]
        if has_settings(self._name):
            self._read_settings()
            rows += _in_rows(list(self._sliders.values()))
        return rows

    def _read_settings(self) -> None:
        """Let the sliders show the settings in force in the unfolded pane."""
        scene = self._line_up.scene
        if self._values_of != (self._name, scene):
            own, self._values, self._values_of = (
                in_force("pymunk", scene),
                in_force(self._name, scene),
                (self._name, scene),
            )
            for key, slider in self._sliders.items():
                slider.values = scale_of(key, own[key], self._values[key])

    def _choice_rows(self, choose: Callable[[str], None], refusal: str = "") -> Sequence[Sequence[Widget]]:
        """Return buttons that choose an engine. refusal: why none can be chosen, or nothing."""
        buttons = []
        for choice in self._line_up.choices:
            key = (choose, choice.spec)
            if key not in self._choices:
                self._choices[key] = TextButton(choice.spec, partial(choose, choice.spec), f"run {choice.spec}")
            button = self._choices[key]
            button.refusal = partial(str, refusal or choice.refusal)
            buttons.append(button)
        return [buttons[:1], *_in_rows(buttons[1:])]  # Pymunk's has a long text

    # What its widgets do

    def _fold(self, pane: int) -> None:
        self._open = None if self._open == pane else pane
        self._exchanging = False

    def _show_exchange(self) -> None:
        self._exchanging = not self._exchanging

    def _add(self, spec: str) -> None:
        """Add a pane, and unfold it."""
        panes = len(self._line_up.names)
        self._line_up.add(spec)
        if len(self._line_up.names) > panes:
            self._open, self._exchanging = panes, False

    def _exchange(self, spec: str) -> None:
        if self._open is not None:
            before = self._line_up.names
            self._line_up.exchange(self._open, spec)
            self._exchanging = self._exchanging and self._line_up.names is before

    def _tune(self, key: str, value: float) -> None:
        if self._open is not None:
            self._line_up.tune(self._open, key, value)

    def _move(self, by: int) -> None:
        if self._open is not None:
            before = self._line_up.names
            self._line_up.move(self._open, by)
            if self._line_up.names is not before:
                self._open += by

    def _remove(self) -> None:
        if self._open is not None:
            before = self._line_up.names
            self._line_up.remove(self._open)
            if self._line_up.names is not before:
                self._open, self._exchanging = None, False

    # Why a button does nothing

    def _is_first(self) -> str:
        return "it is the first pane" if self._open == 0 else ""

    def _is_last(self) -> str:
        return "it is the last pane" if self._open == len(self._line_up.names) - 1 else ""

    def _is_alone(self) -> str:
        return ONLY_ONE if len(self._line_up.names) == 1 else ""


def _in_rows(widgets: Sequence[Widget]) -> list[Sequence[Widget]]:
    return [widgets[k : k + PER_ROW] for k in range(0, len(widgets), PER_ROW)]
