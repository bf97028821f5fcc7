"""Time of whole programs, from start to end: with compiled engines in the cache, and with an empty cache."""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Final

from sandbox.bench.figure import Figure, figure

if sys.platform != "win32":
    import resource

SANDBOX: Final = (sys.executable, "-m", "sandbox")
FIRST_FRAME: Final = (sys.executable, "-c", "from sandbox.bench.window import first_frame; first_frame()")
MOVING_BALL: Final = (sys.executable, "-c", "from sandbox.bench.window import first_moving_ball; first_moving_ball()")
ENVIRONMENT: Final = {"SDL_VIDEODRIVER": "dummy"}
SHORT: Final = ("--seconds", "0.1")


def start(rounds: int) -> Iterator[Figure]:
    """Measure programs whose engines are compiled."""
    for name, means, command in (
        ("--help", "sandbox --help", (*SANDBOX, "--help")),
        ("--version", "sandbox --version", (*SANDBOX, "--version")),
        ("compare", "sandbox compare article --seconds 0.1", (*SANDBOX, "compare", "article", *SHORT)),
        ("window", "sandbox, until the first frame is drawn", FIRST_FRAME),
    ):
        run(command)  # compiles kernels that are not cached yet
        yield from _times(f"start {name}", means, [run(command) for _ in range(rounds)])


def cold(rounds: int) -> Iterator[Figure]:
    """Measure programs that have to compile their engines: each starts with an empty cache folder."""
    for engine in ("article", "impulse", "exact"):
        measured = [run_cold(simulation(engine)) for _ in range(rounds)]
        yield from _times(f"cold {engine}", f"{engine} alone", measured)
    for name, engines in (("pymunk,article", ("--engines", "pymunk,article")), ("compare", ())):
        command = (*SANDBOX, "compare", "article", *SHORT, *engines)
        means = " ".join(("compare article", *engines))
        yield from _times(f"cold {name}", means, [run_cold(command) for _ in range(rounds)])
    yield from _first_frames([frame_times_cold(MOVING_BALL) for _ in range(rounds)])


def simulation(engine: str) -> tuple[str, ...]:
    """Return a command that runs an engine alone. A program that uses the sandbox compiles it when it is called."""
    return sys.executable, "-c", f"import sandbox; sandbox.simulate(sandbox.load('article'), '{engine}', steps=6)"


def _times(name: str, means: str, measured: Sequence[tuple[float, float]]) -> Iterator[Figure]:
    """Yield the time that passed, and the processor time, which other programs on the machine disturb less."""
    yield figure(name, means, [passed for passed, _ in measured], "s")
    if sys.platform != "win32":
        yield figure(f"{name} processor", "  processor time", [processor for _, processor in measured], "s")


def _first_frames(measured: Sequence[Sequence[float]]) -> Iterator[Figure]:
    yield figure("cold first frame", "window: first frame", [times[0] for times in measured], "s")
    longest = [max(later - earlier for earlier, later in pairwise([0.0, *times])) for times in measured]
    yield figure("cold longest wait", "window: longest wait for a frame", longest, "s")
    yield figure("cold moving ball", "window: first frame with a moved ball", [t[-1] for t in measured], "s")


@contextmanager
def fresh_cache() -> Iterator[Mapping[str, str]]:
    """Yield an environment in which numba has compiled nothing yet."""
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        yield {"NUMBA_CACHE_DIR": folder}


def run(command: Sequence[str], environment: Mapping[str, str] = ENVIRONMENT) -> tuple[float, float]:
    """Run a program; return the time until its end, and the processor time of it and its own programs, s."""
    began, before = perf_counter(), _processor_time_of_programs()
    subprocess.run(command, env={**os.environ, **environment}, capture_output=True, check=True)
    return perf_counter() - began, _processor_time_of_programs() - before


def run_cold(command: Sequence[str]) -> tuple[float, float]:
    """Run a program with an empty cache."""
    with fresh_cache() as cache:
        return run(command, cache)


def _processor_time_of_programs() -> float:
    """Return the processor time of all programs that ran from here and have ended, s; Windows does not report it."""
    if sys.platform == "win32":
        return 0.0
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def frame_times_cold(command: Sequence[str]) -> list[float]:
    """Run a program with an empty cache that prints a line for each frame; return when each was drawn, s."""
    with fresh_cache() as cache:
        began = perf_counter()
        with subprocess.Popen(command, env={**os.environ, **ENVIRONMENT, **cache}, stdout=subprocess.PIPE) as program:
            times = [perf_counter() - began for _ in program.stdout or ()]
        if program.returncode:
            raise subprocess.CalledProcessError(program.returncode, command)
        return times
