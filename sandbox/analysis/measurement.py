"""Measuring one engine's run: its energy, momentum and gap over time, its ledger, its differences."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.difference import Difference, Passage, difference_at_start, differences, passages
from sandbox.analysis.gas import TheoryRow, is_gas, measure_gas, obeys_laws
from sandbox.analysis.impacts import IMPACT, MAX_IMPACTS, Impacts, impacts_in
from sandbox.analysis.misreports import Misreport, Reports
from sandbox.judge.causes import NEGLIGIBLE
from sandbox.judge.judge import Judge
from sandbox.judge.ledger import Entry, entries_of
from sandbox.judge.timeline import Suffered, Timeline
from sandbox.quantity import angular_momentum, centre_of_mass, deepest_overlap, energy, length, momentum, outside
from sandbox.run.lockstep import Runner
from sandbox.scene.fields import Vector
from sandbox.scene.model import Expect, Scene
from sandbox.scores.energy_scale import EnergyScale
from sandbox.scores.expectations import Score, overlap_in, score
from sandbox.state import NO_DAMPING, PUSH, Bools, Contacts, Floats, Integers, State, States

SPEED_SAMPLES: Final = 200  # states of a gas, about, whose speeds are compared with their law


@dataclass(frozen=True)
class Figures:
    """One engine's figures; the names are those of JSON and CSV. What an engine does not report is None."""

    energy_ratio: float | None  # at the end: 1 + the change as a fraction of the comparison's scale; None if that is 0
    energy_drift: float | None  # the largest change of that, at any time
    energy_error: float | None  # the largest of `Run.energy_gap`, as a magnitude
    momentum_drift: float | None  # no wall, gravity or mouse gave it; as a fraction of the sum of all balls' |momentum|
    angular_momentum_drift: float | None  # likewise of angular momentum about the arena's centre, of flight and spin
    gap_rms: float  # px from the reference, over all balls and times
    gap_max: float  # px, of any ball at any time
    pair_contacts: int | None
    wall_contacts: int | None
    max_overlap: float  # px, of two balls at the end of any step
    escaped: int  # balls whose centre was outside the arena's walls at any step
    expected: int  # of the scene's expectations, the number that fall into the run and can be judged
    met: int  # the number of those that the engine meets
    skipped: int  # expectations that fall into the run and cannot be judged, because a contact is next to their time
    first_difference: Difference | None  # from the reference
    ledger: tuple[Entry, ...]  # every change of energy, momentum and positions, by its cause


def keeps_energy(scene: Scene) -> bool:
    """Return whether no contact of a scene takes or gives energy, so that it is known beyond every horizon."""
    factors = [*(wall.elasticity for wall in scene.surfaces), *scene.bodies.elasticity]
    return all(factor == 1 for factor in factors) and not scene.bodies.friction.any()


class Escape(NamedTuple):
    """Balls whose centres left the arena."""

    time: float  # s, when the first of them was outside
    ball: int  # the first of them
    balls: int  # how many did
    furthest: float  # px from the arena
    left: int  # how many are still outside at the end


