"""Other settings of Pymunk, what each gains and what it costs, and which of them to use."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.analysis.comparison import Comparison, compare
from sandbox.analysis.verdict import NEGLIGIBLE_ENERGY, percent
from sandbox.engines import REFERENCE
from sandbox.engines.specs import TUNED, format_settings, with_settings
from sandbox.errors import SandboxError
from sandbox.run.inputs import Grab, Input
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension, Units

FINER_STEPS: Final = 4  # factor on the substeps
MORE_ITERATIONS: Final = 200
ALIKE: Final = 0.05  # fraction by which two trials may differ and count as equally good
NEGLIGIBLE_GAP: Final = 0.01  # px; a smaller gap counts as none


@dataclass(frozen=True)
class TriedSettings:
    """A run of Pymunk with some settings changed, compared with the reference; JSON has it without the units."""

    changes: dict[str, int]  # settings of `[pymunk]`
    passages: int  # of balls through walls or each other, without a contact
    escapes: int  # balls that left the arena
    apart: float | None  # s, when its paths leave the reference's; None if not while the reference means anything
    gap_rms: float  # px, over all balls and the times up to when the reference means nothing
    energy_error: float | None  # as in `Figures`, None if the mouse gives each engine its own energy
    units: Units  # of the scene

    @property
    def settings(self) -> str:
        """The changes, as in the name of an engine with settings."""
        return format_settings(self.changes) or "no change"


class Rank(NamedTuple):
    """A figure to rank trials by. badness: smaller is better; text: the figure in words."""

    label: str
    badness: Callable[[TriedSettings], float]
    text: Callable[[TriedSettings], str]

    def better(self, first: TriedSettings, second: TriedSettings) -> bool:
        """Return whether a trial is better than another by more than ALIKE."""
        return self.badness(first) < (1 - ALIKE) * self.badness(second)


RANKS: Final = (  # what matters most comes first
    Rank("passages", lambda trial: trial.passages, lambda trial: str(trial.passages)),
    Rank("escapes", lambda trial: trial.escapes, lambda trial: str(trial.escapes)),
    Rank(
        "paths agree",
        lambda trial: 0.0 if trial.apart is None else 1 / trial.apart if trial.apart else math.inf,
        lambda trial: "throughout" if trial.apart is None else f"until {trial.apart:.2f} s",
    ),
    Rank(
        "RMS gap",
        lambda trial: max(trial.gap_rms - NEGLIGIBLE_GAP, 0.0) if trial.apart is None else math.inf,
        lambda trial: trial.units.text(Dimension.LENGTH, "{:.4g}", trial.gap_rms),
    ),
    Rank(
        "energy error",
        lambda trial: max((trial.energy_error or 0.0) - NEGLIGIBLE_ENERGY, 0.0),
        lambda trial: "-" if trial.energy_error is None else percent(trial.energy_error),
    ),
)


def try_settings(
    scene: Scene, against: str, inputs: Sequence[Input] = (), progress: Callable[[float], object] | None = None
) -> list[TriedSettings]:
    """Run Pymunk with the scene's own settings and with others, each against the reference.

    The first is without changes; simpler changes come before others. progress: called now and then with the fraction
    that is done. Raises SandboxError if the reference is Pymunk itself.
    """
    if against == TUNED:
        raise SandboxError(
            f"advice on {TUNED} cannot be measured against {TUNED} itself; use another reference, such as {REFERENCE}"
        )
    tried = {with_settings(TUNED, changes): changes for changes in _changes(scene)}
    comparison = compare(scene, [*tried, against], against=against, inputs=inputs, progress=progress)
    return [_trial(comparison, name, changes) for name, changes in tried.items()]


def _changes(scene: Scene) -> Iterator[dict[str, int]]:
    """Yield what to change, the simplest first; of equally many changes, what costs the least time."""
    steady = {"collision_persistence": 1}
    finer = {"substeps": FINER_STEPS * scene.pymunk.substeps}
    converged = {"iterations": MORE_ITERATIONS, **steady}
    yield from ({}, steady, finer, {"iterations": MORE_ITERATIONS}, converged, finer | converged)


def _trial(comparison: Comparison, engine: str, changes: dict[str, int]) -> TriedSettings:
    run, until = comparison.runs[engine], comparison.trusted_until
    trusted = comparison.time < (math.inf if until is None else until)
    return TriedSettings(
        changes,
        passages=run.missed,
        escapes=run.figures.escaped,
        apart=run.apart,
        gap_rms=float(np.sqrt(np.mean(run.gap_rms[trusted] ** 2))) if trusted.any() else 0.0,
        energy_error=None if any(isinstance(given, Grab) for given in comparison.inputs) else run.figures.energy_error,
        units=comparison.scene.units,
    )


def advice_rows(trials: Sequence[TriedSettings]) -> Iterator[list[str]]:
    """Yield the rows of a table of trials: the labels, then a row for each. What no trial has is left out."""
    ranks = [rank for rank in RANKS if any(0 < rank.badness(trial) < math.inf for trial in trials)]
    yield [f"{TUNED} with", *(rank.label for rank in ranks)]
    for trial in trials:
        yield [trial.settings, *(rank.text(trial) for rank in ranks)]


def advised(trials: Sequence[TriedSettings]) -> TriedSettings:
    """Return the trial to use: of those about as good as the best by every rank in turn, the simplest."""
    for rank in RANKS:
        best = min(trials, key=rank.badness)
        trials = [trial for trial in trials if not rank.better(best, trial)]
    return min(trials, key=lambda trial: len(trial.changes))


def recommend(trials: Sequence[TriedSettings]) -> str:
    """Return a paragraph that says what to change, what that gains, and what becomes worse."""
    now, chosen = trials[0], advised(trials)
    if chosen is now:
        return "None of the settings tried is better."
    words = {rank: f"{rank.label} {rank.text(chosen)} instead of {rank.text(now)}" for rank in RANKS}
    gains = "; ".join(text for rank, text in words.items() if rank.better(chosen, now))
    costs = "; ".join(text for rank, text in words.items() if rank.better(now, chosen))
    return f"{chosen.settings}: {gains}." + (f" But {costs}." if costs else "")


def as_json(trials: Sequence[TriedSettings]) -> dict[str, Any]:
    """Return what `--json` writes about trials; an empty dictionary if nothing was tried."""
    if not trials:
        return {}
    best = advised(trials)
    listed = [
        {key: value for key, value in vars(trial).items() if key != "units"} | {"advised": trial is best}
        for trial in trials
    ]
    return {"advice": listed, "recommendation": recommend(trials)}
