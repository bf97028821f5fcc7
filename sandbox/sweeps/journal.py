"""The rows of a sweep as they finish, in a file from which a sweep that was killed resumes.

Each line is a row, as JSON, and is synced to the disk before the next is written. The first line identifies the sweep.
A line that is torn or not a row is dropped with all that follow it when the file is opened; their jobs run again.
"""

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from sandbox.errors import SandboxError
from sandbox.files import is_replaceable, write_errors
from sandbox.sweeps.jobs import Row, Sweep, is_row, job_of


class Journal:
    """The rows so far. Without a file, they last as long as the sweep."""

    def __init__(self, rows: list[Row], file: IO[bytes] | None = None) -> None:
        self.rows = rows
        self._file = file

    def add(self, row: Row) -> None:
        """Save a row: when this returns, it is on the disk.

        Raises SandboxError if it cannot be written, or ran with another variant of pow than the rows before.
        """
        if self.rows and row["pow"] != self.rows[0]["pow"]:
            raise SandboxError(
                f"{job_of(row)}: ran where the C library's pow is the variant {row['pow']!r}, the rows before where it "
                f"is {self.rows[0]['pow']!r}, so results may differ; use processors of one kind, or another --out"
            )
        self.rows.append(row)
        if self._file:
            with write_errors(self._file.name):
                _append(self._file, row)


@contextmanager
def open_journal(sweep: Sweep, out: str) -> Iterator[Journal]:
    """Open the journal of a table, with the rows of a sweep that was stopped. Without any rows at the end, delete it.

    Raises SandboxError if it belongs to another sweep, or cannot be written.
    """
    if not is_replaceable(out):
        yield Journal([])
        return
    path = journal_path(out)
    with write_errors(path):
        file = path.open("a+b", buffering=0)
    with file:
        with write_errors(path):
            _lock(file, path)
            rows = _resume(file, path, sweep)
        try:
            yield Journal(rows, file)
        finally:
            file.close()
            if not rows:
                path.unlink(missing_ok=True)


def journal_path(out: str) -> Path:
    """Return the path of a table's journal."""
    return Path(f"{out}.journal")


def _resume(file: IO[bytes], path: Path, sweep: Sweep) -> list[Row]:
    file.seek(0)
    content, head = file.read(), _line(_head(sweep))
    if not content.startswith(head[: len(content)]):
        raise SandboxError(
            f"{path}: has rows of another scene or another version of it; move it away, or choose another --out"
        )
    rows, end = _whole_rows(content, len(head))
    file.truncate(end)
    if len(content) < len(head):
        _append(file, _head(sweep))
    return rows


def _whole_rows(content: bytes, begin: int) -> tuple[list[Row], int]:
    """Return the rows from a position up to the first that is torn or invalid, and the position of that one."""
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
    """Return what a row depends on but does not contain."""
    scene = sweep.scene.model_dump_json(exclude={"seed", "rate", "title", "about", "topic"})
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
    """Raise SandboxError if another sweep writes to the same file; Windows lacks this lock."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SandboxError(f"{path}: is in use by another sweep") from None
