"""Time of a comparison, and start-up time of the programs."""

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from time import perf_counter

from sandbox.analysis.comparison import compare
from sandbox.bench.figure import ROUNDS, Figure, alternately, figure, processor_time
from sandbox.engines import create
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn


def comparison() -> Iterator[Figure]:
    """Measure `compare` relative to its engines run alone."""
    for scene in (load("article").changed(seconds=10.0), load("gas-1000").changed(seconds=3.0, expect=())):
        names = list(compare(scene).runs)
        together = partial(processor_time, partial(compare, scene, names))
        alone = partial(processor_time, partial(run_each, scene, names))
        means = f"{scene.name}: compare / sum of its engines"
        yield figure(f"compare {scene.name}", means, [a / b for a, b in alternately(together, alone)])


def run_each(scene: Scene, engines: Sequence[str]) -> None:
    """Run engines one after the other, for the length of the scene."""
    for name in engines:
        engine = create(name, scene, spawn(scene))
        for _ in range(scene.steps):
            engine.step()


def start() -> Iterator[Figure]:
    """Measure processes from start to end, in wall-clock time."""
    sandbox = [sys.executable, "-m", "sandbox"]
    window = [sys.executable, "-c", "from sandbox.bench.window import first_frame; first_frame()"]
    for name, means, command in (
        ("--help", "sandbox --help", [*sandbox, "--help"]),
        ("compare", "sandbox compare article --seconds 0.1", [*sandbox, "compare", "article", "--seconds", "0.1"]),
        ("window", "sandbox, until the first frame is drawn", window),
    ):
        _run(command)  # compiles kernels that are not cached yet
        yield figure(f"start {name}", means, [_run(command) for _ in range(ROUNDS)], "s")


def _run(command: list[str]) -> float:
    began = perf_counter()
    subprocess.run(command, env=os.environ | {"SDL_VIDEODRIVER": "dummy"}, capture_output=True, check=True)
    return perf_counter() - began
