"""The outputs of a command: files that the user named, and standard output, which one of them may be."""

import os
import sys
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext, redirect_stdout
from pathlib import Path

from sandbox.errors import SandboxError
from sandbox.files import STANDARD_OUTPUT, written_file


def check_outputs(outputs: Mapping[str, str | None], read: Iterable[str | Path | None] = ()) -> None:
    """Check, before anything runs, that each output can be written. Raises SandboxError if one cannot.

    outputs: option -> its path. read: input files, which must not be overwritten.
    """
    taken: set[str | Path] = {Path(os.path.realpath(path)) for path in read if path and os.path.exists(path)}  # noqa: PTH110
    for option, path in outputs.items():
        if path is None:
            continue
        target = written_file(path)
        place = "-" if path in STANDARD_OUTPUT else target
        if place in taken:
            raise SandboxError(f"{option} {path}: is an input, or another output; choose another file")
        if place:
            taken.add(place)


def has_document(files: Iterable[str | None]) -> bool:
    """Return whether one of some outputs is standard output."""
    return not {*files}.isdisjoint(STANDARD_OUTPUT)


def printed_beside(files: Iterable[str | None]) -> AbstractContextManager[object]:
    """While engines run, send what their own code prints to standard error, if an output is standard output."""
    return redirect_stdout(sys.stderr) if has_document(files) else nullcontext()
