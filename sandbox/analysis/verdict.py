"""What a comparison comes to: a few lines for each engine, the worst first, and the rows of its table."""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.expectations import overlap_in
from sandbox.analysis.figures import Figures, Run
from sandbox.engines import REFERENCE
from sandbox.engines.specs import TUNED, settings_in
from sandbox.judge.causes import Cause
from sandbox.judge.thresholds import NEGLIGIBLE
from sandbox.judge.words import OF_STEPS
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.text import counted

NEGLIGIBLE_ENERGY: Final = 1e-6  # fraction of the energy; a smaller error counts as none
ROUNDING: Final = 1e-6  # of any figure in the table, px or %; less is written as 0
SEEN_AT_START: Final = 1e-3  # of a radius; a smaller overlap is not said
MAX_CAUSES: Final = 3  # of an engine
FURTHER_ON: Final = 0.1  # of the largest error in energy: "at worst" is said if the last differs from it by more
SHARE_SHOWN: Final = 0.01  # of an engine's error, below which a further cause is not said
IN_FLIGHT: Final = (Cause.GRAVITY, Cause.DAMPING, Cause.UNREPORTED, Cause.TELEPORTED)  # of steps, not of contacts
REMEDIES: Final = {  # said once, of Pymunk
    Cause.LATE: "More steps a second, or substeps, find them sooner.",
    Cause.WARM_START: "collision_persistence = 1 discards the impulses of earlier touches.",
    Cause.UNCONVERGED: "More iterations, with collision_persistence = 1, let simultaneous contacts converge.",
    Cause.GRAVITY: "More steps a second integrate gravity in finer steps.",
    Cause.DAMPING: "damping = 1 turns it off.",
}


def summaries(comparison: Comparison) -> dict[str, tuple[str, ...]]:
    """Return the lines on each engine: those that failed, then the worst first, and the reference last."""
    remedies = dict(REMEDIES)
    said: dict[str, tuple[str, ...]] = {
        name: (f"Failed at {error.time:.3f} s.",) for name, error in comparison.failed.items()
    }
    worst_first = sorted(comparison.others, key=lambda name: _badness(comparison.runs[name]))
    said |= {name: tuple(_lines(comparison, name, remedies)) for name in worst_first}
    said[comparison.against] = tuple(_lines_of_reference(comparison, remedies))
    return {name: lines for name, lines in said.items() if lines}


def verdict(comparison: Comparison) -> str:
    """Return a paragraph for each engine."""
    return "\n".join(f"{name}: {' '.join(lines)}" for name, lines in summaries(comparison).items())


def _badness(run: Run) -> tuple[float, float, float]:
    """Return what engines are ordered by: the error in energy, when paths part (s), the gap (px)."""
    error = run.figures.energy_error or 0.0
    apart = math.inf if run.apart is None else run.apart
    return -error if error > NEGLIGIBLE_ENERGY else 0.0, apart, -run.figures.gap_rms


def _lines(comparison: Comparison, name: str, remedies: dict[Cause, str]) -> Iterator[str]:
    """Yield the lines of an engine. remedies: those not said yet."""
    run, reference = comparison.runs[name], comparison.runs[comparison.against]
    yield from _energy(comparison, run)
    yield from _causes(comparison, name, remedies)
    if run.is_spinless and reference.final.spin.any():
        yield "It reports no spins, so its friction cannot match; an engine that is a class can report them."
    if not len(run.errors) and run.gap_max.any() and any(each.cause != Cause.UNKNOWN for each in reference.causes):
        yield f"No step of it is wrong: the differences are errors of {_short(comparison)}."
    if run.apart == 0:
        yield f"Begins more than a ball's radius from {_short(comparison)}, so their paths cannot be compared."
    elif run.apart is not None:
        yield f"Within a ball's radius of {_short(comparison)} until {run.apart:.2f} s."
    elif comparison.trusted_until != 0:
        end = comparison.trusted_until
        until = "to the end" if end is None else f"until {end:.2f} s, as long as paths can be compared"
        yield f"Within a ball's radius of {_short(comparison)} {until}."
    yield from _besides(comparison, name)


