"""What stands out while a run goes on is what a comparison of it reports."""

import json
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import pytest
from conftest import ball_at, sample, scene_of

from sandbox.analysis.comparison import RunningComparison, compare
from sandbox.engines import named
from sandbox.report.trajectory import simulate
from sandbox.run.edits import DeleteBall, SetElasticity, SetRate, SetVelocity
from sandbox.run.inputs import Grab, Input, Kick, Move, Release
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.session.session import Session
from sandbox.view.run_so_far import ComparisonSoFar, Marks, RunSoFar


class Watched:
    """A session that is compared while it runs."""

    def __init__(self, scene: Scene, engines: list[str], inputs: Sequence[Input] = ()) -> None:
        self.so_far = ComparisonSoFar()
        self.session = Session(scene, engines, inputs)

    @property
    def marks(self) -> Marks:
        self.so_far.of(RunSoFar.of(self.session))
        return self.so_far.marks


def run(watched: Watched, steps: int) -> Watched:
    for _ in range(steps):
        watched.session.advance()
    return watched


@pytest.mark.parametrize(
    ("name", "engines"),
    [
        ("article", ["pymunk", "article", "impulse", "exact"]),
        ("head-on", ["exact"]),
        pytest.param("gas-100", ["impulse", "exact"], marks=pytest.mark.wide),
    ],
)
def test_marks_are_those_of_the_comparison(name: str, engines: list[str]) -> None:
    marks = run(Watched(load(name), engines), 300).marks
    comparison = compare(load(name).changed(seconds=5.0), engines)
    firsts = {name: run.figures.first_difference for name, run in comparison.runs.items()}
    assert marks.differences == {name: first.time for name, first in firsts.items() if first}
    assert marks.trust.horizon == comparison.trust.horizon


TIE: Final = scene_of(
    ball_at(100, 300, vx=200), "radius = 20\npositions = [[300, 279], [300, 321]]", more="seconds = 2"
)


def test_after_an_edit_the_reference_is_judged_from_there() -> None:
    """The edit throws the first ball at two others, which it hits at once."""
    scene = scene_of(ball_at(100, 300), "radius = 20\npositions = [[300, 279], [300, 321]]", more="seconds = 2")
    watched = run(Watched(scene, ["pymunk", "exact"]), 30)
    watched.session.give(SetVelocity(step=30, ball=0, velocity=(200, 0)))
    marks = run(watched, 90).marks
    undecided = compare(scene, ["exact"], inputs=watched.session.given()).trust.undecided
    assert undecided is not None
    assert marks.trust.undecided == pytest.approx(0.5 + undecided)


def test_a_ball_more_or_less_is_no_difference_from_the_twins_before() -> None:
    watched = run(Watched(load("article"), ["pymunk", "exact"]), 30)
    watched.session.give(DeleteBall(step=30, ball=1))
    marks = run(watched, 30).marks
    assert marks.trust.horizon is None
    assert marks.trust.undecided is None


DENSE: Final = scene_of(
    "count = 12\nradius = 28\ninside = [[0, 0], [300, 300]]\nspeed = 900", size="[300, 300]", more="seconds = 5"
)
THROWS: Final[Mapping[str, Sequence[Input]]] = {
    "drag": [
        Grab(step=20, ball=0, at=(200, 200)),
        Move(step=23, at=(100, 150)),
        Move(step=31, at=(250, 50)),
        Release(step=43),
    ],
    "kicks": [
        Kick(step=14, ball=0, velocity=(90, 30)),
        Kick(step=15, ball=1, velocity=(0, -50)),
        Kick(step=15, ball=2, velocity=(0, 50)),
    ],
}
EDITS: Final[Sequence[Input]] = [
    Kick(step=7, ball=1, velocity=(30, -20)),
    SetVelocity(step=33, ball=0, velocity=(150, 20)),
    Grab(step=40, ball=0, at=(200, 100)),
    SetElasticity(step=47, elasticity=0.999),
    Release(step=52),
    SetRate(step=60, rate=120),
    DeleteBall(step=70, ball=1),
]


@pytest.mark.parametrize("inputs", sample(THROWS.values(), 2), ids=THROWS)
def test_a_throw_moves_the_horizon_to_where_the_comparison_has_it(inputs: Sequence[Input]) -> None:
    marks = run(Watched(DENSE, ["impulse", "exact"], inputs), DENSE.steps).marks
    horizon = compare(DENSE, ["exact"], inputs=inputs).trust.horizon
    assert None is not marks.trust.horizon == horizon != compare(DENSE, ["exact"]).trust.horizon


@pytest.mark.wide
def test_marks_do_not_depend_on_how_often_they_are_asked_for() -> None:
    always, once = (Watched(DENSE, ["impulse", "exact"], EDITS) for _ in range(2))
    run(once, 260)
    for steps in (*[5] * 16, *[20] * 9):
        assert run(always, steps).marks is not None
    assert once.marks == always.marks
    assert once.marks.trust.horizon is not None


@pytest.mark.parametrize("edit_at", range(46, 53))
def test_an_edit_keeps_what_the_steps_before_it_have_shown(edit_at: int) -> None:
    """The tie is in step 50."""
    watched = run(Watched(TIE, ["pymunk", "exact"]), edit_at)
    watched.session.give(SetVelocity(step=edit_at, ball=0, velocity=(0, -1)))
    assert run(watched, 30).marks.trust.undecided == (50 / 60 if edit_at > 49 else None)


def test_a_throw_that_is_undone_leaves_no_mark() -> None:
    watched = run(Watched(TIE, ["pymunk", "exact"]), 8)
    for given in (Grab(step=8, ball=0, at=(100, 100)), Release(step=11)):
        run(watched, given.step - watched.session.step).session.give(given)
    assert run(watched, 60).marks.trust.undecided is None
    watched.session.undo()
    assert run(watched, 60).marks == run(Watched(TIE, ["pymunk", "exact"]), 68).marks
    assert watched.marks.trust.undecided is not None


@pytest.mark.wide
@pytest.mark.parametrize("name", ["newtons-cradle", "billiards", "pile", "gas-100"])
def test_a_comparison_that_goes_on_is_to_the_byte_that_of_a_run_of_as_many_steps(name: str) -> None:
    engines = ["pymunk", "impulse", "exact"]
    scene = load(name).changed(seconds=0.5)
    running = RunningComparison(scene, named(engines), "exact", (), scene.steps)
    for steps in (7, 8, 19, 30):
        running.advance(steps)
        comparison = running.result()
    assert json.dumps(comparison.as_json()) == json.dumps(compare(scene, engines).as_json())
    assert comparison.as_csv() == compare(scene, engines).as_csv()


def test_the_path_of_a_run_longer_than_expected_has_fewer_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.analysis.measurement.MAX_PATH_BYTES", 3 * 8 * 100)
    scene = load("article")
    running = RunningComparison(scene, named(["impulse", "exact"]), "exact", (), 60)
    running.advance(500)
    comparison = running.result()
    positions, path = simulate(scene, "impulse", steps=500).position, comparison.runs["impulse"].path
    assert 50 < len(path) <= 200
    assert np.array_equal(path, positions[:: comparison.stride].astype(np.float32))


def test_a_run_repeated_has_the_same_marks_and_a_changed_run_others() -> None:
    watched = run(Watched(load("article"), ["article", "exact"]), 80)
    before = watched.marks
    assert before.differences
    watched.session.seek(10)
    assert watched.marks == before
    assert run(watched, 20).marks == before
    watched.session.seek(10)
    watched.session.give(SetVelocity(step=10, ball=1, velocity=(0, 0)))
    assert run(watched, 70).marks != before
