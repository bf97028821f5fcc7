"""The scoreboard: how well engines meet the expectations of scenes."""

import math
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import chain, count
from time import monotonic
from typing import Any, Final

import numpy as np

from sandbox.analysis.energy_scale import EnergyScale
from sandbox.analysis.expectations import (
    SAME_TIME,
    ExpectedQuantity,
    Numbers,
    Score,
    relative_error,
    scores,
    step_of,
    worst,
)
from sandbox.engines import BUILT_IN, REFERENCE, Engines, Source, check_name, named
from sandbox.errors import EngineError, LimitReached, Refused, SandboxError
from sandbox.quantity import length
from sandbox.run.lockstep import Lockstep
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import State, States
from sandbox.text import printable

MAX_PRECISE: Final = 2  # numbers of a vector that are written with ten digits; shares are rounded to 0.1 %
MAX_ROWS: Final = 256  # states of an engine that are computed in one call, and not kept
LATE_STEPS: Final = 3  # by which a stepped engine may lag after a few contacts, each found up to a step late
DAMPED: Final = 0.01  # fraction of the energy that a stepped engine may gain or lose besides
PATIENCE: Final = 60.0  # s, time limit of an engine that is not built in for a scene that was not named
FIRST_SECONDS: Final = 0.5  # s, after which an engine's speed is known

Progress = Callable[[float, str], object]  # of the fraction that is done, of a scene and an engine


class Outcome(Enum):
    """The outcome of an engine in a scene; the values are the words of the table.

    CLOSE: beyond the tolerances of the scene, but within those of a stepped engine; for `exact` that is MISSED.
    """

    MET = "ok"
    CLOSE = "close"
    MISSED = "MISSED"
    SKIPPED = "skipped"
    REFUSED = "refused"
    BROKE = "BROKE"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class Result:
    """How an engine did in a scene.

    scores: one for each expectation, if it ran to their end; message: why it refused the scene, broke or was not run;
    details: the traceback of an engine that broke, empty if the message says all; time: s, when one that is not built
    in broke, None otherwise.
    """

    outcome: Outcome
    scores: tuple[Score, ...] = ()
    message: str = ""
    details: str = ""
    time: float | None = None

    @property
    def judged(self) -> list[Score]:
        """The scores of the expectations that could be judged."""
        return [score for score in self.scores if not score.skipped]

    @property
    def worst(self) -> Score:
        """The score of the expectation that is missed most, relative to its tolerance, if any could be judged."""
        return worst(self.judged)

    @property
    def lines(self) -> list[str]:
        """The lines to print: of each quantity that was missed, the largest error first, and of each skipped one.

        If nothing was missed or skipped, the message alone.
        """
        by_error = sorted(self.scores, key=relative_error, reverse=True)
        return [line for score in by_error for line in _lines(score)] or [self.message]

    def document(self) -> dict[str, Any]:
        """Return what `--json` writes; of an engine that was not scored why, as `refused`, `broke` or `not_run`."""
        if self.outcome in (Outcome.REFUSED, Outcome.BROKE, Outcome.NOT_RUN):
            return {self.outcome.name.lower(): self.message}
        skipped = [{"at": score.expect.at, "because": score.skipped} for score in self.scores if score.skipped]
        if self.outcome is Outcome.SKIPPED:
            return {"skipped": skipped}
        judged = Judged(
            error=self.worst.error,
            tolerance=self.worst.expect.tolerance,
            passed=self.outcome in (Outcome.MET, Outcome.CLOSE),
            missed=[miss for score in self.scores for miss in _misses(score)],
            skipped=skipped,
        )
        return vars(judged)


