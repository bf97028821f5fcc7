"""The run so far, compared: what the window says of each engine while it goes on, in the words of `compare`."""

from collections.abc import Iterator
from dataclasses import dataclass

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.difference import Difference
from sandbox.analysis.figures import Run
from sandbox.analysis.verdict import ledger_mark, until_words, verdict_parts
from sandbox.report.tables import NOTHING, sentence, share_text, velocities_and_spins
from sandbox.view.run_so_far import Marks, RunSoFar


@dataclass(frozen=True)
class OtherContact:
    """A contact in which an engine differs from the reference, as `compare` describes it.

    step: of the run, the one that contains it; time: s, since the run began; speeds: of its balls before and after, and
    spins if they turn, line by line.
    """

    step: int
    time: float
    sentence: str
    speeds: str
    difference: Difference


@dataclass(frozen=True)
class LedgerLine:
    """Energy that an engine has lost (negative) or made through one cause. share: of the scale of energy."""

    cause: str
    share: float
    text: str


@dataclass(frozen=True)
class EngineCase:
    """The part of the summary that is about one engine.

    contacts: those that differ from the reference's, in order; agrees: the sentence that replaces an empty list of
    contacts; ledger: its lines, except those that round to 0.0000 %.
    """

    contacts: tuple[OtherContact, ...]
    agrees: str
    ledger: tuple[LedgerLine, ...]


@dataclass(frozen=True)
class Case:
    """Summary of a run so far.

    marks: what has stood out in it; since: s, the time of the last edit, from which all times in words count; verdict:
    its parts, each a sentence or more; engines: all but the reference, and without those that failed, of which the
    verdict speaks.
    """

    marks: Marks
    since: float
    verdict: tuple[str, ...]
    engines: dict[str, EngineCase]


def case_of(run: RunSoFar, comparison: Comparison, marks: Marks) -> Case:
    """Return the summary of a run so far, with its comparison and what has stood out in it."""
    first = run.clock.step(comparison.since)
    return Case(
        marks,
        comparison.since,
        tuple(verdict_parts(comparison)),
        {
            name: EngineCase(
                tuple(_contact(comparison, difference, first) for difference in of_engine.differences),
                "" if of_engine.differences else _agrees(comparison, name),
                tuple(_ledger(comparison, of_engine)),
            )
            for name, of_engine in comparison.others.items()
        },
    )


def _contact(comparison: Comparison, difference: Difference, first: int) -> OtherContact:
    """Describe a difference. first: the step of the run at which the comparison begins."""
    scene, time = comparison.scene, difference.time
    step = first + int(scene.clock.steps_containing(time)) if time else first
    speeds = "\n".join(velocities_and_spins(scene, difference))
    return OtherContact(step, comparison.since + time, sentence(scene, difference), speeds, difference)


def _agrees(comparison: Comparison, name: str) -> str:
    """Say that no step of an engine is wrong, and how long its paths are known to agree."""
    run = comparison.runs[name]
    until = f"until {run.apart:.2f} s" if run.apart is not None else until_words(comparison)
    return f"No step of {name} is wrong; every ball is within its radius of {comparison.against}'s {until}."


def _ledger(comparison: Comparison, run: Run) -> Iterator[LedgerLine]:
    """Yield the lines of an engine's ledger; none if nothing moves."""
    scale = run.energy_scale
    for entry in run.figures.ledger if scale else ():
        share = entry.energy / scale
        if (text := share_text(share)) != NOTHING:
            yield LedgerLine(f"{entry.cause.label}{ledger_mark(comparison)}", share, text)
