"""Every step of a run is sampled, against the reference, and what a hand gives is not what an engine makes."""

from collections.abc import Sequence

import numpy as np
import pytest
from conftest import scene_of
from moments import run, sample

from sandbox.errors import SandboxError
from sandbox.run.edits import AddBall, SetVelocity
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.session.samples import CAPACITY, Quantity, Samples, Series
from sandbox.session.session import Session

THROW: list[Input] = [Grab(step=3, ball=0, at=(300, 300)), Move(step=6, at=(500, 250)), Release(step=20)]


@pytest.fixture
def scene() -> Scene:
    return scene_of("radius = 20\nposition = [200, 300]\nvelocity = [60, 0]", "radius = 20\nposition = [600, 300]")


def sampled(scene: Scene, *steps: dict[str, float]) -> Samples:
    samples = Samples(list(steps[0]), "exact")
    for step, velocity in enumerate(steps):
        sample(samples, scene, step, **velocity)
    return samples


def test_a_series_keeps_an_hour_of_steps_evenly_in_bounded_memory() -> None:
    series = Series(2)
    hour = 3600 * 60
    for step in range(hour):
        if series.wants(step):
            series.add(step, (step, -step))
    assert CAPACITY / 2 <= len(series) <= CAPACITY
    gaps = np.diff(series.steps)
    assert set(gaps.tolist()) == {128}  # the least power of two by which an hour fits
    assert series.steps[0] == 0
    assert series.steps[-1] >= hour - 128
    assert np.array_equal(series.rows, np.column_stack([series.steps, -series.steps]))


def test_earlier_steps_are_not_sampled_again_until_the_series_is_cut() -> None:
    series = Series(1)
    for step in range(10):
        series.add(step, [step])
    assert not series.wants(4)
    series.cut(4)
    assert series.steps.tolist() == [0, 1, 2, 3, 4]
    assert series.wants(5)
    assert not series.wants(4)


def test_energy_gap_and_momentum_are_what_the_formulas_say(scene: Scene) -> None:
    samples = sampled(scene, *[{"pymunk": 90.0, "exact": 60.0}] * 2)
    assert samples.of(Quantity.ENERGY)[1].tolist() == samples.of(Quantity.KINETIC)[1].tolist() == [4050, 1800]
    assert samples.of(Quantity.GAP)[1].tolist() == [30, 0]
    assert samples.of(Quantity.MOMENTUM)[1].tolist() == [90, 60]


def test_an_error_is_a_share_of_what_the_reference_has_had_and_stays_when_it_gets_more(scene: Scene) -> None:
    """Half of the speed is a quarter of the energy, of which the reference has lost 19 % by itself: 0.9² = 0.81."""
    steps = [{"article": 60.0, "exact": 60.0}, *[{"article": 30.0, "exact": 54.0}] * 3]
    samples = sampled(
        scene, *steps, *[{"article": 120.0, "exact": 120.0}] * 2, *[{"article": 60.0, "exact": 120.0}] * 2
    )
    for step, error in enumerate([0.0, -56.0, -56.0, -56.0, 0.0, 0.0, -75.0, -75.0]):
        assert samples.error_at(step) == pytest.approx({"article": error, "exact": 0.0})
    assert samples.error_at(99) == samples.error_at(7)


def test_an_engine_that_loses_what_the_reference_loses_a_step_later_is_not_accused(scene: Scene) -> None:
    late = [{"pymunk": 60.0, "exact": 60.0}, {"pymunk": 60.0, "exact": 30.0}, {"pymunk": 30.0, "exact": 30.0}]
    later = [late[0], late[1], late[1], *late[2:]]
    early = [late[0], {"pymunk": 30.0, "exact": 60.0}, late[2]]
    for steps, accused in ((late, 0.0), (early, 0.0), (later, 75.0)):
        for end in range(1, len(steps) + 2):  # nor while the later step is not done yet
            errors = sampled(scene, *[*steps, steps[-1]][:end]).errors()[:, 0]
            assert np.abs(errors).max() <= accused
        assert np.abs(errors).max() == pytest.approx(accused)


def test_the_energy_of_balls_on_the_ground_is_0_and_a_throw_adds_to_it() -> None:
    balls = "radius = 20\npositions = [[200, 580], [300, 380]]"
    scene = scene_of(balls, more="gravity = [0, 900]\nseconds = 9")
    session = run(Session(scene, ["impulse", "exact"], [SetVelocity(step=20, ball=0, velocity=(100, 0))]), 40)
    energy = session.samples.of(Quantity.ENERGY)
    assert energy[:20, 1] == pytest.approx(900 * 200)
    assert energy[20:, 1] == pytest.approx(900 * 200 + 100**2 / 2)


def test_while_there_is_no_reference_nothing_is_measured_against_it(scene: Scene) -> None:
    samples = Samples(["pymunk", "exact"], "exact")
    for step in range(3):
        sample(samples, scene, step, pymunk=60.0)
    assert np.isnan(samples.errors()).all()
    assert np.isnan(samples.of(Quantity.GAP)).all()
    assert samples.of(Quantity.MOMENTUM)[:, 0].tolist() == [60, 60, 60]


@pytest.mark.parametrize("inputs", [THROW, [SetVelocity(step=4, ball=0, velocity=(700, 90))],
    [AddBall(step=4, position=(90, 90), radius=9)]], ids=["throw", "velocity", "add"])  # fmt: skip
def test_engines_that_keep_energy_keep_it_whatever_a_hand_does(scene: Scene, inputs: Sequence[Input]) -> None:
    session = run(Session(scene, ["impulse", "exact"], inputs), 60)
    assert np.abs(session.samples.errors()).max() < 1e-9
    own = session.samples.of(Quantity.OWN)
    assert own == pytest.approx(own[0, 0])
    assert abs(session.shown.engines["impulse"].work) > 1 or isinstance(inputs[0], AddBall)


# The hidden reference


def test_the_reference_runs_along_hidden_and_engines_are_measured_against_it() -> None:
    gaps = []
    for names, reference in ((["pymunk", "article"], "exact"), (["pymunk", "article", "exact"], None)):
        session = run(Session(load("article"), names, reference=reference), 90)
        gaps.append(session.samples.of(Quantity.GAP)[-1].tolist())
        assert session.names == names
    assert gaps[0] == gaps[1]


@pytest.mark.usefixtures("fails_after_29_steps")
def test_without_a_reference_that_stops_the_run_goes_on_to_the_same_bits() -> None:
    expected = run(Session(load("article"), ["pymunk"]), 60).shown.states["pymunk"]
    session = run(Session(load("article"), ["pymunk"], reference="exact"), 60)
    assert session.shown.states["pymunk"].position.tobytes() == expected.position.tobytes()
    assert set(session.shown.states) == {"pymunk"}
    assert session.stopped == (0.5, "exact: contacts without end")
    gap = session.samples.of(Quantity.GAP)[:, 0]
    assert np.isfinite(gap[:30]).all()
    assert np.isnan(gap[30:]).all()
    session.seek(10)
    session.catch_up()
    assert "exact" in session.shown.states
    run(session, 50)
    assert session.stopped == (0.5, "exact: contacts without end")
    with pytest.raises(SandboxError, match="contacts without end"):
        run(Session(load("article"), ["pymunk", "exact"]), 60)
