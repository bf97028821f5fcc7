"""The summary of a comparison: key figures, and a paragraph on what to trust and what to change."""

import math
import shlex
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import groupby
from typing import Final

import numpy as np

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.difference import contact_name, pair_name
from sandbox.analysis.expectations import overlap_in, worst
from sandbox.analysis.figures import Figures, Run, keeps_energy
from sandbox.analysis.gas import TheoryRow
from sandbox.engines import REFERENCE, TUNED, settings_in
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.text import counted, listed

NEGLIGIBLE_ENERGY: Final = 1e-6  # fraction of the energy; a smaller change counts as none: 100.0000 % is left
NO_ERROR: Final = (Cause.ELASTICITY, Cause.FRICTION, Cause.APPLIED)  # what the scene and the mouse ask for
NO_CAUSES: Final = (
    Cause.SPIN,
    Cause.ROUNDING,
    Cause.SOFT,
)  # lines that are no error that the ledger has found
SEEN_AT_START: Final = 1e-3  # of a radius, far above what an engine that computes in float32 loses
MAX_OWN_ERROR: Final = 0.01  # fraction of the energy that the reference may have in error before the verdict says so
EXPLAINED: Final = 0.1  # of an energy error, by which a ledger that explains it may differ
MAX_CANCELLED: Final = 5  # times an energy error, that its causes may come to before others cancel them
SHARE_SHOWN: Final = 0.2  # of an engine's error, from which on a further cause of it is said
UNKNOWN_SHOWN: Final = 0.01  # of an engine's error that fits no cause, before the verdict says so
MARK: Final = " *"  # of rows whose figures are of the whole run, though the paths soon mean nothing
_FINDS_SOONER: Final = "a higher rate, or more substeps, finds contacts sooner"
REMEDIES: Final = {
    Cause.LATE: _FINDS_SOONER,
    Cause.MISSED: _FINDS_SOONER,
    Cause.WARM_START: "collision_persistence = 1 discards the impulses of earlier touches",
    Cause.UNCONVERGED: "more iterations, with collision_persistence = 1, let simultaneous contacts converge",
    Cause.GRAVITY: "a higher rate integrates gravity in finer steps",
}
OF_PATHS: Final = ("RMS gap", "largest gap")  # rows that mean something only while paths do
OF_ENERGY: Final = ("energy left", "largest energy change")  # the same, unless the scene keeps its energy
OF_ROUGH: Final = "unexplained angular momentum"  # the row that only scenes have in which balls can turn
SAMPLING_ERRORS: Final = 4  # standard errors that a figure of theory may be off before it counts as wrong
MIN_SAMPLE: Final = 400  # contacts of balls; of fewer, theory says too little: 4/√400 are 20 %
MAX_THEORY_ERROR: Final = 0.05  # fraction by which theory may be off, where no exact engine shows it
MAX_COOLING: Final = 0.01  # fraction of the energy; an engine that changes more of it is not in equilibrium
ROWS: Final[tuple[tuple[str, str, Dimension, Callable[[Figures], float | None]], ...]] = (  # label, format, ...
    ("energy left", "{:.4%}", Dimension.NUMBER, lambda figures: figures.energy_ratio),
    ("largest energy change", "{:.2e}", Dimension.NUMBER, lambda figures: figures.energy_drift),
    ("energy error", "{:.2e}", Dimension.NUMBER, lambda figures: figures.energy_error),
    ("unexplained momentum", "{:.2e}", Dimension.NUMBER, lambda figures: figures.momentum_drift),
    (OF_ROUGH, "{:.2e}", Dimension.NUMBER, lambda figures: figures.angular_momentum_drift),
    ("RMS gap", "{:.4g}", Dimension.LENGTH, lambda figures: figures.gap_rms),
    ("largest gap", "{:.4g}", Dimension.LENGTH, lambda figures: figures.gap_max),
    ("ball contacts", "{:.0f}", Dimension.NUMBER, lambda figures: figures.pair_contacts),
    ("wall contacts", "{:.0f}", Dimension.NUMBER, lambda figures: figures.wall_contacts),
    ("deepest overlap", "{:.3g}", Dimension.LENGTH, lambda figures: figures.max_overlap),
    ("escaped balls", "{:.0f}", Dimension.NUMBER, lambda figures: figures.escaped),
)


