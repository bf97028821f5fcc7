"""What stands out in a run while it goes on: until when the reference means anything, and first differences from it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from sandbox.analysis.difference import difference_at_start
from sandbox.analysis.reference import Trust, Twins
from sandbox.compiled import NotCompiledYet, between_frames
from sandbox.errors import SandboxError
from sandbox.judge.judge import Judge
from sandbox.run.lockstep import Lockstep
from sandbox.scene.balls import BallGroup
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene, Wall
from sandbox.scene.spawn import spawn
from sandbox.state import PUSH, Contacts, State, States, no_contacts

CHECK_STEPS: Final = 15  # between two searches for a difference
MAX_BOOKED: Final = 5_000  # balls times steps that are judged at once, so that no frame takes much longer


@dataclass(frozen=True)
class Marks:
    """Times in a run that stand out, s.

    trust: until when the reference means anything; differences: for each engine that has one, its first from the
    reference; stopped: when the reference could go on no longer, and its message.
    """

    trust: Trust = field(default_factory=Trust)
    differences: Mapping[str, float] = field(default_factory=dict)
    stopped: tuple[float, str] | None = None


class Monitor:
    """Follows the engines of a lockstep and marks what stands out. An engine is followed until it differs."""

    def begin(self, lockstep: Lockstep, reference: str) -> None:
        """Follow engines that are at their first step. Without their reference, nothing stands out."""
        self._lockstep = lockstep
        self._reference = reference
        self._marked = Trust()
        self._stopped: tuple[float, str] | None = None
        self._differences: dict[str, float] = {}
        self._compiled = False
        self._waiting: list[tuple[float, State, Contacts]] = []  # steps of the reference that no twin has done
        self._begin_segment()

    @property
    def marks(self) -> Marks:
        """What has been found so far. What the last steps show may be missing, see `catch_up`."""
        return Marks(self._marked, dict(self._differences), self._stopped)

    def observe(self, states: Mapping[str, State], contacts: Mapping[str, Contacts]) -> None:
        """Observe the engines after a step, with the contacts of that step. After an edit, start afresh."""
        limit = self._lockstep.limits().get(self._reference)
        if self._reference not in states or limit:
            why = str(limit or self._lockstep.dropped)
            if why and not self._stopped:
                self.catch_up()
                self._stop(why)
        elif self._lockstep.edited:
            self.catch_up()
            self._begin_segment()
        elif self._lockstep.steps > self._begun + self._steps:
            self._add_step(states, contacts)

    def _add_step(self, states: Mapping[str, State], contacts: Mapping[str, Contacts]) -> None:
        self._steps += 1
        if self._twins.runners:  # beyond the horizon, nothing more is found
            time, found = self._lockstep.time - self._since, _since(contacts[self._reference], self._since)
            self._waiting.append((time, states[self._reference], found))
        for name, engine in self._followed.items():
            engine.add(states[name], self._lockstep)
        if self._steps % self._steps_at_once == 0:
            self.catch_up()
            if self._followed and self._can_enter():
                self._enter()

    def _enter(self) -> None:
        """Judge the steps that wait, and search for differences now and then."""
        for engine in self._followed.values():
            engine.enter()
        if self._steps % CHECK_STEPS == 0:
            self._find_differences()

    def catch_up(self) -> None:
        """Let the twins of the reference do the steps that wait. What was marked before an edit stays."""
        if not self._waiting:
            return
        times, states, contacts = zip(*self._waiting, strict=True)
        self._waiting = []
        try:
            self._twins.follow(States.stack(states), np.array(times))
        except SandboxError as error:
            self._stop(str(error))
            return
        found = self._twins.trust(np.concatenate([no_contacts(), *(some for some in contacts if len(some))]))
        marked = self._marked
        self._marked = Trust(
            self._earlier(marked.horizon, found.horizon),
            self._earlier(marked.undecided, found.undecided),
            self._earlier(marked.unresolved, found.unresolved),
        )

    def _stop(self, why: str) -> None:
        """Follow no engine any longer: without the reference or its twins, none can be judged."""
        self._stopped = self._lockstep.time, why
        self._twins.runners = []
        self._followed.clear()

    def _earlier(self, marked: float | None, found: float | None) -> float | None:
        """Return the time marked before, s, or else the one found since the segment began, if any."""
        return marked if marked is not None or found is None else self._since + found

    def _begin_segment(self) -> None:
        """Follow the engines that have not differed yet from the present step on."""
        lockstep = self._lockstep
        if self._reference not in lockstep.engines:
            return
        self._twins = Twins(lockstep, self._reference)
        names = [name for name in lockstep.engines if name != self._reference and name not in self._differences]
        followed = [*names, self._reference] if names else []
        self._scene, self._begun, self._since = lockstep.scene, lockstep.steps, lockstep.time
        self._steps = 0  # since the segment began
        few = max(1, MAX_BOOKED // len(lockstep.scene.bodies))
        self._steps_at_once = max(
            steps for steps in range(1, CHECK_STEPS + 1) if CHECK_STEPS % steps == 0 and steps <= few
        )
        self._followed: dict[str, _FollowedEngine] = {name: _FollowedEngine(name, lockstep) for name in followed}

    def _can_enter(self) -> bool:
        """Return whether the judge's kernels are compiled. Until they are, steps wait to be judged."""
        if not self._compiled:
            try:
                with between_frames():
                    _try_judge()
            except NotCompiledYet:
                return False
        self._compiled = True
        return True

    def _find_differences(self) -> None:
        """Mark the engines of which a step is wrong, or that began elsewhere, and follow them no longer."""
        start = self._followed[self._reference].start
        for name, engine in list(self._followed.items()):
            if name != self._reference and (time := engine.first_difference(start)) is not None:
                self._differences[name] = self._since + time
                del self._followed[name]
        if len(self._followed) == 1:
            self._followed.clear()


