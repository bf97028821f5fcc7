"""Spaces on trial: each one that a program steps is looked at and recorded, until its diagnosis."""

import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final, Self
from unittest.mock import patch
from weakref import WeakSet

import numpy as np
import pymunk

from sandbox.errors import SandboxError
from sandbox.space.contents import Contents, Origins, StepLengths, is_static, program_line
from sandbox.space.diagnosis import Diagnosis
from sandbox.space.evidence import MET_RULES, Evidence
from sandbox.space.findings import Fault, worst_first
from sandbox.space.lint import Linter
from sandbox.space.mechanics import Rows
from sandbox.space.recording import Recording
from sandbox.space.rules import (
    MAX_MASS_RATIO,
    RULES,
    mass_ratio,
    may_change_contacts,
    moved_static,
    not_finite,
    set_by_handler,
)

MAX_SPACES: Final = 10  # that are diagnosed
MAX_LOOKED_AT: Final = 500_000  # shapes in all looks of the linter, which take some 10 µs each
STEPS_PER_SAMPLE: Final = 10  # between looks at what touches, and at static bodies
MAX_RAISED: Final = 100  # times that a program may catch the end of its run
TIME_ROUNDING: Final = 1e-9  # s

BEFORE_RUN: Final = {rule: find for rule, find in RULES.items() if rule not in MET_RULES}
_GIVEN_BY_SHAPES: Final = ["shape_a", "shape_b", "elasticity", "friction", "surface_velocity"]  # of contacts
_original_step: Final = pymunk.Space.step


class Trial:
    """One Space: its linter, and the recording of its steps. step: the Space's own."""

    def __init__(self, space: pymunk.Space, origins: Origins, step: Callable[[float], None]) -> None:
        self.space, self.time = space, 0.0
        self.recording = _recording_of(space)
        self.changed = True  # something was added since the last step, or steps are of another length
        self._step, self._line = step, ""
        self._linter = Linter(space, origins, StepLengths(), RULES if self.recording is None else BEFORE_RUN)
        self._contents: Contents | None = None
        self._looked_at = self._steps = 0
        self._most = [0, 0, 0]  # bodies, shapes and joints at one time
        self._bodies: dict[int, pymunk.Body] = {}
        self._numbers, self._masses = np.empty(0, np.uintp), np.empty(0)  # ids of bodies, sorted, and their masses
        self._of_handlers: list[Fault] = []
        self._contacts: set[Any] = set()  # pairs of shapes, with elasticity and friction, that were looked at
        self._statics: dict[pymunk.Body, tuple[pymunk.Vec2d, float]] = {}
        self._reported: set[tuple[str, *tuple[int, ...]]] = set()  # rules and ids of bodies, or addresses of shapes

    def step(self, dt: float) -> None:
        """Look at the Space, do a step, record it, and look at what it did."""
        if not self._steps:
            self._line = program_line()
        self._before(dt)
        if self.recording is None:
            self._step(dt)
        else:
            self.recording.record(self._step, dt)
        self._after()
        self._steps += 1
        self.time += dt if math.isfinite(dt) else 0.0

    def diagnosis(self, number: int) -> Diagnosis:
        """Return the diagnosis of what was recorded."""
        findings, evidence = self._linter.findings(), None
        if self.recording:
            contents = Contents(self.space, self._linter.origins, self._linter.steps)
            evidence = Evidence(self.recording, contents, self._of_handlers)
            findings = sorted([*findings, *evidence.findings()], key=worst_first)
        bodies, shapes, joints = self._most
        return Diagnosis(number, self._line, self._steps, self.time, bodies, shapes, joints, tuple(findings), evidence)

    def _before(self, dt: float) -> None:
        self.changed |= self._linter.steps.add(dt)
        counts = len(self.space.bodies), len(self.space.shapes), len(self.space.constraints)
        self._most = [max(most, count) for most, count in zip(self._most, counts, strict=True)]
        if self.changed and self._looked_at <= MAX_LOOKED_AT:
            self.changed = False
            self._looked_at += counts[1]
            self._contents = self._linter.look(self.time if self._steps else None)
            self._bodies = {body.id: body for body in self._contents.bodies}
            self._numbers = np.array(sorted(self._bodies), np.uintp)
            self._masses = np.array([self._bodies[number].mass for number in sorted(self._bodies)])
            for shape in self._contents.shapes:
                if shape.body and is_static(shape.body):
                    self._statics.setdefault(shape.body, (shape.body.position, shape.body.angle))

    def _after(self) -> None:
        if not self.recording:
            return
        bodies = self.recording.steps[-1].after.bodies
        with np.errstate(invalid="ignore", over="ignore"):
            is_finite = np.isfinite(bodies["position"].sum(axis=1) + bodies["velocity"].sum(axis=1))
        for row in np.flatnonzero(~is_finite).tolist():
            self._not_finite(int(bodies["id"][row]))
        if self.space._handlers and may_change_contacts(self.space):
            self._set_by_handler()
        if self._steps % STEPS_PER_SAMPLE == 0:
            self._sample_touching(self.recording.steps[-1].after.contacts)
            self._sample_statics()

    def _report(self, rule: str, body: int, find: Callable[[], Fault | None]) -> None:
        """Add the fault of a body, if there is one, to what the linter found, once for each rule."""
        if (rule, body) not in self._reported and (fault := find()):
            self._reported.add((rule, body))
            self._linter.add(rule, fault, self.time)

    def _set_by_handler(self) -> None:
        """Look at contacts, each pair of shapes once with the same elasticity, friction and surface velocity."""
        if not self.recording or not len(self.recording) or not self._contents:
            return
        step = self.recording.steps[-1]
        contacts = step.after.contacts
        for row, (*first, belt) in enumerate(contacts[_GIVEN_BY_SHAPES].tolist()):
            key = (*first, *belt.tolist())
            if key not in self._contacts:
                self._contacts.add(key)
                pair = ("set-by-handler", *key[:2])
                a, b = map(self.recording.roster.by_address.get, key[:2])
                if pair in self._reported or not (a and b and a.body and b.body):
                    continue
                if fault := set_by_handler(self._contents, a, b, contacts[row], step.end):
                    self._reported.add(pair)
                    self._of_handlers.append(fault)

    def _not_finite(self, number: int) -> None:
        if self._contents and number in self._bodies:
            self._report("not-finite", number, partial(not_finite, self._contents, self._bodies[number]))

    def _sample_touching(self, contacts: Rows) -> None:
        pairs = np.stack([contacts["body_a"], contacts["body_b"]], axis=1)
        if not len(self._masses) or not len(pairs):
            return
        rows = np.searchsorted(self._numbers, pairs).clip(max=len(self._numbers) - 1)
        heavier, lighter = self._masses[rows].max(axis=1), self._masses[rows].min(axis=1)
        known = (self._numbers[rows] == pairs).all(axis=1)
        for first, second in pairs[known & (heavier > MAX_MASS_RATIO * lighter)].tolist():
            a, b = self._bodies[first], self._bodies[second]
            if self._contents:
                heavy = first if a.mass > b.mass else second
                self._report("mass-ratio", heavy, partial(mass_ratio, self._contents, a, b))

    def _sample_statics(self) -> None:
        for body, (place, angle) in self._statics.items():
            off = body.position.get_distance(place) or abs(body.angle - angle)
            if off and is_static(body) and self._contents:
                self._report("static-moved", body.id, partial(moved_static, self._contents, body, off))


