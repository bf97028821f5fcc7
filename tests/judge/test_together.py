"""What an engine that solves the contacts of a step together does is named by states alone."""

import numpy as np
import pytest
from conftest import scene_of

from sandbox.judge.causes import Cause
from sandbox.judge.judge import Judge
from sandbox.judge.timeline import Timeline
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.state import NO_DAMPING, PUSH, Damping, States


def judged(scene: Scene, engine: str = "pymunk", damping: Damping = NO_DAMPING) -> Timeline:
    """Run an engine, and judge its states."""
    lockstep = Lockstep(scene, [engine])
    run = lockstep.engines[engine]
    states = States.empty(scene.steps + 1, len(scene.bodies))
    states.fill(0, run.engine.state())
    while lockstep.steps < scene.steps:
        lockstep.advance({run: states.rows(slice(lockstep.steps + 1, None))})
    judge = Judge(scene, damping)
    judge.add(states, np.empty(0, PUSH), 1 / scene.clock.rates(np.arange(1, scene.steps + 1)))
    return Timeline(judge)


def energies(timeline: Timeline) -> dict[str, float]:
    return {cause.key: float(timeline.sums[0, cause]) for cause in Cause if timeline.sums[3, cause]}


def test_a_late_contact_and_the_pushes_after_it_are_two_errors() -> None:
    """At 10 px a step and 95 px from the wall, it is found 5 px deep; a tenth beyond 0.1 px is undone."""
    scene = scene_of("radius = 10\nposition = [295, 100]\nvelocity = [600, 0]", size="[400, 200]")
    timeline = judged(scene.changed(seconds=0.5))
    late, pushed = timeline.errors
    assert (late.cause, pushed.cause) == (Cause.LATE, Cause.POSITION_CORRECTION)
    assert late.depth == pytest.approx(5.0)
    assert pushed.step == late.step + 1
    assert pushed.displacement == pytest.approx(0.1 * (5.0 - 0.1), rel=1e-6)


def test_a_resting_ball_that_bounces_fully_is_pushed_up_as_the_closed_form_says() -> None:
    """It sinks 0.25 px in its first steps, and is pushed back by a tenth of what is beyond 0.1 px in each.

    In 12 steps: it falls for one without moving, moves by 0.25 px in the second, is found there and reversed.
    """
    scene = scene_of("radius = 20\nposition = [100, 280]", size="[400, 300]", more="gravity = [0, 900]\nseconds = 0.2")
    pushed = [error for error in judged(scene).errors if error.cause == Cause.POSITION_CORRECTION]
    for error in pushed:
        assert error.energy == pytest.approx(900 * float(scene.bodies.mass[0]) * error.displacement, rel=1e-9)
    assert pushed[0].displacement == pytest.approx(0.1 * (0.25 - 0.1), rel=1e-6)


def dense(**settings: float) -> Scene:
    scene = scene_of("radius = 14\ngrid = [8, 8]\nspacing = 30.5\nspeed = 300", size="[260, 260]").changed(seconds=3.0)
    return scene.changed(pymunk=scene.pymunk.model_copy(update=settings))


def test_a_dense_gas_loses_its_energy_by_stale_impulses_and_few_iterations() -> None:
    scene = dense()
    sums = energies(judged(scene))
    whole = 0.5 * float(scene.bodies.mass.sum()) * 300**2
    assert sums["stale"] + sums["unconverged"] < -1e-6 * whole
    others = sum(abs(sums[key]) for key in sums if key not in ("stale", "unconverged"))
    assert others <= 0.01 * abs(sums["stale"] + sums["unconverged"])


def test_with_many_iterations_and_fresh_impulses_nothing_is_stale_nor_unconverged() -> None:
    timeline = judged(dense(iterations=200, collision_persistence=1))
    named = {error.cause for error in timeline.errors}
    assert Cause.POSITION_CORRECTION in named
    assert not named & {Cause.WARM_START, Cause.UNCONVERGED}


def test_without_correction_nothing_is_pushed() -> None:
    assert Cause.POSITION_CORRECTION not in {error.cause for error in judged(dense(collision_bias=1.0)).errors}


def shares_in_heap(**settings: float) -> dict[Cause, float]:
    """Return which share of its error each cause has in sixty rough discs that fall on a heap in 1.4 s."""
    scene = load("pile").changed(seconds=1.4, expect=())
    timeline = judged(scene.changed(pymunk=scene.pymunk.model_copy(update=settings)))
    return {suffered.cause: suffered.share for suffered in timeline.suffered}


def test_in_a_heap_stale_impulses_are_told_from_a_solver_that_has_not_converged() -> None:
    """No contact is cached without touching if it persists for one step, and a hundred times the iterations converge.

    The contacts of this heap are more than what its discs can do: impulses are not unique, and many of them pull.
    """
    as_it_is, fresh, converged = (
        shares_in_heap(),
        shares_in_heap(collision_persistence=1),
        shares_in_heap(iterations=1000),
    )
    assert as_it_is[Cause.WARM_START] > 0.4
    assert as_it_is[Cause.UNCONVERGED] > 0.4
    assert as_it_is.get(Cause.UNKNOWN, 0.0) < 0.01
    assert Cause.WARM_START not in fresh
    assert fresh[Cause.UNCONVERGED] > 0.9
    assert converged[Cause.UNCONVERGED] < 0.2 * as_it_is[Cause.UNCONVERGED]


PYRAMID = (
    "radius = 20\nelasticity = 0\nposition = [100, 280]",
    "radius = 20\nelasticity = 0\nposition = [140, 280]",
    "radius = 20\nelasticity = 0\nfriction = 0.8\nposition = [120, 245.358983848622]",
)


@pytest.mark.parametrize("engine", ["exact", "pymunk"])
def test_a_heap_that_stands_has_no_error_but_pushes(engine: str) -> None:
    """Held by friction of 0.8 everywhere, above the tangent of 15 degrees that three discs need."""
    balls = [ball if "friction" in ball else f"{ball}\nfriction = 0.8" for ball in PYRAMID]
    scene = scene_of(*balls, size="[400, 300]\nfriction = 0.8\nelasticity = 0", more="gravity = [0, 900]\nseconds = 1")
    errors = [error for error in judged(scene, engine).errors if error.step > 20]
    assert {error.cause for error in errors} <= ({Cause.POSITION_CORRECTION} if engine == "pymunk" else set())


def test_damping_that_an_engine_declares_is_damping() -> None:
    """With a half left after a second, 0.5 s leave half of the energy."""
    ball = "radius = 10\nposition = [100, 100]\nvelocity = [50, 0]\nspin = 5"
    scene = scene_of(ball, size="[400, 300]").changed(seconds=0.5)
    damped = scene.changed(pymunk=scene.pymunk.model_copy(update={"damping": 0.5}))
    declared, silent = (judged(damped, damping=damping) for damping in (Damping(0.5), NO_DAMPING))
    assert declared.suffered[0].cause == Cause.DAMPING
    assert silent.suffered[0].cause == Cause.UNREPORTED
    turning = 0.5 * float(scene.bodies.moment.sum()) * 5**2
    whole = 0.5 * float(scene.bodies.mass.sum()) * 50**2 + turning
    assert declared.sums[0, Cause.DAMPING] == pytest.approx(-whole / 2, rel=1e-6)
