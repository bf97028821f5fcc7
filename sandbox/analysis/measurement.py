"""Measuring one engine's run, as far as it has come: energy, momentum and gap over time, its ledger, what is wrong."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.difference import MAX_DIFFERENCES
from sandbox.analysis.energy_scale import EnergyScale
from sandbox.analysis.expectations import overlap_in, scores
from sandbox.analysis.figures import IMPACT, Course, Escape, Impacts, Run
from sandbox.analysis.gas import TheoryRow, measure_gas, why_lawless, why_no_gas
from sandbox.engines.engine import traits_of
from sandbox.judge.causes import Cause
from sandbox.judge.judge import Steps
from sandbox.judge.thresholds import NEGLIGIBLE
from sandbox.quantity import deepest_overlap, energy, impulse_of, length, momentum
from sandbox.run.lockstep import Runner
from sandbox.run.mouse import PUSH, after_pushes
from sandbox.scene.fields import Vector
from sandbox.scene.model import Expect, Scene
from sandbox.state import NO_DAMPING, Contacts, Floats, Integers, State, States

MAX_PATH_BYTES: Final = 20_000_000  # of an engine's positions kept; of a long run, one frame in so many
SPEED_SAMPLES: Final = 200  # states of a gas, about, whose speeds are compared with their law
MAX_IMPACTS: Final = 500  # contacts of which a run keeps the motion before and after
ENOUGH: Final = 1e-3  # of a change of velocity, by which reports in single precision, of several substeps, may be off
OF_PLACE: Final = "place"  # the law of flight that leaves velocities right


class Measurement:
    """Measures one engine, block by block.

    states: a block of them; the first is the last of the block before, or the start. pushes: by the mouse and by kicks,
    in the block: the row of the state that the step led to, the ball, and px/s; stride: steps between two frames of the
    path.
    """

    def __init__(self, scene: Scene, runner: Runner, rows: int, steps: int) -> None:
        n = len(scene.bodies)
        self.runner, self._traits, self._scene = runner, traits_of(runner.engine), scene
        self.states = States.empty(rows, n)
        self.pushes: list[tuple[int, int, Vector]] = []
        self.start = state = runner.engine.state()
        self.states.fill(0, state)
        runner.engine.record_contacts()
        self.stride = max(1, 8 * n * (steps + 1) // MAX_PATH_BYTES)
        self._substeps = self._traits.damping.substeps
        if self._substeps > 1:
            runner.substates()  # starts recording
        self._judged = Steps(scene, self._traits.damping, is_soft=self._traits.soft)
        self.scale = EnergyScale(scene, state)
        self._contacts: list[Contacts] = []
        self._impacts: list[Impacts] = [np.empty(0, IMPACT)]
        self._misreports: list[tuple[int, int]] = []
        self._courses: list[Course] = []
        self._entered = 0  # steps
        self._apart: float | None = None  # s
        self._furthest_outside = np.zeros(n)  # px from the arena, of each ball
        self._first_outside: tuple[float, int] | None = None  # s, ball
        self._obeys_laws = not why_lawless(scene)
        self._velocities: list[Floats] = []  # at some times, of a scene that theory applies to
        self._velocity_stride = max(1, steps // SPEED_SAMPLES)
        self._path: list[NDArray[np.float32]] = []
        self.kept: dict[int, State] = {}  # at the steps of expectations

    def keep(self, step: int) -> None:
        """Keep the state after a step of the block."""
        self.kept[step] = self.states.state(step - self._entered, self._scene.clock.time(step)).copy()

    def enter(self, rows: int, reference: Floats | None) -> None:
        """Measure and judge the first rows of the block, and begin another with the last of them.

        reference: (rows, n, 2) px, where the reference has the balls, None if this is the reference.
        """
        scene, clock, done = self._scene, self._scene.clock, self._entered
        states, steps = self.states.rows(slice(rows)), done + np.arange(1, rows)
        self._measure(states.rows(slice(1 if done else 0, rows)), reference, done + bool(done))
        contacts = self.runner.engine.contacts()
        contacts = contacts[np.argsort(contacts["time"], kind="stable")]
        self._contacts.append(contacts)
        pushes, dt = np.array(self.pushes, PUSH), 1 / clock.rates(steps)
        self._judge(states, pushes, dt)
        pushed, step_of = after_pushes(states, pushes), clock.steps_containing(contacts["time"])
        row_of = np.clip(step_of - done, 1, rows - 1)
        first = slice(MAX_IMPACTS - sum(map(len, self._impacts)))
        within = np.clip(contacts["time"] - clock.times(step_of - 1), 0.0, 1 / clock.rates(step_of))
        self._impacts.append(impacts_in(scene, pushed, contacts[first], row_of[first], within[first]))
        if self._traits.reports_contacts and not self._traits.soft and self._traits.damping == NO_DAMPING:
            found = misreports(scene, pushed, states, contacts, row_of, dt)
            self._misreports += [(done + row, ball) for row, ball in found]
        self.scale.follow(scene, states, contacts, done)
        self._entered += rows - 1
        states.fill(0, states.state(-1, 0.0))
        self.pushes.clear()

    def _measure(self, states: States, reference: Floats | None, first: int) -> None:
        """Measure states. reference: of these, or one row more before them; first: the step of the first."""
        scene, bodies, position = self._scene, self._scene.bodies, states.position
        gap = np.zeros(states.spin.shape)
        if reference is not None:
            gap = length(position - reference[-len(position) :])
        self._courses.append(self._course(states, gap))
        if self._apart is None and (apart := (gap > bodies.radius).any(axis=1)).any():
            self._apart = scene.clock.time(first + int(apart.argmax()))
        away = np.maximum(-position, position - scene.arena.size).max(axis=-1)  # px
        if scene.arena.walls and (away > 0).any():
            if self._first_outside is None:
                step, ball = np.argwhere(away > 0)[0].tolist()
                self._first_outside = scene.clock.time(first + step), ball
            self._furthest_outside = np.maximum(self._furthest_outside, away.max(axis=0))
        self._path.append(position[-first % self.stride :: self.stride].astype(np.float32))
        if sum(map(len, self._path)) * 8 * len(bodies) > 2 * MAX_PATH_BYTES:  # there are more steps than expected
            self._path, self.stride = [np.concatenate(self._path)[::2]], 2 * self.stride
        if self._obeys_laws:
            self._velocities.append(states.velocity[-first % self._velocity_stride :: self._velocity_stride].copy())

    def _course(self, states: States, gap: Floats) -> Course:
        """Return the values of some states. gap: (steps, n) px, from the reference."""
        scene, bodies, soft = self._scene, self._scene.bodies, self._traits.soft
        return Course(
            energy=energy(states, bodies, scene.gravity, scene.arena.size),
            touching=np.array([soft and overlap_in(scene, places) > 0 for places in states.position]),
            momentum=momentum(states.velocity, bodies.mass),
            lengths=np.einsum("tn,n->t", length(states.velocity), bodies.mass),
            gap_rms=np.sqrt(np.mean(gap**2, axis=1)),
            gap_max=gap.max(axis=1),
        )

    def _judge(self, states: States, pushes: NDArray[np.void], dt: Floats) -> None:
        """Judge a block's steps, or their substeps."""
        if self._substeps > 1:
            first, substates, pushes = states.rows(slice(1)), self.runner.substates(), pushes.copy()
            states = States(*map(np.concatenate, zip(first, substates, strict=True)))
            pushes["row"] = (pushes["row"] - 1) * self._substeps + 1
            dt = np.repeat(dt / self._substeps, self._substeps)
        self._judged.add(states, pushes, dt)

    def run(
        self, reference: Run | None, trusted_until: float | None, expects: Sequence[Expect], *, disturbed: bool
    ) -> Run:
        """Return the run so far.

        reference: None for its own; trusted_until: s, when its paths mean nothing; expects: to be scored; disturbed: if
        balls were pushed.
        """
        scene, bodies, course = self._scene, self._scene.bodies, Course.joined(self._courses)
        contacts = np.concatenate(self._contacts)
        verdict = self._judged.verdict().of_steps(self._substeps)
        final = self.states.state(0, scene.clock.time(self._entered)).copy()
        energy_scale = reference.energy_scale if reference else self.scale.value
        trusted = math.inf if trusted_until is None else trusted_until
        means_energy = math.inf if scene.keeps_energy and not disturbed else trusted
        return Run(
            **vars(course),
            scene=scene,
            energy_scale=energy_scale,
            energy_gap=self._energy_gap(course, (reference or course).energy, energy_scale, means_energy),
            apart=self._apart if self._apart is not None and self._apart < trusted else None,
            max_overlap=max(verdict.overlap, deepest_overlap(final.position, bodies.radius, bodies.filters)[0]),
            contacts=contacts,
            reports_contacts=self._traits.reports_contacts,
            impacts=np.concatenate(self._impacts),
            misreports=() if any(law != OF_PLACE for law in verdict.flights) else tuple(self._misreports),
            gained=verdict.gained,
            ledger=verdict.ledger,
            errors=verdict.errors[: MAX_DIFFERENCES if reference and course.gap_max.any() else 0].copy(),
            flights=verdict.flights,
            missed=int(np.count_nonzero(verdict.errors["cause"] == Cause.MISSED)),
            causes=verdict.causes,
            is_spinless=verdict.is_spinless,
            escape=self._escape(),
            scores=tuple(scores(scene, expects, self.start, self.kept, energy_scale, "the run ends before")),
            theory=self._theory(contacts, final.time) if trusted_until is not None or not why_no_gas(scene) else (),
            path=np.concatenate(self._path),
            start=self.start,
            final=final,
        )

    def _energy_gap(self, course: Course, reference: Floats, scale: float, until: float) -> Floats:
        """Return `Run.energy_gap`. reference, scale: kg px²/s²; until: s, when the reference's energy means nothing.

        An engine may be a step late, or early, with a loss of energy that the scene asks for: the difference is from
        the range of the reference's energy, from a step before to a step after. After an edit, an engine may begin with
        another energy than the reference, which is no error of what follows.
        """
        padded = np.pad(reference + (course.energy[0] - reference[0]), 1, mode="edge")
        around = np.stack([padded[:-2], padded[1:-1], padded[2:]])
        off = np.maximum(course.energy - around.max(axis=0), 0.0) + np.minimum(course.energy - around.min(axis=0), 0.0)
        gap: Floats = off / (scale or np.nan)
        unknown = course.touching | (np.arange(len(gap)) >= self._scene.clock.steps(until) * (1 - NEGLIGIBLE))
        gap[1:][unknown[1:]] = np.nan
        return gap

    def _escape(self) -> Escape | None:
        furthest, first = self._furthest_outside, self._first_outside
        return Escape(*first, int(np.count_nonzero(furthest)), float(furthest.max())) if first else None

    def _theory(self, contacts: Contacts, seconds: float) -> tuple[TheoryRow, ...]:
        if not self._obeys_laws or not self._traits.reports_contacts:
            return ()
        return measure_gas(self._scene, contacts, np.concatenate(self._velocities), seconds)


