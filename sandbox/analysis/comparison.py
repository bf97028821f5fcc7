"""Engines in step -> a comparison: how far each is from the reference, since when, and why."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.difference import Account, Difference, differences
from sandbox.analysis.expectations import Score, score
from sandbox.analysis.gas import Row, beside_theory, is_gas, obeys_laws
from sandbox.analysis.ledger import Entry, Ledger, step_at
from sandbox.analysis.reference import REFERENCE, Twin, reference_of
from sandbox.analysis.tunnelling import Passage
from sandbox.engines import can_run, default_engines
from sandbox.errors import SandboxError, nearest
from sandbox.quantity import energy, length, momentum, outside
from sandbox.run.inputs import Input, clock_of
from sandbox.run.lockstep import Lockstep, Runner
from sandbox.scene.model import Scene, Vector
from sandbox.scene.spawn import spawn
from sandbox.state import Bools, Contacts, Floats, State
from sandbox.text import csv_text

SAMPLES: Final = 200  # states of a gas, about, whose speeds are held beside their law
BLOCK_BYTES: Final = 32_000_000  # of states kept between two reckonings, an engine
PATH_BYTES: Final = 20_000_000  # of positions kept of a run, an engine
PACE: Final = 64  # steps between two words on how far a run is


@dataclass(frozen=True)
class Figures:
    """What is said of one engine; the names are those of the JSON and of the CSV."""

    energy_ratio: float | None  # at the end, as a share of the start; None where that was 0
    energy_drift: float | None  # the largest change of that share, at any time
    momentum_drift: float  # that no wall, gravity or hand gave, as a share of all balls' momenta added as lengths
    gap_rms: float  # px from the reference, over all balls and times
    gap_max: float  # px, of any ball at any time
    pair_contacts: int
    wall_contacts: int
    max_overlap: float  # px, of two balls at the end of any step
    escaped: int  # balls whose centre is outside the arena at the end
    expected: int  # of the scene's expectations, those that fall into the run
    met: int  # of these, those that the engine meets
    first_difference: Difference | None  # the first contact that is not as the reference has it
    ledger: tuple[Entry, ...]  # every change of energy, momentum and places, by its cause


class Outing(NamedTuple):
    """Balls whose centres left the arena."""

    time: float  # s, when the first of them was outside
    ball: int  # the first of them
    balls: int  # how many did
    furthest: float  # px from the arena


@dataclass(frozen=True)
class Run:
    """What one engine did, over time.

    energy: (steps + 1,) kg px²/s²; momentum: (steps + 1, 2) kg px/s; gap_rms, gap_max: (steps + 1,) px from the
    reference over the balls; gap_of_ball: (n,) px, each ball's largest; apart: s, since when a ball is further than its
    radius from the reference's; contacts: in order of time; differences: those that are not as the reference has them,
    while the two are not apart; missed: where it told of no contact and should have; outing: the balls that left the
    arena, if any did; scores: of the scene's expectations that fall into the run; theory: what is expected of
    a gas, beside what was measured; path: (frames, n, 2) px, float32, of every so many steps.
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
    outing: Outing | None
    scores: list[Score]
    theory: tuple[Row, ...]
    path: NDArray[np.float32]
    final: State