def _lines_of_reference(comparison: Comparison, remedies: dict[Cause, str]) -> Iterator[str]:
    """Yield the lines of the reference: its own errors, and from when on its paths mean nothing."""
    name = comparison.against
    if not comparison.others:
        hint = "" if name == REFERENCE else f"; {REFERENCE} would be a reference"
        yield f"Only {name} took part, so nothing is measured against it{hint}."
    if name != REFERENCE:
        yield from _causes(comparison, name, remedies)
    overlap = overlap_in(comparison.scene, comparison.runs[name].start.position)
    if overlap > SEEN_AT_START * comparison.scene.bodies.radius.min():
        deep = comparison.scene.units.text(Dimension.LENGTH, "{:.3g}", overlap)
        yield f"At the start, bodies overlap by up to {deep}, which engines part in different ways."
    if comparison.trusted_until is not None:
        yield f"From {comparison.trusted_until:.2f} s on, compare statistics only: {why_it_ends(comparison)}."
    yield from _besides(comparison, name)


def _short(comparison: Comparison) -> str:
    """Return what sentences call the reference: its name, or 'the reference' if settings make that long."""
    return comparison.against if "(" not in comparison.against else "the reference"


def percent(share: float) -> str:
    """Return a fraction in %, with three digits."""
    return f"{100 * share if abs(share) > ROUNDING else 0:.3g} %"


def _energy(comparison: Comparison, run: Run) -> Iterator[str]:
    """Say how much of the energy an engine misses at most, or has too much."""
    error = run.figures.energy_error
    if error is None:
        return
    known = np.isfinite(run.energy_gap)
    until, then = ("", "in the end") if known.all() else (f"until {comparison.time[known.argmin()]:.2f} s", "then")
    if error <= NEGLIGIBLE_ENERGY:
        yield f"Energy as it should be {until}".rstrip() + "."
        return
    share = run.energy_gap[np.argmax(np.abs(run.energy_gap) >= error * (1 - NEGLIGIBLE))]
    last = float(run.energy_gap[known][-1])
    end = f" at worst; {_amount(last)} {then}" if abs(last - share) > FURTHER_ON * error else ""
    yield f"{until.capitalize()}, {_amount(share)}{end}.".removeprefix(", ")
    runs = (run, comparison.runs[comparison.against])
    given, expected = (each.energy_by_cause.get(Cause.APPLIED, 0.0) for each in runs)
    if abs(given - expected) > NEGLIGIBLE_ENERGY * run.energy_scale:
        than = f"{'less' if given < expected else 'more'} than {_short(comparison)}"
        yield f"The mouse or your code gave it {percent(abs(given - expected) / run.energy_scale)} {than}."


def _amount(share: float) -> str:
    """Return how much energy is missing or too much. share: what there is too much, of the scale."""
    return f"{percent(share)} too much energy" if share > 0 else f"{percent(-share)} of the energy is missing"


def _causes(comparison: Comparison, name: str, remedies: dict[Cause, str]) -> Iterator[str]:
    """Yield what an engine suffers most from, with remedies that are not said yet, and how much is unknown."""
    run, is_tuned = comparison.runs[name], settings_in(name)[0] == TUNED
    known = [each for each in run.causes if each.cause != Cause.UNKNOWN]
    unknown = [each for each in run.causes if each.cause == Cause.UNKNOWN]
    is_known = sum(each.share for each in unknown) <= SHARE_SHOWN
    for number, each in enumerate(known[:MAX_CAUSES]):
        if each.share < SHARE_SHOWN and (number or not is_known):
            break
        remedy = remedies.pop(each.cause, "") if is_tuned else ""
        steps = f"{counted(each.contacts, 'step')} of a ball"
        times = steps if each.cause in IN_FLIGHT else counted(each.contacts, "contact")
        yield f"{times}: {each.sentence[0].lower()}{each.sentence[1:]} {remedy}".rstrip()
    crowded = sum(each.share for each in unknown if each.sentence == OF_STEPS["several"])
    if crowded > SHARE_SHOWN:
        yield f"{percent(crowded)} of its error is in steps with several contacts at once, which are not judged."
    if (single := sum(each.share for each in unknown) - crowded) > SHARE_SHOWN:
        yield f"{percent(single)} of its error fits no single cause."
    if Cause.SOFT in run.energy_by_cause:
        yield "Its contacts are soft and last several steps, so they are not judged."


def why_it_ends(comparison: Comparison) -> str:
    """Return why a comparison ends early, or why no path can be trusted from some time on; empty if neither."""
    trust = comparison.trust
    match trust.ends_by:
        case "undecided":
            when = "come at the same time" if comparison.against == REFERENCE else "fall into one step"
            return f"several contacts {when}, and no law says which comes first; another order moves ball {trust.ball}"
        case "unresolved":
            return "by then, another treatment of its heap puts a ball more than a radius off"
        case "horizon":
            return "by then, shifting balls by some units in the last place puts one more than a radius off"
    return comparison.ended.why if comparison.ended else ""