def _lines(score: Score) -> Iterator[str]:
    """Yield a line for each quantity that is missed, or one that says why none was judged."""
    expect, at = score.expect, f"at {score.expect.at:g} s"
    of_ball = f"ball {expect.ball} {at}"
    if score.skipped:
        yield f"{at if expect.ball is None else of_ball}: skipped, since {score.skipped}"
    for each in score.missed:
        quantity, unit = each.quantity, f" {each.quantity.dimension.value}".rstrip()
        yield (
            f"{of_ball if quantity.of_ball else at}: {quantity.label} {_words(each.measured)} instead of "
            f"{_words(each.expected)}, off by {each.error:.2g}{unit} (tolerance {expect.tolerance:g}{unit}): "
            f"{' '.join(expect.because.split())}"
        )


def _words(value: float | Numbers) -> str:
    is_long = len(np.atleast_1d(value)) > MAX_PRECISE
    numbers = ", ".join(f"{number:.3f}" if is_long else f"{number:.10g}" for number in np.atleast_1d(value))
    return f"({numbers})" if isinstance(value, tuple) else numbers


def _misses(score: Score) -> Iterator[dict[str, Any]]:
    """Yield what `--json` writes for each quantity that is missed."""
    for each in score.missed:
        yield {
            "at": score.expect.at,
            "ball": score.expect.ball if each.quantity.of_ball else None,
            "quantity": each.quantity.key,
            "unit": each.quantity.dimension.value,
            "expected": each.expected,
            "found": each.measured,
            "error": each.error,
            "tolerance": score.expect.tolerance,
            "because": score.expect.because,
        }


@dataclass(frozen=True)
class Judged:
    """An engine's result in a scene, as JSON has it."""

    error: float | None  # of the expectation that it misses most; None if it is not finite
    tolerance: float  # of the same
    passed: bool  # whether it meets all expectations
    missed: list[dict[str, Any]]  # what it misses, with all figures
    skipped: list[dict[str, Any]]  # what could not be judged: `at` (s) and `because`


SceneResults = dict[str, Result]  # by engine
Board = dict[str, SceneResults]  # by scene


def verify(
    scenes: Iterable[Scene],
    engines: Engines,
    tolerance: float | None = None,
    patience: float = math.inf,
    progress: Progress | None = None,
) -> Iterator[tuple[str, SceneResults]]:
    """Score engines on scenes by all of their expectations; yield each scene's name and row when it is done.

    Scenes without expectations are left out. An engine that raises an exception is not run any more. tolerance: in
    place of the scenes' own; patience: s, beyond which an engine that is not built in skips a scene.
    Raises SandboxError for an unknown engine, or a scene that no engine can run.
    """
    sources = named(engines)
    for source in sources.values():
        if isinstance(source, str):
            check_name(source)
    scored = {name: _checked(scene, tolerance) for name, scene in _named(scenes) if scene.expect}
    return _rows(scored, sources, _Limits(tolerance is None, patience, progress))


@dataclass(frozen=True)
class _Limits:
    """How engines are scored: whether stepped ones may be CLOSE, and after how many seconds one skips a scene."""

    allows_steps: bool
    patience: float
    progress: Progress | None


def _named(scenes: Iterable[Scene]) -> Iterator[tuple[str, Scene]]:
    """Yield each scene with its name, with its file if another one has the same name, or else with a number too."""
    names = set()
    for scene in scenes:
        file = printable(str(scene.file))
        candidates = chain((scene.name, file), (f"{file} ({n})" for n in count(2)))
        name = next(each for each in candidates if each not in names)
        names.add(name)
        yield name, scene


def _checked(scene: Scene, tolerance: float | None) -> Scene:
    """Return the scene with seconds that reach the last step that is needed, of which there is at least one.

    tolerance: of its expectations, if not None.
    Raises SandboxError if the balls do not fit.
    """
    spawn(scene)
    last = math.ceil(max(expect.at for expect in scene.expect) * scene.rate - SAME_TIME)
    changes = {} if tolerance is None else {"tolerance": tolerance}
    changed = [each.model_copy(update=changes) for each in scene.expect]
    return scene.changed(seconds=max(1, last) / scene.rate, expect=changed)


