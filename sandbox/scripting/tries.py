"""Cures that are settings are tried before they are proposed: the program runs again, unchanged, with other steps.

The child processes are `sandbox watch` too, with the options that only this module uses.
"""

import json
import math
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

from sandbox.space.diagnosis import Diagnosis
from sandbox.space.energy import Cause
from sandbox.space.findings import TEXTS, Finding

PARTS: Final = 4  # of a step, or as many as a body needs not to pass a wall
MOST_PARTS: Final = 16
TIMES: Final = 4  # as many iterations
MAX_SECONDS: Final = 120.0  # of a run
ENOUGH: Final = 0.5  # of a figure, to which it must fall
SAME: Final = 0.01  # relative: by more, the program does not repeat itself
CALLBACKS: Final = 1e-6  # of the largest kinetic energy, that handlers changed
PASSED: Final = "passed-through"
Spaces = dict[int, dict[str, Any]]  # what JSON says of the Spaces of a run, by their numbers


class _Setting(NamedTuple):
    key: str  # in rules.toml
    options: tuple[str, ...]
    name: str
    cure: str


def tried(program: Sequence[str], diagnoses: Sequence[Diagnosis], seconds: float) -> list[Diagnosis]:
    """Return the diagnoses with what became of their findings in other runs of the program. seconds: of each."""
    findings = [finding for diagnosis in diagnoses for finding in diagnosis.findings if _tries(diagnosis, finding)]
    if not findings:
        return list(diagnoses)
    parts = max([PARTS, *(math.ceil(finding.size) for finding in findings if finding.rule == PASSED)])
    wanted = {key for finding in findings for key in TEXTS[finding.rule]["tries"]}
    shorter = f"Shorter steps: for _ in range({parts}): space.step(dt / {parts}), and forces before each."
    more = f"space.iterations = {10 * TIMES}."
    settings = (
        _Setting("steps", ("--parts", str(parts)), f"steps in {parts} parts", shorter),
        _Setting("iterations", ("--iterations", str(TIMES)), f"{TIMES} times the iterations", more),
    )
    unchanged = _run(program, seconds, ())
    runs = {each: _run(program, seconds, each.options) for each in settings if unchanged and each.key in wanted}
    return [_with_runs(diagnosis, unchanged, runs) for diagnosis in diagnoses]


def _tries(diagnosis: Diagnosis, finding: Finding) -> bool:
    """Return whether settings that may mend a finding are tried: not if it is certain that these do not."""
    is_long = "dt-large" in {each.rule for each in diagnosis.findings}
    is_too_fast = finding.rule == PASSED and finding.size > MOST_PARTS
    return "tries" in TEXTS[finding.rule] and not is_long and not is_too_fast


def _run(program: Sequence[str], seconds: float, options: Sequence[str]) -> Spaces:
    """Return the Spaces of a run; none if it fails."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "diagnosis.json"
        command = [sys.executable, "-P", "-m", "sandbox", "watch", "--headless", "--no-tries", "--costs"]
        command += ["--json", str(file), "--seconds", str(seconds), *options, *program]
        try:
            subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=MAX_SECONDS, check=False)
            return {space["space"]: space for space in json.loads(file.read_text(encoding="utf-8"))["spaces"]}
        except (OSError, subprocess.TimeoutExpired):
            return {}


def _with_runs(diagnosis: Diagnosis, unchanged: Spaces, runs: dict[_Setting, Spaces]) -> Diagnosis:
    """Return a diagnosis with what each run says about the findings of its Space."""
    again = unchanged.get(diagnosis.space)

    def tried(finding: Finding) -> Finding:
        if not _tries(diagnosis, finding):
            return finding
        if again is None:
            return replace(finding, tried=("nothing, as a second run of the program failed",))
        before, unit = again["figures"][finding.rule], " passages" if finding.rule == PASSED else " px"
        if why := _why_not(diagnosis, diagnosis.figures[finding.rule], before, unit):
            return replace(finding, tried=(why,))
        words, cures = [], []
        for setting, spaces in runs.items():
            if setting.key in TEXTS[finding.rule]["tries"] and (space := spaces.get(diagnosis.space)):
                after = space["figures"][finding.rule]
                change = f"from {before:.3g} to {after:.3g}{unit}"
                if after > ENOUGH * before:
                    words.append(f"{setting.name} do not help: {change}; something else is the cause")
                else:
                    cost = space["cost"] / (again["cost"] or 1.0)
                    words.append(f"with {setting.name}, {change}; steps cost {cost:.1f} times as much")
                    cures.append(setting.cure)
        return replace(finding, cure=" ".join([*cures, finding.cure]), tried=tuple(words))

    return replace(diagnosis, findings=tuple(map(tried, diagnosis.findings)))


def _why_not(diagnosis: Diagnosis, before: float, again: float, unit: str) -> str:
    """Return why runs of the program do not compare; empty if they do."""
    energy = diagnosis.energy
    if energy and energy.scale and abs(energy.lines[Cause.CALLBACKS]) > CALLBACKS * energy.scale:
        return "nothing, as its callbacks change the motion: in shorter steps they are called more often"
    if abs(again - before) > SAME * before:
        figures = f"{before:.3g}{unit}, and {again:.3g}{unit} in a second run"
        return f"nothing, as the program does not repeat itself: {figures}"
    return ""
