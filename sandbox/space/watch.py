"""Watching live Spaces: their steps are recorded beside their own program, and then diagnosed."""

import math
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final, NoReturn
from unittest.mock import patch
from weakref import WeakSet

import numpy as np
import pymunk

from sandbox.report.output import DEFAULT_WIDTH, json_text
from sandbox.space.contents import Contents, checked
from sandbox.space.diagnosis import Diagnosis
from sandbox.space.energy import ledger_of
from sandbox.space.findings import Fault, Finding, findings_of
from sandbox.space.lint import look
from sandbox.space.origins import Origins, program_line
from sandbox.space.passages import Passages
from sandbox.space.recording import Recording
from sandbox.space.rules import END_RULES, RULES, UNSTEPPED_RULES
from sandbox.space.steps import LONGEST_STEP, STEP_RULES, Evidence
from sandbox.space.unusual import unusual

MAX_SPACES: Final = 10  # that are diagnosed
MAX_LOOKED_AT: Final = 500_000  # shapes in all looks of the linter, which take some 10 µs each
TIME_ROUNDING: Final = 1e-9  # s


class Trial:
    """One Space: its linter, and the recording of its steps."""

    def __init__(self, space: pymunk.Space, origins: Origins, step: Callable[[pymunk.Space, float], None]) -> None:
        self.space, self.time, self.steps, self.line = space, 0.0, 0, ""
        self._original_step, self.cost = step, 0.0  # s of the processor, of the Space's own steps
        origins.grown.add(space)
        self._origins = origins
        self._faults: list[Fault] = []  # of what was added
        self._seen: WeakSet[Any] = WeakSet()
        self._recording = Recording(space)
        self._passages = Passages(self._recording)
        self._looked_at = 0
        self._most = [0, 0, 0]  # bodies, shapes and joints at one time

    def step(self, dt: float) -> None:
        """Look at the Space, do a step, record it, and look at what it did."""
        self.line = self.line or program_line()
        self._look()
        if (step := self._recording.record(self._step, dt)) and not step.lost.any():
            self._passages.look(step)
        self.steps += 1
        self.time += dt if math.isfinite(dt) else 0.0

    def _step(self, dt: float) -> None:
        begin = time.process_time()
        self._original_step(self.space, dt)
        self.cost += time.process_time() - begin

    def _look(self) -> None:
        counts = len(self.space.bodies), len(self.space.shapes), len(self.space.constraints)
        self._most = [max(most, count) for most, count in zip(self._most, counts, strict=True)]
        if self.space in self._origins.grown and self._looked_at <= MAX_LOOKED_AT:
            self._origins.grown.discard(self.space)
            self._looked_at += counts[1]
            contents = Contents(self.space, self._origins, self._seen)
            self._faults += look(contents, RULES, self.time if self.steps else None)

    @np.errstate(all="ignore")  # what is thrown about has energies that overflow
    def diagnosis(self, number: int) -> Diagnosis:
        """Return the diagnosis of what was recorded."""
        contents, energy, figures = Contents(self.space, self._origins), None, {}
        rules = END_RULES if self._recording.steps else (*END_RULES, *UNSTEPPED_RULES)
        faults = [*self._faults, *(fault for find in rules for fault in find(contents))]
        if self._recording.steps:
            evidence = Evidence(self._recording, contents, self._passages)
            faults += (fault for find in STEP_RULES for fault in find(evidence))
            if evidence.run.steps:
                faults += unusual(evidence)
                energy = ledger_of(evidence.run)
            figures = evidence.figures()
        findings, (bodies, shapes, joints) = tuple(findings_of(faults)), self._most
        return Diagnosis(
            number, self.line, self.steps, self.time, bodies, shapes, joints, findings, energy, figures, self.cost
        )