@dataclass(frozen=True, repr=False)
class Run:
    """What one engine did, over time.

    energy: (steps + 1,) kg px²/s²; energy_scale: kg px²/s², the `EnergyScale` of the reference, which all shares of
    energy are of, 0 if nothing moves; energy_gap: (steps + 1,) the difference from the reference's energy as a fraction
    of the scale, give or take a step, NaN where the reference's energy means nothing and where soft contacts hold part
    of the engine's; momentum: (steps + 1, 2) kg px/s; angular_momentum: (steps + 1,) kg px²/s, about the arena's
    centre; centre_of_mass: (steps + 1, 2) px;
    gap_rms, gap_max: (steps + 1,) px from the reference over the balls; gap_of_ball: (n,) px, each ball's largest;
    apart: s, when a ball is first more than its radius from the reference's, None if never while the reference's paths
    mean anything; contacts: as reported, in order of time; impacts: the motion before and after the first MAX_IMPACTS
    of them; differences: its wrong steps, in order; missed: the contacts that did not happen; escape: the balls that
    left the arena, None if none did; suffered: what the run suffers from, the worst first; misreport: where the
    contacts reported are others than what the balls did; scores: for the scene's expectations that fall into the run;
    theory: figures of a gas, measured and expected; path:
    (frames, n, 2) px, float32, one frame in every so many steps.
    """

    figures: Figures
    energy: Floats
    energy_scale: float
    energy_gap: Floats
    momentum: Floats
    angular_momentum: Floats
    centre_of_mass: Floats
    gap_rms: Floats
    gap_max: Floats
    gap_of_ball: Floats
    apart: float | None
    contacts: Contacts
    impacts: Impacts
    differences: tuple[Difference, ...]
    missed: tuple[Passage, ...]
    escape: Escape | None
    suffered: tuple[Suffered, ...]
    misreport: Misreport | None
    scores: list[Score]
    theory: tuple[TheoryRow, ...]
    path: NDArray[np.float32]
    final: State

    @property
    def energy_change(self) -> Floats:
        """The energy since the start, as a fraction of the scale: (steps + 1,), NaN if that is 0."""
        return change_of(self.energy, self.energy_scale)

    def __repr__(self) -> str:
        return (
            f"<Run: {len(self.energy) - 1} steps, {len(self.contacts)} contacts, RMS gap {self.figures.gap_rms:.4g} px>"
        )


def change_of(energy: Floats, scale: float) -> Floats:
    """Return by how much an energy (kg px²/s²) has changed since its first value, as a fraction of a scale."""
    change: Floats = (energy - energy[0]) / (scale or np.nan)
    return change


class MeasuredReference(Protocol):
    """What a run is compared with, once all steps are done.

    start: its first state; energy: (steps + 1,) kg px²/s²; energy_scale: kg px²/s²; timeline: what is wrong with it.
    """

    @property
    def start(self) -> State: ...  # noqa: D102  # said above

    @property
    def energy(self) -> Floats: ...  # noqa: D102

    @property
    def energy_scale(self) -> float: ...  # noqa: D102

    @property
    def timeline(self) -> Timeline: ...  # noqa: D102