def key_figures(comparison: Comparison) -> Iterator[list[str]]:
    """Yield the rows that every table of a comparison has: a label, and a value for each engine."""
    runs = comparison.runs.values()
    marked = _marked(comparison)
    units = comparison.scene.units
    for label, template, dimension, figure in ROWS:
        if label == OF_ROUGH and not comparison.scene.is_rough:
            continue
        values = [figure(run.figures) for run in runs]
        mark = MARK if label in marked else ""
        yield [label + mark, *("-" if value is None else units.text(dimension, template, value) for value in values)]
    if any(run.scores for run in runs):
        yield ["expectations met", *map(_met, runs)]
    firsts = [run.figures.first_difference for run in runs]
    yield ["first difference", *(f"{first.time:.3f} s" if first else "-" for first in firsts)]


def _met(run: Run) -> str:
    met, expected, skipped = run.figures.met, run.figures.expected, run.figures.skipped
    return f"{met} of {expected}" + (f", {skipped} skipped" if skipped else "")


def _marked(comparison: Comparison) -> tuple[str, ...]:
    """Return the rows that cover more than the time in which they mean something."""
    if comparison.trusted_until is None:
        return ()
    return OF_PATHS if keeps_energy(comparison.scene) else OF_ENERGY + OF_PATHS


def ledger_mark(comparison: Comparison) -> str:
    """Return the mark of the ledger's rows, which in a heap cover more than the reference can account for."""
    return MARK if comparison.trust.ends_by == "unresolved" else ""


def mark_words(comparison: Comparison) -> str:
    """Say what the mark at some rows of the table means; empty if none is marked."""
    if comparison.trusted_until is None:
        return ""
    return (
        f"{MARK.strip()} over the whole run, though {_reference(comparison)} is no measure for it after "
        f"{comparison.trusted_until:.2f} s."
    )


def trust_words(comparison: Comparison) -> str:
    """Say in a few words until when the reference's paths mean anything."""
    ends_by, until = comparison.trust.ends_by, comparison.trusted_until
    if until is None:
        return "no chaos within the run"
    return f"{ends_by} {'at' if ends_by == 'horizon' else 'from'} {until:.2f} s"


def reference_words(comparison: Comparison) -> str:
    """Say what several engines are measured against, and until when the reference's paths mean anything."""
    against = f"measured against {comparison.against}; " if comparison.others else ""
    return against + trust_words(comparison)


def verdict(comparison: Comparison) -> str:
    """Return what is wrong with each engine, a line for each, and then what to trust and what to change."""
    return "\n\n".join(filter(None, ("\n".join(findings(comparison)), " ".join(_assessment(comparison)))))


def verdict_parts(comparison: Comparison) -> list[str]:
    """Return the verdict part by part; each is a sentence or more."""
    return [*findings(comparison), *_assessment(comparison)]


def findings(comparison: Comparison) -> list[str]:
    """Return what is wrong with most of each engine's steps, and with the first, for each engine that has errors."""
    names = comparison.others or comparison.runs
    return [said for name in names if (said := _suffered(comparison, name))]


def _assessment(comparison: Comparison) -> list[str]:
    """Return how long paths are near, what the reference is worth, errors of energy and remedies."""
    parts = (
        _alone,
        _end,
        _start,
        _failures,
        _misreports,
        _paths,
        _of_each("Expectations missed", _missed_expectations),
        _trust,
        _errors_of_reference,
        _energy,
        _damping,
        _of_each("Passages through walls", _passages),
        _of_each("Escaped balls", _escapes),
        _statistics,
        _remedies,
    )
    sentences = [sentence for part in parts if (sentence := part(comparison))]
    return [f"T{said[1:]}" if said.startswith("the reference") else said for said in sentences]  # names stay


