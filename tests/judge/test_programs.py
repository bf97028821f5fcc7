"""The programs of tutorials: the verdict names what is wrong with each, and nothing that is not."""

from typing import Final

import numpy as np
import pytest
from conftest import numbers_in, sample
from tutorial_programs import FOLDER, PROGRAMS
from verdicts import causes_of, on_states, states_of

from sandbox.judge.causes import Cause
from sandbox.judge.summary import Verdict
from sandbox.run.trajectory import simulate

UNSAID: Final = ("only_one_changed", "one_radius", "walls_at_centres")  # said in words, or contact by contact
SHOWN: Final = 0.02  # of a program's error; less is not said


def verdict_on(name: str) -> Verdict:
    program = PROGRAMS[name]
    return on_states(program.scene, states_of(program.scene, program.spec))


def test_each_file_is_in_the_table_and_short() -> None:
    assert set(PROGRAMS) == {file.stem for file in FOLDER.glob("*.py")}
    for program in PROGRAMS.values():
        assert program.source.count("\n") < 40
        assert program.true <= {cause.key for cause in Cause}


@pytest.mark.parametrize("name", sample(PROGRAMS, 3))
def test_the_mistake_shows_in_the_program_s_scene(name: str) -> None:
    """A ball is more than 2 px from where it should be at some time, or never by more than rounding."""
    program = PROGRAMS[name]
    off = np.abs(simulate(program.scene, program.spec).position - simulate(program.scene, "exact").position).max()
    assert off > 2 if program.says else off < 1e-3, f"off by {off:.3g} px"


@pytest.mark.parametrize("name", sample(PROGRAMS, 3))
def test_the_verdict_on_a_program(name: str) -> None:
    program, verdict = PROGRAMS[name], verdict_on(name)
    causes = causes_of(verdict, at_least=SHOWN) | {Cause(cause) for cause in verdict.errors["cause"][:1]}
    named = {cause.key for cause in causes - {Cause.UNKNOWN}}
    assert named <= program.true, program.wrong
    assert named & program.says or not program.says
    numbers = [number for each in verdict.causes for number in numbers_in(each.sentence)]
    assert program.has_figure(numbers) or name in UNSAID, numbers


@pytest.mark.parametrize("name", ["springs", "springs_damped"])
def test_all_that_a_spring_does_is_soft(name: str) -> None:
    """But for a step or two in which a touch ends that fit nothing."""
    verdict = verdict_on(name)
    assert causes_of(verdict) <= {Cause.SOFT, Cause.UNKNOWN}
    assert causes_of(verdict, at_least=0.01) == {Cause.SOFT}


@pytest.mark.parametrize("name", ["move_undone", "move_undone_on_an_axis"])
def test_a_move_that_is_undone_is_told_from_a_place_on_the_wall(name: str) -> None:
    places = set(verdict_on(name).errors["place"].tolist())
    assert places & {"begin", "begin across"}
    assert "on" not in places
