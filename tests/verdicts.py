"""Verdicts of the judge on states and engines."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from sandbox import simulate
from sandbox.engines import Source
from sandbox.judge.causes import Cause
from sandbox.judge.judge import Steps
from sandbox.judge.summary import Verdict
from sandbox.run.mouse import PUSH, Pushes
from sandbox.scene.model import Scene
from sandbox.state import NO_DAMPING, Damping, States

NO_PUSHES: Final = np.empty(0, PUSH)


def on_states(
    scene: Scene,
    states: States,
    *,
    pushes: Pushes = NO_PUSHES,
    clock: Sequence[float] | None = None,
    damping: Damping = NO_DAMPING,
    is_soft: bool = False,
) -> Verdict:
    """Judge states, with one cause for each sentence. clock: s, the length of each step, by default the scene's."""
    steps = np.arange(1, len(states.position))
    dt = 1 / scene.clock.rates(steps) if clock is None else np.array(clock)
    judged = Steps(scene, damping, is_soft=is_soft)
    judged.add(states, pushes, dt)
    verdict = judged.verdict()
    assert len({(each.cause, each.sentence) for each in verdict.causes}) == len(verdict.causes)
    return verdict


def states_of(scene: Scene, engine: Source, *, seconds: float | None = None) -> States:
    """Return the states of an engine's run, by default of the whole scene."""
    run = simulate(scene, engine, seconds=seconds)
    return States(run.position, run.velocity, run.angle, run.spin)


def causes_of(verdict: Verdict, *, at_least: float = 0.0) -> set[Cause]:
    """Return the causes that have some share of a run's error."""
    return {each.cause for each in verdict.causes if each.share >= at_least}
