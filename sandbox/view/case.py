"""The run so far, compared: what the window says of each engine while it goes on, in the words of `compare`."""

from collections.abc import Iterator
from dataclasses import dataclass

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.difference import Difference
from sandbox.analysis.figures import Run
from sandbox.analysis.verdict import is_heap, summaries
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

    lines: what `compare` says of it first; contacts: those that differ from the reference's, in order; ledger: its
    lines, except small ones.
    """

    lines: tuple[str, ...]
    contacts: tuple[OtherContact, ...]
    ledger: tuple[LedgerLine, ...]


@dataclass(frozen=True)
class Case:
    """Summary of a run so far.

    marks: what has stood out in it; since: s, the time of the last edit, from which all times in words count; besides:
    lines on the reference and on engines that failed; engines: all others.
    """

    marks: Marks
    since: float
    besides: tuple[str, ...]
    engines: dict[str, EngineCase]


def case_of(run: RunSoFar, comparison: Comparison, marks: Marks) -> Case:
    """Return the summary of a run so far, with its comparison and what has stood out in it."""
    first, lines = run.clock.step(comparison.since), dict(summaries(comparison))
    return Case(
        marks,
        comparison.since,
        tuple(f"{name}: {line}" for name in lines if name not in comparison.others for line in lines[name]),
        {
            name: EngineCase(
                lines.get(name, ()),
                tuple(_contact(comparison, difference, first) for difference in of_engine.differences),
                () if is_heap(comparison) else tuple(_ledger(of_engine)),
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


def _ledger(run: Run) -> Iterator[LedgerLine]:
    """Yield the lines of an engine's ledger; none if nothing moves."""
    scale = run.energy_scale
    for entry in run.figures.ledger if scale else ():
        share = entry.energy / scale
        if (text := share_text(share)) != NOTHING:
            yield LedgerLine(entry.cause.label, share, text)
