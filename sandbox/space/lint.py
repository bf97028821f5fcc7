"""The linter: what is wrong with a Space, without a step of it."""

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any, Final
from weakref import WeakSet

import pymunk

from sandbox.errors import SandboxError
from sandbox.space.contents import Contents, Origins, StepLengths
from sandbox.space.findings import Fault, Finding, Rules, finding_of, worst_first
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
    if not isinstance(space, pymunk.Space):
        raise SandboxError(f"space must be a pymunk.Space, got {type(space).__name__}")
    steps = StepLengths()
    if dt is not None:
        steps.add(dt)
    linter = Linter(space, Origins(), steps)
    linter.look(None)
    return linter.findings()


@dataclass
class Linter:
    """Looks at a Space, and again at what was added since; collects what its rules find."""

    space: pymunk.Space
    origins: Origins
    steps: StepLengths
    rules: Rules[Contents] = field(default_factory=lambda: RULES)
    _seen: WeakSet[Any] = field(default_factory=WeakSet)
    _faults: dict[str, list[Fault]] = field(default_factory=lambda: defaultdict(list))
    _since: dict[str, float | None] = field(default_factory=dict)

    def look(self, since: float | None) -> Contents:
        """Look for faults in what is new since the last time. since: s of the Space's time, None before any step."""
        contents = Contents(self.space, self.origins, self.steps, self._seen)
        for rule, find in self.rules.items():
            for fault in find(contents):
                self.add(rule, fault, since)
        self._seen.update(contents.shapes)
        self._seen.update(contents.bodies)
        self._seen.update(contents.space.constraints)
        return contents

    def add(self, rule: str, fault: Fault, since: float | None) -> None:
        """Add a fault of a rule; of the Space itself, only the last counts."""
        faults = self._faults[rule]
        self._since.setdefault(rule, since)
        if fault.report is None:
            faults[:] = [fault]
        elif len(faults) < MAX_FAULTS:
            faults.append(fault)

    def findings(self) -> list[Finding]:
        """Return one finding for each rule with faults, worst first."""
        found = (finding_of(rule, self._faults[rule], self._since[rule]) for rule in RULES if rule in self._faults)
        return sorted(found, key=worst_first)
