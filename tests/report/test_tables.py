"""Comparisons as text."""

from io import StringIO

from conftest import scene_of
from rich.console import Console

from sandbox.analysis.comparison import compare
from sandbox.analysis.difference import Difference, Kind
from sandbox.judge.causes import Cause
from sandbox.report.tables import _spins, print_comparison
from sandbox.scene.model import Scene


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


def printed(scene: Scene, engines: list[str], width: int = 80) -> str:
    text = StringIO()
    print_comparison(compare(scene, engines), Console(file=text, width=width))
    return text.getvalue()


def test_one_engine_alone_shows_its_first_contacts_as_the_law_of_impacts_has_them() -> None:
    """Of 3 kg at 40 px/s and 1 kg at rest, with restitution 1/4: the centre of mass keeps its 30 px/s.

    It takes 10 px/s of the heavy one, and 30 of the light one: after it, they have a quarter of these, and opposite.
    """
    scene = scene_of(
        "radius = 10\nmass = 3\nposition = [100, 50]\nvelocity = [40, 0]\nelasticity = 0.25",
        "radius = 10\nposition = [140, 50]\nelasticity = 1",
        more="seconds = 1",
    )
    text = printed(scene, ["exact"])
    table = text[text.index("1 contact in exact:") :]
    assert (
        table
        == """1 contact in exact:

0.500 s, balls 0 and 1
                  kg  velocity, px/s  momentum, kg px/s  energy, kg px²/s²
ball 0, before     3         (40, 0)           (120, 0)              2,400
  after                    (27.5, 0)          (82.5, 0)              1,134
ball 1, before     1          (0, 0)             (0, 0)                  0
  after                    (37.5, 0)          (37.5, 0)              703.1
together, before                               (120, 0)              2,400
  after                                        (120, 0)              1,838
"""
    )
    assert "1 contact" not in printed(scene, ["pymunk", "exact"])