class Measurement:
    """Measures one engine, as its states come in.

    states: (rows, n, 2), a block of them; the first is the last of the block before, or the start. pushes: by the mouse
    and by kicks, in the block so far: the row of the state that the step led to, the ball, and px/s.
    """

    def __init__(self, scene: Scene, runner: Runner, rows: int, stride: int, steps: int) -> None:
        n = len(scene.bodies)
        self.runner, self._traits = runner, runner.traits
        self.states = States.empty(rows, n)
        self.pushes: list[tuple[int, int, Vector]] = []
        self.start = state = runner.engine.state()
        self.states.fill(0, state)
        runner.engine.record_contacts()
        self._scene = scene
        self._stride = stride
        self._substeps = self._traits.damping.substeps
        if self._substeps > 1:
            runner.substates()  # starts recording
        self._judge = Judge(scene, self._traits.damping)
        self._max_overlap = deepest_overlap(state.position, scene.bodies.radius)[0]  # px
        self.scale = EnergyScale(scene, state)
        self._contacts: list[Contacts] = []
        self._impacts: list[Impacts] = [np.empty(0, IMPACT)]
        self._reports = Reports(scene)
        traits = self._traits
        self._are_reports_known = traits.reports_contacts and not traits.soft and traits.damping == NO_DAMPING
        self.energy = np.empty(steps + 1)  # kg px²/s², after each step
        self._touching = np.zeros(steps + 1, bool)  # whether a soft contact holds part of the energy
        self._momentum = np.empty((steps + 1, 2))
        self._centre_of_mass = np.empty((steps + 1, 2))  # px
        self._entered = 0  # steps
        self._lengths = np.empty(steps + 1)  # sum of the lengths of all momenta, kg px/s
        self._centre = np.divide(scene.arena.size, 2)
        self._angular_momentum = np.empty(steps + 1)  # about the centre, kg px²/s
        self._levers = np.empty(steps + 1)  # the most that it can be at these speeds and spins, kg px²/s
        self._gap_rms, self._gap_max = np.empty(steps + 1), np.empty(steps + 1)
        self._apart: tuple[float, int] | None = None  # s, ball
        self._gap_of_ball = np.zeros(n)
        self._furthest_outside = np.zeros(n)  # px from the arena, of each ball
        self._first_outside: tuple[float, int] | None = None  # s, ball
        self._obeys_laws = obeys_laws(scene)
        self._velocities: list[Floats] = []  # at some times, of a scene that theory applies to
        self._velocity_stride = max(1, steps // SPEED_SAMPLES)
        self._path: list[NDArray[np.float32]] = []
        self._expected: dict[int, tuple[Expect, State, State]] = {}  # with the states before and after its time
        self._skipped: dict[int, Score] = {}

    def measure(self, rows: slice, reference: Floats | None, before: int) -> None:
        """Measure some of the states.

        reference: (steps, n, 2) px, where the reference has the balls in them, None if this is the reference; before:
        the steps of the run before the first row of the block.
        """
        scene, bodies = self._scene, self._scene.bodies
        states = self.states.rows(rows)
        position, velocity = states.position, states.velocity
        first = before + rows.start
        steps = slice(first, first + len(position))
        gap = np.zeros(position.shape[:2]) if reference is None else length(position - reference)
        self.energy[steps] = energy(states, bodies, scene.gravity, scene.arena.size)
        if self._traits.soft:
            self._touching[steps] = [overlap_in(scene, places) > 0 for places in position]
        self._momentum[steps] = momentum(velocity, bodies.mass)
        self._centre_of_mass[steps] = centre_of_mass(position, bodies.mass)
        speed = length(velocity)
        self._lengths[steps] = np.einsum("tn,n->t", speed, bodies.mass)
        about_centre = states._replace(position=position - self._centre)
        self._angular_momentum[steps] = angular_momentum(about_centre, bodies)
        self._levers[steps] = np.einsum("tn,tn,n->t", length(about_centre.position), speed, bodies.mass)
        self._levers[steps] += np.einsum("tn,n->t", np.abs(states.spin), bodies.moment)
        self._gap_rms[steps] = np.sqrt(np.mean(gap**2, axis=1))
        self._gap_max[steps] = gap.max(axis=1)
        self._gap_of_ball = np.maximum(self._gap_of_ball, gap.max(axis=0))
        if self._apart is None and (apart := gap > bodies.radius).any():
            step, ball = np.argwhere(apart)[0].tolist()
            self._apart = scene.clock.time(first + step), ball
        if scene.arena.walls and (position.min() < 0 or (position > scene.arena.size).any()):
            self._note_escapes(outside(position, scene.arena.size), first)
        self._path.append(position[-first % self._stride :: self._stride].astype(np.float32))
        if self._obeys_laws:
            self._velocities.append(velocity[-first % self._velocity_stride :: self._velocity_stride].copy())

    def _note_escapes(self, away: Floats, first: int) -> None:
        """Note who left the arena. away: (steps, n) px from it, negative inside; first: the step of the first row."""
        if self._first_outside is None:
            step, ball = np.argwhere(away > 0)[0].tolist()
            self._first_outside = self._scene.clock.time(first + step), ball
        self._furthest_outside = np.maximum(self._furthest_outside, away.max(axis=0))

    def expect(self, number: int, expect: Expect, rows: tuple[int, int], before: int) -> None:
        """Keep the states of the rows around the time of an expectation; before: as in `measure`."""
        first, last = (self.states.state(row, self._scene.clock.time(before + row)).copy() for row in rows)
        self._expected[number] = expect, first, last

    def skip(self, number: int, expect: Expect) -> None:
        """Score an expectation that falls between the last step and the end of the run."""
        self._skipped[number] = Score(expect, skipped=f"the last step ends before {expect.at:g} s")

    def enter(self, rows: int) -> None:
        """Enter the first rows of the block in the ledger, and begin another block with the last of them."""
        contacts = self.runner.engine.contacts()
        if (np.diff(contacts["time"]) < 0).any():
            contacts = contacts[np.argsort(contacts["time"], kind="stable")]
        self._contacts.append(contacts)
        states = self.states.rows(slice(rows))
        pushes = np.array(self.pushes, PUSH)
        steps, clock = self._entered + np.arange(1, rows), self._scene.clock
        self._judge_steps(states, pushes, 1 / clock.rates(steps))
        pushed = states.after_pushes(pushes)
        step_of = clock.steps_containing(contacts["time"])
        row_of = np.clip(step_of - self._entered, 1, rows - 1)
        self._add_impacts(pushed, contacts, step_of, row_of)
        if self._are_reports_known:
            self._reports.add(pushed, contacts, row_of, 1 / clock.rates(steps), self._entered)
        deepest = (deepest_overlap(position, self._scene.bodies.radius)[0] for position in states.position[1:])
        self._max_overlap = max(self._max_overlap, *deepest)
        self.scale.follow(self._scene, states, contacts, self._entered)
        self._entered += rows - 1
        states.fill(0, states.state(-1, 0.0))
        self.pushes.clear()

    def _judge_steps(self, states: States, pushes: NDArray[np.void], dt: Floats) -> None:
        """Judge a block's steps, or their substeps."""
        if self._substeps > 1:
            first, substates, pushes = states.rows(slice(1)), self.runner.substates(), pushes.copy()
            states = States(*map(np.concatenate, zip(first, substates, strict=True)))
            pushes["row"] = (pushes["row"] - 1) * self._substeps + 1
            dt = np.repeat(dt / self._substeps, self._substeps)
        self._judge.add(states, pushes, dt)

    def _add_impacts(self, states: States, contacts: Contacts, step_of: Integers, rows: Integers) -> None:
        """Keep the motion before and after each contact of a block, of the first MAX_IMPACTS.

        step_of: (k,), the step that each contact is in; rows: (k,), of the states that these lead to.
        """
        most, clock = MAX_IMPACTS - sum(map(len, self._impacts)), self._scene.clock
        contacts, step_of, rows = contacts[:most], step_of[:most], rows[:most]
        within = np.clip(contacts["time"] - clock.times(step_of - 1), 0.0, 1 / clock.rates(step_of))
        together = self._traits.together
        self._impacts.append(impacts_in(self._scene, states, contacts, rows, within, together=together))

    @property
    def _final(self) -> State:
        """The last state, once all are entered."""
        return self.states.state(0, self._scene.clock.time(len(self.energy) - 1)).copy()

    @cached_property
    def contacts(self) -> Contacts:
        """The contacts as reported, by time, once all steps are entered."""
        return np.concatenate(self._contacts)

    @cached_property
    def timeline(self) -> Timeline:
        """What is wrong with the run, once all steps are entered."""
        return Timeline(self._judge)

    def run(
        self,
        reference: "MeasuredReference | None",
        trusted_until: float | None,
        disturbed: Bools,
    ) -> Run:
        """Return the whole run.

        reference: None for the reference's own run; trusted_until: s, when its paths first mean nothing, None if they
        do to the end; disturbed: (steps + 1,), whether a ball was pushed in the step that led to each state.
        """
        scene, contacts, final = self._scene, self.contacts, self._final
        energy_scale = reference.energy_scale if reference else self.scale.value
        trusted = math.inf if trusted_until is None else trusted_until
        means_energy = math.inf if keeps_energy(scene) and not disturbed.any() else trusted
        energy_gap = self._energy_gap(reference.energy if reference else self.energy, energy_scale, means_energy)
        differing = self._differences(reference) if reference else ()
        scores, escape = self._scores(energy_scale), self._escape(final)
        return Run(
            figures=self._figures(energy_scale, energy_gap, differing, scores, escape),
            energy=self.energy,
            energy_scale=energy_scale,
            energy_gap=energy_gap,
            momentum=self._momentum,
            angular_momentum=self._angular_momentum,
            centre_of_mass=self._centre_of_mass,
            gap_rms=self._gap_rms,
            gap_max=self._gap_max,
            gap_of_ball=self._gap_of_ball,
            apart=self._apart[0] if self._apart and self._apart[0] < trusted else None,
            contacts=contacts,
            impacts=np.concatenate(self._impacts),
            differences=differing,
            missed=passages(self.timeline),
            escape=escape,
            suffered=self.timeline.suffered,
            misreport=self._reports.found(self.timeline.errors),
            scores=scores,
            theory=self._theory(contacts, final.time) if is_gas(scene) or trusted_until is not None else (),
            path=np.concatenate(self._path),
            final=final,
        )

    def _figures(
        self,
        scale: float,
        energy_gap: Floats,
        differing: Sequence[Difference],
        scores: Sequence[Score],
        escape: Escape | None,
    ) -> Figures:
        """Return the figures of the run. scale: of energy, kg px²/s²; the others: as in `Run`."""
        pairs = int(np.count_nonzero(self.contacts["second"] >= 0))
        change = change_of(self.energy, scale)
        gained = self.timeline.gained(len(self.energy) - 1)
        return Figures(
            energy_ratio=float(1 + change[-1]) if scale else None,
            energy_drift=float(np.abs(change)[~self._touching].max(initial=0.0)) if scale else None,
            energy_error=float(np.nanmax(np.abs(energy_gap))) if scale else None,
            momentum_drift=_largest(length(gained[:, :2]), self._lengths),
            angular_momentum_drift=_largest(np.abs(gained[:, 2]), self._levers),
            gap_rms=float(np.sqrt(np.mean(self._gap_rms**2))),
            gap_max=float(self._gap_max.max()),
            pair_contacts=pairs if self._traits.reports_contacts else None,
            wall_contacts=len(self.contacts) - pairs if self._traits.reports_contacts else None,
            max_overlap=self._max_overlap,
            escaped=escape.balls if escape else 0,
            expected=sum(not each.skipped for each in scores),
            met=sum(each.passed for each in scores if not each.skipped),
            skipped=sum(bool(each.skipped) for each in scores),
            first_difference=differing[0] if differing else None,
            ledger=entries_of(self.timeline.sums),
        )

    def _differences(self, reference: "MeasuredReference") -> tuple[Difference, ...]:
        """Return what is wrong with the run; if nothing is, what is wrong with the reference, where the two differ."""
        start, timeline = difference_at_start(self._scene, self.start, reference.start), self.timeline
        if not self._gap_max.any() and not start:
            return ()
        if timeline.errors:
            return (*([start] if start else []), *differences(self._scene, timeline))
        if start:
            return (start,)
        return differences(self._scene, reference.timeline, in_reference=True)

    def _scores(self, energy_scale: float) -> list[Score]:
        """Return the scores of the expectations that fall into the run, in their order in the scene."""
        scored = {
            number: score(self._scene, expect, self.start, before, after, energy_scale)
            for number, (expect, before, after) in self._expected.items()
        }
        return [of_one for _, of_one in sorted((scored | self._skipped).items())]

    def _energy_gap(self, reference: Floats, scale: float, until: float) -> Floats:
        """Return `Run.energy_gap`.

        reference: (steps + 1,) kg px²/s²; scale: kg px²/s²; until: s, when the reference's energy first means nothing.

        A time-stepped engine may be a step late, or early, with a loss of energy that the scene asks for. So the
        difference is from the range of the reference's energy, from a step before to a step after.
        """
        around = np.stack(
            [np.append(reference[:1], reference[:-1]), reference, np.append(reference[1:], reference[-1:])]
        )
        above = np.maximum(self.energy - around.max(axis=0), 0.0)
        below = np.minimum(self.energy - around.min(axis=0), 0.0)
        gap: Floats = (above + below) / (scale or np.nan)
        gap[1:][self._touching[1:]] = np.nan
        gap[1:][np.arange(1, len(gap)) >= self._scene.clock.steps(until) * (1 - NEGLIGIBLE)] = np.nan
        return gap

    def _escape(self, final: State) -> Escape | None:
        if self._first_outside is None:
            return None
        furthest, left = self._furthest_outside, outside(final.position, self._scene.arena.size) > 0
        return Escape(
            *self._first_outside, int(np.count_nonzero(furthest)), float(furthest.max()), int(np.count_nonzero(left))
        )

    def _theory(self, contacts: Contacts, seconds: float) -> tuple[TheoryRow, ...]:
        if not self._obeys_laws or not self._traits.reports_contacts:
            return ()
        return measure_gas(self._scene, contacts, np.concatenate(self._velocities), seconds) or ()


def _largest(gained: Floats, scale: Floats) -> float:
    """Return the largest of what was gained up to each step, as a fraction of the largest of a scale."""
    return float(gained.max(initial=0.0) / (scale.max() or 1.0))
