"""The rows of a sweep as they come, in a file that outlives a sweep which is killed.

A line is one row, as JSON, and on the disk before the next one is begun. The first line says what the rows are of.
What is torn at the end is dropped when the file is opened again, and is run again.
"""

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from sandbox.mistakes import Mistake
from sandbox.output import is_file, telling
from sandbox.sweep.jobs import Row, Sweep


class Journal:
    """Rows that are kept. Without a file, only as long as the sweep runs."""

    def __init__(self, rows: list[Row], file: IO[bytes] | None = None) -> None:
        self.rows = rows
        self._file = file

    def add(self, row: Row) -> None:
        """Keep a row: when this returns, it is on the disk. Raises Mistake where there is no room for it."""
        self.rows.append(row)
        if self._file:
            with telling(self._file.name):
                _append(self._file, row)


@contextmanager
def journal(sweep: Sweep, out: str) -> Iterator[Journal]:
    """Open the journal of a table, with the rows that it has from a sweep that was stopped.

    Raises Mistake where it is another sweep's, or cannot be written.
    """
    if not is_file(out):
        yield Journal([])
        return
    path = journal_of(out)
    with telling(path):
        file = path.open("a+b", buffering=0)
    with file:
        with telling(path):
            _lock(file, path)
            rows = _resume(file, path, sweep)
        yield Journal(rows, file)


def journal_of(out: str) -> Path:
    """Name the journal of a table: it stands beside it."""
    return Path(f"{out}.journal")


def _resume(file: IO[bytes], path: Path, sweep: Sweep) -> list[Row]:
    file.seek(0)
    content = file.read()
    documents, end = _whole_lines(content)
    if documents[:1] != [_head(sweep)] and b"\n" in content:
        raise Mistake(f"{path}: has rows of another scene, or of another time; move it away, or give another --out")
    file.truncate(end)
    if not documents:
        _append(file, _head(sweep))
    return documents[1:]


def _whole_lines(content: bytes) -> tuple[list[Any], int]:
    """Return what the lines hold up to the first that is torn, and where that one begins."""
    documents, end = [], 0
    for line in content.splitlines(keepends=True):
        try:
            documents.append(json.loads(line))
        except ValueError:
            break
        if not line.endswith(b"\n"):
            documents.pop()
            break
        end += len(line)
    return documents, end


def _head(sweep: Sweep) -> dict[str, Any]:
    """Tell what a row depends on that it does not name."""
    scene = sweep.scene.model_dump_json(exclude={"seed", "rate", "title", "about"})
    return {
        "scene": sweep.scene.name,
        "sha256": hashlib.sha256(scene.encode()).hexdigest(),
        "against": sweep.against,
    }


def _append(file: IO[bytes], document: dict[str, Any]) -> None:
    line = memoryview(json.dumps(document).encode() + b"\n")
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
        raise Mistake(f"{path}: another sweep is at work on it") from None
