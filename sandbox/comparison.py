"""Engines in step -> a comparison: how far each is from the yardstick, and what it does to energy and momentum."""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from sandbox.edits import AddBall, DeleteBall, SetGravity, SetRate
from sandbox.engines import Engine, default_engines, takes
from sandbox.gas import Row, beside_theory, is_gas
from sandbox.inputs import Input
from sandbox.mistakes import Mistake, nearest
from sandbox.quantity import deepest_overlap, energy, length, momentum
from sandbox.scene import Scene
from sandbox.spawn import spawn
from sandbox.state import Bools, Contacts, Floats, State
from sandbox.trajectory import Lockstep
from sandbox.truth import Score, score

YARDSTICK: Final = "exact"  # what the others are measured against, wherever it takes part
SAMPLES: Final = 200  # states of a gas, about, whose speeds are held beside their law
BLOCK_BYTES: Final = 32_000_000  # of states kept between two reckonings, an engine


@dataclass(frozen=True)
class Figures:
    """What is said of one engine; the names are those of the JSON and of the CSV."""

    energy_ratio: float | None  # at the end, as a share of the start; None where that was 0
    energy_drift: float | None  # the largest change of that share, at any time
    momentum_drift: float  # that no wall, gravity or hand gave, as a share of all balls' momenta added as lengths
    gap_rms: float  # px from the yardstick, over all balls and times
    gap_max: float  # px, of any ball at any time
    pair_contacts: int
    wall_contacts: int
    max_overlap: float  # px, of two balls at the end of any step
    escaped: int  # balls whose centre is outside the arena at the end
    expected: int  # of the scene's expectations, those that fall into the run
    met: int  # of these, those that the engine meets
    first_difference: None = None
    ledger: None = None


@dataclass(frozen=True)
class Run:
    """What one engine did, over time.

    energy: (steps + 1,) kg px²/s²; momentum: (steps + 1, 2) kg px/s; gap_rms, gap_max: (steps + 1,) px from the
    yardstick over the balls; gap_of_ball: (n,) px, each ball's largest; contacts: in order of time; scores: of the
    scene's expectations that fall into the run; theory: what is expected of a gas, beside what was measured.
    """

    figures: Figures
    energy: Floats
    momentum: Floats
    gap_rms: Floats
    gap_max: Floats
    gap_of_ball: Floats
    contacts: Contacts
    scores: list[Score]
    theory: tuple[Row, ...]
    final: State


@dataclass(frozen=True)
class Comparison:
    """Several engines' runs of one scene. `time` is (steps + 1,) s."""

    scene: Scene
    against: str
    time: Floats
    runs: dict[str, Run]
    horizon: None = None

    def as_json(self) -> dict[str, Any]:
        """Return what `--json` writes."""
        return {
            "scene": self.scene.name,
            "seed": self.scene.seed,
            "rate": self.scene.rate,
            "seconds": float(self.time[-1]),
            "against": self.against,
            "horizon": self.horizon,
            "engines": {
                name: vars(run.figures) | ({"theory": [vars(row) for row in run.theory]} if run.theory else {})
                for name, run in self.runs.items()
            },
        }

    def as_csv(self) -> str:
        """Return what `--csv` writes: a row an engine."""
        common = {"scene": self.scene.name, "seed": self.scene.seed, "rate": self.scene.rate}
        text = io.StringIO()
        figures = [field.name for field in fields(Figures)]
        table = csv.DictWriter(text, [*common, "engine", "seconds", "against", *figures], lineterminator="\n")
        table.writeheader()
        for name, run in self.runs.items():
            row = {"engine": name, "seconds": float(self.time[-1]), "against": self.against}
            table.writerow(common | row | vars(run.figures))
        return text.getvalue()

    def beyond(self, max_gap: float | None = None, max_drift: float | None = None) -> Iterator[str]:
        """Tell which limits are passed: by whom, by how much, and since when."""
        for name, run in self.runs.items():
            drift = np.abs(run.energy / run.energy[0] - 1) if run.energy[0] else np.zeros(1)
            for what, limit, values, unit in (("gap", max_gap, run.gap_max, " px"), ("drift", max_drift, drift, "")):
                if limit is not None and values.max() > limit:
                    since = self.time[int((values > limit).argmax())]
                    yield (
                        f"{name}: {what} {values.max():.6g}{unit} is beyond the limit of {limit:g}{unit}, "
                        f"passed at {since:.3f} s"
                    )


