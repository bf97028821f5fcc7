"""Balls that fly through a wall within a step are reported, and no others."""

import json
from pathlib import Path

import pytest
from conftest import Command, scene_of

from sandbox.analysis.comparison import compare
from sandbox.analysis.verdict import verdict
from sandbox.engines import registry
from sandbox.scene.files import load


@pytest.mark.parametrize("engine", ["pymunk", "impulse"])
def test_a_comparison_reports_balls_that_fly_through_a_wall(engine: str, tmp_path: Path, command: Command) -> None:
    """Two of three balls hit the wall; the third passes its end."""
    figures, table, page = (tmp_path / name for name in ("f.json", "f.csv", "page.html"))
    arguments = ("truths/thin-wall-60-hz", "--engines", f"{engine},exact", "--json", figures, "--csv", table)
    code, out, _ = command("compare", *arguments, "--first", "--report", page)
    assert code == 0
    printed = " ".join(out.split())
    assert "2 contacts: a ball went through a wall without a contact" in printed
    assert "missed contacts 2 0" in printed
    explanation = "A ball went through a wall without a contact: it flew 50 px in the step."
    assert explanation in printed
    assert explanation in page.read_text()
    found = json.loads(figures.read_text())["engines"][engine]
    assert (found["first_difference"]["cause"], found["first_difference"]["because"]) == ("missed", explanation)
    assert found["ledger"]["missed"]["contacts"] == 2
    assert found["ledger"]["missed"]["energy"] == 0
    assert explanation in table.read_text()


@pytest.mark.parametrize("engine", ["exact", "box2d"])
def test_no_passage_is_reported_if_the_wall_stops_the_balls(engine: str) -> None:
    if engine not in registry():
        pytest.skip(f"needs {engine}")
    assert compare(load("truths/thin-wall-60-hz"), [engine]).runs[engine].missed == 0


def test_a_ball_that_goes_round_a_wall_within_a_step_is_not_reported_as_a_passage() -> None:
    """Within one step it flies up to the arena's wall, over the end of the inner wall, and down on the other side."""
    scene = scene_of(
        "radius = 20\nposition = [300, 300]\nvelocity = [200, -600]\n[[walls]]\nfrom = [400, 200]\nto = [400, 600]",
        more="rate = 1\nseconds = 1",
    )
    comparison = compare(scene, ["exact"])
    assert comparison.runs["exact"].final.position[0] == pytest.approx([500, 340])
    assert comparison.runs["exact"].missed == 0
    assert "through" not in verdict(comparison)
