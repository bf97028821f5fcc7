"""The file of the scene that is open, watched for what an editor saves into it."""

from pathlib import Path
from typing import Final

from sandbox.errors import MAX_TEXT_FILE_BYTES

EVERY: Final = 0.2  # s between two looks


class Watch:
    """Tells when a file says something else than it did. One that is missing or not to be read says what it said."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._stamp = self._look()
        self._said = self._read()

    def changed(self) -> bool:
        """Tell whether it has changed since the last call."""
        stamp = self._look()
        if stamp is None or stamp == self._stamp:
            return False
        said, before = self._read(), self._said
        self._stamp, self._said = stamp, said
        return said != before

    def _look(self) -> tuple[int, int, int] | None:
        try:
            seen = self.file.stat()
        except OSError:
            return None
        return seen.st_mtime_ns, seen.st_size, seen.st_ino

    def _read(self) -> bytes:
        try:
            with self.file.open("rb") as file:
                return file.read(MAX_TEXT_FILE_BYTES + 1)
        except OSError:
            return b""
