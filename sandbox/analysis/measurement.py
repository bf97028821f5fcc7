"""Measuring one engine's run: its energy, momentum and gap over time, its ledger, its differences."""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.difference import Difference, Record, differences
from sandbox.analysis.expectations import Score
from sandbox.analysis.gas import TheoryRow, is_gas, measure_gas, obeys_laws
from sandbox.analysis.ledger import Entry, Ledger, steps_containing
from sandbox.analysis.tunnelling import Passage
from sandbox.quantity import energy, length, momentum, outside
from sandbox.run.lockstep import Runner
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Bools, Contacts, Floats, State

SPEED_SAMPLES: Final = 200  # states of a gas, about, whose speeds are compared with their law


@dataclass(frozen=True)
class Figures:
    """One engine's figures; the names are those of JSON and CSV."""

    energy_ratio: float | None  # at the end, as a fraction of the start; None if that was 0
    energy_drift: float | None  # the largest change of that fraction, at any time
    momentum_drift: float  # unexplained by walls, gravity or mouse, as a fraction of the sum of all balls' |momentum|
    gap_rms: float  # px from the reference, over all balls and times
    gap_max: float  # px, of any ball at any time
    pair_contacts: int
    wall_contacts: int
    max_overlap: float  # px, of two balls at the end of any step
    escaped: int  # balls whose centre is outside the arena at the end
    expected: int  # of the scene's expectations, the number that fall into the run
    met: int  # the number of those that the engine meets
    first_difference: Difference | None  # from the reference
    ledger: tuple[Entry, ...]  # every change of energy, momentum and positions, by its cause


class Escape(NamedTuple):
    """Balls whose centres left the arena."""

    time: float  # s, when the first of them was outside
    ball: int  # the first of them
    balls: int  # how many did
    furthest: float  # px from the arena


@dataclass(frozen=True)
class Run:
    """What one engine did, over time.

    energy: (steps + 1,) kg px²/s²; momentum: (steps + 1, 2) kg px/s; gap_rms, gap_max: (steps + 1,) px from the
    reference over the balls; gap_of_ball: (n,) px, each ball's largest; apart: s, when a ball is first more than its
    radius from the reference's, None if never; contacts: in order of time; differences: from the reference, until the
    two are apart; missed: passages without a reported contact; escape: the balls that left the arena, None if none did;
    scores: for the scene's expectations that fall into the run; theory: figures of a gas, measured and expected; path:
    (frames, n, 2) px, float32, one frame in every so many steps.
    """

    figures: Figures
    energy: Floats
    momentum: Floats
    gap_rms: Floats
    gap_max: Floats
    gap_of_ball: Floats
    apart: float | None
    contacts: Contacts
    differences: tuple[Difference, ...]
    missed: tuple[Passage, ...]
    escape: Escape | None
    scores: list[Score]
    theory: tuple[TheoryRow, ...]
    path: NDArray[np.float32]
    final: State


class Pull(NamedTuple):
    """What the mouse did in a step: the ball that it pulled, and by how much (px/s)."""

    ball: int | None
    dv: Vector


