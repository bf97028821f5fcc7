"""The times of steps, against sums of fractions."""

from fractions import Fraction

import numpy as np
import pytest

from sandbox.scene.clock import Clock

MS = [(10 + 7 * k % 13) for k in range(200)]  # of each step
ENDS = [float(sum((Fraction(ms, 1000) for ms in MS[:k]), Fraction(0))) for k in range(len(MS) + 1)]


def irregular() -> Clock:
    clock = Clock(1000 / MS[0])
    for step, ms in enumerate(MS[1:], start=1):
        clock.change(step, 1000 / ms)
    return clock


def test_times_of_irregular_steps_are_their_sums() -> None:
    clock = irregular()
    assert clock.times(np.arange(len(ENDS))) == pytest.approx(ENDS, rel=1e-14)
    assert 1 / clock.rates(np.arange(1, len(ENDS))) == pytest.approx(np.array(MS) / 1000)
    assert [clock.step(time) for time in ENDS] == list(range(len(ENDS)))
    assert clock.steps((ENDS[7] + ENDS[8]) / 2) == pytest.approx(7.5)


def test_the_end_of_a_step_is_in_it_and_what_follows_in_the_next() -> None:
    clock = irregular()
    ends = clock.times(np.arange(1, len(ENDS)))
    assert (clock.steps_containing(ends) == np.arange(1, len(ENDS))).all()
    assert (clock.steps_containing(ends[:-1] + 1e-4) == np.arange(2, len(ENDS))).all()
    assert (clock.steps_containing(ends - 1e-4) == np.arange(1, len(ENDS))).all()


def test_a_change_of_rate_begins_at_its_step() -> None:
    clock = Clock(60)
    clock.change(120, 240)
    assert clock.times(np.array([120, 121])) == pytest.approx([2, 2 + 1 / 240])
    assert clock.rates(np.array([0, 1, 120, 121])).tolist() == [60, 60, 60, 240]
