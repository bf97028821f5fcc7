"""Pymunk's damping in the ledger: a ball alone keeps d^t of its velocity, and d^2t of its energy, after t seconds."""

import math
from typing import Any

import pytest

from sandbox.analysis.comparison import compare
from sandbox.analysis.verdict import verdict
from sandbox.judge.causes import Cause
from sandbox.scene.model import Scene

OWN = {
    *(Cause.DAMPING, Cause.LATE, Cause.POSITION_CORRECTION, Cause.ELASTICITY, Cause.FRICTION, Cause.SPIN),
    *(Cause.ROUNDING, Cause.UNKNOWN),
}


def ball(**changes: Any) -> Scene:
    settings = {"damping": 0.9} | changes.pop("pymunk", {})
    group = {"radius": 10, "position": (400, 300), "velocity": (60, -80), "spin": 3.0}
    return Scene(**{"arena": {"size": (800, 600)}, "balls": [group], "seconds": 2, "pymunk": settings} | changes)


def energies(scene: Scene, name: str = "pymunk") -> dict[Cause, float]:
    """Return the lines of the engine's ledger, as fractions of the energy at the start."""
    run = compare(scene, [name, "exact"]).runs[name]
    return {entry.cause: entry.energy / float(run.energy[0]) for entry in run.figures.ledger}


@pytest.mark.parametrize("substeps", [1, 4])
def test_damping_takes_what_its_law_says_from_a_ball_alone(substeps: int) -> None:
    lines = energies(ball(pymunk={"substeps": substeps}))
    assert lines.pop(Cause.DAMPING) == pytest.approx(0.9**4 - 1, abs=1e-9)
    assert lines.pop(Cause.ROUNDING, 0.0) == pytest.approx(0, abs=1e-9)
    assert not lines


def test_damping_is_a_setting_where_the_engine_is_named() -> None:
    assert energies(ball(), "pymunk(damping=0.5)")[Cause.DAMPING] == pytest.approx(0.5**4 - 1, abs=1e-9)


def test_damping_of_1_takes_nothing() -> None:
    assert Cause.DAMPING not in energies(ball(pymunk={"damping": 1.0}))


def test_other_engines_ignore_damping() -> None:
    run = compare(ball(), ["impulse", "exact"]).runs["impulse"]
    assert run.figures.first_difference is None
    assert run.figures.energy_ratio == pytest.approx(1, abs=1e-12)


def test_damping_under_gravity_is_not_gravity_s_error() -> None:
    """A ball at rest falls by v_k+1 = D v_k + g h: what that lacks of g t is damping's, the parabola's half is not."""
    group = {"radius": 10, "position": (400, 100)}
    arena, gravity = {"size": (800, 600), "walls": False}, 900.0
    run = compare(ball(arena=arena, balls=[group], gravity=(0, gravity)), ["pymunk", "exact"]).runs["pymunk"]
    lines = {entry.cause: entry.energy for entry in run.figures.ledger}
    h, left = 1 / 60, 0.9 ** (1 / 60)
    speeds = [0.0]
    for _ in range(120):
        speeds.append(left * speeds[-1] + gravity * h)
    lost = sum((left * v + gravity * h) ** 2 / 2 - (v + gravity * h) ** 2 / 2 for v in speeds[:-1])
    assert lines[Cause.DAMPING] == pytest.approx(lost, rel=1e-9)
    assert lines[Cause.GRAVITY] == pytest.approx(gravity * gravity * h * h / 2 * 120, rel=1e-6)
    assert (run.figures.momentum_drift or 0.0) < 1e-12


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("substeps", [1, 4])
def test_damping_is_no_error_of_contacts(friction: float, substeps: int) -> None:
    """A damped gas has the causes that the same gas has without damping, and its lines add up."""
    group = {"count": 12, "radius": 15, "inside": ((0, 0), (400, 300)), "speed": 300, "friction": friction}
    arena = {"size": (400, 300), "friction": friction, "elasticity": 0.9}
    settings = {"damping": 0.6, "substeps": substeps, "collision_persistence": 1}
    run = compare(ball(arena=arena, balls=[group], pymunk=settings), ["pymunk", "exact"]).runs["pymunk"]
    lines = {entry.cause: entry.energy for entry in run.figures.ledger}
    assert (run.figures.pair_contacts or 0) > 5
    assert (run.figures.wall_contacts or 0) > 5
    assert set(lines) <= OWN
    whole = math.fsum(energy for cause, energy in lines.items() if cause != Cause.SPIN)
    assert whole == pytest.approx(float(run.energy[-1] - run.energy[0]), rel=1e-9)
    assert (run.figures.momentum_drift or 0.0) < 1e-12


def test_the_first_difference_in_free_flight_is_damping_in_words() -> None:
    comparison = compare(ball(), ["pymunk", "exact"])
    first = comparison.runs["pymunk"].figures.first_difference
    assert first is not None
    assert first.cause == Cause.DAMPING
    assert first.because == "Damping leaves 90 % of the velocities each second."
    assert (
        "120 steps of a ball: damping leaves 90 % of the velocities each second. damping = 1 turns it off."
        in verdict(comparison)
    )


def test_engines_that_are_damped_alike_do_not_differ_by_it() -> None:
    comparison = compare(ball(), ["pymunk", "pymunk(damping=0.9)"], against="pymunk")
    assert comparison.runs["pymunk(damping=0.9)"].figures.first_difference is None
