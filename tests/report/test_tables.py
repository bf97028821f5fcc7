"""Comparisons as text."""

from conftest import scene_of

from sandbox.analysis.difference import Difference, Kind
from sandbox.judge.causes import Cause
from sandbox.report.tables import _spins


def test_spins_that_are_rounding_are_not_printed() -> None:
    scene = scene_of("radius = 20\npositions = [[100, 100], [200, 100]]")
    still, moving = ((0.0, 0.0), (0.0, 0.0)), ((100.0, 0.0), (0.0, 0.0))
    line = "Spins, rad/s: 0 and 0 before the step, -0.5 and 0 after it; exactly, 0 and 0."
    for spin, expected in ((-8.882e-16, ""), (-0.5, line)):
        first = Difference(
            *(Kind.OUTCOME, 0.5, 0, 1, Cause.LATE, "", False, moving, still, moving, still),
            spin_before=(0.0, 0.0),
            spin_after=(spin, 0.0),
            should_spin_before=(0.0, 0.0),
            should_spin_after=(0.0, 0.0),
        )
        assert _spins(scene, first) == expected
