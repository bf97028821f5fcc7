"""Kernels: functions that run as Python, or compiled by numba to machine code, with the same bits.

`kernel` marks one, and `compiled` returns its machine code, with all kernels that it calls inside. Python passes it
structured arrays; the same function as Python works on lists of objects, see `as_python`. Two traps: `a[i] = b[j]`
copies a record in one form only, so that kernels copy fields; and division by zero raises in Python only.

`sandbox.engines.machine_code` decides which of the two an engine runs. Without numba, everything runs as Python.

Never fastmath: every operation rounds as IEEE 754 prescribes.
"""

import hashlib
import os
from collections.abc import Callable
from dataclasses import make_dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from itertools import starmap
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Function = Callable[..., Any]  # numba ships no types
Records = Any  # a structured array or, as Python, a list of objects with the fields as attributes
Record = Any  # one of these; in a kernel, its fields are attributes
_unregistered: Final[list[Function]] = []  # kernels that numba does not know of yet


def kernel(function: Function) -> Function:
    """Let a function run as Python and, inside others, as machine code."""
    _unregistered.append(function)
    return function


@cache
def _options() -> dict[str, Any]:
    """Return how numba compiles: dividing by zero as numpy does, and not counting references, which takes time."""
    from numba import njit  # noqa: PLC0415  (it takes longer to import than all else together)

    try:
        njit(_nrt=False)(lambda: None)()  # type: ignore[call-overload]
    except KeyError:  # a numba without this private option
        return {"error_model": "numpy"}
    return {"error_model": "numpy", "_nrt": False}


@cache
def compiled(function: Function) -> Function:
    """Return a kernel as machine code, which is compiled or loaded from the cache at its first call."""
    numba, extending = import_module("numba"), import_module("numba.extending")

    while _unregistered:  # inlined: each call of machine code would copy a World
        extending.register_jitable(**_options(), forceinline=True)(_unregistered.pop())
    config: Any = numba.config
    before, config.CACHE_DIR = config.CACHE_DIR, str(cache_folder())
    try:
        machine_code: Function = numba.njit(**_options(), cache=True, nogil=True)(function)
        return machine_code
    finally:
        config.CACHE_DIR = before


def as_python(data: Any) -> Any:
    """Return structured arrays, also in (nested) named tuples, as lists of objects with slots, and others as lists."""
    if isinstance(data, np.ndarray):
        values = data.tolist()
        return list(starmap(_row(data.dtype.names), values)) if data.dtype.names else values
    return data._make(map(as_python, data)) if hasattr(data, "_make") else data


def write_back(rows: Any, data: Any) -> None:
    """Copy what `as_python` returned, and kernels have changed, into the arrays that it was made from."""
    if hasattr(data, "_make"):
        for part, array in zip(rows, data, strict=True):
            write_back(part, array)
    elif isinstance(data, np.ndarray):
        for name in data.dtype.names or ():
            data[name] = list(map(attrgetter(name), rows))
        if not data.dtype.names:
            data[...] = rows


def column(records: Records, name: str) -> NDArray[Any]:
    """Return a field of all records, in either form: (n,)."""
    values: NDArray[Any] = columns(records, name)[0]
    return values


def columns(records: Records, *names: str) -> NDArray[Any]:
    """Return several fields of one type of all records, in either form: (len(names), n)."""
    if isinstance(records, np.ndarray):
        fields = records.view(np.ndarray)  # a recarray finds its fields in twice the time
        return np.array([fields[name] for name in names])
    return np.array(list(map(attrgetter(*names), records))).reshape(-1, len(names)).T


@cache
def _row(names: tuple[str, ...]) -> Any:
    return make_dataclass("Row", names, slots=True, eq=False)


@cache
def has_numba() -> bool:
    """Return whether numba is installed, and may compile."""
    return find_spec("numba") is not None and os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")


@cache
def cache_folder() -> Path:
    """Return the folder of machine code from these sources, which need not exist: numba itself checks one file only."""
    package = Path(__file__).parent
    sources = hashlib.sha256(f"{version('numba')} {np.__version__}".encode())
    for file in (*sorted(package.glob("*.py")), *sorted(package.glob("engines/**/*.py")), package / "scene/walls.py"):
        sources.update(file.read_bytes())
    return Path(os.environ.get("NUMBA_CACHE_DIR") or package / "__pycache__") / f"kernels-{sources.hexdigest()[:12]}"
