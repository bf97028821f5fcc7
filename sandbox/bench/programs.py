"""Time and memory of whole programs, with compiled engines in the cache, and with an empty cache."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Final

from sandbox.bench.figure import Figure, figure

STATUS: Final = Path("/proc/self/status")  # sizes in kB of 1,024 bytes; only Linux has it
PEAK: Final = "VmHWM"
PRESENT: Final = "VmRSS"
GAS_SIZES: Final = (1_000, 5_000)  # balls in the window, whose growth is measured

SANDBOX: Final = (sys.executable, "-m", "sandbox")
COMPARE: Final = ("compare", "article", "--seconds", "0.1")
MOVING_BALL: Final = (sys.executable, "-c", "from sandbox.bench.window import first_moving_ball; first_moving_ball()")
ENVIRONMENT: Final = {"SDL_VIDEODRIVER": "dummy"}


def start(rounds: int) -> Iterator[Figure]:
    """Measure programs whose engines are compiled, from start to end."""
    for name, means, command in (
        ("--version", "sandbox --version", (*SANDBOX, "--version")),
        ("compare", f"sandbox {' '.join(COMPARE)}", (*SANDBOX, *COMPARE)),
        ("window", "sandbox, until a ball has moved", MOVING_BALL),
    ):
        run(command)  # compiles kernels that are not cached yet
        yield figure(f"start {name}", means, [run(command)[-1] for _ in range(rounds)], "s")


def cold(rounds: int) -> Iterator[Figure]:
    """Measure programs that have to compile their engines: each starts with an empty cache folder."""
    yield figure("cold exact", "exact alone", [run_cold(simulation("exact"))[-1] for _ in range(rounds)], "s")
    yield figure("cold compare", "compare article", [run_cold((*SANDBOX, *COMPARE))[-1] for _ in range(rounds)], "s")
    frames = [run_cold(MOVING_BALL)[:-1] for _ in range(rounds)]
    longest = [max(later - earlier for earlier, later in pairwise([0.0, *times])) for times in frames]
    yield figure("cold longest wait", "window: longest wait for a frame", longest, "s")
    yield figure("cold moving ball", "window: first frame with a moved ball", [times[-1] for times in frames], "s")


def simulation(engine: str) -> tuple[str, ...]:
    """Return a command that runs an engine alone. A program that uses the sandbox compiles it when it is called."""
    return sys.executable, "-c", f"import sandbox; sandbox.simulate(sandbox.load('article'), '{engine}', steps=6)"


def run(command: Sequence[str], **environment: str) -> list[float]:
    """Run a program; return when it printed each line, and when it ended: s since its start."""
    variables, began = {**os.environ, **ENVIRONMENT, **environment}, perf_counter()
    with subprocess.Popen(command, env=variables, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as program:
        times = [perf_counter() - began for _ in program.stdout or ()]
    if program.returncode:
        raise subprocess.CalledProcessError(program.returncode, command)
    return [*times, perf_counter() - began]


def run_cold(command: Sequence[str]) -> list[float]:
    """Run a program as `run` does, with an empty cache."""
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        return run(command, NUMBA_CACHE_DIR=folder)


def memory(rounds: int) -> Iterator[Figure]:
    """Measure the peak of a comparison, and how much the window grows."""
    if not STATUS.exists():
        return
    program = "import sandbox; sandbox.compare(sandbox.load('gas-1000'))"
    printing = f"{program}; from sandbox.bench.programs import PEAK, megabytes; print(megabytes(PEAK))"
    peaks = [size for _ in range(rounds) for size in _sizes(printing)]
    yield figure("memory compare gas-1000", "compare gas-1000: peak", peaks, "MB")
    for n in GAS_SIZES:
        sizes = _sizes(f"from sandbox.bench.window import print_growth; print_growth({n}, {rounds})")
        yield figure(f"memory window n={n}", f"window: growth / 1,000 frames, {n:,} balls", sizes, "MB")


def megabytes(field: str) -> float:
    """Return a size of this process, MB."""
    [size] = re.findall(rf"^{field}:\s*(\d+) kB$", STATUS.read_text(), re.MULTILINE)
    return int(size) * 1024 / 1e6


def _sizes(program: str) -> list[float]:
    """Run a program in Python, and return the sizes that it prints."""
    environment = os.environ | ENVIRONMENT
    ran = subprocess.run([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, check=True)
    return [float(line) for line in ran.stdout.split()]
