"""The scoreboard: exact meets every truth, the others get honest scores."""

import json

import pytest
from conftest import scene_of

from sandbox.analysis.expectations import Score
from sandbox.analysis.verify import all_passed, as_json, verify
from sandbox.errors import Refused
from sandbox.scene.files import bundled, load

TRUTHS = list(bundled("truths"))


@pytest.mark.parametrize("name", TRUTHS)
def test_the_exact_engine_meets_every_truth(name: str) -> None:
    [[score]] = [row.values() for row in verify([load(name)], ["exact"]).values()]
    assert isinstance(score, Score)
    assert score.error < 1e-9


def test_an_expectation_at_the_start_is_scored() -> None:
    expect = "[[expect]]\nat = 0\nball = 0\nposition = [100, 101]\ntolerance = 2\nbecause = 'It begins there.'"
    [row] = verify([scene_of(f"radius = 20\nposition = [100, 100]\n{expect}")], ["exact"]).values()
    assert isinstance(row["exact"], Score)
    assert row["exact"].error == 1


def test_pymunk_s_score_is_its_error() -> None:
    """In `oblique` it leaves at 105.88, -99.83 px/s where 100, -100 is true."""
    [row] = verify([load("oblique")], ["pymunk", "article"]).values()
    assert isinstance(row["pymunk"], Score)
    assert row["pymunk"].error == pytest.approx(((105.882353 - 100) ** 2 + (99.826840 - 100) ** 2) ** 0.5, abs=1e-5)
    assert not row["pymunk"].passed


def test_the_json_names_error_tolerance_and_passed_or_why_it_was_refused() -> None:
    board = verify([load("bouncing")], ["exact", "article"])
    document = json.loads(json.dumps(as_json(board)))["scenes"]["bouncing"]
    assert document["exact"] == {"error": pytest.approx(0, abs=1e-9), "tolerance": 1e-6, "passed": True}
    assert list(document["article"]) == ["refused"]
    assert document["article"]["refused"].startswith("article: gravity and elasticity below 1 are not")


def test_the_score_is_that_of_the_expectation_missed_most() -> None:
    expect = "[[expect]]\nat = 1\nball = 0\nposition = [{}, 300]\ntolerance = {}\nbecause = 'it flies on'\n"
    scene = scene_of(
        "radius = 20\nposition = [200, 300]\nvelocity = [60, 0]\n" + expect.format(262, 10) + expect.format(261, 1e-3)
    )
    [row] = verify([scene], ["exact"]).values()
    score = row["exact"]
    assert isinstance(score, Score)
    assert score.error == pytest.approx(1)
    assert score.expect.tolerance == 1e-3


def test_an_error_is_the_largest_within_one_expectation() -> None:
    scene = scene_of(
        "radius = 20\nposition = [200, 300]\nvelocity = [60, 0]\n[[expect]]\nat = 1\nball = 0\n"
        "position = [260, 300]\nvelocity = [57, 4]\ntolerance = 1\nbecause = 'its position is right'\n"
    )
    [row] = verify([scene], ["exact"]).values()
    assert isinstance(row["exact"], Score)
    assert row["exact"].error == pytest.approx(5)


def test_the_engines_asked_for_must_pass_or_else_the_exact_engine() -> None:
    board = verify([load("oblique")], ["pymunk", "exact"])
    assert all_passed(board, None)
    assert all_passed(board, ["exact"])
    assert not all_passed(board, ["pymunk", "exact"])
    refused = verify([load("bouncing")], ["article"])
    assert isinstance(refused["bouncing"]["article"], Refused)
    assert all_passed(refused, ["article"])


def test_momentum_and_centre_of_mass_are_of_all_balls() -> None:
    scene = scene_of(
        "radius = 20\nmass = 3\nposition = [200, 300]\nvelocity = [60, 0]",
        "radius = 20\nposition = [600, 300]\nvelocity = [0, -60]\n[[expect]]\nat = 1\nmomentum = [180, -60]\n"
        "centre_of_mass = [345, 285]\nenergy_ratio = 1\ntolerance = 1e-9\nbecause = 'nothing acts on them'\n",
    )
    [row] = verify([scene], ["exact"]).values()
    assert isinstance(row["exact"], Score)
    assert row["exact"].passed
