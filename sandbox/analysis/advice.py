"""Other settings of Pymunk, what each gains and what it costs, and which of them to use."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.analysis.comparison import Comparison, compare
from sandbox.analysis.documents import TrialFigures
from sandbox.analysis.verdict import MAX_THEORY_ERROR, NEGLIGIBLE_ENERGY, worst_of_theory
from sandbox.engines import REFERENCE, TUNED, settings_in, with_settings
from sandbox.engines.specs import format_settings
from sandbox.errors import SandboxError
from sandbox.run.edits import SetRate
from sandbox.run.inputs import Grab, Input, clock_of
from sandbox.scene.clock import Clock
from sandbox.scene.fields import MAX_COUNT
from sandbox.scene.model import MAX_STEPS, Scene
from sandbox.scene.spawn import needed_rate, spawn
from sandbox.scene.units import Dimension, Units

FINER_STEPS: Final = 4  # factor on the rate or the substeps
MORE_ITERATIONS: Final = 200
ALIKE: Final = 0.05  # fraction by which two trials may differ and count as equally good
NEGLIGIBLE_GAP: Final = 1e-3  # of the smallest radius; a smaller gap counts as none

Changes = dict[str, int]  # of the scene's rate and of Pymunk's settings


@dataclass(frozen=True)
class TriedSettings(TrialFigures):
    """A trial.

    until: s, until when the reference means anything, None if to the end; scale: px, the least gap that counts; units:
    of the scene.
    """

    until: float | None
    scale: float
    units: Units

    @property
    def settings(self) -> str:
        """The changes, as in the name of an engine with settings."""
        return format_settings(self.changes) or "no change"

    @property
    def agrees(self) -> str:
        """Until when its paths agree, in words."""
        if self.apart is not None:
            return f"until {self.apart:.2f} s"
        return "to the end" if self.until is None else f"at least until {self.until:.2f} s"

    def as_json(self, advised: bool) -> dict[str, Any]:
        """Return what `--json` writes."""
        return {each.name: getattr(self, each.name) for each in fields(TrialFigures)} | {"advised": advised}


class Rank(NamedTuple):
    """Something to rank trials by.

    badness: smaller is better; value: a trial's, in words; words: a sentence around a value, and one to compare with;
    noise: what two values may differ by and mean the same.
    """

    name: str
    badness: Callable[[TriedSettings], float]
    value: Callable[[TriedSettings], str]
    words: str
    noise: float = 0.0

    def better(self, first: TriedSettings, second: TriedSettings) -> bool:
        """Return whether a trial is better than another by more than ALIKE and the noise."""
        return self.badness(first) < (1 - ALIKE) * self.badness(second) - self.noise

    def best(self, trials: Sequence[TriedSettings]) -> list[TriedSettings]:
        """Return the trials that are about as good as the best."""
        best = min(trials, key=self.badness)
        return [trial for trial in trials if not self.better(best, trial)]

    def compared(self, first: TriedSettings, second: TriedSettings) -> str:
        """Return what one trial has, and what another has instead."""
        return self.words.format(self.value(first), self.value(second))


def _off_theory(trial: TriedSettings) -> str:
    match trial.theory:
        case None:
            return "unknown"
        case 0.0:
            return "within the noise"
    return f"{100 * trial.theory:.2g} %"


def _off_energy(trial: TriedSettings) -> str:
    error = trial.energy_error or 0.0
    return f"{100 * error:.2g} %" if error > NEGLIGIBLE_ENERGY else f"below {100 * NEGLIGIBLE_ENERGY:g} %"


RANKS: Final = (  # what matters most comes first
    Rank(
        "passages",
        lambda trial: trial.passages,
        lambda trial: str(trial.passages),
        "{} passages without a contact instead of {}",
    ),
    Rank(
        "escapes",
        lambda trial: trial.escapes,
        lambda trial: str(trial.escapes),
        "{} balls leave the arena instead of {}",
    ),
    Rank(
        "paths",
        lambda trial: 0.0 if trial.apart is None else 1 / trial.apart if trial.apart else math.inf,
        lambda trial: trial.agrees,
        "the paths agree {} instead of {}",
    ),
    Rank(
        "gap",
        lambda trial: max(trial.gap, trial.scale) if trial.apart is None else math.inf,
        lambda trial: trial.units.text(Dimension.LENGTH, "{:.2g}", trial.gap),
        "the RMS gap is {} instead of {}",
    ),
    Rank(
        "theory",
        lambda trial: math.inf if trial.theory is None else trial.theory,
        _off_theory,
        "the largest difference from theory is {} instead of {}",
        MAX_THEORY_ERROR,
    ),
    Rank(
        "energy",
        lambda trial: max(trial.energy_error or 0.0, NEGLIGIBLE_ENERGY),
        _off_energy,
        "the energy error is {} instead of {}",
    ),
)


def try_settings(
    scene: Scene,
    against: str,
    inputs: Sequence[Input] = (),
    progress: Callable[[float], object] | None = None,
) -> list[TriedSettings]:
    """Run Pymunk with the scene's own settings and then with others, each against the reference.

    The first is without changes; simpler changes come before others. Trials of one rate run together. progress: called
    now and then with the fraction that is done.
    Raises SandboxError if the reference is Pymunk itself.
    """
    if against == TUNED:
        raise SandboxError(
            f"advice on {TUNED} cannot be measured against {TUNED} itself; use another reference, such as {REFERENCE}"
        )
    tried = list(_changes(scene, against, inputs))
    rates = dict.fromkeys(changes.get("rate", scene.rate) for changes in tried)
    trials: list[TriedSettings] = []
    for number, rate in enumerate(rates):
        group = [changes for changes in tried if changes.get("rate", scene.rate) == rate]
        names = [with_settings(TUNED, {key: n for key, n in changes.items() if key != "rate"}) for changes in group]
        reference = _reference_at(rate, scene, against)
        comparison = compare(
            scene.changed(rate=rate),
            [*names, reference],
            against=reference,
            inputs=at_rate(inputs, scene.rate, rate),
            progress=partial(_show_part, progress, number, len(rates)) if progress else None,
        )
        trials += [_trial(comparison, name, changes) for changes, name in zip(group, names, strict=True)]
        if comparison.ended:  # so that all trials are of the same time
            scene = scene.changed(seconds=comparison.since + float(comparison.time[-1]))
    return sorted(trials, key=lambda trial: tried.index(trial.changes))


def _show_part(progress: Callable[[float], object], number: int, parts: int, done: float) -> None:
    progress((number + done) / parts)


def _changes(scene: Scene, against: str, inputs: Sequence[Input]) -> Iterator[Changes]:
    """Yield what to change, the simplest first; of equally many changes, what costs the least time."""
    steady = {"collision_persistence": 1}
    converged = {"iterations": MORE_ITERATIONS, **steady}
    finer = {"substeps": FINER_STEPS * scene.pymunk.substeps}
    yield from ({}, steady, finer)
    for rate in _rates(scene, against):
        highest = max([scene.rate, *(given.rate for given in inputs if isinstance(given, SetRate))]) * rate / scene.rate
        if highest <= MAX_COUNT and rate * scene.seconds <= MAX_STEPS:
            yield {"rate": rate}
    yield from ({"iterations": MORE_ITERATIONS}, converged, finer | converged)


def _rates(scene: Scene, against: str) -> list[int]:
    """Return the rates to try: a finer one, and the one that `check` names.

    A reference that takes steps must take the same ones at each rate, see `_reference_at`: the next higher rate that
    allows this is tried instead, or none.
    """
    enough = needed_rate(scene, spawn(scene))
    rates = {FINER_STEPS * scene.rate} | ({enough} if enough else set())
    if against != REFERENCE:
        total = _substeps(scene, against) * scene.rate  # steps of the reference per second
        counts = (next((k for k in range(total // rate, 0, -1) if total % k == 0), None) for rate in rates)
        rates = {total // k for k in counts if k}
    return sorted(rates)


def _substeps(scene: Scene, engine: str) -> int:
    """Return the number of substeps of an engine: 1 unless it is Pymunk."""
    name, settings = settings_in(engine)
    return int(settings.get("substeps", scene.pymunk.substeps)) if name == TUNED else 1


def _reference_at(rate: int, scene: Scene, against: str) -> str:
    """Return the reference for trials of a rate. Pymunk has as many substeps as it takes to have the same steps."""
    if rate == scene.rate or against == REFERENCE:
        return against
    name, settings = settings_in(against)
    return with_settings(name, settings | {"substeps": _substeps(scene, against) * scene.rate // rate})


def at_rate(inputs: Sequence[Input], old: int, new: int) -> list[Input]:
    """Return recorded inputs for another rate: each at the step nearest to its time, rates in proportion."""
    before, converted = clock_of(Clock(old), inputs), list[Input]()
    for given in inputs:
        step = clock_of(Clock(new), converted).step(before.time(given.step))
        changed = {"rate": round(given.rate * new / old)} if isinstance(given, SetRate) else {}
        converted.append(given.model_copy(update={"step": step, **changed}))
    return converted


def _trial(comparison: Comparison, engine: str, changes: Changes) -> TriedSettings:
    run, until = comparison.runs[engine], comparison.trusted_until
    trusted = comparison.time < (math.inf if until is None else until)
    return TriedSettings(
        changes,
        passages=len(run.missed),
        escapes=run.figures.escaped,
        apart=run.apart,
        until=until,
        gap=float(np.sqrt(np.mean(run.gap_rms[trusted] ** 2))) if trusted.any() else 0.0,
        theory=worst_of_theory(comparison, run),
        energy_error=None if any(isinstance(given, Grab) for given in comparison.inputs) else run.figures.energy_error,
        astray=run.figures.energy_error or 0.0,
        gap_rms=run.figures.gap_rms,
        scale=NEGLIGIBLE_GAP * float(comparison.scene.bodies.radius.min()),
        units=comparison.scene.units,
    )


def advice_rows(trials: Sequence[TriedSettings]) -> Iterator[list[str]]:
    """Yield the rows of a table of trials: the labels, then a row for each. What no trial has is left out."""
    columns: list[tuple[str, list[str]]] = [
        ("passages", [str(trial.passages) for trial in trials] if any(trial.passages for trial in trials) else []),
        ("escapes", [str(trial.escapes) for trial in trials] if any(trial.escapes for trial in trials) else []),
        ("paths agree", [trial.agrees for trial in trials]),
        ("RMS gap", [trial.units.text(Dimension.LENGTH, "{:.4g}", trial.gap) for trial in trials]),
        ("off theory", [_off_theory(trial) for trial in trials] if any(trial.theory for trial in trials) else []),
        ("energy error", ["-" if trial.energy_error is None else f"{trial.energy_error:.2e}" for trial in trials]),
    ]
    shown = [(label, values) for label, values in columns if values]
    yield [f"{TUNED} with", *(label for label, _ in shown)]
    for row, trial in enumerate(trials):
        yield [trial.settings, *(values[row] for _, values in shown)]


def advised(trials: Sequence[TriedSettings]) -> TriedSettings:
    """Return the trial to use: of those about as good as the best by every rank in turn, the simplest."""
    for rank in RANKS:
        trials = rank.best(trials)
    return min(trials, key=lambda trial: len(trial.changes))


def recommend(trials: Sequence[TriedSettings]) -> str:
    """Return a paragraph that says what to change, what that gains, and what becomes worse.

    Where other changes do better in something that matters less, it names them, with what they cost.
    """
    now, chosen = trials[0], advised(trials)
    sentences = [_described(chosen, now)] if chosen is not now else ["None of the settings tried is better."]
    named = [chosen]
    for rank in RANKS:
        best = min(rank.best(trials), key=lambda trial: len(trial.changes))
        if rank.better(best, chosen) and rank.better(best, now) and best not in named:
            named.append(best)
            sentences.append(f"For the {rank.name} alone, {_described(best, now)}")
    return " ".join(sentences)


def _described(trial: TriedSettings, now: TriedSettings) -> str:
    """Say what a trial gains and what it costs."""
    gains = [rank.compared(trial, now) for rank in RANKS if rank.better(trial, now)]
    costs = [rank.compared(trial, now) for rank in RANKS if rank.better(now, trial)]
    return f"{trial.settings}: {'; '.join(gains)}." + (f" But {'; '.join(costs)}." if costs else "")


def as_json(trials: Sequence[TriedSettings]) -> dict[str, Any]:
    """Return what `--json` writes about trials; an empty dictionary if nothing was tried."""
    if not trials:
        return {}
    best = advised(trials)
    return {
        "advice": [trial.as_json(advised=trial is best) for trial in trials],
        "recommendation": recommend(trials),
    }
