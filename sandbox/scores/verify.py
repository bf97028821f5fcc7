"""The scoreboard: how well engines meet the expectations of scenes."""

import traceback
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from itertools import chain, count
from typing import Any, Final, TypeVar
from xml.etree import ElementTree

import numpy as np

from sandbox.analysis.energy_scale import EnergyScale
from sandbox.analysis.expectations import Numbers, Score, relative_error, score, steps_around, worst
from sandbox.engines import REFERENCE, check_name
from sandbox.errors import EngineError, LimitReached, Refused, SandboxError
from sandbox.run.lockstep import Lockstep
from sandbox.scene.model import MAX_STEPS, Scene
from sandbox.scene.spawn import spawn
from sandbox.state import State, States
from sandbox.text import printable, xml_text

MAX_PRECISE: Final = 2  # numbers of a vector that are written with ten digits; shares are rounded to 0.1 %
MAX_ROWS: Final = 256  # states of an engine that are computed in one call, and not kept


T = TypeVar("T", bound=float | Numbers)


class Outcome(Enum):
    """The outcome of an engine in a scene; the values are the words of the table."""

    MET = "ok"
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

    def document(self) -> "Judged | Unjudged | Refusal | Breakage | NotRun":
        """Return what `--json` writes."""
        match self.outcome:
            case Outcome.REFUSED:
                return Refusal(refused=self.message)
            case Outcome.BROKE:
                return Breakage(broke=self.message)
            case Outcome.NOT_RUN:
                return NotRun(not_run=self.message)
        skipped = [Skip(at=score.expect.at, because=score.skipped) for score in self.scores if score.skipped]
        if self.outcome is Outcome.SKIPPED:
            return Unjudged(skipped=skipped)
        return Judged(
            error=_finite(self.worst.error),
            tolerance=self.worst.expect.tolerance,
            passed=self.outcome is Outcome.MET,
            missed=[miss for score in self.scores for miss in _misses(score)],
            skipped=skipped,
        )


def _lines(score: Score) -> Iterator[str]:
    """Yield a line for each quantity that is missed, or one that says why none was judged."""
    expect, at = score.expect, f"at {score.expect.at:g} s"
    of_ball = f"ball {expect.ball} {at}"
    if score.skipped:
        yield f"{at if expect.ball is None else of_ball}: skipped, since {score.skipped}"
    for each in score.missed:
        quantity, off = each.quantity, f"{each.error:.2g} {each.quantity.dimension.value}".strip()
        yield (
            f"{of_ball if quantity.of_ball else at}: {quantity.label} {_words(each.measured)} instead of "
            f"{_words(each.expected)}, off by {off} (tolerance {expect.tolerance:g}): "
            f"{' '.join(expect.because.split())}"
        )


def _words(value: float | Numbers) -> str:
    is_long = len(np.atleast_1d(value)) > MAX_PRECISE
    numbers = ", ".join(f"{number:.3f}" if is_long else f"{number:.10g}" for number in np.atleast_1d(value))
    return f"({numbers})" if isinstance(value, tuple) else numbers


def _misses(score: Score) -> Iterator["Miss"]:
    """Yield what `--json` writes for each quantity that is missed; an infinite number is None."""
    for each in score.missed:
        yield Miss(
            at=score.expect.at,
            ball=score.expect.ball if each.quantity.of_ball else None,
            quantity=each.quantity.key,
            unit=each.quantity.dimension.value,
            expected=each.expected,
            found=_finite(each.measured),
            error=_finite(each.error),
            tolerance=score.expect.tolerance,
            because=score.expect.because,
        )


def _finite(value: T) -> T | None:
    """Return a number or a vector for JSON, None if it is not finite."""
    return value if np.isfinite(np.atleast_1d(value)).all() else None


@dataclass(frozen=True)
class Miss:
    """A quantity that an engine misses, as JSON has it: in its unit, at a time in s; ball is None for all together."""

    at: float
    ball: int | None
    quantity: str
    unit: str
    expected: float | Numbers
    found: float | Numbers | None
    error: float | None
    tolerance: float
    because: str