class Measurement:
    """Measures one engine, block by block of states."""

    def __init__(self, scene: Scene, runner: Runner, stride: int, steps: int) -> None:
        self.engine = engine = runner.engine
        engine.contacts()  # starts recording
        self.states: list[State] = []  # not measured yet
        self.pulls: list[Pull] = []  # in the steps that led there
        self.scores: list[Score] = []
        self._scene = scene
        self._stride = stride
        self._ledger = Ledger(scene, together=runner.together)
        self._contacts: list[Contacts] = []
        self._series: list[Floats] = []  # columns: energy, momentum x and y, sum of lengths, gap RMS and max, apart
        self._gap_of_ball = np.zeros(len(scene.bodies))
        self._furthest_outside = np.zeros(len(scene.bodies))  # px from the arena, of each ball
        self._first_outside: tuple[float, int] | None = None  # s, ball
        self._velocities: list[Floats] = []  # at some times, of a scene that theory applies to
        self._velocity_stride = max(1, steps // SPEED_SAMPLES)
        self._pulled: list[Bools] = []
        self._path: list[NDArray[np.float32]] = []
        self._final: State | None = None

    def measure(self, reference: Floats) -> None:
        """Measure the states so far. reference: (steps, n, 2) px, where the reference has the balls in them."""
        scene, bodies = self._scene, self._scene.bodies
        position = np.stack([state.position for state in self.states])
        velocity = np.stack([state.velocity for state in self.states])
        gap = length(position - reference)
        columns = (
            energy(position, velocity, bodies.mass, scene.gravity, scene.arena.size),
            momentum(velocity, bodies.mass),
            length(velocity) @ bodies.mass,
            np.sqrt(np.mean(gap**2, axis=1)),
            gap.max(axis=1),
            (gap > bodies.radius).any(axis=1),
        )
        done = sum(map(len, self._series))
        self._path.append(position[-done % self._stride :: self._stride].astype(np.float32))
        self._series.append(np.column_stack(columns))
        if obeys_laws(scene):
            self._velocities.append(velocity[:: self._velocity_stride])
        self._gap_of_ball = np.maximum(self._gap_of_ball, gap.max(axis=0))
        away = outside(position, scene.arena.size)
        if self._first_outside is None and away.max() > 0:
            step, ball = np.argwhere(away > 0)[0].tolist()
            self._first_outside = (done + step) / scene.rate, ball
        self._furthest_outside = np.maximum(self._furthest_outside, away.max(axis=0))
        self._contacts.append(self.engine.contacts())
        self._enter(position, velocity)
        self._final = self.states[-1]
        self.states.clear()

    def _enter(self, position: Floats, velocity: Floats) -> None:
        """Enter the block in the ledger, with the state before it."""
        pulled = np.array([-1 if pull.ball is None else pull.ball for pull in self.pulls])
        dv = np.array([pull.dv for pull in self.pulls])
        self.pulls.clear()
        self._pulled.append(pulled >= 0)
        if self._final is not None:
            position = np.concatenate([self._final.position[None], position])
            velocity = np.concatenate([self._final.velocity[None], velocity])
            pulled, dv = np.append(-1, pulled), np.concatenate([np.zeros((1, 2)), dv])
        self._ledger.add(position, velocity, self._contacts[-1], pulled, dv)

    def record(self) -> Record:
        """Return the contacts with what the ledger found about them."""
        return Record(np.concatenate(self._contacts), self._ledger.findings, self._ledger.missed)

    def run(self, reference: Record | None, horizon: float | None) -> Run:
        """Return the whole run. reference: its contacts, None for the reference's own run; horizon: s."""
        total_energy, momentum_x, momentum_y, lengths, gap_rms, gap_max, is_apart = np.concatenate(self._series).T
        assert self._final is not None
        total_momentum = np.column_stack([momentum_x, momentum_y])
        record, scene = self.record(), self._scene
        contacts = record.contacts
        at_wall = contacts[contacts["second"] < 0]
        apart = float(is_apart.argmax() / scene.rate) if is_apart.any() else None
        until = min(time for time in (apart, horizon, self._final.time) if time is not None)
        differing = differences(scene, record, reference, until, self._final.time) if reference else ()
        unexplained = self._unexplained_momentum(total_momentum, at_wall)
        start = total_energy[0]
        figures = Figures(
            energy_ratio=float(total_energy[-1] / start) if start else None,
            energy_drift=float(np.abs(total_energy / start - 1).max()) if start else None,
            momentum_drift=float(unexplained.max(initial=0.0) / (lengths.max() or 1.0)),
            gap_rms=float(np.sqrt(np.mean(gap_rms**2))),
            gap_max=float(gap_max.max()),
            pair_contacts=len(contacts) - len(at_wall),
            wall_contacts=len(at_wall),
            max_overlap=self._ledger.max_overlap,
            escaped=int(np.count_nonzero(outside(self._final.position, scene.arena.size) > 0)),
            expected=len(self.scores),
            met=sum(score.passed for score in self.scores),
            first_difference=differing[0] if differing else None,
            ledger=self._ledger.entries(),
        )
        return Run(
            figures=figures,
            energy=total_energy,
            momentum=total_momentum,
            gap_rms=gap_rms,
            gap_max=gap_max,
            gap_of_ball=self._gap_of_ball,
            apart=apart,
            contacts=contacts,
            differences=differing,
            missed=tuple(sorted(record.missed)),
            escape=self._escape(),
            scores=self.scores,
            theory=self._theory(contacts) if is_gas(scene) or horizon is not None else (),
            path=np.concatenate(self._path),
            final=self._final,
        )

    def _escape(self) -> Escape | None:
        if self._first_outside is None:
            return None
        furthest = self._furthest_outside
        return Escape(*self._first_outside, int(np.count_nonzero(furthest)), float(furthest.max()))

    def _unexplained_momentum(self, total: Floats, at_wall: Contacts) -> Floats:
        """Return the momentum not given by walls, gravity or mouse, (steps,) kg px/s. total: (steps + 1, 2)."""
        disturbed = np.concatenate(self._pulled)
        disturbed[steps_containing(at_wall["time"], self._scene.rate)] = True
        fall = np.multiply(self._scene.gravity, self._scene.bodies.mass.sum() / self._scene.rate)
        change = np.diff(total, axis=0) - fall
        return length(np.cumsum(np.where(disturbed[1:, None], 0.0, change), axis=0))

    def _theory(self, contacts: Contacts) -> tuple[TheoryRow, ...]:
        if not self._velocities or self._final is None:
            return ()
        return measure_gas(self._scene, contacts, np.concatenate(self._velocities), self._final.time) or ()
