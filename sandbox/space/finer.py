"""A recorded Space compared with itself in finer steps: how far it is off, until when that is known, and what helps.

Each step is divided, twice as finely each time, with more iterations of the solver. The error of Pymunk's steps falls
in proportion to their length, so 2 c - b is a better reference than the finest run c, where b is the one before
(Richardson, Phil. Trans. A 210, 1911, p. 307). What the last division changed in that is its error bar. The reference
of a body counts until the error bar, or the effect of a shift by some units in the last place, exceeds a tenth of the
error that is reported.

What stands in finer steps, but moves on in the program's own, is a finding: it leans, slides or topples.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.errors import SandboxError
from sandbox.space.description import SpaceDescription
from sandbox.space.evidence import MAX_CREEP, Evidence
from sandbox.space.findings import Fault, Rules
from sandbox.space.mechanics import Floats, is_within
from sandbox.space.recording import Recording, Step
from sandbox.space.replay import AWAKE, Motion, Numbers, Script, Variant, distance, replay, replayable

MAX_WORK: Final = 6_000_000  # steps times bodies, contacts and joints, of all runs: about 10 s
FIRST_RUNS: Final = 100  # the work of the runs that are always done, in that of the program's run
AFTERWARDS: Final = 1.5  # the work of a division of steps with all runs that follow it, in its own
LEAST_SUBSTEPS, MOST_SUBSTEPS = 8, 256
SHARE: Final = 0.1  # of what is reported: the error bar at most
LARGEST: Final = 1e9  # px, px/s, rad and rad/s: beyond, a program has lost its bodies
LEAST: Final = 0.01  # of a body's size: smaller errors do not matter
MAX_NAMED: Final = 2  # functions of the program
SUBSTEPS_TRIED, ITERATIONS_TRIED = (2, 4, 8), (2, 4)
STILL: Final = 0.1  # of the smallest half width of a body: what moves less stands
ALREADY_SAID: Final = ("creeps", "sinks-in", "unsolved")  # rules that name the same bodies for what they do
IDEAL: Final[Mapping[str, float]] = {  # settings
    "collision_slop": 0.0,
    "collision_bias": 0.0,
    "collision_persistence": 60,
}


class Tried(NamedTuple):
    """Another value of one setting, which part of the largest error goes with it, below 0 if it grows, and its cost.

    cost: steps, or iterations of the solver, a factor.
    """

    setting: str
    value: float
    removed: float
    cost: int


@dataclass(frozen=True)
class Finer:
    """A comparison of n steps of b bodies with finer steps.

    finest: the finest run; error: (n, b) px, of the furthest point of each body, NaN where there is no reference; bar:
    (n, b) px, the largest so far; until: (b,) for how many steps it counts; since: (b,) as `replayable` returns it;
    is_rounding: (b,) whether it ends because rounding makes a difference; is_light: (b,) which have a finite mass;
    tried: other settings, if the error matters; by_order: px, how far off the program's run bodies are at most if all
    is added in reverse order.
    """

    script: Script
    finest: Variant
    reference: Motion
    error: Floats
    bar: Floats
    until: Numbers
    since: Numbers
    is_rounding: NDArray[np.bool_]
    is_light: NDArray[np.bool_]
    tried: tuple[Tried, ...] = ()
    by_order: float = 0.0

    @property
    def start(self) -> SpaceDescription:
        """The Space before its first step."""
        assert self.script.roster.start
        return self.script.roster.start

    @property
    def worst(self) -> tuple[int, int]:
        """The step and the body of the largest error."""
        step, body = np.unravel_index(np.nanargmax(self.error), self.error.shape)
        return int(step), int(body)

    @property
    def largest(self) -> float:
        """The largest error, px."""
        return float(np.nanmax(self.error))

    @property
    def largest_so_far(self) -> tuple[Floats, Floats]:
        """The end of each step, s, and the largest error until then, px."""
        worst = np.nan_to_num(self.error).max(axis=1)
        return np.array([step.end for step in self.script.steps[: len(worst)]]), np.maximum.accumulate(worst)

    @property
    def last(self) -> int:
        """The last step with a reference."""
        return int(np.flatnonzero(np.isfinite(self.error).any(axis=1))[-1])

    @property
    def first(self) -> int:
        """The first step with a tenth of the largest error."""
        return int(np.argmax((self.error >= SHARE * self.largest).any(axis=1)))

    @property
    def left_out(self) -> Numbers:
        """The numbers of bodies that are not compared to the end, because of `since`."""
        return np.flatnonzero(self.is_light & (self.since < len(self.error)))

    @property
    def ended(self) -> Numbers:
        """The numbers of bodies whose reference ends before."""
        return np.flatnonzero(self.is_light & (self.until < np.minimum(self.since, len(self.error))))

    def up_to_rounding(self, apart: Floats) -> "Finer":
        """Return what is left if a shift of some units in the last place puts bodies so far apart, (n, b) px."""
        until = np.minimum(self.until, _counts(apart, self.error, self.script.sizes))
        return replace(self, until=until, error=_cut(self.error, until), is_rounding=until < self.until)

    @property
    def matters(self) -> bool:
        """Whether a body is off by more than a small part of its size."""
        return bool(np.nanmax(self.error / self.script.sizes) > LEAST)


def finer(recording: Recording) -> Finer:
    """Compare a recording with the same Space in finer steps. Raises SandboxError if that is impossible."""
    start = recording.roster.start
    if start is None:
        raise SandboxError(recording.roster.why_not or "no step was recorded")
    budget = _Budget(recording, start.settings.iterations)
    script = Script(recording, budget.first_steps)
    if not script.steps:
        raise SandboxError(recording.roster.why_not or "there are too many bodies for one step of it")
    script, since = _repeating(script)
    is_light = _is_light(script)
    if not is_light.any():
        raise SandboxError("no body in it moves by forces")
    if not (since[is_light] >= min(2, len(script.steps))).any():  # one step shows nothing of what moves a body
        raise SandboxError(f"what moves its bodies is not in the recording{functions(start)}")
    settings = AWAKE if start.settings.sleep_time_threshold < np.inf else {}
    count, runs, substeps = len(script.steps), [script.recorded], 1
    while True:
        substeps *= 2
        variant = _divided(substeps, settings)
        runs = [*runs[-2:], replay(script, variant, since, count)]
        budget.spend(variant, count)
        if substeps < LEAST_SUBSTEPS:
            continue
        finer_run = _judged(script, variant, runs, since, is_light)
        next_count = budget.affordable(_divided(2 * substeps, settings), count)
        is_worth_it = next_count == count or next_count > finer_run.until.max()
        if not len(finer_run.ended) or substeps == MOST_SUBSTEPS or not is_worth_it:
            break
        count = next_count
    length = len(finer_run.error)
    twin = replay(script, replace(_divided(substeps // 2, settings), is_shifted=True), since, length)
    finer_run = finer_run.up_to_rounding(distance(script.outlines, runs[-2].first(length), twin))
    if np.isnan(finer_run.error).all():
        raise SandboxError("finer steps, and rounding, change its motion from the start")
    if not finer_run.matters:
        return finer_run
    return replace(finer_run, tried=tuple(_tried(finer_run, settings)), by_order=_by_order(finer_run))


def _repeating(script: Script) -> tuple[Script, Numbers]:
    """Return a script, and `replayable` of it: bodies are added with their velocities, or at rest if more repeats."""
    since = replayable(script)
    if (since == len(script.steps)).all():
        return script, since
    at_rest = script.added_at_rest()
    since_at_rest = replayable(at_rest)
    return (at_rest, since_at_rest) if since_at_rest.sum() > since.sum() else (script, since)


def functions(start: SpaceDescription) -> str:
    """Return the functions of the program that a Space calls, after a colon; nothing if it has none."""
    names = start.callables
    more = f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    return f": {', '.join(names[:MAX_NAMED])}{more}" if names else ""


class _Budget:
    """Bounds the work of all runs."""

    def __init__(self, recording: Recording, iterations: int) -> None:
        self._iterations, self._left = iterations, float(MAX_WORK)
        steps = recording.from_start
        rows = [len(step.after.bodies) + len(step.after.contacts) + len(step.after.joints) for step in steps]
        self._rows = np.cumsum(rows, dtype=float)
        numbers = (step.number for step in steps if not is_within(LARGEST, step.after))
        most = recording.roster.until if recording.roster.why_not else len(steps)
        self.first_steps = min(self._steps(MAX_WORK / FIRST_RUNS), next(numbers, len(steps)), most)

    def spend(self, variant: Variant, count: int) -> None:
        """Count the work of a run of so many steps."""
        self._left -= self._cost(variant) * self._rows[count - 1]

    def affordable(self, variant: Variant, count: int) -> int:
        """Return of how many of some steps a run, with what follows it, is affordable."""
        return min(count, self._steps(self._left / AFTERWARDS / self._cost(variant)))

    def _steps(self, work: float) -> int:
        return int(np.searchsorted(self._rows, work, side="right"))

    def _cost(self, variant: Variant) -> float:
        """Return the work of a run, in that of the program's: half of a step with 10 iterations is spent on them."""
        return variant.substeps * (10 + self._iterations * variant.iterations) / (10 + self._iterations)


