"""Resident memory of programs. It is read from Linux; elsewhere nothing is measured."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from sandbox.bench.figure import Figure, figure

STATUS: Final = Path("/proc/self/status")  # sizes in kB of 1,024 bytes
PEAK: Final = "VmHWM"
PRESENT: Final = "VmRSS"
PROGRAMS: Final = (
    ("import", "import of a comparison: peak", "import sandbox.analysis.comparison"),
    (
        "compare gas-1000",
        "compare gas-1000: peak",
        "import sandbox; sandbox.compare(sandbox.load('gas-1000'))",
    ),
)
GAS_SIZES: Final = (1_000, 5_000)  # balls in the window


def memory(rounds: int) -> Iterator[Figure]:
    """Measure the peak of programs, and how much the window grows."""
    if not STATUS.exists():
        return
    for name, means, program in PROGRAMS:
        printing = f"{program}; from sandbox.bench.memory import PEAK, megabytes; print(megabytes(PEAK))"
        peaks = [size for _ in range(rounds) for size in _sizes(printing)]
        yield figure(f"memory {name}", means, peaks, "MB")
    for n in GAS_SIZES:
        sizes = _sizes(f"from sandbox.bench.window import print_growth; print_growth({n}, {rounds})")
        yield figure(f"memory window n={n}", f"window: growth / 1,000 frames, {n:,} balls", sizes, "MB")


def megabytes(field: str) -> float:
    """Return a size of this process, MB."""
    [size] = re.findall(rf"^{field}:\s*(\d+) kB$", STATUS.read_text(), re.MULTILINE)
    return int(size) * 1024 / 1e6


def _sizes(program: str) -> list[float]:
    """Run a program in Python, and return the sizes that it prints."""
    environment = os.environ | {"SDL_VIDEODRIVER": "dummy"}
    ran = subprocess.run([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, check=True)
    return [float(line) for line in ran.stdout.split()]
