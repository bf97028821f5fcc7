"""What stands out while a run goes on is what a comparison of it reports."""

import gc
import tracemalloc
from collections.abc import Sequence

import pytest
from conftest import scene_of

from sandbox.analysis.comparison import compare
from sandbox.run.edits import DeleteBall, SetVelocity
from sandbox.run.inputs import Grab, Input, Release
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.session.monitor import Marks, Monitor
from sandbox.session.session import Session


class Watched:
    """A session with a monitor."""

    def __init__(self, scene: Scene, engines: list[str], inputs: Sequence[Input] = ()) -> None:
        self.monitor = Monitor()
        self.session = Session(scene, engines, inputs, self.monitor)

    @property
    def marks(self) -> Marks:
        return self.monitor.marks


def run(watched: Watched, steps: int) -> Watched:
    for _ in range(steps):
        watched.session.advance()
    return watched


@pytest.mark.parametrize(
    ("name", "engines"),
    [("article", ["pymunk", "article", "impulse", "exact"]), ("gas-100", ["impulse", "exact"]), ("head-on", ["exact"])],
)
def test_marks_are_those_of_the_comparison(name: str, engines: list[str]) -> None:
    marks = run(Watched(load(name), engines), 300).marks
    comparison = compare(load(name).changed(seconds=5.0), engines)
    firsts = {name: run.figures.first_difference for name, run in comparison.runs.items()}
    assert marks.differences == {name: first.time for name, first in firsts.items() if first}
    assert marks.trust.horizon == comparison.horizon


def test_a_tie_is_marked_as_in_the_comparison_and_no_engine_differs_after_it() -> None:
    scene = scene_of(
        "radius = 20\nposition = [100, 300]\nvelocity = [200, 0]",
        "radius = 20\npositions = [[300, 279], [300, 321]]",
        more="seconds = 2",
    )
    marks = run(Watched(scene, ["pymunk", "exact"]), 120).marks
    comparison = compare(scene, ["pymunk", "exact"])
    assert comparison.undecided is not None
    assert marks.trust.undecided == comparison.undecided
    assert marks.trust.horizon == comparison.horizon
    assert marks.differences == {}


def test_after_an_edit_the_reference_is_judged_from_there() -> None:
    """The edit throws the first ball at two others, which it hits at once."""
    scene = scene_of(
        "radius = 20\nposition = [100, 300]", "radius = 20\npositions = [[300, 279], [300, 321]]", more="seconds = 2"
    )
    watched = run(Watched(scene, ["pymunk", "exact"]), 30)
    watched.session.give(SetVelocity(step=30, ball=0, velocity=(200, 0)))
    marks = run(watched, 90).marks
    undecided = compare(scene, ["exact"], inputs=watched.session.given()).undecided
    assert undecided is not None
    assert marks.trust.undecided == pytest.approx(0.5 + undecided)


def test_a_ball_more_or_less_is_no_difference_from_the_twins_before() -> None:
    watched = run(Watched(load("article"), ["pymunk", "exact"]), 30)
    watched.session.give(DeleteBall(step=30, ball=1))
    marks = run(watched, 30).marks
    assert marks.trust.horizon is None
    assert marks.trust.undecided is None


@pytest.mark.parametrize(
    ("name", "engines"), [("article", ["pymunk", "article", "exact"]), ("gas-100", ["impulse", "exact"])]
)
def test_marks_are_those_of_one_step_at_a_time(name: str, engines: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    inputs: list[Input] = [Grab(step=20, ball=0, at=(200, 200)), Release(step=33)]
    together = Watched(load(name), engines, inputs)
    monkeypatch.setattr("sandbox.session.monitor.MAX_BOOKED", 1)
    singly = Watched(load(name), engines, inputs)
    for _ in range(120):
        assert run(together, 1).marks == run(singly, 1).marks
    assert together.marks.differences


def test_marks_appear_when_the_run_gets_there() -> None:
    """The first differences of `article` are at 0.82 and 0.83 s, and are known some steps later."""
    watched = run(Watched(load("article"), ["pymunk", "article", "exact"]), 49)
    assert watched.marks.differences == {}
    assert set(run(watched, 20).marks.differences) == {"pymunk", "article"}


def test_a_run_repeated_has_the_same_marks_and_a_changed_run_others() -> None:
    watched = run(Watched(load("article"), ["article", "exact"]), 80)
    before = watched.marks
    assert before.differences
    watched.session.seek(10)
    watched.session.catch_up()
    assert watched.marks.differences == {}
    assert run(watched, 70).marks == before
    watched.session.seek(10)
    watched.session.give(SetVelocity(step=10, ball=1, velocity=(0, 0)))
    assert run(watched, 70).marks != before


def test_after_an_edit_times_still_count_from_the_start() -> None:
    scene = scene_of(
        "radius = 20\nposition = [100, 300]", "radius = 20\nposition = [300, 320]", more="seconds = 20\nrate = 60"
    )
    watched = run(Watched(scene, ["impulse", "exact"]), 30)
    watched.session.give(SetVelocity(step=30, ball=0, velocity=(240, 0)))
    edited = compare(scene, ["impulse", "exact"], inputs=[SetVelocity(step=30, ball=0, velocity=(240, 0))])
    first = edited.runs["impulse"].figures.first_difference
    assert first is not None
    assert run(watched, 90).marks.differences["impulse"] == pytest.approx(0.5 + first.time)


def test_the_mouse_makes_no_difference() -> None:
    scene = scene_of("radius = 20\nposition = [400, 300]")
    inputs: list[Input] = [Grab(step=3, ball=0, at=(200, 200)), Release(step=30)]
    assert run(Watched(scene, ["impulse", "exact"], inputs), 60).marks.differences == {}


def test_a_run_in_which_nothing_happens_takes_no_more_memory() -> None:
    scene = scene_of("radius = 20\nposition = [400, 300]", "radius = 20\nposition = [100, 100]")
    lockstep = Lockstep(scene, ["impulse", "exact"])
    for runner in lockstep.engines.values():
        runner.contacts()
    monitor = Monitor()
    monitor.begin(lockstep, "exact")
    sizes = []
    tracemalloc.start()
    for _ in range(4):
        for _ in range(500):
            lockstep.step()
            monitor.observe(lockstep.states(), {name: runner.contacts() for name, runner in lockstep.engines.items()})
        gc.collect()
        sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert sizes[3] - sizes[2] < 20_000  # a state kept each step would be 500 times a hundred bytes