@dataclass(frozen=True)
class Skip:
    """An expectation that could not be judged. at: s."""

    at: float
    because: str


@dataclass(frozen=True)
class Judged:
    """An engine's result in a scene. error, tolerance: of what it misses most; error is None if it is not finite."""

    error: float | None
    tolerance: float
    passed: bool
    missed: list[Miss]
    skipped: list[Skip]


@dataclass(frozen=True)
class Unjudged:
    """No expectation of the scene could be judged."""

    skipped: list[Skip]


@dataclass(frozen=True)
class Refusal:
    """Why the engine cannot run the scene."""

    refused: str


@dataclass(frozen=True)
class Breakage:
    """The exception that the engine raised."""

    broke: str


@dataclass(frozen=True)
class NotRun:
    """In which scene the engine broke before."""

    not_run: str


@dataclass(frozen=True)
class Scores:
    """The document that `sandbox verify --json` writes; docs/formats.md explains the keys.

    scenes: scene -> engine -> result; tally: engine -> outcome -> number of scenes.
    """

    scenes: dict[str, dict[str, Judged | Unjudged | Refusal | Breakage | NotRun]]
    tally: dict[str, dict[str, int]]


SceneResults = dict[str, Result]  # by engine
Board = dict[str, SceneResults]  # by scene


def verify(scenes: Iterable[Scene], engines: Sequence[str]) -> Iterator[tuple[str, SceneResults]]:
    """Score engines on scenes by all of their expectations; yield each scene's name and row when it is done.

    Scenes without expectations are left out. An engine that raises an exception is not run any more.
    Raises SandboxError for an unknown engine, or a scene that no engine can run.
    """
    for engine in engines:
        check_name(engine)
    scored = {name: _checked(scene) for name, scene in _named(scenes) if scene.expect}
    return _rows(scored, engines)


def _named(scenes: Iterable[Scene]) -> Iterator[tuple[str, Scene]]:
    """Yield each scene with its name, with its file if another one has the same name, or else with a number too."""
    names = set()
    for scene in scenes:
        file = printable(str(scene.file))
        candidates = chain((scene.name, file), (f"{file} ({n})" for n in count(2)))
        name = next(each for each in candidates if each not in names)
        names.add(name)
        yield name, scene


def _checked(scene: Scene) -> Scene:
    """Return the scene with seconds that reach the last step that is needed, of which there is at least one.

    Raises SandboxError if that is too late for any run, or if the balls do not fit.
    """
    spawn(scene)
    for number, expect in enumerate(scene.expect):
        if expect.at * scene.rate > MAX_STEPS:
            most = f"{MAX_STEPS / scene.rate:g} at this rate"
            raise SandboxError(scene.at_key(("expect", number, "at"), f"must be at most {most}, got {expect.at:g}"))
    last = max(steps_around(expect.at, scene.rate)[1] for expect in scene.expect)
    return scene.changed(seconds=max(1, last) / scene.rate)


def _rows(scored: Mapping[str, Scene], engines: Sequence[str]) -> Iterator[tuple[str, SceneResults]]:
    broken: dict[str, str] = {}  # engine -> the scene that it broke in
    for name, scene in scored.items():
        row = {}
        for engine in engines:
            if engine in broken:
                row[engine] = Result(Outcome.NOT_RUN, message=f"{engine} broke in {broken[engine]}")
                continue
            row[engine] = _result(scene, engine)
            if row[engine].outcome is Outcome.BROKE:
                broken[engine] = name
        yield name, row


def _result(scene: Scene, engine: str) -> Result:
    try:
        scores = tuple(_scores(scene, engine))
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
    if all(score.skipped for score in scores):
        return Result(Outcome.SKIPPED, scores)
    return Result(Outcome.MET if all(score.passed for score in scores) else Outcome.MISSED, scores)