class Trials:
    """The first MAX_SPACES Spaces that a program steps, from the first step of each.

    seconds: of a Space's time, of which a step counts LONGEST_STEP at most; after them, KeyboardInterrupt ends the
    program, as Ctrl-C does; parts, iterations: that a step is done in, and times those of each Space that it gets, to
    try whether that mends something; only: the one Space that is recorded.
    ended: no further step is recorded, such as one of a thread that goes on; out_of_time: the program should have
    ended; stepping: the Space that is in a step; thread: that does the step; since: when the step began, or the last
    one ended, by the clock; finish: ends the process where the program goes on, with the diagnosis.
    """

    def __init__(
        self, seconds: float | None = None, parts: int = 1, iterations: int = 1, only: pymunk.Space | None = None
    ) -> None:
        self.seconds = math.inf if seconds is None else seconds
        self._parts, self._iterations = parts, iterations
        self._origins, self._original_step = Origins(), pymunk.Space.step  # of another recording, if there is one
        self._only = only
        self._trials = {id(only): Trial(only, self._origins, self._original_step)} if only else {}
        self.ended = self.out_of_time = False
        self._waited = 0.0  # s, since the last step
        self.stepping: Trial | None = None
        self.thread, self.since = 0, time.monotonic()
        self.finish: Callable[[], NoReturn] = sys.exit

    @contextmanager
    def recorded(self) -> Iterator[None]:
        """Record, within a `with` block, each call of `Space.step`."""

        def step(space: pymunk.Space, dt: float) -> None:
            self.step(space, dt)

        with patch.object(pymunk.Space, "step", step), self._origins.followed():
            try:
                yield
            finally:
                self.ended = True

    def step(self, space: pymunk.Space, dt: float) -> None:
        """Do a step of a Space, recorded."""
        trial = None if self.ended or self._only not in (None, space) else self._trial(space)
        if trial is None or not isinstance(dt, int | float | np.number):  # Pymunk says what is wrong with it
            self._original_step(space, dt)
            return
        if self.out_of_time:
            self._stop()
        self.stepping, self.thread, self.since = trial, threading.get_ident(), time.monotonic()
        try:
            self._do(trial, float(dt))
        finally:
            self.stepping, self.since, self._waited = None, time.monotonic(), 0.0
        most = trial.steps / self._parts * LONGEST_STEP  # its time may be in ms
        if min(trial.time, most) >= self.seconds - TIME_ROUNDING:
            self._stop()

    def _do(self, trial: Trial, dt: float) -> None:
        """Do a step in parts, with the program's forces in each: Pymunk takes them away after a step."""
        pushed = [(body, body.force, body.torque) for body in trial.space.bodies] if self._parts > 1 else []
        for part in range(self._parts):
            for body, force, torque in pushed if part else ():
                body.force, body.torque = force, torque
            trial.step(dt / self._parts)

    def wait(self, seconds: float) -> None:
        """Count time in which a program waits, in place of waiting; end it if it waits long without a step."""
        self._waited += 0.0 if self.stepping else seconds
        if not self.ended and self._waited > self.seconds:
            self._stop()

    def diagnoses(self) -> Iterator[Diagnosis]:
        """Yield the diagnosis of each Space."""
        for number, trial in enumerate(self._trials.values(), 1):
            yield trial.diagnosis(number)

    def _trial(self, space: pymunk.Space) -> Trial | None:
        trial = self._trials.get(id(space))
        if trial is None and len(self._trials) < MAX_SPACES:
            trial = self._trials[id(space)] = Trial(space, self._origins, self._original_step)
            space.iterations *= self._iterations
        return trial

    def _stop(self) -> NoReturn:
        """End the program as Ctrl-C would; at once if its main thread goes on in spite of that."""
        if threading.current_thread() is not threading.main_thread():
            self.interrupt()
            raise SystemExit
        if self.out_of_time:
            self.finish()
        self.out_of_time = True
        raise KeyboardInterrupt

    def interrupt(self) -> None:
        """Interrupt the main thread from another one, as Ctrl-C does, once."""
        if not self.out_of_time:
            self.out_of_time, self.since = True, time.monotonic()
            if sys.platform == "win32":
                signal.raise_signal(signal.SIGINT)
            else:  # also while it waits for a lock
                signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)


@contextmanager
def watch(space: pymunk.Space) -> Iterator["Watched"]:
    """Record what the steps of a Space do; afterwards, find what is wrong with it.

    Raises SandboxError if it is not a Space.
    """
    trials = Trials(only=checked(space))
    with trials.recorded():
        yield Watched(trials)


@dataclass(frozen=True, repr=False)
class Watched:
    """What a Space did within a `with` block. `sandbox watch` prints its `table`, and writes its `to_json`."""

    _trials: Trials

    def __repr__(self) -> str:
        return f"<Watched: {self.diagnosis.heading}>"

    @property
    def diagnosis(self) -> Diagnosis:
        """All that was recorded so far."""
        return next(self._trials.diagnoses())

    @property
    def findings(self) -> list[Finding]:
        """What is wrong with the Space and its steps, worst first."""
        return list(self.diagnosis.findings)

    def table(self, width: int = DEFAULT_WIDTH) -> str:
        """Return the text that `sandbox watch` prints, in so many columns."""
        return "\n".join(self.diagnosis.lines(width))

    def to_json(self) -> str:
        """Return what `sandbox watch --json` writes about the Space."""
        return json_text(self.diagnosis.as_json())