def _reference(comparison: Comparison) -> str:
    """Return what sentences call the reference: its name, unless settings make that long."""
    return comparison.against if "(" not in comparison.against else "the reference"


# The paths, and until when they mean anything


def _alone(comparison: Comparison) -> str:
    """Say that an engine is measured against nothing if it is the only one, and what would measure it."""
    if comparison.others:
        return ""
    name = comparison.against
    hint = "" if name == REFERENCE else f"; --engines {shlex.quote(f'{name},{REFERENCE}')} has a reference"
    return f"Only {name} took part, so nothing is measured against it{hint}."


def _end(comparison: Comparison) -> str:
    """Say where the comparison ends early, and why."""
    if not comparison.ended:
        return ""
    ended, until = comparison.ended, comparison.time[-1]
    return f"{ended.engine} ends at {until:.4g} s: {ended.why}. Every figure is up to there."


def _start(comparison: Comparison) -> str:
    """Say which engines begin elsewhere than the reference, as after edits, and how deep bodies overlap then."""
    scene, against, sentences = comparison.scene, _reference(comparison), []
    least, length = SEEN_AT_START * float(scene.bodies.radius.min()), partial(scene.units.text, Dimension.LENGTH)
    away = {name: run.gap_max[0] for name, run in comparison.others.items() if run.gap_max[0] > least}
    if away:
        gaps = ", ".join(f"{name} up to {length('{:.4g}', gap)}" for name, gap in away.items())
        sentences.append(
            f"At the start, balls are elsewhere than in {against}: in {gaps}. Later differences may come from that."
        )
    deepest = overlap_in(scene, comparison.runs[comparison.against].start.position)
    if deepest > least:
        by = length("{:.3g}", deepest)
        sentences.append(f"At the start, bodies overlap by up to {by}, which engines part in different ways.")
    return " ".join(sentences)


def _failures(comparison: Comparison) -> str:
    """Say which engines failed, and when."""
    return " ".join(f"{name} failed at {error.time:.3f} s." for name, error in comparison.failed.items())


def _misreports(comparison: Comparison) -> str:
    """Say which engines report other contacts than their balls had."""
    sentences = []
    for name, run in comparison.runs.items():
        if misreport := run.misreport:
            units, time = comparison.scene.units, comparison.scene.clock.time(misreport.step)
            changed = units.text(Dimension.VELOCITY, "({:.4g}, {:.4g})", *misreport.seen)
            reported = "({:.4g}, {:.4g})".format(*units.scaled(Dimension.VELOCITY, *misreport.reported))
            sentences.append(
                f"{name} misreports contacts in {counted(misreport.steps, 'step')}, first at {time:.3f} s: "
                f"ball {misreport.ball} changed by {changed}, and its contacts give {reported}."
            )
    return " ".join(sentences)


def _suffered(comparison: Comparison, name: str) -> str:
    """Say what is wrong with most of an engine's steps, what else is with many, and what is with the first."""
    run = comparison.runs[name]
    known = [each for each in run.suffered if each.cause != Cause.UNKNOWN]
    worst_fault = next((each for each in known if each.is_fault and each.share > UNKNOWN_SHOWN), None)
    said = [each for each in known if each.share >= SHARE_SHOWN or each in (known[0], worst_fault)]
    unknown = sum(each.share for each in run.suffered if each.cause == Cause.UNKNOWN)
    first, sentences = run.figures.first_difference, []
    for k, each in enumerate(said):
        often = f"{counted(each.times, 'time')}, {_percent(each.share)} of its error"
        example = "for example, " * each.is_example
        sentences.append(f"{'Also' if k else name}, {often}: {example}{_lower(each.because)}")
    if unknown > UNKNOWN_SHOWN:
        fits_none = f"{_percent(unknown)} of {name}'s error fits no single cause."
        sentences.insert(0 if known and unknown > known[0].share else len(sentences), fits_none)
    if first and not any(first.because.startswith(each.because) for each in said):
        who = pair_name(comparison.scene, first)
        sentences.append(f"{name} is wrong first at {first.time:.3f} s, {who}: {_lower(first.because)}")
    return " ".join(sentences)


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _lower(sentence: str) -> str:
    return f"{sentence[0].lower()}{sentence[1:]}"


