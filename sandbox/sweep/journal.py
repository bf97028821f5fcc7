"""The rows of a sweep as they come, in a file that outlives a sweep which is killed.

A line is one row, as JSON, and on the disk before the next one is begun. The first line says what the rows are of.
What is torn, or no row, is dropped with all that follows when the file is opened again, and is run again.
"""

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from sandbox.errors import SandboxError
from sandbox.files import is_file, write_errors
from sandbox.sweep.jobs import Row, Sweep, is_row


class Journal:
    """Rows that are kept. Without a file, only as long as the sweep runs."""

    def __init__(self, rows: list[Row], file: IO[bytes] | None = None) -> None:
        self.rows = rows
        self._file = file

    def add(self, row: Row) -> None:
        """Keep a row: when this returns, it is on the disk. Raises SandboxError where there is no room for it."""
        self.rows.append(row)
        if self._file:
            with write_errors(self._file.name):
                _append(self._file, row)


@contextmanager
def journal(sweep: Sweep, out: str) -> Iterator[Journal]:
    """Open the journal of a table, with the rows that it has from a sweep that was stopped.

    Raises SandboxError where it is another sweep's, or cannot be written.
    """
    if not is_file(out):
        yield Journal([])
        return
    path = journal_of(out)
    with write_errors(path):
        file = path.open("a+b", buffering=0)
    with file:
        with write_errors(path):
            _lock(file, path)
            rows = _resume(file, path, sweep)
        yield Journal(rows, file)


def journal_of(out: str) -> Path:
    """Name the journal of a table: it stands beside it."""
    return Path(f"{out}.journal")


def _resume(file: IO[bytes], path: Path, sweep: Sweep) -> list[Row]:
    file.seek(0)
    content, head = file.read(), _line(_head(sweep))
    if not content.startswith(head[: len(content)]):
        raise SandboxError(
            f"{path}: has rows of another scene, or of another time; move it away, or give another --out"
        )
    rows, end = _whole_rows(content, len(head))
    file.truncate(end)
    if len(content) < len(head):
        _append(file, _head(sweep))
    return rows


def _whole_rows(content: bytes, begin: int) -> tuple[list[Row], int]:
    """Return the rows from a place on up to the first that is torn or none, and where that one begins."""
    if len(content) < begin:
        return [], 0
    rows, end = [], begin
    for line in content[begin:].splitlines(keepends=True):
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):
            break
        if not line.endswith(b"\n") or not is_row(row):
            break
        rows.append(row)
        end += len(line)
    return rows, end


def _head(sweep: Sweep) -> dict[str, Any]:
    """Tell what a row depends on that it does not name."""
    scene = sweep.scene.model_dump_json(exclude={"seed", "rate", "title", "about"})
    return {
        "scene": sweep.scene.name,
        "sha256": hashlib.sha256(scene.encode()).hexdigest(),
        "against": sweep.against,
    }


def _line(document: dict[str, Any]) -> bytes:
    return json.dumps(document).encode() + b"\n"


def _append(file: IO[bytes], document: dict[str, Any]) -> None:
    line = memoryview(_line(document))
    while line:
        line = line[file.write(line) :]
    os.fsync(file.fileno())


def _lock(file: IO[bytes], path: Path) -> None:
    """See that no other sweep writes to the same file, where the system can tell."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SandboxError(f"{path}: another sweep is at work on it") from None
