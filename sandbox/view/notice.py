"""A message that takes the place of the status line for some seconds."""

from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Final

from sandbox.errors import SandboxError

SECONDS_SHOWN: Final = 5.0


class Notice:
    """The latest message to the user: what was saved, or what went wrong."""

    def __init__(self) -> None:
        self.clear()

    @property
    def text(self) -> str:
        """The message, while it is shown; then nothing."""
        return self._text if monotonic() < self._until else ""

    def show(self, text: str) -> None:
        """Show a message."""
        self._text, self._until = text, monotonic() + SECONDS_SHOWN

    def clear(self) -> None:
        """Show nothing."""
        self._text, self._until = "", 0.0

    @contextmanager
    def reporting(self) -> Iterator[None]:
        """Show the error that a block raises, and end the block."""
        try:
            yield
        except SandboxError as error:
            self.show(str(error))
