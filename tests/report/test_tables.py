"""Comparisons as text."""

from io import StringIO

from conftest import ball_at, scene_of
from rich.console import Console

from sandbox.analysis.comparison import compare
from sandbox.analysis.difference import Difference
from sandbox.judge.causes import Cause
from sandbox.report.output import text_of
from sandbox.report.tables import comparison_rows, print_comparison, velocities_and_spins
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.text import counted


def test_spins_that_are_rounding_are_not_printed_nor_what_is_not_known() -> None:
    scene = scene_of("radius = 20\npositions = [[100, 100], [200, 100]]")
    still, moving = ((0.0, 0.0), (0.0, 0.0)), ((100.0, 0.0), (0.0, 0.0))
    line = "Spins, rad/s: 0 and 0 before the step, -0.5 and 0 after it"
    for spin, should, expected in (
        (-8.882e-16, (0.0, 0.0), ""),
        (-0.5, (0.0, 0.0), f"{line}; exactly, 0 and 0."),
        (-0.5, (), f"{line}."),
    ):
        first = Difference(
            *(0.5, 0, 1, Cause.LATE, ""),
            before=moving,
            after=still,
            should_after=moving if should else (),
            spin_before=(0.0, 0.0),
            spin_after=(spin, 0.0),
            should_spin_after=should,
        )
        velocities, *spins = velocities_and_spins(scene, first)
        assert " ".join(spins) == expected
        assert ("exactly" in velocities) == bool(should)


def test_ten_rows_are_printed_and_all_if_asked_for() -> None:
    comparison = compare(load("article").changed(seconds=5.0), ["pymunk", "article", "exact"])
    rows = list(comparison_rows(comparison))
    assert len(rows) > 10
    default = text_of(lambda terminal: print_comparison(comparison, terminal), 80)
    whole = text_of(lambda terminal: print_comparison(comparison, terminal, all_rows=True), 80)
    shown = {text: [label in text for label, *_ in rows] for text in (default, whole)}
    assert sum(shown[default]) == 10
    assert all(shown[whole])
    assert f"{counted(len(rows) - 10, 'more row')} with --all." in default
    assert "--all" not in whole


def test_the_first_difference_and_contacts_are_printed_if_asked_for() -> None:
    comparison = compare(load("article").changed(seconds=5.0), ["pymunk", "exact"])
    default = text_of(lambda terminal: print_comparison(comparison, terminal), 80)
    asked = text_of(lambda terminal: print_comparison(comparison, terminal, first=True, contacts=1), 80)
    assert "pymunk, 0.767 s, ball 2 and the right wall" not in default
    assert "pymunk, 0.767 s, ball 2 and the right wall" in asked
    assert [line for line in default.splitlines() if line.startswith("The first")] == [
        "The first 2 of 10 contacts in exact:"
    ]
    assert len([line for line in asked.splitlines() if line.startswith("The first of")]) == 2


def printed(scene: Scene, engines: list[str], width: int = 80) -> str:
    text = StringIO()
    print_comparison(compare(scene, engines), Console(file=text, width=width))
    return text.getvalue()


def test_one_engine_alone_shows_its_first_contacts_as_the_law_of_impacts_has_them() -> None:
    """Of 3 kg at 40 px/s and 1 kg at rest, with restitution 1/4: the centre of mass keeps its 30 px/s.

    It takes 10 px/s of the heavy one, and 30 of the light one: after it, they have a quarter of these, and opposite.
    """
    scene = scene_of(
        ball_at(100, 50, vx=40, radius=10, mass=3, elasticity=0.25), ball_at(140, 50, radius=10), more="seconds = 1"
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