def _besides(comparison: Comparison, name: str) -> Iterator[str]:
    """Yield what else matters of an engine, a line each."""
    run, scene = comparison.runs[name], comparison.scene
    if comparison.ended and comparison.ended.engine == name:
        why, until = comparison.ended.why, comparison.time[-1]
        yield f"Ends at {until:.4g} s: {why}. Every figure is up to there."
    if run.misreports:
        step, ball = run.misreports[0]
        first = f"first of ball {ball} at {scene.clock.time(step):.3f} s"
        yield f"Misreports contacts in {counted(len(run.misreports), 'step')}, {first}."
    if escape := run.escape:
        by = scene.units.text(Dimension.LENGTH, "{:.4g}", escape.furthest)
        first = f"first ball {escape.ball} at {escape.time:.3f} s"
        yield f"{counted(escape.balls, 'ball')} left the arena, {first}, by up to {by}."


# The table


def is_heap(comparison: Comparison) -> bool:
    """Return whether balls come to rest on each other after the reference's paths have lost their meaning."""
    scene = comparison.scene
    return comparison.trusted_until is not None and any(scene.gravity) and not scene.keeps_energy


def _in_percent(share: float | None) -> float | None:
    return None if share is None else 100 * share


COUNT: Final = "{:.0f}", Dimension.NUMBER
LENGTH: Final = "{:.4g}", Dimension.LENGTH
SHARE: Final = "{:.3g} %", Dimension.NUMBER
ROWS: Final[Mapping[str, tuple[tuple[str, Dimension], Callable[[Run, slice], float | None]]]] = {
    "energy change": (("{:+.3g} %", Dimension.NUMBER), lambda run, rows: 100 * float(run.energy_change[rows][-1])),
    "energy error": (SHARE, lambda run, _: _in_percent(run.figures.energy_error)),
    "RMS gap": (LENGTH, lambda run, rows: float(np.sqrt(np.mean(run.gap_rms[rows] ** 2)))),
    "largest gap": (LENGTH, lambda run, rows: float(run.gap_max[rows].max())),
    "ball contacts": (COUNT, lambda run, _: run.figures.pair_contacts),
    "wall contacts": (COUNT, lambda run, _: run.figures.wall_contacts),
    "missed contacts": (COUNT, lambda run, _: run.missed),
    "escaped balls": (COUNT, lambda run, _: run.figures.escaped),
    "deepest overlap": (LENGTH, lambda run, _: run.figures.max_overlap),
    "unexplained momentum": (SHARE, lambda run, _: _in_percent(run.figures.momentum_drift)),
}


def key_figures(comparison: Comparison) -> Iterator[list[str]]:
    """Yield the rows that every table of a comparison has, what matters most first: a label, a value for each engine.

    Rows in which nothing differs from 0 are left out. Those that mean something only while paths do end with these.
    """
    runs, until = comparison.runs.values(), comparison.trusted_until
    if any(run.scores for run in runs):
        yield ["expectations met", *(_met(run.figures) for run in runs)]
    firsts = [run.figures.first_difference for run in runs]
    if any(firsts):
        yield ["first difference", *(f"{first.time:.3f} s" if first else "-" for first in firsts)]
        yield ["  cause", *(first.cause.label if first else "-" for first in firsts)]
    rows = slice(None if until is None else 1 + comparison.scene.clock.step(until))
    of_error, of_change = not comparison.scene.keeps_energy, is_heap(comparison)
    ends = {"RMS gap": True, "largest gap": True, "energy error": of_error, "energy change": of_change}
    for label, ((template, dimension), figure) in ROWS.items():
        is_cut = until is not None and ends.get(label, False)
        values = [figure(run, rows if is_cut else slice(None)) for run in runs]
        if any(value and abs(value) > ROUNDING for value in values):
            end = f" until {until:.2f} s" if is_cut else ""
            yield [label + end, *(_cell(comparison.scene, dimension, template, value) for value in values)]


def _cell(scene: Scene, dimension: Dimension, template: str, value: float | None) -> str:
    if value is None or abs(value) > ROUNDING:
        return "-" if value is None else scene.units.text(dimension, template, value)
    return scene.units.text(dimension, template.replace("+", ""), 0.0)


def _met(figures: Figures) -> str:
    return f"{figures.met} of {figures.expected}" + (f", {figures.skipped} skipped" if figures.skipped else "")
