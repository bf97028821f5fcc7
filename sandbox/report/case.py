"""The run so far, compared: what the window says of each engine while it goes on, in the words of `compare`."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Self

from sandbox.analysis.comparison import Comparison, compare
from sandbox.analysis.difference import Difference
from sandbox.analysis.measurement import Run
from sandbox.analysis.verdict import ledger_mark, until_words, verdict_parts
from sandbox.report.tables import NOTHING, sentence, share_text, velocities_and_spins
from sandbox.run.inputs import Input, clock_of
from sandbox.scene.clock import Clock
from sandbox.scene.model import Scene
from sandbox.session.session import Session


@dataclass(frozen=True)
class RunSoFar:
    """Engines that run a scene with some inputs, up to a step. against: the one that the others are compared with."""

    scene: Scene
    engines: tuple[str, ...]
    against: str
    inputs: tuple[Input, ...]
    steps: int

    @classmethod
    def of(cls, session: Session) -> Self:
        """Return the run of a session up to the latest step that it has reached."""
        inputs = tuple(given for given in session.inputs if given.step <= session.end)
        return cls(session.start, _engines_of(session), session.reference, inputs, session.end)

    def is_part_of(self, session: Session) -> bool:
        """Return whether a session's run began like this, and has come as far."""
        now = session.start, _engines_of(session), session.reference
        same = (self.scene, self.engines, self.against) == now and self.steps <= session.end
        return same and self._done == [given for given in session.inputs if given.step < self.steps]

    @cached_property
    def _done(self) -> list[Input]:
        """The inputs before the last step, which the states show."""
        return [given for given in self.inputs if given.step < self.steps]

    @cached_property
    def clock(self) -> Clock:
        """The times of its steps."""
        return clock_of(self.scene.clock, self.inputs)

    def compare(self) -> Comparison:
        """Run it again, and compare. Raises SandboxError as `compare` does."""
        scene = self.scene.changed(seconds=self.clock.time(self.steps))
        return compare(scene, self.engines, against=self.against, inputs=self.inputs)


def _engines_of(session: Session) -> tuple[str, ...]:
    """Return the names of a session's engines, with that of the reference if it is hidden."""
    return tuple(dict.fromkeys([*session.names, session.reference]))


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

    since: s, the time of the last edit, from which all times in words count; verdict: its parts, each a sentence or
    more; engines: all but the reference, and without those that failed, of which the verdict speaks.
    """

    since: float
    verdict: tuple[str, ...]
    engines: dict[str, EngineCase]


def case_of(run: RunSoFar, comparison: Comparison) -> Case:
    """Return the summary of a run so far. comparison: what its `compare` returns."""
    first = run.clock.step(comparison.since)
    return Case(
        comparison.since,
        tuple(verdict_parts(comparison)),
        {
            name: EngineCase(
                tuple(_contact(comparison, difference, first) for difference in of_engine.differences),
                "" if of_engine.differences else _agrees(comparison, name),
                tuple(_ledger(comparison, of_engine)),
            )
            for name, of_engine in comparison.runs.items()
            if name != comparison.against
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
