"""The linter: what is wrong with a Space, without a step of it."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakSet

import pymunk

from sandbox.space.contents import Contents, checked
from sandbox.space.findings import TEXTS, Fault, Finding, Rules, findings_of
from sandbox.space.origins import Origins
from sandbox.space.rules import END_RULES, RULES


def lint(space: pymunk.Space) -> list[Finding]:
    """Return what is wrong with a Space, worst first, without a step of it.

    Raises SandboxError if it is not a Space.
    """
    linter = Linter(checked(space), Origins())
    linter.look({**RULES, **END_RULES}, None)
    return linter.findings({})


@dataclass
class Linter:
    """Looks at a Space, and again at what was added since; collects what its rules find."""

    space: pymunk.Space
    origins: Origins
    _seen: WeakSet[Any] = field(default_factory=WeakSet)
    _faults: dict[str, list[Fault]] = field(default_factory=lambda: defaultdict(list))

    def look(self, rules: Rules[Contents], since: float | None) -> None:
        """Look for faults in what is new since the last time. since: s of the Space's time, None before any step."""
        contents = Contents(self.space, self.origins, self._seen)
        for rule, find in rules.items():
            self._faults[rule] += [fault._replace(since=since) for fault in find(contents)]
        self._seen.update([*contents.shapes, *contents.bodies, *contents.space.constraints])

    def findings(self, more: Mapping[str, Sequence[Fault]]) -> list[Finding]:
        """Return one finding for each rule with faults, worst first. more: faults that were found otherwise."""
        return findings_of({rule: [*self._faults[rule], *more.get(rule, ())] for rule in TEXTS})
