"""The diagnosis of a Space that a program stepped: its findings, and the comparison with `exact`; as text and JSON."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from sandbox.errors import SandboxError
from sandbox.scripting.exact import AgainstExact
from sandbox.scripting.finer import AgainstFiner
from sandbox.space.energy import Ledger
from sandbox.space.evidence import Evidence
from sandbox.space.findings import Finding, worst_first
from sandbox.space.mechanics import Floats
from sandbox.text import counted, printable

MAX_FINDINGS: Final = 10  # in text
INDENT: Final = "   "  # below a finding's number


@dataclass(frozen=True)
class Diagnosis:
    """What a Space did while it was recorded, and what is wrong with it.

    number: of the Space, from 1; line: of the program, that stepped it first; seconds: of its time; bodies, shapes,
    joints: the most at one time; seen: the findings that need no comparison, worst first; evidence: None without a
    recording. Comparing it may take a minute.
    """

    number: int
    line: str
    steps: int
    seconds: float
    bodies: int
    shapes: int
    joints: int
    seen: tuple[Finding, ...]
    evidence: Evidence | None
    against_exact: AgainstExact

    @property
    def energy(self) -> Ledger | None:
        """The energy ledger of what was recorded."""
        return self.evidence.ledger if self.evidence else None

    @cached_property
    def against_finer(self) -> AgainstFiner | None:
        """The comparison with finer steps, of a Space that `exact` does not run; computed when first asked for."""
        return None if self.evidence is None or self.against_exact.comparison else AgainstFiner.of(self.evidence)

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        """All findings, worst first, also those of the comparison with finer steps if `exact` has no part in it."""
        against = None if self.against_exact.part else self.against_finer
        compared = against.findings(self.seen) if against else []
        return tuple(sorted([*self.seen, *compared], key=worst_first))

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
        """Yield the text, in so many columns; what needs no comparison comes before it."""
        yield from textwrap.wrap(self.heading, width, subsequent_indent="  ")
        yield ""
        first = self.seen or self.findings
        if not first:
            yield f"No faults found in how it is set up{' and in its steps' if self.energy else ''}."
            yield ""
        yield from _numbered(first[:MAX_FINDINGS], 1, width)
        if len(first) > MAX_FINDINGS:
            yield f"and {counted(len(first) - MAX_FINDINGS, 'further finding')}; --json has all of them"
            yield ""
        if self.energy:
            yield from self.energy.text()
            yield ""
        for paragraph in self.against_exact.paragraphs():
            yield from textwrap.wrap(printable(paragraph), width) or [""]
        for paragraph in self.against_finer.paragraphs() if self.against_finer else ():
            yield ""
            yield from textwrap.wrap(printable(paragraph), width)
        if rest := [finding for finding in self.findings if finding not in first]:
            yield ""
            yield from _numbered(rest, len(first) + 1, width)

    def exceeded(self, max_gap: float | None, max_drift: float | None, max_energy_error: float | None) -> Iterator[str]:
        """Yield which limits are exceeded, by how much and since when. Raises SandboxError if one cannot be checked."""
        comparison, why_not = self.against_exact.comparison, self.against_exact.why_not
        if comparison:
            yield from (message for _, message in comparison.exceeded(max_gap, max_drift, max_energy_error))
            return
        if max_energy_error is not None:
            raise SandboxError(f"Space {self.number}: the energy error needs a comparison with exact: {why_not}")
        if max_gap is not None:
            finer = self.against_finer
            if finer is None or finer.finer is None:
                why_not += f"; with finer steps: {finer.why_not}" if finer else ""
                raise SandboxError(f"Space {self.number}: no gap can be checked: {why_not}")
            yield from _over(max_gap, "gap", " px", finer.finer.largest_so_far)
        if max_drift is not None:
            if self.energy is None:
                raise SandboxError(f"Space {self.number}: no drift can be checked: {why_not}")
            yield from _over(max_drift, "drift", "", self.energy.drift_so_far)

    def as_json(self) -> dict[str, Any]:
        """Return it as a JSON document has it."""
        against, comparison = self.against_exact, self.against_exact.comparison
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
            "comparison": comparison.as_json() if comparison else None,
            "not_compared_because": against.why_not or None,
            "notes": against.sentences,
            "finer": self.against_finer.as_json() if self.against_finer else None,
            "no_finer_because": (self.against_finer.why_not or None) if self.against_finer else None,
        }


def _over(limit: float, what: str, unit: str, values: tuple[Floats, Floats]) -> Iterator[str]:
    """Yield that values exceed a limit, if they do. values: times, s, and the largest value until each."""
    times, largest = values
    if len(over := np.flatnonzero(largest > limit)):
        since = f"first at {times[over[0]]:.3f} s"
        yield f"{what} {largest[-1]:.6g}{unit} exceeds the limit of {limit:g}{unit}, {since}"


def _numbered(findings: Sequence[Finding], start: int, width: int) -> Iterator[str]:
    """Yield the lines of findings, each with an empty line after it."""
    for number, finding in enumerate(findings, start):
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
