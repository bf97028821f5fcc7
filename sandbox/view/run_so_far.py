"""A run as far as it has come: the comparison goes on with it, and what stands out is marked."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

from sandbox.analysis.comparison import Comparison, RunningComparison
from sandbox.analysis.reference import Trust
from sandbox.engines import named
from sandbox.run.edits import Edit
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
        engines = tuple(dict.fromkeys([*session.names, session.reference]))  # the reference too if it is hidden
        return cls(session.start, engines, session.reference, inputs, session.end)

    def is_beginning_of(self, later: "RunSoFar") -> bool:
        """Return whether a run began like this, and has come as far."""
        return self.steps <= later.steps and self._before(self.steps) == later._before(self.steps)

    def _before(self, step: int) -> tuple[object, ...]:
        """Return what the states at a step show."""
        return self.scene, self.engines, self.against, [given for given in self.inputs if given.step < step]

    @cached_property
    def clock(self) -> Clock:
        """The times of its steps."""
        return clock_of(self.scene.clock, self.inputs)


@dataclass(frozen=True)
class Marks:
    """Times in a run that stand out, s, from its start.

    trust: until when the reference means anything; differences: for each engine that has one, its first from the
    reference; stopped: when the reference could go on no longer, and its message.
    """

    trust: Trust = field(default_factory=Trust)
    differences: Mapping[str, float] = field(default_factory=dict)
    stopped: tuple[float, str] | None = None

    def followed_by(self, comparison: Comparison) -> Self:
        """Return the marks with those of a comparison from the last edit on. What stood out before the edit stays."""
        since = comparison.since
        firsts = {name: run.figures.first_difference for name, run in comparison.runs.items()}
        differences = {name: since + first.time for name, first in firsts.items() if first}
        trust = self.trust.followed_by(comparison.trust, since)
        return replace(self, trust=trust, differences=differences | dict(self.differences))


class ComparisonSoFar:
    """The comparison of a run that goes on, of which only the steps that are new are run.

    marks: what has stood out in the run.
    """

    def __init__(self) -> None:
        self.marks = Marks()
        self._run: RunSoFar | None = None
        self._comparison: RunningComparison | None = None
        self._before_edit = Marks()

    def of(self, run: RunSoFar) -> Comparison:
        """Return the comparison of a run, and mark what stands out. Raises SandboxError as `compare` does."""
        comparison = self._of_this_run(run)
        for edit_at in sorted({given.step for given in run.inputs if isinstance(given, Edit)}):
            if 0 < edit_at < run.steps and comparison.steps <= edit_at:
                comparison.advance(edit_at)
                self._before_edit = self._before_edit.followed_by(comparison.result())
        comparison.advance(run.steps)
        result = comparison.result()
        self._run, self.marks = run, self._before_edit.followed_by(result)
        return result

    def _of_this_run(self, run: RunSoFar) -> RunningComparison:
        """Return the comparison that has been made so far if it is of this run, or else one that is at the start."""
        if self._comparison and self._run and self._run.is_beginning_of(run):
            self._comparison.replace_inputs(run.inputs)
        else:
            self._before_edit = Marks()
            steps = run.clock.step(run.scene.seconds)
            self._comparison = RunningComparison(
                run.scene, named(run.engines), run.against, run.inputs, steps, suspends=True
            )
        self._run = None  # until it is compared
        return self._comparison
