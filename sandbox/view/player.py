"""How time passes on a stage: on and back, slower and faster, and what is undone in it."""

import math
from collections.abc import Callable
from time import perf_counter
from typing import Final

from sandbox.errors import SandboxError
from sandbox.run.inputs import Input, Release
from sandbox.session.session import Session
from sandbox.view.stage import Stage

BUDGET: Final = 0.025  # s of a frame that may go into physics; what does not fit slows time
SLICE: Final = 10  # steps that are run again between two looks at the clock
SPEEDS: Final = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, math.inf)


class Player:
    """Lets the time of a stage pass.

    tell: shows a person what went wrong; progress: is called while the engines run again before something can be done.
    """

    def __init__(self, stage: Stage, tell: Callable[[str], None], progress: Callable[[], None]) -> None:
        self._tell = tell
        self._progress = progress
        self.paused = False
        self.speed = 1.0
        self.put_on(stage)

    def put_on(self, stage: Stage) -> None:
        """Go on with another stage."""
        self.stage = stage
        self._owed = 0.0  # steps that time has passed for

    @property
    def session(self) -> Session:
        """The run."""
        return self.stage.session

    @property
    def exact(self) -> bool:
        """Whether what is shown is where one is, and not only the nearest that is remembered."""
        return self.stage.moment.step == self.session.step

    # What passes

    def advance(self, seconds: float) -> None:
        """Do the steps that are due after some time of the screen: never a larger step, if need be fewer."""
        if self.catch_up():
            return
        if seconds:  # of none, as fast as can be is none too
            self._owed += seconds * self.speed * self.stage.moment.scene.rate
        until = perf_counter() + BUDGET
        while self._owed >= 1:
            try:
                self.session.advance()
            except SandboxError as mistake:  # an edit of a recording that is refused
                self._tell(str(mistake))
            self._owed -= 1
            if perf_counter() > until:
                self._owed = min(self._owed, 1.0)
                break
        self.stage.look()

    def catch_up(self) -> bool:
        """Let the engines run again to where one is, for a while; tell whether they are still behind."""
        until = perf_counter() + BUDGET
        while self.session.steps_behind:
            self.session.catch_up(SLICE)
            if perf_counter() > until:
                break
        self.stage.look()
        return self.session.steps_behind > 0

    def settle(self) -> None:
        """Let the engines run again to where one is."""
        while self.catch_up():
            self._progress()

    def give(self, given: Input | None) -> None:
        """Do something to the balls, in every engine; where one refuses, say so."""
        if given is None:
            return
        self.settle()
        try:
            self.session.give(given)
        except SandboxError as mistake:
            self._tell(str(mistake))
        self.stage.forget_to_come()
        self.stage.look()

    def seek(self, step: int) -> None:
        """Go to a step that was reached before."""
        self._let_go()
        self.session.seek(step)
        self._owed = 0.0
        self.stage.look()

    def _let_go(self) -> None:
        """Let go of a ball before one leaves the time at which it is held."""
        if self.session.held is not None:
            self.give(Release(step=self.session.step))

    # What keys and buttons ask for

    def pause(self) -> None:
        """Pause, or go on."""
        self.paused = not self.paused

    def one_step(self) -> None:
        """Do one step, and pause."""
        self.paused = True
        self.settle()
        self._owed = 1.0
        self.advance(0.0)

    def step_back(self) -> None:
        """Go one step back, and pause."""
        self.paused = True
        self.seek(self.session.step - 1)

    def second_back(self) -> None:
        """Go one second back."""
        self.seek(self.session.step - self.stage.moment.scene.rate)

    def second_on(self) -> None:
        """Go one second on, but not further than one has been."""
        self.seek(self.session.step + self.stage.moment.scene.rate)

    def to_start(self) -> None:
        """Go to the start."""
        self.seek(0)

    def to_end(self) -> None:
        """Go to the furthest that was reached."""
        self.seek(self.session.end)

    def faster(self) -> None:
        """Let time pass faster."""
        self.speed = next((speed for speed in SPEEDS if speed > self.speed), SPEEDS[-1])

    def slower(self) -> None:
        """Let time pass slower."""
        self.speed = next((speed for speed in reversed(SPEEDS) if speed < self.speed), SPEEDS[0])

    def set_speed(self, speed: float) -> None:
        """Let time pass at some speed."""
        self.speed = speed

    def undo(self) -> None:
        """Go back to before the last throw or edit."""
        self._let_go()
        self._look_at(self.session.undo(), "there is nothing to undo here")

    def redo(self) -> None:
        """Do again what was undone."""
        self._look_at(self.session.redo(), "there is nothing to do again")

    def _look_at(self, done: bool, otherwise: str) -> None:
        if done:
            self._owed = 0.0
            self.settle()
            self.stage.forget_to_come()
        else:
            self._tell(otherwise)