def _paths(comparison: Comparison) -> str:
    """Say how long each engine has every ball within its radius of the reference's, the longest first."""
    runs = [(name, run.apart) for name, run in comparison.others.items() if run.apart != 0.0]
    if not runs or comparison.trusted_until == 0.0:
        return ""
    runs.sort(key=lambda item: -(math.inf if item[1] is None else item[1]))
    until = {name: until_words(comparison) if apart is None else f"until {apart:.2f} s" for name, apart in runs}
    groups = [(list(names), time) for time, names in groupby(until, until.__getitem__)]
    (best, longest), *others = groups
    sentence = f"In {listed(best)}, every ball stays within its radius of {_reference(comparison)} {longest}"
    return "".join([sentence, *(f", in {listed(names)} {time}" for names, time in others), "."])


def _of_each(title: str, clause: Callable[[Comparison, str], str]) -> Callable[[Comparison], str]:
    """Return a part of the verdict that lists the engines of which there is something to say."""

    def part(comparison: Comparison) -> str:
        clauses = [said for name in comparison.runs if (said := clause(comparison, name))]
        return f"{title}: {'; '.join(clauses)}." if clauses else ""

    return part


def _missed_expectations(comparison: Comparison, name: str) -> str:
    """Say how many of the scene's expectations an engine misses, and by how much at most."""
    run = comparison.runs[name]
    missed = [score for score in run.scores if score.missed]
    if not missed:
        return ""
    furthest = worst(missed)
    deviation = furthest.missed[0]
    units, dimension = comparison.scene.units, deviation.quantity.dimension
    off = units.text(dimension, "{:.2g}", deviation.error)
    [tolerance] = units.scaled(dimension, furthest.expect.tolerance)
    share = f"{len(missed)} of {run.figures.expected} in {name}"
    return f"{share}, in {deviation.quantity.label} by up to {off} (tolerance {tolerance:g})"


def until_words(comparison: Comparison) -> str:
    """Say until when paths can be compared with the reference's."""
    ends_by, until = comparison.trust.ends_by, comparison.trusted_until
    if until is None:
        return f"to the end at {round(comparison.time[-1], 2):g} s"
    if ends_by == "horizon":
        return f"up to the horizon at {until:.2f} s"
    return f"up to {until:.2f} s, where {_reference(comparison)} is {ends_by}"


def _trust(comparison: Comparison) -> str:
    """Say from when on no path can be trusted, and why."""
    trust, against = comparison.trust, _reference(comparison)
    match trust.ends_by:
        case "undecided":
            assert trust.tied
            when, reason = "at the same time", "no law says which first"
            if comparison.against != REFERENCE:
                when, reason = "in the same step", "the result depends on which has the lower number"
            return (
                f"{against} is undecided from {trust.undecided:.2f} s: {_tied(comparison.scene, trust.tied)} "
                f"touch ball {trust.tied[2]} {when}, and {reason}. From then on compare statistics only."
            )
        case "unresolved":
            return (
                f"{against} is not exact in this heap after {trust.unresolved:.2f} s: by then, half the hop of balls "
                "that lean on each other puts one more than a radius off. From then on compare statistics only."
            )
        case "horizon":
            return (
                f"After {trust.horizon:.2f} s compare statistics only: by then, shifting {against}'s balls by some "
                "units in the last place puts one more than a radius off."
            )
    return ""


