"""Other settings of Pymunk, and what each would gain."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from sandbox.analysis.comparison import compare
from sandbox.analysis.verdict import KEPT, TUNED, astray
from sandbox.errors import SandboxError
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene

FINER: Final = 4  # times the steps, in a trial


MANY: Final = 200  # iterations, in a trial


@dataclass(frozen=True)
class Trial:
    """How Pymunk does with some settings changed."""

    changes: dict[str, int]
    apart: float | None  # s, until when its paths are the reference's; None for to the end
    astray: float  # share of the energy lost or gained without right
    gap_rms: float  # px, over all balls and times

    @property
    def settings(self) -> str:
        """The changes as a scene would say them."""
        return ", ".join(f"{key} = {value}" for key, value in self.changes.items()) or "as it is"


def advise(scene: Scene, against: str, inputs: Sequence[Input] = ()) -> list[Trial]:
    """Run Pymunk with settings changed, each against the reference, the scene as it is first.

    Raises SandboxError where the reference is Pymunk itself.
    """
    if against == TUNED:
        raise SandboxError(
            f"--advise cannot measure {TUNED} against itself; --engines {TUNED},exact has another reference"
        )
    pymunk = scene.pymunk
    steady = {"iterations": MANY, "collision_persistence": 1}
    finer = {"substeps": FINER * pymunk.substeps}
    tried = [{}, finer, *({key: value} for key, value in steady.items()), steady, finer | steady]
    if not inputs:  # which belong to steps
        tried.insert(1, {"rate": FINER * scene.rate})
    return [_try(scene, changes, against, inputs) for changes in tried]


def _try(scene: Scene, changes: dict[str, int], against: str, inputs: Sequence[Input]) -> Trial:
    rate = changes.get("rate", scene.rate)
    settings = {key: value for key, value in changes.items() if key != "rate"}
    changed = scene.changed(rate=rate, pymunk=scene.pymunk.model_copy(update=settings))
    run = compare(changed, [TUNED, against], against=against, inputs=inputs).runs[TUNED]
    of_energy = astray(run)
    return Trial(changes, run.apart, abs(of_energy[0]) if of_energy else 0.0, run.figures.gap_rms)


def advice(trials: Sequence[Trial]) -> str:
    """Say which of the trials to take, and what it gains: for the energy, and for the paths."""
    before, *others = trials
    said = []
    best = min(others, key=lambda trial: (_magnitude(trial.astray), len(trial.changes)))
    if _magnitude(best.astray) < _magnitude(before.astray):
        said.append(f"{best.settings}: {_share(best)} of the energy goes astray instead of {_share(before)}.")
    best = max(others, key=lambda trial: (trial.apart or math.inf, -trial.gap_rms))
    if (best.apart or math.inf) > (before.apart or math.inf):
        until = f"until {best.apart:.2f} s" if best.apart else "to the end"
        said.append(f"{best.settings}: the paths hold {until}, instead of until {before.apart:.2f} s.")
    elif before.apart is None and best.gap_rms < before.gap_rms:
        said.append(f"{best.settings}: the gap is {best.gap_rms:.2g} px RMS instead of {before.gap_rms:.2g} px.")
    return " ".join(said) or "None of the settings tried is better."


def _magnitude(share: float) -> int:
    """Return the power of ten of a share; all that rounding leaves is one."""
    return math.floor(math.log10(max(share, KEPT)))


def _share(trial: Trial) -> str:
    return f"{100 * trial.astray:.2g} %" if trial.astray else "none"