# What reported contacts do. The states are what an engine is judged by; reports are only compared with them.


def impacts_in(scene: Scene, states: States, contacts: Contacts, rows: Integers, within: Floats) -> Impacts:
    """Return the motion before and after each contact, one after another: (k,) IMPACT.

    states: after the pushes, of steps + 1 rows, the first before the steps; rows: (k,) that each contact's step leads
    to, and within: s since that step began.
    """
    impacts, bodies, push = np.zeros(len(contacts), IMPACT), scene.bodies, impulse_of(contacts)
    motion, pull = np.dstack([states.velocity, states.spin]), np.append(scene.gravity, 0.0)
    now, last = motion[0], (0, 0.0)
    for k, (row, time) in enumerate(zip(rows.tolist(), within.tolist(), strict=True)):
        if row != last[0]:
            now, last = motion[row - 1].copy(), (row, 0.0)
        now += pull * (time - last[1])
        last = row, time
        for side, ball in enumerate(contacts[["first", "second"]][k]):
            if ball >= 0:
                impacts["before"][k, side] = now[ball]
                now[ball, :2] += (1 if side else -1) * push[k] / bodies.mass[ball]
                now[ball, 2] -= contacts["tangential"][k] * bodies.radius[ball] / bodies.moment[ball]
                impacts["after"][k, side] = now[ball]
    return impacts


