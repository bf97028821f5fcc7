"""Findings: what is wrong with a Space, since when, with which bodies, why, and what to change."""

import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from textwrap import wrap
from typing import Any, Final, NamedTuple, TypeVar

from sandbox.report.output import DEFAULT_WIDTH
from sandbox.text import printable

MAX_BODIES_SHOWN: Final = 3  # of a finding, in text
INDENT: Final = "   "  # below a finding's number
_FOLDER: Final = files("sandbox.space")
_RULES, CHANGES = (tomllib.loads(_FOLDER.joinpath(f"{name}.toml").read_text("utf-8")) for name in ("rules", "changes"))
TEXTS: Final[Mapping[str, Any]] = {
    rule: {"certainty": "possible" if section == "unusual" else "certain", "cause": "", **texts}
    for section, rules in _RULES.items()
    for rule, texts in rules.items()
}


class Certainty(StrEnum):
    """How sure a finding is."""

    CERTAIN = "certain"  # a fact of the Space, which is wrong in every program
    LIKELY = "likely"  # rarely meant
    POSSIBLE = "possible"  # may well be meant


@dataclass(frozen=True)
class BodyReport:
    """A body, or two that belong together, and what is wrong with it.

    index: in `Space.bodies` when it was found, None if it was not there, as the Space's own static body; kind: of body
    and shape; position: px; line: of the program, that added it, empty if unknown; detail: the fault in figures.
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
    bodies: those concerned, worst first, none if it is the Space itself; cause: empty if the symptom has it; size: of
    the worst case, in the rule's unit, in bodies' sizes if a person sees it; tried: what became of it in other runs.
    """

    rule: str
    symptom: str
    since: float | None
    bodies: tuple[BodyReport, ...]
    cause: str
    cure: str
    certainty: Certainty
    size: float
    tried: tuple[str, ...] = ()

    def __str__(self) -> str:
        return "\n".join(self.lines(DEFAULT_WIDTH))

    def lines(self, width: int, number: str = "") -> Iterator[str]:
        """Yield the finding as text, in so many columns: the symptom, the first bodies, cause and cure."""
        since = "" if self.since is None else f", since {self.since:.3f} s"
        yield from wrap(f"{number}{self.symptom} ({self.certainty}{since})", width, subsequent_indent=INDENT)
        lines = [*map(str, self.bodies[:MAX_BODIES_SHOWN])]
        if len(self.bodies) > MAX_BODIES_SHOWN:
            lines.append(f"and {len(self.bodies) - MAX_BODIES_SHOWN} more")
        cause = [f"Cause: {self.cause}"] if self.cause else []
        for line in (*lines, *cause, f"Cure: {self.cure}", *(f"Tried: {each}" for each in self.tried)):
            yield from wrap(line, width, initial_indent=INDENT, subsequent_indent=f"{INDENT}  ")


class Fault(NamedTuple):
    """One case of a fault.

    rule: its key in rules.toml; report: the body, None if it is the Space itself; size: to show the worst first, as in
    a finding; figure: for `{}` of the symptom; since: s of the Space's time, None if it was so before any step.
    """

    rule: str
    report: BodyReport | None
    size: float = 1.0
    figure: str = ""
    since: float | None = None


Source = TypeVar("Source")  # what rules read
Rules = Sequence[Callable[[Source], Iterator[Fault]]]


def findings_of(faults: Iterable[Fault]) -> list[Finding]:
    """Return one finding for each rule with faults, in the order of rules.toml; what a person sees by size."""
    faults_of: dict[str, list[Fault]] = defaultdict(list)
    for fault in faults:
        faults_of[fault.rule].append(fault)
    findings = []
    for section, rules in _RULES.items():
        found = [_finding_of(rule, faults_of[rule]) for rule in rules if rule in faults_of]
        findings += sorted(found, key=lambda finding: -finding.size) if section == "seen" else found
    return findings


def _finding_of(rule: str, faults: Sequence[Fault]) -> Finding:
    since = None if any(fault.since is None for fault in faults) else min(fault.since or 0.0 for fault in faults)
    faults = sorted(faults, key=lambda fault: -fault.size)
    bodies = tuple(dict.fromkeys(fault.report for fault in faults if fault.report))
    texts, worst = TEXTS[rule], faults[0]
    symptom, certainty = texts["symptom"].format(worst.figure), Certainty(texts["certainty"])
    return Finding(rule, symptom, since, bodies, texts["cause"], texts["cure"], certainty, worst.size)
