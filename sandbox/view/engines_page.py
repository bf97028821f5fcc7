"""The column's page of the engines: which of them run, each in a pane, and those to add."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Final

from sandbox.engines import BUILT_IN, check_name, known, refusal
from sandbox.errors import SandboxError
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback
from sandbox.view.theme import chart_palette
from sandbox.view.widgets import TextButton, Widget, Words
from sandbox.view.widgets.fields import Field
from sandbox.view.widgets.group import rows_of

MAX_PANES: Final = 6  # that are large enough to compare, each in a colour of its own
ONLY_ONE: Final = "the last engine stays: add another one first"
FULL: Final = f"{MAX_PANES} panes are the most: remove one first"
TYPED: Final = "type an engine, such as pymunk(iterations=30, damping=0.9) or mine.py:Mine, and press Enter"


class EnginesPage:
    """The engines that run, each with a button that removes its pane, and the engines to add.

    use: lets engines run instead of these, with the same inputs, to the same step. What cannot be done is shown as a
    notice, and changes nothing.
    """

    def __init__(self, playback: Playback, notice: Notice, use: Callable[[Sequence[str]], None]) -> None:
        self._playback, self._notice, self._use = playback, notice, use
        self._heading = cache(lambda pane: Words(""))
        self._remove_button = cache(self._make_remove_button)
        self._choice = cache(lambda spec: TextButton(spec, partial(self.add, spec), f"run {spec}"))
        self._to_add, self._typed = Words("Add a pane"), Field("or type one", str, self.add, TYPED)
        self._choices: Mapping[str, str] = {}
        self._choices_for: object = None  # the scene and engines of these

    def _make_remove_button(self, pane: int) -> TextButton:
        return TextButton(
            "Remove", partial(self.remove, pane), "remove the pane", width=2.0,
            refusal=lambda: ONLY_ONE * (len(self.names) == 1),
        )  # fmt: skip

    @property
    def names(self) -> list[str]:
        """The specs of the engines, in the order of their panes."""
        return self._playback.session.names

    def add(self, spec: str) -> None:
        """Add a pane at the end."""
        with self._notice.reporting():
            check_name(spec := spec.strip())
            if spec in self.names:
                raise SandboxError(f"{spec} runs already, in another pane")
            if len(self.names) == MAX_PANES:
                raise SandboxError(FULL)
            self._use([*self.names, spec])

    def remove(self, pane: int) -> None:
        """Remove a pane, which is not the only one."""
        self._use([name for k, name in enumerate(self.names) if k != pane])

    @property
    def choices(self) -> Mapping[str, str]:
        """Why each engine cannot be added, or nothing."""
        wanted = self._playback.session.start, self.names
        if wanted != self._choices_for:
            self._choices_for, self._choices = wanted, {spec: self._refusal(spec) for spec in known()}
        return self._choices

    def _refusal(self, spec: str) -> str:
        """Return why an engine cannot be added to the run; one that cannot run an edited scene stands still then."""
        if spec in self.names:
            return f"{spec} runs already"
        try:
            check_name(spec)
        except SandboxError as error:
            return str(error)
        if spec not in BUILT_IN:  # others are imported when they run, and refuse scenes then
            return ""
        return (refusal(spec, self._playback.session.start) or "").partition("; use --")[0]

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets, from the top, as they are now."""
        names = self.names
        colours = chart_palette().engines(names)
        rows: list[Sequence[Widget]] = []
        for pane, name in enumerate(names):
            heading = self._heading(pane)
            heading.text, heading.dots = name, (colours[name],)
            rows.append([heading, self._remove_button(pane)])
        choices = self.choices
        buttons = [self._choice(spec) for spec in choices]
        for button, why in zip(buttons, choices.values(), strict=True):
            button.refusal = partial(str, FULL if len(names) >= MAX_PANES else why)
        return [*rows, [self._to_add], *rows_of(buttons), [self._typed]]
