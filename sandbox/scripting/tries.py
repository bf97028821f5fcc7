"""Cures that are settings are tried before they are proposed: the program runs again, unchanged, with other steps.

The child processes are `sandbox watch` too, with the options that only this module uses.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

from sandbox.scripting.program import SAFE_PATH
from sandbox.space.diagnosis import Diagnosis
from sandbox.space.energy import Cause
from sandbox.space.findings import TEXTS, Finding

PARTS: Final = 4  # of a step
TIMES: Final = 4  # as many iterations
MAX_SECONDS: Final = 120.0  # of a run
ENOUGH: Final = 0.5  # of a figure, to which it must fall
SAME: Final = 0.01  # relative: by more, the program does not repeat itself
CALLBACKS: Final = 1e-6  # of the largest kinetic energy, that handlers changed


class _Setting(NamedTuple):
    options: tuple[str, ...]
    name: str
    cure: str


SETTINGS: Final = {
    "steps": _Setting(
        ("--parts", str(PARTS)),
        f"steps in {PARTS} parts",
        f"Shorter steps: for _ in range({PARTS}): space.step(dt / {PARTS}).",
    ),
    "iterations": _Setting(
        ("--iterations", str(TIMES)), f"{TIMES} times the iterations", f"space.iterations = {10 * TIMES}."
    ),
}
UNITS: Final = {"passed-through": " passages"}  # of the other figures: px


def tried(program: Sequence[str], diagnoses: Sequence[Diagnosis], seconds: float) -> list[Diagnosis]:
    """Return the diagnoses with what became of their findings in other runs of the program. seconds: of each."""
    wanted = dict.fromkeys(
        each for diagnosis in diagnoses for finding in diagnosis.findings for each in tries_of(finding)
    )
    if not wanted:
        return list(diagnoses)
    unchanged = _run(program, seconds, ())
    runs = {name: _run(program, seconds, SETTINGS[name].options) for name in wanted if unchanged}
    return [_with_runs(diagnosis, number, unchanged, runs) for number, diagnosis in enumerate(diagnoses)]


def tries_of(finding: Finding) -> list[str]:
    """Return the settings that may mend a finding."""
    return list(TEXTS[finding.rule].get("tries", ()))


def _run(program: Sequence[str], seconds: float, options: Sequence[str]) -> list[dict[str, Any]]:
    """Return the figures and costs of the Spaces of a run; none if it fails."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "diagnosis.json"
        command = [sys.executable, "-m", "sandbox", "watch", "--headless", "--no-tries", "--costs", "--json", str(file)]
        command += ["--seconds", str(seconds), *options, *program]
        try:
            subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env={**os.environ, SAFE_PATH: "1"},
                timeout=MAX_SECONDS,
                check=False,
            )
            spaces: list[dict[str, Any]] = json.loads(file.read_text(encoding="utf-8"))["spaces"]
        except (OSError, subprocess.TimeoutExpired):
            return []
    return spaces


def _with_runs(
    diagnosis: Diagnosis, number: int, unchanged: list[dict[str, Any]], runs: dict[str, list[dict[str, Any]]]
) -> Diagnosis:
    """Return a diagnosis with what each run says about the findings of its Space."""

    def tried(finding: Finding) -> Finding:
        if not (tries := tries_of(finding)):
            return finding
        again = unchanged[number]["figures"][finding.rule] if number < len(unchanged) else None
        if why := _why_not(diagnosis, finding, diagnosis.figures[finding.rule], again):
            return replace(finding, tried=(why,))
        outcomes = [each for name in tries for each in _outcome(name, finding, number, unchanged, runs[name])]
        cures = [cure for _, cure in outcomes if cure]
        return replace(finding, cure=" ".join([*cures, finding.cure]), tried=tuple(words for words, _ in outcomes))

    return replace(diagnosis, findings=tuple(map(tried, diagnosis.findings)))


def _why_not(diagnosis: Diagnosis, finding: Finding, before: float, again: float | None) -> str:
    """Return why runs of the program do not compare; empty if they do."""
    energy = diagnosis.energy
    if energy and energy.scale and abs(energy.lines[Cause.CALLBACKS]) > CALLBACKS * energy.scale:
        return "nothing, as its callbacks change the motion: in shorter steps they are called more often"
    if again is None:
        return "nothing, as a second run of the program failed"
    if abs(again - before) > SAME * before:
        unit = UNITS.get(finding.rule, " px")
        figures = f"{before:.3g}{unit}, and {again:.3g}{unit} in a second run"
        return f"nothing, as the program does not repeat itself: {figures}"
    return ""


def _outcome(
    name: str, finding: Finding, number: int, unchanged: list[dict[str, Any]], run: list[dict[str, Any]]
) -> Iterator[tuple[str, str]]:
    """Yield what a run with another setting says about a finding, and the cure if it is one."""
    if number >= len(run):
        return
    setting, unit = SETTINGS[name], UNITS.get(finding.rule, " px")
    before, after = unchanged[number]["figures"][finding.rule], run[number]["figures"][finding.rule]
    change = f"from {before:.3g} to {after:.3g}{unit}"
    if after > ENOUGH * before:
        yield f"{setting.name} do not help: {change}; something else is the cause", ""
    else:
        cost = run[number]["cost"] / (unchanged[number]["cost"] or 1.0)
        yield f"with {setting.name}, {change}; steps cost {cost:.1f} times as much", setting.cure
