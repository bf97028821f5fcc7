"""Other settings of Pymunk, and what each would gain."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from sandbox.analysis.comparison import compare
from sandbox.analysis.verdict import NEGLIGIBLE_ENERGY
from sandbox.engines import TUNED
from sandbox.errors import SandboxError
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene

FINER_STEPS: Final = 4  # factor on the rate or the substeps
MORE_ITERATIONS: Final = 200


@dataclass(frozen=True)
class Trial:
    """A run of Pymunk with some settings changed."""

    changes: dict[str, int]
    apart: float | None  # s, when its paths leave the reference's; None if they agree to the end
    energy_error: float  # fraction of the energy gained or lost in error
    gap_rms: float  # px, over all balls and times

    @property
    def settings(self) -> str:
        """The changes as a scene writes them."""
        return ", ".join(f"{key} = {value}" for key, value in self.changes.items()) or "no change"

    def as_json(self) -> dict[str, Any]:
        """Return what `--json` writes."""
        return {"changes": self.changes, "apart": self.apart, "astray": self.energy_error, "gap_rms": self.gap_rms}


def try_settings(scene: Scene, against: str, inputs: Sequence[Input] = ()) -> list[Trial]:
    """Run Pymunk with the scene's own settings and then with others, each against the reference.

    Raises SandboxError if the reference is Pymunk itself.
    """
    if against == TUNED:
        raise SandboxError(
            f"--advise cannot measure {TUNED} against itself; --engines {TUNED},exact has another reference"
        )
    pymunk = scene.pymunk
    steady = {"iterations": MORE_ITERATIONS, "collision_persistence": 1}
    finer = {"substeps": FINER_STEPS * pymunk.substeps}
    tried = [{}, finer, *({key: value} for key, value in steady.items()), steady, finer | steady]
    if not inputs:  # recorded inputs belong to steps, and so to one rate
        tried.insert(1, {"rate": FINER_STEPS * scene.rate})
    return [_try(scene, changes, against, inputs) for changes in tried]


def _try(scene: Scene, changes: dict[str, int], against: str, inputs: Sequence[Input]) -> Trial:
    rate = changes.get("rate", scene.rate)
    settings = {key: value for key, value in changes.items() if key != "rate"}
    changed = scene.changed(rate=rate, pymunk=scene.pymunk.model_copy(update=settings))
    run = compare(changed, [TUNED, against], against=against, inputs=inputs).runs[TUNED]
    return Trial(changes, run.apart, run.figures.energy_error or 0.0, run.figures.gap_rms)


def recommend(trials: Sequence[Trial]) -> str:
    """Return a paragraph that recommends the trials that gain most: for the energy, and for the paths."""
    now, *others = trials
    sentences = []
    best = min(others, key=lambda trial: (_magnitude(trial.energy_error), len(trial.changes)))
    if _magnitude(best.energy_error) < _magnitude(now.energy_error):
        sentences.append(f"{best.settings}: the energy error is {_percent(best)} instead of {_percent(now)}.")
    best = max(others, key=lambda trial: (trial.apart or math.inf, -trial.gap_rms))
    if (best.apart or math.inf) > (now.apart or math.inf):
        until = f"until {best.apart:.2f} s" if best.apart else "to the end"
        sentences.append(f"{best.settings}: the paths agree {until} instead of until {now.apart:.2f} s.")
    elif now.apart is None and best.gap_rms < now.gap_rms:
        sentences.append(f"{best.settings}: the RMS gap is {best.gap_rms:.2g} px instead of {now.gap_rms:.2g} px.")
    return " ".join(sentences) or "None of the settings tried is better."


def _magnitude(share: float) -> int:
    """Return the power of ten of a fraction; everything negligible has the same."""
    return math.floor(math.log10(max(share, NEGLIGIBLE_ENERGY)))


def _percent(trial: Trial) -> str:
    return f"{100 * trial.energy_error:.2g} %"
