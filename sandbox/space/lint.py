"""The linter: what is wrong with a Space, without a step of it."""

from dataclasses import dataclass, field
from typing import Any
from weakref import WeakSet

import pymunk

from sandbox.space.contents import Contents, checked
from sandbox.space.findings import Fault, Finding, Rules, findings_of
from sandbox.space.origins import Origins
from sandbox.space.rules import END_RULES, RULES, STILL_RULES


def lint(space: pymunk.Space) -> list[Finding]:
    """Return what is wrong with a Space, worst first, without a step of it.

    Raises SandboxError if it is not a Space.
    """
    linter = Linter(checked(space), Origins())
    linter.look([*RULES, *END_RULES, *STILL_RULES], None)
    return findings_of(linter.faults)


@dataclass
class Linter:
    """Looks at a Space, and again at what was added since; collects the faults that its rules find."""

    space: pymunk.Space
    origins: Origins
    faults: list[Fault] = field(default_factory=list)
    _seen: WeakSet[Any] = field(default_factory=WeakSet)

    def look(self, rules: Rules[Contents], since: float | None) -> None:
        """Look for faults in what is new since the last time. since: s of the Space's time, None before any step."""
        contents = Contents(self.space, self.origins, self._seen)
        self.faults += [fault._replace(since=since) for find in rules for fault in find(contents)]
        self._seen.update([*contents.shapes, *contents.bodies, *contents.space.constraints])
