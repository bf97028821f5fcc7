"""Each program of `tutorials/` is short, is in the table, and has a mistake that shows."""

import numpy as np
import pytest
from tutorial_programs import FOLDER, PROGRAMS

from sandbox.judge.causes import Cause
from sandbox.run.trajectory import simulate


def test_each_file_is_in_the_table_and_short() -> None:
    assert set(PROGRAMS) == {file.stem for file in FOLDER.glob("*.py")}
    assert len(PROGRAMS) >= 30
    for program in PROGRAMS.values():
        assert program.source.count("\n") < 40
        assert program.wrong.endswith(".")
        assert "\n" not in program.wrong
        assert program.true <= {cause.key for cause in Cause}


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_mistake_shows_in_the_program_s_scene(name: str) -> None:
    """A ball is more than 2 px from where it should be at some time, or never by more than rounding."""
    program = PROGRAMS[name]
    off = np.abs(simulate(program.scene, program.spec).position - simulate(program.scene, "exact").position).max()
    assert off > 2 if program.says else off < 1e-3, f"off by {off:.3g} px"
