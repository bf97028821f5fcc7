"""The diagnosis of a Space that a program stepped: its findings, and the comparison with `exact`; as text and JSON."""

import math
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

from sandbox.scripting.comparison import Comparison
from sandbox.space.findings import Finding
from sandbox.text import counted, printable

MAX_FINDINGS: Final = 10  # in text
INDENT: Final = "   "  # below a finding's number


class AgainstExact(NamedTuple):
    """A comparison with `exact`, or why there is none; and notes on what it covers."""

    comparison: Comparison | None
    why_not: str = ""
    notes: Sequence[str] = ()

    def lines(self, width: int) -> Iterator[str]:
        """Yield the text, in so many columns."""
        if self.comparison:
            yield "Compared with exact, the engine of this sandbox without time steps:"
            for paragraph in [*self.comparison.verdict.split("\n"), *self.notes]:
                yield from textwrap.wrap(printable(paragraph), width) or [""]
        else:
            yield from textwrap.wrap(f"Not compared with exact: {printable(self.why_not)}.", width)


@dataclass(frozen=True)
class Diagnosis:
    """What a Space did while it was recorded, and what is wrong with it.

    number: of the Space, from 1; line: of the program, that stepped it first; seconds: of its time; bodies, shapes,
    joints: the most at one time; compare: compares it with `exact`, which may take a minute.
    """

    number: int
    line: str
    steps: int
    seconds: float
    bodies: int
    shapes: int
    joints: int
    findings: tuple[Finding, ...]
    compare: Callable[[], AgainstExact]

    @cached_property
    def against_exact(self) -> AgainstExact:
        """The comparison with `exact`, computed when it is first asked for."""
        return self.compare()

    def lines(self, width: int) -> Iterator[str]:
        """Yield the text, in so many columns; the findings come before anything is compared."""
        stepped = f", stepped in {printable(self.line)}" if self.line else ""
        counts = [
            f"{self.bodies:,} {'body' if self.bodies == 1 else 'bodies'}",
            counted(self.shapes, "shape"),
            counted(self.joints, "joint"),
        ]
        head = f"Space {self.number}{stepped}: {counted(self.steps, 'step')}, {self.seconds:.4g} s; {', '.join(counts)}"
        yield from textwrap.wrap(head, width, subsequent_indent="  ")
        yield ""
        if not self.findings:
            yield "No faults found in how it is set up."
            yield ""
        for number, finding in enumerate(self.findings[:MAX_FINDINGS], 1):
            yield from _finding(number, finding, width)
            yield ""
        if len(self.findings) > MAX_FINDINGS:
            yield f"and {counted(len(self.findings) - MAX_FINDINGS, 'further finding')}; --json has all of them"
            yield ""
        yield from self.against_exact.lines(width)

    def as_json(self) -> dict[str, Any]:
        """Return it as a JSON document has it."""
        comparison, why_not, notes = self.against_exact
        return {
            "space": self.number,
            "stepped_in": self.line,
            "steps": self.steps,
            "seconds": self.seconds,
            "bodies": self.bodies,
            "shapes": self.shapes,
            "joints": self.joints,
            "findings": [_as_json(finding) for finding in self.findings],
            "comparison": comparison.as_json() if comparison else None,
            "not_compared_because": why_not or None,
            "notes": list(notes),
        }


def _finding(number: int, finding: Finding, width: int) -> Iterator[str]:
    """Yield the lines of a finding under its number, wrapped."""
    symptom, *rest = finding.lines()
    yield from textwrap.wrap(f"{number}. {symptom}", width, subsequent_indent=INDENT)
    for line in rest:
        indent = INDENT + " " * (len(line) - len(line.lstrip()) - 2)
        yield from textwrap.wrap(line.strip(), width, initial_indent=indent, subsequent_indent=f"{indent}  ")


def _as_json(finding: Finding) -> dict[str, Any]:
    document = asdict(finding)
    document["certainty"] = str(finding.certainty)
    for body in document["bodies"]:
        body["position"] = [x if math.isfinite(x) else None for x in body["position"]]
    return document
