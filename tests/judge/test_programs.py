"""The programs of tutorials: the verdict names what is wrong with each, and nothing that is not."""

import re

import pytest
from tutorial_programs import PROGRAMS

import sandbox
from sandbox.analysis.verdict import verdict
from sandbox.judge.causes import Cause
from sandbox.scene.files import parse

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


@pytest.mark.parametrize("name", ["springs", "springs_damped"])
def test_all_that_a_spring_does_is_soft(name: str) -> None:
    """Also the first step of a touch, which does not push yet, and the last, which pushes two that part."""
    program = PROGRAMS[name]
    run = sandbox.compare(program.scene, [program.spec, "exact"]).runs[program.spec]
    assert run.figures.first_difference is not None
    assert run.figures.first_difference.cause == Cause.SOFT
    assert [one.cause for one in run.suffered] == [Cause.SOFT]


def test_walls_without_elasticity_are_named_by_one_contact_whatever_the_balls_have() -> None:
    """Three contacts with walls, of balls of two elasticities; the fourth is that of the two balls, only late."""
    program = PROGRAMS["walls_without_elasticity"]
    text = program.scene_text.replace("velocity = [230, 40]", "velocity = [230, 40]\nelasticity = 0.9")
    run = sandbox.compare(parse(text, "scene.toml"), [program.spec, "exact"]).runs[program.spec]
    assert [(one.cause, one.times) for one in run.suffered] == [(Cause.LARGE, 3), (Cause.LATE, 1)]
    assert run.suffered[0].because.startswith("The restitution is 1, whatever the scene's elasticity.")


def test_what_is_said_of_many_contacts_has_the_depths_of_all() -> None:
    program = PROGRAMS["walls_that_clamp"]
    [clamped] = sandbox.compare(program.scene, [program.spec, "exact"]).runs[program.spec].suffered
    assert clamped.times > 1
    low, high, median = map(float, re.findall(r"\d+\.?\d*", clamped.because))
    assert 0 < low < median < high < max(230, 170) / 60
    assert clamped.because.endswith(" and balls put back, which discards some of their way.")


@pytest.mark.parametrize("name", ["move_undone", "move_undone_on_an_axis"])
def test_a_move_that_is_undone_is_told_from_a_place_on_the_wall(name: str) -> None:
    program = PROGRAMS[name]
    run = sandbox.compare(program.scene, [program.spec, "exact"]).runs[program.spec]
    first = run.figures.first_difference
    assert first is not None
    assert first.because.endswith("deep, and put back to where the step began.")