class _FollowedEngine:
    """An engine's steps so far. start: its first state."""

    def __init__(self, name: str, lockstep: Lockstep) -> None:
        self._name, self._scene = name, lockstep.scene
        damping = lockstep.engines[name].traits.damping._replace(substeps=1)
        self._judge = Judge(lockstep.scene, damping)
        self._entered = 0
        self.start = lockstep.engines[name].state()
        self._begin_block(self.start)

    def _begin_block(self, state: State) -> None:
        """Begin a block of steps that are judged together."""
        self._states = [state]
        self._pushes: list[tuple[int, int, Vector]] = []

    def add(self, state: State, lockstep: Lockstep) -> None:
        """Add a step."""
        self._pushes += [(len(self._states), ball, dv) for ball, dv in lockstep.pushes.get(self._name, ())]
        self._states.append(state)

    def enter(self) -> None:
        """Judge the steps added since the last call."""
        steps = self._entered + np.arange(1, len(self._states))
        self._judge.add(States.stack(self._states), np.array(self._pushes, PUSH), 1 / self._scene.clock.rates(steps))
        self._entered += len(steps)
        self._begin_block(self._states[-1])

    def first_difference(self, reference: State) -> float | None:
        """Return when it first differs, s, None if it does not. reference: the first state of the reference."""
        if difference_at_start(self._scene, self.start, reference):
            return 0.0
        self._judge.finish()
        errors = self._judge.errors
        return self._scene.clock.time(errors[0].step) if errors else None


def _try_judge() -> None:
    """Judge a step in which a ball meets a wall late. Raises NotCompiledYet if the judge's kernels are missing."""
    ball, wall = BallGroup(radius=1, position=(5.0, 5.0), velocity=(-300.0, 0.0)), Wall(start=(1.0, 1.0), to=(1.0, 9.0))
    scene = Scene(arena={"size": (9.0, 9.0)}, balls=[ball], walls=[wall])
    judge = Judge(scene)
    judge.add(States.stack([spawn(scene)] * 2), np.empty(0, PUSH), np.array([1 / scene.rate]))
    judge.finish()


def _since(contacts: Contacts, time: float) -> Contacts:
    """Return contacts with times that count from a time (s)."""
    contacts = contacts.copy()
    contacts["time"] -= time
    return contacts