def _is_light(script: Script) -> NDArray[np.bool_]:
    """Return which bodies had a finite mass in all steps."""
    is_light = np.ones(len(script.sizes), bool)
    for step in script.steps:
        numbers, is_heavy = script.numbers(step.after.bodies["id"]), np.isinf(step.after.bodies["mass"])
        is_light[numbers[is_heavy & (numbers >= 0)]] = False
    return is_light


def _divided(substeps: int, settings: Mapping[str, float]) -> Variant:
    """Return finer steps: with four times as many, the solver has twice as many iterations in each."""
    return Variant(substeps, 2 ** (substeps.bit_length() // 2), settings)


def _judged(script: Script, finest: Variant, runs: list[Motion], since: Numbers, is_light: NDArray[np.bool_]) -> Finer:
    """Compare with what follows from the last three runs, each twice as fine as the one before."""
    count = len(runs[-1].place)
    coarse, medium, fine = (run.first(count) for run in runs)
    reference = medium.extrapolated(fine)
    error = distance(script.outlines, script.recorded.first(count), reference)
    error[:, ~is_light] = np.nan
    bar = np.fmax.accumulate(distance(script.outlines, coarse.extrapolated(medium), reference), axis=0)
    until = np.minimum(_counts(bar, error, script.sizes), since)
    return Finer(script, finest, reference, _cut(error, until), bar, until, since, np.zeros(len(until), bool), is_light)


def _counts(doubt: Floats, error: Floats, sizes: Floats) -> Numbers:
    """Return for how many steps what is doubtful of a reference stays below a tenth of the error that is reported."""
    doubts, errors = (np.fmax.accumulate(values, axis=0) for values in (doubt, error))
    is_doubtful = doubts > SHARE * np.fmax(errors, LEAST * sizes)
    return np.where(is_doubtful.any(axis=0), is_doubtful.argmax(axis=0), len(error))


def _cut(values: Floats, until: Numbers) -> Floats:
    """Return values up to a step for each body, NaN from there on."""
    return np.where(np.arange(len(values))[:, None] < until, values, np.nan)


def _tried(finer_run: Finer, settings: Mapping[str, float]) -> Iterator[Tried]:
    """Yield what other settings do to the largest error."""
    script, count = finer_run.script, int(finer_run.until.max())
    iterations = finer_run.start.settings.iterations
    variants = [(Tried("substeps", n, 0, n), Variant(substeps=n)) for n in SUBSTEPS_TRIED]
    variants += [(Tried("iterations", n * iterations, 0, n), Variant(iterations=n)) for n in ITERATIONS_TRIED]
    ideal = {**IDEAL, **settings}
    variants += [(Tried(name, value, 0, 1), Variant(settings={name: value})) for name, value in ideal.items()]
    for tried, variant in variants:
        motion = replay(script, variant, finer_run.since, count)
        left = _largest(finer_run, motion, finer_run.reference.first(count))
        yield tried._replace(removed=1 - left / finer_run.largest)


def _by_order(finer_run: Finer) -> float:
    """Return how far off the program's run the same steps lead if all is added in reverse order, px."""
    count = int(finer_run.until.max())
    motion = replay(finer_run.script, Variant(is_reversed=True), finer_run.since, count)
    return _largest(finer_run, motion, finer_run.script.recorded.first(count))


def _largest(finer_run: Finer, first: Motion, second: Motion) -> float:
    """Return how far apart bodies are at most in two runs, where there is a reference, px."""
    apart = distance(finer_run.script.outlines, first, second)
    return float(np.nanmax(_cut(apart, finer_run.until) + 0 * finer_run.error[: len(apart)]))


@dataclass(frozen=True)
class Compared:
    """A recording compared with finer steps. named: the bodies that other rules found, by rule and index."""

    evidence: Evidence
    finer: Finer
    named: Mapping[str, set[int | None]]


def _moves_on(compared: Compared) -> Iterator[Fault]:
    """Bodies that move on by a part of their size, and stand in the reference from the start to the end.

    So does all that touches them before they move: what something else hits may fall.
    """
    evidence, found = compared.evidence, compared.finer
    steps, last = found.script.steps, len(found.error) - 1
    is_known = found.is_light & (found.until > last)
    stands = {body.id: _stands(compared, number) for number, body in enumerate(found.script.roster.bodies)}
    for number, body in enumerate(found.script.roster.bodies):
        half = evidence.half_width(body.id)
        ways = _ways(found, found.script.recorded, number)
        way, since = float(ways.max()), steps[int(np.argmax(ways > STILL * half))]
        if is_known[number] and stands[body.id] and way > MAX_CREEP * half:
            what = f"moves {way:.3g} px from {since.end:.3f} to {steps[last].end:.3f} s"
            report = evidence.report((body.id,), steps[last], what)
            is_new = not any(report.index in compared.named.get(rule, ()) for rule in ALREADY_SAID)
            touched = _touched(steps[: since.number - steps[0].number + 1], body.id)
            if is_new and all(stands.get(other, True) for other in touched):
                yield Fault(way, report, f"{way:.3g} px", since=since.end)


def _stands(compared: Compared, number: int) -> bool:
    """Return whether a body, by its number, stands in the reference, as long as that is known."""
    found, body = compared.finer, list(compared.finer.script.roster.bodies)[number]
    most = STILL * compared.evidence.half_width(body.id) if compared.evidence.is_dynamic(body.id) else 0.0
    return bool((_ways(found, found.reference, number)[: found.until[number]] <= most).all())


def _touched(steps: Iterable[Step], body: int) -> Iterator[int]:
    """Yield the ids of the bodies that touch a body in some steps."""
    for step in steps:
        contacts = step.after.contacts
        for side, other in (("body_a", "body_b"), ("body_b", "body_a")):
            yield from contacts[other][contacts[side] == body].tolist()


def _ways(found: Finer, motion: Motion, body: int) -> Floats:
    """Return how far a body is in each compared step from where it is in the first, px."""
    column = slice(body, body + 1)
    moved = Motion(motion.place[: len(found.error), column], motion.angle[: len(found.error), column])
    return distance(found.script.outlines[column], moved, moved.first(1))[:, 0]


COMPARED_RULES: Final[Rules[Compared]] = {"moves-on": _moves_on}
