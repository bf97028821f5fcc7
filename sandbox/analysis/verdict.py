"""What a comparison comes to: key figures, a paragraph to act on; and what other settings of Pymunk would do."""

import math
from collections.abc import Iterator
from typing import Final

from sandbox.analysis.causes import CAUSES
from sandbox.analysis.comparison import Comparison, Run
from sandbox.analysis.difference import who
from sandbox.analysis.ledger import Entry

KEPT: Final = 1e-6  # share of the energy, below which it counts as kept: 100.0000 % of it is left
NOT_WRONG: Final = ("elasticity", "hand", "friction")  # what a scene or a person takes and gives
TUNED: Final = "pymunk"  # the engine that a scene has settings for
CURES: Final = {
    "late": "a higher rate, or more substeps, finds contacts sooner",
    "stale": "collision_persistence = 1 forgets the impulses of earlier touches",
    "unconverged": "more iterations, with collision_persistence = 1, let contacts of one time agree",
    "gravity": "a higher rate integrates gravity in finer steps",
}


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
    """Say until when each engine's paths are the reference's, the best first, and until when that means anything."""
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
