"""The diagnosis of a Space that a program stepped: its findings and its energy; as text and JSON."""

import textwrap
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Final

from sandbox.space.energy import Ledger
from sandbox.space.findings import Finding
from sandbox.text import counted, printable

MOST: Final = 10.0  # times the largest kinetic energy, in the headline


@dataclass(frozen=True)
class Diagnosis:
    """What a Space did while it was recorded, and what is wrong with it.

    space: its number, from 1; stepped_in: the line of the program that stepped it first; seconds: of its time; bodies,
    shapes, joints: the most at one time; findings: worst first; energy: None if no step left numbers; figures: of the
    rules whose cures can be tried, also where these are no fault; cost: s of the processor, of the Space's own steps.
    """

    space: int
    stepped_in: str
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
        stepped = f", stepped in {printable(self.stepped_in)}" if self.stepped_in else ""
        bodies = f"{self.bodies:,} {'body' if self.bodies == 1 else 'bodies'}"
        things = f"{bodies}, {counted(self.shapes, 'shape')}, {counted(self.joints, 'joint')}"
        return f"Space {self.space}{stepped}: {counted(self.steps, 'step')}, {self.seconds:.4g} s; {things}"

    @property
    def headline(self) -> str:
        """Whether a rule found a fault, and whether energy came or went where none should."""
        suspect = [
            f"{cause} {'beyond ' * (abs(share) > MOST)}{100 * max(-MOST, min(share, MOST)):+,.0f} %"
            for cause, share in (self.energy.suspect if self.energy else {}).items()
        ]
        rule = "" if self.findings or not self.steps else "No rule found a fault. "
        energy = f"Energy came or went where none should: {', '.join(suspect)} of the largest kinetic energy."
        return f"{rule}{energy if suspect else ''}".rstrip()

    def lines(self, width: int) -> Iterator[str]:
        """Yield the text, in so many columns."""
        yield from textwrap.wrap(self.heading, width, subsequent_indent="  ")
        yield ""
        if self.headline:
            yield from textwrap.wrap(self.headline, width)
            yield ""
        for number, finding in enumerate(self.findings, 1):
            yield from finding.lines(width, f"{number}. ")
            yield ""
        if self.energy:
            yield from self.energy.text()
        elif self.seconds > 0:
            yield "Its energy is not a number."

    def as_json(self) -> dict[str, Any]:
        """Return it as a JSON document has it."""
        return {key: value for key, value in vars(self).items() if key != "cost"} | {
            "headline": self.headline,
            "findings": [asdict(finding) for finding in self.findings],
            "energy": self.energy.as_json() if self.energy else None,
        }
