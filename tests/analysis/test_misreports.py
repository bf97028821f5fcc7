"""Contacts that are reported otherwise than the balls had them: a line of its own, and no cause of a difference."""

import pytest
from conftest import scene_of
from faults import FAULTS, EventDriven

import sandbox
from sandbox.analysis.verdict import verdict
from sandbox.run.inputs import Kick, Start
from sandbox.scene.files import load

EIGHT = "count = 8\nradius = 20\nspeed = 200\ninside = [[20, 20], [380, 280]]"
SCENE = scene_of(EIGHT, size="[400, 300]", more="seed = 1\nseconds = 1\ngravity = [0, 900]")


@pytest.mark.parametrize("name", ["DoesNotReport", "ReportsWrongPair"])
def test_an_engine_that_only_misreports_is_not_wrong(name: str) -> None:
    comparison = sandbox.compare(SCENE, {"mine": FAULTS[name].engine, "exact": "exact"})
    run = comparison.runs["mine"]
    assert run.misreport
    assert run.differences == ()
    assert "mine misreports contacts in " in verdict(comparison)


def test_an_impulse_that_is_reported_as_what_was_due_shows() -> None:
    """The impulse is 1.05 times what is reported."""
    run = sandbox.compare(SCENE, {"mine": FAULTS["MoreThanReported"].engine, "exact": "exact"}).runs["mine"]
    assert run.misreport
    along = sum(a * b for a, b in zip(run.misreport.seen, run.misreport.reported, strict=True))
    assert along / sum(b * b for b in run.misreport.reported) > 1


def test_engines_that_report_what_they_do_are_not_accused() -> None:
    assert sandbox.compare(SCENE, {"mine": EventDriven, "exact": "exact"}).runs["mine"].misreport is None
    for name, engines in {
        "gas-100": ["pymunk", "article", "impulse", "exact"],
        "bouncing": ["pymunk", "exact"],
    }.items():
        runs = sandbox.compare(load(name).changed(seconds=0.5), engines).runs
        assert not any(run.misreport for run in runs.values())


def test_a_kick_right_after_a_contact_is_no_part_of_what_the_contact_did() -> None:
    """The ball is at the wall in step 6, and is kicked before step 7."""
    scene = scene_of("radius = 20\nposition = [100, 70]\nvelocity = [0, -510]", more="seconds = 0.5")
    start, kick = Start(scene="test", seed=0, rate=60), Kick(step=6, ball=0, velocity=(0.0, 200.0))
    runs = sandbox.compare(scene, ["pymunk", "exact"], inputs=[start, kick]).runs
    assert len(runs["exact"].contacts) == 1
    assert not any(run.misreport for run in runs.values())
