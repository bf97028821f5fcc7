"""Files that the user names: text is read up to a limit, and a file is written whole or not at all.

`-` and /dev/stdout are standard output. Devices and pipes cannot be replaced and are written to directly. A link stays;
the file it points to is replaced.
"""

import os
import shutil
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex
from typing import IO, Final

from sandbox.errors import SandboxError
from sandbox.text import printable

MAX_TEXT_FILE_BYTES: Final = 2_000_000  # room for 20,000 balls, each in a group of its own
STANDARD_OUTPUT: Final = ("-", "/dev/stdout")


def read_text(file: Path, max_bytes: int = MAX_TEXT_FILE_BYTES) -> str:
    """Read a UTF-8 file that the user named. Raises SandboxError if it is unreadable, too large or not UTF-8."""
    name = printable(str(file))
    try:
        with file.open("rb") as opened:
            raw = opened.read(max_bytes + 1)
        if len(raw) > max_bytes:
            raise SandboxError(f"{name}: is larger than {max_bytes:,} bytes")
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise SandboxError(f"{name}:{line}: is not UTF-8 text: byte {raw[error.start]:#04x}") from None
    except OSError as error:
        raise SandboxError(f"{name}: cannot be read: {error.strerror}") from None


@contextmanager
def write_errors(path: str | Path) -> Iterator[None]:
    """Turn a failed write into a SandboxError that names the file; a closed pipe stays a BrokenPipeError."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise SandboxError(f"{path}: cannot be written: {error.strerror or error}") from None


@contextmanager
def whole_file(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file for an atomic write: it replaces the old one only once it is complete.

    Raises SandboxError if it cannot be written.
    """
    with write_errors(path):
        if target := _file_behind(path):
            with _partial_of(target) as (partial, file):
                yield file
                file.flush()
                os.fsync(file.fileno())  # or a power failure could leave the new name with an empty file
                if target.exists():
                    shutil.copymode(target, partial)
                file.close()
                partial.replace(target)
        elif str(path) not in STANDARD_OUTPUT:
            with Path(path).open("wb") as file:
                yield file
        else:
            yield sys.stdout.buffer
            sys.stdout.buffer.flush()


def write_text(path: str | Path, text: str) -> None:
    """Write a whole file of UTF-8 text. Raises SandboxError if it cannot be written."""
    with whole_file(path) as file:
        file.write(text.encode())


def written_file(path: str) -> Path | None:
    """Return the file that is written at a path; None for standard output, a device or a pipe.

    Raises SandboxError if it cannot be written.
    """
    with write_errors(path or "''"):
        if target := _file_behind(path):
            with _partial_of(target):
                pass
    return target


def _file_behind(path: str | Path) -> Path | None:
    """Return the file that a path leads to through links; None for standard output, a device or a pipe.

    Raises OSError if the file exists and cannot be written.
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
def _partial_of(target: Path) -> Iterator[tuple[Path, IO[bytes]]]:
    """Open a temporary file beside the target, under a random name. Only a killed process leaves it behind."""
    partial = target.with_name(f".{target.name[:40]}.{token_hex(8)}.partial")  # a name has at most 255 bytes
    try:
        with partial.open("xb") as file:
            yield partial, file
    finally:
        partial.unlink(missing_ok=True)
