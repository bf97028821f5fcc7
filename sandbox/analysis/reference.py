"""The reference: the engine that others are measured against, and until when its own paths mean anything."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from sandbox.analysis.ties import SIMULTANEOUS, Tie, find_tie
from sandbox.engines import REFERENCE, RunningEngine
from sandbox.engines.exact.contact import HOP_TIME
from sandbox.engines.exact.engine import ExactEngine
from sandbox.engines.stand_ins import RenumberedEngine
from sandbox.quantity import length
from sandbox.run.lockstep import Lockstep, Runner
from sandbox.scene.model import Scene
from sandbox.state import Bools, Contacts, Floats, State, States, no_contacts

SHIFTED_TWINS: Final = 3  # one may happen not to grow: a contact can absorb a shift to the bit
MAX_SHIFT: Final = 8  # units in the last place, of every coordinate of a shifted twin
PARTED: Final = 1e-9  # of a radius or a speed, by which a twin is elsewhere, and not only rounded otherwise
RESTING: Final = 10  # times what gravity does between two contacts of bodies at rest: an impulse up to this is no hit


def reference_of(engines: Sequence[str]) -> str:
    """Return the engine that others are measured against by default: the exact one, or else the last."""
    return REFERENCE if REFERENCE in engines else engines[-1]


class Trust(NamedTuple):
    """Until when the paths of the reference mean anything: three times, s, each None if that is to the end.

    tied: the two bodies (balls, or ~walls) of which the order is undecided, and the ball that they touch.
    """

    horizon: float | None = None
    undecided: float | None = None
    unresolved: float | None = None
    tied: tuple[int, int, int] | None = None

    @property
    def until(self) -> float | None:
        """The earliest of the three."""
        return min(self._found.values(), default=None)

    @property
    def ends_by(self) -> str:
        """Which of the three is the earliest; empty if none is within the run."""
        return min(self._found, key=self._found.__getitem__, default="")

    def followed_by(self, later: "Trust", since: float) -> "Trust":
        """Return this trust, and where it is to the end, that of what follows, of which the times count from since."""
        both = zip(self[:3], later[:3], strict=True)
        times = (before if before is not None or after is None else since + after for before, after in both)
        horizon, undecided, unresolved = times
        return Trust(horizon, undecided, unresolved)

    @property
    def _found(self) -> dict[str, float]:
        """Those that are within the run. At equal times, the one that says more comes first."""
        times = {"undecided": self.undecided, "unresolved": self.unresolved, "horizon": self.horizon}
        return {name: time for name, time in times.items() if time is not None}


class Twins:
    """Copies of an engine of a lockstep that follow it with the same pushes, until the horizon or an edit.

    Shifted twins begin with every coordinate some units in the last place elsewhere: the horizon is where a ball of one
    is a radius away. The renumbered twin has its balls in reverse order, and agrees to the bit up to a tie; in an
    event-driven engine, rounding may order contacts too, so that the shifted twins are searched as well. Under gravity,
    the finer twin of `exact` has half the hop of discs that lean on each other: where a ball of it is a radius away, it
    is unresolved. Times count from when the twins were built.
    """

    def __init__(self, lockstep: Lockstep, engine: str) -> None:
        scene, state = lockstep.scene, lockstep.engines[engine].state()
        self._hands, self._radius = lockstep.applied, scene.bodies.radius
        self._shifted = [lockstep.new_runner(engine, _shifted(state, number)) for number in range(SHIFTED_TWINS)]
        renumbered = lockstep.new_runner(engine, state, partial(RenumberedEngine, lockstep.builds[engine]))
        by_event = isinstance(lockstep.engines[engine].engine, ExactEngine)
        shortest = HOP_TIME if by_event else 1 / scene.rate
        searched = [renumbered, *(self._shifted if by_event else ())]
        self._searches = [_TieSearch(runner, scene, shortest) for runner in searched]
        self._finer = [lockstep.new_runner(engine, state, _finer)] if by_event and any(scene.gravity) else []
        self._horizon: float | None = None
        self._unresolved: float | None = None
        self.runners = [*self._shifted, renumbered, *self._finer]  # those that still run

    def follow(self, original: States, time: Floats) -> None:
        """Do the steps that the original has done since the last call, at some times (s), and compare the states."""
        if not self.runners or not len(time):
            return
        twins = {runner: States.empty(*original.spin.shape) for runner in self.runners}
        for runner, states in twins.items():
            runner.follow(states, self._hands)
        row = min(_first(self._is_away(original, twins[runner])) for runner in self._shifted)
        rows = slice(row + 1)  # what comes after the horizon does not count
        for search in self._searches:
            search.compare(original.rows(rows), twins[search.runner].rows(rows), time[rows])
        for finer in self._finer if self._unresolved is None else ():
            first_away = _first(self._is_away(original.rows(rows), twins[finer].rows(rows)))
            if first_away < len(time[rows]):
                self._unresolved = float(time[first_away])
        if row < len(time):
            self._horizon, self.runners = float(time[row]), []

    def trust(self, contacts: Contacts) -> Trust:
        """Return what is found so far. contacts: all of the original."""
        tie = min((tie for search in self._searches if (tie := search.tie(contacts))), default=None)
        return Trust(self._horizon, tie and tie.time, self._unresolved, tie and tie[1:])

    def _is_away(self, original: States, twin: States) -> Bools:
        """Return whether a ball is more than its radius away, (steps,)."""
        return np.asarray((length(twin.position - original.position) > self._radius).any(axis=1))


class _TieSearch:
    """Searches for a tie in the step after which a twin first differs from the original by more than rounding.

    shortest: s, between two contacts of bodies at rest.
    """

    def __init__(self, runner: Runner, scene: Scene, shortest: float) -> None:
        self.runner = runner
        self.parted: int | None = None
        self._radius, self._clock = scene.bodies.radius, scene.clock
        self._resting = RESTING * math.hypot(*scene.gravity) * shortest * float(scene.bodies.mass.min())
        runner.engine.record_contacts()
        self._theirs = no_contacts()  # contacts of the twin in that step
        self._compared = 0  # steps

    def compare(self, original: States, twin: States, time: Floats) -> None:
        """Compare the states after some steps, each of which is compared once. time: (steps,) s."""
        contacts = self.runner.engine.contacts()
        if self.parted is None and (row := _first(self._is_different(original, twin))) < len(time):
            self.parted = self._clock.step(time[row])
        if self.parted is not None and self._compared <= self.parted:
            self._theirs = np.concatenate([self._theirs, self._hits(contacts)])
        self._compared = self._clock.step(time[-1])

    def tie(self, contacts: Contacts) -> Tie | None:
        """Return the tie at which the twin parts, if that is the reason. contacts: all of the original so far."""
        if self.parted is None:
            return None
        tie = find_tie(self._hits(contacts), self._theirs, together=self.runner.traits.together)
        is_whole = self._compared > self.parted  # rounding may put contacts at the end of the step into the next
        return tie if tie and (is_whole or not self._is_at_end(tie.time)) else None

    def _is_at_end(self, time: Floats | float) -> Bools:
        """Return whether contacts of a time (s) are at the end of the step in which the twin parts."""
        return np.abs(time - self._clock.time(self.parted or 0)) <= 2 * SIMULTANEOUS

    def _hits(self, contacts: Contacts) -> Contacts:
        """Return the contacts in the step in which the twin parts and at its end, without those of bodies at rest."""
        within = (self._clock.steps_containing(contacts["time"]) == self.parted) | self._is_at_end(contacts["time"])
        pressed: Contacts = contacts[within & (contacts["impulse"] > self._resting)]
        return pressed

    def _is_different(self, original: States, twin: States) -> Bools:
        """Return whether a ball's place, velocity or spin differs by more than rounding, (steps,)."""
        offset = length(twin.position - original.position) > PARTED * self._radius
        rim = self._radius * np.abs(original.spin)
        speed = (length(original.velocity) + rim).max(axis=1, keepdims=True)
        change = length(twin.velocity - original.velocity) + self._radius * np.abs(twin.spin - original.spin)
        return np.asarray((offset | (change > PARTED * speed)).any(axis=1))


def _first(holds: Bools) -> int:
    """Return the first row that is true, or the number of rows."""
    return int(holds.argmax()) if holds.any() else len(holds)


def _shifted(state: State, number: int) -> State:
    """Return a state with every coordinate some units in the last place elsewhere; every other twin is opposite."""
    rng, position, sign = np.random.default_rng(number // 2), state.position, (-1) ** number
    units = rng.integers(1, MAX_SHIFT + 1, position.shape) * rng.choice((-1, 1), position.shape)
    return replace(state, position=position + sign * units * np.spacing(position))


def _finer(scene: Scene, initial: State) -> RunningEngine:
    """Build `exact` with half the hop of discs that lean on each other."""
    return ExactEngine(scene, initial, hop_time=HOP_TIME / 2)
