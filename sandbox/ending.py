"""How a command ends: at a mistake, a signal, a pipe that nobody reads. What it has begun is undone first."""

import io
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Final, TextIO

from sandbox.mistakes import Mistake
from sandbox.output import Ended, telling

SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def ending() -> Iterator[None]:
    """End the program as what happens within says: exit code 2 and one message at a mistake, by a signal at a signal.

    A shell tells the latter as 128 + its number: 130 for Ctrl-C, 143 for SIGTERM, 141 for a closed pipe.
    """
    sys.stderr = Stream(sys.stderr) if sys.stderr else Path(os.devnull).open("w")  # noqa: SIM115 (until the end)
    if sys.stdout:
        sys.stdout = Stream(sys.stdout)
    for each in SIGNALS:
        if signal.getsignal(each) != signal.SIG_IGN:  # as nohup has it
            signal.signal(each, _end)
    try:
        try:
            yield
        finally:
            if sys.stdout:
                sys.stdout.flush()
    except Mistake as mistake:
        print(mistake, file=sys.stderr)
        sys.exit(2)
    except Ended as end:
        number = end.number
    else:
        return
    signal.signal(number, signal.SIG_DFL)
    signal.raise_signal(number)


def _end(number: int, _frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)  # who asks twice does not want to wait
    raise Ended(number)


class Stream(io.TextIOWrapper):
    """Standard output or error that says what is wrong with it, once; then it takes everything, and keeps nothing."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__(
            stream.buffer, encoding=stream.encoding, errors="replace", line_buffering=bool(stream.line_buffering)
        )

    def write(self, text: str) -> int:
        """Write text. Raises Mistake, or Ended."""
        with self._telling():
            return super().write(text)

    def flush(self) -> None:
        """Write what is held back. Raises Mistake, or Ended."""
        with self._telling():
            super().flush()

    @contextmanager
    def _telling(self) -> Iterator[None]:
        try:
            with telling("standard output" if self.fileno() == 1 else "standard error"):
                yield
        except (Mistake, Ended):
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            raise
