"""Time of a comparison and of a sweep."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Final

import numpy as np

from sandbox.analysis.comparison import compare
from sandbox.analysis.reference import REFERENCE, Twins
from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_in
from sandbox.bench.plain import plain_space
from sandbox.engines import create
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import States
from sandbox.sweeps import Sweep, plan
from sandbox.sweeps.jobs import reference_job, run_job, run_shared
from sandbox.sweeps.workers import groups

SECONDS_PER_ROUND: Final = 0.5  # at least, for which each side of a ratio is measured
SWEPT_SEEDS: Final = 25  # in a round
SWEPT_SETTINGS: Final = {"substeps": (1, 2), "iterations": (5, 10, 20)}


def comparison(rounds: int) -> Iterator[Figure]:
    """Measure `compare`: alone, relative to its engines run alone, and to a plain Pymunk loop of as many steps.

    The share of the twins is what the reference takes longer with them than without.
    """
    gas = load("gas-1000")
    for scene in (load("article").changed(seconds=10.0), gas.changed(seconds=3.0, expect=()), gas):
        names = list(compare(scene.changed(seconds=0.1, expect=())).runs)
        runs = partial(run_each, scene, names), partial(run_plain, scene)
        twins = partial(run_twins, scene, with_twins=True), partial(run_twins, scene, with_twins=False)
        acts = partial(compare, scene), *runs, *twins
        measured = alternately(
            rounds, *(partial(processor_time, act, repeats_in(act, SECONDS_PER_ROUND)) for act in acts)
        )
        name, means = f"{scene.name} {scene.seconds:g} s", f"{scene.name}, {scene.seconds:g} s: compare"
        yield figure(f"compare {name}", means, [ours for ours, *_ in measured], "s")
        ratios = [ours / engines for ours, engines, *_ in measured]
        yield figure(f"compare / engines {name}", f"{means} / its engines", ratios)
        ratios = [ours / plain for ours, _, plain, *_ in measured]
        yield figure(f"compare / plain {name}", f"{means} / plain Pymunk", ratios)
        ratios = [(with_twins - without) / ours for ours, _, _, with_twins, without in measured]
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


def run_plain(scene: Scene) -> None:
    """Run a plain Pymunk loop for the length of the scene."""
    space = plain_space(scene)
    for _ in range(scene.steps):
        space.step(1 / scene.rate)


def sweep(rounds: int) -> Iterator[Figure]:
    """Measure a sweep in this process: alone, and relative to a plain Pymunk loop of as many steps for each row.

    Each round has seeds of its own, so that nothing that an earlier round has computed can be used again.
    """
    run_jobs(_sweep_of([0]))  # loads the engines
    sweeps = [_sweep_of(range(k * SWEPT_SEEDS + 1, (k + 1) * SWEPT_SEEDS + 1)) for k in range(rounds)]
    measured = [
        (processor_time(partial(run_jobs, one)), processor_time(partial(run_plain_jobs, one))) for one in sweeps
    ]
    rows = f"{len(sweeps[0].jobs)} rows"
    yield figure("sweep", f"{rows}: sweep", [ours for ours, _ in measured], "s")
    yield figure("sweep / plain", f"{rows}: sweep / plain Pymunk loops", [ours / plain for ours, plain in measured])


def _sweep_of(seeds: Sequence[int]) -> Sweep:
    scene = load("article").changed(seconds=2.0)
    return plan(scene, seeds, [scene.rate], ["pymunk", "article", "impulse"], SWEPT_SETTINGS)


def run_jobs(sweep: Sweep) -> None:
    """Run the jobs of a sweep one after the other, as a worker does."""
    for group in groups(sweep, sweep.jobs):
        reference = run_shared(sweep.scene, reference_job(sweep.against, group[0]))
        for job in group:
            run_job(sweep.scene, sweep.against, job, reference)


def run_plain_jobs(sweep: Sweep) -> None:
    """Run a plain Pymunk loop for each job of a sweep."""
    for job in sweep.jobs:
        run_plain(sweep.scene.changed(seed=job.seed))
