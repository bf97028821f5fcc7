"""The reference: the engine that others are measured against, and until when its own paths mean anything."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from sandbox.engines import REFERENCE
from sandbox.engines.engine import RunningEngine
from sandbox.engines.exact.contact import HOP_TIME
from sandbox.engines.exact.engine import ExactEngine
from sandbox.engines.stand_ins import RenumberedEngine
from sandbox.quantity import length
from sandbox.run.lockstep import Lockstep, Runner
from sandbox.scene.model import Scene
from sandbox.state import Bools, Floats, State, States

SHIFTED_TWINS: Final = 3  # one may happen not to grow: a contact can absorb a shift to the bit
MAX_SHIFT: Final = 8  # units in the last place, of every coordinate of a shifted twin
PARTED: Final = 1e-9  # of a radius or a speed, by which a twin is elsewhere, and not only rounded otherwise
ORDER_MATTERS: Final = 1e-3  # of a speed: in one step, chaos does not make it of PARTED, but another order does
PIECE: Final = 6_000  # steps of a ball that twins do at once, about: after the horizon, they do no more
RESTING: Final = 10  # times what gravity does between two contacts of bodies at rest: a change up to this is no hit


def reference_of(engines: Sequence[str]) -> str:
    """Return the engine that others are measured against by default: the exact one, or else the last."""
    return REFERENCE if REFERENCE in engines else engines[-1]


class Trust(NamedTuple):
    """Until when the paths of the reference mean anything: three times, s, each None if that is to the end.

    ball: one whose simultaneous contacts are undecided.
    """

    horizon: float | None = None
    undecided: float | None = None
    unresolved: float | None = None
    ball: int | None = None

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
    is a radius away. The renumbered twin has its balls in reverse order, and agrees to the bit until the order of
    simultaneous contacts matters: from then on, it is undecided. In an event-driven engine, rounding may order contacts
    too, so that the shifted twins show that as well. Under gravity, the finer twin of `exact` has half the hop of discs
    that lean on each other: where a ball of it is a radius away, it is unresolved. Times count from when the twins were
    built. trust: what they have found so far.
    """

    def __init__(self, lockstep: Lockstep, engine: str) -> None:
        scene, runner = lockstep.scene, lockstep.engines[engine]
        build, state = runner.build, runner.state()
        self.trust = Trust()
        self._hands, self._radius = lockstep.applied, scene.bodies.radius
        self._shifted = [lockstep.new_runner(build, _shifted(state, number)) for number in range(SHIFTED_TWINS)]
        renumbered = lockstep.new_runner(partial(RenumberedEngine, build), state)
        by_event = isinstance(runner.engine, ExactEngine)
        self._finer = [lockstep.new_runner(_finer, state)] if by_event and any(scene.gravity) else []
        self._resting = RESTING * math.hypot(*scene.gravity) * (HOP_TIME if by_event else 1 / scene.rate)  # px/s
        before = np.zeros((2, 2 + len(self._radius)), bool)  # of two rows
        self._differs = dict.fromkeys((renumbered, *(self._shifted if by_event else ())), before)
        self._times = np.zeros(2)  # s, of these rows
        self.runners = [*self._shifted, renumbered, *self._finer]  # those that still run

    def follow(self, original: States, time: Floats) -> None:
        """Do the steps that the original has done since the last call, at some times (s), and compare the states."""
        piece = 1 + PIECE // len(self._radius)
        for begin in range(0, len(time), piece):
            rows = slice(begin, begin + piece)
            if self.runners:
                self._follow(original.rows(rows), time[rows])

    def _follow(self, original: States, time: Floats) -> None:
        twins = {runner: States.empty(*original.spin.shape) for runner in self.runners}
        for runner, states in twins.items():
            runner.follow(states, self._hands)
        end = min(_first(self._is_away(original, twins[runner])) for runner in self._shifted)
        rows = slice(end + 1)  # what comes after the horizon does not count
        times, original = np.concatenate([self._times, time[rows]]), original.rows(rows)
        row, ball = min(self._tie(runner, original, twins[runner].rows(rows)) for runner in self._differs)
        if self.trust.undecided is None and row < len(times):
            self.trust = self.trust._replace(undecided=float(times[row]), ball=ball)
        for finer in self._finer if self.trust.unresolved is None else ():
            if (away := _first(self._is_away(original, twins[finer].rows(rows)))) < len(times) - 2:
                self.trust = self.trust._replace(unresolved=float(times[2 + away]))
        self._times = times[-2:]
        if end < len(time):
            self.trust, self.runners = self.trust._replace(horizon=float(time[end])), []

    def _is_away(self, original: States, twin: States) -> Bools:
        """Return whether a ball is more than its radius away, (steps,)."""
        return np.asarray((length(twin.position - original.position) > self._radius).any(axis=1))

    def _tie(self, runner: Runner, original: States, twin: States) -> tuple[int, int]:
        """Return the row, of the two before these and these, in which the order of contacts matters, and a ball.

        In one step, the velocity of a ball that did not differ does. Where its place does not, as the contact is at the
        step's end, the twin must differ after the next step too: rounding may put a contact there. If the order matters
        in no row, the row is the number of rows.
        """
        offset = length(twin.position - original.position) > PARTED * self._radius
        rim = self._radius * np.abs(original.spin)
        speed = (length(original.velocity) + rim).max(axis=1, keepdims=True)
        change = length(twin.velocity - original.velocity) + self._radius * np.abs(twin.spin - original.spin)
        hit = change > ORDER_MATTERS * speed + self._resting
        rows = [(offset | (change > PARTED * speed)).any(axis=1), (hit & offset).any(axis=1)]
        differs = np.concatenate([self._differs[runner], np.column_stack([*rows, hit])])
        self._differs[runner] = differs[-2:]
        parted, is_sure, hit = differs[:, 0], differs[:, 1].copy(), differs[:, 2:]
        is_sure[:-1] |= parted[1:]
        row = _first(~parted[:-1] & hit[1:].any(axis=1) & is_sure[1:]) + 1
        return row, int(hit[row].argmax()) if row < len(differs) else 0


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
