"""Files are written whole or not at all; `-`, or /dev/stdout, is standard output.

What cannot be replaced, a device or a pipe, is written to as it is. A link stays, and the file behind it is replaced.
"""

import os
import shutil
import stat
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex
from typing import IO, Final

from sandbox.errors import NOBODY_READS, Ended, SandboxError

STANDARD_OUTPUT: Final = ("-", "/dev/stdout")


@contextmanager
def telling(path: str | Path) -> Iterator[None]:
    """Turn a failed write into a SandboxError that names the file, and a closed pipe into Ended."""
    try:
        yield
    except BrokenPipeError:
        raise Ended(NOBODY_READS) from None
    except OSError as error:
        raise SandboxError(f"{path}: cannot be written: {error.strerror or error}") from None


@contextmanager
def whole_file(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file to write that takes its place only when all of it is there.

    Raises SandboxError where it cannot be written.
    """
    with telling(path):
        if target := _file_behind(path):
            with _replacing(target) as file:
                yield file
        elif str(path) not in STANDARD_OUTPUT:
            with Path(path).open("wb") as file:
                yield file
        elif sys.stdout is None:
            raise OSError("it is closed")
        else:
            yield sys.stdout.buffer
            sys.stdout.buffer.flush()


def is_file(path: str | Path) -> bool:
    """Return whether a path is a regular file or may become one. Raises SandboxError if it cannot be written."""
    with telling(path):
        return _file_behind(path) is not None


def check_outputs(outputs: Mapping[str, str | None], read: Iterable[str | Path | None] = ()) -> None:
    """Find what cannot be written before anything runs: options, and the paths that they were given.

    read: what is read, and so must not be written over. Raises SandboxError.
    """
    sources = {Path(os.path.realpath(path)) for path in read if path and os.path.exists(path)}  # noqa: PTH110  (as in `load`)
    taken: dict[str | Path | None, str] = {}  # what only one of them can write to -> the option and its path
    for option, path in outputs.items():
        if path is None:
            continue
        if not path:
            raise SandboxError(f"{option} '': must be the name of a file, or - for standard output")
        with telling(path):
            target = _file_behind(path)
        place = "-" if path in STANDARD_OUTPUT else target
        if place in sources:
            raise SandboxError(f"{option} {path}: is what is read here; give another file")
        if place in taken:
            raise SandboxError(f"{taken[place]} and {option} {path}: each must be a file of its own")
        if place is not None:
            taken[place] = f"{option} {path}"
        if target:
            with telling(path), _partial_of(target):
                pass


def _file_behind(path: str | Path) -> Path | None:
    """Return the file that a path means, behind links; None for standard output, a device or a pipe.

    Raises OSError where the file is there and cannot be written.
    """
    if str(path) in STANDARD_OUTPUT:
        return None
    target = Path(os.path.realpath(path))
    try:
        mode = Path(path).stat().st_mode
    except FileNotFoundError:
        return target
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        return None
    target.open("r+b").close()
    return target


@contextmanager
def _replacing(target: Path) -> Iterator[IO[bytes]]:
    with _partial_of(target) as (partial, file):
        yield file
        file.flush()
        os.fsync(file.fileno())  # or the new name may be on the disk before what it names, and power fail between
        if target.exists():
            shutil.copymode(target, partial)
        file.close()
        partial.replace(target)


@contextmanager
def _partial_of(target: Path) -> Iterator[tuple[Path, IO[bytes]]]:
    """Open a file beside another, of a name that no other program has; only a kill leaves it."""
    partial = target.with_name(f".{target.name[:40]}.{token_hex(8)}.partial")  # names have 255 bytes, letters up to 4
    try:
        with partial.open("xb") as file:
            yield partial, file
    finally:
        partial.unlink(missing_ok=True)
