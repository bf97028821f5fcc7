"""Figures compared with those of an earlier benchmark."""

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sandbox.bench.figure import Figure
from sandbox.errors import SandboxError
from sandbox.files import read_text
from sandbox.text import printable


def read_figures(file: Path) -> dict[str, Figure]:
    """Read the JSON of an earlier benchmark, and return its figures by name. Raises SandboxError if it is not one."""
    text = read_text(file)
    try:
        return {figure.name: figure for figure in map(_figure, json.loads(text))}
    except (ValueError, TypeError, OverflowError, RecursionError):
        raise SandboxError(f"{printable(str(file))}: is not a file of sandbox bench --json") from None


def _figure(found: dict[str, Any]) -> Figure:
    """Return a figure that was read. Raises TypeError, ValueError or OverflowError if it is not one."""
    figure = Figure(**found)
    numbers = (figure.lowest, figure.median, figure.highest)
    if not (isinstance(figure.name, str) and all(map(math.isfinite, numbers)) and [*numbers] == sorted(numbers)):
        raise ValueError("neither a name nor a spread")
    return figure


def worse(figures: Iterable[Figure], earlier: Mapping[str, Figure]) -> list[Figure]:
    """Return the figures that are worse than earlier ones of the same name by more than the spread."""
    return [figure for figure in figures if figure.name in earlier and figure.is_worse_than(earlier[figure.name])]
