"""How time passes in a run: forward and back, slower and faster; how fast it does; undo."""

import gc
import math
from collections.abc import Sequence
from time import perf_counter
from typing import Final

from sandbox.errors import SandboxError
from sandbox.run.edits import Edit
from sandbox.run.inputs import Input, Release
from sandbox.scene.model import Scene
from sandbox.session.session import Session
from sandbox.view.notice import Notice, NoticeKind
from sandbox.view.session_view import NOTED_LAG, SessionView

MAX_WAIT: Final = 1.0  # s that an edit waits for engines that run again, and for the reference
PATIENCE: Final = 0.004  # s that a frame waits for a reference computed beside it, which mostly is there by then
FRAME_BUDGET: Final = 0.025  # s of a frame that physics may take; if that is too short, time slows down
SPEEDS: Final = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, math.inf)


def speed_text(speed: float) -> str:
    """Return a speed as the window shows it."""
    return "max" if speed == math.inf else f"{speed:g}\N{MULTIPLICATION SIGN}"


class Playback:
    """Plays a session, and goes to any of its steps. steps_played: while time passed, of all sessions."""

    def __init__(self, view: SessionView, notice: Notice) -> None:
        self._notice = notice
        self.paused = False
        self.speed = 1.0
        self.steps_played = 0
        self.view = view
        self.play(view)

    def play(self, view: SessionView) -> None:
        """Play another session, whose charts show the same instruments.

        The garbage collector leaves its objects alone: it would go through those of Pymunk again and again,
        for longer than a frame. The former session's are collected here.
        """
        view.charts.show(self.view.charts.instrument)
        self.view = view
        gc.unfreeze()
        gc.collect()
        gc.freeze()
        self._due = 0.0  # steps whose time has passed and that are not done yet

    def use_engines(self, names: Sequence[str]) -> bool:
        """Let other engines run instead, with the same inputs, to the same step; show a notice if one refuses.

        They run from the start to the latest step reached: later steps, inputs to come, and what can be redone are
        kept. If an engine refuses the scene, or soon an input, nothing changes. Return whether the engines run.
        """
        self._release()
        before, step = self.view, self.session.step
        try:
            view = SessionView(before.session.start, names, before.session.inputs, beside=before.session.beside)
            view.session.go_on_from(before.session)
            self.play(view)
            self._approach(MAX_WAIT)
        except SandboxError as error:
            self.play(before)
            self._notice.show(str(error).partition("; use --")[0], NoticeKind.ERROR)
            return False
        before.session.stop()
        self.seek(step)
        return True

    @property
    def session(self) -> Session:
        """The run."""
        return self.view.session

    @property
    def scene(self) -> Scene:
        """The scene at the step shown."""
        return self.view.moment.scene

    @property
    def track_end(self) -> int:
        """The step at the end of the track: that of the scene's seconds, or a later one that has been reached."""
        return max(self.session.end, self.session.start.steps, 1)

    @property
    def shows_current_step(self) -> bool:
        """Whether the current step is shown, and not just the nearest one in the history."""
        return self.view.moment.step == self.session.step

    @property
    def rests(self) -> bool:
        """Whether the run is paused at the step that is shown, and no engines are on their way to it."""
        is_on_the_way = 0 < self.session.steps_behind < self.session.step
        return self.paused and self.shows_current_step and not is_on_the_way

    # Time passes

    def advance(self, seconds: float) -> None:
        """Do the steps that are due after some seconds; if the machine is slow, fewer steps, never larger ones."""
        if self.catch_up():
            return
        if seconds:  # infinite speed times 0 s would be nan
            self._due += seconds * self.speed * self.scene.rate
        deadline, dropped = perf_counter() + FRAME_BUDGET, self.session.dropped
        while self._due >= 1 and not self._must_wait():
            with self._notice.reporting():  # an edit in a recording can be refused
                self.session.advance()
            self._due -= 1
            self.steps_played += 1
            if perf_counter() > deadline:
                self._due = min(self._due, 1.0)
                break
        self.session.collect(PATIENCE if self.session.lag <= NOTED_LAG else 0.0)
        if self.session.dropped != dropped:
            self._notice.show(f"{self.session.dropped}; the others run on without it")
        self.view.update()

    def _must_wait(self) -> bool:
        """Return whether time must stand still in this frame, until the reference is nearer."""
        if self.session.waits:
            self.session.collect(PATIENCE)
        if self.session.waits:
            self._due = min(self._due, 1.0)
        return self.session.waits

    def wait(self) -> None:
        """Let a frame pass while paused: go on to the current step."""
        if not self.rests:
            self.catch_up()
        elif self.session.collect():
            self.view.update()

    def catch_up(self, seconds: float | None = None) -> bool:
        """Run the engines towards the current step for some seconds, by default those of a frame.

        Shows a notice if engines that run in place of others refuse an edit, which is then dropped. Return whether the
        engines are still behind.
        """
        with self._notice.reporting():
            self._approach(FRAME_BUDGET if seconds is None else seconds)
        return self.session.steps_behind > 0

    def _approach(self, seconds: float) -> None:
        """Run the engines towards the current step for some seconds. Raises SandboxError if one refuses an edit."""
        deadline = perf_counter() + seconds
        while self.session.steps_behind:
            if not self._must_wait():
                self.session.catch_up(max_steps=1)
            if perf_counter() > deadline:
                break
        self.session.collect()
        self.view.update()

    def settle(self) -> None:
        """Run the engines to the current step. Raises SandboxError if that takes too long; frames go on with it."""
        if self.catch_up(MAX_WAIT):
            raise SandboxError("the engines are not there yet: try again when they have caught up")

    def give(self, given: Input) -> None:
        """Apply an input in every engine; show a notice if that is not possible."""
        with self._notice.reporting():
            self.settle()
            if isinstance(given, Edit):  # which is for the reference's state too
                self._await_reference()
            self.session.give(given)
        self.view.update()

    def _await_reference(self) -> None:
        """Wait until the reference is at the current step. Raises SandboxError if that takes too long."""
        self.session.collect(MAX_WAIT)
        if self.session.lag:
            what = "wait" if self.paused else "pause"
            raise SandboxError(f"{self.session.reference} is {self.session.lag:.1f} s behind: {what} until it is there")

    # Going to other steps

    def seek(self, step: int) -> None:
        """Go to a step between the start and the latest step reached."""
        self._release()
        self.session.seek(step)
        self._due = 0.0
        self.view.update()

    def _release(self) -> None:
        """Let go of a held ball before the step changes."""
        if self.session.held is not None:
            self.give(Release(step=self.session.step))

    def step_back(self) -> None:
        """Pause, and go one step back."""
        self.paused = True
        self.seek(self.session.step - 1)

    def step(self) -> None:
        """Pause, and do one step."""
        self.paused = True
        self.settle()
        if self.session.waits:
            self._await_reference()
        self._due = 1.0
        self.advance(0.0)

    # Speed

    def pause(self) -> None:
        """Pause or resume."""
        self.paused = not self.paused

    def change_speed(self, by: int) -> None:
        """Let time pass at a speed so many places further on in the list of speeds."""
        self.speed = SPEEDS[min(max(SPEEDS.index(self.speed) + by, 0), len(SPEEDS) - 1)]

    # Undoing

    def restart(self, *, keep: bool) -> None:
        """Go to the start of the run. keep: whether the edits up to here stay, all made there; undo comes back."""
        self._release()
        with self._notice.reporting():  # an edit may be impossible at the start
            self.session.restart(keep=keep)
        self._show_change()

    def undo(self) -> None:
        """Undo the latest throw, edit or restart, and go to its step."""
        self._release()
        if self.session.undo():
            self._show_change()
        else:
            self._notice.show("there is nothing to undo")

    def redo(self) -> None:
        """Redo what was undone last; what an engine that runs only since then refuses is dropped, with a notice."""
        if self.session.redo():
            self._show_change()
        else:
            self._notice.show("there is nothing to redo")

    def _show_change(self) -> None:
        self._due = 0.0
        self.catch_up(MAX_WAIT)
