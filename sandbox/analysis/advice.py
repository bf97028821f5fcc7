"""Other settings of Pymunk, what each gains and what it costs, and which of them to use."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.analysis.comparison import Comparison, compare
from sandbox.analysis.documents import TrialFigures
from sandbox.analysis.verdict import MAX_THEORY_ERROR, NEGLIGIBLE_ENERGY, percent, worst_of_theory
from sandbox.engines import REFERENCE, TUNED, with_settings
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
NEGLIGIBLE_GAP: Final = 0.01  # px; a smaller difference counts as none

Changes = dict[str, int]  # of the scene's rate and of Pymunk's settings


@dataclass(frozen=True)
class TriedSettings(TrialFigures):
    """A trial. units: of the scene."""

    units: Units

    @property
    def settings(self) -> str:
        """The changes, as in the name of an engine with settings."""
        return format_settings(self.changes) or "no change"

    @property
    def agrees(self) -> str:
        """Until when its paths agree, in words."""
        return "throughout" if self.apart is None else f"until {self.apart:.2f} s"

    @property
    def off_theory(self) -> str:
        """How far the worst figure of a gas is from theory, in words."""
        return "unknown" if self.theory is None else percent(self.theory) if self.theory else "within the noise"

    def length(self, gap: float) -> str:
        """Return a distance, px, in words."""
        return self.units.text(Dimension.LENGTH, "{:.4g}", gap)


class Rank(NamedTuple):
    """Something to rank trials by.

    badness: smaller is better; value: a trial's, in words; words: a sentence around a value, and one to compare with;
    noise: what two values may differ by and mean the same.
    """

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


RANKS: Final = (  # what matters most comes first
    Rank(
        lambda trial: trial.passages, lambda trial: str(trial.passages), "{} passages without a contact instead of {}"
    ),
    Rank(lambda trial: trial.escapes, lambda trial: str(trial.escapes), "{} balls leave the arena instead of {}"),
    Rank(
        lambda trial: 0.0 if trial.apart is None else 1 / trial.apart if trial.apart else math.inf,
        lambda trial: trial.agrees,
        "the paths agree {} instead of {}",
    ),
    Rank(
        lambda trial: trial.gap if trial.apart is None else math.inf,
        lambda trial: trial.length(trial.gap),
        "the RMS gap is {} instead of {}",
        NEGLIGIBLE_GAP,
    ),
    Rank(
        lambda trial: math.inf if trial.theory is None else trial.theory,
        lambda trial: trial.off_theory,
        "the largest difference from theory is {} instead of {}",
        MAX_THEORY_ERROR,
    ),
    Rank(
        lambda trial: trial.energy_error or 0.0,
        lambda trial: percent(trial.energy_error or 0.0),
        "the energy error is {} instead of {}",
        NEGLIGIBLE_ENERGY,
    ),
)


def try_settings(
    scene: Scene, against: str, inputs: Sequence[Input] = (), progress: Callable[[float], object] | None = None
) -> list[TriedSettings]:
    """Run Pymunk with the scene's own settings and then with others, each against the reference.

    The first is without changes; simpler changes come before others. Trials of one rate run together. progress: called
    now and then with the fraction that is done.
    Other rates are tried only against `exact`, which does not depend on the rate.
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
        comparison = compare(
            scene.changed(rate=rate),
            [*names, against],
            against=against,
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
    enough = needed_rate(scene, spawn(scene))  # the one that `check` names
    for rate in sorted({FINER_STEPS * scene.rate, enough or scene.rate} - {scene.rate}) if against == REFERENCE else ():
        highest = max([scene.rate, *(given.rate for given in inputs if isinstance(given, SetRate))]) * rate / scene.rate
        if highest <= MAX_COUNT and rate * scene.seconds <= MAX_STEPS:
            yield {"rate": rate}
    yield from ({"iterations": MORE_ITERATIONS}, converged, finer | converged)


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
        gap=float(np.sqrt(np.mean(run.gap_rms[trusted] ** 2))) if trusted.any() else 0.0,
        theory=worst_of_theory(comparison, run),
        energy_error=None if any(isinstance(given, Grab) for given in comparison.inputs) else run.figures.energy_error,
        astray=run.figures.energy_error or 0.0,
        gap_rms=run.figures.gap_rms,
        units=comparison.scene.units,
    )


def advice_rows(trials: Sequence[TriedSettings]) -> Iterator[list[str]]:
    """Yield the rows of a table of trials: the labels, then a row for each. What no trial has is left out."""
    columns: list[tuple[str, bool, Callable[[TriedSettings], str]]] = [
        ("passages", any(trial.passages for trial in trials), lambda trial: str(trial.passages)),
        ("escapes", any(trial.escapes for trial in trials), lambda trial: str(trial.escapes)),
        ("paths agree", True, lambda trial: trial.agrees),
        ("RMS gap", True, lambda trial: trial.length(trial.gap)),
        ("off theory", any(trial.theory for trial in trials), lambda trial: trial.off_theory),
        ("energy error", True, lambda trial: "-" if trial.energy_error is None else percent(trial.energy_error)),
    ]
    shown = [(label, value) for label, is_shown, value in columns if is_shown]
    yield [f"{TUNED} with", *(label for label, _ in shown)]
    for trial in trials:
        yield [trial.settings, *(value(trial) for _, value in shown)]


def advised(trials: Sequence[TriedSettings]) -> TriedSettings:
    """Return the trial to use: of those about as good as the best by every rank in turn, the simplest."""
    for rank in RANKS:
        trials = rank.best(trials)
    return min(trials, key=lambda trial: len(trial.changes))


def recommend(trials: Sequence[TriedSettings]) -> str:
    """Return a paragraph that says what to change, what that gains, and what becomes worse."""
    now, chosen = trials[0], advised(trials)
    if chosen is now:
        return "None of the settings tried is better."
    gains, costs = (
        "; ".join(rank.words.format(rank.value(chosen), rank.value(now)) for rank in RANKS if rank.better(*pair))
        for pair in ((chosen, now), (now, chosen))
    )
    return f"{chosen.settings}: {gains}." + (f" But {costs}." if costs else "")


def as_json(trials: Sequence[TriedSettings]) -> dict[str, Any]:
    """Return what `--json` writes about trials; an empty dictionary if nothing was tried."""
    if not trials:
        return {}
    best, keys = advised(trials), [field.name for field in fields(TrialFigures)]
    listed = [{key: getattr(trial, key) for key in keys} | {"advised": trial is best} for trial in trials]
    return {"advice": listed, "recommendation": recommend(trials)}