def _scores(scene: Scene, engine: str) -> Iterator[Score]:
    around = {expect: steps_around(expect.at, scene.rate) for expect in scene.expect}
    lockstep = Lockstep(scene, [engine])
    scale = EnergyScale(scene, lockstep.initial)
    steps, states, ended = sorted({step for steps in around.values() for step in steps}), dict[int, State](), ""
    try:
        for step, state in _states(lockstep, engine, steps, scale):
            states[step] = state
    except LimitReached as limit:
        ended = str(limit)
    for expect, (before, after) in around.items():
        if after in states:
            yield score(scene, expect, lockstep.initial, states[before], states[after], scale.value)
        else:
            yield Score(expect, skipped=ended)


def _states(lockstep: Lockstep, engine: str, steps: Sequence[int], scale: EnergyScale) -> Iterator[tuple[int, State]]:
    """Run to each of some steps, in order, and yield it with the state there; the scale follows the engine."""
    runner, scene = lockstep.engines[engine], lockstep.scene
    rows = States.empty(MAX_ROWS + 1, len(scene.bodies))
    rows.fill(0, runner.state())
    runner.record_contacts()
    for step in steps:
        while lockstep.steps < step:
            before, block = lockstep.steps, min(MAX_ROWS, step - lockstep.steps)
            while (done := lockstep.steps - before) < block:
                lockstep.advance({runner: rows.rows(slice(1 + done, 1 + block))})
            scale.follow(scene, rows.rows(slice(block + 1)), runner.contacts(), before)
            rows.fill(0, rows.state(block, 0.0))
        yield step, runner.state()


def as_json(board: Board) -> dict[str, Any]:
    """Return what `--json` writes."""
    scores = Scores(
        scenes={scene: {name: result.document() for name, result in row.items()} for scene, row in board.items()},
        tally={
            name: {outcome.name.lower(): count for outcome, count in counts.items()}
            for name, counts in tally(board).items()
        },
    )
    return asdict(scores)


def tally(board: Board) -> dict[str, dict[Outcome, int]]:
    """Count each engine's outcomes; those that it never had are left out."""
    engines = next(iter(board.values()), {})
    counts = {name: Counter(row[name].outcome for row in board.values()) for name in engines}
    return {
        name: {outcome: count[outcome] for outcome in Outcome if outcome in count} for name, count in counts.items()
    }


_JUNIT_ELEMENTS: Final = {  # in the test case of an outcome
    Outcome.MISSED: "failure",
    Outcome.BROKE: "error",
    Outcome.SKIPPED: "skipped",
    Outcome.REFUSED: "skipped",
    Outcome.NOT_RUN: "skipped",
}


def as_junit(board: Board) -> str:
    """Return what `--junit` writes: XML with a test case for each scene and engine, for continuous integration."""
    root = ElementTree.Element("testsuites")
    suite = ElementTree.SubElement(root, "testsuite", name="sandbox verify")
    elements = Counter[str]()
    for scene, row in board.items():
        for engine, result in row.items():
            case = ElementTree.SubElement(suite, "testcase", classname=engine, name=scene)
            if element := _JUNIT_ELEMENTS.get(result.outcome):
                details = ElementTree.SubElement(case, element, message=result.lines[0])
                details.text = result.details or "\n".join(result.lines)
            elements[element or "passed"] += 1
    for key, element in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        suite.set(key, str(elements[element]))
    suite.set("tests", str(elements.total()))
    ElementTree.indent(root)
    xml: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return xml_text(xml.decode()) + "\n"


def all_passed(board: Board, engines: Sequence[str] | None) -> bool:
    """Return whether the given engines, by default the exact one, met every expectation that they did not refuse.

    An expectation that could not be judged counts as met, an engine that broke as having missed one.
    """
    must_pass = engines or [REFERENCE]
    failures = (Outcome.MISSED, Outcome.BROKE, Outcome.NOT_RUN)
    return not any(
        result.outcome in failures for row in board.values() for name, result in row.items() if name in must_pass
    )