def _tied(scene: Scene, tied: tuple[int, int, int]) -> str:
    """Name the two bodies that touch a ball in an order that is undecided. tied: as in `Trust`."""
    first, second = sorted(tied[:2], key=lambda body: (body < 0, abs(body)))
    if first < 0:
        return f"{scene.wall_name(~first)} and {scene.wall_name(~second)}"
    return contact_name(scene, first, second)


# The energy


def _errors_of_reference(comparison: Comparison) -> str:
    """Say how much of the energy the reference's own ledger has in error.

    Lines larger than all of the energy cancel others, and prove nothing. The flights of `exact` are parabolas, so its
    line of gravity has only what balls at rest lose as they settle; nor does it part what overlaps at the start.
    """
    run = comparison.runs[comparison.against]
    rightful = [Cause.DAMPING]  # a setting, of which the verdict has a sentence
    if comparison.against == REFERENCE:
        rightful += [Cause.GRAVITY, Cause.OVERLAPPED]
    scale, error = run.energy_scale, sum(energy for cause, energy in _errors(run).items() if cause not in rightful)
    if abs(error) <= MAX_OWN_ERROR * scale or max(map(abs, run.energy_by_cause.values())) > scale:
        return ""
    cause = _main_cause(run, error)
    return (
        f"{_reference(comparison)} is not free of errors: its own ledger has {100 * error / scale:+.2g} % of the "
        f"energy in error{f', mostly through “{cause.label}”' if cause else ''}."
    )


def _errors(run: Run) -> dict[Cause, float]:
    """Return the energy (kg px²/s²) of the lines of an engine's ledger that are its errors."""
    return {cause: energy for cause, energy in run.energy_by_cause.items() if cause not in (*NO_ERROR, *NO_CAUSES)}


def _main_cause(run: Run, error: float) -> Cause | None:
    """Return the cause of most of an error in energy (kg px²/s²), None if the ledger does not tell it."""
    errors = _errors(run)
    alike = {cause: abs(energy) for cause, energy in errors.items() if energy * error > 0}
    whole, same = sum(errors.values()), sum(alike.values())
    if not alike or abs(whole - error) > EXPLAINED * abs(error) or same > MAX_CANCELLED * abs(error):
        return None
    largest = max(alike, key=alike.__getitem__)
    return largest if alike[largest] > same / 2 and largest != Cause.UNKNOWN else None


def _energy(comparison: Comparison) -> str:
    """Say what the scene takes from the energy, and which engine is furthest from the reference's."""
    off = {name: run for name, run in comparison.others.items() if _energy_error(run) > NEGLIGIBLE_ENERGY}
    if not off:
        return _rightful(comparison, len(comparison.time) - 1) if comparison.trusted_until is None else ""
    name, run = max(off.items(), key=lambda item: _energy_error(item[1]))
    step = _step_of_energy_error(run)
    share, cause = float(run.energy_gap[step]), _explained(run)
    through = f", mostly through “{cause.label}”" if cause else ""
    than = f"{'less' if share < 0 else 'more'} than {_reference(comparison)}"
    return (
        f"{_rightful(comparison, step)} The largest energy error is {name}'s: at {comparison.time[step]:.2f} s it has "
        f"{100 * abs(share):.3g} % of the energy {than}{through}.{_pushed(comparison, name)}"
    ).strip()


def _pushed(comparison: Comparison, name: str) -> str:
    """Say by how much more energy pushes gave an engine than the reference: they act on other velocities there."""
    runs, scale = comparison.runs, comparison.energy_scale
    given, reference = (runs[engine].energy_by_cause.get(Cause.APPLIED, 0.0) for engine in (name, comparison.against))
    if abs(given - reference) <= NEGLIGIBLE_ENERGY * scale:
        return ""
    than = f"{'less' if given < reference else 'more'} than {_reference(comparison)}"
    return f" In all, {Cause.APPLIED.label} gave it {100 * abs(given - reference) / scale:.3g} % {than}."


