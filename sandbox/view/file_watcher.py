"""Watches the file of the open scene for what an editor saves into it."""

from pathlib import Path
from typing import Final

from sandbox.files import MAX_TEXT_FILE_BYTES

CHECK_INTERVAL: Final = 0.2  # s between two checks of the file


class FileWatcher:
    """Reports when a file's content changes. While the file is missing, it counts as unchanged."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._stamp = self._read_stamp()
        self._content = self._read()

    def changed(self) -> bool:
        """Return whether the content has changed since the last call."""
        stamp = self._read_stamp()
        if stamp is None or stamp == self._stamp:
            return False
        content, before = self._read(), self._content
        self._stamp, self._content = stamp, content
        return content != before

    def _read_stamp(self) -> tuple[int, int, int] | None:
        try:
            status = self.file.stat()
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size, status.st_ino

    def _read(self) -> bytes:
        try:
            with self.file.open("rb") as file:
                return file.read(MAX_TEXT_FILE_BYTES + 1)
        except OSError:
            return b""
