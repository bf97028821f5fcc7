"""Time of a comparison."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Final

import numpy as np

from sandbox.analysis.comparison import compare
from sandbox.analysis.reference import Twins
from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_in
from sandbox.engines import REFERENCE, create
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import States

SECONDS_PER_ROUND: Final = 0.5  # at least, for which each side of a ratio is measured


def comparison(rounds: int) -> Iterator[Figure]:
    """Measure `compare`: alone, and relative to its engines run alone.

    The share of the twins is what the reference takes longer with them than without.
    """
    for scene in (load("article").changed(seconds=10.0), load("gas-1000").changed(seconds=3.0, expect=())):
        names = list(compare(scene.changed(seconds=0.1, expect=())).runs)
        twins = partial(run_twins, scene, with_twins=True), partial(run_twins, scene, with_twins=False)
        acts = partial(compare, scene), partial(run_each, scene, names), *twins
        measured = alternately(
            rounds, *(partial(processor_time, act, repeats_in(act, SECONDS_PER_ROUND)) for act in acts)
        )
        name, means = f"{scene.name} {scene.seconds:g} s", f"{scene.name}, {scene.seconds:g} s: compare"
        yield figure(f"compare {name}", means, [ours for ours, *_ in measured], "s")
        ratios = [ours / engines for ours, engines, *_ in measured]
        yield figure(f"compare / engines {name}", f"{means} / its engines", ratios)
        ratios = [(with_twins - without) / ours for ours, _, with_twins, without in measured]
        yield figure(f"twins / compare {name}", f"{means}: share of twins", ratios)


def run_twins(scene: Scene, *, with_twins: bool) -> None:
    """Run the reference for the length of the scene, with or without its twins."""
    lockstep = Lockstep(scene, [REFERENCE])
    twins = Twins(lockstep, REFERENCE) if with_twins else None
    states = States.empty(scene.steps, len(scene.bodies))
    while (done := lockstep.steps) < scene.steps:
        count = lockstep.advance({lockstep.engines[REFERENCE]: states.rows(slice(done, None))})
        if twins:
            twins.follow(states.rows(slice(done, done + count)), np.arange(done + 1, done + count + 1) / scene.rate)


def run_each(scene: Scene, engines: Sequence[str]) -> None:
    """Run engines one after the other, for the length of the scene."""
    for name in engines:
        engine = create(name, scene, spawn(scene))
        for _ in range(scene.steps):
            engine.step()