def _rows(
    scored: Mapping[str, Scene], engines: Mapping[str, Source], limits: _Limits
) -> Iterator[tuple[str, SceneResults]]:
    broken: dict[str, str] = {}  # engine -> the scene that it broke in
    for name, scene in scored.items():
        row, allowed = {}, tolerances_of_steps(scene) if limits.allows_steps else {}
        for engine in engines:
            if engine in broken:
                row[engine] = Result(Outcome.NOT_RUN, message=f"{engine} broke in {broken[engine]}")
                continue
            row[engine] = _result(scene, engine, engines[engine], limits, allowed)
            if row[engine].outcome is Outcome.BROKE:
                broken[engine] = name
        yield name, row


def _result(
    scene: Scene, engine: str, source: Source, limits: _Limits, allowed: Mapping[ExpectedQuantity, float]
) -> Result:
    """Score an engine on a scene. allowed: `tolerances_of_steps`."""
    try:
        scored = tuple(_scores(scene, engine, source, limits))
    except Refused as refusal:
        return Result(Outcome.REFUSED, message=str(refusal))
    except EngineError as error:
        return Result(Outcome.BROKE, message=str(error), details=error.details, time=error.time)
    except SandboxError as error:
        return Result(Outcome.BROKE, message=str(error))
    except Exception as error:  # whatever an engine raises ends its own column only
        said = printable(f"{engine}: {type(error).__name__}: {error}")
        details = "".join(f"{printable(line)}\n" for line in traceback.format_exc().split("\n")[:-1])
        return Result(Outcome.BROKE, message=said, details=details)
    if all(score.skipped for score in scored):
        return Result(Outcome.SKIPPED, scored)
    return Result(_outcome(scored, {} if source == REFERENCE else allowed), scored)


def _outcome(scored: Sequence[Score], allowed: Mapping[ExpectedQuantity, float]) -> Outcome:
    """Return whether scores meet the tolerances of the scene or, by quantity, what is allowed besides."""
    if all(score.passed for score in scored):
        return Outcome.MET
    missed = [deviation for score in scored for deviation in score.missed]
    is_close = all(deviation.error <= allowed.get(deviation.quantity, 0.0) for deviation in missed)
    return Outcome.CLOSE if is_close else Outcome.MISSED


def tolerances_of_steps(scene: Scene) -> dict[ExpectedQuantity, float]:
    """Return how far a stepped engine may be off, in the units of the quantities.

    It finds contacts up to a step late. Until then a ball goes `late` px too far, and turns the normal by late / reach.
    Empty if balls that fly through everything would be as close: then these tolerances would not show a contact.
    """
    state, bodies, dt = spawn(scene), scene.bodies, 1 / scene.rate
    pull = math.hypot(*scene.gravity)
    lowest = np.where(np.array(scene.gravity) > 0, scene.arena.size - bodies.radius[:, None], bodies.radius[:, None])
    fall = ((lowest - state.position) * scene.gravity).sum(axis=1).clip(0)
    fastest = float(np.sqrt(length(state.velocity) ** 2 + 2 * fall).max())
    smallest = float(bodies.radius.min())
    late = fastest * dt + pull * dt**2
    off = fastest * min(1.0, late / (2 * smallest)) + pull * dt  # px/s
    allowed = {
        ExpectedQuantity.POSITION: LATE_STEPS * late,
        ExpectedQuantity.CENTRE_OF_MASS: LATE_STEPS * late,
        ExpectedQuantity.OVERLAP: late,
        ExpectedQuantity.VELOCITY: off,
        ExpectedQuantity.SPIN: 2 * off / smallest,
        ExpectedQuantity.MOMENTUM: float(bodies.mass.max()) * pull * dt,
        ExpectedQuantity.ENERGY_RATIO: DAMPED + (2 * pull * dt / fastest if fastest else 0.0),
    }
    return {} if _outcome(_scores_of_flight(scene), allowed) is Outcome.CLOSE else allowed


