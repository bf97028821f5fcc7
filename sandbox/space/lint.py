"""The linter: what is wrong with a Space, without a step of it."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final
from weakref import WeakSet

import pymunk

from sandbox.space.contents import Contents, StepLengths, checked
from sandbox.space.findings import Fault, Finding, Rules, finding_of, worst_first
from sandbox.space.origins import Origins
from sandbox.space.rules import RULES

MAX_FAULTS: Final = 1_000  # kept of a rule; further ones are not looked at


def lint(space: pymunk.Space, *, dt: float | None = None) -> list[Finding]:
    """Return what is wrong with a Space, worst first, without a step of it.

    dt: s, of the steps that will be done; without, 1/60 s. Raises SandboxError if it is not a Space.

    >>> space = pymunk.Space()
    >>> body = pymunk.Body(1, 10)
    >>> disc = pymunk.Circle(body, 20)
    >>> disc.friction = 0.5
    >>> space.add(body, disc)
    >>> for finding in lint(space):
    ...     print(finding.rule, finding.bodies[0].detail)
    moment moment 10, 20 times too small: its shapes have 200
    """
    linter = Linter(checked(space), Origins(), StepLengths())
    if dt is not None:
        linter.steps.add(dt)
    linter.look(RULES, None)
    return linter.findings()


@dataclass
class Linter:
    """Looks at a Space, and again at what was added since; collects what its rules find."""

    space: pymunk.Space
    origins: Origins
    steps: StepLengths
    _seen: WeakSet[Any] = field(default_factory=WeakSet)
    _faults: dict[str, list[Fault]] = field(default_factory=lambda: defaultdict(list))

    def look(self, rules: Rules[Contents], since: float | None) -> Contents:
        """Look for faults in what is new since the last time. since: s of the Space's time, None before any step."""
        contents = Contents(self.space, self.origins, self.steps, self._seen)
        for rule, find in rules.items():
            for fault in find(contents):
                self.add(rule, fault._replace(since=since))
        self._seen.update(contents.shapes)
        self._seen.update(contents.bodies)
        self._seen.update(contents.space.constraints)
        return contents

    def add(self, rule: str, fault: Fault) -> None:
        """Add a fault of a rule; of the Space itself, only the last counts."""
        faults = self._faults[rule]
        if fault.report is None:
            faults[:] = [fault._replace(since=faults[0].since if faults else fault.since)]
        elif len(faults) < MAX_FAULTS:
            faults.append(fault)

    def findings(self, more: Mapping[str, Sequence[Fault]] = MappingProxyType({})) -> list[Finding]:
        """Return one finding for each rule with faults, worst first. more: faults that were found otherwise."""
        faults = {rule: [*self._faults.get(rule, ()), *more.get(rule, ())] for rule in {**self._faults, **more}}
        return sorted((finding_of(rule, each) for rule, each in faults.items() if each), key=worst_first)
