"""The diagnosis of a Space that a program stepped: its findings and its energy; as text and JSON."""

import math
import textwrap
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Final

from sandbox.space.energy import Ledger
from sandbox.space.findings import Finding, Kind
from sandbox.text import counted, listed, printable

MAX_FINDINGS: Final = 10  # in text
INDENT: Final = "   "  # below a finding's number


@dataclass(frozen=True)
class Diagnosis:
    """What a Space did while it was recorded, and what is wrong with it.

    number: of the Space, from 1; line: of the program, that stepped it first; seconds: of its time; bodies, shapes,
    joints: the most at one time; findings: worst first; energy: None if no step was recorded; figures: of the rules
    whose cures can be tried, also where these are no fault; cost: s of the processor, of the Space's own steps.
    """

    number: int
    line: str
    steps: int
    seconds: float
    bodies: int
    shapes: int
    joints: int
    findings: tuple[Finding, ...]
    energy: Ledger | None
    figures: dict[str, float]
    cost: float

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

    @property
    def headline(self) -> str:
        """Whether the steps changed the energy by more than the program explains, and whether a rule found a fault."""
        shares = self.energy.suspect if self.energy else {}
        suspect = [f"{words} {100 * share:+.0f} %" for words, share in shares.items()]
        changed = f"the steps changed the energy by more than the program did: {listed(suspect)}" if suspect else ""
        if any(finding.kind is not Kind.POSSIBLE for finding in self.findings):
            return f"{changed[:1].upper()}{changed[1:]}." if changed else ""
        if changed:
            return f"No rule found a fault, but {changed}."
        return f"No faults found in how it is set up{' and in its steps' if self.energy else ''}."

    def lines(self, width: int) -> Iterator[str]:
        """Yield the text, in so many columns."""
        shown = [finding for finding in self.findings if finding.kind is not Kind.POSSIBLE]
        yield from textwrap.wrap(self.heading, width, subsequent_indent="  ")
        yield ""
        if self.headline:
            yield from textwrap.wrap(self.headline, width)
            yield ""
        for number, finding in enumerate(shown[:MAX_FINDINGS], 1):
            yield from _finding(number, finding, width)
            yield ""
        if len(shown) > MAX_FINDINGS:
            yield f"and {counted(len(shown) - MAX_FINDINGS, 'further finding')}; --json has all of them"
            yield ""
        possible = [f"{finding.symptom} ({len(finding.bodies)})" for finding in self.findings if finding not in shown]
        if possible:
            yield from textwrap.wrap(f"Could go wrong, but did not: {'; '.join(possible)}.", width)
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
            "headline": self.headline,
            "findings": [_as_json(finding) for finding in self.findings],
            "figures": self.figures,
            "energy": self.energy.as_json() if self.energy else None,
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
    document["size"] = finding.size if math.isfinite(finding.size) else None
    for body in document["bodies"]:
        body["position"] = [x if math.isfinite(x) else None for x in body["position"]]
    return document