def _scores_of_flight(scene: Scene) -> Sequence[Score]:
    """Score what balls would do that fly through everything."""
    start, gravity, states = spawn(scene), np.array(scene.gravity), dict[int, State]()
    for step in filter(None, (step_of(expect, scene.rate) for expect in scene.expect)):
        time = step / scene.rate
        flown = start.position + start.velocity * time + gravity * time**2 / 2
        states[step] = replace(start, time=time, position=flown, velocity=start.velocity + gravity * time)
    return tuple(scores(scene, scene.expect, start, states, EnergyScale(scene, start).value, ""))


def _scores(scene: Scene, engine: str, source: Source, limits: _Limits) -> Iterator[Score]:
    lockstep = Lockstep(scene, {engine: source})
    scale = EnergyScale(scene, lockstep.initial)
    steps = sorted({step for expect in scene.expect if (step := step_of(expect, scene.rate)) is not None})
    states, ended = dict[int, State](), ""
    try:
        for step, state in _states(lockstep, engine, steps, scale, _within(limits, scene, engine, source)):
            states[step] = state
    except LimitReached as limit:
        ended = str(limit)
    return scores(scene, scene.expect, lockstep.initial, states, scale.value, ended)


def _within(limits: _Limits, scene: Scene, engine: str, source: Source) -> Callable[[int], None]:
    """Return a function of the steps done, which raises LimitReached if an engine will need too long for a scene."""
    began, patience = monotonic(), math.inf if source in BUILT_IN else limits.patience

    def check(done: int) -> None:
        seconds = monotonic() - began
        needed = seconds * scene.steps / done
        if seconds > FIRST_SECONDS and needed > patience:
            why = f"it would take {needed:.0f} s for this scene, which is scored if it is named"
            raise LimitReached(engine, done / scene.rate, why)
        if limits.progress:
            limits.progress(done / scene.steps, f"{scene.name}, {engine}")

    return check


def _states(
    lockstep: Lockstep, engine: str, steps: Sequence[int], scale: EnergyScale, check: Callable[[int], None]
) -> Iterator[tuple[int, State]]:
    """Run to each of some steps, in order, and yield it with the state there; the scale follows the engine.

    check: called with the number of steps done.
    """
    runner, scene = lockstep.engines[engine], lockstep.scene
    rows = States.empty(MAX_ROWS + 1, len(scene.bodies))
    rows.fill(0, runner.state())
    runner.record_contacts()
    for step in steps:
        while lockstep.steps < step:
            before, block = lockstep.steps, min(MAX_ROWS, step - lockstep.steps)
            while (done := lockstep.steps - before) < block:
                lockstep.advance({runner: rows.rows(slice(1 + done, 1 + block))})
                check(lockstep.steps)
            scale.follow(scene, rows.rows(slice(block + 1)), runner.contacts(), before)
            rows.fill(0, rows.state(block, 0.0))
        yield step, runner.state()


def as_json(board: Board) -> dict[str, Any]:
    """Return what `--json` writes: each engine's result by scene, and how often it had each outcome."""
    return {
        "scenes": {scene: {name: result.document() for name, result in row.items()} for scene, row in board.items()},
        "tally": {
            name: {outcome.name.lower(): count for outcome, count in counts.items()}
            for name, counts in tally(board).items()
        },
    }


def tally(board: Board) -> dict[str, dict[Outcome, int]]:
    """Count each engine's outcomes; those that it never had are left out."""
    engines = next(iter(board.values()), {})
    counts = {name: Counter(row[name].outcome for row in board.values()) for name in engines}
    return {
        name: {outcome: count[outcome] for outcome in Outcome if outcome in count} for name, count in counts.items()
    }


def all_passed(board: Board, engines: Sequence[str] | None) -> bool:
    """Return whether the given engines, by default the exact one, met every expectation that they did not refuse.

    An expectation that could not be judged counts as met, an engine that broke as having missed one.
    """
    must_pass = engines or [REFERENCE]
    failures = (Outcome.MISSED, Outcome.BROKE, Outcome.NOT_RUN)
    return not any(
        result.outcome in failures for row in board.values() for name, result in row.items() if name in must_pass
    )