def _damping(comparison: Comparison) -> str:
    """Say how much of the energy damping takes in each engine, and how to turn it off."""
    scale = comparison.energy_scale
    taken = {name: -run.energy_by_cause.get(Cause.DAMPING, 0.0) for name, run in comparison.runs.items()}
    shares = [
        (f"{100 * energy / scale:.3g} % of the energy" if scale else "Energy", name)
        for name, energy in taken.items()
        if abs(energy) > NEGLIGIBLE_ENERGY * scale
    ]
    if not shares:
        return ""
    (share, name), *others = shares
    also = "".join(f", {share} in {name}" for share, name in others)
    return f"{share} is taken by damping in {name}{also}; damping = 1 turns it off."


def _energy_error(run: Run) -> float:
    return run.figures.energy_error or 0.0


def _step_of_energy_error(run: Run) -> int:
    """Return the first step at which the energy is as far from the reference's as it ever is."""
    return int(np.argmax(np.abs(run.energy_gap) >= _energy_error(run) * (1 - NEGLIGIBLE)))


def _rightful(comparison: Comparison, step: int) -> str:
    """Say how much of the energy the scene and the mouse have taken or given by a step, if they have."""
    run = comparison.runs[comparison.against]
    if not run.energy_scale or not (comparison.others or comparison.against == REFERENCE):
        return ""
    least = NEGLIGIBLE_ENERGY * run.energy_scale
    share = float(run.energy_change[step])
    sign = math.copysign(1.0, share)  # what gave energy is no reason for a loss
    lines = run.energy_by_cause.items()
    causes = [cause for cause, energy in lines if cause in NO_ERROR and sign * energy > least]
    errors = sum(abs(energy) for cause, energy in lines if cause not in NO_ERROR)
    if errors > least and comparison.against != REFERENCE:
        return ""  # part of the change is the reference's own error
    if not causes or abs(share) <= NEGLIGIBLE_ENERGY or (share > 0 and Cause.APPLIED not in causes):
        return ""
    change = "lost" if share < 0 else "gained"
    whole = "the energy" if abs(share) <= 1 else "the scale of energy"  # a ball can fall twice
    return (
        f"By {comparison.time[step]:.2f} s, {100 * abs(share):.3g} % of {whole} is rightly {change}: "
        f"{_reason(comparison, causes)}."
    )


def _reason(comparison: Comparison, causes: Sequence[Cause]) -> str:
    """Say through what energy is lost or gained; if all contacts have one elasticity, what that leaves."""
    scene, balls = comparison.scene, np.unique(comparison.scene.bodies.elasticity).tolist()
    factors = [wall.elasticity for wall in scene.surfaces] + (balls if len(scene.bodies) > 1 else [])
    products = {round(ball * factor, 12) for ball in balls for factor in factors}
    if [*causes] != [Cause.ELASTICITY] or len(products) > 1:
        return f"through {listed([cause.label for cause in causes])}"
    [e] = products
    return f"an elasticity of {e:g} leaves {e:g} x {e:g} = {e * e:.4g} of the energy of approach at every bounce"


def _explained(run: Run) -> Cause | None:
    """Return the cause of most of an engine's energy error, None if its ledger does not explain the error."""
    return _main_cause(run, float(run.energy_gap[_step_of_energy_error(run)] * run.energy_scale))


# Balls that are where they should not be


def _passages(comparison: Comparison, name: str) -> str:
    """Say how many balls went through inner walls in an engine."""
    through = [passage for passage in comparison.runs[name].missed if passage.second < 0]
    if not through:
        return ""
    first = f"{pair_name(comparison.scene, through[0])} at {comparison.time[through[0].step]:.3f} s"
    return f"{len(through)} in {name}, the first {first}"


def _escapes(comparison: Comparison, name: str) -> str:
    """Say how many balls left the arena in an engine."""
    if not (escape := comparison.runs[name].escape):
        return ""
    at_end = f", {escape.left} still outside at the end" if escape.left else ""
    by = comparison.scene.units.text(Dimension.LENGTH, "{:.4g}", escape.furthest)
    first = f"the first ball {escape.ball} at {escape.time:.3f} s"
    return f"{escape.balls} in {name}, {first}, by up to {by}{at_end}"


