"""The column's page of the engines: which of them run, in which panes, and with which settings of Pymunk."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from itertools import chain, count
from typing import Final

from sandbox.engines import BUILT_IN, check_name, known, refusal, resolved
from sandbox.engines.pymunk import settings_of
from sandbox.engines.specs import TUNED, settings_in, with_settings
from sandbox.errors import SandboxError
from sandbox.scene.model import PymunkSettings, Scene
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback
from sandbox.view.theme import chart_palette
from sandbox.view.widgets import TextButton, Widget, Words
from sandbox.view.widgets.fields import Field, Slider
from sandbox.view.widgets.group import rows_of

SCALES: Final[dict[str, tuple[float, ...]]] = {  # the values to choose from
    "iterations": (1, 2, 3, 5, 10, 15, 20, 30, 50, 100, 200, 500),
    "substeps": (1, 2, 3, 4, 6, 8, 12, 16, 24, 32),
    "collision_slop": (0, 0.001, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5),
    "collision_bias": (0, 1e-6, 1e-5, 1e-4, 0.001797, 0.01, 0.05, 0.1, 0.2, 0.5, 0.8, 1),
    "collision_persistence": (0, 1, 2, 3, 5, 10, 20, 50),
    "damping": (0.1, 0.2, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999, 1),
}
UNITS: Final = {"collision_slop": " px"}
NONE: Final = -1  # of the panes is unfolded
MAX_PANES: Final = 6  # that are large enough to compare, each in a colour of its own
ONLY_ONE: Final = "the last engine stays: add another one first"
FULL: Final = f"{MAX_PANES} panes are the most: remove one first"
OTHER_SUBSTEPS: Final = (4, 8, 2, 16)  # of another pane of Pymunk, until it is tuned; then any
TYPED: Final = "type an engine, such as pymunk(iterations=30, damping=0.9) or mine.py:Mine, and press Enter"


def has_settings(spec: str) -> bool:
    """Return whether an engine has these settings."""
    return settings_in(spec)[0] == TUNED


def in_force(spec: str, scene: Scene) -> dict[str, float]:
    """Return every setting with which the Pymunk of a spec runs a scene. Raises SandboxError if one is not valid."""
    return settings_of(resolved(spec, scene)[1])


def normal(spec: str, scene: Scene) -> str:
    """Return the shortest spec of the same engine: without the settings that it has anyway, the others in their order.

    Raises SandboxError if a setting is not valid.

    >>> from sandbox.scene.files import load
    >>> normal("pymunk(substeps=4,  iterations=10, damping=0.9)", load("article"))
    'pymunk(substeps=4, damping=0.9)'
    """
    base, settings = settings_in(spec)
    if not settings:
        return spec
    wanted, own = in_force(spec, scene), settings_of(scene)
    return with_settings(base, {key: wanted[key] for key in settings if wanted[key] != own[key]})


def with_setting(spec: str, scene: Scene, key: str, value: float) -> str:
    """Return the shortest spec of Pymunk with one of its settings changed; a new one is the last."""
    base, settings = settings_in(spec)
    return normal(with_settings(base, settings | {key: value}), scene)


def meaning_of(key: str) -> str:
    """Return what a setting is, as the scene's schema says it."""
    return str(PymunkSettings.model_fields[key].description).partition(";")[0].rstrip(".")


