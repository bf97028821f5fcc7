"""The programs of tutorials: the verdict names what is wrong with each, and nothing that is not."""

import re

import pytest
from tutorial_programs import PROGRAMS

import sandbox
from sandbox.analysis.verdict import verdict
from sandbox.judge.causes import Cause

UNSAID = ("only_one_changed", "one_radius", "walls_at_centres")  # said in words, or contact by contact
SHOWN = 0.02  # of a program's error; less is not said


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_verdict_on_a_program(name: str) -> None:
    program = PROGRAMS[name]
    comparison = sandbox.compare(program.scene, [program.spec, "exact"])
    run = comparison.runs[program.spec]
    first = run.figures.first_difference
    named = {one.cause.key for one in run.suffered if one.share > SHOWN} | ({first.cause.key} if first else set())
    assert named <= program.true | {Cause.UNKNOWN.key}, program.wrong
    if program.says:
        assert named & program.says, verdict(comparison)
        worst = next(one for one in run.suffered if one.cause != Cause.UNKNOWN)
        assert worst.because[1:].rstrip(".") in verdict(comparison)
    numbers = [float(number) for number in re.findall(r"-?\d+\.?\d*", " ".join(one.because for one in run.suffered))]
    assert program.has_figure(numbers) or name in UNSAID, numbers
