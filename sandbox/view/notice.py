"""A message to the user, which is shown in the status line for some seconds."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum, auto
from pathlib import Path
from time import monotonic
from typing import Final

from sandbox.errors import SandboxError

SECONDS_SHOWN: Final = 6.0


class Kind(Enum):
    """What a message is about, which its colour and its sign show."""

    HINT = auto()
    DONE = auto()
    ERROR = auto()


class Notice:
    """The latest message to the user: what was saved, what went wrong, or what to do."""

    def __init__(self) -> None:
        self.clear()

    @property
    def text(self) -> str:
        """The message, while it is shown; then nothing."""
        return self._text if monotonic() < self._until else ""

    def show(self, text: str, kind: Kind = Kind.HINT) -> None:
        """Show a message."""
        self.kind, self._text, self._until = kind, text, monotonic() + SECONDS_SHOWN

    def show_saved(self, file: str | Path, more: str = "") -> None:
        """Show that a file was saved, and in which folder."""
        path = Path(file).absolute()
        self.show(f"saved {path.name} in {path.parent}{more}", Kind.DONE)

    def clear(self) -> None:
        """Show nothing."""
        self.kind, self._text, self._until = Kind.HINT, "", 0.0

    def go_stale(self) -> None:
        """Show nothing that the user's next action answers: only what was saved stays."""
        if self.kind is not Kind.DONE:
            self.clear()

    @contextmanager
    def reporting(self) -> Iterator[None]:
        """Show the error that a block raises, and end the block."""
        try:
            yield
        except SandboxError as error:
            self.show(str(error), Kind.ERROR)
