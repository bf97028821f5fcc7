"""A verdict is a pure function of the run: of how it is cut into blocks and substeps, and of odd states."""

import numpy as np
import pytest
from conftest import scene_of
from event_driven import EventDriven
from faults import FAULTS
from verdicts import causes_of, on_states, states_of

from sandbox.analysis.comparison import compare
from sandbox.judge.causes import Cause
from sandbox.judge.judge import Steps
from sandbox.run.mouse import PUSH, Pushes
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import NO_DAMPING, States


def falling(seed: int = 1) -> Scene:
    return scene_of(
        "count = 6\nradius = 20\nspeed = 200\nfriction = 0.5\ninside = [[20, 20], [380, 280]]",
        size="[400, 300]\nfriction = 0.5",
        more=f"seed = {seed}\ngravity = [0, 300]\nseconds = 3",
    )


@pytest.mark.parametrize("engine", ["pymunk", "impulse"])
def test_blocks_are_judged_as_one(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fifty steps each: the first error, the causes of flights and contacts, and the sums of energy are the same."""
    scene = falling()
    states = states_of(scene, engine)
    whole = on_states(scene, states)
    monkeypatch.setattr("sandbox.judge.judge.BLOCK", 50 * len(scene.bodies))
    parts = on_states(scene, states)
    assert causes_of(parts, at_least=0.01) == causes_of(whole, at_least=0.01)
    assert (
        parts.errors[["step", "first", "second", "cause"]][0] == whole.errors[["step", "first", "second", "cause"]][0]
    )
    assert [part.shape for part in (parts.gained, whole.gained)] == [(scene.steps, 3)] * 2
    total = [sum(entry.energy for entry in verdict.ledger if entry.cause != Cause.SPIN) for verdict in (parts, whole)]
    assert total[0] == pytest.approx(total[1])
    assert parts.errors["step"].max() <= scene.steps


def test_steps_that_come_in_pieces_are_judged_as_one() -> None:
    """Of any lengths, with the last row of each as the first of the next, and pushes by rows of the piece."""
    scene = falling()
    states = states_of(scene, "pymunk")
    pushes: Pushes = np.array([(30, 0, (40.0, 0.0)), (90, 2, (0.0, -50.0))], PUSH)
    whole = on_states(scene, states, pushes=pushes)
    steps, clock = Steps(scene, NO_DAMPING, is_soft=False), np.full(scene.steps, 1 / scene.rate)
    for first, last in ((0, 1), (1, 50), (50, 77), (77, scene.steps)):
        some = pushes[(pushes["row"] > first) & (pushes["row"] <= last)].copy()
        some["row"] -= first
        steps.add(states.rows(slice(first, last + 1)), some, clock[first:last])
    parts = steps.verdict()
    assert parts.causes == whole.causes
    assert parts.ledger == whole.ledger


def test_a_verdict_by_whole_steps() -> None:
    """Of four substeps each, the errors are in the steps that contain them, and so is what is gained."""
    scene = falling()
    states = states_of(scene, "impulse")
    verdict = on_states(scene, states)
    by_steps = verdict.of_steps(4)
    assert (by_steps.errors["step"] == np.ceil(verdict.errors["step"] / 4)).all()
    assert (by_steps.gained == verdict.gained[3::4]).all()
    assert by_steps.causes == verdict.causes


@pytest.mark.parametrize(("name", "causes"), [("EventDriven", set()), ("ImpulseTooSmall", {Cause.SMALL})])
def test_steps_of_varying_length(name: str, causes: set[Cause]) -> None:
    """Every third step is half as long."""
    scene = falling()
    engine = FAULTS[name].engine(scene, spawn(scene)) if causes else EventDriven(scene, spawn(scene))
    states, clock = States.empty(121, len(scene.bodies)), list[float]()
    states.fill(0, engine.state())
    for step in range(120):
        engine.dt = (0.5 if step % 3 == 0 else 1.0) / scene.rate
        engine.step()
        clock.append(engine.dt)
        states.fill(step + 1, engine.state())
    assert causes_of(on_states(scene, states, clock=clock)) == causes
    assert causes_of(on_states(scene, states)) != causes


@pytest.mark.parametrize("places", ["one", "moving", "apart again"])
def test_coincident_centres_end_in_a_verdict(places: str) -> None:
    scene = scene_of("radius = 20\nposition = [300, 300]", "radius = 20\nposition = [345, 300]")
    states = States.empty(6, 2)
    states.position[:], states.velocity[:] = 300.0, 0.0
    if places == "moving":
        states.velocity[..., 0], states.position[..., 0] = 60.0, 300.0 + np.arange(6)[:, None]
    if places == "apart again":
        states.position[3:, 0, 0], states.position[3:, 1, 0] = 280, 320
    verdict = on_states(scene, states)
    assert np.isfinite([entry.energy for entry in verdict.ledger]).all()
    assert np.isfinite([each.share for each in verdict.causes]).all()


def test_balls_in_each_other_at_one_velocity_have_a_verdict_without_a_warning() -> None:
    balls = "radius = 20\npositions = [[100, 100], [110, 100]]\nvelocity = [100, 0]"
    run = compare(scene_of(balls, size="[400, 300]", more="seconds = 1"), ["pymunk", "exact"]).runs["pymunk"]
    assert {each.cause for each in run.figures.causes} == {Cause.UNKNOWN}


def test_a_fast_ball_among_many_at_rest_is_no_error_of_exact() -> None:
    """It flies 100 px a step, and all others lie still: the broad phase must reach as far as it flies."""
    rest = ", ".join(f"[{60 + 10 * i}, {400 + 10 * j}]" for i in range(50) for j in range(6))
    shot = "radius = 4\nposition = [20, 103]\nvelocity = [6000, 0]"
    scene = scene_of(f"radius = 4\npositions = [{rest}]", shot, "radius = 4\nposition = [380, 100]", size="[700, 500]")
    verdict = on_states(scene, states_of(scene, "exact", seconds=0.2))
    assert causes_of(verdict) == set()