# Statistics


def _statistics(comparison: Comparison) -> str:
    """Name the worst figure of theory of each engine, where paths mean nothing for part of the run."""
    if comparison.trusted_until is None or not any(run.theory for run in comparison.runs.values()):
        return ""
    deviating, agree = [], []
    for name, run in comparison.runs.items():
        cools = (run.figures.energy_drift or 0.0) > MAX_COOLING  # then there is no equilibrium, and no theory
        if cools or (run.figures.pair_contacts or 0) < MIN_SAMPLE:
            continue
        wrong = [(error, row) for row in run.theory if (error := _beyond_noise(comparison, run, row))]
        if wrong:
            error, row = max(wrong, key=lambda row_error: abs(row_error[0]))
            deviating.append(f"{name}'s {_error_words(error, row)}")
        else:
            agree.append(name)
    if not deviating and not agree:
        return ""
    if agree:
        deviating.append(
            f"{' and '.join(agree)} {'agree' if len(agree) > 1 else 'agrees'} with theory, as far as the sample shows"
        )
    return f"In statistics, {'; '.join(deviating)}."


def _error_words(error: float, row: TheoryRow) -> str:
    if not row.expected:
        return f"speeds are {row.measured:.2g} from their law"
    figure = row.figure.partition(",")[0]
    verb = "are" if figure.startswith("contacts") else "is"
    return f"{figure} {verb} {100 * abs(error):.2g} % too {'low' if error < 0 else 'high'} ({row.because})"


def worst_of_theory(comparison: Comparison, run: Run) -> float | None:
    """Return by what fraction the worst figure differs from theory, 0 if none does by more than its sample allows.

    None if no theory applies.
    """
    if not run.theory or (run.figures.energy_drift or 0.0) > MAX_COOLING:
        return None
    return max(abs(_beyond_noise(comparison, run, row)) for row in run.theory)


def _beyond_noise(comparison: Comparison, run: Run, row: TheoryRow) -> float:
    """Return by what fraction a figure differs from theory; 0 if no more than its sample, or the theory, allows.

    A sample of n contacts allows 1/√n, several times. How far theory is off in a scene of few balls shows in the exact
    engine's own figures.
    """
    figures, exact = run.figures, comparison.runs.get(REFERENCE)
    contacts = figures.wall_contacts if row.figure.startswith("wall") else figures.pair_contacts
    off = MAX_THEORY_ERROR
    if exact and exact is not run:
        off = max((abs(_error(each)) for each in exact.theory if each.figure == row.figure), default=off)
    error = _error(row)
    return error if abs(error) > SAMPLING_ERRORS / math.sqrt(max(contacts or 0, 1)) + off else 0.0


def _error(row: TheoryRow) -> float:
    return row.measured / row.expected - 1 if row.expected else row.measured


# What to change


def _remedies(comparison: Comparison) -> str:
    """Say which settings of Pymunk to change."""
    tuned: dict[str, list[str]] = {}  # remedies -> the engines that they are for
    for name, run in comparison.others.items():
        if settings_in(name)[0] == TUNED and (remedies := _remedies_of(run)):
            tuned.setdefault(remedies, []).append(name)
    sentences = [f"For {listed(names)}, {remedies}." for remedies, names in tuned.items()]
    return " ".join([*sentences, "--advise tries that and more."]) if sentences else ""


def _remedies_of(run: Run) -> str:
    """Name the settings that an engine's errors call for, if any do."""
    first = run.figures.first_difference
    cause = _explained(run) if _energy_error(run) > NEGLIGIBLE_ENERGY else None
    causes = ([cause] if cause else []) + ([first.cause] if first and not first.in_reference else [])
    causes += [Cause.MISSED] if run.missed else []
    return "; ".join(dict.fromkeys(REMEDIES[cause] for cause in causes if cause in REMEDIES))
