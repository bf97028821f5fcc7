"""Engines in lockstep, compared: how far each is from the reference, since when, and why."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cache
from typing import Any, Final

import numpy as np

from sandbox.analysis.difference import Difference
from sandbox.analysis.expectations import step_of
from sandbox.analysis.figures import Figures, Run
from sandbox.analysis.gas import THEORY_FIGURES, TheoryRow
from sandbox.analysis.measurement import Measurement
from sandbox.analysis.reference import Trust, Twins, reference_of
from sandbox.engines import REFERENCE, Engines, Source, default_engines, named
from sandbox.errors import EngineError, LimitReached, SandboxError, suggestion
from sandbox.judge.causes import Cause, Entry
from sandbox.run.edits import Edit, edited_scenes
from sandbox.run.inputs import Input, clock_of
from sandbox.run.lockstep import Lockstep
from sandbox.scene.model import Scene
from sandbox.state import Floats
from sandbox.text import csv_text

BLOCK_BYTES: Final = 1_000_000  # of an engine's states that are measured together: they stay in a core's cache


@dataclass(frozen=True)
class Conditions:
    """What all engines of a comparison share, by the keys of JSON and CSV; see `Comparison` for their meaning."""

    scene: str  # its name
    seed: int  # of what is drawn at random
    rate: int  # steps per second
    since: float  # s, time of the last edit, from which times count
    seconds: float  # how long the engines ran
    against: str  # the reference
    horizon: float | None  # s, from when on its paths mean nothing; None if they mean something to the end
    undecided: float | None  # s, likewise
    unresolved: float | None  # s, likewise
    reference_until: float | None  # s, when an engine that cannot go on ended the comparison; None if none did
    energy_scale: float  # kg px²/s², what shares of energy are relative to; 0 if nothing moves


@dataclass(frozen=True)
class Comparison:
    """Several engines' runs of one scene, since its last edit.

    since: s, the time of that edit, from which times count; time: (steps + 1,) s; stride: steps between two frames of
    the runs' paths; failed: engines that have no run, because they failed; ended: the limit of an engine that ends the
    comparison before the scene's seconds.
    """

    scene: Scene
    against: str
    since: float
    time: Floats
    runs: dict[str, Run]
    trust: Trust
    stride: int
    inputs: tuple[Input, ...]
    failed: Mapping[str, EngineError] = field(default_factory=dict)
    ended: LimitReached | None = None

    @property
    def others(self) -> dict[str, Run]:
        """The runs of all engines but the one that they are measured against."""
        return {name: run for name, run in self.runs.items() if name != self.against}

    @property
    def reference_until(self) -> float | None:
        """Where the comparison ends early, s; None if it covers the scene's seconds."""
        return float(self.time[-1]) if self.ended else None

    @property
    def energy_scale(self) -> float:
        """What all shares of energy are of, kg px²/s², see `EnergyScale`; 0 if nothing moves in the reference."""
        return next(iter(self.runs.values())).energy_scale

    @property
    def trusted_until(self) -> float | None:
        """When the reference's paths first mean nothing, s: the earliest of the three; None if they do to the end."""
        return self.trust.until

    def as_json(self) -> dict[str, Any]:
        """Return what `--json` writes."""
        return asdict(self.conditions) | {
            "engines": {name: _as_json(run) for name, run in self.runs.items()},
            "failed": {name: {"time": error.time, "message": str(error)} for name, error in self.failed.items()},
        }

    @property
    def conditions(self) -> Conditions:
        """What all engines share, as JSON and CSV have it."""
        scene, trust, seconds = self.scene, self.trust, float(self.time[-1])
        times = trust.horizon, trust.undecided, trust.unresolved, self.reference_until
        return Conditions(
            scene.name, scene.seed, scene.rate, self.since, seconds, self.against, *times, self.energy_scale
        )

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each engine with the same columns, of dotted names; None where it has no such figure."""
        common = asdict(self.conditions)
        columns = ("engine", *common, *figure_columns())
        rows = [{"engine": name} | common | flatten(_as_json(run)) for name, run in self.runs.items()]
        return [{key: row.get(key) for key in columns} for row in rows]

    def as_csv(self) -> str:
        """Return what `--csv` writes: the rows, under the names of their columns."""
        rows = self.rows()
        return csv_text([[*rows[0]], *([*row.values()] for row in rows)])

    def exceeded(self, max_gap: float | None = None, max_energy_error: float | None = None) -> Iterator[str]:
        """Yield which engine exceeds a limit, of those that are not None, and by how much.

        Raises SandboxError if a limit cannot be judged: the engine is alone, or its figure is unknown at all times.
        """
        for name, run in self.runs.items():
            for what, limit, values, unit in (
                ("gap", max_gap, run.gap_max, " px"),
                ("energy error", max_energy_error, np.abs(run.energy_gap), ""),
            ):
                if limit is not None and (np.isnan(values[1:]).all() or not self.others):
                    why = "means nothing from the start" if run.energy_scale else "has no ball that moves"
                    raise SandboxError(
                        f"{name}: there is no {what} to compare with the limit of {limit:g}: {self.against} "
                        f"{why if self.others else 'took part alone'}"
                    )
                if limit is not None and (beyond := values > limit).any():
                    since, largest = self.time[int(beyond.argmax())], f"{np.nanmax(values):.6g}{unit}"
                    yield f"{name}: {what} {largest} exceeds the limit of {limit:g}{unit}, first at {since:.3f} s"


def _as_json(run: Run) -> dict[str, Any]:
    """Return an engine's part of `--json`."""
    scale = run.energy_scale
    figures = asdict(run.figures)
    if first := run.figures.first_difference:
        figures["first_difference"]["cause"] = first.cause.key
    figures["causes"] = [asdict(each) | {"cause": each.cause.key} for each in run.causes]
    figures["ledger"] = {
        entry.cause.key: {key: value for key, value in asdict(entry).items() if key != "cause"}
        | {"share": entry.energy / scale if scale else None}
        for entry in run.figures.ledger
    }
    if run.theory:
        figures["theory"] = {
            row.figure: {key: value for key, value in asdict(row).items() if key != "figure"} for row in run.theory
        }
    return figures


