"""Expectations: how far a state is from what its scene expects."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sandbox.quantity import energy, momentum
from sandbox.scene.model import Expect, Scene
from sandbox.state import State


@dataclass(frozen=True)
class Score:
    """How an engine did on one expectation. error is in the unit of what is expected, as is the tolerance."""

    expect: Expect
    error: float

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error <= self.expect.tolerance


def score(scene: Scene, expect: Expect, initial: State, state: State) -> Score:
    """Return the score of a state at the time of an expectation: its largest distance from anything expected."""
    mass = scene.bodies.mass
    errors = [
        math.dist(expected, actual[expect.ball])
        for expected, actual in ((expect.position, state.position), (expect.velocity, state.velocity))
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
    """Return the score with the largest error relative to its tolerance."""
    return max(scores, key=lambda score: score.error / score.expect.tolerance)
