"""Summary of a run, as far as a process beside the window has compared it, in the words of `compare`."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.connection import Connection
from time import monotonic
from typing import Any, Final, NamedTuple

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.difference import Difference
from sandbox.analysis.figures import Run
from sandbox.analysis.verdict import is_heap, summaries
from sandbox.errors import SandboxError
from sandbox.processes import ChildProcess, serve
from sandbox.report.tables import NOTHING, sentence, share_text, velocities_and_spins
from sandbox.session.session import Session
from sandbox.view.run_so_far import ComparisonSoFar, Marks, RunSoFar

DIED = "the process that compares has died"
MAX_REST: Final = 2.0  # s; until then, the worker is busy for half of the time at most
FIRST_STEPS: Final = 60  # of a run that it compares at once; then twice as many each time


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


class LedgerLine(NamedTuple):
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
    scene, since, lines = comparison.scene, comparison.since, summaries(comparison)
    first = run.clock.step(since)

    def contact(difference: Difference) -> OtherContact:
        step = first + int(scene.clock.steps_containing(difference.time)) if difference.time else first
        speeds = "\n".join(velocities_and_spins(scene, difference))
        return OtherContact(step, since + difference.time, sentence(scene, difference), speeds, difference)

    engines = {
        name: EngineCase(
            lines.get(name, ()),
            tuple(map(contact, of_engine.differences)),
            () if is_heap(comparison) else tuple(_ledger(of_engine)),
        )
        for name, of_engine in comparison.others.items()
    }
    besides = (f"{name}: {line}" for name in lines if name not in engines for line in lines[name])
    return Case(marks, since, tuple(besides), engines)


def _ledger(run: Run) -> Iterator[LedgerLine]:
    """Yield the lines of an engine's ledger; none if nothing moves."""
    scale = run.energy_scale
    for entry in run.figures.ledger if scale else ():
        share = entry.energy / scale
        if (text := share_text(share)) != NOTHING:
            yield LedgerLine(entry.cause.label, share, text)


class CaseWorker:
    """Does one task after another in a process of its own, which begins with the first task.

    A task's result is what it returns, or the SandboxError that it raises.
    """

    def __init__(self) -> None:
        self._process: ChildProcess | None = None

    def ask(self, run: RunSoFar) -> None:
        """Begin to compare a run so far. It must have done with the one before."""
        if self._process is None:
            self._process = ChildProcess(_serve)
        self._process.send(run)

    def poll(self) -> Case | SandboxError | None:
        """Return what has become of the task, once it is done."""
        if self._process is None or not self._process.connection.poll():
            return None
        try:
            answer: Case | SandboxError = self._process.receive()
        except EOFError:  # a bug, of which it has printed the traceback, or too little memory
            self._process = None
            return SandboxError(DIED)
        return answer

    def stop(self) -> None:
        """End the process, and what it does."""
        process, self._process = self._process, None
        if process is not None:
            process.stop()


def _serve(connection: "Connection[Any, Any]") -> None:
    serve(connection, partial(answer, ComparisonSoFar()))


def answer(so_far: ComparisonSoFar, run: RunSoFar) -> Case | SandboxError:
    """Return the summary of a run."""
    try:
        return case_of(run, so_far.of(run), so_far.marks)
    except SandboxError as error:
        return SandboxError(str(error))  # others, such as EngineError, cannot be pickled


class CaseSoFar:
    """What a worker finds out about the run of a session, part by part, while the run goes on.

    case: the latest, None until there is one; compared: the run that it is about; is_current: whether that is all of
    the run. error: why there is no newer one.
    """

    def __init__(self, worker: CaseWorker | None = None) -> None:
        self._worker = worker or CaseWorker()
        self._asked: RunSoFar | None = None  # what the worker compares
        self._asked_at = self._rests_until = 0.0  # s
        self.forget()

    def forget(self) -> None:
        """Forget what was found."""
        self.case: Case | None = None
        self.compared: RunSoFar | None = None
        self.error = ""
        self.is_current = False

    def of(self, session: Session) -> Case | None:
        """Return the latest case, unless it is about too short a part of a session's run, or about another run.

        An event can replace the run.
        """
        compared = self.compared
        if not compared or (compared.steps < FIRST_STEPS and not self.is_current):
            return None
        return self.case if compared.is_beginning_of(RunSoFar.of(session)) else None

    def update(self, session: Session) -> bool:
        """Note what the worker has found, and let it go on. Return whether that is news."""
        before, now = (self.case, self.error), RunSoFar.of(session)
        if self._asked and (answer := self._worker.poll()):
            self._note(self._asked, answer)
        if self.compared and not self.compared.is_beginning_of(now):
            self.forget()
        if self._asked and not self._asked.is_beginning_of(now):
            self.stop()
        if self._asked is None and now.steps:
            self._ask(now)
        self.is_current = self.compared == now
        return before != (self.case, self.error)

    def _note(self, run: RunSoFar, answer: Case | SandboxError) -> None:
        now = monotonic()
        self._rests_until = now + min(now - self._asked_at, MAX_REST)
        self._asked = None
        self.compared = run
        if isinstance(answer, SandboxError):
            self.error = str(answer)
        else:
            self.case, self.error = answer, ""

    def _ask(self, run: RunSoFar) -> None:
        """Let the worker compare more of a run, unless it has compared all of it."""
        most = max(FIRST_STEPS, 2 * self.compared.steps if self.compared else 0)
        if run != self.compared and (run.steps > most or monotonic() >= self._rests_until):
            self._asked, self._asked_at = replace(run, steps=min(run.steps, most)), monotonic()
            self._worker.ask(self._asked)

    def stop(self) -> None:
        """End what the worker does."""
        self._worker.stop()
        self._asked = None