@cache
def figure_columns() -> tuple[str, ...]:
    """Return the columns of an engine's figures in CSV, the same for all engines and scenes."""
    line, law = [*_keys(Entry, "cause"), "share"], _keys(TheoryRow, "figure")
    return (
        *_keys(Figures, "first_difference", "causes", "ledger"),
        *(f"first_difference.{key}" for key in _keys(Difference)),
        *(f"ledger.{cause.key}.{key}" for cause in Cause for key in line),
        *(f"theory.{figure}.{key}" for figure in THEORY_FIGURES for key in law),
    )


def _keys(of: type[Any], *besides: str) -> list[str]:
    return [each.name for each in fields(of) if each.name not in besides]


def flatten(figures: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Bring nested tables onto one level: {"a": {"b": 1}} becomes {"a.b": 1}."""
    level: dict[str, Any] = {}
    for key, value in figures.items():
        level |= flatten(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return level


def compare(
    scene: Scene,
    engines: Engines | None = None,
    *,
    against: str | None = None,
    inputs: Sequence[Input] = (),
    progress: Callable[[float], object] | None = None,
) -> Comparison:
    """Run a scene in several engines, in lockstep, for its seconds.

    engines: as `sandbox.engines.named` reads them; by default "pymunk", then "article" (or "impulse" if the article's
    rule cannot run the scene with its edits), and "exact"; against: the engine that the others are measured against, by
    default "exact" if it takes part, else the last; inputs: recorded inputs to replay; progress: called now and then
    with the fraction that is done. If inputs edit the scene, the comparison covers what follows the last edit.
    An engine that is not built in and fails has no run, but an EngineError in `failed`. Where an engine reaches a
    limit, the comparison ends for all, with a LimitReached in `ended`.
    Raises SandboxError if an engine is unknown, Refused if one cannot run the scene, EngineError if the reference
    fails, LimitReached if an engine reaches a limit in the first step.
    """
    steps = clock_of(scene.clock, inputs).step(scene.seconds)
    if engines is None:
        scenes = edited_scenes(scene, [given for given in inputs if given.step < steps])
        engines = [*default_engines(*scenes), REFERENCE]
    sources = named(engines)
    against = against or reference_of(list(sources))
    if against not in sources:
        hint = suggestion(against, sources)
        raise SandboxError(f"cannot compare against {against!r}, which does not take part; {hint}")
    comparison = RunningComparison(scene, sources, against, inputs, steps)
    comparison.advance(steps, progress)
    return comparison.result()


class RunningComparison:
    """A comparison that goes on: engines run to any step, and are compared as far as they have come.

    Arguments and errors are those of `compare`; planned: how many steps are expected. suspends: whether an engine that
    cannot run an edited scene has no run until it can, and does not raise Refused.
    """

    def __init__(
        self,
        scene: Scene,
        engines: Mapping[str, Source],
        against: str,
        inputs: Sequence[Input],
        planned: int,
        *,
        suspends: bool = False,
    ) -> None:
        self._scene, self._engines, self._against, self._planned = scene, dict(engines), against, planned
        self._suspends = suspends
        self._failed: dict[str, EngineError] = {}
        self._ended: LimitReached | None = None
        self._most: float = math.inf  # steps that no engine reaches a limit in
        self.inputs = tuple(inputs)
        self._begin()

    @property
    def steps(self) -> int:
        """The number of steps done."""
        return self._lockstep.steps

    def replace_inputs(self, inputs: Sequence[Input]) -> None:
        """Replace the inputs to come. Those before the present step must be as they were."""
        self.inputs = tuple(inputs)
        self._lockstep.replace_pending(inputs)

    def advance(self, steps: int, progress: Callable[[float], object] | None = None) -> None:
        """Run up to a step, or as far as no engine reaches a limit. progress: as for `compare`.

        Where an engine fails, all is run again without it, and where one reaches a limit, for fewer steps.
        """
        while self.steps < min(steps, self._most):
            try:
                self._advance(int(min(steps, self._most)))
            except LimitReached as limit:
                self._most = min(self._lockstep.clock.step(limit.time), min(steps, self._most) - 1)
                if self._most < 1:
                    raise
                self._ended = limit
                self._begin()
            except EngineError as error:
                self._leave_out(error)
                self._begin()
            if progress:
                progress(self.steps / steps)

    def result(self) -> Comparison:
        """Return the comparison so far."""
        is_whole = self._ended or self.steps == self._planned
        seconds = self._scene.seconds if is_whole else self._lockstep.time
        comparison = (self._segment or self._new_segment()).comparison(self.inputs, seconds)
        return replace(comparison, failed=dict(self._failed), ended=self._ended)

    def _begin(self) -> None:
        """Begin at the first step, with the engines that can be built."""
        self._segment: _Segment | None = None
        try:
            reference = self._against if self._suspends else None
            self._lockstep = Lockstep(self._scene, self._engines, self.inputs, reference=reference)
        except EngineError as error:
            self._leave_out(error)
            self._begin()

    def _leave_out(self, error: EngineError) -> None:
        """Go on without an engine that has failed. Raises its error if the others are measured against it."""
        if error.engine == self._against:
            raise error
        self._failed[error.engine] = error
        del self._engines[error.engine]

    def _advance(self, steps: int) -> None:
        """Do a step or more, up to a number of them. Those before the last edit are not measured."""
        edits = (given.step for given in self.inputs if isinstance(given, Edit) and given.step < steps)
        if self.steps < max(edits, default=0):
            self._segment = None
            self._lockstep.step()
            return
        self._lockstep.apply_due()
        if self._segment is None or self._lockstep.edited:
            self._segment = self._new_segment()
        self._segment.advance(steps)

    def _new_segment(self) -> "_Segment":
        return _Segment(self._lockstep, self._against, max(1, self._planned - self._lockstep.steps))


class _Segment:
    """The part of a run since its start or its last edit; an edit changes the scene or the states.

    Each engine's states fill the rows of a block; `before` is the number of steps before its first row, and `filled`
    rows are there.
    """

    def __init__(self, lockstep: Lockstep, against: str, steps: int) -> None:
        self.lockstep, self.against, self.scene = lockstep, against, lockstep.scene
        self.since, self.begun = lockstep.time, lockstep.steps
        self.work_before = dict(lockstep.work)  # kg px²/s², by the mouse and edits of earlier segments
        edited = any(isinstance(given, Edit) for given in lockstep.given)
        self.expect = () if edited else self.scene.expect  # what was expected may not hold after an edit
        self.rows = min(max(2, BLOCK_BYTES // (4 * 8 * len(self.scene.bodies))), steps + 1)
        self.measurements = {
            name: Measurement(self.scene, runner, self.rows, steps) for name, runner in lockstep.engines.items()
        }
        self.twins = Twins(lockstep, against)
        self.disturbed = math.inf  # the step before which a ball was first pushed
        self.before, self.filled = 0, 1

    def advance(self, steps: int) -> None:
        """Advance the engines by a step or more, up to a step of the run; enter a block once it is full."""
        rows = slice(self.filled, min(self.rows, steps - self.begun - self.before + 1))
        blocks = {measurement.runner: measurement.states.rows(rows) for measurement in self.measurements.values()}
        self.filled += self.lockstep.advance(blocks)
        if self.lockstep.pushes:
            self.disturbed = min(self.disturbed, self.before + rows.start)
            for name, measurement in self.measurements.items():
                measurement.pushes += [(rows.start, ball, dv) for ball, dv in self.lockstep.pushes[name]]
                measurement.scale.give(self.lockstep.work[name] - self.work_before[name])
        if self.filled == self.rows:
            self._enter()

    def _enter(self) -> None:
        """Measure and judge the block, and begin another."""
        block = range(self.before + bool(self.before), self.before + self.filled)
        for expect in self.expect:
            if (step := step_of(expect, self.scene.rate)) is not None and step in block:
                for measurement in self.measurements.values():
                    measurement.keep(step)
        states = self.measurements[self.against].states.rows(slice(self.filled))
        times = self.scene.clock.times(np.arange(self.before + 1, self.before + self.filled))
        self.twins.follow(states.rows(slice(1, None)), times)
        reference = states.position.copy()  # its own block begins anew before others are measured
        for name, measurement in self.measurements.items():
            measurement.enter(self.filled, None if name == self.against else reference)
        self.before += self.filled - 1
        self.filled = 1

    def comparison(self, inputs: tuple[Input, ...], seconds: float) -> Comparison:
        """Return the comparison so far. seconds: that the whole run is to take, from its start."""
        if self.filled > 1 or not self.before:
            self._enter()
        trust, disturbed = self.twins.trust, self.disturbed < math.inf
        undisturbed = min(seconds, (self.disturbed - 1) / self.scene.rate)
        expects = [expect for expect in self.expect if expect.at <= undisturbed]
        reference: Run | None = None
        runs = dict[str, Run]()
        for name in sorted(self.measurements, key=lambda name: name != self.against):
            runs[name] = self.measurements[name].run(reference, trust.until, expects, disturbed=disturbed)
            reference = runs[self.against]
        runs = {name: runs[name] for name in self.measurements}
        time = self.scene.clock.times(np.arange(self.before + 1))
        stride = self.measurements[self.against].stride
        scene = self.scene if self.scene.seconds == seconds else self.scene.changed(seconds=seconds)
        return Comparison(scene, self.against, self.since, time, runs, trust, stride, inputs)