@dataclass(frozen=True)
class Comparison:
    """Several engines' runs of one scene.

    since: s, when the last edit was, if there was one: the comparison is of what follows, and all its times count from
    there; time: (steps + 1,) s; horizon: s, when a twin of the reference, begun with its first ball one unit in the
    last place to the right, has a ball a radius away; None where that is later than the end; stride: steps between two
    frames of the runs' paths; inputs: what was replayed into all of them.
    """

    scene: Scene
    against: str
    since: float
    time: Floats
    runs: dict[str, Run]
    horizon: float | None
    stride: int
    inputs: tuple[Input, ...]

    def as_json(self) -> dict[str, Any]:
        """Return what `--json` writes."""
        return {
            "scene": self.scene.name,
            "seed": self.scene.seed,
            "rate": self.scene.rate,
            "since": self.since,
            "seconds": float(self.time[-1]),
            "against": self.against,
            "horizon": self.horizon,
            "engines": {name: self._of_engine(run) for name, run in self.runs.items()},
        }

    def _of_engine(self, run: Run) -> dict[str, Any]:
        start = float(run.energy[0])
        told = asdict(run.figures)
        told["ledger"] = {
            entry.cause: {key: value for key, value in asdict(entry).items() if key != "cause"}
            | {"share": entry.energy / start if start else None}
            for entry in run.figures.ledger
        }
        if run.theory:
            told["theory"] = {
                row.figure: {key: value for key, value in asdict(row).items() if key != "figure"} for row in run.theory
            }
        return told

    def as_csv(self) -> str:
        """Return what `--csv` writes: a row an engine, with what is nested under dotted names."""
        document = self.as_json()
        common = {key: value for key, value in document.items() if key != "engines"}
        rows = [{"engine": name} | common | flat(told) for name, told in document["engines"].items()]
        columns = list(dict.fromkeys(key for row in rows for key in row))
        return csv_text([columns, *([row.get(key) for key in columns] for row in rows)])

    def _repr_html_(self) -> str | None:
        """Return what a notebook shows: the report, once `sandbox.report` has registered how to make it."""
        return _notebook_html(self) if _notebook_html else None

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


_notebook_html: Callable[[Comparison], str] | None = None


def show_in_notebooks(html: Callable[[Comparison], str]) -> None:
    """Register what makes the HTML by which a notebook shows a comparison."""
    global _notebook_html  # noqa: PLW0603  (the one registration there is)
    _notebook_html = html


def flat(told: Mapping[str, Any], under: str = "") -> dict[str, Any]:
    """Bring nested tables onto one level: {"a": {"b": 1}} is {"a.b": 1}."""
    level: dict[str, Any] = {}
    for key, value in told.items():
        level |= flat(value, f"{under}{key}.") if isinstance(value, dict) else {f"{under}{key}": value}
    return level


def compare(
    scene: Scene,
    engines: Sequence[str] | None = None,
    *,
    against: str | None = None,
    inputs: Sequence[Input] = (),
    progress: Callable[[float], object] | None = None,
) -> Comparison:
    """Run a scene in several engines, all together, for its seconds.

    Where no engines are named: Pymunk, the reference that can honour the scene, and the exact engine. They are
    measured against `against`, which is the exact engine where it takes part, and else the last. Where inputs edit the
    scene, the comparison is of what follows the last edit. `progress` is told now and then which share of the run is
    done.
    Raises SandboxError for a name that is no engine, Refused where an engine cannot honour the scene.
    """
    names = list(engines) if engines else _all_by_default(scene)
    against = against or reference_of(names)
    if against not in names:
        raise SandboxError(f"cannot compare against {against!r}, which does not take part; {nearest(against, names)}")
    lockstep = Lockstep(scene, names, inputs)
    steps = clock_of(scene.rate, inputs).step(scene.seconds)
    stretch = _Stretch(lockstep, names, against, steps)
    for step in range(steps):
        lockstep.obey_due()
        if lockstep.edited:
            stretch = _Stretch(lockstep, names, against, steps - step)
        lockstep.step()
        stretch.look()
        if progress and step % PACE == 0:
            progress(step / steps)
    return stretch.comparison(tuple(inputs))


