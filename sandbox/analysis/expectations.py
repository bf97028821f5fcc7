"""Expectations: how far a state is from what a law says."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sandbox.quantity import energy, momentum
from sandbox.scene.model import Expect, Scene
from sandbox.state import State


@dataclass(frozen=True)
class Score:
    """How an engine did on one expectation; error and tolerance are in the units of what is expected."""

    expect: Expect
    error: float

    @property
    def passed(self) -> bool:
        """Tell whether the error is within the tolerance."""
        return self.error <= self.expect.tolerance


def score(scene: Scene, expect: Expect, initial: State, state: State) -> Score:
    """Score a state at the time of an expectation: the largest distance from anything that is expected."""
    mass = scene.bodies.mass
    errors = [
        math.dist(expected, of_balls[expect.ball])
        for expected, of_balls in ((expect.position, state.position), (expect.velocity, state.velocity))
        if expected is not None
    ]
    if expect.energy_ratio is not None:
        before, after = (
            energy(at.position, at.velocity, mass, scene.gravity, scene.arena.size) for at in (initial, state)
        )
        errors.append(abs(float(after / before) - expect.energy_ratio))
    if expect.momentum is not None:
        errors.append(math.dist(expect.momentum, momentum(state.velocity, mass)))
    if expect.centre_of_mass is not None:
        errors.append(math.dist(expect.centre_of_mass, np.average(state.position, axis=0, weights=mass)))
    return Score(expect, max(errors))


def worst(scores: Sequence[Score]) -> Score:
    """Return the score that is furthest beyond its tolerance."""
    return max(scores, key=lambda one: one.error / one.expect.tolerance)