def _recording_of(space: pymunk.Space) -> Recording | None:
    """Return a recording to begin, or None if this Pymunk's memory is laid out in another way."""
    try:
        return Recording(space)
    except SandboxError:
        return None


class Trials:
    """All Spaces that a program steps, from the first step of each; a context that replaces `Space.step`.

    others: the number of Spaces beyond those that are diagnosed.
    seconds: of a Space's time, after which KeyboardInterrupt ends the program, as Ctrl-C does.
    """

    def __init__(self, seconds: float | None = None) -> None:
        self._seconds = math.inf if seconds is None else seconds
        self._origins = Origins()
        self._trials: dict[int, Trial] = {}
        self.others = 0
        self._counted: WeakSet[pymunk.Space] = WeakSet()  # those
        self._ended = False
        self.out_of_time = False
        self._raised = 0
        self._waited = 0.0  # s, since the last step
        self._stepping = 0  # threads that do a step, the first of which may take minutes

    def __enter__(self) -> Self:
        trials, add = self, pymunk.Space.add

        def step(space: pymunk.Space, dt: float) -> None:
            """Do a step, recorded."""
            trials.step(space, dt)

        def add_remembered(space: pymunk.Space, *objects: Any) -> None:
            """Add objects, and remember the line of the program that does."""
            add(space, *objects)
            trials.added(space, objects)

        self._patch = patch.multiple(pymunk.Space, step=step, add=add_remembered)
        self._patch.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.end()
        self._patch.stop()

    def end(self) -> None:
        """Record no further step, such as one of a thread that goes on."""
        self._ended = True

    def added(self, space: pymunk.Space, objects: tuple[Any, ...]) -> None:
        """Remember who added objects, and look at them before the next step. Each step adds none."""
        if objects and not self._ended:
            self._origins.remember(objects)
            if trial := self._trials.get(id(space)):
                trial.changed = True

    def step(self, space: pymunk.Space, dt: float) -> None:
        """Do a step of a Space, recorded."""
        trial = None if self._ended else self._trial(space)
        if trial is None or not isinstance(dt, int | float | np.number):  # Pymunk says what is wrong with it
            _original_step(space, dt)
            return
        if self.out_of_time:
            self._stop()
        self._stepping += 1
        try:
            trial.step(float(dt))
        finally:
            self._stepping -= 1
            self._waited = 0.0
        if trial.time >= self._seconds - TIME_ROUNDING:
            self.out_of_time = True
            self._stop()

    def wait(self, seconds: float) -> None:
        """Count time in which a program waits, in place of waiting; end it if it waits long without a step."""
        self._waited += 0.0 if self._stepping else seconds
        if not self._ended and self._waited > self._seconds:
            self.out_of_time = True
            self._stop()

    def diagnoses(self) -> Iterator[Diagnosis]:
        """Yield the diagnosis of each Space."""
        for number, trial in enumerate(self._trials.values(), 1):
            yield trial.diagnosis(number)

    def _trial(self, space: pymunk.Space) -> Trial | None:
        trial = self._trials.get(id(space))
        if trial is None and len(self._trials) < MAX_SPACES:
            trial = self._trials[id(space)] = Trial(space, self._origins, partial(_original_step, space))
        elif trial is None:
            self.others += space not in self._counted
            self._counted.add(space)
        return trial

    def _stop(self) -> None:
        """End the program as Ctrl-C would; a program that goes on in spite of that is ended at once."""
        self._raised += 1
        if self._raised > MAX_RAISED:
            os._exit(0)
        if threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt
        interrupt_main_thread()
        raise SystemExit


def interrupt_main_thread() -> None:
    """Interrupt the main thread, as Ctrl-C does, also while it waits."""
    if sys.platform == "win32":
        signal.raise_signal(signal.SIGINT)
    else:
        ident = threading.main_thread().ident
        assert ident is not None
        signal.pthread_kill(ident, signal.SIGINT)
