"""The engines of the window's panes: added, removed, exchanged, moved, and tuned while the scene runs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain, count
from typing import Final

from sandbox.engines import BUILT_IN, TUNED, check_name, known, refusal, settings_in
from sandbox.errors import SandboxError
from sandbox.run.edits import Edit, edited_scenes
from sandbox.scene.model import Scene
from sandbox.view.notice import Kind, Notice
from sandbox.view.playback import Playback
from sandbox.view.tuning import are_same, has_settings, normal, with_setting

MAX_PANES: Final = 6  # that are large enough to compare, each in a colour of its own
ONLY_ONE: Final = "the last engine stays: add another one first"
FULL: Final = f"{MAX_PANES} panes are the most: remove one first"
OTHER_SUBSTEPS: Final = (4, 8, 2, 16)  # of another pane of Pymunk, until it is tuned; then any


@dataclass(frozen=True)
class Choice:
    """An engine to choose by its spec. refusal: why it cannot be chosen, or nothing."""

    spec: str
    refusal: str


class LineUp:
    """The engines that run, in the order of their panes.

    use: lets engines run instead of these, with the same inputs, to the same step. What cannot be done is shown as a
    notice, and changes nothing.
    """

    def __init__(self, playback: Playback, notice: Notice, use: Callable[[Sequence[str]], None]) -> None:
        self._playback = playback
        self._notice = notice
        self._use = use
        self._ever: list[str] = []  # engines that have run in this window, in files of their own too
        self._choices: list[Choice] = []
        self._choices_for: object = None  # the scene, edits and engines of these

    @property
    def names(self) -> list[str]:
        """Their specs."""
        return self._playback.session.names

    @property
    def scene(self) -> Scene:
        """The scene at the start of the run."""
        return self._playback.session.start

    # Changes

    def add(self, spec: str) -> None:
        """Add a pane at the end."""
        self._change(len(self.names), spec, replaced=0)

    def exchange(self, pane: int, spec: str) -> None:
        """Let another engine run in a pane."""
        self._change(pane, spec, replaced=1)

    def tune(self, pane: int, key: str, value: float) -> None:
        """Change a setting of the Pymunk that runs in a pane."""
        self.exchange(pane, with_setting(self.names[pane], self.scene, key, value))

    def remove(self, pane: int) -> None:
        """Remove a pane."""
        if len(self.names) == 1:
            self._notice.show(ONLY_ONE)
        else:
            self._use([name for k, name in enumerate(self.names) if k != pane])

    def move(self, pane: int, by: int) -> None:
        """Move a pane so many places towards the end, or towards the start if negative."""
        names = [*self.names]
        names.insert(pane + by, names.pop(pane))
        self._use(names)

    def _change(self, pane: int, spec: str, replaced: int) -> None:
        """Put an engine in place of as many from a pane on."""
        others = [*self.names]
        del others[pane : pane + replaced]
        try:
            check_name(spec := spec.strip())
            spec = normal(spec, self.scene)
        except SandboxError as error:
            self._notice.show(str(error), Kind.ERROR)
            return
        if any(are_same(spec, name, self.scene) for name in others):
            self._notice.show(f"{spec} runs already, in another pane", Kind.ERROR)
        elif len(others) == MAX_PANES:
            self._notice.show(FULL, Kind.ERROR)
        elif [*others[:pane], spec, *others[pane:]] != self.names:
            self._use([*others[:pane], spec, *others[pane:]])

    # Choices

    @property
    def choices(self) -> list[Choice]:
        """Every engine by its name, and those in files that have run in this window.

        While Pymunk runs, another one has other settings.
        """
        session = self._playback.session
        wanted = session.start, [one for one in session.inputs if isinstance(one, Edit)], session.names
        if wanted != self._choices_for:
            self._choices_for = wanted
            scenes = list(edited_scenes(session.start, session.inputs))
            names = dict.fromkeys([*known(), *self._ever, *session.names])
            self._ever = [name for name in names if not has_settings(name)]
            self._choices = [Choice(spec, self._refusal(spec, scenes)) for spec in (self._another(), *self._ever)]
        return self._choices

    def _another(self) -> str:
        """Return Pymunk as the scene has it or, while that runs, with other settings."""
        running = [normal(name, self.scene) for name in self.names]
        tuned = (with_setting(TUNED, self.scene, "substeps", number) for number in chain(OTHER_SUBSTEPS, count(1)))
        return next(spec for spec in chain([TUNED], tuned) if spec not in running)

    def _refusal(self, spec: str, scenes: Sequence[Scene]) -> str:
        if spec in self.names:
            return f"{spec} runs already"
        try:
            check_name(spec)
        except SandboxError as error:
            return str(error)
        if settings_in(spec)[0] not in BUILT_IN:  # others are imported when they run, and refuse scenes then
            return ""
        return next(filter(None, (refusal(spec, scene) for scene in scenes)), "")
