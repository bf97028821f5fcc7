"""The linter: what is wrong with a Space, without a step of it."""

import pymunk

from sandbox.space.contents import Contents, checked
from sandbox.space.findings import Fault, Finding, Rules, findings_of
from sandbox.space.origins import Origins
from sandbox.space.rules import END_RULES, RULES, UNSTEPPED_RULES


def lint(space: pymunk.Space) -> list[Finding]:
    """Return what is wrong with a Space, worst first, without a step of it.

    Raises SandboxError if it is not a Space.
    """
    return findings_of(look(Contents(checked(space), Origins()), [*RULES, *END_RULES, *UNSTEPPED_RULES]))


def look(contents: Contents, rules: Rules[Contents], since: float | None = None) -> list[Fault]:
    """Return the faults of what is new, and mark it as seen. since: s of the Space's time, None before any step."""
    faults = [fault._replace(since=since) for find in rules for fault in find(contents)]
    contents.seen.update([*contents.shapes, *contents.bodies, *contents.space.constraints])
    return faults
