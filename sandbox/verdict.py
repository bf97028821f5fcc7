"""What a comparison comes to: key figures, a paragraph to act on; and what other settings of Pymunk would do."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from sandbox.comparison import Comparison, Run, compare
from sandbox.difference import who
from sandbox.inputs import Input
from sandbox.ledger import CAUSES, Entry
from sandbox.mistakes import Mistake
from sandbox.scene import Scene

KEPT: Final = 1e-6  # share of the energy, below which it counts as kept: 100.0000 % of it is left
NOT_WRONG: Final = ("elasticity", "hand", "friction")  # what a scene or a person takes and gives
TUNED: Final = "pymunk"  # the engine that a scene has settings for
CURES: Final = {
    "late": "a higher rate, or more substeps, finds contacts sooner",
    "stale": "collision_persistence = 1 forgets the impulses of earlier touches",
    "unconverged": "more iterations, with collision_persistence = 1, let contacts of one time agree",
    "gravity": "a higher rate integrates gravity in finer steps",
}
FINER: Final = 4  # times the steps, in a trial
MANY: Final = 200  # iterations, in a trial


_ROWS: Final = {  # what the table calls each figure, and how it is written
    "energy_ratio": ("energy left", "{:.4%}"),
    "energy_drift": ("largest energy change", "{:.2e}"),
    "momentum_drift": ("momentum from nowhere", "{:.2e}"),
    "gap_rms": ("gap, RMS", "{:.4g} px"),
    "gap_max": ("gap, largest", "{:.4g} px"),
    "pair_contacts": ("contacts of balls", "{}"),
    "wall_contacts": ("contacts with walls", "{}"),
    "max_overlap": ("deepest overlap", "{:.3g} px"),
    "escaped": ("balls that escaped", "{}"),
}


def key_figures(comparison: Comparison) -> Iterator[list[str]]:
    """Yield what is shown of each engine in every table: a label, and a value an engine."""
    runs = comparison.runs.values()
    for figure, (label, form) in _ROWS.items():
        values = [getattr(run.figures, figure) for run in runs]
        yield [label, *("-" if value is None else form.format(value) for value in values)]
    if any(run.scores for run in runs):
        yield ["expectations met", *(f"{run.figures.met} of {run.figures.expected}" for run in runs)]
    firsts = [run.figures.first_difference for run in runs]
    yield ["first difference", *(f"{first.time:.3f} s" if first else "-" for first in firsts)]


def verdict(comparison: Comparison) -> str:
    """Say which engine to believe until when, what the largest error is, and what to change."""
    said = [*_of_paths(comparison), *_of_energy(comparison), *_of_walls(comparison), *_of_cures(comparison)]
    return " ".join(said) or f"Nothing is measured against {comparison.against}."


def astray(run: Run) -> tuple[float, Entry] | None:
    """Return which share of its energy an engine lost or gained without right, and the line with most of that.

    None where the energy was kept.
    """
    entries = [entry for entry in run.figures.ledger if entry.cause not in NOT_WRONG]
    start, change = float(run.energy[0]), sum(entry.energy for entry in entries)
    if not start or abs(change / start) <= KEPT:
        return None
    return change / start, max(entries, key=lambda entry: math.copysign(1.0, change) * entry.energy)


def _others(comparison: Comparison) -> dict[str, Run]:
    return {name: run for name, run in comparison.runs.items() if name != comparison.against}


def _of_paths(comparison: Comparison) -> Iterator[str]:
    """Say until when each engine's paths are the yardstick's, the best first, and until when that means anything."""
    end, horizon = float(comparison.time[-1]), comparison.horizon
    runs = sorted(_others(comparison).items(), key=lambda item: -(item[1].apart or math.inf))
    told = [f"{name} {f'until {run.apart:.2f} s' if run.apart else f'to the end at {end:g} s'}" for name, run in runs]
    if told:
        parted = any(run.apart for _, run in runs)
        why = "by then a ball is its own radius away" if parted else "no ball is its own radius away"
        yield f"Against {comparison.against}, believe {', '.join(told)}: {why}."
    if told and horizon is not None:
        yield (
            f"No path means anything after {horizon:.2f} s, when a twin of {comparison.against} that began one unit in "
            "the last place aside is a radius away: from there on compare statistics only."
        )


def _of_energy(comparison: Comparison) -> Iterator[str]:
    """Say where most energy goes that should not."""
    found = {name: of_engine for name, run in _others(comparison).items() if (of_engine := astray(run))}
    if found:
        name, (share, entry) = max(found.items(), key=lambda item: abs(item[1][0]))
        change = f"{100 * abs(share):.3g} % of the energy is {'lost' if share < 0 else 'gained'}"
        yield f"The largest error is {name}'s: {change}, most of it by “{CAUSES[entry.cause]}”."


def _of_walls(comparison: Comparison) -> Iterator[str]:
    """Say whose balls went through walls of the scene's own, and whose were outside the arena."""
    through, outside = [], []
    for name, run in comparison.runs.items():
        passages = [one for one in run.missed if one.second < 0]
        if passages:
            first = f"{who(comparison.scene, passages[0])} at {passages[0].step / comparison.scene.rate:.3f} s"
            through.append(f"{name}'s {len(passages)}, first {first}")
        if run.outing:
            time, ball, balls, furthest = run.outing
            to_the_end = f", {run.figures.escaped} of them at the end" if run.figures.escaped else ""
            outside.append(
                f"{name}'s {balls}, first ball {ball} at {time:.3f} s, by up to {furthest:.4g} px{to_the_end}"
            )
    if through:
        yield f"Passages through walls: {'; '.join(through)}."
    if outside:
        yield f"Balls outside the arena: {'; '.join(outside)}."


def _of_cures(comparison: Comparison) -> Iterator[str]:
    """Say what to change of Pymunk."""
    run = _others(comparison).get(TUNED)
    if run is None:
        return
    of_energy, first = astray(run), run.figures.first_difference
    causes = ([of_energy[1].cause] if of_energy else []) + ([first.cause] if first else [])
    causes += ["late"] if run.missed else []
    cures = dict.fromkeys(CURES[cause] for cause in causes if cause in CURES)
    if cures:
        yield f"For {TUNED}, {'; '.join(cures)}. --advise tries that and more."


# Other settings


@dataclass(frozen=True)
class Trial:
    """How Pymunk does with some settings changed."""

    changes: dict[str, int]
    apart: float | None  # s, until when its paths are the yardstick's; None for to the end
    astray: float  # share of the energy lost or gained without right
    gap_rms: float  # px, over all balls and times

    @property
    def settings(self) -> str:
        """The changes as a scene would say them."""
        return ", ".join(f"{key} = {value}" for key, value in self.changes.items()) or "as it is"


def advise(scene: Scene, against: str, inputs: Sequence[Input] = ()) -> list[Trial]:
    """Run Pymunk with settings changed, each against the yardstick, the scene as it is first.

    Raises Mistake where the yardstick is Pymunk itself.
    """
    if against == TUNED:
        raise Mistake(f"--advise cannot measure {TUNED} against itself; --engines {TUNED},exact has another yardstick")
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