def compare(
    scene: Scene,
    engines: Sequence[str] | None = None,
    *,
    against: str | None = None,
    inputs: Sequence[Input] = (),
) -> Comparison:
    """Run a scene in several engines, all together, for its seconds.

    Where no engines are named: Pymunk, the reference that can honour the scene, and the exact engine. They are
    measured against `against`, which is the exact engine where it takes part, and else the last.
    Raises Mistake for a name that is no engine, Refused where an engine cannot honour the scene.
    """
    for given in inputs:
        if isinstance(given, AddBall | DeleteBall | SetGravity | SetRate):
            raise Mistake(
                "a comparison is of one set of balls, one gravity and one rate; "
                f"sandbox trace follows {given.do!r} at step {given.step}"
            )
    names = list(engines) if engines else _all_by_default(scene)
    against = against or (YARDSTICK if YARDSTICK in names else names[-1])
    if against not in names:
        raise Mistake(f"cannot compare against {against!r}, which does not take part; {nearest(against, names)}")
    lockstep = Lockstep(scene, names, inputs)
    tallies = {name: _Tally(scene, engine) for name, engine in lockstep.engines.items()}
    held = np.zeros(scene.steps + 1, bool)
    block = max(1, BLOCK_BYTES // lockstep.initial.position.nbytes // 2)
    for start in range(0, scene.steps + 1, block):
        states: dict[str, list[State]] = {name: [] for name in names}
        for step in range(start, min(start + block, scene.steps + 1)):
            if step:
                lockstep.step()
                held[step] = lockstep.touched
            for name, state in lockstep.states().items():
                states[name].append(state)
        yardstick = np.stack([state.position for state in states[against]])
        for name, tally in tallies.items():
            tally.add(states[name], yardstick)
            tally.scores += [
                score(scene, expect, lockstep.initial, states[name][round(expect.at * scene.rate) - start])
                for expect in scene.expect
                if start <= round(expect.at * scene.rate) <= lockstep.steps
            ]
    runs = {name: tally.run(held) for name, tally in tallies.items()}
    return Comparison(scene, against, np.arange(scene.steps + 1) / scene.rate, runs)


def _all_by_default(scene: Scene) -> list[str]:
    initial = spawn(scene)
    yardstick = [YARDSTICK] if takes(YARDSTICK, scene, initial) else []
    return default_engines(scene, initial) + yardstick


class _Tally:
    """Reckons up one engine's states, block by block."""

    def __init__(self, scene: Scene, engine: Engine) -> None:
        self.scene = scene
        self.engine = engine
        engine.contacts()  # begins their collecting
        self.contacts: list[Contacts] = []
        self.series: list[Floats] = []  # columns: energy, momentum x and y, momenta as lengths, gap RMS and max
        self.gap_of_ball = np.zeros(len(scene.bodies))
        self.scores: list[Score] = []
        self.velocities: list[Floats] = []  # at some times, where theory has something to say of them
        self.every = max(1, scene.steps // SAMPLES)
        self.overlap = 0.0

    def add(self, states: list[State], yardstick: Floats) -> None:
        """Reckon up some steps. yardstick: (steps, n, 2) px, where the balls should be."""
        scene, bodies = self.scene, self.scene.bodies
        position = np.stack([state.position for state in states])
        velocity = np.stack([state.velocity for state in states])
        gap = length(position - yardstick)
        columns = (
            energy(scene, position, velocity),
            momentum(velocity, bodies.mass),
            length(velocity) @ bodies.mass,
            np.sqrt(np.mean(gap**2, axis=1)),
            gap.max(axis=1),
        )
        self.series.append(np.column_stack(columns))
        if is_gas(scene):
            self.velocities.append(velocity[:: self.every])
        self.gap_of_ball = np.maximum(self.gap_of_ball, gap.max(axis=0))
        self.overlap = max(self.overlap, *(deepest_overlap(state.position, bodies.radius)[0] for state in states))
        self.contacts.append(self.engine.contacts())
        self.final = states[-1]

    def run(self, held: Bools) -> Run:
        """Sum it all up. held: (steps + 1,), whether the hand pulled during the step that led there."""
        joules, px, py, momenta, gap_rms, gap_max = np.concatenate(self.series).T
        total = np.column_stack([px, py])
        contacts = np.concatenate(self.contacts)
        at_wall = contacts[contacts["second"] < 0]
        walled = held.copy()
        walled[np.ceil(at_wall["time"] * self.scene.rate - 1e-6).astype(int)] = True
        change = np.diff(total, axis=0) - np.multiply(
            self.scene.gravity, self.scene.bodies.mass.sum() / self.scene.rate
        )
        from_nowhere = length(np.cumsum(np.where(walled[1:, None], 0.0, change), axis=0))
        outside = ((self.final.position < 0) | (self.final.position > self.scene.arena.size)).any(axis=1)
        figures = Figures(
            energy_ratio=float(joules[-1] / joules[0]) if joules[0] else None,
            energy_drift=float(np.abs(joules / joules[0] - 1).max()) if joules[0] else None,
            momentum_drift=float(from_nowhere.max(initial=0.0) / (momenta.max() or 1.0)),
            gap_rms=float(np.sqrt(np.mean(gap_rms**2))),
            gap_max=float(gap_max.max()),
            pair_contacts=len(contacts) - len(at_wall),
            wall_contacts=len(at_wall),
            max_overlap=float(self.overlap),
            escaped=int(outside.sum()),
            expected=len(self.scores),
            met=sum(one.passed for one in self.scores),
        )
        theory: tuple[Row, ...] = ()
        if self.velocities:
            theory = beside_theory(self.scene, contacts, np.concatenate(self.velocities), self.final.time) or ()
        return Run(
            figures, joules, total, gap_rms, gap_max, self.gap_of_ball, contacts, self.scores, theory, self.final
        )