def misreports(
    scene: Scene, pushed: States, states: States, contacts: Contacts, rows: Integers, dt: Floats
) -> list[tuple[int, int]]:
    """Return each row to which reported contacts change a ball otherwise than it changed, and the first such ball.

    states: of steps + 1 rows; pushed: these after the pushes with which the next step begins; rows: (k,) that each
    contact's step leads to; dt: (steps,) s.
    """
    mass, push = scene.bodies.mass, impulse_of(contacts)
    fallen = pushed.velocity[:-1] + np.multiply.outer(dt, scene.gravity)[:, None]
    seen, reported = states.velocity[1:] - fallen, np.zeros_like(fallen)
    for ball, sign in ((contacts["first"], -1), (contacts["second"], 1)):
        is_ball = ball >= 0
        given = sign * push[is_ball] / mass[ball[is_ball], None]
        np.add.at(reported, (rows[is_ball] - 1, ball[is_ball]), given)
    fastest = float(max(length(fallen).max(initial=0.0), length(states.velocity).max()))
    off = length(seen - reported) > ENOUGH * np.maximum(length(seen), length(reported)) + ENOUGH**2 * fastest
    off &= (states.velocity[1:] != pushed.velocity[:-1]).any(axis=2)  # what rests need report nothing
    return [(step + 1, int(off[step].argmax())) for step in np.flatnonzero(off.any(axis=1)).tolist()]
