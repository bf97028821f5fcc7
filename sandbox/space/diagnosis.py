"""The diagnosis of a Space that a program stepped: its findings and its energy; as text and JSON."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from sandbox.space.energy import Ledger
from sandbox.space.evidence import Evidence
from sandbox.space.findings import Finding
from sandbox.text import counted, printable

MAX_FINDINGS: Final = 10  # in text
INDENT: Final = "   "  # below a finding's number


@dataclass(frozen=True)
class Diagnosis:
    """What a Space did while it was recorded, and what is wrong with it.

    number: of the Space, from 1; line: of the program, that stepped it first; seconds: of its time; bodies, shapes,
    joints: the most at one time; findings: worst first; evidence: None without a recording.
    """

    number: int
    line: str
    steps: int
    seconds: float
    bodies: int
    shapes: int
    joints: int
    findings: tuple[Finding, ...]
    evidence: Evidence | None

    @property
    def energy(self) -> Ledger | None:
        """The energy ledger of what was recorded."""
        return self.evidence.ledger if self.evidence else None

    @property
    def heading(self) -> str:
        """Which Space it is, and what was recorded, in a line."""
        stepped = f", stepped in {printable(self.line)}" if self.line else ""
        counts = [
            f"{self.bodies:,} {'body' if self.bodies == 1 else 'bodies'}",
            counted(self.shapes, "shape"),
            counted(self.joints, "joint"),
        ]
        return f"Space {self.number}{stepped}: {counted(self.steps, 'step')}, {self.seconds:.4g} s; {', '.join(counts)}"

    def lines(self, width: int) -> Iterator[str]:
        """Yield the text, in so many columns."""
        yield from textwrap.wrap(self.heading, width, subsequent_indent="  ")
        yield ""
        if not self.findings:
            yield f"No faults found in how it is set up{' and in its steps' if self.energy else ''}."
            yield ""
        yield from _numbered(self.findings[:MAX_FINDINGS], width)
        if len(self.findings) > MAX_FINDINGS:
            yield f"and {counted(len(self.findings) - MAX_FINDINGS, 'further finding')}; --json has all of them"
            yield ""
        if self.energy:
            yield from self.energy.text()

    def as_json(self) -> dict[str, Any]:
        """Return it as a JSON document has it."""
        return {
            "space": self.number,
            "stepped_in": self.line,
            "steps": self.steps,
            "seconds": self.seconds,
            "bodies": self.bodies,
            "shapes": self.shapes,
            "joints": self.joints,
            "findings": [_as_json(finding) for finding in self.findings],
            "energy": self.energy.as_json() if self.energy else None,
        }


def _numbered(findings: Sequence[Finding], width: int) -> Iterator[str]:
    """Yield the lines of findings, each with an empty line after it."""
    for number, finding in enumerate(findings, 1):
        yield from _finding(number, finding, width)
        yield ""


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
