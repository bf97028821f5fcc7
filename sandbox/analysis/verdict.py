"""The summary of a comparison: key figures, and a paragraph on what to trust and what to change."""

import math
from collections.abc import Callable, Iterator
from typing import Final

from sandbox.analysis.causes import Cause
from sandbox.analysis.comparison import Comparison
from sandbox.analysis.difference import pair_name
from sandbox.analysis.ledger import Entry
from sandbox.analysis.measurement import Figures, Run

NEGLIGIBLE_ENERGY: Final = 1e-6  # fraction of the energy; a smaller change counts as none: 100.0000 % is left
NO_ERROR: Final = (Cause.ELASTICITY, Cause.HAND, Cause.FRICTION)  # what the scene and the mouse ask for
TUNED: Final = "pymunk"  # the engine that a scene has settings for
REMEDIES: Final = {
    Cause.LATE: "a higher rate, or more substeps, finds contacts sooner",
    Cause.STALE: "collision_persistence = 1 discards the impulses of earlier touches",
    Cause.UNCONVERGED: "more iterations, with collision_persistence = 1, let simultaneous contacts converge",
    Cause.GRAVITY: "a higher rate integrates gravity in finer steps",
}
ROWS: Final[tuple[tuple[str, str, Callable[[Figures], float | None]], ...]] = (  # label, format, figure
    ("energy left", "{:.4%}", lambda figures: figures.energy_ratio),
    ("largest energy change", "{:.2e}", lambda figures: figures.energy_drift),
    ("unexplained momentum", "{:.2e}", lambda figures: figures.momentum_drift),
    ("RMS gap", "{:.4g} px", lambda figures: figures.gap_rms),
    ("largest gap", "{:.4g} px", lambda figures: figures.gap_max),
    ("ball contacts", "{}", lambda figures: figures.pair_contacts),
    ("wall contacts", "{}", lambda figures: figures.wall_contacts),
    ("deepest overlap", "{:.3g} px", lambda figures: figures.max_overlap),
    ("escaped balls", "{}", lambda figures: figures.escaped),
)


def key_figures(comparison: Comparison) -> Iterator[list[str]]:
    """Yield the rows that every table of a comparison has: a label, and a value for each engine."""
    runs = comparison.runs.values()
    for label, template, figure in ROWS:
        values = [figure(run.figures) for run in runs]
        yield [label, *("-" if value is None else template.format(value) for value in values)]
    if any(run.scores for run in runs):
        yield ["expectations met", *map(_met, runs)]
    firsts = [run.figures.first_difference for run in runs]
    yield ["first difference", *(f"{first.time:.3f} s" if first else "-" for first in firsts)]


def _met(run: Run) -> str:
    met, expected, skipped = run.figures.met, run.figures.expected, run.figures.skipped
    return f"{met} of {expected}" + (f", {skipped} skipped" if skipped else "")


def horizon_words(comparison: Comparison) -> str:
    """Return the horizon in words."""
    return "no chaos within the run" if comparison.horizon is None else f"horizon at {comparison.horizon:.2f} s"


def verdict(comparison: Comparison) -> str:
    """Return a paragraph: how long each engine's paths can be trusted, the largest error, and what to change."""
    parts = (_agreement, _horizon, _largest_energy_error, _passages, _escapes, _remedies)
    sentences = [sentence for part in parts if (sentence := part(comparison))]
    return " ".join(sentences) or f"Nothing is measured against {comparison.against}."


def energy_error(run: Run) -> tuple[float, Entry] | None:
    """Return the fraction of its energy that an engine gained or lost in error, and the ledger's line with most of it.

    None if the energy was kept.
    """
    entries = [entry for entry in run.figures.ledger if entry.cause not in NO_ERROR]
    start, change = float(run.energy[0]), sum(entry.energy for entry in entries)
    if not start or abs(change / start) <= NEGLIGIBLE_ENERGY:
        return None
    return change / start, max(entries, key=lambda entry: math.copysign(1.0, change) * entry.energy)


def _others(comparison: Comparison) -> dict[str, Run]:
    return {name: run for name, run in comparison.runs.items() if name != comparison.against}


def _agreement(comparison: Comparison) -> str:
    """Say how long each engine's paths agree with the reference's, the longest first."""
    runs = sorted(_others(comparison).items(), key=lambda item: -(item[1].apart or math.inf))
    if not runs:
        return ""
    end = f"to the end at {comparison.time[-1]:g} s"
    (best, run), *others = [(name, f"until {run.apart:.2f} s" if run.apart else end) for name, run in runs]
    until = ", ".join([f"{best} agrees with {comparison.against} {run}", *(f"{name} {time}" for name, time in others)])
    if any(run.apart for _, run in runs):
        return f"{until}, when a ball is first more than its radius off."
    return f"{until}: no ball is more than its radius off."


def _horizon(comparison: Comparison) -> str:
    """Say from when on no path can be trusted."""
    if comparison.horizon is None or not _others(comparison):
        return ""
    return (
        f"After {comparison.horizon:.2f} s compare statistics only: by then, shifting {comparison.against}'s first "
        "ball by one unit in the last place puts a ball more than a radius off."
    )


def _largest_energy_error(comparison: Comparison) -> str:
    found = {name: error for name, run in _others(comparison).items() if (error := energy_error(run))}
    if not found:
        return ""
    name, (share, entry) = max(found.items(), key=lambda item: abs(item[1][0]))
    change = f"{'loses' if share < 0 else 'gains'} {100 * abs(share):.3g} % of the energy"
    return f"The largest energy error is {name}'s: it {change}, mostly through “{entry.cause.label}”."


def _passages(comparison: Comparison) -> str:
    """Name the engines whose balls went through inner walls."""
    sentences = []
    for name, run in comparison.runs.items():
        through = [passage for passage in run.missed if passage.second < 0]
        if through:
            first = f"{pair_name(comparison.scene, through[0])} at {through[0].step / comparison.scene.rate:.3f} s"
            sentences.append(f"{len(through)} in {name}, the first {first}")
    return f"Passages through walls: {'; '.join(sentences)}." if sentences else ""


def _escapes(comparison: Comparison) -> str:
    """Name the engines whose balls left the arena."""
    sentences = []
    for name, run in comparison.runs.items():
        if run.escape:
            time, ball, balls, furthest = run.escape
            at_end = f", {run.figures.escaped} still outside at the end" if run.figures.escaped else ""
            sentences.append(
                f"{balls} in {name}, the first ball {ball} at {time:.3f} s, by up to {furthest:.4g} px{at_end}"
            )
    return f"Balls outside the arena: {'; '.join(sentences)}." if sentences else ""


def _remedies(comparison: Comparison) -> str:
    """Say which settings of Pymunk to change."""
    run = _others(comparison).get(TUNED)
    if run is None:
        return ""
    error, first = energy_error(run), run.figures.first_difference
    causes = ([error[1].cause] if error else []) + ([first.cause] if first else [])
    causes += [Cause.LATE] if run.missed else []
    remedies = dict.fromkeys(REMEDIES[cause] for cause in causes if cause in REMEDIES)
    return f"For {TUNED}, {'; '.join(remedies)}. --advise tries that and more." if remedies else ""
