"""Findings: what is wrong with a Space, since when, with which bodies, why, and what to change."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from sandbox.text import printable

MAX_BODIES_SHOWN: Final = 3  # of a finding, in text


class Certainty(StrEnum):
    """How sure a finding is."""

    CERTAIN = "certain"  # a fact of the Space, which is wrong in every program
    LIKELY = "likely"  # rarely meant
    POSSIBLE = "possible"  # often meant: for you to decide


@dataclass(frozen=True)
class BodyReport:
    """A body, or two that belong together, and what is wrong with it.

    index: in `Space.bodies` when it was found, None for the Space's own static body; kind: of body and shape; position:
    px; line: of the program, that added it, empty if unknown; detail: the fault in figures.
    """

    index: int | None
    kind: str
    position: tuple[float, float]
    line: str
    detail: str

    def __str__(self) -> str:
        x, y = self.position
        name = "" if self.index is None else f"body {self.index}, "
        added = f", added in {printable(self.line)}" if self.line else ""
        return f"{name}{self.kind} at ({x:.4g}, {y:.4g}){added}: {self.detail}"


@dataclass(frozen=True)
class Finding:
    """A symptom, its cause and its cure.

    rule: the key of the rule that found it; since: s of the Space's time, None if it was so before the first step;
    bodies: those concerned, worst first, empty if it is the Space itself; weight: how bad, from 0 to 1, by which
    findings are ordered.
    """

    rule: str
    symptom: str
    since: float | None
    bodies: tuple[BodyReport, ...]
    cause: str
    cure: str
    certainty: Certainty
    weight: float

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def lines(self) -> list[str]:
        """Return the finding as text: the symptom, the first bodies, cause and cure, a line each."""
        since = "" if self.since is None else f", since {self.since:.3f} s"
        lines = [f"{self.symptom} ({self.certainty}{since})"]
        lines += [f"  {body}" for body in self.bodies[:MAX_BODIES_SHOWN]]
        if len(self.bodies) > MAX_BODIES_SHOWN:
            lines.append(f"  and {len(self.bodies) - MAX_BODIES_SHOWN} more")
        return [*lines, f"  Cause: {self.cause}", f"  Cure: {self.cure}"]


def worst_first(finding: Finding) -> tuple[float, float]:
    """Return the key by which findings are sorted: the weight, then the time."""
    return -finding.weight, -1.0 if finding.since is None else finding.since