class _Stretch:
    """A run from its start, or from an edit, on: what comes before an edit is of another scene, or other states."""

    def __init__(self, lockstep: Lockstep, names: Sequence[str], against: str, steps: int) -> None:
        self.lockstep, self.against, self.scene = lockstep, against, lockstep.scene
        self.since = lockstep.time
        self.expect = () if lockstep.steps else self.scene.expect
        state_bytes = 4 * 8 * len(self.scene.bodies)
        self.block = max(1, BLOCK_BYTES // state_bytes)
        self.stride = max(1, state_bytes // 4 * (steps + 1) // PATH_BYTES)
        self.tallies = {name: _Tally(self.scene, lockstep.engines[name], self.stride, steps) for name in names}
        self.twin = Twin(lockstep, against)
        self.steps = -1
        self.look()
        self.initial = self.tallies[against].states[0]

    def look(self) -> None:
        """Take in the states that the engines have now."""
        self.steps += 1
        for name, tally in self.tallies.items():
            tally.states.append(tally.engine.state())
            tally.pulls.append(_Pull(self.lockstep.pulled, self.lockstep.pulls.get(name, (0.0, 0.0))))
        self.twin.look(self.tallies[self.against].states[-1])
        if len(self.tallies[self.against].states) == self.block:
            self.reckon()

    def reckon(self) -> None:
        """Reckon up the states taken in."""
        begin = self.steps + 1 - len(self.tallies[self.against].states)
        reference = np.stack([state.position for state in self.tallies[self.against].states])
        for tally in self.tallies.values():
            tally.scores += [
                score(self.scene, expect, self.initial, tally.states[round(expect.at * self.scene.rate) - begin])
                for expect in self.expect
                if begin <= round(expect.at * self.scene.rate) <= self.steps
            ]
            tally.add(reference)

    def comparison(self, inputs: tuple[Input, ...]) -> Comparison:
        """Sum it all up."""
        if self.tallies[self.against].states:
            self.reckon()
        right = self.tallies[self.against].account()
        runs = {
            name: tally.run(right if name != self.against else None, self.twin.apart)
            for name, tally in self.tallies.items()
        }
        time = np.arange(self.steps + 1) / self.scene.rate
        return Comparison(self.scene, self.against, self.since, time, runs, self.twin.apart, self.stride, inputs)


def _all_by_default(scene: Scene) -> list[str]:
    initial = spawn(scene)
    reference = [REFERENCE] if can_run(REFERENCE, scene, initial) else []
    return default_engines(scene, initial) + reference


class _Pull(NamedTuple):
    """What the hand did in a step: the ball that it pulled, and by how much (px/s)."""

    ball: int | None
    dv: Vector


class _Tally:
    """Reckons up one engine's states, block by block."""

    def __init__(self, scene: Scene, runner: Runner, stride: int, steps: int) -> None:
        self.scene = scene
        self.engine = engine = runner.engine
        engine.contacts()  # begins their collecting
        self.contacts: list[Contacts] = []
        self.series: list[Floats] = []  # columns: energy, momentum x and y, momenta as lengths, gap RMS and max, apart
        self.gap_of_ball = np.zeros(len(scene.bodies))
        self.outside = np.zeros(len(scene.bodies))  # px, each ball's furthest from the arena
        self.left: tuple[float, int] | None = None  # when the first was there (s), and which
        self.scores: list[Score] = []
        self.velocities: list[Floats] = []  # at some times, where theory has something to say of them
        self.every = max(1, steps // SAMPLES)
        self.ledger = Ledger(scene, together=runner.together)
        self.states: list[State] = []  # that are not reckoned up yet
        self.pulls: list[_Pull] = []  # of the steps that led there
        self.held: list[Bools] = []
        self.path: list[NDArray[np.float32]] = []
        self.stride = stride
        self.final: State | None = None

    def add(self, reference: Floats) -> None:
        """Reckon up the states. reference: (steps, n, 2) px, where the balls should be in them."""
        scene, bodies = self.scene, self.scene.bodies
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
        done = sum(map(len, self.series))
        self.path.append(position[-done % self.stride :: self.stride].astype(np.float32))
        self.series.append(np.column_stack(columns))
        if obeys_laws(scene):
            self.velocities.append(velocity[:: self.every])
        self.gap_of_ball = np.maximum(self.gap_of_ball, gap.max(axis=0))
        away = outside(position, scene.arena.size)
        if self.left is None and away.max() > 0:
            step, ball = np.argwhere(away > 0)[0].tolist()
            self.left = (done + step) / scene.rate, ball
        self.outside = np.maximum(self.outside, away.max(axis=0))
        self.contacts.append(self.engine.contacts())
        self.book(position, velocity)
        self.final = self.states[-1]
        self.states.clear()

    def book(self, position: Floats, velocity: Floats) -> None:
        """Enter the block in the ledger, which begins with the state before it."""
        pulled = np.array([-1 if pull.ball is None else pull.ball for pull in self.pulls])
        pull = np.array([pull.dv for pull in self.pulls])
        self.pulls.clear()
        self.held.append(pulled >= 0)
        if self.final is not None:
            position = np.concatenate([self.final.position[None], position])
            velocity = np.concatenate([self.final.velocity[None], velocity])
            pulled, pull = np.append(-1, pulled), np.concatenate([np.zeros((1, 2)), pull])
        self.ledger.add(position, velocity, self.contacts[-1], pulled, pull)

    def account(self) -> Account:
        """Return the contacts with what the ledger says of them."""
        return Account(np.concatenate(self.contacts), self.ledger.rows, self.ledger.missed)

    def run(self, right: Account | None, horizon: float | None) -> Run:
        """Sum it all up. right: the contacts of another engine, the reference; horizon: s, up to which they matter."""
        joules, px, py, momenta, gap_rms, gap_max, apart = np.concatenate(self.series).T
        assert self.final is not None
        total = np.column_stack([px, py])
        account, rate = self.account(), self.scene.rate
        contacts = account.contacts
        at_wall = contacts[contacts["second"] < 0]
        parted = float(apart.argmax() / rate) if apart.any() else None
        until = min(time for time in (parted, horizon, self.final.time) if time is not None)
        differing = differences(self.scene, account, right, until, self.final.time) if right else ()
        figures = Figures(
            energy_ratio=float(joules[-1] / joules[0]) if joules[0] else None,
            energy_drift=float(np.abs(joules / joules[0] - 1).max()) if joules[0] else None,
            momentum_drift=float(self.from_nowhere(total, at_wall).max(initial=0.0) / (momenta.max() or 1.0)),
            gap_rms=float(np.sqrt(np.mean(gap_rms**2))),
            gap_max=float(gap_max.max()),
            pair_contacts=len(contacts) - len(at_wall),
            wall_contacts=len(at_wall),
            max_overlap=self.ledger.deepest,
            escaped=int(np.count_nonzero(outside(self.final.position, self.scene.arena.size) > 0)),
            expected=len(self.scores),
            met=sum(one.passed for one in self.scores),
            first_difference=differing[0] if differing else None,
            ledger=self.ledger.entries(),
        )
        return Run(
            figures=figures,
            energy=joules,
            momentum=total,
            gap_rms=gap_rms,
            gap_max=gap_max,
            gap_of_ball=self.gap_of_ball,
            apart=parted,
            contacts=contacts,
            differences=differing,
            missed=tuple(sorted(account.missed)),
            outing=self.outing(),
            scores=self.scores,
            theory=self.beside_theory(contacts) if is_gas(self.scene) or horizon is not None else (),
            path=np.concatenate(self.path),
            final=self.final,
        )

    def outing(self) -> Outing | None:
        """Return who left the arena, if any did."""
        return Outing(*self.left, int(np.count_nonzero(self.outside)), float(self.outside.max())) if self.left else None

    def from_nowhere(self, total: Floats, at_wall: Contacts) -> Floats:
        """Return the momentum that no wall, gravity or hand gave, (steps,) kg px/s, from all balls' (steps + 1, 2)."""
        walled = np.concatenate(self.held)
        walled[step_at(at_wall["time"], self.scene.rate)] = True
        fall = np.multiply(self.scene.gravity, self.scene.bodies.mass.sum() / self.scene.rate)
        change = np.diff(total, axis=0) - fall
        return length(np.cumsum(np.where(walled[1:, None], 0.0, change), axis=0))

    def beside_theory(self, contacts: Contacts) -> tuple[Row, ...]:
        """Return what theory expects of a gas, beside what was measured."""
        if not self.velocities or self.final is None:
            return ()
        return beside_theory(self.scene, contacts, np.concatenate(self.velocities), self.final.time) or ()
