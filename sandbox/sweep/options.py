"""What the command line says of a sweep."""

import os
import re
from collections.abc import Sequence

from sandbox.errors import SandboxError


def seeds_of(text: str) -> range:
    """Read "A:B": from A up to, and without, B.

    >>> list(seeds_of("3:6"))
    [3, 4, 5]
    """
    ends = re.fullmatch(r"(\d{1,18}):(\d{1,18})", text)
    if not ends or int(ends[1]) >= int(ends[2]):
        raise SandboxError(f"--seeds {text}: must be two numbers A:B, the seeds from A up to, and without, B")
    return range(int(ends[1]), int(ends[2]))


def rates_of(text: str) -> list[int]:
    """Read "60,240"."""
    if not re.fullmatch(r"\d{1,9}(,\d{1,9})*", text):
        raise SandboxError(f"--rates {text}: must be whole numbers with commas between them, such as 60,240")
    return [int(rate) for rate in text.split(",")]


def settings_of(texts: Sequence[str]) -> dict[str, list[float]]:
    """Read settings of Pymunk, each with its values.

    >>> settings_of(["substeps=1,4", "collision_bias=0.5"])
    {'substeps': [1, 4], 'collision_bias': [0.5]}
    """
    found: dict[str, list[float]] = {}
    for text in texts:
        key, _, values = text.partition("=")
        try:
            numbers: list[float] = [int(value) if value.isdecimal() else float(value) for value in values.split(",")]
        except ValueError:
            raise SandboxError(
                f"--set {text}: must be a setting of Pymunk and its values, such as substeps=1,4"
            ) from None
        if key in found:
            raise SandboxError(f"--set {text}: {key} is set twice; write all of its values with commas between them")
        found[key] = numbers
    return found


def cores() -> int:
    """Return how many processes can run at once."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
