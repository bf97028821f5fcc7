"""Time of comparisons, beside that of their engines."""

from collections.abc import Iterator, Sequence
from functools import partial

from sandbox.analysis.comparison import compare
from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_of
from sandbox.engines import create
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn


def comparison(rounds: int) -> Iterator[Figure]:
    """Measure `compare` relative to its engines run alone."""
    for scene in (load("article").changed(seconds=10.0), load("gas-1000").changed(seconds=1.0, expect=())):
        names = list(compare(scene.changed(seconds=0.1, expect=())).runs)
        acts = partial(compare, scene), partial(run_each, scene, names)
        measured = alternately(rounds, *(partial(processor_time, act, repeats_of(act)) for act in acts))
        means = f"{scene.name}, {scene.seconds:g} s: compare / its engines"
        ratios = [ours / engines for ours, engines in measured]
        yield figure(f"compare / engines {scene.name} {scene.seconds:g} s", means, ratios)


def run_each(scene: Scene, engines: Sequence[str]) -> None:
    """Run engines one after the other, for the length of the scene."""
    for name in engines:
        engine = create(name, scene, spawn(scene))
        for _ in range(scene.steps):
            engine.step()