class EnginesPage:
    """The engines that run: a heading for each pane, of which one is unfolded, and the engines to add.

    use: lets engines run instead of these, with the same inputs, to the same step. What cannot be done is shown as a
    notice, and changes nothing. The widgets of the unfolded pane are the same for all panes.
    """

    def __init__(self, playback: Playback, notice: Notice, use: Callable[[Sequence[str]], None]) -> None:
        self._playback, self._notice, self._use = playback, notice, use
        self._open = next((k for k, name in enumerate(self.names) if has_settings(name)), NONE)
        self._remove_button = TextButton(
            "Remove", lambda: self.remove(self._open), "remove the pane",
            refusal=lambda: ONLY_ONE * (len(self.names) == 1),
        )  # fmt: skip
        self._values: dict[str, float] = {}  # of the sliders, in force in the unfolded pane
        self._sliders = {key: self._slider(key) for key in SCALES}
        self._choice = cache(lambda spec: TextButton(spec, partial(self.add, spec), f"run {spec}"))
        self._heading = cache(lambda pane: Words("", do=partial(self._fold, pane), does="show or hide its settings"))
        self._to_add, self._typed = Words("Add a pane"), Field("or type one", str, self.add, TYPED)
        self._choices: Mapping[str, str] = {}
        self._choices_for: object = None  # the scene and engines of these

    def _slider(self, key: str) -> Slider:
        return Slider(
            key.removeprefix("collision_"), SCALES[key], lambda: self._values[key],
            lambda value: self.tune(self._open, key, value), f"{key}, {meaning_of(key)}", UNITS.get(key, ""),
        )  # fmt: skip

    @property
    def names(self) -> list[str]:
        """The specs of the engines, in the order of their panes."""
        return self._playback.session.names

    @property
    def scene(self) -> Scene:
        """The scene at the start of the run."""
        return self._playback.session.start

    # Changes

    def add(self, spec: str) -> None:
        """Add a pane at the end, and unfold it."""
        panes = len(self.names)
        self._change(panes, spec, replaced=0)
        if len(self.names) > panes:
            self._open = panes

    def tune(self, pane: int, key: str, value: float) -> None:
        """Change a setting of the Pymunk that runs in a pane."""
        self._change(pane, with_setting(self.names[pane], self.scene, key, value), replaced=1)

    def remove(self, pane: int) -> None:
        """Remove a pane."""
        if len(self.names) == 1:
            self._notice.show(ONLY_ONE)
        else:
            self._open = NONE
            self._use([name for k, name in enumerate(self.names) if k != pane])

    def _change(self, pane: int, spec: str, replaced: int) -> None:
        """Put an engine in place of as many from a pane on."""
        others = [*self.names]
        del others[pane : pane + replaced]
        with self._notice.reporting():
            check_name(spec := spec.strip())
            spec = normal(spec, self.scene)
            if settings_in(spec) in [settings_in(normal(name, self.scene)) for name in others]:
                raise SandboxError(f"{spec} runs already, in another pane")
            if len(others) == MAX_PANES:
                raise SandboxError(FULL)
            others.insert(pane, spec)
            if others != self.names:
                self._use(others)

    # Choices

    @property
    def choices(self) -> Mapping[str, str]:
        """Why each engine cannot be added, or nothing; while Pymunk runs, another one has other settings."""
        wanted = self.scene, self.names
        if wanted != self._choices_for:
            specs = [self._another(), *(name for name in known() if not has_settings(name))]
            self._choices_for, self._choices = wanted, {spec: self._refusal(spec) for spec in specs}
        return self._choices

    def _another(self) -> str:
        """Return Pymunk as the scene has it or, while that runs, with other settings."""
        running = [normal(name, self.scene) for name in self.names]
        tuned = (with_setting(TUNED, self.scene, "substeps", number) for number in chain(OTHER_SUBSTEPS, count(1)))
        return next(spec for spec in chain([TUNED], tuned) if spec not in running)

    def _refusal(self, spec: str) -> str:
        """Return why an engine cannot be added to the run; one that cannot run an edited scene stands still then."""
        if spec in self.names:
            return f"{spec} runs already"
        try:
            check_name(spec)
        except SandboxError as error:
            return str(error)
        if settings_in(spec)[0] not in BUILT_IN:  # others are imported when they run, and refuse scenes then
            return ""
        return (refusal(spec, self.scene) or "").partition("; use --")[0]

    # Its widgets

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets, from the top, as they are now."""
        names = self.names
        lines = chart_palette().engines(names)
        self._open = self._open if self._open < len(names) else NONE
        rows: list[Sequence[Widget]] = []
        for pane, name in enumerate(names):
            heading = self._heading(pane)
            heading.text, heading.dots = name, (lines[name],)
            heading.marked = pane == self._open
            rows += [[heading], *(self._unfolded(name) if heading.marked else [])]
        choices = self.choices
        buttons = [self._choice(spec) for spec in choices]
        for button, why in zip(buttons, choices.values(), strict=True):
            button.refusal = partial(str, FULL if len(names) >= MAX_PANES else why)
        return [*rows, [self._to_add], buttons[:1], *rows_of(buttons[1:]), [self._typed]]  # Pymunk's has a long text

    def _unfolded(self, name: str) -> Sequence[Sequence[Widget]]:
        if not has_settings(name):
            return [[self._remove_button]]
        self._values = in_force(name, self.scene)
        return [[self._remove_button], *rows_of(list(self._sliders.values()))]

    def _fold(self, pane: int) -> None:
        self._open = NONE if self._open == pane else pane
