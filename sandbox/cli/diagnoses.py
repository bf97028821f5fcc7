"""The end of `watch`: the diagnoses of a program's Spaces, printed and written, and the exit code."""

import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from textwrap import fill
from typing import Final, TextIO

from sandbox.files import STANDARD_OUTPUT, write_text
from sandbox.report.output import console, json_text
from sandbox.scripting.program import End
from sandbox.scripting.tries import tried
from sandbox.space.diagnosis import Diagnosis
from sandbox.space.watch import MAX_SPACES, Trials
from sandbox.text import printable

HEADLESS_SECONDS: Final = 20.0  # of a Space's time, as nobody closes a window
_OPTIONS: Final = ("--headless", "--seconds", "--json", "--try", "--no-tries")


def warn_of_misplaced_options(program: Sequence[str]) -> None:
    """Say that options of `watch` after the program are passed to the program."""
    misplaced = [option for option in program[1:] if option.partition("=")[0] in _OPTIONS]
    if misplaced:
        given = printable(program[0])
        print(f"{misplaced[0]} goes to {given}; options of watch come before the program", file=sys.stderr)


@dataclass(frozen=True)
class Report:
    """Where the diagnoses go, as text or JSON."""

    program: Sequence[str]
    trials: Trials
    json_file: str | None
    tries: bool  # whether cures are tried
    costs: bool  # whether JSON has what steps cost, which differs from run to run
    output: TextIO = field(default_factory=lambda: sys.stdout)  # while the program runs, its own may be another

    def write(self, end: End) -> int:
        """Print or write all diagnoses, then how the program ended; return the exit code."""
        diagnoses = list(self.trials.diagnoses())
        if self.tries and end.how != "exception":
            diagnoses = tried(self.program, diagnoses, self.trials.seconds)
        sys.stdout.flush()
        with redirect_stdout(self.output):
            if self.json_file not in STANDARD_OUTPUT:
                self._print(diagnoses)
            if self.json_file:
                write_text(self.json_file, json_text(self._document(end, diagnoses)))
            sys.stdout.flush()
        if end.details:
            print(end.details, end="", file=sys.stderr)
        if end.hint:
            print(f"\n{fill(printable(end.hint), console(stderr=True).width)}", file=sys.stderr)
        return end.code

    def _print(self, diagnoses: list[Diagnosis]) -> None:
        for diagnosis in diagnoses:
            print("", *diagnosis.lines(console().width), sep="\n")
        if not diagnoses:
            print(f"{printable(self.program[0])} stepped no pymunk.Space: there is nothing to diagnose.")
        if len(diagnoses) == MAX_SPACES:
            print(f"\nOnly the first {MAX_SPACES} Spaces of a program have a diagnosis.")

    def _document(self, end: End, diagnoses: list[Diagnosis]) -> dict[str, object]:
        return {
            "program": self.program[0],
            "arguments": list(self.program[1:]),
            "ended_by": end.how,
            "exit_code": end.code,
            "hint": end.hint or None,
            "spaces": [
                diagnosis.as_json() | ({"cost": diagnosis.cost} if self.costs else {}) for diagnosis in diagnoses
            ],
        }
