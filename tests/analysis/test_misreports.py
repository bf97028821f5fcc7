"""Contacts that are reported otherwise than the balls had them: a line of its own, and no cause of a difference."""

from typing import Any

import pytest
from conftest import scene_of
from event_driven import EventDriven

import sandbox
from sandbox.analysis.verdict import verdict
from sandbox.run.inputs import Kick, Start
from sandbox.scene.files import load
from sandbox.state import Contacts

EIGHT = "count = 8\nradius = 20\nspeed = 200\ninside = [[20, 20], [380, 280]]"
SCENE = scene_of(EIGHT, size="[400, 300]", more="seed = 1\nseconds = 1\ngravity = [0, 900]")


class MissesReports(EventDriven):
    """The first contact of each step is resolved, but not reported."""

    def contacts(self) -> Contacts:
        return super().contacts()[1:]


class ReportsAnotherBall(EventDriven):
    """Contacts of a pair are reported of its first ball and a third."""

    def report(self, time: float, i: int, other: int, *more: Any) -> None:
        third = [j for j in self.balls[i + 1 :] if j != other]
        super().report(time, i, third[-1] if other >= 0 and third else other, *more)


class AppliesMore(EventDriven):
    """It applies 5 % more than it reports."""

    def push(self, i: int, other: int, impulse: complex) -> None:
        super().push(i, other, 1.05 * impulse)


@pytest.mark.parametrize("engine", [MissesReports, ReportsAnotherBall])
def test_an_engine_that_only_misreports_is_not_wrong(engine: type[EventDriven]) -> None:
    comparison = sandbox.compare(SCENE, {"mine": engine, "exact": "exact"})
    run = comparison.runs["mine"]
    assert run.misreports
    assert run.differences == ()
    assert "Misreports contacts in " in verdict(comparison)


def test_an_impulse_that_is_reported_as_what_was_due_shows() -> None:
    """The impulse is 1.05 times what is reported."""
    run = sandbox.compare(SCENE, {"mine": AppliesMore, "exact": "exact"}).runs["mine"]
    assert run.misreports


def test_engines_that_report_what_they_do_are_not_accused() -> None:
    assert sandbox.compare(SCENE, {"mine": EventDriven, "exact": "exact"}).runs["mine"].misreports == ()
    for name, engines in {
        "gas-100": ["pymunk", "article", "impulse", "exact"],
        "bouncing": ["pymunk", "exact"],
    }.items():
        runs = sandbox.compare(load(name).changed(seconds=0.5), engines).runs
        assert not any(run.misreports for run in runs.values())


def test_a_kick_right_after_a_contact_is_no_part_of_what_the_contact_did() -> None:
    """The ball is at the wall in step 6, and is kicked before step 7."""
    scene = scene_of("radius = 20\nposition = [100, 70]\nvelocity = [0, -510]", more="seconds = 0.5")
    start, kick = Start(scene="test", seed=0, rate=60), Kick(step=6, ball=0, velocity=(0.0, 200.0))
    runs = sandbox.compare(scene, ["pymunk", "exact"], inputs=[start, kick]).runs
    assert len(runs["exact"].contacts) == 1
    assert not any(run.misreports for run in runs.values())
