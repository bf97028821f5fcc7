"""Time of comparisons: beside their engines, and as whole programs whose engines are compiled and in the cache."""

import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from time import perf_counter
from typing import Final

from sandbox.analysis.comparison import compare
from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_of
from sandbox.engines import create
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn

SANDBOX: Final = (sys.executable, "-m", "sandbox")


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


def start(rounds: int) -> Iterator[Figure]:
    """Measure programs from start to end."""
    for name, arguments in (("--version", ("--version",)), ("compare", ("compare", "article", "--seconds", "0.1"))):
        command = (*SANDBOX, *arguments)
        run(command)  # compiles kernels that are not cached yet
        yield figure(f"start {name}", f"sandbox {' '.join(arguments)}", [run(command) for _ in range(rounds)], "s")


def run(command: Sequence[str]) -> float:
    """Run a program; return how long it took, s. Raises CalledProcessError if it fails."""
    began = perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    return perf_counter() - began
